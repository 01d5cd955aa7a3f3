"""All modes of a robot in natural coordinates, whatever its legs: real ones, each in a box of its own (docs/pages/
proofs.md, section 8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...constraints.pattern import list_leg_ends
from ...equations.natural_view import NaturalView, read_natural_view
from ...errors import ExternalSolverFailure, UnsupportedLocus
from ...geometry.vectors import Array, build_pose, compare_poses, freeze_array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.observations.encoder import Encoder
from ...solving.quadric_solver import QuadricSolver, SolutionBox
from ...solving.uniqueness import enclose_unique, evaluate_quadrics, is_excluded
from ..measured import MeasuredRobot
from .branches import Model
from .constrained_platform import System
from .solve import SystemMode, SystemModes

LEG_FREEDOMS_MIN = 6
"""Least freedoms of a leg that holds nothing of the platform."""
SAME_POSE_TOL = 1e-6
"""Difference (characteristic lengths, entries of rotations) up to which poses are listed as one."""
ROTATION_SPREAD_MAX = 1e-8
"""Change of a direction over the samples up to which none turns it."""
GOAL_ISOLATED_MIN = 1e-9
"""Smallest singular value of the equations at the goal, over the largest, where it is isolated."""


@dataclass(frozen=True, eq=False, repr=False)
class NaturalPlatform(System):
    """A robot in natural coordinates; q are those of the view."""

    goal: ClosedConfiguration
    view: NaturalView
    links: tuple[str, ...]
    kept: bool
    """True if directions that no sample turns are held."""

    freedoms = 6

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.goal.model.length

    def place(self, link: str, x: Array) -> Array:
        """Return the pose (4, 4) of a link at x."""
        group, origin, _ = self.view.links[link]
        basis = self.view.groups[group][0]
        values = np.append(1.0, x)
        images = np.array([self.view.direction(link, column) @ values for column in basis.T]).reshape(-1, 3).T
        if basis.shape[1] == 2:
            basis, images = (np.column_stack([M, np.cross(*M.T)]) for M in (basis, images))
        U, _, Vt = np.linalg.svd(images @ basis.T)
        R = U @ Vt
        there = self.view.point(link, origin) @ values
        moved = build_pose(self.size * (there - R @ origin), R)
        return np.asarray(moved @ self.goal.pose(link))

    def place_all(self, x: Array) -> dict[str, Array]:
        """Return the poses (4, 4) of the links on which legs end."""
        return {link: self.place(link, x) for link in self.links}

    def bound_shift(self, radii: Array) -> tuple[float, float]:
        """Return how far (m) and by which angle (rad) a link's pose can be from that at the middle of a box."""
        shift = turn = 0.0
        for link in self.links:
            group, origin, own = self.view.links[link]
            places = self.view.groups[group][1]
            turned = 0.0 if places is None else float(np.linalg.norm(radii[places]))
            moved = 0.0 if own is None else float(np.linalg.norm(radii[own]))
            arm = float(np.linalg.norm(self.goal.pose(link)[:3, 3] / self.size - origin))
            # images to the nearest rotation: twice; a third one of two: twice
            turn = max(turn, 4.0 * turned)
            shift = max(shift, self.size * (moved + 4.0 * turned * (arm + float(np.linalg.norm(origin)))))
        return shift, turn


def solve_natural(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0) -> tuple[Model, SystemModes]:
    """All real modes, with the goal known to ``error`` (m); those that keep the directions that no sample turns, where
    others cannot be confined. Raises ``UnsupportedLocus`` and ``ExternalSolverFailure``."""
    if not np.isfinite(error):
        raise UnsupportedLocus(
            measured.setup.robot.name, "the distance to the exact closed configuration is not bounded"
        )
    whole = _read(measured, goal, error, kept=False)
    try:
        return _solve(whole)
    except ExternalSolverFailure:
        kept = _read(measured, goal, error, kept=True)
        if len(kept.view.matrices) == len(whole.view.matrices):
            raise
        return _solve(kept)


def _read(measured: MeasuredRobot, goal: ClosedConfiguration, error: float, kept: bool) -> NaturalPlatform:
    """Return the robot without legs that hold nothing."""
    setup, model = measured.setup, measured.observation_model
    mechanism, name = goal.model.mechanism, setup.robot.name
    if setup.decomposition.point is not None or model.reference != mechanism.base:
        raise UnsupportedLocus(name, "its platform is a point, or seen from a link that is not its base")
    seen = {each.joint for each in model.observations if isinstance(each, Encoder)}
    links = {each.link for each in model.observations}
    idle = [
        leg
        for leg in setup.decomposition.legs
        if not seen & {*leg.joints}
        and not links & {*leg.links}
        and sum(mechanism.joints[joint].type.freedoms for joint in leg.joints) >= LEG_FREEDOMS_MIN
    ]
    idle_joints = {joint for leg in idle for joint in leg.joints}
    resting = _list_resting_directions(measured, goal, idle_joints) if kept else []
    view = read_natural_view(goal, model.observations, idle_joints, resting, error)
    bodies = list_leg_ends(setup.decomposition)
    for link in bodies:
        if link not in view.links or view.groups[view.links[link][0]][0].shape[1] < 2:
            raise UnsupportedLocus(name, f"the joints do not place {link}")
    return NaturalPlatform((), np.zeros((0, 3)), goal, view, bodies, kept, error=error)


