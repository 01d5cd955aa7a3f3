"""What a camera measures: observations, each with its own measured space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ..errors import BadMechanism
from .vectors import Array, frozen, hat, unit


@dataclass(frozen=True, eq=False)
class Observation:
    """A measurement of one link of a leg, seen from the reference link.

    A subclass gives the measured value and its rate; nothing else in the project knows what is measured. Poses are
    X_BL (4, 4) in the base frame, Jacobians V (6, n) map joint velocities to (linear, angular) velocities of the link
    frame's origin in base axes.
    """

    size: ClassVar[int]
    """Rows of the measured value."""

    leg: str
    link: str
    line: int | None = field(default=None, kw_only=True)
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


@dataclass(frozen=True, eq=False)
class Direction(Observation):
    """The unit vector u = R_cᵀ R_ℓ d of a direction d fixed in link ℓ (theory: observation; MMT 2.3.1).

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
        directions = np.array([o.direction for o in observations if isinstance(o, Direction)])
        seen = X_reference[:3, :3].T
        u = np.matmul(X_links[:, :3, :3], directions[:, :, None])[:, :, 0]
        zero = np.zeros(len(u))
        crosses = np.array([[zero, u[:, 2], -u[:, 1]], [-u[:, 2], zero, u[:, 0]], [u[:, 1], -u[:, 0], zero]])
        rates = (seen @ crosses.transpose(2, 0, 1)) @ (V_links[:, 3:] - V_reference[3:])
        return (u @ seen.T).ravel(), rates.reshape(-1, rates.shape[2])

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        found = super().differences(other, tolerance)
        if not found and isinstance(other, Direction) and np.max(np.abs(self.direction - other.direction)) > tolerance:
            found.append(f"direction of leg {self.leg}: {self.direction} / {other.direction}")
        return found
