"""What a servo loop feeds back of each kind: the errors' derivatives, the field's interaction matrices, images drawn by
hand, sight and simulated sensors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.geometry.vectors import Array, build_pose, invert_pose, normalise_vector
from hrsynth.mechanism.cameras import CameraObservation, NamedCamera
from hrsynth.mechanism.images import IMAGE_LINE_HALF_WIDTH_FRACTION
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations import list_kinds
from hrsynth.mechanism.observations.encoder import AngleEncoder, SlideEncoder
from hrsynth.mechanism.observations.image_circle import ImageCircle
from hrsynth.mechanism.observations.image_line import ImageLine
from hrsynth.mechanism.observations.point import ImagePoint
from mechanism.test_kinds import CHAINED, Rng, far, moved, random_pose
from strategies import random_direction, random_rotation

SEEDS = st.integers(0, 2**32 - 1).map(np.random.default_rng)
IMAGES = [kind for kind in CHAINED if kind.kind in ("point", "image_line", "edge")]


def in_sight(rng: Rng, kind: type[Observation], side: int = 1) -> tuple[Observation, Array, Array]:
    """An observation with what it sees well in front of the camera, no line of the image far outside."""
    while True:
        seen, X_c, X = far(rng, kind, side)
        value = seen.value(X_c, X)
        if (
            kind.kind in ("image_line", "edge", "edges")
            and min(np.hypot(value[0], value[1]), np.hypot(value[-3], value[-2])) < 0.3
        ):
            continue
        if seen.in_front(X_c, X) > 0.3:
            return seen, X_c, X


def camera_frame(seen: CameraObservation, X_c: Array, X: Array) -> tuple[Array, Array]:
    """B and d in the camera's frame."""
    relative = invert_pose(X_c @ seen.view) @ X
    axis = np.zeros(3) if seen.axis is None else seen.axis
    return relative[:3, :3] @ seen.at + relative[:3, 3], relative[:3, :3] @ axis


def camera_twists(seen: CameraObservation, X_c: Array) -> Array:
    """The camera's twists as velocities (6, 6) of the frame of the link that carries it: v and ω in its own axes."""
    X = X_c @ seen.view
    R, arm = X[:3, :3], X_c[:3, 3] - X[:3, 3]
    shift = np.array([[0, arm[2], -arm[1]], [-arm[2], 0, arm[0]], [arm[1], -arm[0], 0]])
    return np.block([[R, shift @ R], [np.zeros((3, 3)), R]])


@pytest.mark.some(4)
@pytest.mark.parametrize("kind", CHAINED, ids=lambda kind: kind.kind)
@settings(max_examples=20, deadline=None)
@given(rng=SEEDS, side=st.sampled_from([1, -1]))
def test_rows_of_the_interaction_matrix_are_derivatives_of_the_error(
    kind: type[Observation], rng: Rng, side: int
) -> None:
    """For any motion of both links, to 1e-8; and errors change their sign where value and wanted value do."""
    seen, X_c, X = in_sight(rng, kind, side)
    wanted = seen.value(moved(X_c, rng.uniform(-0.1, 0.1, size=6), 1), moved(X, rng.uniform(-0.1, 0.1, size=6), 1))
    V_c, V = rng.uniform(-1, 1, size=(2, 6))
    h, value = 5e-4, seen.value(X_c, X)
    steps = [seen.error(seen.value(moved(X_c, V_c, s * h), moved(X, V, s * h)), wanted) for s in (-2, -1, 1, 2)]
    slope = (steps[0] - 8 * steps[1] + 8 * steps[2] - steps[3]) / (12 * h)
    rows = (seen.error_slope(value, wanted) @ seen.rate(X_c, X, V_c[:, None], V[:, None]))[:, 0]
    # differences of the fourth order of what is nearly singular have errors of their own
    assert np.max(np.abs(slope - rows)) < 1e-8 * (1 + np.max(np.abs(rows)) ** 5)
    np.testing.assert_allclose(seen.error(wanted, value), -seen.error(value, wanted), atol=1e-13)
    assert not seen.error(value, value).any()


