"""Unobserved motions of a formation: trivial motions and flexes.

A motion that changes no measured value is *trivial* if one similarity (v, ω, s) moves all observed points and
directions: v(x) = v + ω × x + s x for points, rotations by ω, at all poses. All others are flexes
(docs/pages/control_a_formation.md). An observation constrains a link by the wrenches that it transmits when its value
is fixed, over all poses of the other link: one rule for all kinds, in floating point and over the rationals.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Annotated

import numpy as np

from ..geometry.ranks import compute_kernel_basis, compute_range_basis
from ..geometry.screws import make_rotation_twist, make_translation_twist
from ..geometry.vectors import Array, Numbers, hat, normalise_vector, orient_axis, rotate_about_axis
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.velocity_relation import ObservationModel, VelocityRelation
from ..mechanism import Observation
from ..mechanism.cameras import CameraObservation, ViewGeometry
from ..mechanism.legs import LegDecomposition
from ..mechanism.observations.direction import SeenAxis
from ..records import Recorded
from ..results import Value
from ..tolerances import NAMED_TWIST_TOL
from .freedoms import format_point, name_direction, name_directions

RIGID, FLEXIBLE = "rigid", "flexible"
SENSED_POINTS_COUNT = 4
"""Places of the other link at which an observation's wrenches are taken: no kind senses more than six of one link, and
each place adds one at least."""
SENSED_POINTS_RANGE_FRACTION = 10.0
"""Distance of these points (characteristic lengths): outside of the formation."""
ALL_FLEX_SETS_BODIES_MAX = 8
"""Number of bodies up to which flexes are sought in all sets of them; beyond, in sets of one, two, and in all."""


def name_rigidity(flexes: int) -> str:
    """The verdict on a formation with so many flexes."""
    return FLEXIBLE if flexes else RIGID


@dataclass(frozen=True, eq=False)
class ObservationWrenches:
    """Constraint of one observation on one link: ``rows`` (k, 6), wrenches on the link's twist at the origin; a scaling
    moves the link as its ``point`` (3,)."""

    link: str
    point: Numbers
    rows: Numbers


def measure_links(
    seen: Observation, reference: str, at: ViewGeometry, places: Sequence[tuple[Numbers, Numbers]]
) -> Iterator[ObservationWrenches]:
    """Return the constraints of an observation on its two links; only those on their relative motion if it has no
    wrenches (an encoder). ``places`` are points and directions where the other link might be."""
    if not isinstance(seen, CameraObservation | SeenAxis):
        return
    for link, point, others in (
        (seen.link, at.B, [replace(at, C=P, z=n) for P, n in places]),
        (seen.seen_from or reference, at.C, [replace(at, B=P, d=n) for P, n in places]),
    ):
        yield ObservationWrenches(link, point, np.array([w for each in (at, *others) for w in seen.wrenches(each)]))


def list_similarities(point: Numbers) -> Numbers:
    """The twists (6, 7) at the origin of a link at a point, of unit v, ω and s."""
    zero = 0 * point
    units = [np.array([zero[0] + int(i == j) for j in range(3)], dtype=point.dtype) for i in range(3)]
    return np.array(
        [
            *map(make_translation_twist, units),
            *(make_rotation_twist(each, zero) for each in units),
            make_translation_twist(point),
        ]
    ).T


def evaluate_formation_rows(
    found: Iterable[ObservationWrenches], twists: Mapping[str, Numbers]
) -> tuple[Numbers, Numbers]:
    """Return the rows (n, k) and (n, 7) by which motions with these ``twists`` (6, k) at the origin, and similarities,
    change the observed points; a link without twists is fixed."""
    motions, common = [], []
    columns = next(iter(twists.values())).shape[1]
    for each in found:
        own = twists.get(each.link)
        motions.append(np.zeros((len(each.rows), columns), dtype=each.rows.dtype) if own is None else each.rows @ own)
        common.append(each.rows @ list_similarities(each.point))
    return np.vstack(motions), np.vstack(common)


@dataclass(frozen=True, eq=False, repr=False)
class Flex(Value, all_recorded=True):
    """Flex, a motion of some links while all others are fixed and no measured value changes. It has ``count``
    independent motions."""

    links: tuple[str, ...]
    count: int
    name: str


@dataclass(frozen=True, eq=False, repr=False)
class Similarities(Value):
    """All x → s R x + t that trivial motions make of what is sensed: shifts along ``shifts`` (3, k), turns about
    ``axes`` (3, 0 to 3) through ``centre`` (3,), metres, and where ``scaled`` a scale about it."""

    shifts: Array
    axes: Array
    scaled: bool
    centre: Array

    @classmethod
    def of(cls, S: Array, centre: Array, length: float) -> Similarities | None:
        """Return those that a space S (7, k) of rates (v, ω, s) about a centre (m), in characteristic lengths,
        generates; None if it couples a rotation or a scaling to another motion."""
        shifts = compute_range_basis((S @ compute_kernel_basis(S[3:], 1.0)[0])[:3], 1.0)[0]
        axes = compute_range_basis((S @ compute_kernel_basis(S[6:], 1.0)[0])[3:6], 1.0)[0]
        scaled = bool(np.linalg.norm(S[6]) > NAMED_TWIST_TOL)
        across = np.eye(3) - shifts @ shifts.T
        rows = np.vstack([np.zeros((0, 3)), *(across @ (hat(each[3:6]) + each[6] * np.eye(3)) for each in S.T)])
        shifted = (across @ S[:3]).T.ravel()
        U, sizes, V = np.linalg.svd(rows, full_matrices=False)
        told = sizes > NAMED_TWIST_TOL  # of translations alone they are rounding, and define no centre
        fixed = -V[told].T @ (U[:, told].T @ shifted / sizes[told])
        tied = np.linalg.norm(rows @ fixed + shifted) + np.linalg.norm(S[3:6] - axes @ (axes.T @ S[3:6]))
        if shifts.shape[1] + axes.shape[1] + scaled != S.shape[1] or tied > NAMED_TWIST_TOL:
            return None
        return cls(shifts, axes, scaled, centre + length * fixed)

    def nearest(self, points: Array, wanted: Array) -> tuple[float, Array, Array]:
        """Return s, R and t that take points (n, 3) nearest to those that are ``wanted``: means and sizes made equal,
        then the least-squares rotation (W. Kabsch, Acta Cryst. A32, 1976, 922)."""
        one, other = (
            self.centre + self.shifts @ (self.shifts.T @ (each.mean(axis=0) - self.centre)) for each in (points, wanted)
        )
        p, w = points - one, wanted - other
        s = float(np.linalg.norm(w) / np.linalg.norm(p)) if self.scaled else 1.0
        R = np.eye(3)
        if self.axes.shape[1] == 1:
            axis = self.axes[:, 0]
            flat = p - np.outer(p @ axis, axis)
            R = rotate_about_axis(axis, float(np.arctan2(np.cross(p, w).sum(axis=0) @ axis, (flat * w).sum())))
        elif self.axes.shape[1]:
            U, _, V = np.linalg.svd(w.T @ p)
            R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V
        return s, R, other - s * R @ one


@dataclass(frozen=True, eq=False, repr=False)
class Formation(Value):
    """Unobserved motions of a formation at a configuration: trivial motions by name, and flexes; ``special`` is the
    line or plane through all observed points here, if there is none generically."""

    bodies: Recorded[tuple[str, ...]]
    trivial: Recorded[tuple[str, ...]]
    flexes: Recorded[tuple[Flex, ...]]
    special: Annotated[str, "line or plane through all observed points here, but not generically"] = ""
    group: Similarities | None = None
    """Transformations of the observed points by trivial motions, if rotations and scalings about one point describe
    them."""

    @property
    def verdict(self) -> str:
        """Rigid or flexible."""
        return name_rigidity(len(self.flexes))

    @property
    def count(self) -> int:
        """Number of independent flexes."""
        return sum(each.count for each in self.flexes)


def analyze_formation(
    at: ClosedConfiguration,
    observation_model: ObservationModel,
    found: VelocityRelation,
    decomposition: LegDecomposition,
) -> Formation:
    """Return the motions that ``found``, ρ at a configuration, leaves unobserved."""
    bodies, length = (observation_model.platform, *observation_model.others), at.model.length
    told, points = list_sensed_points(at, observation_model)
    centre = points.mean(axis=0) if len(points) else np.zeros(3)
    random = np.random.default_rng(0)
    places = [
        (
            SENSED_POINTS_RANGE_FRACTION * length * normalise_vector(random.normal(size=3)),
            normalise_vector(random.normal(size=3)),
        )
        for _ in range(SENSED_POINTS_COUNT)
    ]
    parts = [
        _scale(part, length)
        for each, place in told
        for part in measure_links(
            each, observation_model.reference, replace(place, B=place.B - centre, C=place.C - centre), places
        )
    ]
    K = found.unobserved_twists
    twists = {}
    for body, twist in zip(bodies, K.reshape(len(bodies), 6, -1), strict=True):
        arm = (at.pose(body)[:3, 3] - centre) / length
        twists[body] = np.vstack([twist[:3] + hat(arm) @ twist[3:], twist[3:]])
    if not parts or not K.shape[1]:
        return Formation(
            bodies, (), _find_flexes(K, K[:, :0], bodies), group=Similarities.of(np.zeros((7, 0)), centre, length)
        )
    motions, common = evaluate_formation_rows(parts, twists)
    inert = compute_kernel_basis(common, 1.0)[0]
    both = compute_kernel_basis(np.hstack([motions, -common]), 1.0)[0]
    followed = both[K.shape[1] :]
    followed = compute_range_basis(followed - inert @ (inert.T @ followed), 1.0)[0]
    idle = compute_kernel_basis(motions, 1.0)[0]
    moved = both[: K.shape[1]] - idle @ (idle.T @ both[: K.shape[1]])
    trivial = compute_range_basis(moved, 1.0)[0]
    return Formation(
        bodies,
        _name_similarities(followed, points, centre, length, decomposition),
        _find_flexes(K, K @ trivial, bodies),
        group=Similarities.of(followed, centre, length),
    )


def list_sensed_points(
    at: ClosedConfiguration, observation_model: ObservationModel
) -> tuple[list[tuple[Observation, ViewGeometry]], Array]:
    """The observations that sense anything, each with where it is, and all points that are sensed (n, 3)."""
    found = list[tuple[Observation, ViewGeometry]]()
    for each in observation_model.observations:
        if isinstance(each, CameraObservation | SeenAxis):
            found.append(
                (each, each.sighting(at.pose(each.seen_from or observation_model.reference), at.pose(each.link)))
            )
    points = [P for each, place in found if isinstance(each, CameraObservation) for P in (place.B, place.C)]
    return found, np.array(points).reshape(-1, 3)


def _scale(part: ObservationWrenches, length: float) -> ObservationWrenches:
    """Return the rows in characteristic lengths, normalised."""
    rows = part.rows * np.repeat([length, 1.0], 3)
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return replace(part, point=part.point / length, rows=rows / np.where(size > 0, size, 1.0))


def _name_similarities(
    S: Array, points: Array, centre: Array, length: float, decomposition: LegDecomposition
) -> tuple[str, ...]:
    """Names of similarities (7, k) about ``centre``, characteristic lengths: translations, turns, a scale; where these
    are not about any place of the sensed ``points`` (n, 3), about which."""
    spread = compute_range_basis((points - centre).T / length, 1.0)[0] if len(points) else np.zeros((3, 0))
    shifts = compute_range_basis((S @ compute_kernel_basis(S[3:], 1.0)[0])[:3], 1.0)[0]
    anchored = np.linalg.norm(spread - shifts @ (shifts.T @ spread)) > NAMED_TWIST_TOL
    names = [
        f"translation along {name_direction(each, decomposition)}" for each in name_directions(shifts, decomposition)
    ]
    turning = S @ compute_kernel_basis(S[6:], 1.0)[0]
    for axis in name_directions(compute_range_basis(turning[3:6], 1.0)[0], decomposition):
        v = (turning @ np.linalg.lstsq(turning[3:6], axis, rcond=None)[0])[:3]
        v = v - shifts @ (shifts.T @ v)
        through = "" if not anchored else f" through {format_point(centre + length * np.cross(axis, v))}"
        names.append(f"common rotation about {name_direction(axis, decomposition)}{through}")
    if len(names) < S.shape[1]:
        row = S[6] / (S[6] @ S[6])
        v = S[:3] @ row
        v = v - shifts @ (shifts.T @ v)
        fixed = "" if not anchored else f" about {format_point(centre - length * v)}"
        names.append(f"scale{fixed}" + (" with a rotation" if np.linalg.norm(S[3:6] @ row) > NAMED_TWIST_TOL else ""))
    return tuple(names)


def _find_flexes(K: Array, trivial: Array, bodies: tuple[str, ...]) -> tuple[Flex, ...]:
    """Split the unobserved motions K (6 bodies, k) beyond the trivial ones into flexes of the smallest sets of links
    that move while all others are fixed."""
    known, found = compute_range_basis(trivial, 1.0)[0], list[Flex]()
    total, n = K.shape[1], len(bodies)
    for size in range(1, n + 1):
        if n > ALL_FLEX_SETS_BODIES_MAX and 2 < size < n:
            continue
        for chosen in combinations(range(n), size):
            if known.shape[1] == total:
                return tuple(found)
            resting = np.delete(K.reshape(n, 6, -1), chosen, axis=0).reshape(-1, total)
            alone = K @ compute_kernel_basis(resting, 1.0)[0] if size < n else K
            turning = alone.reshape(n, 6, -1)[:, 3:].reshape(3 * n, -1)
            counts = []
            for part in (alone @ compute_kernel_basis(turning, 1.0)[0], alone):
                more = compute_range_basis(part - known @ (known.T @ part), 1.0)[0]
                known = compute_range_basis(np.hstack([known, more]), 1.0)[0]
                counts.append(more.shape[1])
            if sum(counts):
                links = tuple(bodies[i] for i in chosen)
                of_kind = zip(("translation", "turn"), counts, strict=True) if size == 1 else [("motion", sum(counts))]
                what = [f"{count} {kind}{'s' * (count > 1)}" for kind, count in of_kind if count]
                how = "alone" if size == 1 else "while the others are fixed" if size < n else "against each other"
                found.append(Flex(links, sum(counts), f"{', '.join(links)} {how}: {', '.join(what)}"))
    return tuple(found)


def describe_degeneracy(at: ClosedConfiguration, observation_model: ObservationModel) -> str:
    """The line or plane that holds all points that are sensed, in words; empty where they have none in common."""
    points = list_sensed_points(at, observation_model)[1] / at.model.length
    points = np.array(
        [P for i, P in enumerate(points) if all(np.linalg.norm(P - Q) > NAMED_TWIST_TOL for Q in points[:i])]
    )
    if len(points) < 3:
        return ""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0))
    if sizes[1] <= NAMED_TWIST_TOL * sizes[0]:
        return "all observed points lie on one line"
    if len(points) > 3 and sizes[2] <= NAMED_TWIST_TOL * sizes[0]:
        return f"all observed points lie in one plane, with the normal {format_point(orient_axis(axes[2]))}"
    return ""
