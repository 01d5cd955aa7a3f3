"""Assembly of a joint graph to a mechanism: loops closed, geometry repaired, away from singular zero configurations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...budgets import LOOP_COORDINATES_MAX
from ...errors import BadMechanism, BadRequest, LoopClosureFailure
from ...geometry.vectors import Array, normalise_vector
from ...mechanism.model import FIRST, GIVEN, NAMED, Coupling, Joint, JointType, Mechanism, Note, PlatformChoice
from ...tolerances import (
    GEOMETRY_DIFFERENCE_TOL,
    INCIDENCE_TOL,
    ROUNDED_INCIDENCE_FRACTION,
    TOLERANCE_AMBIGUITY_FRACTION,
)
from ..jointgraph import JointGraph, JointSpec, join_names
from ..jointmotion import propose_closure_fix
from ..keyframes import STAY, find_keyframe
from ..numerals import Digits
from ..observation_text import add_file_observations
from ..overrides import Overrides
from ..tree import build_spanning_mechanism
from . import assumptions, closures
from .candidates import without_loop
from .coordinates import with_weighed_motors, without_coordinates
from .geometry_repair import snap_geometry
from .loops import LoopAssembly, LoopSolution, Values, regular_values, solve
from .zero_configuration import moves, with_offsets, with_zero_at

POSTURE = "Start from a keyframe that nearly closes them: --keyframe NAME, or FILE.srdf:NAME."


def build(graph: JointGraph, overrides: Overrides) -> Mechanism:
    """Return the mechanism of a foreign file with its overrides.

    Raises
    ------
    BadRequest
        For unknown names and a missing platform.
    LoopClosureFailure, UndecidedRank
        For loops that stay open, or whose rank is undecided due to rounding.
    """
    closures.join_halves(graph, overrides.named)
    overrides.apply(graph)
    closures.merge_points(graph)
    base = assumptions.standing(graph, graph.base or assumptions.base(graph), overrides.base, overrides.platform)
    graph.prune(base)
    for role, link in (("base", overrides.base), ("platform", overrides.platform)):
        if link is not None and link not in graph.links:
            raise BadRequest(f"{graph.file}: no such {role} link", link, join_names(graph.links, like=link))
    if open_chain := without_loop(graph, base):
        graph.note("open", open_chain)
    graph.formation = graph.formation and overrides.platform is None
    platform, choice = _platform(graph, overrides, base)
    if platform == base and overrides.base is None:
        raise BadRequest(f"{graph.file}: the platform is the base", platform, "another link")
    start = None if overrides.keyframe is None else graph.in_metres(find_keyframe(graph, overrides.keyframe))
    assembly = LoopAssembly(base, list(graph.joints.values()), graph.gears, start)
    if assembly.size > LOOP_COORDINATES_MAX or len(assembly.loops) > LOOP_COORDINATES_MAX:
        raise BadRequest(
            f"{graph.file}: too many loops",
            f"{len(assembly.loops)} loops through joints with {assembly.size} coordinates",
            f"up to {LOOP_COORDINATES_MAX} of each",
        )
    open_at_zero = assembly.worst(assembly.zero())[1]
    length = assembly.length / graph.unit
    rounded = 0.0 if overrides.as_written else overrides.tolerance or rounding(graph.digits, length, open_at_zero)
    tolerance = overrides.tolerance or max(INCIDENCE_TOL, rounded)
    assembly.noise = max(INCIDENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION * rounded)
    if open_at_zero <= TOLERANCE_AMBIGUITY_FRACTION * rounded:
        solution = LoopSolution(assembly.zero(), open_at_zero)
    else:
        solution = solve(assembly)
    if not solution.residual <= assembly.noise:
        raise LoopClosureFailure(
            graph.file,
            solution.residual,
            assembly.noise,
            assembly.worst(solution.values)[0],
            propose_closure_fix(solution.residual) or POSTURE,
        )
    _note_solution(graph, assembly, solution, overrides.keyframe)
    mechanism = replace(_mechanism(graph, base, platform, assembly, solution.values), choice=choice)
    mechanism = closures.points_as_hinges(mechanism, tolerance)
    if not all(joint.in_tree for joint in mechanism.joints.values()):
        if not overrides.as_written:
            possible = 0.0 if overrides.tolerance else deviation(graph.digits, length)
            mechanism = snap_geometry(mechanism, solution.residual, tolerance, possible)
        elif solution.residual > GEOMETRY_DIFFERENCE_TOL:
            raise LoopClosureFailure(
                graph.file, solution.residual, GEOMETRY_DIFFERENCE_TOL, assembly.worst(solution.values)[0]
            )
        mechanism = build_spanning_mechanism(mechanism)
        if overrides.keyframe != STAY:
            mechanism = _away_from_singular(mechanism)
    if graph.platform is None and not mechanism.has_open_platform:
        mechanism = without_coordinates(mechanism)
    return with_weighed_motors(mechanism)


def _platform(graph: JointGraph, overrides: Overrides, base: str) -> tuple[str, PlatformChoice]:
    """Return the platform's link and how it was chosen."""
    if overrides.platform is not None:
        return overrides.platform, GIVEN
    first = assumptions.formation(graph, base) if graph.platform is None and graph.formation else graph.platform
    if first is not None:
        return first, FIRST if graph.formation else NAMED
    return assumptions.platform(graph, overrides.base or base)