@pytest.mark.parametrize("kind", IMAGES, ids=lambda kind: kind.kind)
@settings(max_examples=20, deadline=None)
@given(rng=SEEDS, side=st.sampled_from([1, -1]))
def test_the_plane_in_which_it_lies_gives_its_rate(kind: type[CameraObservation], rng: Rng, side: int) -> None:
    """Supposed in its own plane it moves as it does; in any other plane it has the same value, and turns of the camera
    are seen as they are, whatever is supposed."""
    seen, X_c, X = in_sight(rng, kind, side)
    assert isinstance(seen, CameraObservation)
    plane, V_c, V = seen.plane_at(X_c, X), *rng.uniform(-1, 1, size=(2, 6, 3))
    assert plane is not None
    np.testing.assert_allclose(seen.suppose_plane_rate(plane, X_c, X, V_c, V), seen.rate(X_c, X, V_c, V), atol=1e-9)
    p, d = camera_frame(seen, X_c, X)
    other, r = plane + 0.3 * random_direction(rng) * np.linalg.norm(plane), np.array([seen.radius or 0.0])
    np.testing.assert_allclose(
        seen.measurement(*seen.suppose_plane(p, d, r, other), r), seen.measurement(p, d, r), atol=1e-9
    )
    turns = camera_twists(seen, X_c)[:, 3:]
    still = np.zeros((6, 3))
    np.testing.assert_allclose(
        seen.suppose_plane_rate(other, X_c, X, turns, still),
        seen.rate(X_c, X, turns, still),
        atol=1e-9 * (1 + 1 / np.linalg.norm(other)),
    )


@settings(max_examples=20, deadline=None)
@given(rng=SEEDS)
def test_a_point_has_the_matrix_of_the_textbook(rng: Rng) -> None:
    """Chaumette and Hutchinson 2006, eq. 11, with the depth that is supposed."""
    seen, X_c, X = in_sight(rng, ImagePoint)
    assert isinstance(seen, ImagePoint)
    (x, y), Z = seen.error(seen.value(X_c, X), np.array([0.0, 0, 1])), rng.uniform(0.3, 2)
    V_c = camera_twists(seen, X_c)
    rows = seen.error_slope(seen.value(X_c, X), seen.value(X_c, X)) @ seen.suppose_plane_rate(
        np.array([0, 0, 1 / Z]), X_c, X, V_c, np.zeros((6, 6))
    )
    expected = [[-1 / Z, 0, x / Z, x * y, -(1 + x * x), y], [0, -1 / Z, y / Z, 1 + y * y, -x * y, -x]]
    np.testing.assert_allclose(rows, expected, atol=1e-9 * (1 + np.abs(expected).max()))


@settings(max_examples=20, deadline=None)
@given(rng=SEEDS)
def test_a_line_has_the_matrix_of_the_textbook(rng: Rng) -> None:
    """Espiau, Chaumette and Rives 1992: ρ and θ of a line in a plane a X + b Y + c Z + d = 0."""
    seen, X_c, X = in_sight(rng, ImageLine)
    assert isinstance(seen, ImageLine)
    value = seen.value(X_c, X)
    rho, theta = seen.error(value, np.array([1.0, 0, 0]))
    (a, b, c), d = rng.normal(size=3), -1.0
    rows = seen.error_slope(value, value) @ seen.suppose_plane_rate(
        np.array([a, b, c]), X_c, X, camera_twists(seen, X_c), np.zeros((6, 6))
    )
    cos, sin = np.cos(theta), np.sin(theta)
    by_rho, by_theta = (a * rho * cos + b * rho * sin + c) / d, (a * sin - b * cos) / d
    expected = [
        [by_rho * cos, by_rho * sin, -by_rho * rho, (1 + rho**2) * sin, -(1 + rho**2) * cos, 0],
        [by_theta * cos, by_theta * sin, -by_theta * rho, -rho * cos, -rho * sin, -1],
    ]
    np.testing.assert_allclose(rows, expected, atol=1e-9 * (1 + np.abs(expected).max()))


