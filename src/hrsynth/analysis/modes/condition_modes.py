"""Modes of a rigid platform from the conditions of its legs (docs/pages/proofs.md, section 8).

The number is at least that of disjoint boxes, complex ones too, and at most that of the degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod

import numpy as np

from ...constraints.pattern import list_leg_ends
from ...errors import ExternalSolverFailure, UnsupportedLocus
from ...geometry.so3 import convert_from_quaternion, convert_rotations_to_vectors, convert_vectors_to_rotations
from ...geometry.vectors import Array, build_pose, freeze_array, invert_pose
from ...kinematics.configuration import ClosedConfiguration
from ...solving.platform.constrained_platform import System
from ...solving.platform.overdetermined import describe_fits
from ...solving.platform.pose_bound import FEW_FORMS_SECONDS, FORMS_SECONDS, LARGEST_FORMS, bound
from ...solving.platform.pose_boxes import PoseBox, describe_far, enclose_poses, is_box_excluded
from ...solving.platform.pose_conditions import OnPlane, PoseCondition
from ...solving.platform.pose_forms import Poses, SquareForms, propose_poses
from ...solving.platform.solve import SystemMode, SystemModes
from ...tolerances import LOCUS_DISTANCE_TOL, MOVED_AXIS_LEVER_MAX, POINT_DISTANCE_TOL, RANK_GAP_MIN, RELATION_ANGLE_TOL
from ..loci.leg_conditions import Branches, OriginAndUnit, list_leg_conditions, require_rigid_platform
from ..loci.observation_loci import PlatformObservation, list_plane_conditions, separate_sights
from ..measured import MeasuredRobot
from .tip_systems import LEG_SOLUTION_CHOICES_MAX, MODES_TIME_LIMIT_S, Model, unite_modes


@dataclass(frozen=True, eq=False)
class PosedPlatform(System):
    """A rigid platform on ``conditions``: q is the position of its origin (m), which is at ``middle.origin`` at the
    goal, and the rotation vector of its turn from there."""

    conditions: tuple[PoseCondition, ...]
    middle: OriginAndUnit
    poses: Poses
    back: bool = False
    """True if the pose is that of the base, relative to the platform."""
    seen: tuple[PlatformObservation, ...] = ()
    branches: Mapping[str, int] = field(default_factory=dict)
    """Number of conditions of each leg."""

    freedoms = 6

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.middle.size

    @property
    def home(self) -> Array:
        """The goal."""
        return np.array([*self.middle.origin, 0.0, 0.0, 0.0])

    def pose(self, q: Array) -> Array:
        """The platform's frame in the base frame; shape (4, 4)."""
        return build_pose(q[:3], convert_vectors_to_rotations(q[3:]))

    def place(self, box: PoseBox) -> Array:
        """q at the middle of a real box."""
        turn, p = box.pose(self.poses)
        return np.array(
            [*(self.middle.origin + self.size * p), *convert_rotations_to_vectors(convert_from_quaternion(turn))]
        )

    def miss(self, box: PoseBox) -> float:
        """The largest distance from a condition (sizes) at the middle of a real box."""
        turn, p = box.pose(self.poses)
        R, misses = convert_from_quaternion(turn), [0.0]
        for c in self.conditions:
            point, arrow = p + R @ c.b, R @ c.c
            slope = np.hstack(c.slopes(point, arrow, np.asarray))
            misses.append(abs(float(c.value(point, arrow, np.asarray))) / max(1.0, float(np.linalg.norm(slope))))
        return max(misses)


