"""What is measured: by a camera (directions and positions of lines) or at a joint (encoders), each with its own
measured space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from ..errors import BadMechanism
from ..geometry.screws import point_velocity
from ..geometry.so3 import wrap_angle
from ..geometry.vectors import Array, cross, frozen, hat, transform, unit
from ..results import Value


@dataclass(frozen=True, eq=False, repr=False)
class Observation(Value):
    """A measurement of one link of a leg, seen from the reference link.

    A subclass gives the measured value and its rate; nothing else in the project knows what is measured. Poses are
    X_BL (4, 4) in the base frame, Jacobians V (6, n) map joint velocities to (linear, angular) velocities of the link
    frame's origin in base axes. All lengths (of poses, velocities, values and rates) are in the same unit: metres.
    """

    size: ClassVar[int]
    """Rows of the measured value."""
    dimension: ClassVar[int] = 0
    """Power of length in the measured value: 0 for pure numbers and angles, 1 for lengths; who compares values of
    different observations divides by that power of a characteristic length."""

    leg: str
    link: str
    line: int | None = field(default=None, kw_only=True, compare=False)
    seen_from: str | None = field(default=None, kw_only=True)
    """The link from which it is measured; None means the mechanism's reference link."""

    @property
    def key(self) -> tuple[str, ...]:
        """What tells this measurement from the others of a mechanism."""
        return (self.leg, self.link)

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """The measured value, seen from the reference link."""
        raise NotImplementedError

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """The rate of :meth:`value` for each joint velocity; one row a component."""
        raise NotImplementedError

    def apart(self, value: Array, wanted: Array) -> Array:
        """By how much a measured value is off a wanted one."""
        return value - wanted

    @classmethod
    def together(cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array,
                 V_links: Array) -> tuple[Array, Array]:
        """Values and rates of several observations of this class, stacked: (rows,), (rows, n)."""
        values = [o.value(X_reference, X) for o, X in zip(observations, X_links, strict=True)]
        rates = [o.rate(X_reference, X, V_reference, V)
                 for o, X, V in zip(observations, X_links, V_links, strict=True)]
        return np.concatenate(values), np.concatenate(rates)

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        """What differs from another observation, in words."""
        same = type(self) is type(other) and self.key == other.key
        return [] if same else [f"observation of leg {self.leg}: {self!r} / {other!r}"]


def labels_of(observations: Iterable[Observation]) -> tuple[str, ...]:
    """The legs that are measured, each once, in order."""
    return tuple(dict.fromkeys(each.leg for each in observations))


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Observation):
    """The unit vector u = R_cᵀ R_ℓ d of a direction d fixed in link ℓ (docs/pages/theory.md, section 2; MMT 2.3.1).

    ``direction`` is d in the *link's* frame, shape (3,).
    """

    size = 3
    direction: Array

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "direction", frozen(unit(self.direction)))
        except ValueError:
            raise BadMechanism(f"observation of leg {self.leg!r}: direction", "0 0 0", "a non-zero vector") from None

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """u, shape (3,), a unit vector in the reference link's frame."""
        return X_reference[:3, :3].T @ X_link[:3, :3] @ self.direction

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """u̇ = R_cᵀ ((ω_ℓ − ω_c) × R_ℓ d), shape (3, n)."""
        u = X_link[:3, :3] @ self.direction
        return (X_reference[:3, :3].T @ -hat(u)) @ (V_link[3:] - V_reference[3:])

    @classmethod
    def together(cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array,
                 V_links: Array) -> tuple[Array, Array]:
        seen = X_reference[:3, :3].T
        u = np.matmul(X_links[:, :3, :3], _directions(tuple(observations)))[:, :, 0]
        crosses = np.zeros((3, 3, len(u)))
        crosses[1, 2], crosses[2, 0], crosses[0, 1] = u.T
        crosses -= crosses.transpose(1, 0, 2)
        rates = (seen @ crosses.transpose(2, 0, 1)) @ (V_links[:, 3:] - V_reference[3:])
        return (u @ seen.T).ravel(), rates.reshape(-1, rates.shape[2])

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        found = super().differences(other, tolerance)
        if not found and isinstance(other, Direction) and np.max(np.abs(self.direction - other.direction)) > tolerance:
            found.append(f"direction of leg {self.leg}: {self.direction} / {other.direction}")
        return found


@lru_cache(maxsize=512)
def _directions(observations: tuple[Observation, ...]) -> Array:
    """The directions (k, 3, 1) of observations, in their links."""
    return frozen([o.direction[:, None] for o in observations if isinstance(o, Direction)])


