"""The error of the directions as a function of the platform's pose, in the working mode of a goal: one formula for
numbers and for enclosures.

E = ½ Σ sin² ∠(u, u*) = ½ Σ (1 − (u · u*)²), u* the direction at the goal. With y the velocity of a rod's tip, t that of
its other end and s = t · u, u̇ = g (y − t (u · y) / s), so that E's rate is Σ −c g (u* · y) + c g (u* · t) (u · y) / s,
c = u · u*: s vanishes where the rod's leg is at its limit (Type 1), ± √reach margin / rod. Poses about the goal's have
coordinates x: the point's shift along a basis (characteristic lengths), then γ = tan(θ/2) · axis of the turn (Cayley).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.aspects.leg_forms import LegPattern, build_leg_pattern
from ...analysis.aspects.path_segments import PathCoordinates, list_path_coordinates
from ...analysis.aspects.vector_expressions import JointRules, NoLegForm
from ...analysis.observed import ObservedRobot
from ...closed_forms.legs import ClosedFormLeg
from ...closed_forms.platform_points import PlatformPoint, platform_point
from ...constraints.named_vectors import BodyVector, NamedVector, collect_poses
from ...geometry.components import (
    Components,
    cayley,
    combine_columns,
    cross,
    dot,
    minus,
    plus,
    scale,
    spin,
    transform_vector,
)
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import Direction
from ...results import Value
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL

Number = Callable[[Any], Any]
Place = tuple[Components, Components]
"""A pose: the point (3) and the platform's rotation (9, by rows)."""


def _plain(value: Any) -> Any:
    """A number of the robot, as it is."""
    return value


@dataclass(frozen=True, eq=False)
class Twist:
    """Velocity of the platform's point and its angular velocity (None where it never turns)."""

    v: Components
    w: Components | None


class EnclosureFailure(Exception):
    """Reason why the error has no enclosure over poses."""


@dataclass(frozen=True, eq=False, repr=False)
class ObservedDirection(Value):
    """Observed direction: ``sense`` times that of a leg's rod, or (``limb`` None) one that the pose rotates."""

    leg: str
    sense: float
    limb: int | None
    rule: PlatformPoint | None = None


@dataclass(frozen=True, eq=False)
class RotatingDirection:
    """An observed direction u, the one that is wanted, and u̇ along some directions of the coordinates: ``plain``[j] −
    ``normal``[j] ``slip`` / ``along``, which vanishes at the leg's limit."""

    u: Components
    wanted: Components
    plain: Sequence[Components]
    normal: Sequence[Any]
    slip: Components
    along: Any

    @property
    def error(self) -> Components:
        """e = u × u*."""
        return cross(self.u, self.wanted)

    @property
    def rates(self) -> list[Components]:
        """ė along each direction."""
        return [
            cross(minus(plain, scale(normal / self.along, self.slip)), self.wanted)
            for plain, normal in zip(self.plain, self.normal, strict=True)
        ]


@dataclass(frozen=True, eq=False)
class ErrorRates:
    """At poses: the legs' reach margins, and what the observed directions do."""

    margins: Sequence[Any]
    seen: Sequence[RotatingDirection]

    @property
    def E(self) -> Any:
        """½ Σ |e|²."""
        return 0.5 * sum(dot(e, e) for e in (each.error for each in self.seen))


