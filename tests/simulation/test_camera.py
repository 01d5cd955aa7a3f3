"""The camera: edges are tangent planes, directions come back from them, noise is what was asked for."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.description import load
from hrsynth.errors import BadRequest, MissingExtra, RenderFailure
from hrsynth.geometry.vectors import Array, normalise_vector
from hrsynth.mechanism.noise import Noise
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.simulation import rendered_images
from hrsynth.simulation.camera import Camera, Edges, cylinders, edges, place_camera, rebuilt, sensitivity
from hrsynth.simulation.law import directions
from hrsynth.simulation.noise import NOISE_PERIOD_S, NoiseSamples, Sensors
from hrsynth.simulation.servo import servo
from simulation.scenes import home

NUMBERS = st.floats(-1, 1, allow_nan=False)
POINTS = st.tuples(NUMBERS, NUMBERS, st.floats(1, 3)).map(np.array)


@given(POINTS, POINTS)
def test_edges_are_the_two_tangent_planes_and_give_the_direction_back(a: Array, b: Array):
    radius = 0.01
    if np.linalg.norm(b - a) < 0.1 or np.linalg.norm(np.cross(a, normalise_vector(b - a))) < 2 * radius:
        return
    ends, u = np.array([a, b]), normalise_vector(b - a)
    for normal in edges(ends, radius):
        assert np.linalg.norm(normal) == pytest.approx(1)
        assert normal @ u == pytest.approx(0, abs=1e-12)
        assert normal @ a == pytest.approx(-radius, abs=1e-12)
    assert rebuilt(*edges(ends, radius)) == pytest.approx(u, abs=1e-9)


def test_a_camera_inside_a_leg_is_refused():
    with pytest.raises(BadRequest, match="inside a leg"):
        edges(np.array([[0.0, 0.001, -1.0], [0.0, 0.001, 1.0]]), 0.01)


@given(NUMBERS, NUMBERS)
def test_a_pixel_and_its_ray_are_one(x: float, y: float):
    camera = Camera(np.eye(4))
    point = np.array([x, y, 2.0])
    assert 2 * camera.ray(camera.pixels(point[None])[0]) == pytest.approx(point, abs=1e-12)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["3rpr_m1", "quattro"])
def test_the_camera_sees_all_rods_and_exact_edges_give_exact_directions(name: str):
    scene = home(name)
    mechanism, observation_model = scene.setup.mechanism, scene.law.observation_model
    rods = cylinders(mechanism, observation_model.observations)
    camera = place_camera(rods, observation_model.reference, (scene.start.pose,))
    for rod in rods:
        pixels = camera.pixels(camera.project(scene.start.pose(observation_model.reference), scene.start.pose, rod))
        assert np.all((pixels > 0) & (pixels < [camera.width, camera.height]))
    sense = Edges(camera, observation_model.reference, rods, 0.0, NoiseSamples.draw(2 * len(rods), 1, 0))
    u = directions(scene.start, observation_model)[0]
    assert sense(0.0, scene.start.pose, u) == pytest.approx(u, abs=1e-9)


@pytest.mark.slow
def test_a_carried_camera_sees_the_same_directions_from_its_link():
    robot = load("delta")
    carried = robot.platform
    found = servo(
        robot, camera=carried, start="x=0,y=0,z=-0.6", goal="x=0.05,y=0,z=-0.6", sense="edges", gain=8, time=1.0
    )
    assert found.outcome == "goal"
    assert found.spread is not None
    assert found.spread.metres < 0.01
    assert found.setup.samples.observation_model.reference == carried


def test_the_noise_of_rebuilt_directions_grows_with_that_of_pixels_and_is_bounded_by_the_sensitivity():
    scene = home("delta")
    observation_model = scene.law.observation_model
    rods = cylinders(scene.setup.mechanism, observation_model.observations)
    camera = place_camera(rods, observation_model.reference, (scene.start.pose,))
    u = directions(scene.start, observation_model)[0]

    def wrong(pixels: float) -> Array:
        sense = Edges(camera, observation_model.reference, rods, pixels, NoiseSamples.draw(2 * len(rods), 4, 0))
        return np.array([np.linalg.norm(sense(t, scene.start.pose, u) - u, axis=1) for t in np.arange(0, 4, 0.04)])

    assert wrong(0.02).max() == pytest.approx(2 * wrong(0.01).max(), rel=0.05)
    for number, rod in enumerate(rods):
        ends = camera.project(scene.start.pose(observation_model.reference), scene.start.pose, rod)
        assert wrong(0.01)[:, number].max() <= 1.1 * sensitivity(ends, rod.radius) * 0.01 / camera.focal


def cones(half_angle: float, count: int, horizon: float, seed: int) -> Sensors:
    """Sensors of directions that are wrong inside of cones."""
    every = [Direction(str(i), "l", np.array([0.0, 0, 1])) for i in range(count)]
    return Sensors.of(every, Noise((("rad", half_angle),)), horizon, seed, 1.0)


@given(st.floats(1e-4, 0.2), st.integers(0, 1000), st.floats(0, 3))
def test_measured_directions_lie_in_their_cones(half_angle: float, seed: int, time: float):
    u = np.array([[0.0, 0.0, 1.0], normalise_vector([1, 2, 3])])
    seen = np.array(cones(half_angle, 2, 3, seed)(time, lambda link: np.eye(4), u))
    angles = np.arccos(np.clip(np.sum(seen * u, axis=1), -1, 1))
    assert np.all(angles <= half_angle + 1e-7)
    assert np.linalg.norm(seen, axis=1) == pytest.approx([1, 1])


def test_cones_are_filled():
    u = np.array([[0.0, 0.0, 1.0]])
    sense = cones(0.1, 1, 4000 * NOISE_PERIOD_S, 0)
    angles = [
        float(np.linalg.norm(np.cross(sense(n * NOISE_PERIOD_S, lambda link: np.eye(4), u)[0], u))) for n in range(4000)
    ]
    assert max(angles) > 0.095
    assert 0.03 < float(np.mean(angles)) < 0.07


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("0.1deg", math.radians(0.1), "rad"),
        ("0.002", 0.002, "rad"),
        ("0.3px", 0.3, "px"),
        ("2mm", 0.002, "m"),
        ("0.1m", 0.1, "m"),
        ("0.3px, 1mm", 1e-3, "m"),
        ("0.3px,1mm", 0.3, "px"),
    ],
)
def test_amounts(text: str, value: float, unit: str):
    assert Noise.parse(text).of(unit) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "deg", "much", "-1deg", "0px", "90deg", "nan", "inf", "1px,", "1px,2px", "1km"])
def test_amounts_that_are_none(text: str):
    with pytest.raises(BadRequest):
        Noise.parse(text)


def test_without_opencv_pictures_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(MissingExtra, match=r"hrsynth\[bench\]") as raised:
        servo(load("delta"), start="x=0,y=0", goal="x=0.05,y=0", sense="images")
    assert raised.value.exit_status == 3


@pytest.mark.skipif(find_spec("mujoco") is None or sys.platform != "linux", reason="needs the extra bench on Linux")
@pytest.mark.parametrize("first", ["import mujoco", ""])
def test_without_a_screen_images_are_rendered_or_refused(first: str):
    """MuJoCo chooses at its first import what it draws with; with GLFW and no screen it ends the process."""
    code = f"""{first}
