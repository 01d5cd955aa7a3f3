"""All modes of a robot in natural coordinates, whatever its legs: real ones, each in a box of its own (docs/pages/
proofs.md, section 8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...constraints.pattern import list_placing_links
from ...equations.natural_view import SLIDE_REACH_MAX, NaturalView, read_natural_view
from ...errors import ExternalSolverFailure, LoopClosureFailure, TooLarge, UnsupportedLocus
from ...geometry.vectors import Array, build_pose, compare_poses, freeze_array, transform
from ...kinematics.assembly import build_from_link_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.goal_error import is_planar, is_proved_to_exist
from ...kinematics.tasks import FixedValuesTask
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Mechanism, graphs
from ...mechanism.legs import Leg
from ...mechanism.observations.encoder import Encoder
from ...solving.platform.constrained_platform import System
from ...solving.platform.solve import SystemMode, SystemModes
from ...solving.quadric_solver import QuadricSolver, SolutionBox
from ...solving.uniqueness import enclose_unique, evaluate_quadrics, is_excluded
from ..measured import MeasuredRobot
from .assembly_mode import AssemblyMode
from .tip_systems import MODES_TIME_LIMIT_S, Model

NATURAL_TIME_S = 5.0
"""Estimated time of one list (s)."""
LEG_DOF_MIN, PLANAR_LEG_DOF_MIN = 6, 3
"""Least dof of a leg that holds nothing of the platform, and of one of a planar mechanism."""
SAME_POSE_TOL = 1e-6
"""Difference (characteristic lengths, entries of rotations) up to which poses are listed as one."""
ROTATION_SPREAD_MAX = 1e-8
"""Change of a direction over the samples up to which none turns it."""
GOAL_ISOLATED_MIN = 1e-9
"""Smallest singular value of the equations at the goal, over the largest, where it is isolated."""
COMPLEX_RESIDUAL_MAX = 1e-5
"""Largest value of the equations, relative to products of the unknowns, at a complex solution that is counted."""
NARROWER_MAX = 0.5
"""Size of what all boxes lie in, over that of the bounds, up to which a list is computed again within it."""


@dataclass(frozen=True, eq=False, repr=False)
class NaturalPlatform(System):
    """A robot in natural coordinates; q are those of the view."""

    goal: ClosedConfiguration
    view: NaturalView
    links: tuple[str, ...]
    kept: bool
    """True if directions that no sample turns are held."""
    point: Array | None = None
    """The platform, if it is a point (3,) of its link, in the link's frame (m)."""
    is_reach_assumed: bool = False
    """True if points that only slides bound are taken to be within ``SLIDE_REACH_MAX``."""

    freedoms = 6

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.goal.model.length

    @property
    def motion(self) -> str:
        """Return the kind of poses among which modes are sought: ``planar``, ``kept`` or ``spatial``."""
        return "kept" if self.kept else "planar" if is_planar(self.goal.model.mechanism) else "spatial"

    def place(self, link: str, x: Array) -> Array:
        """Return the pose (4, 4) of a link at x; of one with a single direction one of those with its image."""
        group, origin, _ = self.view.links[link]
        basis = self.view.groups[group][0]
        values = np.append(1.0, x)
        images = np.array([self.view.direction(link, column) @ values for column in basis.T]).reshape(-1, 3).T
        if basis.shape[1] == 2:
            basis, images = (np.column_stack([M, np.cross(*M.T)]) for M in (basis, images))
        U, _, Vt = np.linalg.svd(images @ basis.T)
        R = U @ Vt
        place = self.view.point(link, origin) @ values
        moved = build_pose(self.size * (place - R @ origin), R)
        return np.asarray(moved @ self.goal.pose(link))

    def close(self, x: Array) -> ClosedConfiguration:
        """Return the robot with all its links, coupled joints at the turns at which couplings close."""
        return build_from_link_poses(self.goal.model, partial(self.place, x=x))

    def place_all(self, x: Array) -> dict[str, Array]:
        """Return the poses (4, 4) of the links that place the platform."""
        return {link: self.place(link, x) for link in self.links}

    def compare(self, x: Array, y: Array) -> float:
        """Return the largest difference of poses at x and y (characteristic lengths, entries of rotations)."""
        pairs = zip(self.place_all(x).values(), self.place_all(y).values(), strict=True)
        return max(compare_poses(X, Y, self.size, self.point) for X, Y in pairs)

    def list_pose_rows(self) -> Array:
        """Return the rows (k, n + 1) of points and images of directions of the links that place the platform."""
        if self.point is not None:
            (link,) = self.links
            return self.view.point(link, transform(self.goal.pose(link), self.point) / self.size)
        rows = list[Array]()
        for link in self.links:
            group, origin, _ = self.view.links[link]
            rows.append(self.view.point(link, origin))
            rows += [self.view.direction(link, column) for column in self.view.groups[group][0].T]
        return np.concatenate(rows)

    def count_poses(self, points: Sequence[Array]) -> int:
        """Return the number of distinct poses at points x (n,), complex ones too."""
        rows, distinct = self.list_pose_rows(), list[Array]()
        for x in points:
            pose = rows @ np.append(1.0, x)
            size = 1.0 + np.abs(pose).max()
            if all(np.abs(pose - known).max() > SAME_POSE_TOL * size for known in distinct):
                distinct.append(pose)
        return len(distinct)

    def bound_shift(self, radii: Array) -> tuple[float, float]:
        """Return how far (m) and by which angle (rad) a link's pose can be from that at the middle of a box."""
        shift = turn = 0.0
        for link in self.links:
            group, origin, triple = self.view.links[link]
            places = self.view.groups[group][1]
            turned = 0.0 if places is None else float(np.linalg.norm(radii[places]))
            moved = 0.0 if triple is None else float(np.linalg.norm(radii[triple]))
            arm = float(np.linalg.norm(self.goal.pose(link)[:3, 3] / self.size - origin))
            # images to the nearest rotation: twice; a third one of two: twice
            turn = max(turn, 4.0 * turned)
            shift = max(shift, self.size * (moved + 4.0 * turned * (arm + float(np.linalg.norm(origin)))))
        return shift, turn


