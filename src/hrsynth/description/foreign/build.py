"""From a joint graph to a mechanism: closed, its geometry as it is meant, away from singular zero poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...errors import BadMechanism, BadRequest, LoopsNotClosed, RankUndecided
from ...geometry.vectors import Array, inverse, unit
from ...mechanism.model import Coupling, Joint, JointType, Limits, Mechanism, Note
from ...tolerances import FAINT, NOISE, RANK_CUTOFF, RANK_GAP, SAME_GEOMETRY
from ..draft import Edge
from ..tree import spanning
from . import closures, given, guess, relations
from .assembly import Assembly, State, assembly_of
from .coordinates import coordinates_freed, mobility
from .given import Given
from .graph import Graph, listed
from .solving import Solution, solve, unlocked

SIZE = 240
"""Coordinates of joints in loops above which loops are not solved."""


def build(graph: Graph, wishes: Given) -> Mechanism:
    """The mechanism that a foreign file and what the user says of it make.

    Raises
    ------
    BadRequest
        For names that there are not, and for a platform that has to be given.
    LoopsNotClosed, RankUndecided
        Where loops stay open, or where rounded numbers leave no gap between what is free and what is not.
    """
    closures.halves_joined(graph)
    given.closed(graph, wishes.close)
    graph.edges = given.frozen(graph.edges, wishes.freeze)
    if wishes.motors is not None:
        graph.edges = given.motors(graph.edges, wishes.motors)
    closures.points_together(graph)
    base = graph.base or guess.base(graph)
    _pruned(graph, base)
    for role, link in (("base", wishes.base), ("platform", wishes.platform)):
        if link is not None and link not in graph.links:
            raise BadRequest(f"{graph.file}: no such {role} link", link, listed(graph.links))
    platform = wishes.platform or graph.platform or guess.platform(graph, wishes.base or base)
    if platform == base and wishes.base is None:
        raise BadRequest(f"{graph.file}: the platform is the base", platform, "another link")
    assembly = Assembly(base, list(graph.edges.values()), graph.gears)
    if assembly.size > SIZE or len(assembly.loops) > SIZE:
        raise BadRequest(f"{graph.file}: {len(assembly.loops)} loops through joints with {assembly.size} coordinates",
                         None, f"up to {SIZE} of each")
    solution = solve(assembly)
    if not solution.residual <= NOISE:
        raise LoopsNotClosed(graph.file, solution.residual, NOISE, assembly.worst(solution.state)[0])
    _tell_solution(graph, assembly, solution)
    mechanism = _mechanism(graph, base, platform, assembly, solution.state)
    meant = _as_meant(closures.points_in_planes(mechanism), solution.residual)
    regular = _away_from_singular(meant)
    return _motors_weighed(coordinates_freed(regular) if graph.platform is None else regular)


def _pruned(graph: Graph, base: str) -> None:
    kept = graph.connected(base)
    lost = [link for link in graph.links if link not in kept]
    if lost:
        graph.note("ignored", f"{len(lost)} links that no joint connects to the base {base!r}: "
                              + listed(lost, 5))
        graph.links = {name: link for name, link in graph.links.items() if name in kept}
        graph.edges = {name: edge for name, edge in graph.edges.items() if set(edge.links) <= kept}
        graph.gears = [gear for gear in graph.gears if {gear.driver, gear.driven} <= set(graph.edges)]


def _tell_solution(graph: Graph, assembly: Assembly, solution: Solution) -> None:
    name, miss = assembly.worst(assembly.zero())
    moves = _moves(assembly, solution.state)
    if moves and miss > SAME_GEOMETRY:
        pushed = ", after a random push out of a flat pose" if solution.pushed else ""
        graph.note("solved", f"at the file's zero pose the loop {name!r} is open by {miss:.3g} (characteristic "
                             f"lengths, radians); closed{pushed} with {moves}")


def _moves(assembly: Assembly, state: State) -> str:
    """The coordinates that differ from zero, in words."""
    found = []
    for edge in assembly.active:
        value = state[edge.name]
        for number, q in enumerate(value if value.ndim == 1 else value[:3, :3][[2, 0, 1], [1, 2, 0]]):
            scale = assembly.length if edge.type is JointType.PRISMATIC else 1.0
            if abs(q) > NOISE:
                suffix = f"[{number}]" if value.size > 1 else ""
                found.append(f"{edge.name}{suffix} = {q * scale:.6g}")
    return listed(found)


def _mechanism(graph: Graph, base: str, platform: str, assembly: Assembly, state: State) -> Mechanism:
    poses = assembly.placed(state)
    tree = {edge.name for edge, _, _ in assembly.tree}
    joints = {name: _joint(edge, poses, name in tree, assembly, state) for name, edge in graph.edges.items()}
    links = {name: replace(link, pose=poses[name]) for name, link in graph.links.items()}
    mechanism = Mechanism(graph.name, links, joints, base, platform, tuple(graph.observations), (), graph.camera,
                          tuple(graph.rest), graph.file, tuple(graph.notes))
    mechanism = spanning(mechanism)
    return replace(mechanism, couplings=tuple(_couplings(graph, mechanism)))


def _joint(edge: Edge, poses: Mapping[str, Array], in_tree: bool, assembly: Assembly, state: State) -> Joint:
    kind = edge.type or JointType.FIXED
    X_P, X_S = (poses[link] @ end.X for link, end in zip(edge.links, edge.ends, strict=True))
    axes: tuple[Array, ...] = ()
    if kind is JointType.UNIVERSAL:
        first, second = X_P[:3, :3] @ edge.axes[0], X_S[:3, :3] @ edge.axes[1]
        axes = first, unit(second - first * float(first @ second))
    elif kind.axes:
        both = X_P[:3, :3] @ edge.axes[0], X_S[:3, :3] @ edge.axes[0]
        axes = (both[0] if in_tree else unit(both[0] + both[1]),)
    point = X_P[:3, 3] if in_tree or kind.slides or kind is JointType.PLANAR else (X_P[:3, 3] + X_S[:3, 3]) / 2
    limits = edge.limits
    if limits is not None and in_tree and kind in (JointType.REVOLUTE, JointType.PRISMATIC):
        q = float(state[edge.name][0]) * (assembly.length if kind is JointType.PRISMATIC else 1.0)
        limits = limits if q == 0 else Limits(_less(limits.lower, q), _less(limits.upper, q), limits.velocity,
                                              limits.effort)
    return Joint(edge.name, kind, *edge.links, point, axes, None if kind is JointType.FIXED else edge.motor, limits,
                 in_tree, edge.xml, edge.line)


def _less(value: float | None, q: float) -> float | None:
    return None if value is None else value - q


def _couplings(graph: Graph, mechanism: Mechanism) -> list[Coupling]:
    found = []
    for gear in graph.gears:
        ends = [mechanism.joints.get(name) for name in (gear.driver, gear.driven)]
        joints = [joint for joint in ends if joint is not None and joint.in_tree and joint.type.freedoms == 1]
        if len(joints) == 2:
            found.append(Coupling(gear.name, joints[0].successor, joints[1].successor, gear.ratio, gear.line))
        elif all(edge is None or edge.type is not JointType.FIXED for edge in
                 (graph.edges.get(gear.driver), graph.edges.get(gear.driven))):
            raise BadMechanism(f"{graph.file}: coupling {gear.name!r} of a joint that closes a loop", gear.driven,
                               "joints of one freedom in the spanning tree")
    return found


def _as_meant(mechanism: Mechanism, residual: float) -> Mechanism:
    """Geometry that nearly keeps relations keeps them; the gap of the singular values is the evidence."""
    if all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    written = assembly_of(mechanism)
    found = relations.exact(mechanism)
    if found is None:
        if residual > SAME_GEOMETRY:
            raise LoopsNotClosed(str(mechanism.file), residual, SAME_GEOMETRY, written.worst(written.zero())[0])
        return mechanism
    meant = found.mechanism
    rank = assembly_of(meant).freedom(assembly_of(meant).zero())
    before, loose = (written.freedom(written.zero(), cutoff) for cutoff in (RANK_CUTOFF, FAINT))
    text = (f"{found.mended} relations of joints (parallel, perpendicular, meeting, equal) that hold to {NOISE:g} are "
            f"made exact, largest change {found.change:.1e}")
    if before.value != rank.value or residual > SAME_GEOMETRY:
        if loose.value != rank.value or loose.gap < RANK_GAP:
            raise RankUndecided(f"{mechanism.file}: loops with rounded numbers", loose.gap, RANK_GAP)
        text += f"; the loops' singular values as written leave a gap of {loose.gap:.1e} (needed {RANK_GAP:g})"
    return replace(meant, notes=(*meant.notes, Note("merged", text)))


def _away_from_singular(mechanism: Mechanism) -> Mechanism:
    """A zero pose at which the loops have more freedoms than nearby is left for one nearby."""
    if all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    assembly = assembly_of(mechanism)
    start = assembly.zero()
    there = unlocked(assembly, start)
    if there is None:
        return mechanism
    here, after = assembly.freedom(start), assembly.freedom(there)
    why = (f"singular (its loops have {here.value} freedoms there, {after.value} nearby)" if after.value < here.value
           else f"nearly singular (weakest singular value {here.weakest:.1e}, {after.weakest:.1e} nearby)")
    note = Note("solved", f"the zero pose is {why}: moved to {_moves(assembly, there)}")
    moved = moved_to(mechanism, assembly, there)
    return replace(moved, notes=(*mechanism.notes, note))


def _motors_weighed(mechanism: Mechanism) -> Mechanism:
    """A note where more coordinates are driven than there are freedoms: files put actuators on passive joints too."""
    driven = sum(joint.type.freedoms for joint in mechanism.joints.values() if joint.actuated)
    if driven == 0 or all(joint.in_tree for joint in mechanism.joints.values()):
        return mechanism
    free = mobility(mechanism)
    if driven <= free:
        return mechanism
    note = Note("open", f"{driven} coordinates are driven, but there are {free} freedoms: some motors may stand on "
                        "passive joints (--motors JOINTS to name the driven ones)")
    return replace(mechanism, notes=(*mechanism.notes, note))


def moved_to(mechanism: Mechanism, assembly: Assembly, state: State) -> Mechanism:
    """The same mechanism with another closed configuration for its zero."""
    poses = assembly.placed(state)
    turn = {name: poses[name] @ inverse(link.pose) for name, link in mechanism.links.items()}
    joints = {}
    for joint in mechanism.joints.values():
        X, Y = (turn[link] for link in joint.links)
        axes = tuple(Z[:3, :3] @ axis for Z, axis in zip((X, Y), joint.axes, strict=False))
        limits = joint.limits
        if limits is not None and joint.name in state and joint.type in (JointType.REVOLUTE, JointType.PRISMATIC):
            q = float(state[joint.name][0]) * (assembly.length if joint.type is JointType.PRISMATIC else 1.0)
            limits = Limits(_less(limits.lower, q), _less(limits.upper, q), limits.velocity, limits.effort)
        joints[joint.name] = replace(joint, point=X[:3, :3] @ joint.point + X[:3, 3], axes=axes, limits=limits)
    links = {name: replace(link, pose=poses[name]) for name, link in mechanism.links.items()}
    return replace(mechanism, links=links, joints=joints)


