"""Constraint wrenches of legs on a platform whose twists change with the pose: each one force, in closed form.

A leg keeps a point C of the platform in a plane of the base or at a distance from a point of the base, or a plane of
the platform on a point of the base: a force along the plane's normal or from point to point. It is read from the leg's
joints and counts only if it holds at all configurations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..closed_forms.platform_points import PlatformPoint
from ..geometry.ranks import compute_range_bases
from ..geometry.vectors import Array, cross, dot, invert_pose
from ..mechanism import Mechanism
from ..mechanism.legs import Leg
from ..results import Value
from ..tolerances import GEOMETRY_DIFFERENCE_TOL
from .iterative_leg import IterativeLegStates
from .platform_coordinates import PlatformCoordinates


@dataclass(frozen=True, eq=False, repr=False)
class LegForce(Value):
    """A force on the platform: along ``normal``, of the base (``turns``: of the platform), or from the base's ``place``
    to the ``tip`` where there is none."""

    tip: PlatformPoint
    place: Array
    normal: Array | None
    turns: bool

    def force(self, p: Array, R: Array) -> tuple[Array, Array]:
        """The force (3, n), a unit vector, and its arm from the reference point (3, n)."""
        arm = self.place[:, None] - p.T if self.turns else self.tip.value(p, R).T - p.T
        if self.normal is None:
            away = arm + p.T - self.place[:, None]
            return away / _measure_lengths(away), arm
        return ((R @ self.normal).T if self.turns else np.broadcast_to(self.normal[:, None], p.T.shape)), arm

    def rows(self, p: Array, R: Array, span: Array) -> Array:
        """Return the force on the twists ``span`` (6, D), of unit length, (D, n)."""
        force, arm = self.force(p, R)
        found = span.T @ np.concatenate([force, cross(arm, force, axis=-2)])
        return np.asarray(found / _measure_lengths(found))

    def level(self, p: Array, R: Array) -> Array:
        """Return the constant (m; n,): the tip's height or distance, or the reference point's height."""
        force, arm = self.force(p, R)
        height = arm if self.turns else arm + p.T - (0.0 if self.normal is not None else self.place[:, None])
        return np.asarray(np.einsum("in,in->n", force, height))


def _measure_lengths(vectors: Array) -> Array:
    """Lengths (n,) of vectors (k, n), never zero."""
    return np.sqrt(np.maximum(np.einsum("in,in->n", vectors, vectors), np.finfo(float).tiny))


def list_leg_forces(
    mechanism: Mechanism, leg: Leg, coordinates: PlatformCoordinates, states: IterativeLegStates, p: Array
) -> Sequence[LegForce] | None:
    """The forces by which a leg holds the platform, at states of closed configurations; None where these are others."""
    ranks = compute_range_bases([each.T for each in states.wrenches()], 1.0)
    count = {rank.value for _, rank in ranks}
    if count == {0}:
        return ()
    if count != {1}:
        return None
    wanted = np.array([basis[:, 0] for basis, _ in ranks])
    for hold in _list_candidates(mechanism, leg, coordinates):
        levels = hold.level(p, states.R)
        rows = hold.rows(p, states.R, states.span).T
        aside = wanted - dot(rows, wanted)[:, None] * rows
        if max(np.ptp(levels) / mechanism.length, np.max(np.abs(aside))) <= 10 * GEOMETRY_DIFFERENCE_TOL:
            return (hold,)
    return None


def _list_candidates(mechanism: Mechanism, leg: Leg, coordinates: PlatformCoordinates) -> Iterator[LegForce]:
    """Yield candidates from the leg's joints on the base and on the platform: all pairs of centres, all axes, and the
    normals to them where the platform rotates about one axis."""
    body = coordinates.links.get(leg.platform_link)
    if body is None:
        return
    joints = [mechanism.joints[name] for name in leg.joints]
    to_body = invert_pose(mechanism.links[leg.platform_link].pose)
    about = coordinates.rotations.T if coordinates.rotations.shape[1] == 1 else np.zeros((0, 3))
    near = [joint for joint in joints if mechanism.base in joint.links]
    far = [joint for joint in joints if leg.platform_link in joint.links]
    tips = [body.point(to_body[:3, :3] @ joint.point + to_body[:3, 3]) for joint in far]

    def normals(axes: Sequence[Array]) -> Iterator[Array]:
        for axis in axes:
            yield axis
            yield from (
                aside / np.linalg.norm(aside)
                for aside in np.cross(about, axis)
                if np.linalg.norm(aside) > GEOMETRY_DIFFERENCE_TOL
            )

    for tip in tips:
        for joint in near:
            yield LegForce(tip, joint.point, None, False)
        for normal in normals([axis for joint in near for axis in joint.axes]):
            yield LegForce(tip, np.zeros(3), normal, False)
    for joint in near:
        for normal in normals([axis for each in far for axis in each.axes]):
            yield LegForce(tips[0], joint.point, body.Q @ to_body[:3, :3] @ normal, body.turns)


def compute_free_twists(rows: Array) -> tuple[Array, Array]:
    """Orthonormal bases (D, D - k, n) of what is normal to k independent rows (k, D, n), and the smallest part (n,) of
    a row that is normal to those before (Householder 1958). Of one sense with the rows: it turns over nowhere."""
    rows = rows.copy()
    k, D, n = rows.shape
    least, sense, mirrors = np.full(n, np.inf), np.ones(n), []
    for i in range(k):
        mirror = rows[i, i:].copy()
        size = _measure_lengths(mirror)
        mirror[0] += np.copysign(size, mirror[0])
        sense *= np.copysign(1.0, rows[i, i])
        least = np.minimum(least, size)
        mirror *= np.sqrt(2.0) / _measure_lengths(mirror)
        for j in range(i + 1, k):
            rows[j, i:] -= mirror * np.einsum("dn,dn->n", mirror, rows[j, i:])
        mirrors.append(mirror)
    found = np.zeros((D, D - k, n))
    for i in range(D - k):
        found[k + i, i] = 1.0
    for i, mirror in reversed(list(enumerate(mirrors))):
        found[i:] -= mirror[:, None] * np.einsum("dn,din->in", mirror, found[i:])
    found[:, -1] *= sense
    return found, least
