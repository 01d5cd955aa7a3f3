"""Modes of formations: against exact ranks, known counts of frameworks, and counts with which nothing is shared."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
import pytest
from flint import fmpz_mat

from hrsynth.analysis.modes.assembly_mode import AssemblyMode
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.certificates import certificate
from hrsynth.errors import BadRequest, NoCertificate
from hrsynth.families.formations import build_formation
from hrsynth.geometry.vectors import Array, freeze_array
from hrsynth.mechanism.observations.distance import PointDistance
from hrsynth.present.show import text
from strategies import random_rotation

Pairs = list[tuple[int, int]]
LAMAN: Pairs = [(1, 2), (1, 3), (2, 3), (2, 4), (3, 4), (3, 5), (4, 5)]
PRISM: Pairs = [(1, 2), (2, 3), (1, 3), (4, 5), (5, 6), (4, 6), (1, 4), (2, 5), (3, 6)]
RING: Pairs = [(1, 2), (2, 3), (3, 4), (4, 5), (5, 1)]


def places_of(mode: AssemblyMode) -> tuple[Array, Array]:
    assert mode.bodies is not None
    found = np.array(list(mode.bodies.values()))
    return found[:, :3, 3], found[:, :3, :3]


def measured(places: Array, turns: Array, bearings: Pairs, distances: Pairs) -> Array:
    """Plain NumPy: directions in the seeing body's frame, and distances."""
    rows = [turns[i - 1].T @ (places[j - 1] - places[i - 1]) for i, j in bearings]
    lengths = [[np.linalg.norm(places[j - 1] - places[i - 1])] for i, j in distances]
    return np.concatenate([*(each / np.linalg.norm(each) for each in rows), *lengths])


def require_modes(found: AssemblyModes, bearings: Pairs, distances: Pairs) -> None:
    """All have the measurements of the first, and no two are alike: distances between bodies, in the first as unit, and
    volumes tell them apart."""
    places, turns = places_of(found.modes[0])
    for each in found.modes:
        assert np.allclose(
            measured(*places_of(each), bearings, distances), measured(places, turns, bearings, distances), atol=1e-8
        )
    pairs, fours = list(combinations(range(len(places)), 2)), list(combinations(range(len(places)), 4))
    flat = np.ptp(places[:, 2]) == 0.0
    invariants = []
    for P, _ in map(places_of, found.modes):
        arms = [P[j] - P[i] for i, j in pairs]
        turned = (
            [np.cross(P[j] - P[0], P[k] - P[0])[2] for j, k in combinations(range(1, len(P)), 2)]
            if flat
            else [np.linalg.det(P[[b, c, d]] - P[a]) for a, b, c, d in fours]
        )
        invariants.append(np.array([*map(np.linalg.norm, arms), *turned]) / np.linalg.norm(arms[0]))
    assert all(np.abs(a - b).max() > 1e-5 for a, b in combinations(invariants, 2))


@pytest.mark.some(1)
@pytest.mark.parametrize("bodies", ["position", "plane position"])
@pytest.mark.parametrize(("n", "bearings"), [(4, list(combinations(range(1, 5), 2))), (5, LAMAN)])
def test_rigid_bearings_in_a_common_frame_have_one_mode_by_rank(bodies: str, n: int, bearings: Pairs):
    """Whole numbers as places: over the integers the bearings' equations have the rank that leaves d + 1 freedoms."""
    places = np.random.default_rng(n).integers(-9, 10, size=(n, 3))
    d = 2 if bodies == "plane position" else 3
    places[:, 2] *= d - 2
    rows = []
    for i, j in bearings:
        arm = places[j - 1] - places[i - 1]
        for a, b in combinations(range(d), 2):
            row = np.zeros((n, d), dtype=int)
            row[j - 1, [a, b]] = row[i - 1, [a, b]] = -arm[b], arm[a]
            row[i - 1] *= -1
            rows.append(row.ravel().tolist())
    found = modes(build_formation(places.astype(float), bearings, bodies=bodies))
    assert fmpz_mat(rows).rank() == d * n - d - 1
    assert (found.found.complete, found.found.complex, len(found.modes), len(found.antipodal)) == (True, 1, 1, 0)
    assert found.modes[0].goal
    assert f"of rank {d * n - d - 1} " in found.found.proof
    with pytest.raises(NoCertificate, match="formation"):
        certificate(found)


def test_a_distance_leaves_the_opposite_of_all_bearings():
    places = np.random.default_rng(1).normal(size=(5, 3))
    found = modes(build_formation(places, LAMAN, [(1, 2)], bodies="position"))
    assert (found.found.complete, found.found.complex, len(found.modes)) == (True, 2, 1)
    (other,) = found.antipodal
    assert set(other.opposite) == {f"{i}-{j}" for i, j in LAMAN}
    there = places_of(other)[0]
    assert np.allclose(there[:, None] - there, places - places[:, None], atol=1e-8)
    assert "antipodal 1" in text(found)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("places", "bearings", "flexes"),
    [
        (np.random.default_rng(2).normal(size=(5, 3)), RING, 1),
        (np.array([[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.3, 0.6, 0.9]]), [(1, 2), (2, 3), (1, 3)], 1),
    ],
)
def test_a_flexible_formation_has_a_continuum_with_its_flexes(places: Array, bearings: Pairs, flexes: int):
    """A ring; and three on one line, whose decimals are not on one line as binary numbers."""
    found = modes(build_formation(places, bearings, bodies="position"))
    assert (found.found.continuous_family, found.found.complete, found.modes) == (flexes, False, ())
    assert found.formation is not None
    assert sum(each.count for each in found.formation.flexes) == flexes
    assert f"a continuous family of dimension {flexes}" in text(found)