@dataclass(frozen=True, eq=False, repr=False)
class PoseError(Value):
    """Error about a goal, in its working mode: the pose (``p``, ``R``) from which coordinates count, by default the
    goal's, the basis of shifts (3, k) and of rotations (3, m), all legs, the observations. Lengths in characteristic
    lengths."""

    length: float
    motion: PlatformMotion
    p: Array
    R: Array
    shifts: Array
    turns: Array
    limbs: tuple[ClosedFormLeg, ...]
    seen: tuple[ObservedDirection, ...]
    fitted: tuple[str, ...] = ()
    """Forms that were fitted to samples, not read from the joints."""
    limits: tuple[str, ...] = ()
    """Joints whose limits are ignored."""
    coordinates: PathCoordinates | None = None
    """Reader of poses of configurations."""

    @classmethod
    def of(cls, setup: ObservedRobot, goal: ClosedConfiguration) -> PoseError:
        """Build the error of the observations about a configuration; raises ``EnclosureFailure``."""
        require_directions(setup)
        configurations = [setup.all_samples.start, *setup.configurations]
        reason = "the variable parts of the platform's pose depend on each other"
        for each in list_path_coordinates(
            setup.decomposition, setup.samples.observation_model, setup.dof, configurations
        ):
            try:
                return cls.along(setup, goal, each)
            except NoLegForm as why:
                reason = str(why)
        raise EnclosureFailure(reason)

    @classmethod
    def along(cls, setup: ObservedRobot, goal: ClosedConfiguration, coordinates: PathCoordinates) -> PoseError:
        """Build the error over the variable part of the platform's pose; raises ``EnclosureFailure``, or ``NoLegForm``
        if a leg has none."""
        configurations, mechanism = [setup.all_samples.start, *setup.configurations], setup.mechanism
        motion = coordinates.motion
        known = build_leg_pattern(setup.decomposition, [], coordinates, configurations)
        # a leg on whose rail the point itself lies gives no condition: the point's one shift is along the rail
        pairs = [
            (limb, carried)
            for limb, carried in zip(known.forms(goal).subchains, known.carried, strict=True)
            if not (
                not limb.slides
                and limb.rod <= EXACT_INCIDENCE_TOL
                and motion.translations.shape[1] == 1
                and not np.any(limb.tip.turned)
            )
        ]
        read = JointRules.of(setup.decomposition, coordinates, configurations)
        seen = tuple(_seen_direction(o, known, pairs, read, [goal, *configurations]) for o in setup.observed)
        p, R = coordinates.of([goal])
        rules = tuple(f"direction of leg {o.leg}" for o in seen if o.rule is not None and o.rule.fitted)
        return cls(
            coordinates.length,
            motion,
            p[0],
            R[0],
            motion.translations,
            motion.rotations if coordinates.turning else np.zeros((3, 0)),
            tuple(limb for limb, _ in pairs),
            seen,
            (*known.fitted, *rules),
            (*mechanism.stops, *mechanism.tilt_limits),
            coordinates=coordinates,
        )

    @property
    def size(self) -> int:
        """The number of coordinates."""
        return int(self.shifts.shape[1] + self.turns.shape[1])

    def pose(self, x: Components, number: Number) -> tuple[Components, Components]:
        """p (3) and R (9, by rows) at coordinates x."""
        k, R = self.shifts.shape[1], number(self.R.ravel())
        if self.turns.shape[1]:
            gamma = combine_columns(x[k:], self.turns, number)
            columns = [cayley(gamma, [R[3 * i + j] for i in range(3)]) for j in range(3)]
            R = [columns[j][i] for i in range(3) for j in range(3)]
        return plus(number(self.p), combine_columns(x[:k], self.shifts, number)), R

    @property
    def mirrors(self) -> Array:
        """Signs (2ᵏ, legs, 1) of the observed directions under which E is the same at a pose, all 1 first: a rod that
        slides through a base point has its direction either way."""
        both = [k for k, each in enumerate(self.seen) if each.limb is not None and self.limbs[each.limb].can_reverse]
        signs = np.ones((2 ** len(both), len(self.seen), 1))
        signs[:, both, 0] = list(product((1.0, -1.0), repeat=len(both)))
        return signs

    def at(self, x: Components, directions: Sequence[Components], number: Number) -> ErrorRates:
        """Return the rates of the error at coordinates x, and along directions of the coordinates."""
        p, R = self.pose(x, number)
        goal = number(self.p), number(self.R.ravel())
        twists = [self._twist(x, R, each, number) for each in directions]
        margins = [limb.at(self._tip(limb, p, R, number)[0], number, limb.mode)[0] for limb in self.limbs]
        return ErrorRates(margins, [self._turning(each, (p, R), goal, twists, number) for each in self.seen])

    def levels(self, x: Array) -> tuple[NDArray[np.bool_], Array]:
        """Return whether all legs reach, and E, (n,), at coordinates (n, size)."""
        with np.errstate(all="ignore"):
            found = self.at(list(x.T), [], _plain)
            reached = np.ones(len(x), dtype=bool)
            for margin in found.margins:
                reached &= margin > 0
            return reached, np.broadcast_to(found.E, reached.shape)

    def numbers(self, x: Array, directions: Array) -> tuple[Array, Array]:
        """e (n, 3 legs) and its rates (n, 3 legs, directions) at coordinates (n, size)."""
        with np.errstate(all="ignore"):
            found = self.at(list(x.T), list(directions), _plain).seen
            e = [np.broadcast_to(each, len(x)) for one in found for each in one.error]
            rates = [
                [np.broadcast_to(each, len(x)) for one in found for each in one.rates[j]]
                for j in range(len(directions))
            ]
        return np.array(e).T, np.array(rates).transpose(2, 1, 0)

    def _twist(self, x: Components, R: Components, rates: Components, number: Number) -> Twist:
        """Return the twist that belongs to rates of the coordinates."""
        k = self.shifts.shape[1]
        w: Components | None = None
        if self.turns.shape[1]:
            gamma, rate = (combine_columns(each[k:], self.turns, number) for each in (x, rates))
            w = spin(gamma, rate, self.turns.shape[1] == 1)
        return Twist(combine_columns(rates[:k], self.shifts, number), w)

    def _tip(self, limb: ClosedFormLeg, p: Components, R: Components, number: Number) -> tuple[Components, Components]:
        """Return a leg's tip, and the tip relative to the point."""
        arm: Components = transform_vector(R, number(limb.tip.turned)) if np.any(limb.tip.turned) else [0.0, 0.0, 0.0]
        return plus(plus(p, number(limb.tip.constant)), arm), arm

    def _turning(
        self, seen: ObservedDirection, here: Place, goal: Place, twists: Sequence[Twist], number: Number
    ) -> RotatingDirection:
        """An observed direction, and how it changes with twists of the platform's point."""
        wanted = self._direction(seen, *goal, number)
        if seen.limb is None:
            u = self._direction(seen, *here, number)
            plain = [[0.0, 0.0, 0.0] if each.w is None else cross(each.w, u) for each in twists]
            return RotatingDirection(u, wanted, plain, [0.0] * len(twists), u, 1.0)
        limb = self.limbs[seen.limb]
        tip, arm = self._tip(limb, *here, number)
        at = limb.observe(tip, number, seen.sense)
        tips = [each.v if each.w is None else plus(each.v, cross(each.w, arm)) for each in twists]
        plain, normal = [scale(at.gain, y) for y in tips], [at.gain * dot(at.u, y) for y in tips]
        return RotatingDirection(at.u, wanted, plain, normal, at.slip, at.along)

    def _direction(self, seen: ObservedDirection, p: Components, R: Components, number: Number) -> Components:
        """Return an observed direction at a pose, in its leg's working mode."""
        if seen.rule is not None:
            return plus(transform_vector(R, number(seen.rule.turned)), number(seen.rule.constant))
        assert seen.limb is not None
        limb = self.limbs[seen.limb]
        return limb.observe(self._tip(limb, p, R, number)[0], number, seen.sense).u