@dataclass(frozen=True, eq=False, repr=False)
class LinePosition(Observation):
    """The moment h = p × u of an observed line, u its direction and p any of its points: the second vector of the
    line's Plücker coordinates (MMT 5.3), both seen from the reference link, about its frame's origin.

    ``direction`` is u and ``point`` a point of the line, both in the *link's* frame, shape (3,). Where u is measured
    too, what h adds does not depend on the origin: about another one, at o, it is h − o × u. The unit normal h / ‖h‖ of
    the plane through the origin and the line has no such law (and none at all where the line meets the origin), which
    is why the moment itself is taken.
    """

    size = 3
    dimension = 1
    direction: Array
    point: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", frozen(unit(self.direction)))
        object.__setattr__(self, "point", frozen(self.point))

    @property
    def key(self) -> tuple[str, ...]:
        return (self.leg, self.link, "line")

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """h, shape (3,), in the reference link's frame (m)."""
        u, arm = self._line(X_reference, X_link)
        return X_reference[:3, :3].T @ cross(arm, u)

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """ḣ = ṗ × u + p × u̇ as the reference link sees it, shape (3, n)."""
        u, arm = self._line(X_reference, X_link)
        turn = V_link[3:] - V_reference[3:]
        at = self._at(X_link)
        slip = point_velocity(V_link, at - X_link[:3, 3]) - point_velocity(V_reference, at - X_reference[:3, 3])
        return X_reference[:3, :3].T @ -(hat(u) @ slip + hat(arm) @ hat(u) @ turn)

    def _at(self, X_link: Array) -> Array:
        return transform(X_link, self.point)

    def _line(self, X_reference: Array, X_link: Array) -> tuple[Array, Array]:
        """u, and p seen from the reference link's origin, in base axes."""
        return X_link[:3, :3] @ self.direction, self._at(X_link) - X_reference[:3, 3]


@dataclass(frozen=True, eq=False, repr=False)
class Encoder(Observation):
    """One coordinate of a joint: the motion of ``link`` seen from ``seen_from``, the joint's other link.

    ``axis`` is the joint's axis in the frame of ``seen_from``, shape (3,).
    """

    size = 1
    joint: str
    axis: Array

    @property
    def key(self) -> tuple[str, ...]:
        return (self.joint, type(self).__name__, self.link)


@dataclass(frozen=True, eq=False, repr=False)
class AngleEncoder(Encoder):
    """The angle by which a direction fixed in the link has turned about the axis since the zero configuration.

    ``mark`` is that direction in the link's frame, ``start`` the same at zero in the frame of ``seen_from``, both (3,)
    and not parallel to the axis: any normal of it for R and C, the other axis for U.
    """

    mark: Array
    start: Array

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """The angle, shape (1,), in (−π, π]."""
        mark = X_reference[:3, :3].T @ X_link[:3, :3] @ self.mark
        normal = self.start - (self.axis @ self.start) * self.axis
        return np.array([np.arctan2(self.axis @ cross(normal, mark), normal @ mark)])

    def apart(self, value: Array, wanted: Array) -> Array:
        """The difference without whole turns: at half a turn the angle is π as well as −π."""
        return np.array([wrap_angle(float(value[0] - wanted[0]))])

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """a* · (ω_ℓ − ω_c), shape (1, n); a* = (a − c m) / (1 − c²), c = a · m: dual to the axis a and the mark m."""
        axis, mark = X_reference[:3, :3] @ self.axis, X_link[:3, :3] @ self.mark
        cosine = float(axis @ mark)
        return ((axis - cosine * mark) / (1 - cosine**2))[None] @ (V_link[3:] - V_reference[3:])


@dataclass(frozen=True, eq=False, repr=False)
class SlideEncoder(Encoder):
    """The length by which the link has slid along the axis since the zero configuration.

    ``point`` is the joint's centre in the link's frame, ``start`` the same at zero in the frame of ``seen_from``, (3,).
    """

    dimension = 1
    point: Array
    start: Array

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """The length, shape (1,), in metres."""
        arm = transform(X_link, self.point) - X_reference[:3, 3]
        return np.array([self.axis @ (X_reference[:3, :3].T @ arm - self.start)])

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """a · (velocity of the centre as one link carries it − as the other does), shape (1, n)."""
        centre = transform(X_link, self.point)
        slip = point_velocity(V_link, centre - X_link[:3, 3]) - point_velocity(V_reference, centre - X_reference[:3, 3])
        return (X_reference[:3, :3] @ self.axis)[None] @ slip