def deviation(digits: Digits, length: float) -> float:
    """Return the rounding error of exact geometry due to the decimals of a file (characteristic lengths, rad);
    ``length`` is the characteristic length in the file's unit."""
    return ROUNDED_INCIDENCE_FRACTION * digits.last_place * max(1.0, 1 / length)


def rounding(digits: Digits, length: float, opening: float) -> float:
    """Return that rounding error; 0 if nothing indicates rounding: neither vectors and angles nor the closure residual
    at zero."""
    found = deviation(digits, length)
    return found if digits.rounded or GEOMETRY_DIFFERENCE_TOL < opening <= TOLERANCE_AMBIGUITY_FRACTION * found else 0.0


def _note_solution(graph: JointGraph, assembly: LoopAssembly, solution: LoopSolution, keyframe: str | None) -> None:
    name, miss = assembly.worst(assembly.zero())
    moved = moves(assembly, solution.values)
    if moved and miss > GEOMETRY_DIFFERENCE_TOL:
        pushed = ", after a random push out of a flat configuration" if solution.pushed else ""
        where = "the file's zero configuration" if keyframe is None else f"the keyframe {keyframe!r}"
        graph.note(
            "solved",
            f"at {where} the loop {name!r} is open by {miss:.3g} (characteristic lengths, radians); "
            f"closed{pushed} with {moved}",
        )


def _mechanism(graph: JointGraph, base: str, platform: str, assembly: LoopAssembly, values: Values) -> Mechanism:
    poses = assembly.poses(values)
    tree = {joint.name for joint, _, _ in assembly.tree}
    joints = {name: joint_at(joint, poses, name in tree) for name, joint in graph.joints.items()}
    links = {name: replace(link, pose=poses[name]) for name, link in graph.links.items()}
    mechanism = Mechanism(
        graph.name,
        links,
        with_offsets(joints, assembly, values),
        base,
        platform,
        tuple(graph.observations),
        (),
        graph.camera,
        tuple(graph.rest),
        graph.file,
        tuple(graph.notes),
        formation=graph.formation,
        turns=graph.turns if platform == graph.platform else None,
    )
    mechanism = add_file_observations(build_spanning_mechanism(mechanism), graph.sights, graph.cameras, graph.file)
    return replace(mechanism, couplings=tuple(_couplings(graph, mechanism)))


def joint_at(joint: JointSpec, poses: Mapping[str, Array], in_tree: bool) -> Joint:
    """Return a joint where its links have ``poses``; a loop closure is put in the middle of its two frames."""
    kind = joint.kind
    X_P, X_S = joint.frames(poses)
    axes: tuple[Array, ...] = ()
    if kind is JointType.UNIVERSAL:
        first, second = X_P[:3, :3] @ joint.axes[0], X_S[:3, :3] @ joint.axes[1]
        axes = first, normalise_vector(second - first * float(first @ second))
    elif kind.axes:
        both = X_P[:3, :3] @ joint.axes[0], X_S[:3, :3] @ joint.axes[0]
        axes = (both[0] if in_tree else normalise_vector(both[0] + both[1]),)
    point = X_P[:3, 3] if in_tree or kind.has_translation or kind is JointType.PLANAR else (X_P[:3, 3] + X_S[:3, 3]) / 2
    motor = None if kind is JointType.FIXED else joint.motor
    return Joint(joint.name, kind, *joint.links, point, axes, motor, joint.limits, in_tree, joint.xml, joint.line)


def _couplings(graph: JointGraph, mechanism: Mechanism) -> list[Coupling]:
    found = []
    for gear in graph.gears:
        ends = [mechanism.joints.get(name) for name in (gear.driver, gear.driven)]
        joints = [joint for joint in ends if joint is not None and joint.in_tree and joint.type.freedoms == 1]
        if len(joints) == 2 and gear.ratio == 0:
            where = graph.file if gear.line is None else f"{graph.file}:{gear.line}"
            raise BadMechanism(
                f"{where}: coupling {gear.name!r} would fix joint {gear.driven!r}; its ratio",
                gear.ratio,
                "a ratio other than 0",
                remedy=f"Fix the joint with --freeze {gear.driven}.",
            )
        if len(joints) == 2:
            found.append(Coupling(gear.name, joints[0].successor, joints[1].successor, gear.ratio, gear.line))
        elif all(
            joint is None or joint.type is not JointType.FIXED
            for joint in (graph.joints.get(gear.driver), graph.joints.get(gear.driven))
        ):
            raise BadMechanism(
                f"{graph.file}: coupling {gear.name!r} of a loop closure",
                gear.driven,
                "one-dof joints of the spanning tree",
            )
    return found


def _away_from_singular(mechanism: Mechanism) -> Mechanism:
    """Replace a zero configuration at which the loops have a higher mobility than nearby by one nearby."""
    assembly = LoopAssembly.of(mechanism)
    zero = assembly.zero()
    there = regular_values(assembly, zero)
    if there is None:
        return mechanism
    here, after = assembly.rank(zero), assembly.rank(there)
    freedoms = [assembly.size - rank.value for rank in (here, after)]
    why = (
        f"singular (its loops have mobility {freedoms[0]} there, {freedoms[1]} nearby)"
        if freedoms[1] < freedoms[0]
        else f"nearly singular (smallest singular value {here.weakest:.1e}, {after.weakest:.1e} nearby)"
    )
    note = Note("solved", f"the zero configuration is {why}: moved by {moves(assembly, there)}")
    return replace(with_zero_at(mechanism, assembly, there), notes=(*mechanism.notes, note))
