"""Observations of the platform from the base, or of the base from the platform, as loci of points, constant angles of
directions, and conditions on a pose (docs/pages/proofs.md, section 8).

Lines, planes and axes count without their sense: a pose at which a value is the opposite one is *antipodal*, no mode.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...constraints.pattern import list_leg_ends, recognise
from ...errors import UndefinedValue, UnsupportedLocus
from ...geometry.loci import Circle, Line, Plane, Point, Reach, Sphere
from ...geometry.vectors import Array, invert_pose, transform
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.goal_error import ROTATION_LEVER_MIN
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Observation
from ...mechanism.cameras import CameraObservation, FixedValueLocus
from ...mechanism.legs import LegDecomposition
from ...mechanism.observations.direction import Direction, SeenAxis
from ...mechanism.observations.encoder import Encoder
from ...solving.platform.pose_conditions import AtAngle, OnMovingPlane, OnPlane, OnRevolution, PoseCondition
from ...tolerances import CHAIN_ROUNDING, EXACT_INCIDENCE_TOL, MOVED_AXIS_LEVER_MAX
from ..measured import MeasuredRobot
from .leg_conditions import OriginAndUnit
from .tips import KeptAngle, Tip, TipLoci, derive_tip_loci

MEASURED_VALUE_TOL = 1e-3
"""Difference of measured values (unit vectors; characteristic lengths) up to which a mode has the desired value."""


@dataclass(frozen=True, eq=False)
class PlatformObservation:
    """An observation between base and ``body``, a link on which legs end, with its loci in the base frame at the goal
    (m); ``back``: the body carries the camera, and the base is seen."""

    seen: Observation
    body: str
    loci: tuple[FixedValueLocus, ...]
    back: bool

    def error(self, exact: float, goal: ClosedConfiguration) -> float:
        """Return how far a point of its curves within the robot's extent can be from the exact one (m), if a point of
        the robot is known to ``exact``."""
        points = [locus.place for locus in self.loci if not locus.turns] + [
            locus.through for locus in self.loci if not locus.turns
        ]
        if not points:
            return exact
        body = goal.pose(self.body)[:3, 3]
        far = max(float(np.linalg.norm(point - body)) for point in points) / goal.model.length
        spread = max(float(np.linalg.norm(locus.place - locus.through)) for locus in self.loci if not locus.turns)
        bent = 1.0 + (goal.model.length * (1.0 + far) / spread if spread > EXACT_INCIDENCE_TOL else 0.0)
        rounding = CHAIN_ROUNDING * max(float(np.linalg.norm(point)) for point in points)
        return MOVED_AXIS_LEVER_MAX * (exact * max(1.0, far / ROTATION_LEVER_MIN) + rounding) * bent


def separate_sights(
    decomposition: LegDecomposition, observation_model: ObservationModel, goal: ClosedConfiguration
) -> tuple[ObservationModel, tuple[PlatformObservation, ...]]:
    """Return the observations of legs, by their labels, and the others. Raises ``UnsupportedLocus`` if the locus of an
    observation is not known, or if it is neither of a leg nor between base and platform."""
    base, bodies = decomposition.mechanism.base, list_leg_ends(decomposition)
    sights, rest = list[PlatformObservation](), list[Observation]()
    for observation in observation_model.observations:
        reference = observation.seen_from or observation_model.reference
        ends = {reference, observation.link}
        body = next(iter(ends - {base}), base)
        if observation.leg in (*decomposition.labels, "") and (
            observation.is_segment_direction or isinstance(observation, Encoder)
        ):
            rest.append(observation)
        elif isinstance(observation, CameraObservation | SeenAxis) and base in ends and body in bodies:
            loci = observation.loci(observation.sighting(goal.pose(reference), goal.pose(observation.link)))
            if not loci or decomposition.point is not None:
                raise UnsupportedLocus(decomposition.mechanism.name, f"the locus of {observation.text} is not known")
            sights.append(PlatformObservation(observation, body, loci, body == reference))
        else:
            rest.append(_set_leg(decomposition, observation))
    return replace(observation_model, observations=tuple(rest)), tuple(sights)


def _set_leg(decomposition: LegDecomposition, seen: Observation) -> Observation:
    """The coordinate of a leg's joint, or the direction of a leg's link, as the leg's; that of a joint inside the
    platform as of no leg."""
    joint = decomposition.mechanism.joints.get(seen.joint) if isinstance(seen, Encoder) else None
    if joint is not None and set(joint.links) <= set(decomposition.platform):
        return replace(seen, leg="")
    for leg in decomposition.legs:
        if (
            seen.joint in leg.joints
            if isinstance(seen, Encoder)
            else isinstance(seen, Direction) and (seen.link in leg.links)
        ):
            return replace(seen, leg=leg.label)
    raise UnsupportedLocus(decomposition.mechanism.name, f"{seen.text} is of no leg and not between base and platform")


def _add_sights(confined: TipLoci, seen: Sequence[PlatformObservation], goal: ClosedConfiguration) -> TipLoci:
    """Return a platform with its observations. Raises ``UnsupportedLocus`` if these are not points on loci in the base:
    cameras on the platform beside legs that restrict it, angles in a plane."""
    turning = confined.motion in ("spatial", "oriented")
    sides = (
        {sight.back for sight in seen if not _is_symmetric_kind(sight)}
        if turning or confined.motion == "planar"
        else set()
    )
    back = sides == {True}
    if len(sides) > 1 or (back and (confined.tips or confined.angles)):
        raise UnsupportedLocus(
            goal.model.mechanism.name, "cameras on the platform, and legs or observations from the base"
        )
    tips, angles = list(confined.tips), list(confined.angles)
    for sight in seen:
        X, label = goal.pose(sight.body), sight.seen.leg
        turned = sight.back != back  # camera and point change places: all is symmetric, or nothing rotates
        for locus in sight.loci:
            if locus.turns and confined.motion == "planar":
                raise UnsupportedLocus(goal.model.mechanism.name, f"{sight.seen.text} keeps an angle in a plane")
            if locus.turns:
                pairs = [(n, locus.place) if turned else (locus.place, n) for n in locus.normals if turning]
                angles += [KeptAngle(label, sight.body, X[:3, :3].T @ d, axis, 0.0) for d, axis in pairs]
                continue
            place, through = (locus.through, locus.place) if turned else (locus.place, locus.through)
            reach = _convert_locus(replace(locus, place=place, through=through), confined.plane)
            if reach is not None:
                tips.append(Tip(label, sight.body, X[:3, :3].T @ (place - X[:3, 3]), reach))
    return replace(confined, tips=tuple(tips), angles=tuple(angles), back=back)


def derive_all_loci(
    measured: MeasuredRobot, goal: ClosedConfiguration
) -> tuple[TipLoci, tuple[PlatformObservation, ...]]:
    """Return the loci of tips of legs and observed points, all other measured values fixed; and the observations.
    Raises ``UnsupportedLocus``."""
    setup = measured.setup
    if setup.decomposition.point is not None and len(list_leg_ends(setup.decomposition)) > 1:
        raise UnsupportedLocus(setup.robot.name, "legs end on several links of a platform that is a point")
    rest, seen = separate_sights(setup.decomposition, measured.observation_model, goal)
    if not seen:
        return derive_tip_loci(setup.decomposition, rest, measured.generic_pattern, goal), ()
    if rest.observations:
        pattern = recognise(setup.decomposition, rest, setup.configurations, everywhere=False)
        confined = derive_tip_loci(setup.decomposition, rest, pattern, goal)
    else:
        confined = _build_unheld(measured, goal)
    if confined.motion == "translations" and setup.dof < 3:
        raise UnsupportedLocus(setup.robot.name, "its legs restrict how the platform moves")
    return _add_sights(confined, seen, goal), seen


def _build_unheld(measured: MeasuredRobot, goal: ClosedConfiguration) -> TipLoci:
    """Return a platform without a leg. Raises ``UnsupportedLocus`` if legs restrict its motion."""
    decomposition, dof = measured.setup.decomposition, measured.setup.dof
    bodies = list_leg_ends(decomposition)
    if len(bodies) > 1:
        raise UnsupportedLocus(decomposition.mechanism.name, "legs end on several links")
    motion, normal = measured.moving
    if dof != {"translations": dof, "planar": 3, "spatial": 6}[motion]:
        raise UnsupportedLocus(decomposition.mechanism.name, "its legs restrict how the platform moves")
    return TipLoci(goal, motion, (), bodies, normal)


def _is_symmetric_kind(sight: PlatformObservation) -> bool:
    """Return True if it is the same condition on the camera relative to the point: a distance, a position, angles."""
    return all(locus.turns or len(locus.normals) in (0, 3) for locus in sight.loci)


def _convert_locus(locus: FixedValueLocus, plane: Array | None) -> Reach | None:
    """Return the locus of a point that moves in space, or in the plane through it with a normal; None: anywhere
    there."""
    if plane is None:
        if locus.radius is not None:
            return Sphere(locus.through, locus.radius)
        if len(locus.normals) == 1:
            return Plane(locus.through, locus.normals[0])
        return Line(locus.through, np.cross(*locus.normals)) if len(locus.normals) == 2 else Point(locus.through)
    if locus.radius is not None:
        v = locus.place - locus.through
        centre = locus.through + plane * float(plane @ v)
        return Circle(centre, plane, float(np.linalg.norm(locus.place - centre)))
    flat = locus.normals - np.outer(locus.normals @ plane, plane)
    _, sizes, rows = np.linalg.svd(flat)
    rank = int(np.sum(sizes > EXACT_INCIDENCE_TOL))
    return None if not rank else Line(locus.place, np.cross(plane, rows[0])) if rank == 1 else Point(locus.place)


def list_plane_conditions(
    seen: Sequence[PlatformObservation], middle: OriginAndUnit, turned: bool
) -> list[PoseCondition]:
    """Return the conditions on the platform's pose, relative to the goal, of a camera on it that observes moving
    planes; or, ``turned``, on the base's relative to the platform."""
    conditions, none, up = list[PoseCondition](), np.zeros(3), np.array([0.0, 0.0, 1.0])
    for sight in seen:
        label, back = sight.seen.leg, sight.back != turned
        for locus in sight.loci:
            if locus.turns:
                conditions += [
                    AtAngle(label, none, n if back else locus.place, locus.place if back else n, float(n @ locus.place))
                    for n in locus.normals
                ]
                continue
            place, through = middle.point(locus.place), middle.point(locus.through)
            body, rest = (through, place) if back else (place, through)
            if locus.radius is not None:
                conditions.append(
                    OnRevolution(label, body, none, rest, up, np.array([(locus.radius / middle.size) ** 2, 0.0, -1.0]))
                )
            elif back and len(locus.normals) < 3:
                conditions += [OnMovingPlane(label, body, n, rest, float(n @ (rest - body))) for n in locus.normals]
            else:
                conditions += [OnPlane(label, body, none, n, float(n @ rest)) for n in locus.normals]
    return conditions


