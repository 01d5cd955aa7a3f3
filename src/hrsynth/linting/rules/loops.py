"""Loop closures: open at zero, mirrored, redundant, or without data."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...description import numerals, xml
from ...description.assembly import assumptions
from ...description.assembly.candidates import closure_candidates
from ...description.assembly.loops import LoopAssembly, LoopSolution, solve
from ...description.assembly.zero_configuration import count_from, moves
from ...description.contents import collect_content
from ...description.conversion import move_along_joint
from ...description.jointgraph import JointGraph, JointSpec
from ...errors import HrsynthError
from ...geometry.vectors import Array, transform
from ...mechanism.model import Joint, JointType, Mechanism
from ...tolerances import EXACT_INCIDENCE_TOL, INCIDENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION
from ..elements import NumberAt
from ..findings import Fix, LintRule, RuleHit
from ..freedoms import NearbyFreedoms
from ..linted_file import LintedFile
from .names import OWN, remove_element

OPPOSITE_AXES_TOL = 1e-3
"""One plus the cosine between two axes of a closure below which they are opposite."""

CLOSING = ("loop", "constraint", "loop_joint", "joint", "connect", "weld", "coupling")
"""Elements that close loops, in any format."""
SHORTEST_LOOP_JOINTS_MIN = 3
"""Number of movable joints in the shortest loop, without the one that closes it."""


def read_loops(file: LintedFile) -> tuple[JointGraph, LoopAssembly] | None:
    """Return the loops of a file before anything is solved, merged or repaired; nothing may change them."""
    return file.remember("as written", lambda: _read_loops(file))


def _read_loops(file: LintedFile) -> tuple[JointGraph, LoopAssembly] | None:
    try:
        graph = file.graph()
        file.given.apply(graph)
    except HrsynthError:
        return None
    base = assumptions.base(graph)
    graph.prune(base)
    assembly = LoopAssembly(base, list(graph.joints.values()), graph.gears)
    return None if assembly.is_too_large else (graph, assembly)


def _open(file: LintedFile) -> Iterator[RuleHit]:
    found = read_loops(file)
    if found is None:
        return
    graph, assembly = found
    zero, every = assembly.poses(assembly.zero()), assembly.misses(assembly.zero())
    misses = {loop.name: every[loop.name] for loop in assembly.loops if not _has_opposite_axes(loop, zero)}
    worst = max(misses, key=lambda name: misses[name], default=None)
    if worst is None or misses[worst] <= INCIDENCE_TOL or _is_explained_by_rounding(file, graph, assembly):
        return
    closed = solve(assembly)
    size = ", ".join(f"{name!r} by {miss:.3g}" for name, miss in list(misses.items())[:6] if miss > INCIDENCE_TOL)
    text = f"at zero the loops are open: {size} (characteristic lengths, radians)"
    if closed.residual > INCIDENCE_TOL:
        yield RuleHit(
            graph.joints[worst].line,
            text + f"; no closed configuration was found (residual {closed.residual:.3g})",
            None,
            "correct the dimensions, or the frames of the closures",
        )
        return
    text += f"; they close with {moves(assembly, closed.values)}"
    yield RuleHit(
        graph.joints[worst].line,
        text,
        _repair_zero(file, graph, assembly, closed),
        severity="warning" if file.refusal is None else None,
    )


def _is_explained_by_rounding(file: LintedFile, graph: JointGraph, assembly: LoopAssembly) -> bool:
    """Return True if rounded numbers explain the closure residual: geometry repair suffices, no joint has to move."""
    miss = assembly.worst(assembly.zero())[1]
    explained = file.given.tolerance or graph.digits.rounding(assembly.length / graph.unit, miss)
    return not file.given.as_written and miss <= TOLERANCE_AMBIGUITY_FRACTION * explained


def _repair_zero(file: LintedFile, graph: JointGraph, assembly: LoopAssembly, closed: LoopSolution) -> Fix | None:
    """Return the fix that counts every joint from the closed configuration: its origin takes the displacement, its
    limits and the offset of its mimic lose it."""
    if file.dialect != "urdf" or file.expanded or closed.beyond:
        return None
    moved, q = [], assembly.coordinates(closed.values)
    for joint, _, _ in assembly.tree:
        if not q[joint.name].any():
            continue
        element = file.element(graph.joints[joint.name].line, "joint", name=joint.name)
        part = OWN.search(joint.name)  # of a chain that is one joint only if its frames stay aligned
        if element is None or part or joint.kind not in (JointType.REVOLUTE, JointType.PRISMATIC):
            return None
        moved.append((joint, element))
    return partial(_set_zero, moved, assembly.singles(closed.values), assembly.closing(closed.values))


def _set_zero(moved: list[tuple[JointSpec, xml.Element]], turned: dict[str, float], shifts: dict[str, float]) -> None:
    for joint, element in moved:
        q = turned[joint.name]
        X = joint.ends[0].X @ move_along_joint(joint, q)
        origin = element.find("origin")
        if origin is None:
            origin = element.makeelement("origin", {})
            element.insert(0, origin)
        origin.set("xyz", numerals.format_exact_vector(X[:3, 3]))
        origin.set("rpy", numerals.format_exact_vector(numerals.compute_rounded_rpy(X[:3, :3])))
        _shift_limits(element, q)
    for element in moved[0][1].getroottree().iter("loop"):
        if q := shifts.get(str(element.get("name")), 0.0):
            _shift_limits(element, q)
    for element in moved[0][1].getroottree().iter("joint"):
        for mimic in element.iterfind("mimic"):
            ratio = NumberAt(mimic, "multiplier").value
            led = (1.0 if ratio is None else ratio) * turned.get(str(mimic.get("joint")), 0.0)
            if own := turned.get(str(element.get("name")), 0.0) - led:
                offset = (NumberAt(mimic, "offset").value or 0.0) - own
                mimic.set("offset", numerals.format_exact(offset if abs(offset) > EXACT_INCIDENCE_TOL else 0.0))


def _shift_limits(element: xml.Element, q: float) -> None:
    """Count the limits and other coordinates of a joint's element from q."""
    for limit in element.iterfind("limit"):
        free = (limit.get("free") or "").split()
        _subtract_value(limit, q, *(key for key in ("lower", "upper") if key not in free))
    for each in element:
        count_from(each, q)


