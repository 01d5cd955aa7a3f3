"""Random rational instances of an architecture, and their exact kinematics.

An instance is a random choice of axes, centres and observed directions that keeps all relations that persist in motion
(:mod:`hrsynth.mechanism.incidences`). It is drawn in linear steps: the directions one after another, then all centres
at once, each from a solution space whose dimension is generically constant. The instances are therefore the rational
points of an irreducible family, to which the robot's own configurations belong."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import gcd
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry.incidences import Incidence
from ..geometry.ranks import rank_of
from ..geometry.screws import find_normals
from ..geometry.vectors import Numbers, cross, scale_to_whole
from ..mechanism import Joint, Mechanism, Observation, graphs
from ..mechanism.cameras import ViewGeometry
from ..mechanism.incidences import DirectionSource, Incidences
from ..mechanism.observations.direction import SeenAxis
from ..mechanism.screws import list_allowed_twists
from ..tolerances import RANK_CUTOFF_FRACTION, RANK_GAP_MIN
from .sensor_rows import SensorPlaces, build_view_geometry, compute_observation_rates

if TYPE_CHECKING:
    from flint import fmpz_mat

LARGEST_RANDOM = 10**9
"""Range of random integers of rational instances, of either sign."""


class RecognitionFailure(Exception):
    """Error: the incidences that were found do not describe the architecture, with the reason."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """Rational directions (3,), one a class, of any length, and centres (n, 3), that satisfy relations exactly."""

    directions: tuple[Numbers, ...]
    centres: Numbers
    ranks: tuple[int, ...] = ()
    """Ranks of the conditions on each direction, and of those on all centres."""


@dataclass(frozen=True, eq=False)
class Instance:
    """Exact maps on a basis of ker A, the velocities that all joints allow: the platform's twist, of a formation those
    of all bodies (twist rows, mobility), u × (ω − ω of the reference) for each observed direction (3, mobility), and
    what :func:`.sensor_rows.convergence_rates` gives for other observations."""

    geometry: Geometry
    twist: Numbers
    rates: tuple[Numbers, ...]
    links: Mapping[str, Numbers]
    """Return the twists of all links (6, rates) along a tree of joints, the loop constraints of the other joints on the
    rates (rows, rates), and the rates of each joint."""
    free: Numbers
    """The basis of ker A (rates, mobility)."""
    loops: Numbers
    """A: loop constraints on the joint rates (rows, rates)."""
    rows: tuple[Numbers, ...]
    """The twist and the rates for each joint's rates, before they are taken on ker A."""
    sightings: tuple[ViewGeometry | None, ...]
    """For each observation the frames of camera and link; None for an encoder."""

    def twists(self) -> dict[str, Numbers]:
        """Return the twists of all links (6, rates) along a tree of joints, the loop constraints of the other joints on
        the rates (rows, rates), and the rates of each joint."""
        rows = np.vstack(list(self.links.values()))
        return dict(zip(self.links, _compute_product(rows, self.free).reshape(-1, 6, self.mobility), strict=True))

    @property
    def mobility(self) -> int:
        """dim ker A."""
        return int(self.twist.shape[1])

    @property
    def dof(self) -> int:
        """Rank of the platform's twist."""
        return rank(self.twist)

    def ranks(self, places: Sequence[int]) -> tuple[int, int]:
        """For some of the observations: rank [X; Y], which is dim ρ, and rank Y."""
        rates = [self.rates[i] for i in places]
        return rank(np.vstack([self.twist, *rates])), rank(np.vstack(rates)) if rates else 0


def draw(relations: Incidences, rng: random.Random) -> Geometry:
    """A random geometry; raises ``RecognitionFailure`` where the relations leave no direction to choose."""
    from flint import fmpq

    directions, ranks = _draw_directions(relations, rng)
    n = relations.count
    basis = compute_exact_kernel(_list_centre_rows(relations, directions))
    centres = np.asarray((basis @ draw_whole_numbers(basis.shape[1], rng)).reshape(n, 3))
    return Geometry(
        tuple(np.array([fmpq(x) for x in each], dtype=object) for each in directions),
        centres,
        (*ranks, 3 * n - basis.shape[1]),
    )


def compute_float_ranks(relations: Incidences, place: int) -> tuple[int, ...]:
    """Return the ranks of ``Geometry``, in floating point, at one of the configurations of the incidences; -1 if the
    singular values have no gap."""
    directions = list(relations.directions[:, place])
    rows = [
        *(_list_direction_rows(conditions, directions) for conditions in relations.tower),
        _list_centre_rows(relations, directions),
    ]
    found = []
    for each in rows:
        matrix = each.astype(float)
        sizes = np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), RANK_CUTOFF_FRACTION)
        seen = rank_of(np.linalg.svd(matrix / sizes, compute_uv=False))
        found.append(seen.value if seen.gap >= RANK_GAP_MIN else -1)
    return tuple(found)


