"""Legs in closed form, read from their joints and verified at closed configurations: one reading for all.

A *tip* is a point that the platform's pose alone decides. A rod leads to it from a link that an R or a P joins to the
base; or it slides through it, along a line that keeps its distance from a base point. What is proposed counts only if
it holds at all configurations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.lines import project_to_line
from ..geometry.vectors import Array, cross, invert_pose
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg
from ..mechanism.normal import locate_centre_pair
from ..tolerances import HIDDEN_ROBOT_RESIDUAL_TOL
from .legs import ClosedFormLeg, FixedDirection, OnCrank, OnRail, OnRod, PlatformDirection, RailAndLine, SlidingRod
from .platform_points import PlatformPoint


@dataclass(frozen=True, eq=False)
class LegTip:
    """A tip at ``point`` (3,) at zero, m; ``rule`` gives the laws by which points of its link follow from the pose.
    Between a ``joint`` and others, rods are as their axes are apart (two R: their common perpendicular)."""

    point: Array
    rule: Callable[[Array], PlatformPoint]
    joint: Joint | None = None

    def segments(self, other: Joint) -> Iterator[tuple[Array, PlatformPoint]]:
        """Yield the start of a rod from another joint, at zero, m, and its tip."""
        near, far = (other.point, self.point) if self.joint is None else locate_centre_pair(other, self.joint)
        for start in dict.fromkeys(map(tuple, (near, other.point))):
            yield np.array(start), self.rule(far)


@dataclass(frozen=True, eq=False)
class LegReader:
    """A leg at sampled configurations: the platform's poses p (m, 3), R (m, 3, 3) and those of its links (m, 4, 4), in
    units of ``length`` (m)."""

    mechanism: Mechanism
    leg: Leg
    frames: Mapping[str, Array]
    p: Array
    R: Array
    length: float = 1.0

    @property
    def joints(self) -> list[Joint]:
        """The leg's joints."""
        return [self.mechanism.joints[name] for name in self.leg.joints]

    @property
    def feet(self) -> list[Joint]:
        """The leg's joints on the base."""
        return [joint for joint in self.joints if self.mechanism.base in joint.links]

    @property
    def tolerance(self) -> float:
        """Largest difference of points that are the same."""
        return HIDDEN_ROBOT_RESIDUAL_TOL * self.mechanism.length / self.length

    def moved(self, link: str, point: Array) -> Array:
        """The places (m, 3) of a link's point, given at zero, m."""
        place = (invert_pose(self.mechanism.links[link].pose) @ np.append(point, 1.0))[:3] / self.length
        X = self.frames[link]
        return np.asarray(X[:, :3, :3] @ place + X[:, :3, 3])

    def rods(self, tip: LegTip) -> Iterator[tuple[OnRod, Joint, Array]]:
        """Yield rods of constant length, the joints at which they begin and the places (m, 3) of these."""
        for foot in self.feet:
            crank = foot.other(self.mechanism.base)
            for joint in self.joints:
                if foot.type not in (JointType.REVOLUTE, JointType.PRISMATIC) or joint is foot:
                    continue
                for start, rule in tip.segments(joint) if crank in joint.links else ():
                    ends = self.moved(crank, start)
                    rods = np.linalg.norm(rule.value(self.p, self.R) - ends, axis=1)
                    form = _read_rod(self.leg.label, rule, foot, crank, start, float(rods[0]), self.length)
                    if form is not None and np.ptp(rods) < self.tolerance:
                        yield form, joint, ends

    def sliding_rods(self, tip: LegTip, u: Array) -> Iterator[tuple[SlidingRod, Joint]]:
        """Yield rods with directions u (m, 3) that slide through a tip, and the joints on the base that they pass."""
        for foot in self.feet:
            for start, rule in tip.segments(foot):
                centre = start / self.length
                D = rule.value(self.p, self.R) - centre
                form = SlidingRod(self.leg.label, rule, centre=centre)
                if np.max(np.linalg.norm(cross(D, u), axis=1)) < self.tolerance:
                    yield form, foot
                elif foot.type is JointType.REVOLUTE and np.max(np.abs(u @ foot.axis)) < HIDDEN_ROBOT_RESIDUAL_TOL:
                    offsets = np.einsum("ij,ij->i", D, cross(foot.axis, u))
                    if np.ptp(offsets) < self.tolerance:
                        yield replace(form, axis=foot.axis, aside=float(offsets[0])), foot

    def directions(self, tips: Sequence[LegTip], u: Array) -> Iterator[tuple[ClosedFormLeg, Array]]:
        """Yield the leg with observed directions u (m, 3), and what it carries at all configurations."""
        turned = PlatformDirection(self.leg.label, axis=self.R[0].T @ u[0])
        if sum(joint.type.has_translation for joint in self.joints) >= 2:
            yield FixedDirection(self.leg.label, axis=u[0]), u
            yield turned, u
        if self.leg.takes_platform:
            yield turned, u
        for tip in tips:
            yield from ((form, u) for form in self.crossings(tip, turned, u))
        for tip in tips:
            yield from ((form, u) for form, _ in self.sliding_rods(tip, u))
            yield from ((form, ends) for form, _, ends in self.rods(tip))

    def crossings(self, tip: LegTip, turned: PlatformDirection, u: Array) -> Iterator[PlatformDirection]:
        """Yield a crank whose end slides along a line of the platform: an R at the base, an R, a P."""
        if sorted(joint.type.value for joint in self.joints) != ["P", "R", "R"]:
            return
        for foot in self.feet:
            crank = foot.other(self.mechanism.base)
            for joint in self.joints:
                if joint is foot or crank not in joint.links or {foot.type, joint.type} != {JointType.REVOLUTE}:
                    continue
                place, rule = joint.point / self.length, tip.rule(joint.point)
                B, centre = self.moved(crank, joint.point), project_to_line(place, foot.point / self.length, foot.axis)
                if np.max(np.abs(cross(B - rule.value(self.p, self.R), u))) < self.tolerance:
                    yield replace(
                        turned,
                        tip=rule,
                        mode=-1.0 if (B[0] - centre) @ u[0] < 0 else 1.0,
                        centre=centre,
                        pivot=foot.axis,
                        radius=float(np.linalg.norm(place - centre)),
                        crank=crank,
                        place=place,
                    )

    def recognise(self, tips: Sequence[LegTip], u: Array) -> ClosedFormLeg | None:
        """Return the leg with observed directions u (m, 3), in the working mode of the first configuration."""
        for form, carried in self.directions(tips, u):
            leg = form.oriented(self.p, self.R, u, carried)
            if leg is not None:
                return leg
        return None