def _subtract_value(element: xml.Element, q: float, *keys: str) -> None:
    for key in keys:
        value = NumberAt(element, key).value
        if value is not None:
            element.set(key, numerals.format_exact(value - q))


def _has_opposite_axes(joint: JointSpec, poses: dict[str, np.ndarray]) -> bool:
    """Return True if the two axes of a joint are opposite when its frames coincide."""
    if joint.kind not in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR) or len(joint.axes) != 1:
        return False
    X, Y = joint.frames(poses)
    return float(X[:3, :3] @ joint.axes[0] @ (Y[:3, :3] @ joint.axes[0])) < -1 + OPPOSITE_AXES_TOL


def _find_mirrored(file: LintedFile) -> Iterator[RuleHit]:
    found = read_loops(file)
    if found is None:
        return
    _, assembly = found
    poses = assembly.poses(assembly.zero())
    for joint in assembly.loops:
        if _has_opposite_axes(joint, poses):
            yield RuleHit(joint.line, f"the two axes of {joint.name!r} are opposite at zero", _turn_axis(file, joint))


def _turn_axis(file: LintedFile, joint: JointSpec) -> Fix | None:
    """Return the fix that reverses the child's axis of a ``<constraint>``."""
    element = file.element(joint.line, "constraint", name=joint.name)
    axis = None if element is None else element.find("child_axis")
    if axis is None:
        return None
    return partial(_reverse, axis)


