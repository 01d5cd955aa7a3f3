"""Motors of a pose in closed form: what each leg carries (:mod:`..closed_forms`) determines its motor's coordinate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..analysis.branch.answer import BranchProof
from ..analysis.branch.loop_parts import split_loop_system
from ..analysis.branch.loops import TreeCoordinate
from ..analysis.observed import ObservedRobot, RobotLike
from ..batch.engine import Batch
from ..batch.tape import Tape
from ..closed_forms.legs import ClosedFormLeg, OnCrank, OnRod, PinnedRod, PlatformDirection, RailAndLine, SlidingRod
from ..closed_forms.platform_points import PlatformPoint
from ..errors import HrsynthError
from ..geometry.components import Components, arctan2, dot, minus, plus, scale, transform_vector
from ..geometry.components import cross as cross_
from ..geometry.vectors import Array, cross, find_perpendicular
from ..geometry.vectors import invert_pose as inverted
from ..mechanism import JointType, Mechanism
from ..mechanism.legs import Leg
from ..results import Value
from ..tolerances import GEOMETRY_DIFFERENCE_TOL
from .branch_cells import TubedBranch
from .trace import TracedFunction

INVERSE_CHECK_SAMPLES_COUNT = 64
"""Motors that closed forms must give back."""


@dataclass(frozen=True, eq=False, repr=False)
class LegMotor(Value):
    """A motor's coordinate (m, rad) by what a leg carries: how far the ``end`` B of a crank or slider, the
    ``direction`` of a rod, or the rod seen from its crank (``bend``) has turned or slid since the zero configuration,
    or how much longer the rod is (``length``)."""

    coordinate: TreeCoordinate
    form: ClosedFormLeg
    reads: str
    point: Array
    """The platform's reference point in its own frame: the form takes its place and the rotation."""
    zero: Any
    """Value at the zero configuration."""

    def read(self, position: Components, R: Components) -> tuple[Any, Any]:
        """Return the reach margin, and the vector or length that determines the coordinate, at a pose of the platform's
        frame."""
        form, p = self.form, plus(position, transform_vector(R, self.point))
        tip = plus(plus(p if form.tip.follows else [0.0] * 3, transform_vector(R, form.tip.turned)), form.tip.constant)
        margin: Any = 1.0
        if isinstance(form, PlatformDirection):
            found = transform_vector(R, form.axis)
            if self.reads == "end":
                margin, found = form.at(tip, _return_value, form.mode, *found)
        elif isinstance(form, RailAndLine):
            margin, found = form.at(
                tip, _return_value, form.mode, *(transform_vector(R, form.normal) if form.turns else form.normal)
            )
        else:
            margin, found = form.at(tip, _return_value, form.mode)
        if self.reads == "length":
            return margin, dot(found, minus(tip, form.centre))
        if self.reads == "end":
            return margin, minus(found, self.coordinate.point)
        if not isinstance(form, OnRod | PinnedRod):
            return margin, found
        rod = transform_vector(R, form.axis) if isinstance(form, PinnedRod) else minus(tip, found)
        if self.reads == "direction":
            return margin, rod
        axis, spoke = self.coordinate.axis, minus(found, form.centre)
        across = find_perpendicular(axis)
        return margin, plus(scale(dot(spoke, rod), across), scale(dot(cross_(spoke, rod), axis), cross(axis, across)))

    def at(self, position: Components, R: Components) -> tuple[Any, Any]:
        """Reach margin and coordinate at a pose of the platform's frame; turns between −π and π."""
        margin, found = self.read(position, R)
        axis, zero = self.coordinate.axis, self.zero
        if self.reads == "length":
            return margin, self._filed(found - zero)
        if self.coordinate.slides:
            return margin, self._filed(dot(minus(found, zero), axis))
        arm = zero - axis * (axis @ zero)
        return margin, self._filed(arctan2(dot(cross(axis, arm), found), dot(arm, found)))

    def _filed(self, value: Any) -> Any:
        """A coordinate from the zero configuration as the file counts it."""
        return value + self.coordinate.zero if self.coordinate.zero else value


def trace_inverse(rules: Sequence[LegMotor]) -> TracedFunction:
    """S, the legs' reach margins, and Q, the motors, of rotation r (9,) and position p (3,)."""
    tape = Tape([])
    pose = [tape.load(k) for k in range(12)]
    stores = [
        (array, (k,), value)
        for k, rule in enumerate(rules)
        for array, value in zip("SQ", rule.at(pose[9:], pose[:9]), strict=True)
    ]
    return TracedFunction.of(tape, [*(f"r[{k}]" for k in range(9)), *(f"p[{k}]" for k in range(3))], stores)


def _return_value(value: Any) -> Any:
    return value


def find_closed_inverse(robot: RobotLike, proof: BranchProof, branch: TubedBranch) -> tuple[LegMotor, ...]:
    """A closed form for each motor, in the working mode of the zero configuration; none where a leg has none, or where
    the working mode is not proved to be the same in all cells (no Type 1 singularity in the box that they fill)."""
    if not proof.regular or any(part.volume_fraction > part.box_fraction for part in proof.parts):
        return ()
    try:
        observed = ObservedRobot.of(robot).by_segments("export")
        batch = observed.batch
    except HrsynthError:
        return ()
    if batch is None:
        return ()
    q, X = _sample_motors(proof, branch)
    found = []
    for k, i in enumerate(branch.motors):
        coordinate = branch.system.coordinates[i]
        forms = _list_forms(observed, batch, branch.system.mechanism, coordinate)
        rules = (_find_rule(coordinate, form, reads, batch, X, q[:, k]) for form, reads in forms)
        rule = next((each for each in rules if each is not None), None)
        if rule is None:
            return ()
        found.append(rule)
    return tuple(found)