def solve_natural(
    measured: MeasuredRobot,
    goal: ClosedConfiguration,
    error: float = 0.0,
    *,
    time_limit: float = MODES_TIME_LIMIT_S,
    keeps: bool = False,
) -> tuple[Model, SystemModes]:
    """All real modes, with the goal known to ``error`` (m); if ``keeps``, those that keep the directions that no sample
    turns. Raises ``UnsupportedLocus``, ``ExternalSolverFailure`` and ``TooLarge``."""
    if time_limit < NATURAL_TIME_S:
        raise TooLarge("a system of equations", "natural coordinates", NATURAL_TIME_S, time_limit)
    if not np.isfinite(error):
        raise UnsupportedLocus(
            measured.setup.robot.name, "the distance to the exact closed configuration is not bounded"
        )
    return _solve(_read(measured, goal, error, keeps))


def _read(measured: MeasuredRobot, goal: ClosedConfiguration, error: float, kept: bool) -> NaturalPlatform:
    """Return the robot without legs that hold nothing."""
    setup, model = measured.setup, measured.observation_model
    mechanism, name, point = goal.model.mechanism, setup.robot.name, setup.decomposition.point
    joints = {seen.joint for seen in model.observations if isinstance(seen, Encoder)}
    joints |= {joint for coupling in mechanism.couplings for joint in (coupling.driver, coupling.driven)}
    links = {link for seen in model.observations for link in (seen.link, seen.seen_from or model.reference)}
    least = PLANAR_LEG_DOF_MIN if is_planar(mechanism) else LEG_DOF_MIN
    free_legs = [
        leg
        for leg in setup.decomposition.legs
        if not joints & {*leg.joints} and not links & {*leg.links} and _count_serial_dof(mechanism, leg) >= least
    ]
    if least == PLANAR_LEG_DOF_MIN and len(free_legs) == len(setup.decomposition.legs):
        free_legs = []  # one of them holds the plane
    left_out = {joint for leg in free_legs for joint in leg.joints} | _list_hanging(measured, mechanism)
    directions = _list_kept_directions(measured, goal, left_out) if kept else []
    if kept and not directions:
        raise UnsupportedLocus(name, "no link keeps a direction")
    view = read_natural_view(goal, model.observations, model.reference, left_out, directions, error)
    bodies = list_placing_links(setup.decomposition)
    if point is not None and len(bodies) > 1:
        raise UnsupportedLocus(name, "legs end on several links of a platform that is a point")
    for link in mechanism.links if mechanism.couplings else bodies:
        if link not in view.links or view.groups[view.links[link][0]][0].shape[1] < 2 - (point is not None):
            raise UnsupportedLocus(name, f"the joints do not place {link}")
    is_reach_assumed = bool(np.any(view.farthest >= SLIDE_REACH_MAX))
    return NaturalPlatform((), np.zeros((0, 3)), goal, view, bodies, kept, point, is_reach_assumed, error=error)


