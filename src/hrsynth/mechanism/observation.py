"""What is measured: the contract of all kinds of observations. Each kind is a file in :mod:`.observations`."""

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
    """An observation: its label (that of a leg if it is a segment), the link and the kind; the named camera that sees
    it, and its point (m) and axis in the link's frame (null if there are none); the joint of an encoder."""

    leg: str
    link: str
    kind: str
    camera: str | None
    at: list[float] | None
    axis: list[float] | None
    joint: NotRequired[str]


@dataclass(frozen=True, eq=False, repr=False)
class Observation(Value):
    """A measurement of one link, seen from a reference link.

    A subclass gives the measured value and its rate; nothing else in the project knows what is measured. Poses are
    X_BL (4, 4) in the base frame, Jacobians V (6, n) map joint velocities to (linear, angular) velocities of the link
    frame's origin in base axes. All lengths (of poses, velocities, values and rates) are in the same unit: metres.
    """

    kind: ClassVar[str]
    """Its word in files, on the command line and in records."""
    words: ClassVar[str]
    """What is measured, for the table of all kinds."""
    needs: ClassVar[tuple[str, ...]] = ()
    """The attributes of ``<observe>`` that it needs besides ``link``; one with ``?`` at its end can be left out."""
    size: ClassVar[int]
    """Rows of the measured value."""
    rank: ClassVar[int]
    """Independent numbers that are measured."""
    dimension: ClassVar[int | Array] = 0
    """Power of length in the measured value, one for all rows or one for each: 0 for pure numbers and angles, 1 for
    lengths; who compares values of different observations divides by that power of a characteristic length."""
    turns_only: ClassVar[bool] = False
    """Whether the rates need angular velocities alone: then the linear ones may be those of any point."""

    angular: ClassVar[bool] = False
    """Whether its errors are angles: unit vectors and turns."""
    feature_error: ClassVar[str] = "y − y*"
    """The error that a servo loop drives to zero, for the table of all kinds."""
    found_by: ClassVar[frozenset[str]] = frozenset()
    """Units of the noise that its simulated sensor has: ``px``, ``m``, ``rad``."""

    leg: str
    link: str
    line: int | None = field(default=None, kw_only=True, compare=False)
    seen_from: str | None = field(default=None, kw_only=True)
    """The link from which it is measured; None means the mechanism's reference link."""

    @property
    def key(self) -> tuple[str, ...]:
        """What tells this measurement from the others of a mechanism."""
        return (self.leg, self.link)

    @property
    def by_segment(self) -> bool:
        """Whether it is a direction seen from the mechanism's reference link: what the rules for segments are about."""
        return False

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """The measured value, seen from the reference link."""
        raise NotImplementedError

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """The rate of :meth:`value` for each joint velocity; one row a component."""
        raise NotImplementedError

    def difference(self, value: Array, wanted: Array) -> Array:
        """By how much a measured value is off a wanted one."""
        return value - wanted

    def error(self, value: Array, wanted: Array) -> Array:
        """What a servo loop drives to zero (rows,), of a value (size,): by default y − y*."""
        return self.difference(value, wanted)

    def error_slope(self, value: Array, wanted: Array) -> Array:
        """∂error/∂value, (rows, size). Errors change their sign where value and wanted value change places, so
        ∂error/∂wanted is −error_slope(wanted, value)."""
        return np.eye(self.size)

    def in_front(self, X_reference: Array, X_link: Array) -> float:
        """How far what is seen is inside the half-space in front of the camera (and its picture, where its size is
        known): the sine of an angle, negative behind it; infinite where nothing can be lost from sight."""
        return np.inf

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        """How it is drawn in space, in the base frame; ``size`` (m) of what has none of its own."""
        return Drawn()

    def image(self, X_reference: Array, X_link: Array, size: float) -> list[Array]:
        """What a camera shows of it: polylines (n, 2) in the plane z = 1 of its frame, a point alone (1, 2)."""
        return []

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """The value (size,) that a simulated sensor gives: ``noise`` by its unit (m, rad, px), ``shocks`` (2, 3) in the
        unit ball."""
        return value

    @classmethod
    def together(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        """Values and rates of several observations of this class, stacked: (rows,), (rows, n)."""
        values = [o.value(X_reference, X) for o, X in zip(observations, X_links, strict=True)]
        rates = [o.rate(X_reference, X, V_reference, V) for o, X, V in zip(observations, X_links, V_links, strict=True)]
        return np.concatenate(values), np.concatenate(rates)

    @classmethod
    def batched(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        """The same at several configurations, poses (n, 4, 4) and (n, k, 4, 4): (n, rows), (n, rows, columns)."""
        found = [
            cls.together(observations, *each) for each in zip(X_reference, X_links, V_reference, V_links, strict=True)
        ]
        return np.array([values for values, _ in found]), np.array([rates for _, rates in found])

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        """The same measurement where links became parts of others: ``into[old]``; ``poses`` are X_BL at zero."""
        seen_from = None if self.seen_from is None else into[self.seen_from]
        return replace(self, link=into[self.link], seen_from=seen_from)

    def to_dict(self) -> ObservationRecord:
        """Where it is, as JSON has it."""
        return {"leg": self.leg, "link": self.link, "kind": self.kind, "camera": None, "at": None, "axis": None}

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        """What differs from another observation, in words."""
        same = type(self) is type(other) and self.key == other.key
        return [] if same else [f"observation of leg {self.leg}: {self!r} / {other!r}"]


def labels_of(observations: Iterable[Observation]) -> tuple[str, ...]:
    """The legs that are measured, each once, in order."""
    return tuple(dict.fromkeys(each.leg for each in observations))