from hrsynth.errors import RenderFailure
from hrsynth.simulation.rendered_images import drawing
try:
    print(drawing().GLContext.__module__)
except RenderFailure as error:
    print(error)
"""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")}
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", code], env=environment, capture_output=True, text=True)
    assert ("there is no screen" if first else "mujoco.egl") in run.stdout


@pytest.mark.slow
@pytest.mark.skipif(find_spec("mujoco") is None, reason="needs the extra bench")
@pytest.mark.parametrize("name", ["delta", "quattro"])
def test_directions_from_rendered_pictures(name: str):
    pytest.importorskip("cv2")
    scene = home(name)
    mechanism, observation_model = scene.setup.mechanism, scene.law.observation_model
    rods = cylinders(mechanism, observation_model.observations)
    camera = place_camera(rods, observation_model.reference, (scene.start.pose,))
    stage = rendered_images.LegRenderer(mechanism, camera, observation_model.reference, rods)
    try:
        picture = stage.picture(scene.start.pose)
    except RenderFailure as error:
        pytest.skip(str(error))
    assert picture.shape == (camera.height, camera.width, 3)
    u = directions(scene.start, observation_model)[0]
    seen = rendered_images.RenderedImages(stage)(0.0, scene.start.pose, u)
    wrong = np.degrees(np.linalg.norm(np.cross(seen, u), axis=1))
    assert np.all((wrong > 0) & (wrong < 1.0))
    drawn = [rendered_images.shade(picture, colour) > 127 for colour in rendered_images.COLOURS[: len(rods)]]
    for rod, seen_there in zip(rods, drawn, strict=True):
        ends = camera.pixels(camera.project(scene.start.pose(observation_model.reference), scene.start.pose, rod))
        middle = np.round(ends.mean(axis=0) - 0.5).astype(int)
        assert seen_there[middle[1], middle[0]]