def _count_serial_dof(mechanism: Mechanism, leg: Leg) -> int:
    """Return the dof of a leg; 0 for one with loops."""
    joints = [mechanism.joints[name] for name in leg.joints]
    has_loops = len(joints) >= len({link for joint in joints for link in joint.links})
    return 0 if has_loops else sum(joint.type.freedoms for joint in joints)


def _list_hanging(measured: MeasuredRobot, mechanism: Mechanism) -> set[str]:
    """Return joints of what hangs on links that place the platform, or on the base, and holds nothing of it."""
    if mechanism.couplings:
        return set()
    base, bodies = mechanism.base, list_placing_links(measured.setup.decomposition)
    model = measured.observation_model
    pairs = [joint.links for joint in mechanism.joints.values()] + [(base, body) for body in bodies]
    pairs += [
        (seen.seen_from or model.reference, seen.link) for seen in model.observations if not isinstance(seen, Encoder)
    ]
    parts = [part for part in graphs.list_blocks(pairs) if any({base, body} <= part for body in bodies)]
    return {joint.name for joint in mechanism.joints.values() if not any(set(joint.links) <= part for part in parts)}


def _list_kept_directions(
    measured: MeasuredRobot, goal: ClosedConfiguration, free_legs: set[str]
) -> list[tuple[str, Array]]:
    """Return links and directions (3,), at the goal, that no sample turns."""
    mechanism, kept = goal.model.mechanism, list[tuple[str, Array]]()
    for link in mechanism.links:
        if link == mechanism.base or not any(
            link in j.links for j in mechanism.joints.values() if j.name not in free_legs
        ):
            continue
        R = goal.pose(link)[:3, :3]
        turns = [member.configuration.pose(link)[:3, :3] @ R.T - np.eye(3) for member in measured.samples.members]
        _, s, Vt = np.linalg.svd(np.vstack(turns))
        kept += [(link, Vt[k]) for k in range(3) if s[k] < ROTATION_SPREAD_MAX]
    return kept


def _solve(system: NaturalPlatform) -> tuple[Model, SystemModes]:
    """Return the modes, each pose once."""
    if not _is_isolated(system.view):
        raise ExternalSolverFailure("natural coordinates", "the goal is not isolated, to rounding")
    for narrowed in (False, True):
        view, solver = system.view, QuadricSolver()
        boxes, others = solver.solve(view.matrices, view.errors, view.farthest)
        unique = _list_unique(view, boxes)
        if unique is not None:
            break
        # within smaller bounds errors are smaller
        narrower = view.narrow(np.max([np.abs(box.middle) + box.radii for box in boxes], axis=0))
        if narrowed or narrower.size > NARROWER_MAX * view.size:
            raise ExternalSolverFailure("natural coordinates", "a box may hold several solutions")
        system = replace(system, view=narrower)
    assert unique is not None
    modes = _list_poses(system, unique)
    if not any(np.all(np.abs(view.goal - mode.q) <= SAME_POSE_TOL) for mode in modes):
        raise ExternalSolverFailure("natural coordinates", "the goal is in none of the boxes")
    # combinations of a low degree may leave points that are no solutions
    complex_points = [x for x in others if _compute_residual(view, x) <= COMPLEX_RESIDUAL_MAX]
    count = system.count_poses([*(mode.q for mode in modes), *complex_points])
    proof = (
        f"{len(view.goal)} coordinates of points and directions, {solver.left} of them left by linear equations: "
        f"all real solutions{f' within {SLIDE_REACH_MAX:g} characteristic lengths' * system.is_reach_assumed}"
        + f" are in {len(boxes)} box{'es' * (len(boxes) != 1)}"
        + f" of {solver.cases} cases" * (solver.cases > 1)
        + f", by combinations of the equations up to degree {solver.degree}" * bool(solver.degree)
        + f", with errors bounded; {len(modes)} pose{'s' * (len(modes) != 1)}; complex ones are found, {count} in all"
    )
    listed = SystemModes(count, tuple(modes), True, proof, bound="combinations", enclosed=len(modes) == len(unique))
    # legs that are closed one by one need not meet couplings
    coupled = system.goal.model.mechanism.couplings
    return Model(system, system.place_all, view.goal, closing=system.close if coupled else None), listed