def _list_resting_directions(
    measured: MeasuredRobot, goal: ClosedConfiguration, idle: set[str]
) -> list[tuple[str, Array]]:
    """Return links and directions (3,), at the goal, that no sample turns."""
    mechanism, found = goal.model.mechanism, list[tuple[str, Array]]()
    for link in mechanism.links:
        if link == mechanism.base or not any(link in j.links for j in mechanism.joints.values() if j.name not in idle):
            continue
        R = goal.pose(link)[:3, :3]
        turns = [member.configuration.pose(link)[:3, :3] @ R.T - np.eye(3) for member in measured.samples.members]
        _, s, Vt = np.linalg.svd(np.vstack(turns))
        found += [(link, Vt[k]) for k in range(3) if s[k] < ROTATION_SPREAD_MAX]
    return found


def _solve(system: NaturalPlatform) -> tuple[Model, SystemModes]:
    """Return the modes, each pose once, the goal first."""
    view, solver = system.view, QuadricSolver()
    if not _is_isolated(view):
        raise ExternalSolverFailure("natural coordinates", "the goal is not isolated, to rounding")
    boxes = solver.solve(view.matrices, view.errors, view.farthest)
    n, m = len(view.goal), solver.left
    modes = list[SystemMode]()
    for x, radii in _list_unique(view, boxes):
        shift, turn = system.bound_shift(radii)
        pose = system.place(system.links[0], x)
        same = next((k for k, e in enumerate(modes) if compare_poses(e.pose, pose, system.size) < SAME_POSE_TOL), None)
        at_goal = bool(np.all(np.abs(view.goal - x) <= radii))
        mode = SystemMode(
            (),
            max(shift / system.size, turn),
            shift,
            turn,
            float(np.abs(evaluate_quadrics(view.matrices, x)[0]).max(initial=0.0)),
            freeze_array(pose),
            freeze_array(x),
            proved=at_goal,
            match_residual=not at_goal,
        )
        if same is None:
            modes.append(mode)
        else:  # legs that are assembled in several ways: not known to be one pose
            first = modes[same] if not at_goal else mode
            modes[same] = replace(
                first,
                radius=first.radius + SAME_POSE_TOL,
                shift=first.shift + SAME_POSE_TOL * system.size,
                turn=first.turn + SAME_POSE_TOL,
                proved=False,
                match_residual=True,
            )
    if not any(np.all(np.abs(view.goal - mode.q) <= SAME_POSE_TOL) for mode in modes):
        raise ExternalSolverFailure("natural coordinates", "the goal is in none of the boxes")
    proof = (
        f"{n} coordinates of points and directions, {m} of them left by linear equations: all real solutions are in "
        f"{len(boxes)} box{'es' * (len(boxes) != 1)}"
        + (f" of {solver.cases} cases" if solver.cases > 1 else "")
        + (f", by combinations of the equations up to degree {solver.degree}" if solver.degree else "")
        + f", with errors bounded; {len(modes)} pose{'s' * (len(modes) != 1)}"
    )
    found = SystemModes(None, tuple(modes), True, proof, bound="combinations", enclosed=True)
    return Model(system, system.place_all, view.goal), found


def _is_isolated(view: NaturalView) -> bool:
    """Return True if no motion from the goal leaves all equations satisfied to first order."""
    s = np.linalg.svd(evaluate_quadrics(view.matrices, view.goal)[1], compute_uv=False)
    return len(s) == len(view.goal) and bool(s[-1] > GOAL_ISOLATED_MIN * s[0])


def _list_unique(view: NaturalView, boxes: Sequence[SolutionBox]) -> list[tuple[Array, Array]]:
    """Return middles and radii of boxes that hold one solution at most, without those that hold none; raises
    ``ExternalSolverFailure``."""
    found = list[tuple[Array, Array]]()
    for box in boxes:
        if is_excluded(view.matrices, view.errors, box.middle, box.radii):
            continue
        one = enclose_unique(view.matrices, view.errors, box.middle, box.radii)
        if one is None:
            raise ExternalSolverFailure("natural coordinates", "a box may hold several solutions")
        if not is_excluded(view.matrices, view.errors, *one):
            found.append(one)
    return found