KNOWN = [
    pytest.param("plane position", 3, [], [(1, 2), (2, 3), (1, 3)], 2, id="triangle and mirror image"),
    pytest.param(
        "plane position", 5, [], LAMAN, 8, id="each of three bodies on either side of two", marks=[pytest.mark.slow]
    ),
    pytest.param("position", 4, [], list(combinations(range(1, 5), 2)), 2, id="tetrahedron and mirror image"),
    pytest.param(
        "plane",
        3,
        [(1, 2), (2, 3), (3, 1)],
        [(1, 2), (2, 3), (1, 3)],
        2,
        id="cameras that turn with it",
        marks=pytest.mark.slow,
    ),
    pytest.param("yaw", 3, list(permutations((1, 2, 3), 2)), [], 1, id="all see all", marks=pytest.mark.slow),
    pytest.param("free", 3, list(permutations((1, 2, 3), 2)), [(1, 2)], 1, id="turns in space", marks=pytest.mark.slow),
]


@pytest.mark.some(1)
@pytest.mark.parametrize(("bodies", "n", "bearings", "distances", "count"), KNOWN)
def test_as_many_are_found_as_are_known(bodies: str, n: int, bearings: Pairs, distances: Pairs, count: int):
    """Up to similarities that leave all measurements, mirror images apart; the five bodies at places at which all
    triangles can be closed either way."""
    rng = np.random.default_rng(5)
    places = rng.normal(size=(n, 3))
    if "plane" in bodies:
        places[:, 2] = 0.25
    turns = None if "plane" in bodies else [random_rotation(rng) for _ in range(n)]
    found = modes(build_formation(places, bearings, distances, bodies=bodies, turns=turns))
    assert len(found.modes) == count
    assert (found.found.complete, found.found.complex) == (False, None)
    assert found.modes[0].goal
    require_modes(found, bearings, distances)


def placings(base: Array, platform: Array, rods: Array) -> int:
    """In how many ways three rods join two triangles (3, 2) in the plane: a trigonometric polynomial of degree three in
    the turn, sampled, and its roots on the unit circle.

    |p + R b_k - a_k|² = r_k²; differences are linear in p, and with p from two of them the first is left.
    """

    def value(z: complex) -> complex:
        def turned(v: Array) -> Array:
            c, s = (z + 1 / z) / 2, (z - 1 / z) / 2j
            return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])

        arms = [turned(b) - a for a, b in zip(base, platform, strict=True)]
        size = [e @ e - r * r for e, r in zip(arms, rods, strict=True)]
        A = 2 * np.array([arms[k] - arms[0] for k in (1, 2)])
        h = -np.array([size[k] - size[0] for k in (1, 2)])
        det = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
        p = np.array([A[1, 1] * h[0] - A[0, 1] * h[1], A[0, 0] * h[1] - A[1, 0] * h[0]])  # times det
        return p @ p + 2 * det * (p @ arms[0]) + det * det * size[0]

    n = 32
    samples = np.array([value(np.exp(2j * np.pi * k / n)) for k in range(n)])
    series = np.fft.fft(samples) / n
    degree = max(k for k in range(n // 2) if abs(series[k]) > 1e-9 * np.abs(series).max())
    assert degree == 3
    roots = np.roots([series[k] for k in range(3, -4, -1)])
    assert len(roots) == 6
    return int(np.sum(np.abs(np.abs(roots) - 1) < 1e-7))


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("seed", range(3))
def test_the_modes_of_a_prism_are_those_of_two_triangles_on_three_rods(seed: int):
    """24 complex embeddings with mirror images (the Desargues graph): six for either side of the second triangle,
    twice; the real ones are counted by a polynomial."""
    rng = np.random.default_rng(seed)
    places = np.hstack([rng.normal(size=(6, 2)), np.zeros((6, 1))])
    flat = places[:, :2]
    rods = np.linalg.norm(flat[:3] - flat[3:], axis=1)
    expected = 2 * sum(placings(flat[:3], (flat[3:] - flat[3]) * np.array([1, side]), rods) for side in (1, -1))
    found = modes(build_formation(places, [], PRISM, bodies="plane position"))
    assert len(found.modes) == expected <= 24
    require_modes(found, [], PRISM)


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_moved_along_is_no_other_mode(seed: int):
    """Distances between points aside of two origins, in a tilted common frame: translations alone are trivial, and no
    two modes are alike but for one."""
    rng = np.random.default_rng(seed)
    made = build_formation(
        rng.normal(size=(2, 3)), distances=[(1, 2)] * 6, bodies="position", frame=random_rotation(rng)
    )
    seen = tuple(
        replace(each, leg=f"d{k}", at=freeze_array(rng.normal(size=3)))
        for k, each in enumerate(made.observations)
        if isinstance(each, PointDistance)
    )
    found = modes(replace(made, observations=seen))
    assert found.formation is not None
    assert (len(found.formation.trivial), found.formation.count) == (3, 0)
    shapes = [np.diff(places_of(each)[0], axis=0) for each in found.modes]
    assert all(np.abs(a - b).max() > 1e-5 for a, b in combinations(shapes, 2))


def test_poses_and_motors_of_formations_are_refused():
    made = build_formation(np.eye(3), [(1, 2), (2, 3), (1, 3)], bodies="position")
    for asked in ({"at": "x=1"}, {"at": "mode:1"}, {"real": True}):
        with pytest.raises(BadRequest, match="a formation has no"):
            modes(made, **asked)