def build_posed_platforms(measured: MeasuredRobot, goal: ClosedConfiguration) -> list[PosedPlatform]:
    """The platform with the measurements at a configuration, one for each choice of the legs' branches, the goal's own
    first. Raises ``UnsupportedLocus`` where a leg's conditions are not known."""
    decomposition, name = measured.setup.decomposition, measured.setup.robot.name
    _, middle = require_rigid_platform(measured, goal)
    motion, normal = measured.moving
    rest, seen = separate_sights(decomposition, measured.observation_model, goal)
    by_leg = [
        list_leg_conditions(decomposition, leg, rest, goal, middle, normal, motion == "translations")
        for leg in decomposition.legs
    ]
    moved = MOVED_AXIS_LEVER_MAX * sum(off for _, off in by_leg)
    held = any(branch for branches, _ in by_leg for branch in branches)
    ways = [(turned, list_plane_conditions(seen, middle, turned)) for turned in ((False,) if held else (False, True))]
    turned, fewest = min(ways, key=lambda way: sum(c.degree for c in way[1]))
    counts = {leg.label: len(branches) for leg, (branches, _) in zip(decomposition.legs, by_leg, strict=True)}
    by_leg.append(([fewest], 0.0))
    legs: list[Branches] = [branches for branches, _ in by_leg]
    if prod(map(len, legs)) > LEG_SOLUTION_CHOICES_MAX:
        raise UnsupportedLocus(name, f"its legs have {prod(map(len, legs))} combinations of leg solutions")
    if any(
        abs(float(c.value(c.b, c.c, np.asarray)))
        > RELATION_ANGLE_TOL * (1.0 + float(np.abs(getattr(c, "f", 0.0)).max()))
        for branches in legs
        for c in branches[0]
    ):
        raise UnsupportedLocus(name, "the conditions of its legs are not met at the pose itself")
    poses = (
        Poses.translating() if motion == "translations" else Poses.spatial() if normal is None else Poses.planar(normal)
    )
    asked = (_drop_repeats([c for branch in chosen for c in branch]) for chosen in product(*legs))
    return [
        PosedPlatform(
            (),
            np.zeros((0, 3)),
            kept,
            middle,
            poses,
            turned,
            seen,
            counts,
            error=moved + MOVED_AXIS_LEVER_MAX * goal.model.length * off,
        )
        for kept, off in asked
    ]


def _drop_repeats(conditions: Sequence[PoseCondition]) -> tuple[tuple[PoseCondition, ...], float]:
    """Conditions without those that several legs have in common, as where all turn about one point; and how far the
    numbers of such are apart (sizes)."""
    kept, off = list[PoseCondition](), 0.0
    for c in conditions:
        apart = min(
            (
                max(float(np.abs(c.b - k.b).max()), float(np.abs(c.n - k.n).max()), abs(c.h - k.h))
                for k in kept
                if isinstance(c, OnPlane) and isinstance(k, OnPlane)
            ),
            default=np.inf,
        )
        if apart > POINT_DISTANCE_TOL / RANK_GAP_MIN:
            kept.append(c)
        else:
            off = max(off, apart)
    return tuple(kept), off


def bound_posed(measured: MeasuredRobot, goal: ClosedConfiguration) -> int:
    """Return a root bound of the modes, complex ones too. Raises ``UnsupportedLocus``."""
    return sum(_build_forms(measured, platform).most for platform in build_posed_platforms(measured, goal))


def solve_posed(
    measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0, time_limit: float = MODES_TIME_LIMIT_S
) -> tuple[Model, SystemModes]:
    """All modes of all choices of branches together, with the goal known to ``error`` (m). Raises ``UnsupportedLocus``,
    and ``ExternalSolverFailure`` where not all poses are enclosed that there may be, or the choices need more than
    ``time_limit`` (s)."""
    systems = [
        replace(platform, error=platform.error + max([error, *(sight.error(error, goal) for sight in platform.seen)]))
        for platform in build_posed_platforms(measured, goal)
    ]
    if not np.isfinite(error):
        raise UnsupportedLocus(
            measured.setup.robot.name, "the distance to the exact closed configuration is not bounded"
        )
    (body,) = list_leg_ends(measured.setup.decomposition)
    first = systems[0]
    X, back = goal.pose(body), invert_pose(build_pose(first.middle.origin))
    made = Model(
        first,
        lambda q: {body: (invert_pose if first.back else np.asarray)(first.pose(q) @ back) @ X},
        first.home,
        first.back,
    )
    forms, solved = _build_forms(measured, first), list[SystemModes]()
    needed = len(systems) * (FEW_FORMS_SECONDS + FORMS_SECONDS * (forms.size / LARGEST_FORMS) ** 3)
    if needed > max(time_limit, FEW_FORMS_SECONDS * (len(systems) == 1)):
        raise ExternalSolverFailure(
            "conditions on the pose",
            f"{len(systems)} combinations of leg solutions, {forms.size} monomials each, need "
            f"about {needed:.2g} s, more than the time limit of {time_limit:g} s",
            "Observe other legs, or raise --time-limit.",
        )
    for system in systems:
        solved.append(_judge(system, _build_forms(measured, system), system is first))
        if not solved[-1].complete:
            raise ExternalSolverFailure("the conditions on the pose", solved[-1].proof)
    return made, unite_modes(solved, first.branches, first.size)