@settings(max_examples=20, deadline=None)
@given(rng=SEEDS)
def test_what_is_fed_back_is_what_a_picture_shows(rng: Rng) -> None:
    """Points of a line lie on its image; the image of a circle, drawn as a polygon, has its centre and moments."""
    line, X_c, X = in_sight(rng, ImageLine)
    rho, theta = line.error(line.value(X_c, X), np.array([1.0, 0, 0]))
    p, d = camera_frame(line, X_c, X)  # type: ignore[arg-type]
    for way in rng.uniform(-1, 1, size=3):
        x, y, z = p + way * d
        assert x * np.cos(theta) + y * np.sin(theta) == pytest.approx(rho * z, abs=1e-9)
    circle, X_c, X = in_sight(rng, ImageCircle)
    assert isinstance(circle, ImageCircle)
    found = circle.error(
        circle.value(X_c, X), ImageCircle.measurement(np.array([0, 0, 1.0]), np.array([0, 0, 1.0]), np.array([0.5]))
    )
    found = found + [0, 0, 0.0625, 0, 0.0625]
    p, d = camera_frame(circle, X_c, X)
    one = normalise_vector(np.cross(d, [0.3, 0.5, 0.8]))
    angles = np.linspace(0, 2 * np.pi, 20001)
    around = p + abs(circle.radius or 0) * (np.outer(np.cos(angles), one) + np.outer(np.sin(angles), np.cross(d, one)))
    x, y = (around[:, :2] / around[:, 2:]).T
    parts = x[:-1] * y[1:] - x[1:] * y[:-1]
    area = parts.sum() / 2
    centre = [((v[:-1] + v[1:]) * parts).sum() / (6 * area) for v in (x, y)]
    x, y = x - centre[0], y - centre[1]
    parts = x[:-1] * y[1:] - x[1:] * y[:-1]
    second = [
        ((a[:-1] * b[:-1] + a[1:] * b[1:]) / 12 + (a[:-1] * b[1:] + a[1:] * b[:-1]) / 24) @ parts / area
        for a, b in ((x, x), (x, y), (y, y))
    ]
    np.testing.assert_allclose(found, [*centre, *second], rtol=1e-5, atol=1e-5 * (1 + np.abs(found).max()))


def test_a_camera_sees_what_is_in_front_and_inside_of_its_picture() -> None:
    X_c, R = np.eye(4), np.eye(3)
    wide = NamedCamera("eye", "c")
    small = NamedCamera("eye", "c", focal=800.0, width=640, height=480)
    for place, ahead, inside in (
        ((0, 0, 1), True, True),
        ((0, 0, -1), False, False),
        ((3, 0, 1), True, False),
        ((0.39, 0.29, 1), True, True),
        ((0.41, 0, 1), True, False),
        ((0, -0.31, 1), True, False),
    ):
        for camera, seen in ((wide, ahead), (small, inside)):
            assert (ImagePoint("p", "l", camera=camera).in_front(X_c, build_pose(place, R)) > 0) is seen
    circle = ImageCircle("p", "l", axis=np.array([1.0, 0, 0]), radius=0.5, camera=wide)
    assert circle.in_front(X_c, build_pose((0, 0, 0.51), R)) > 0 > circle.in_front(X_c, build_pose((0, 0, 0.49), R))


