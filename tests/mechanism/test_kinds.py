"""Every kind of observation obeys the same laws: rates are derivatives, the chain has six freedoms and sees what the
kind sees, and what is transmitted when the value is held is reciprocal to what still moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.errors import BadMechanism
from hrsynth.geometry.vectors import Array, build_pose, normalise_vector
from hrsynth.mechanism.cameras import CameraObservation, NamedCamera, VirtualJoint
from hrsynth.mechanism.model import JointType
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations import list_kinds
from hrsynth.mechanism.observations.encoder import AngleEncoder, Encoder, SlideEncoder
from hrsynth.mechanism.screws import list_allowed_twists
from oracle import exponential
from strategies import random_direction, random_rotation

Rng = np.random.Generator
FREEDOMS = {"R": 1, "P": 1, "U": 2, "C": 2, "S": 3}
CHAINED = [kind for kind in list_kinds().values() if kind is not Encoder]
SEEDS = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def random_pose(rng: Rng) -> Array:
    return build_pose(rng.normal(size=3), random_rotation(rng))


def drawn(kind: type[Observation], rng: Rng, side: int = 1) -> Observation:
    """An observation of link l by a camera on link c, with a small radius where it has one; not of a
    circle in the image, whose size would hardly be seen."""
    if issubclass(kind, CameraObservation):
        camera = NamedCamera("eye", "c", random_pose(rng))
        axis = random_direction(rng) if "axis" in kind.needs else None
        widest = 1.0 if kind.kind == "image_circle" else 0.1
        radius = side * widest * rng.uniform(0.5, 1.0) if "radius" in kind.needs else None
        return kind("p", "l", at=rng.normal(size=3), axis=axis, radius=radius, camera=camera)
    return kind("p", "l", random_direction(rng), seen_from="c")  # type: ignore[call-arg]


def far(rng: Rng, kind: type[Observation], side: int = 1) -> tuple[Observation, Array, Array]:
    """An observation and the poses of both links, no point or line near the camera's centre, nothing on an axis, and
    the centre not near the plane of a circle that is seen as a conic, where that loses rank."""
    while True:
        seen, X_c, X = drawn(kind, rng, side), random_pose(rng), random_pose(rng)
        if not isinstance(seen, CameraObservation):
            return seen, X_c, X
        at = seen.sighting(X_c, X)
        line = np.linalg.norm(np.cross(at.B - at.C, at.d)) if seen.axis is not None else 1.0
        flat = abs(np.dot(at.B - at.C, at.d)) if seen.kind == "image_circle" else 1.0
        if line > 0.4 and np.linalg.norm(at.B - at.C) > 0.4 and flat > 0.1:
            return seen, X_c, X


def chain_of(seen: Observation, X_c: Array, X: Array) -> tuple[VirtualJoint, ...]:
    return seen.chain(seen.sighting(X_c, X))  # type: ignore[attr-defined, no-any-return]


def twists(chain: tuple[VirtualJoint, ...], wanted: Callable[[VirtualJoint], bool] = lambda _: True) -> Array:
    """The twists (6, n) of some joints of a chain, about the base's origin."""
    screws = [
        t
        for joint in chain
        if wanted(joint)
        for t in list_allowed_twists(JointType(joint.letter), joint.at, joint.axes)
    ]
    return np.array(screws, dtype=float).reshape(-1, 6).T


def rates(seen: Observation, X_c: Array, X: Array) -> Array:
    """The rates (size, 6) for twists of the link about the base's origin, the reference link at rest."""
    p = X[:3, 3]
    shift = np.array([[0, p[2], -p[1]], [-p[2], 0, p[0]], [p[1], -p[0], 0]])
    V = np.block([[np.eye(3), shift], [np.zeros((3, 3)), np.eye(3)]])
    return seen.rate(X_c, X, np.zeros((6, 6)), V)


def moved(X: Array, twist: Array, time: float) -> Array:
    return build_pose(X[:3, 3] + time * twist[:3], exponential(time * twist[3:]) @ X[:3, :3])


@pytest.mark.some(6)
@pytest.mark.parametrize("kind", CHAINED, ids=lambda kind: kind.kind)
@settings(max_examples=20, deadline=None)
@given(rng=SEEDS, side=st.sampled_from([1, -1]))
def test_rates_are_derivatives(kind: type[Observation], rng: Rng, side: int) -> None:
    """Of the value, for any motion of both links, to 1e-8 (a difference of the fourth order)."""
    seen, X_c, X = far(rng, kind, side)
    V_c, V = rng.uniform(-1, 1, size=(2, 6))
    h = 5e-4
    steps = [seen.value(moved(X_c, V_c, s * h), moved(X, V, s * h)) for s in (-2, -1, 1, 2)]
    slope = (steps[0] - 8 * steps[1] + 8 * steps[2] - steps[3]) / (12 * h)
    rate = seen.rate(X_c, X, V_c[:, None], V[:, None])[:, 0]
    assert rate.shape == (kind.size,)
    assert np.max(np.abs(slope - rate)) < 1e-8 * (1 + np.max(np.abs(rate)))