def build_instance(
    mechanism: Mechanism, relations: Incidences, observations: Sequence[Observation], drawn: Geometry
) -> Instance:
    """The kinematics of a mechanism with this geometry, from the rates of its joints: whole numbers throughout.

    The incidences are those of the observed directions, then those of the other observations.
    """
    screws = {name: _list_screws(joint, relations, drawn) for name, joint in mechanism.joints.items()}
    velocities, loops, columns = _compute_link_twists(mechanism, screws)
    places = SensorPlaces.of(observations, mechanism)
    sights = iter(relations.sights)
    directions = {
        o.key: compute_observed_direction(next(sights), drawn) for o in observations if isinstance(o, SeenAxis)
    }
    further = [compute_observed_direction(sight, drawn) for sight in sights]
    t = np.vstack([velocities[body] for body in mechanism.bodies])
    if relations.point is not None:
        point, scale = scale_to_whole(drawn.centres[relations.point])
        t = scale * t[:3] + cross(t[3:], point[:, None], axis=-2)
    parts, sightings = [t], list[ViewGeometry | None]()
    for observation in observations:
        sightings.append(
            build_view_geometry(
                observation, places, relations, drawn.centres, further, mechanism, directions.get(observation.key)
            )
        )
        if observation.key in directions:
            turn = velocities[observation.link] - velocities[observation.seen_from or mechanism.reference]
            parts.append(cross(scale_to_whole(directions[observation.key])[0][:, None], turn[3:], axis=-2))
        else:
            parts.append(compute_observation_rates(observation, sightings[-1], mechanism, velocities, columns))
    free, _ = _reduce(loops)
    t, *moving = np.split(_compute_product(np.vstack(parts), free), np.cumsum([len(part) for part in parts[:-1]]))
    return Instance(drawn, t, tuple(moving), velocities, free, loops, tuple(parts), tuple(sightings))


def _list_screws(joint: Joint, relations: Incidences, drawn: Geometry) -> Numbers:
    """Twists that a joint allows, each of any length, columns of whole numbers (6, dof)."""
    from flint import fmpz

    number = relations.centres.get(joint.name)
    anywhere = np.array([fmpz(0)] * 3, dtype=object)
    point, scale = (anywhere, 1) if number is None else scale_to_whole(drawn.centres[number])
    axes = [scale_to_whole(drawn.directions[c])[0] for c in relations.axes[joint.name]]
    found = [
        np.concatenate([screw[:3], scale * screw[3:]]) if screw[3:].any() else screw
        for screw in list_allowed_twists(joint.type, point, axes)
    ]
    return np.array(found, dtype=object).reshape(-1, 6).T


def _compute_link_twists(
    mechanism: Mechanism, screws: Mapping[str, Numbers]
) -> tuple[dict[str, Numbers], Numbers, dict[str, slice]]:
    """Return the twists of all links (6, rates) along a tree of joints, the loop constraints of the other joints on the
    rates (rows, rates), and the rates of each joint."""
    joints = list(mechanism.joints.values())
    sizes = np.cumsum([0, *(screws[joint.name].shape[1] for joint in joints)])
    own = {joint.name: slice(*sizes[i : i + 2]) for i, joint in enumerate(joints)}
    velocities = {mechanism.base: np.zeros((6, sizes[-1]), dtype=object)}
    tree = graphs.order_outward(
        mechanism.base, graphs.build_spanning_forest(mechanism.links, joints, [0.0] * len(joints))
    )
    for joint, near, far in tree:
        velocities[far] = velocities[near].copy()
        velocities[far][:, own[joint.name]] = screws[joint.name] * (1 if far == joint.successor else -1)
    used = {joint.name for joint, _, _ in tree}
    loops = [np.zeros((0, sizes[-1]), dtype=object)]
    for joint in joints:
        if joint.name not in used:
            loop = velocities[joint.successor] - velocities[joint.predecessor]
            loop[:, own[joint.name]] -= screws[joint.name]
            loops.append(loop)
    return velocities, np.vstack(loops), own