def _read_rod(
    label: str, tip: PlatformPoint, foot: Joint, crank: str, start: Array, rod: float, length: float
) -> OnRod | None:
    """The rod of this length from the point ``start`` of the crank or slider, at zero, m; None if it does not move."""
    place = start / length
    if foot.type is JointType.PRISMATIC:
        return OnRail(label, tip, centre=place, axis=foot.axis, rod=rod, crank=crank, place=place)
    centre = project_to_line(place, foot.point / length, foot.axis)
    radius = float(np.linalg.norm(place - centre))
    if radius * length < HIDDEN_ROBOT_RESIDUAL_TOL:
        return None
    return OnCrank(label, tip, centre=centre, axis=foot.axis, radius=radius, rod=rod, crank=crank, place=place)


def list_motor_forms(
    mechanism: Mechanism,
    legs: Mapping[Leg, ClosedFormLeg | None],
    motor: Joint,
    on_platform: Callable[[Array], PlatformPoint],
) -> Iterator[ClosedFormLeg]:
    """Yield the forms that may decide a motor's coordinate: those of its leg, lines of the platform that pass one of
    the leg's joints, and a link between the motor and the platform; ``on_platform`` is the rule of its points."""
    if mechanism.base in motor.links:
        for joint in mechanism.joints_of(motor.other(mechanism.base)):
            if mechanism.platform in joint.links:
                yield PlatformDirection(motor.name, on_platform(joint.point), axis=motor.axis)
    for leg, form in legs.items():
        if motor.name not in leg.joints or form is None:
            continue
        yield form
        joints = [mechanism.joints[name] for name in leg.joints]
        tips = [form.tip, *([on_platform(motor.point)] if mechanism.platform in motor.links else [])]
        yield from (replace(form, tip=tip, centre=joint.point, radius=0.0) for tip in tips for joint in joints)
        others = sorted((joint for joint in joints if joint is not motor), key=lambda joint: joint.type.value)
        if motor.type is JointType.PRISMATIC and [joint.type.value for joint in others] == ["P", "R"]:
            # the line along the P goes with the platform, or with the slider
            slide, turn = others
            normal, R = cross(slide.axis, turn.axis), mechanism.links[mechanism.platform].pose[:3, :3]
            line = RailAndLine(
                leg.label, on_platform(turn.point), centre=turn.point, axis=motor.axis, normal=normal, turns=False
            )
            yield from (line, replace(line, normal=R.T @ normal, turns=True))