@pytest.mark.some(6)
@pytest.mark.parametrize("kind", CHAINED, ids=lambda kind: kind.kind)
@settings(max_examples=20, deadline=None)
@given(rng=SEEDS, side=st.sampled_from([1, -1]))
def test_a_chain_constrains_nothing_and_sees_what_the_kind_sees(kind: type[Observation], rng: Rng, side: int) -> None:
    """Six freedoms, independent; its passive ones are the kernel of the rates; its motors are what is measured."""
    seen, X_c, X = far(rng, kind, side)
    chain, M = chain_of(seen, X_c, X), rates(seen, X_c, X)
    whole, passive = twists(chain), twists(chain, lambda joint: not joint.actuated)
    assert sum(FREEDOMS[joint.letter] for joint in chain) == 6
    assert np.linalg.svd(whole, compute_uv=False)[-1] > 1e-6
    assert np.max(np.abs(M @ passive), initial=0.0) < 1e-9 * (1 + np.abs(M).max()) * (1 + np.abs(passive).max())
    assert np.linalg.matrix_rank(M, tol=1e-8) == seen.rank == 6 - passive.shape[1]  # type: ignore[attr-defined]


@pytest.mark.some(6)
@pytest.mark.parametrize("kind", CHAINED, ids=lambda kind: kind.kind)
@settings(max_examples=20, deadline=None)
@given(rng=SEEDS, side=st.sampled_from([1, -1]))
def test_wrenches_are_reciprocal_to_what_moves_when_the_value_is_held(
    kind: type[Observation], rng: Rng, side: int
) -> None:
    """And they are as many as are independent: they span the same space as the rates do."""
    seen, X_c, X = far(rng, kind, side)
    W = np.array(seen.wrenches(seen.sighting(X_c, X)), dtype=float)  # type: ignore[attr-defined]
    passive = twists(chain_of(seen, X_c, X), lambda joint: not joint.actuated)
    assert np.max(np.abs(W @ passive), initial=0.0) < 1e-9 * (1 + np.abs(W).max()) * (1 + np.abs(passive).max())
    M = rates(seen, X_c, X)
    rank = np.linalg.matrix_rank
    assert rank(W, tol=1e-8) == rank(M, tol=1e-8) == rank(np.vstack([W, M]), tol=1e-7)


@pytest.mark.parametrize("kind", CHAINED, ids=lambda kind: kind.kind)
def test_values_are_told_in_the_frame_of_the_camera(kind: type[Observation]) -> None:
    """Moved together, camera and link measure the same; and several at once measure what each one does."""
    rng = np.random.default_rng(4)
    several = [far(rng, kind) for _ in range(3)]
    for seen, X_c, X in several:
        D = random_pose(rng)
        np.testing.assert_allclose(seen.value(D @ X_c, D @ X), seen.value(X_c, X), atol=1e-12)
    X_c, V_c, V = several[0][1], rng.normal(size=(6, 4)), rng.normal(size=(3, 6, 4))
    poses = np.array([X for _, _, X in several])
    values, J = kind.together([seen for seen, _, _ in several], X_c, poses, V_c, V)
    each = [(seen.value(X_c, X), seen.rate(X_c, X, V_c, v)) for (seen, _, X), v in zip(several, V, strict=True)]
    np.testing.assert_allclose(values, np.concatenate([value for value, _ in each]), atol=1e-13)
    np.testing.assert_allclose(J, np.vstack([rate for _, rate in each]), atol=1e-13)


@pytest.mark.parametrize("kind", [*CHAINED, AngleEncoder, SlideEncoder], ids=lambda kind: kind.__name__)
def test_what_needs_turns_only_is_the_same_whatever_the_points_do(kind: type[Observation]) -> None:
    rng = np.random.default_rng(3)
    if issubclass(kind, Encoder):
        seen: Observation = kind(
            "p",
            "l",
            "j",
            random_direction(rng),
            *rng.normal(size=(2, 3)),  # type: ignore[call-arg]
            seen_from="c",
        )
        X_c, X = random_pose(rng), random_pose(rng)
    else:
        seen, X_c, X = far(rng, kind)
    V_c, V = rng.normal(size=(2, 6, 3))
    elsewhere = V.copy()
    elsewhere[:3] = rng.normal(size=(3, 3))
    same = np.allclose(seen.rate(X_c, X, V_c, V), seen.rate(X_c, X, V_c, elsewhere), rtol=0, atol=1e-12)
    assert same is kind.turns_only