def _reverse(axis: xml.Element) -> None:
    """Reverse the current axis, which another fix may have changed."""
    axis.set("xyz", numerals.format_exact_vector(-numerals.parse(axis.get("xyz", "1 0 0"), 3)))


def _find_misplaced(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is None:
        return
    for joint in robot.joints.values():
        distance = min(_measure_distance(robot, link, joint, joint.point) for link in joint.links)
        if joint.in_tree or distance <= robot.length:
            continue
        for link in joint.links:
            numbers = transform(robot.links[link].inverse, joint.point)
            nearer = max(_measure_distance(robot, end, joint, numbers) for end in joint.links)
            if nearer < distance / 2:
                text = f"the point of {joint.name!r} is {distance:.3g} m or more from both of its links"
                cure = f"; its numbers in the frame of {link!r}, read in the world's, are within {nearer:.3g} m"
                yield RuleHit(_find_line(file, joint.name), text + cure)
                break


def _measure_distance(robot: Mechanism, link: str, closure: Joint, point: Array) -> float:
    """Return the distance (m) of a point from the joints and shapes of a link, a closure aside; 0 if it has none."""
    places = [(joint.point, 0.0) for joint in robot.joints_of(link) if joint is not closure]
    for solid in collect_content(robot.links[link], robot).solids:
        centre = transform(robot.links[link].pose, solid.X[:3, 3])
        places.append((centre, float(np.linalg.norm(solid.sizes)) / (1 if solid.kind == "sphere" else 2)))
    return min((max(float(np.linalg.norm(point - at)) - radius, 0.0) for at, radius in places), default=0.0)


def sample_nearby(file: LintedFile) -> NearbyFreedoms | None:
    """Return the mobility counts of the file's mechanism, if it was read."""
    robot = file.mechanism
    return None if robot is None else file.remember("freedoms", lambda: NearbyFreedoms(robot))


def _find_immobile(file: LintedFile) -> Iterator[RuleHit]:
    found = sample_nearby(file)
    for name in [] if found is None else found.dead():
        graph = file.said
        line = _find_line(file, name)
        own = None if graph is None else graph.joints.get(name)
        element = None if own is not None and own.in_tree else file.element(line, *CLOSING, name=name)
        yield RuleHit(line, f"{name!r} does not change the mobility", remove_element(file, element))


def _find_line(file: LintedFile, name: str) -> int | None:
    graph, robot = file.said, file.mechanism
    for table in ({} if graph is None else graph.joints, {} if robot is None else robot.joints):
        if name in table:
            return table[name].line
    gears = [] if graph is None else [gear for gear in graph.gears if gear.name == name]
    return gears[0].line if gears else None


def _find_redundant(file: LintedFile) -> Iterator[RuleHit]:
    found = sample_nearby(file)
    if found is None:
        return
    joints = found.mechanism.joints

    def rows(name: str) -> int:
        joint: Joint | None = joints.get(name)
        return 1 if joint is None else 6 - joint.type.freedoms

    dead = set(found.dead())
    for name, count in found.redundant(rows).items():
        if name not in dead:
            yield RuleHit(
                _find_line(file, name),
                f"{count} of the {rows(name)} constraints of {name!r} are redundant with those of earlier loops",
            )


def is_unclosed(robot: Mechanism) -> bool:
    """Return True if no joint or coupling closes a loop."""
    return not robot.couplings and all(joint.in_tree for joint in robot.joints.values())


def is_watched(robot: Mechanism) -> bool:
    """Return True if a robot is open on purpose: formations, free bodies, arms with a camera."""
    seen = robot.formation or robot.observations or robot.cameras
    return is_unclosed(robot) and (bool(seen) or all(joint.type is JointType.FREE for joint in robot.joints.values()))


def _find_no_loop(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is not None and is_unclosed(robot) and not is_watched(robot):
        yield RuleHit(None, "the file closes no loop")


def _is_near_in_tree(graph: JointGraph, one: str, two: str) -> bool:
    """Return True if the frames are those of neighbouring joints: fewer than three movable joints are between them, or
    one carries the other, which carries more."""
    carrier = {joint.links[1]: joint for joint in graph.joints.values() if joint.in_tree}
    ways: list[list[str]] = []
    for tip in (one, two):
        way = [tip]
        while way[-1] in carrier and len(way) <= len(carrier):
            way.append(carrier[way[-1]].links[0])
        ways.append(way)
    between = {*ways[0]} ^ {*ways[1]}
    if sum(carrier[each].kind is not JointType.FIXED for each in between if each in carrier) < SHORTEST_LOOP_JOINTS_MIN:
        return True
    inner = [tip for tip, way in ((one, ways[1]), (two, ways[0])) if tip in way]
    return any(joint.in_tree and joint.links[0] in {one, two} - {*inner} for joint in graph.joints.values() if inner)


def _find_coincident(file: LintedFile) -> Iterator[RuleHit]:
    graph = file.said
    if graph is None:
        return
    held = (
        graph.closing
        | file.given.ends
        | {link for joint in graph.joints.values() if not joint.in_tree for link in joint.links}
    )
    for each in closure_candidates(graph, assumptions.base(file.graph())):
        one, two = each.links
        if each.coincides and not held & {one, two} and not _is_near_in_tree(graph, one, two):
            yield RuleHit(
                graph.links[two].line,
                f"the frames of {one!r} and {two!r} are {1000 * each.distance:.3g} mm "
                "apart at zero, and nothing connects them when the joints move",
                advice=f"if they should coincide: --close {each.wish}",
            )


RULES = (
    LintRule(
        "loop-open",
        "error",
        "loops that are open at the zero configuration",
        "A simulator closes them with a jump, and if there are two closed configurations, perhaps in the wrong one. "
        "hrsynth finds the nearest closed configuration, reports the joints that it moves, and counts from there.",
        "correct the mistyped dimension or, if all are right, count the moved joints from the closed configuration",
        _open,
        fixable=True,
    ),
    LintRule(
        "loop-mirrored",
        "error",
        "a closure with opposite axes",
        "The joint fits, but aligning the axes rotates a link by 180 degrees: the robot is read as "
        "its mirror image, or not at all.",
        "reverse one of the two axes",
        _find_mirrored,
        fixable=True,
    ),
    LintRule(
        "closure-misplaced",
        "warning",
        "a closure whose point is far from both links",
        "Coordinates of the world were probably typed where those of a link's frame are expected. "
        "The closure then has another lever arm, and the robot other motions.",
        "write the point in the frame of the link",
        _find_misplaced,
    ),
    LintRule(
        "constraint-dead",
        "warning",
        "a closure or coupling that constrains nothing",
        "A loop closed twice is overdetermined: solvers of constraint forces have no single solution, and rounded "
        "numbers may lock the loop.",
        "remove it",
        _find_immobile,
        fixable=True,
    ),
    LintRule(
        "constraint-redundant",
        "note",
        "redundant constraints",
        "Normal in planar and over-constrained loops, and harmless in ideal geometry. Solvers of constraint "
        "forces have no single solution, and rounded numbers may lock the loop.",
        "nothing, or a joint with more dof (spherical instead of revolute)",
        _find_redundant,
    ),
    LintRule(
        "loop-none",
        "warning",
        "no loop",
        "The closures were perhaps lost in a conversion, or are in a file or launch script next to this one.",
        "close it: --close A:B[:TYPE] with frames A and B that coincide",
        _find_no_loop,
    ),
    LintRule(
        "frames-coincide",
        "warning",
        "coincident frames that no joint connects",
        "Several tools mark a loop by two coincident frames on different links; a loop that is not "
        "closed is an open chain.",
        "if they should stay coincident: --close A:B",
        _find_coincident,
    ),
)