def _sample_motors(proof: BranchProof, branch: TubedBranch) -> tuple[Array, Array]:
    """Motors (n, m) in the proved box, zero first, and the poses (n, 4, 4) of the platform's frame on the branch."""
    low, high = proof.proved
    system = proof.system
    q = np.random.default_rng(0).uniform(low, high, (INVERSE_CHECK_SAMPLES_COUNT, len(low)))
    place = {name: i for i, name in enumerate(system.names)}
    values = np.tile(system.zero * system.units, (INVERSE_CHECK_SAMPLES_COUNT, 1))
    q[0] = values[0, [place[name] for name in proof.motors]]
    values[:, [place[name] for name in proof.motors]] = q
    for part, loops in zip(proof.parts, split_loop_system(system)[0], strict=True):
        near = [cell.at(row) for row in values[:, loops.driven] if (cell := part.find(row)) is not None]
        units = system.units[list(loops.unknowns)]
        values[:, loops.unknowns] = (
            units * loops.close(values[:, loops.driven] / system.units[list(loops.driven)], np.array(near) / units)[0]
        )
    values /= system.units
    return q, np.array([system.pose(system.mechanism.platform, row.tolist()) for row in values])


def _list_forms(
    observed: ObservedRobot, batch: Batch, mechanism: Mechanism, coordinate: TreeCoordinate
) -> Iterator[tuple[ClosedFormLeg, str]]:
    """Yield forms that may determine a coordinate, and the part of them that is read."""
    motor = coordinate.joint
    joint = mechanism.joints[motor]
    if mechanism.base in joint.links:
        crank = joint.other(mechanism.base)
        for each in mechanism.joints_of(crank):
            if mechanism.platform in each.links:
                yield PinnedRod(motor, _locate_on_platform(batch, mechanism, each.point), axis=coordinate.axis), "end"
    for leg in observed.decomposition.legs:
        form = batch.legs[leg.label]
        if motor not in leg.joints or not isinstance(form, ClosedFormLeg):
            continue
        if form.crank and not coordinate.parent >= 0:
            yield form, "end"
        if isinstance(form, OnRod):
            yield form, "bend" if isinstance(form, OnCrank) else "direction"
        if isinstance(form, PlatformDirection):
            if mechanism.platform in joint.links:
                for name in leg.joints:
                    yield (
                        PinnedRod(
                            motor,
                            _locate_on_platform(batch, mechanism, joint.point),
                            axis=form.axis,
                            centre=mechanism.joints[name].point,
                        ),
                        "bend",
                    )
            for name in leg.joints:
                yield replace(form, centre=mechanism.joints[name].point, radius=0.0), "length"
        if isinstance(form, SlidingRod | PlatformDirection):
            yield form, "length" if coordinate.slides else "direction"
        yield from ((each, "end") for each in _list_rail_forms(batch, mechanism, leg, coordinate))


def _locate_on_platform(batch: Batch, mechanism: Mechanism, place: Array) -> PlatformPoint:
    """A point that is fixed in the platform's link, by its place at zero."""
    X = mechanism.links[mechanism.platform].pose
    return PlatformPoint(True, (inverted(X) @ np.append(place, 1.0))[:3] - batch.coordinates.point, np.zeros(3))


def _list_rail_forms(batch: Batch, mechanism: Mechanism, leg: Leg, coordinate: TreeCoordinate) -> Iterator[RailAndLine]:
    """A slider of the base, an R and a P to the platform, in any order: the line along the P goes with the platform, or
    with the slider."""
    joints = [mechanism.joints[name] for name in leg.joints if name != coordinate.joint]
    if not coordinate.slides or sorted(each.type.value for each in joints) != ["P", "R"]:
        return
    slide, turn = sorted(joints, key=lambda each: each.type is JointType.REVOLUTE)
    R, normal = mechanism.links[mechanism.platform].pose[:3, :3], cross(slide.axis, turn.axis)
    tip = _locate_on_platform(batch, mechanism, turn.point)
    for turns in (False, True):
        yield RailAndLine(
            leg.label,
            tip,
            centre=turn.point,
            axis=coordinate.axis,
            normal=R.T @ normal if turns else normal,
            turns=turns,
        )


def _find_rule(
    coordinate: TreeCoordinate, form: ClosedFormLeg, reads: str, batch: Batch, X: Array, q: Array
) -> LegMotor | None:
    """The closed form of a coordinate that gives motors q (n,), the first of them zero, but for whole turns, at their
    poses (n, 4, 4)."""
    position, R = list(X[:, :3, 3].T), list(X[:, :3, :3].reshape(-1, 9).T)
    rule = LegMotor(coordinate, form, reads, batch.coordinates.point, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        at_zero = rule.read([x[0] for x in position], [x[0] for x in R])[1]
        rule = replace(rule, zero=np.asarray(at_zero, dtype=float))
        margin, found = rule.at(position, R)
        off = found - q
        if not coordinate.slides:  # the program finds the turn that lies in the box
            off = off - 2 * np.pi * np.round(off / (2 * np.pi))
        if not (np.all(np.asarray(margin) > 0) and np.all(np.abs(off) <= GEOMETRY_DIFFERENCE_TOL)):
            return None
    return rule