@pytest.mark.parametrize("kind", [*CHAINED, AngleEncoder, SlideEncoder], ids=lambda kind: kind.__name__)
def test_the_same_is_measured_where_links_become_parts_of_others(kind: type[Observation]) -> None:
    rng = np.random.default_rng(6)
    a = random_direction(rng)
    seen = (
        drawn(kind, rng)
        if not issubclass(kind, Encoder)
        else kind(
            "p",
            "l",
            "j",
            a,
            normalise_vector(np.cross(a, [1, 2, 3])),
            normalise_vector(np.cross(a, [3, 1, 2])),  # type: ignore[call-arg]
            seen_from="c",
        )
    )
    poses = {name: random_pose(rng) for name in ("l", "c", "whole", "hand")}
    there = seen.carried_by({"l": "whole", "c": "hand"}, poses)
    assert (there.link, there.seen_from) == ("whole", "hand")
    same = isinstance(seen, CameraObservation | Encoder)
    one, other = seen.value(poses["c"], poses["l"]), there.value(poses["hand"], poses["whole"])
    turned = np.eye(3) if same else poses["hand"][:3, :3].T @ poses["c"][:3, :3]
    np.testing.assert_allclose(other, one if same else turned @ one, atol=1e-12)


def test_a_circle_seen_from_its_axis_or_edge_on_shows_less() -> None:
    """There its chain still has five motors: the image loses two freedoms, not the chain."""
    rng = np.random.default_rng(1)
    kind = list_kinds()["image_circle"]
    X, X_c = build_pose(), build_pose((0, 0, -1.0), random_rotation(rng))
    seen = kind("p", "l", at=np.zeros(3), axis=np.array([0, 0, 1.0]), radius=0.2)  # type: ignore[call-arg]
    assert np.linalg.matrix_rank(rates(seen, X_c, X), tol=1e-8) == 3
    edge_on, aside = (build_pose(centre, X_c[:3, :3]) for centre in ((0.8, 0.6, 0), (0.1, 0, -1.0)))
    assert np.linalg.matrix_rank(rates(seen, edge_on, X), tol=1e-8) == 2
    assert np.linalg.matrix_rank(rates(seen, aside, X), tol=1e-8) == 5


def test_a_line_through_the_centre_has_a_chain_of_other_motors() -> None:
    kind = list_kinds()["line"]
    seen = kind("p", "l", at=np.array([0, 0, 1.0]), axis=np.array([0, 0, 1.0]))  # type: ignore[call-arg]
    X_c, X = build_pose(), build_pose()
    chain = chain_of(seen, X_c, X)
    passive = twists(chain, lambda joint: not joint.actuated)
    assert [joint.letter for joint in chain] == ["P", "P", "U", "C"]
    assert np.linalg.svd(twists(chain), compute_uv=False)[-1] > 1e-6
    assert np.max(np.abs(rates(seen, X_c, X) @ passive)) < 1e-12


@pytest.mark.parametrize(
    ("kind", "geometry"),
    [
        ("point", {}),
        ("position", {}),
        ("distance", {}),
        ("image_line", {"axis": [0, 0, 1.0]}),
        ("circle", {"axis": [0, 0, 1.0]}),
        ("edge", {"axis": [0, 0, 1.0], "radius": 0.2, "at": [0.1, 0, 0]}),
        ("edges", {"axis": [0, 0, 1.0], "radius": 0.2, "at": [0.1, 0, 0]}),
        ("image_circle", {"axis": [0, 0, 1.0], "radius": 0.0, "at": [0.1, 0, 0]}),
    ],
)
def test_what_has_no_rate_in_the_centre_is_refused(kind: str, geometry: dict[str, object]) -> None:
    seen = list_kinds()[kind]("p", "l", **geometry)
    with pytest.raises(BadMechanism, match=f"^{kind} 'p'|^circle 'p'"):
        chain_of(seen, build_pose(), build_pose())


def test_every_file_is_a_kind_of_its_own() -> None:
    found = list_kinds()
    assert len(found) == 13
    assert all(
        word == kind.kind and kind.words and set(kind.needs) <= {"at", "axis", "axis?", "radius", "joint"}
        for word, kind in found.items()
    )
