"""Observations: the interface of all kinds. Each kind is a file in :mod:`.observations`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, NotRequired, Self, TypedDict

import numpy as np

from ..geometry.vectors import Array
from ..results import Value


@dataclass(frozen=True, eq=False)
class Drawn:
    """Polylines (n, 3) and polygons (n, 3)."""

    lines: tuple[Array, ...] = ()
    areas: tuple[Array, ...] = ()


class ObservationRecord(TypedDict):
    """Observation: its label (that of a leg if it is a segment), the link and the kind; the named camera, and its point
    (m) and axis in the link's frame (null if absent); the joint of an encoder."""

    leg: str
    link: str
    kind: str
    camera: str | None
    at: list[float] | None
    axis: list[float] | None
    joint: NotRequired[str]


@dataclass(frozen=True, eq=False, repr=False)
class Observation(Value):
    """Measurement of one link relative to a reference link.

    A subclass gives the measured value and its rate; no other module depends on the kind. Poses are
    X_BL (4, 4) in the base frame, Jacobians V (6, n) map joint velocities to (linear, angular) velocities of the link
    frame's origin in base axes. All lengths (of poses, velocities, values and rates) are in the same unit: metres.
    """

    kind: ClassVar[str]
    """Name in files, on the command line and in records."""
    words: ClassVar[str]
    """Measured quantity, for the table of all kinds."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Attributes of ``<observe>`` that it needs besides ``link``; one with ``?`` at its end is optional."""
    size: ClassVar[int]
    """Rows of the measured value."""
    rank: ClassVar[int]
    """Number of independent values."""
    dimension: ClassVar[int | Array] = 0
    """Power of length in the measured value, one for all rows or one for each: 0 for pure numbers and angles, 1 for
    lengths; to compare values of different observations, divide by that power of a characteristic length."""
    turns_only: ClassVar[bool] = False
    """The rates need angular velocities alone: the linear ones may be those of any point."""

    angular: ClassVar[bool] = False
    """Its errors are angles: unit vectors and rotations."""
    feature_error: ClassVar[str] = "y − y*"
    """Error that a servo loop drives to zero, for the table of all kinds."""
    found_by: ClassVar[frozenset[str]] = frozenset()
    """Units of the noise of its simulated sensor: ``px``, ``m``, ``rad``."""

    leg: str
    link: str
    line: int | None = field(default=None, kw_only=True, compare=False)
    seen_from: str | None = field(default=None, kw_only=True)
    """Link from which it is measured; None means the mechanism's reference link."""

    @property
    def key(self) -> tuple[str, ...]:
        """Identity of this measurement among those of a mechanism."""
        return (self.leg, self.link)

    @property
    def text(self) -> str:
        """Leg and kind, for messages."""
        return f"observation {self.leg} ({self.kind})"

    @property
    def is_segment_direction(self) -> bool:
        """It is a direction relative to the mechanism's reference link: the subject of the rules for segments."""
        return False

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """Return the measured value, relative to the reference link."""
        raise NotImplementedError

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """Return the rate of :meth:`value` for each joint velocity; one row for each component."""
        raise NotImplementedError

    def difference(self, value: Array, wanted: Array) -> Array:
        """Return the difference of a measured and a desired value."""
        return value - wanted

    def error(self, value: Array, wanted: Array) -> Array:
        """Return the error (rows,) that a servo loop drives to zero, for a value (size,): by default y − y*."""
        return self.difference(value, wanted)

    def error_slope(self, value: Array, wanted: Array) -> Array:
        """Return ∂error/∂value, (rows, size). Errors change their sign if value and desired value are exchanged, so
        ∂error/∂wanted is −error_slope(wanted, value)."""
        return np.eye(self.size)

    def in_front(self, X_reference: Array, X_link: Array) -> float:
        """Return how far the observed geometry is inside the half-space in front of the camera (and its image, if its
        size is known): the sine of an angle, negative behind it; infinite if it is always visible."""
        return np.inf

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        """Return the drawing in the base frame; ``size`` (m) of parts that have none."""
        return Drawn()

    def image(self, X_reference: Array, X_link: Array, size: float) -> list[Array]:
        """Return the image of a camera: polylines (n, 2) in the plane z = 1 of its frame, a point alone (1, 2)."""
        return []

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return the value (size,) of a simulated sensor: ``noise`` by its unit (m, rad, px), noise samples ``shocks``
        (2, 3) in the unit ball."""
        return value

    @classmethod
    def together(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        """Return values and rates of several observations of this class, stacked: (rows,), (rows, n)."""
        values = [o.value(X_reference, X) for o, X in zip(observations, X_links, strict=True)]
        rates = [o.rate(X_reference, X, V_reference, V) for o, X, V in zip(observations, X_links, V_links, strict=True)]
        return np.concatenate(values), np.concatenate(rates)

    @classmethod
    def batched(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        """Return these at several configurations, poses (n, 4, 4) and (n, k, 4, 4): (n, rows), (n, rows, columns)."""
        members = zip(X_reference, X_links, V_reference, V_links, strict=True)
        found = [cls.together(observations, *member) for member in members]
        return np.array([values for values, _ in found]), np.array([rates for _, rates in found])

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        """Return the measurement where links became parts of others: ``into[old]``; ``poses`` are X_BL at zero."""
        return replace(self, link=into[self.link], seen_from=None if self.seen_from is None else into[self.seen_from])

    def to_dict(self) -> ObservationRecord:
        """Return the record of the observation."""
        return {"leg": self.leg, "link": self.link, "kind": self.kind, "camera": None, "at": None, "axis": None}

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        """Return the differences from another observation as texts."""
        return [] if type(self) is type(other) and self.key == other.key else [f"{self.text}: {self!r} / {other!r}"]


def list_labels(observations: Iterable[Observation]) -> tuple[str, ...]:
    """Return the measured legs, each once, in order."""
    return tuple(dict.fromkeys(each.leg for each in observations))