def _draw_directions(relations: Incidences, rng: random.Random) -> tuple[tuple[Numbers, ...], list[int]]:
    """A direction for each class, one after another, whole numbers; the rank of the conditions on each."""
    found: list[Numbers] = []
    ranks: list[int] = []
    for number, conditions in enumerate(relations.tower):
        basis = compute_exact_kernel(_list_direction_rows(conditions, found))
        if basis.shape[1] == 0:
            raise RecognitionFailure(
                "no random direction satisfies all incidences (parallel, perpendicular, in one plane): "
                + relations.members(number)
            )
        found.append(_scale_to_whole(basis @ draw_whole_numbers(basis.shape[1], rng)))
        ranks.append(3 - basis.shape[1])
    return tuple(found), ranks


def _list_direction_rows(conditions: Sequence[tuple[int, ...]], directions: Sequence[Numbers]) -> Numbers:
    """Conditions (conditions, 3) on a direction by those before it."""
    rows = [directions[c[0]] if len(c) == 1 else cross(directions[c[0]], directions[c[1]]) for c in conditions]
    return np.array(rows, dtype=object).reshape(-1, 3)


def _list_centre_rows(relations: Incidences, directions: Sequence[Numbers]) -> Numbers:
    """The linear system of all incidences (rows, 3 centres)."""
    n = relations.count
    rows: dict[tuple[Any, ...], None] = {}
    for each in relations.incidences:
        for normal in _list_normals(each, directions):
            row = [0] * (3 * n)
            for point, sign in each.terms:
                row[3 * point : 3 * point + 3] = [sign * x for x in normal]
            rows[tuple(row)] = None
    return np.array(list(rows), dtype=object).reshape(len(rows), 3 * n)


def _list_normals(incidence: Incidence, directions: Sequence[Numbers]) -> Sequence[Iterable[Any]]:
    """Vectors to which the vector of an incidence is normal."""
    match incidence.kind:
        case "zero":
            return [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        case "parallel":
            return find_normals(directions[incidence.classes[0]])
        case _:
            return [directions[incidence.classes[0]]]


def compute_observed_direction(sight: DirectionSource, drawn: Geometry) -> Numbers:
    """An observed direction, of any length."""
    axes = [drawn.directions[c] for c in sight.classes]
    match sight.kind:
        case "class":
            return axes[0]
        case "normal":
            return cross(axes[0], axes[1])
        case _:
            j, k = sight.points
            between = drawn.centres[k] - drawn.centres[j]
            return between if sight.kind == "between" else cross(axes[0], cross(between, axes[0]))


def draw_whole_numbers(count: int, rng: random.Random) -> Numbers:
    """Random whole numbers, as rational ones."""
    from flint import fmpq

    return np.array([fmpq(rng.choice((-1, 1)) * rng.randint(1, LARGEST_RANDOM)) for _ in range(count)], dtype=object)


def _scale_to_whole(vector: Numbers) -> Numbers:
    """The shortest vector of whole numbers along a rational one."""
    numbers, _ = scale_to_whole(vector)
    return numbers // gcd(*numbers)


def compute_exact_kernel(rows: Numbers) -> Numbers:
    """A basis of the exact kernel of whole rows, rational, shape (columns, nullity)."""
    from flint import fmpq

    basis, divisor = _reduce(rows)
    return np.array([fmpq(x, divisor) for x in basis.ravel()], dtype=object).reshape(basis.shape)


def _reduce(rows: Numbers) -> tuple[Numbers, Any]:
    """A whole basis of the kernel, shape (columns, nullity), and the value of each vector in its own free column."""
    from flint import fmpz

    columns = rows.shape[1]
    reduced, divisor, found = _convert_to_matrix(rows).rref()
    table = np.array(reduced.entries(), dtype=object).reshape(rows.shape)[:found]
    pivots = [next(j for j, x in enumerate(row) if x) for row in table]
    free = sorted(set(range(columns)) - set(pivots))
    basis = np.full((columns, len(free)), fmpz(0), dtype=object)
    basis[free, range(len(free))] = divisor
    basis[pivots] = -table[:, free]
    return basis, divisor


def _compute_product(a: Numbers, b: Numbers) -> Numbers:
    """The product of matrices of whole numbers."""
    return np.array((_convert_to_matrix(a) * _convert_to_matrix(b)).entries(), dtype=object).reshape(len(a), b.shape[1])


def _convert_to_matrix(rows: Numbers) -> fmpz_mat:
    from flint import fmpz_mat

    return fmpz_mat(rows.shape[0], rows.shape[1], rows.ravel().tolist())


def rank(rows: Numbers) -> int:
    """The exact rank of a rational matrix."""
    from flint import fmpq_mat

    return int(fmpq_mat(rows.shape[0], rows.shape[1], rows.ravel().tolist()).rank())