@pytest.mark.parametrize("kind", [kind for kind in list_kinds().values() if kind.found_by], ids=lambda kind: kind.kind)
@settings(max_examples=10, deadline=None)
@given(rng=SEEDS)
def test_sensors_are_wrong_by_no_more_than_is_said(kind: type[Observation], rng: Rng) -> None:
    """Without shocks they are right; halved noise halves the error, to first order."""
    seen, X_c, X = in_sight(rng, kind)
    if isinstance(seen, CameraObservation):
        camera = NamedCamera("eye", "c", seen.view, focal=500.0)
        seen = kind("p", "l", at=seen.at, axis=seen.axis, radius=seen.radius, camera=camera)  # type: ignore[call-arg]
    value, shocks = seen.value(X_c, X), rng.normal(size=(2, 3))
    shocks *= rng.uniform(size=(2, 1)) / np.linalg.norm(shocks, axis=1, keepdims=True)
    for unit_, amount in (("px", 0.05), ("rad", 1e-4), ("m", 1e-4)):
        if unit_ not in kind.found_by:
            continue
        np.testing.assert_allclose(seen.sense(value, 0 * shocks, {unit_: amount}), value, atol=1e-9)
        off = [seen.sense(value, shocks, {unit_: part * amount}) - value for part in (1.0, 0.5)]
        assert off[0].any()
        assert np.linalg.norm(off[0] - 2 * off[1]) < 0.05 * np.linalg.norm(off[0]) + 1e-9
        if kind is ImagePoint and unit_ == "px":
            apart = seen.error(value + off[0], value)
            assert np.linalg.norm(apart) <= amount / 500 * (1 + 1e-9)
        if kind is ImageLine:
            rho, theta = seen.error(value + off[0], value)
            assert abs(rho) <= 1.01 * amount / 500
            assert abs(theta) <= 1.01 * amount / 500 / IMAGE_LINE_HALF_WIDTH_FRACTION


def test_what_lies_behind_is_not_in_sight() -> None:
    """The sign of the sine of sight is that of the depth, wherever the camera is."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        camera = NamedCamera("eye", "c", build_pose(rng.normal(size=3), random_rotation(rng)))
        seen, X_c, X = ImagePoint("p", "l", at=rng.normal(size=3), camera=camera), random_pose(rng), random_pose(rng)
        assert np.sign(seen.in_front(X_c, X)) == np.sign(camera_frame(seen, X_c, X)[0][2])


@pytest.mark.parametrize("kind", [*CHAINED, AngleEncoder, SlideEncoder], ids=lambda kind: kind.__name__)
def test_each_kind_draws_itself_where_it_is(kind: type[Observation]) -> None:
    """A drawing moves with camera and link; rays begin in the camera's centre; a picture shows what is in front, by the
    rule of the pinhole, and directions alone (arrows on their links) have no drawing of their own."""
    rng = np.random.default_rng(6)
    for _ in range(10):
        if kind in (AngleEncoder, SlideEncoder):
            axis, start = random_direction(rng), rng.normal(size=3)
            seen: Observation = kind("p", "l", "j", axis, random_direction(rng), start, seen_from="c")  # type: ignore[call-arg]
            X_c, X = random_pose(rng), random_pose(rng)
        else:
            seen, X_c, X = in_sight(rng, kind)
        found, D = seen.draw(X_c, X, 0.2), random_pose(rng)
        assert bool(found.lines) is (kind.kind != "direction")
        other = seen.draw(D @ X_c, D @ X, 0.2)
        for one, two in zip(found.lines + found.areas, other.lines + other.areas, strict=True):
            np.testing.assert_allclose(two, one @ D[:3, :3].T + D[:3, 3], atol=1e-9)
        if not isinstance(seen, CameraObservation):
            continue
        at = seen.sighting(X_c, X)
        every = np.vstack(found.lines + found.areas)
        assert kind.kind == "line" or np.linalg.norm(every - at.C, axis=1).min() < 1e-9
        local = (every - at.C) @ (X_c @ seen.view)[:3, :3]
        drawn_points = local[local[:, 2] > 1e-3]
        drawn_points = drawn_points[:, :2] / drawn_points[:, 2:]
        for stroke in seen.image(X_c, X, 0.2):
            whole = [np.min(np.linalg.norm(drawn_points - point, axis=1)) < 1e-6 for point in stroke]
            assert sum(whole) >= min(1, len(stroke) - 1)
        ahead = ((at.B - at.C) @ (X_c @ seen.view)[:3, :3])[2] > 0.2
        assert bool(seen.image(X_c, X, 0.2)) is (kind.kind not in ("distance", "depth")) or not ahead