def require_directions(setup: ObservedRobot) -> None:
    """Raise ``EnclosureFailure`` unless directions are measured from the base."""
    mechanism = setup.mechanism
    others = [each for each in setup.observed if not isinstance(each, Direction)]
    if others:
        raise EnclosureFailure(f"the observation of leg {others[0].leg} is not a direction")
    if mechanism.reference != mechanism.base or any(each.seen_from is not None for each in setup.observed):
        raise EnclosureFailure("directions are not measured from the base")
    if mechanism.couplings:
        raise EnclosureFailure("joints are coupled")


def _seen_direction(
    observation: Observation,
    known: LegPattern,
    pairs: Sequence[tuple[ClosedFormLeg, NamedVector]],
    read: JointRules,
    configurations: Sequence[ClosedConfiguration],
) -> ObservedDirection:
    """Return the leg whose rod has an observed direction at all configurations; raises ``EnclosureFailure``."""
    assert isinstance(observation, Direction)
    feature = BodyVector("u", "observed", observation.link, observation.direction)
    u = feature.value(collect_poses(configurations, feature.links))
    p, R = known.coordinates.of(configurations)
    for i, (limb, carried) in enumerate(pairs):
        held = carried.value(collect_poses(configurations, carried.links))
        rods = np.array(limb.along(limb.tip.value(p, R), held)) / (limb.rod or 1.0)
        for sense in (1.0, -1.0):
            if np.max(np.abs(u - sense * rods)) < HIDDEN_ROBOT_RESIDUAL_TOL:
                return ObservedDirection(observation.leg, sense, i)
    rule = read.rule(feature) or platform_point(u, p, R)
    if rule is not None and not rule.follows:
        # what does not turn with the platform is the same everywhere
        if known.coordinates.turning and np.any(rule.turned) and np.any(rule.constant):
            raise EnclosureFailure(f"the direction of link {observation.link} rotates partly with the platform")
        return ObservedDirection(observation.leg, 1.0, None, rule)
    raise EnclosureFailure(
        f"the direction of link {observation.link} of leg {observation.leg} is not that of a rod in closed form"
    )
