"""The direction of an axis: u, a unit vector.

reference –P–P–P– T –U̲– W –R(d)– ℓ        (MMT 3.2, Fig. 2(b))
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np

from ...errors import BadMechanism
from ...geometry.screws import find_normals, make_couple
from ...geometry.vectors import Array, Numbers, cross, freeze_array, hat, normalise_vector
from ..cameras import (
    FixedValueLocus,
    ViewGeometry,
    VirtualJoint,
    compute_relative_pose,
    make_angle_locus,
    make_universal,
)
from ..images import rotate_by_noise
from ..observation import Observation, ObservationRecord


def make_axis_chain(at: ViewGeometry) -> tuple[VirtualJoint, ...]:
    """Return PPP-U̲-R(d): T only translates relative to the reference link, so the first axis of U̲ keeps its direction
    there."""
    turning = make_universal(at.B, at.d, at.far, actuated=True)
    first, second = turning.axes
    slides = (VirtualJoint("P", at.B, (axis,)) for axis in (first, second, np.cross(first, second)))
    return (*slides, turning, VirtualJoint("R", at.B, (at.d,)))


@dataclass(frozen=True, eq=False, repr=False)
class SeenAxis(Observation):
    """Unit vector u = R_cᵀ R_ℓ d of a direction d fixed in link ℓ (docs/pages/theory.md, section 2; MMT 2.3.1).

    ``direction`` is d in the *link's* frame, shape (3,).
    """

    locked = "two moments ⟂ u"
    size = 3
    angular = True
    rank = 2
    rational = True
    turns_only = True
    feature_error = "u × u*"
    found_by = frozenset({"rad"})
    direction: Array

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "direction", freeze_array(normalise_vector(self.direction)))
        except ValueError:
            raise BadMechanism(f"observation of leg {self.leg!r}: direction", "0 0 0", "a non-zero vector") from None

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """Return u, shape (3,), a unit vector in the reference link's frame."""
        return X_reference[:3, :3].T @ X_link[:3, :3] @ self.direction

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """Return u̇ = R_cᵀ ((ω_ℓ − ω_c) × R_ℓ d), shape (3, n)."""
        u = X_link[:3, :3] @ self.direction
        return (X_reference[:3, :3].T @ -hat(u)) @ (V_link[3:] - V_reference[3:])

    def error(self, value: Array, wanted: Array) -> Array:
        """Return u × u* (MMT eq. 9): it vanishes for the opposite direction too."""
        return np.asarray(cross(value, wanted))

    def error_slope(self, value: Array, wanted: Array) -> Array:
        """−[u*]ₓ."""
        return -hat(wanted)

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        """Return a direction in a cone about u."""
        return rotate_by_noise(value, shocks[0], noise["rad"])

    @classmethod
    def together(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        seen = X_reference[..., :3, :3].swapaxes(-1, -2)
        u = np.matmul(X_links[..., :3, :3], _stack_directions(tuple(observations)))[..., 0]
        across = np.zeros((*u.shape, 3))
        across[..., 0, 1], across[..., 1, 2], across[..., 2, 0] = u[..., 2], u[..., 0], u[..., 1]
        across -= across.swapaxes(-1, -2)
        rates = (seen[..., None, :, :] @ across) @ (V_links[..., 3:, :] - V_reference[..., None, 3:, :])
        n = u.shape[:-2]
        return (u @ X_reference[..., :3, :3]).reshape(*n, -1), rates.reshape(*n, -1, rates.shape[-1])

    batched = together

    @property
    def view(self) -> Array:
        """Frame of the value (4, 4), in the reference link's."""
        return freeze_array(np.eye(4))

    def sighting(self, X_reference: Array, X_link: Array, far: Array | None = None) -> ViewGeometry:
        """Return the geometry of links and axis in the base frame."""
        return ViewGeometry(X_reference[:3, 3], X_reference[:3, 2], X_link[:3, 3], X_link[:3, :3] @ self.direction, far)

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        """Return two moments normal to u."""
        return [make_couple(n) for n in find_normals(at.d)]

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        """PPP-U̲-R(d)."""
        return make_axis_chain(at)

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        return (make_angle_locus(at.d, *find_normals(at.d)),)

    def pointing(self, values: Array) -> Array | None:
        """Return the part of values (n, 3) that the chain's first U rotates: all."""
        return values

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        if into[self.link] == self.link:
            return super().carried_by(into, poses)
        turned = compute_relative_pose(self.link, into, poses)[:3, :3] @ self.direction
        return replace(super().carried_by(into, poses), direction=turned)

    def to_dict(self) -> ObservationRecord:
        return {**super().to_dict(), "axis": self.direction.tolist()}

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        found = super().differences(other, tolerance)
        if not found and isinstance(other, SeenAxis) and np.max(np.abs(self.direction - other.direction)) > tolerance:
            found.append(f"direction of leg {self.leg}: {self.direction} / {other.direction}")
        return found


@dataclass(frozen=True, eq=False, repr=False)
class Direction(SeenAxis):
    """Direction of a segment, or of any axis of a link."""

    kind = "direction"
    words = "the direction of an axis, u"
    needs = ("axis",)

    @property
    def is_segment_direction(self) -> bool:
        return self.seen_from is None


@lru_cache(maxsize=512)
def _stack_directions(observations: tuple[Observation, ...]) -> Array:
    """Return the directions (k, 3, 1) of observations, in their links."""
    return freeze_array([o.direction[:, None] for o in observations if isinstance(o, SeenAxis)])


KIND = Direction
