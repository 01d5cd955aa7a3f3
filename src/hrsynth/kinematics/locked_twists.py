"""Locked twist system T_i: the twists that a leg allows its end with fixed measured values.

Computed from the screws of the leg's own joints, without the engine's Jacobians: an independent path to the same ranks.
Lengths in characteristic lengths; twists at the base frame's origin, base axes. Source: docs/pages/theory.md, section
7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..description.assembly.loops import SINGLE
from ..description.assembly.zero_configuration import zeroed_at
from ..geometry.ranks import compute_kernel_basis, compute_matrix_spectra, compute_range_bases, compute_range_basis
from ..geometry.screws import compute_point_velocity
from ..geometry.vectors import Array, hat
from ..mechanism import Coupling, Joint, Mechanism, Observation
from ..mechanism.legs import Leg
from ..mechanism.screws import build_constraint_matrix
from ..tolerances import PSEUDOINVERSE_CUTOFF_FRACTION
from .configuration import ClosedConfiguration
from .velocity_relation import ObservationModel


class _Bodies:
    """Constraint and velocity matrices on the stacked twists of some links, all at the base frame's origin."""

    def __init__(self, at: ClosedConfiguration, links: Sequence[str], joints: Sequence[Joint]) -> None:
        self.at = at
        self.place = {link: i for i, link in enumerate(links)}
        pose = cache(at.pose)
        self.A = build_constraint_matrix(joints, self.place, lambda joint: locate_joint(at, joint, pose))
        names = {joint.name for joint in joints}
        gears = [each for each in at.model.mechanism.couplings if {each.driver, each.driven} <= names]
        self.A = np.vstack([self.A, *(self._coupling_row(each, pose) for each in gears)])

    def _coupling_row(self, coupling: Coupling, pose: Callable[[str], Array]) -> Array:
        """A coupling's row: the driven joint's rate less ratio × the driver's (metres, radians)."""
        row = np.zeros((1, 6 * len(self.place)))
        for name, factor in ((coupling.driven, 1.0), (coupling.driver, -coupling.ratio)):
            joint = self.at.model.mechanism.joints[name]
            (axis,), slides = locate_joint(self.at, joint, pose)[1], joint.type.has_translation
            part = np.r_[axis * self.at.model.length, 0 * axis] if slides else np.r_[0 * axis, axis]
            for end, sign in ((joint.successor, factor), (joint.predecessor, -factor)):
                if end in self.place:
                    row[0, 6 * self.place[end] : 6 * self.place[end] + 6] += sign * part
        return row

    def pose(self, link: str) -> Array:
        """X_BL with the position in characteristic lengths."""
        X = self.at.pose(link).copy()
        X[:3, 3] /= self.at.model.length
        return X

    def velocity(self, link: str) -> Array:
        """The map to the twist of a link's frame at its origin, (6, 6 links)."""
        V = np.zeros((6, 6 * len(self.place)))
        if link in self.place:
            start = 6 * self.place[link]
            V[:, start : start + 6] = np.eye(6)
            V[:3, start + 3 : start + 6] = -hat(self.pose(link)[:3, 3])
        elif link != self.at.model.mechanism.base:
            raise ValueError(f"the twist of {link} is not among the unknowns")
        return V

    def rates(self, observations: Sequence[Observation], reference: str) -> Array:
        """The rates of observations, stacked, lengths in them in characteristic lengths."""
        found, length = [np.zeros((0, self.A.shape[1]))], self.at.model.length
        metric = np.repeat([length, 1.0], 3)[:, None]
        for each in observations:
            links = each.seen_from or reference, each.link
            rate = each.rate(*map(self.at.pose, links), *(metric * self.velocity(link) for link in links))
            found.append((rate.T / length ** np.asarray(each.dimension)).T)
        return np.vstack(found)


def compute_leg_twists(at: ClosedConfiguration, leg: Leg, locks: Sequence[Observation], reference: str) -> Array:
    """Return an orthonormal basis (6, k) of T_i: the twists of the link on which the leg ends that its joints and fixed
    measured values allow. Raises ``ValueError`` if an observation is from a link outside the leg."""
    return compute_twists_at_samples([at], leg, locks, reference)[0]