Poses = Callable[[str], Array]


def list_opposite(
    seen: Sequence[Observation], goal: ClosedConfiguration, reference: str, pose: Poses
) -> tuple[str, ...]:
    """Return the observations whose value at a pose of the links is the opposite of the goal's."""
    return tuple(
        observation.leg
        for observation in seen
        if not _has_goal_value(observation, observation.seen_from or reference, goal, pose)
    )


def _has_goal_value(seen: Observation, reference: str, goal: ClosedConfiguration, pose: Poses) -> bool:
    try:
        value = seen.value(pose(reference), pose(seen.link))
    except UndefinedValue:
        return False
    off = seen.difference(value, seen.value(goal.pose(reference), goal.pose(seen.link)))
    return bool(np.all(np.abs(off / goal.model.length ** np.asarray(seen.dimension)) <= MEASURED_VALUE_TOL))


def list_behind(observed: Sequence[Observation], pose: Poses) -> tuple[str, ...] | None:
    """Return the observed points and circles that are not in front of their cameras, by their names: z ≤ 0 in the
    camera's frame; None if no named camera observes a point."""
    points = [o for o in observed if isinstance(o, CameraObservation) and o.camera is not None and o.images_point]
    if not points:
        return None
    return tuple(
        o.leg
        for o in points
        if o.camera is not None
        and transform(invert_pose(pose(o.camera.link) @ o.camera.pose), transform(pose(o.link), o.at))[2] <= 0.0
    )
