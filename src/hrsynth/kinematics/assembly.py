"""A robot assembled at a given pose of its platform's bodies, leg by leg: does every leg close there?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import LoopsNotClosed
from ..mechanism import Joint, JointType, Mechanism, Observation
from ..mechanism.legs import Anatomy, Leg
from ..mechanism.vectors import Array, inverse
from ..tolerances import CLOSED, SAME_POINT, SOLVED
from .configuration import ClosedConfiguration, Target, closed
from .locked import placed
from .misses import alone
from .twin import Twin

STARTS = 24
"""Configurations of a leg, the zero configuration first, from which it is closed at a pose."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """What became of a robot at a pose: the configuration, or None and the legs that do not close (``open``); joints
    that are outside their limits there (``beyond``); the poses (4, 4) of the platform's links."""

    configuration: ClosedConfiguration | None
    open: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    platform: Mapping[str, Array] | None = None

    @property
    def reachable(self) -> bool:
        """Whether the whole robot closes, within the limits of its joints."""
        return self.configuration is not None and not self.beyond


@dataclass(frozen=True, eq=False)
class Assembler:
    """A robot whose legs are closed one at a time between the base and bodies of the platform at given poses."""

    anatomy: Anatomy
    length: float
    reference: str

    @cached_property
    def _twins(self) -> dict[str, Twin]:
        return {leg.label: Twin(alone(self.anatomy, leg), self.length) for leg in self.anatomy.legs}

    @cached_property
    def _platform(self) -> Mechanism:
        """The platform alone, floating with the first body on which a leg ends."""
        mechanism, body = self.anatomy.mechanism, self.anatomy.legs[0].attach
        kept = {mechanism.base, *self.anatomy.platform}
        floats = Joint(mechanism.fresh("floating"), JointType.FREE, mechanism.base, body,
                       mechanism.links[body].pose[:3, 3])
        inside = set(self.anatomy.platform)
        outside = [name for name, joint in mechanism.joints.items() if not set(joint.links) <= inside]
        return mechanism.changed(remove_links=set(mechanism.links) - kept, remove_joints=outside, joints=[floats],
                                 observations=(), camera=None)

    def platform(self, bodies: Mapping[str, Array]) -> dict[str, Array]:
        """The poses (4, 4) of all links of the platform where the bodies on which legs end have these; raises
        ``LoopsNotClosed`` where its own joints do not allow that."""
        mechanism, body = self._platform, self.anatomy.legs[0].attach
        displacement = bodies[body] @ inverse(mechanism.links[body].pose)
        poses = {link: displacement @ mechanism.links[link].pose for link in self.anatomy.platform}
        twin = Twin(placed(mechanism, {mechanism.base: mechanism.links[mechanism.base].pose, **poses}), self.length)
        target = _Poses(tuple(bodies.items()))
        residual = np.inf
        for start in _starts(twin):
            q, residual = closed(twin, start, target, tolerance=SOLVED, iterations=60)
            if residual <= CLOSED and all(_turned_as(twin.pose(q, body), X) for body, X in bodies.items()):
                return {link: twin.pose(q, link) for link in self.anatomy.platform}
        raise LoopsNotClosed(twin.mechanism.name, residual, CLOSED, "inside the platform")

    def at(self, bodies: Mapping[str, Array], measured: Sequence[tuple[Observation, Array]]) -> Assembly:
        """The robot with the bodies (on which legs end) at these poses (4, 4) and the measured values as given."""
        platform = self.platform(bodies)
        poses = dict(platform)
        missing, beyond = list[str](), list[str]()
        for leg in self.anatomy.legs:
            found = self._leg(leg, bodies[leg.attach], [each for each in measured if each[0].leg == leg.label])
            if found is None:
                missing.append(leg.label)
                continue
            twin, q = found
            poses.update({link: twin.pose(q, link) for link in leg.links if link not in poses})
            beyond += _beyond(twin, q, leg)
        if missing:
            return Assembly(None, tuple(missing), (), platform)
        mechanism = self.anatomy.mechanism
        whole = Twin(placed(mechanism, {mechanism.base: mechanism.links[mechanism.base].pose, **poses}), self.length)
        return Assembly(ClosedConfiguration.of(whole, whole.q0), (), tuple(beyond), platform)

    def _leg(self, leg: Leg, X: Array, measured: Sequence[tuple[Observation, Array]]) -> tuple[Twin, Array] | None:
        """A configuration of one leg with its end at X, within its joints' limits where there is such a one."""
        twin = self._twins[leg.label]
        target = Target(leg.attach, X, self.anatomy.point, self.reference, tuple(measured))
        outside = None
        for start in _starts(twin):
            q, residual = closed(twin, start, target, tolerance=SOLVED, iterations=60)
            if residual <= CLOSED and (target.point is not None or _turned_as(twin.pose(q, leg.attach), X)):
                if not _beyond(twin, q, leg):
                    return twin, q
                outside = outside or (twin, q)
        return outside


@dataclass(frozen=True, eq=False)
class _Poses:
    """Poses wanted of several links."""

    wanted: tuple[tuple[str, Array], ...]

    def rows(self, twin: Twin, q: Array) -> tuple[Array, Array]:
        parts = [Target(link, X, None, twin.mechanism.base, ()).rows(twin, q) for link, X in self.wanted]
        return np.concatenate([error for error, _ in parts]), np.vstack([rows for _, rows in parts])


def _turned_as(X: Array, wanted: Array) -> bool:
    """Whether two poses are turned alike: the solver's error of a turn vanishes at half a turn as well."""
    return float(np.trace(X[:3, :3].T @ wanted[:3, :3])) > 1.0


def _starts(twin: Twin) -> Iterator[Array]:
    """The zero configuration, then random ones, always the same."""
    yield twin.q0
    rng = np.random.default_rng(0)
    for _ in range(STARTS - 1):
        yield twin.moved(twin.q0, rng.uniform(-np.pi, np.pi, twin.nv))


def _beyond(twin: Twin, q: Array, leg: Leg) -> list[str]:
    """The joints of a leg, turning or sliding about one axis, whose coordinates are outside their limits."""
    moved = twin.difference(twin.q0, q)
    found = []
    for name in leg.joints:
        joint, at = twin.mechanism.joints.get(name), twin.coordinates.get(name)
        if joint is None or joint.limits is None or at is None or len(at) != 1:
            continue
        slides = joint.type is JointType.PRISMATIC
        value = float(moved[at[0]]) * (twin.length if slides else 1.0)
        lower, upper = joint.limits.lower, joint.limits.upper
        turns = (0.0,) if slides else (0.0, 2 * np.pi, -2 * np.pi)
        if not any((lower is None or value + turn >= lower - SAME_POINT) and
                   (upper is None or value + turn <= upper + SAME_POINT) for turn in turns):
            found.append(name)
    return found
