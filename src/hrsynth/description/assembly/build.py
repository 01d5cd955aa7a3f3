"""Assembly of a joint graph to a mechanism: loops closed, geometry repaired, away from singular zero configurations."""

from __future__ import annotations

from dataclasses import replace

from ...errors import BadRequest, LoopClosureFailure
from ...mechanism.model import FIRST, GIVEN, NAMED, Mechanism, Note, PlatformChoice
from ...tolerances import (
    GEOMETRY_DIFFERENCE_TOL,
    INCIDENCE_TOL,
    LOOP_COORDINATES_MAX,
    TOLERANCE_AMBIGUITY_FRACTION,
)
from ..conversion import convert_to_joint
from ..jointgraph import CouplingSpec, JointGraph, join_names
from ..keyframes import STAY, find_keyframe
from ..overrides import Overrides
from ..tree import build_spanning_mechanism
from . import assumptions, closures
from .candidates import without_loop
from .closed import make_mechanism
from .coordinates import with_weighed_motors, without_coordinates
from .geometry_repair import snap_geometry
from .loops import LoopAssembly, LoopSolution, Values, regular_values, solve
from .opening import describe_failure
from .zero_configuration import moves, with_offsets, with_zero_at


def build(graph: JointGraph, overrides: Overrides) -> Mechanism:
    """Return the mechanism of a file with its overrides; what the file leaves open is assumed or solved.

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
    base = assumptions.standing(graph, assumptions.base(graph), overrides.base, overrides.platform)
    graph.prune(base)
    for role, link in (("base", overrides.base), ("platform", overrides.platform)):
        if link is not None and link not in graph.links:
            raise BadRequest(f"{graph.file}: no such {role} link", link, join_names(graph.links, like=link))
    if not overrides.close and (open_chain := without_loop(graph, base)):
        graph.note("open", open_chain)
    graph.formation = graph.formation and overrides.platform is None
    platform, choice = _platform(graph, overrides, base)
    if platform == base and overrides.base is None:
        raise BadRequest(f"{graph.file}: the platform is the base", platform, "another link")
    start = graph.start if overrides.keyframe is None else find_keyframe(graph, overrides.keyframe)
    assembly = LoopAssembly(base, list(graph.joints.values()), graph.gears, graph.in_metres(start))
    if assembly.is_too_large:
        raise BadRequest(
            f"{graph.file}: too many joints for loops",
            f"{len(assembly.loops)} loops, and joints with {assembly.model.nv} coordinates",
            f"up to {LOOP_COORDINATES_MAX} of each",
        )
    open_at_zero = assembly.worst(assembly.zero())[1]
    length = assembly.length / graph.unit
    rounded = 0.0 if overrides.as_written else overrides.tolerance or graph.digits.rounding(length, open_at_zero)
    tolerance = overrides.tolerance or max(INCIDENCE_TOL, rounded)
    assembly.noise = max(INCIDENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION * rounded)
    if open_at_zero <= TOLERANCE_AMBIGUITY_FRACTION * rounded:
        solution = LoopSolution(assembly.zero(), open_at_zero)
    else:
        solution = solve(assembly)
    if not solution.residual <= assembly.noise:
        raise describe_failure(graph, assembly, solution, overrides)
    _note_solution(graph, assembly, solution, overrides.keyframe)
    graph.gears = [_take_slope(graph, gear, assembly, solution.values) for gear in graph.gears]
    tree, poses = {joint.name for joint, _, _ in assembly.tree}, assembly.poses(solution.values)
    joints = {name: convert_to_joint(joint, poses, in_tree=name in tree) for name, joint in graph.joints.items()}
    joints = with_offsets(joints, assembly, solution.values)
    mechanism = make_mechanism(graph, base, (platform, choice), joints, poses)
    mechanism = closures.points_as_hinges(mechanism, tolerance)
    if not all(joint.in_tree for joint in mechanism.joints.values()):
        if not overrides.as_written:
            possible = 0.0 if overrides.tolerance else graph.digits.deviation(length)
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
    return with_weighed_motors(mechanism, graph)


def _platform(graph: JointGraph, overrides: Overrides, base: str) -> tuple[str, PlatformChoice]:
    """Return the platform's link and how it was chosen."""
    if overrides.platform is not None:
        return overrides.platform, GIVEN
    first = assumptions.formation(graph, base) if graph.platform is None and graph.formation else graph.platform
    if first is not None:
        return first, FIRST if graph.formation else NAMED
    return assumptions.platform(graph, overrides.base or base)


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


def _take_slope(graph: JointGraph, gear: CouplingSpec, assembly: LoopAssembly, values: Values) -> CouplingSpec:
    """Return a coupling with its slope at ``values`` for its ratio."""
    if not gear.curve or gear not in assembly.gears:
        return gear
    q = float(assembly.coordinates(values)[gear.driver][0])
    ratio = float(gear.polynomial.deriv()(q))
    graph.note(
        "assumption",
        f"coupling {gear.name!r} is a curve: its ratio is the slope {ratio:.6g} at {gear.driver} = {q:.6g}",
    )
    return replace(gear, ratio=ratio)


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