def _build_forms(measured: MeasuredRobot, system: PosedPlatform) -> SquareForms:
    """Return as many of its conditions as dof. Raises ``UnsupportedLocus``, ``ExternalSolverFailure``."""
    forms = SquareForms.of(system.conditions, system.poses)
    if forms is None:
        raise UnsupportedLocus(measured.setup.robot.name, "the conditions of its legs do not determine isolated poses")
    if forms.size > LARGEST_FORMS:
        raise ExternalSolverFailure(
            "conditions on the pose",
            f"a polynomial system with up to {forms.most} solutions needs {forms.size} monomials of degree "
            f"{forms.degree}, more than the {LARGEST_FORMS} that this method handles",
        )
    return forms


def _judge(system: PosedPlatform, forms: SquareForms, own: bool) -> SystemModes:
    """The modes: as many as the degrees allow, or else as the ranks of all multiples of the conditions do; ``own``:
    whether the goal is one."""
    slack = system.error / system.size
    product_ = (
        (
            f"the product of degrees {' · '.join(map(str, forms.degrees))}"
            f"{f' / {2 ** forms.shape[1]}' if forms.shape[1] else ''} (Bézout)"
        )
        if forms.degrees
        else "conditions that are all linear"
    )
    most, why, named = forms.most, product_, "class"
    proposed = propose_poses(forms, forms.degree, forms.most, 0)
    boxes, lost = ([], 1) if proposed is None else enclose_poses(forms, slack, proposed, most)
    if len(boxes) < most:
        bounded = bound(forms)
        if bounded is not None:
            most, why, named = bounded[0], f"ranks modulo a prime of 62 bits, in degree {bounded[1]}", "rank"
            if lost or len(boxes) < most:
                proposed, lost = propose_poses(forms, bounded[1], most, bounded[2]), 1
        if lost:
            boxes = [] if proposed is None else enclose_poses(forms, slack, proposed)[0]
    at_goal = [box for box in boxes if own and box.real and box.has_pose(np.eye(len(box.middle))[0])]
    goal = at_goal[0] if len(at_goal) == 1 else None
    complete = len(boxes) == most and (goal is not None) == own
    real = [box for box in boxes if box.real]
    proof = (
        f"at most {most} pose{'s' * (most != 1)} by {why}, {len(boxes)} enclosed, all distinct, "
        f"complex ones too{describe_far(boxes)}, {len(real)} real"
    )
    left = [c for c in system.conditions if c not in forms.planes and c not in forms.others]
    kept = [box for box in real if box is goal or not is_box_excluded(left, forms.poses, box, slack)]
    fitting = [box for box in kept if not left or box is goal or system.miss(box) <= LOCUS_DISTANCE_TOL]
    modes = tuple(_make_mode(system, box, not left or box is goal) for box in fitting)
    open_ = len(kept) - len(fitting)
    if left:
        others = [mode.residual for mode in modes if not mode.proved]
        proof = (
            f"from {len(system.conditions) - len(left)} of {len(system.conditions)} conditions: {proof}; of these "
            + describe_fits(goal is not None, False, others, len(real) - len(kept), open_)
        )
    return SystemModes(
        len(modes) if left else len(boxes),
        modes,
        complete and not open_,
        proof,
        bound=named if complete else "none",
        enclosed=complete,
    )


def _make_mode(system: PosedPlatform, box: PoseBox, proved: bool) -> SystemMode:
    """A real box as a mode."""
    shift = system.size * float(np.linalg.norm(box.radii[box.turned :]))
    # two unit quaternions at the distance δ are rotated against each other by at most 4 asin(δ / 2) ≤ π δ
    turn = np.pi * float(np.linalg.norm(box.radii[: box.turned]))
    q = system.place(box)
    return SystemMode(
        (),
        max(shift / system.size, turn),
        shift,
        turn,
        system.miss(box),
        freeze_array(system.pose(q)),
        freeze_array(q),
        proved=proved,
        match_residual=not proved,
    )