def compute_twists_at_samples(
    samples: Sequence[ClosedConfiguration], leg: Leg, locks: Sequence[Observation], reference: str
) -> list[Array]:
    """:func:`compute_leg_twists` at several configurations."""
    mechanism, rows = samples[0].model.mechanism, []
    links = (leg.platform_link, *(link for link in leg.links if link not in (leg.platform_link, mechanism.base)))
    for at in samples:
        bodies = _Bodies(at, links, [mechanism.joints[name] for name in leg.joints])
        rows.append(np.vstack([bodies.A, bodies.rates(locks, reference)]))
    return [
        basis for basis, _ in compute_range_bases([found.kernel[:6] for found in compute_matrix_spectra(rows)], 1.0)
    ]


def compute_interaction(at: ClosedConfiguration, observation_model: ObservationModel) -> Array:
    """Return Mᵀ on an orthonormal basis of the platform's twists, (rows, d), by the screws of all joints: u̇ = Mᵀ x. If
    observed links move while the platform is fixed, that part of u̇ is left out."""
    mechanism = at.model.mechanism
    links = [link for link in mechanism.links if link != mechanism.base]
    bodies = _Bodies(at, links, list(mechanism.joints.values()))
    kernel, _ = compute_kernel_basis(bodies.A)
    V = bodies.velocity(observation_model.platform)
    if observation_model.point is not None:
        V = compute_point_velocity(
            V, at.pose(observation_model.platform)[:3, :3] @ observation_model.point / at.model.length
        )
    moving, rates = V @ kernel, bodies.rates(observation_model.observations, observation_model.reference) @ kernel
    still, _ = compute_kernel_basis(moving, 1.0)
    hidden = compute_range_basis(rates @ still, 1.0)[0] if still.shape[1] else np.zeros((len(rates), 0))
    basis, _ = compute_range_basis(moving, 1.0)
    found: Array = rates @ np.linalg.pinv(basis.T @ moving, rcond=PSEUDOINVERSE_CUTOFF_FRACTION)
    return found - hidden @ (hidden.T @ found)


def locate_joint(
    at: ClosedConfiguration, joint: Joint, pose: Callable[[str], Array] | None = None
) -> tuple[Array, list[Array]]:
    """Return centre (characteristic lengths) and axes of a joint at a configuration, whose links are at these poses."""
    point, axes = carry_joint(at.model.mechanism, joint, pose or at.pose)
    return point / at.model.length, axes


def carry_joint(mechanism: Mechanism, joint: Joint, pose: Callable[[str], Array]) -> tuple[Array, list[Array]]:
    """Return centre (m) and axes of a joint, carried by links that are at these poses (4, 4)."""

    carriers = [pose(link) @ mechanism.links[link].inverse for link in joint.links[: max(1, len(joint.axes))]]
    axes = [D[:3, :3] @ axis for D, axis in zip(carriers, joint.axes, strict=False)]
    return carriers[0][:3, :3] @ joint.point + carriers[0][:3, 3], axes


def set_zero(at: ClosedConfiguration) -> Mechanism:
    """Return the mechanism with ``at`` as its zero configuration."""
    mechanism, model = at.model.mechanism, at.model
    step = model.difference(model.q0, at.q)
    known = {
        name: float(step[model.coordinates[name][0]]) * (model.length if joint.type.has_translation else 1.0)
        for name, joint in mechanism.joints.items()
        if joint.type in SINGLE and name in model.coordinates
    }
    return zeroed_at(mechanism, {name: at.pose(name) for name in mechanism.links}, known)


@dataclass(frozen=True, eq=False)
class Split:
    """Twist system decomposed at a point B: the translations in it, (3, k), the rotations about axes through B in it,
    (3, m), and whether that is all of it."""

    translations: Array
    rotations: Array
    whole: bool


def split(twists: Array, point: Array) -> Split:
    """Decompose a twist system (6, k) at a point (3,)."""
    return split_together([twists], [point])[0]


def split_together(systems: Sequence[Array], points: Sequence[Array]) -> list[Split]:
    """:func:`split` of several systems, each at its own point."""
    there = [
        np.vstack([compute_point_velocity(twists, point), twists[3:]])
        for twists, point in zip(systems, points, strict=True)
    ]
    parts = []
    for part, other in ((slice(3), slice(3, 6)), (slice(3, 6), slice(3))):
        alone = compute_matrix_spectra([twists[other] for twists in there], 1.0)
        parts.append(
            compute_range_bases([twists[part] @ each.kernel for twists, each in zip(there, alone, strict=True)], 1.0)
        )
    return [
        Split(moved, turned, moved.shape[1] + turned.shape[1] == twists.shape[1])
        for (moved, _), (turned, _), twists in zip(*parts, systems, strict=True)
    ]