def _list_poses(system: NaturalPlatform, unique: Sequence[tuple[Array, Array]]) -> list[SystemMode]:
    """Return a mode for each pose of the platform among middles and radii of boxes with one solution at most."""
    modes = list[SystemMode]()
    for x, radii in unique:
        shift, turn = system.bound_shift(radii)
        at_goal = bool(np.all(np.abs(system.view.goal - x) <= radii))
        mode = SystemMode(
            (),
            max(shift / system.size, turn),
            shift,
            turn,
            float(np.abs(evaluate_quadrics(system.view.matrices, x)[0]).max(initial=0.0)),
            freeze_array(system.place(system.links[0], x)),
            freeze_array(x),
            proved=at_goal,
            match_residual=not at_goal,
        )
        same = next((k for k, known in enumerate(modes) if system.compare(known.q, x) < SAME_POSE_TOL), None)
        if same is None:
            modes.append(mode)
        else:  # legs that are assembled in several ways: not known to be one pose
            known = modes[same]
            first, apart = mode if at_goal else known, system.compare(known.q, x)
            modes[same] = replace(
                first,
                radius=max(first.radius, mode.radius, known.radius) + apart,
                shift=max(first.shift, mode.shift, known.shift) + apart * system.size,
                turn=max(first.turn, mode.turn, known.turn) + apart,
                proved=False,
                match_residual=True,
            )
    return modes


def _compute_residual(view: NaturalView, x: Array) -> float:
    """Return the largest value of the equations at a complex point (n,), relative to its products."""
    extent = 1.0 + float(np.abs(x).max(initial=0.0))
    return float(np.abs(evaluate_quadrics(view.matrices, x)[0]).max(initial=0.0)) / extent**2


def _is_isolated(view: NaturalView) -> bool:
    """Return True if no motion from the goal leaves all equations satisfied to first order."""
    s = np.linalg.svd(evaluate_quadrics(view.matrices, view.goal)[1], compute_uv=False)
    return len(s) == len(view.goal) and bool(s[-1] > GOAL_ISOLATED_MIN * s[0])


def _list_unique(view: NaturalView, boxes: Sequence[SolutionBox]) -> list[tuple[Array, Array]] | None:
    """Return middles and radii of boxes that hold one solution at most, without those that hold none; None where one
    may hold several."""
    unique = list[tuple[Array, Array]]()
    for box in boxes:
        if is_excluded(view.matrices, view.errors, box.middle, box.radii):
            continue
        smaller = enclose_unique(view.matrices, view.errors, box.middle, box.radii)
        if smaller is None:
            return None
        if not is_excluded(view.matrices, view.errors, *smaller):
            unique.append(smaller)
    return unique


def prove_existence(
    mode: AssemblyMode, goal: ClosedConfiguration, observation_model: ObservationModel, moved: float
) -> AssemblyMode:
    """Return a mode of a box with one solution at most, as proved where the assembled robot proves one; ``moved``: how
    far axes are from those of the file (m)."""
    at = mode.configuration
    if mode.goal or at is None or mode.match_residual is None:
        return mode
    try:
        at = at if at.model is goal.model else build_from_link_poses(goal.model, at.pose)
    except LoopClosureFailure:
        return mode
    held = FixedValuesTask.at(goal.model, goal.q, observation_model.reference, observation_model.observations)
    return replace(mode, proved=True, match_residual=None) if is_proved_to_exist(at, held, moved) else mode
