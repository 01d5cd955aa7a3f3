"""The servo loop on observations of any kind: each ending is held against facts that the run does not compute."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import hrsynth
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.chart import TangentChart
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.present.runs import _draw_image
from hrsynth.present.view.sights import compute_half_image, list_cameras
from hrsynth.simulation.law import Law, measure_all, supposed_planes
from hrsynth.simulation.result import Servo
from simulation.scenes import setting

EYE = "eye=base@0,0,-0.6"
SIZED = f"{EYE}/0,0,0/800"
POINTS = (
    "point:platform@0.1,0,0",
    "point:platform@-0.1,0.1,0",
    "point:platform@0,-0.1,0",
    "point:platform@0.1,0.1,0.1",
)
START, GOAL = "x=0.02,y=0.01,z=0.01,rpy=0.1/0.05/0.1", "x=0,y=0,z=0.02,rpy=0/0/0"
CORNERS = np.array([[0.4, 0, 0], [0.55, 0, 0], [0.55, 0.15, 0], [0.4, 0.15, 0]])
HAND = "hand=wrist_3_link"
ARM_GOAL = "x=0.47,y=0.08,z=0.45,rpy=3.1/0.05/0.1"


def platform(sensor: tuple[str, ...] = POINTS, start: str = START, **options: object) -> Servo:
    return hrsynth.servo("gough_stewart", camera=EYE, sensor=sensor, start=start, goal=GOAL, **options)


def arm(start: str, corners: Array = CORNERS, **options: object) -> Servo:
    sensor = [f"point:world@{x},{y},{z}" for x, y, z in corners]
    return hrsynth.servo("example:ur5_robot", camera=HAND, sensor=sensor, start=start, goal=ARM_GOAL, **options)


def picture(at: ClosedConfiguration, corners: Array = CORNERS) -> Array:
    """The corners in the frame of the camera in the hand, (n, 3): x, y in the image and the depth."""
    X = at.pose("wrist_3_link")
    local = (corners - X[:3, 3]) @ X[:3, :3]
    return np.column_stack([local[:, :2] / local[:, 2:], local[:, 2]])


def true(found: Servo, corners: Array = CORNERS) -> bool:
    """Whether an ending of the arm is what it is called, by its poses, pictures and small steps alone."""
    here, wanted = picture(found.settled, corners), picture(found.target, corners)
    apart = float(np.abs(here - wanted)[:, :2].max())
    same = np.allclose(found.settled.pose("wrist_3_link"), found.target.pose("wrist_3_link"), atol=1e-6)
    if found.outcome in ("goal", "assembly mode"):
        return apart < 1e-8 and here[:, 2].min() > 0 and same == (found.outcome == "goal")
    if found.outcome == "out of view":
        return bool(0 < here[:, 2].min() < 1e-2 and apart > 1e-3)
    if found.outcome == "local minimum":
        model, q = found.settled.model, found.settled.q
        steps = 1e-5 * np.eye(model.nv)
        errors = [
            np.sum((picture(ClosedConfiguration.of(model, model.integrate(q, s * step)), corners) - wanted)[:, :2] ** 2)
            for step in steps
            for s in (1, -1)
        ]
        rising = np.array(errors).reshape(-1, 2)
        return apart > 1e-6 and bool(np.abs(rising[:, 0] - rising[:, 1]).max() < 1e-8)
    return found.outcome in ("limit reached", "time") and apart > 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    "sensor",
    [
        POINTS,
        (
            "image_line:platform@0.1,0,0/0,1,0",
            "image_line:platform@-0.1,0.1,0/1,0,0.1",
            "image_line:platform@0,-0.1,0.1/1,0.3,0",
        ),
        ("circle:platform@0.1,0,0/0,0.3,1", "distance:platform@0.1,0.1,0"),
        ("edges:platform@0.1,0,0/0,1,0.2/0.02", "edge:platform@0.1,0.1,0/1,0,0/0.02"),
        ("inclination:platform", "position:platform@0.1,0,0", "direction:platform/1,0,0"),
    ],
    ids=["points", "lines", "circle and distance", "edges", "inclination, position and direction"],
)
def test_a_platform_comes_to_its_goal_with_any_sensors(sensor: tuple[str, ...]) -> None:
    found = platform(sensor)
    assert found.outcome == "goal"
    X, wanted = (at.pose("platform") for at in (found.settled, found.target))
    np.testing.assert_allclose(X, wanted, atol=1e-8)


@pytest.mark.long
def test_a_depth_that_is_only_supposed_bends_the_way_and_may_make_the_goal_repel() -> None:
    """The depths at the goal bend the way. One depth for all, which is not that of the point that stands out, does
    more: at the goal itself a motion grows under the law, and the run ends elsewhere."""
    exact, found, wrong = (platform(depth=depth) for depth in ("exact", "desired", "constant:0.8"))
    assert found.outcome == "goal"
    assert wrong.outcome == "local minimum"
    assert wrong.to_dict()["depth"] == "constant:0.8"
    assert [", depth: " in str(each) for each in (exact, found, wrong)] == [False, True, True]
    halfway = [np.array([np.interp(0.8, each.run.times, each.way[:, i]) for i in range(3)]) for each in (exact, found)]
    assert np.linalg.norm(halfway[0] - halfway[1]) > 1e-6
    for run, repels in ((exact, False), (found, False), (wrong, True)):
        observation_model, goal = run.setup.samples.observation_model, run.target
        law = Law(observation_model, 6, 1.0, supposed_planes(run.depth, goal, observation_model))
        wanted, chart = measure_all(goal, observation_model)[0], TangentChart.around(goal, observation_model)
        flows = [law.at(chart.at(y, goal.q), (wanted, [0 * w for w in wanted])).velocity for y in 1e-5 * np.eye(6)]
        growth = float(np.linalg.eigvals(chart.basis.T @ np.array(flows).T / 1e-5).real.max())
        assert (growth > 0.1) is repels
        assert repels or growth < -0.9


def test_a_depth_that_nothing_needs_is_refused() -> None:
    with pytest.raises(
        BadRequest, match=r"--depth desired: no observation needs a depth\. Omit it, or add .* --sensor"
    ):
        hrsynth.servo("delta", start="x=0", goal="x=0.05", depth="desired")


def test_supposed_depths_make_other_rows_of_what_images_show_alone() -> None:
    robot = hrsynth.observe("gough_stewart", camera=EYE, sensor=[*POINTS, "distance:platform@0.1,0,0"])
    observation_model, at = robot.samples.observation_model, robot.all_samples.start
    assert supposed_planes("exact", at, observation_model) is None
    for text in ("constant", "constant:", "constant:-1", "constant:inf", "far", ""):
        with pytest.raises(BadRequest):
            supposed_planes(text, at, observation_model)
    planes = supposed_planes("constant:0.5", at, observation_model)
    assert planes is not None
    assert [plane is None for plane in planes] == [False] * 4 + [True]
    own = supposed_planes("desired", at, observation_model)
    wanted = measure_all(at, observation_model)[0]
    moved = [0 * w for w in wanted]
    off = robot.configurations[0]
    commands = [Law(observation_model, 6, 1.0, each).at(off, (wanted, moved)) for each in (None, own, planes)]
    assert np.linalg.norm(commands[0].velocity - commands[2].velocity) > 1e-3
    at_goal = [Law(observation_model, 6, 1.0, each).at(at, (wanted, moved)).values for each in (None, own)]
    np.testing.assert_allclose(*at_goal, atol=1e-12)


@pytest.mark.slow
def test_a_led_loop_of_points_follows_more_closely() -> None:
    at_once, led = platform(), platform(duration=4.0)
    assert led.outcome == at_once.outcome == "goal"
    assert led.errors.max() < 0.05 * at_once.errors.max()


@pytest.mark.slow
def test_noise_in_pixels_needs_a_focal_length_and_keeps_the_platform_near_its_goal() -> None:
    with pytest.raises(BadRequest, match="focal"):
        platform(noise="0.3px")
    with pytest.raises(BadRequest, match="errors in lengths: got '1mm', expected 0"):
        platform(noise="1mm")
    found = hrsynth.servo("gough_stewart", camera=SIZED, sensor=POINTS, start=START, goal=GOAL, noise="0.3px", time=4.0)
    assert found.spread is not None
    assert found.outcome == "goal"
    assert 0 < found.spread.metres < 0.02
    worst = max(
        float(np.linalg.norm(seen[:2] / seen[2] - true[:2] / true[2]))
        for each in found.run.commands
        for seen, true in zip(each.seen, each.true, strict=True)
    )
    assert 0.1 < worst * 800 / 0.3 <= 1 + 1e-9


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("sensor", "noise", "words", "unit", "most"),
    [
        (POINTS, "0.3px", "image points", "px", 0.3),
        (POINTS, "0.1deg", "angles", "degrees", 0.1),
        (tuple(f"position:{each.partition(':')[2]}" for each in POINTS[:3]), "2mm", "lengths", "mm", 2.0),
    ],
)
def test_noise_is_told_in_the_unit_in_which_it_is_given(
    sensor: tuple[str, ...], noise: str, words: str, unit: str, most: float
) -> None:
    found = hrsynth.servo("gough_stewart", camera=SIZED, sensor=sensor, start=GOAL, goal=GOAL, noise=noise, time=0.4)
    (told,) = (each for each in found.notes if "errors" in each)
    assert told.startswith(f"errors of the measured {words}: ")
    *_, largest, last = told.split()
    assert last == unit
    assert 0.2 * most < float(largest) <= most


def test_the_picture_of_a_camera_with_a_size_is_all_of_it(recwarn: pytest.WarningsRecorder) -> None:
    """Matplotlib says so where it does not keep the limits that it is given."""
    setup = hrsynth.observe("gough_stewart", camera=SIZED, sensor=POINTS)
    eye = replace(next(each for each in list_cameras(setup) if each.name == "eye"), width=640, height=480)
    found = hrsynth.servo(setup, start=GOAL, goal=GOAL, time=0.4)
    place = Figure((6, 2)).add_axes((0.1, 0.1, 0.8, 0.8))
    half = compute_half_image(eye)
    _draw_image(place, found, eye, half)
    place.figure.canvas.draw()
    assert not [each for each in recwarn if "limits" in str(each.message)]
    np.testing.assert_allclose([place.get_xlim(), place.get_ylim()], [[-half[0], half[0]], [half[1], -half[1]]])


def test_what_stands_behind_the_camera_is_refused() -> None:
    with pytest.raises(BadRequest, match="not in front of its camera at the start"):
        hrsynth.servo("gough_stewart", camera="eye=base@0,0,1", sensor=POINTS, start=START, goal=GOAL)
    for options in ({"dynamics": True}, {"sense": "edges"}):
        with pytest.raises(BadRequest, match="segments"):
            platform(**options)


@pytest.mark.slow
def test_a_run_ends_where_a_camera_loses_sight() -> None:
    """Legs lead the platform; a point on its long arm, whose depth is measured, sweeps out of the picture on the way
    between two poses at which it is inside. There the run ends, to the picture's very side."""
    home = hrsynth.observe("3rrr_m1").all_samples.start.pose("platform")[:3, 3]
    place = ",".join(f"{value:.6f}" for value in (home[0] + 0.5, home[1], home[2] - 0.92))
    options = {
        "sensor": "depth:platform@1,0,0",
        "start": f"x={home[0]:.6f},y={home[1]:.6f},phi=-0.25",
        "goal": f"x={home[0]:.6f},y={home[1]:.6f},phi=0.25",
    }
    found = hrsynth.servo("3rrr_m1", "1,2,3", f"eye=base@{place}/0,0,0/500,530,500", **options)
    assert found.outcome == "out of view"
    assert "depth_1" in found.run_outcome.reason
    X = found.settled.pose("platform")
    x, y, z = X[:3, :3] @ [1, 0, 0] + X[:3, 3] - [float(word) for word in place.split(",")]
    assert x / z == pytest.approx(0.53, abs=2e-3)
    assert abs(y / z) < 0.5
    wide = hrsynth.servo("3rrr_m1", "1,2,3", f"eye=base@{place}/0,0,0/500,630,500", **options)
    assert wide.outcome in ("goal", "assembly mode")


@pytest.mark.slow
def test_directions_are_fed_back_as_ever() -> None:
    """The same robot with its legs' directions, asked as legs and as observations of their links."""
    robot = setting("3rrr_m1")
    links = [(o.link, o.direction) for o in robot.observed]  # type: ignore[attr-defined]
    sensor = [f"direction:{link}/{','.join(map(repr, map(float, axis)))}" for link, axis in links]
    poses = {"start": "x=0,y=0,phi=0", "goal": "x=0.02,y=0,phi=0.1"}
    one, other = hrsynth.servo("3rrr_m1", **poses), hrsynth.servo("3rrr_m1", sensor=sensor, **poses)
    assert one.outcome == other.outcome == "goal"
    np.testing.assert_allclose(one.errors[0], other.errors[0], atol=1e-12)


@pytest.mark.slow
def test_an_arm_comes_to_its_goal_by_what_its_hand_sees() -> None:
    found = arm("x=0.5,y=0.15,z=0.55,rpy=3.0/0.2/0.5")
    assert found.outcome == "goal"
    assert true(found)


LOW, HIGH = (0.27, -0.12, 0.2, 2.4, -0.7, -3.1), (0.67, 0.28, 0.65, 3.8, 0.7, 3.1)
STARTS = np.random.default_rng(19).uniform(LOW, HIGH, (40, 6))
"""x, y, z (m), roll, pitch, yaw."""


@pytest.mark.long
def test_an_arm_from_twenty_starts_ends_as_is_said() -> None:
    """Of starts about the goal with any turn of the hand, the first twenty that it reaches and that see all corners."""
    endings = []
    for x, y, z, *turn in STARTS:
        start = f"x={x:.3f},y={y:.3f},z={z:.3f},rpy={'/'.join(f'{each:.3f}' for each in turn)}"
        try:
            found = arm(start)
        except hrsynth.errors.HrsynthError:
            continue
        assert true(found), (start, found.outcome)
        endings.append(found.outcome)
        if len(endings) == 20:
            break
    assert len(endings) == 20
    assert endings.count("goal") > 10


BODY = """<robot name="body"><link name="base"/><link name="platform"/>
  <joint name="free" type="floating"><parent link="base"/><child link="platform"/><origin xyz="0 0 1.2"/></joint>
  <hrsynth serial="true"><platform link="platform"/></hrsynth></robot>"""


def body(folder: Path, sensor: list[str], start: str, goal: str, **options: object) -> Servo:
    """A run of a body that nothing holds."""
    (folder / "body.urdf").write_text(BODY)
    return hrsynth.servo(
        folder / "body.urdf", start=start, goal=goal, sensor=sensor, camera="eye=base@0,0,0", **options
    )


def test_a_line_that_comes_to_the_cameras_centre_ends_the_run(tmp_path: Path) -> None:
    found = body(
        tmp_path,
        [
            "line:platform@0.225232,-0.17792,0.224325/0.905356,0.446375,-0.536953",
            "point:platform@-0.0454,0.024797,-0.23622",
        ],
        "x=0.0761,y=0.0114,z=1.1308,rpy=0.6922/-0.4723/-0.279",
        "x=-0.1098,y=-0.0291,z=1.0424,rpy=-0.5704/0.6009/-1.3175",
    )
    assert found.run_outcome.name == "out of view"
    assert "is undefined there" in found.run_outcome.reason


@pytest.mark.slow
def test_supposed_depths_at_which_the_law_loses_rank_are_told(tmp_path: Path) -> None:
    """Three image points are as many numbers as freedoms: no more are measured."""
    found = body(
        tmp_path,
        [
            "point:platform@-0.094037,-0.078560,-0.075302",
            "point:platform@0.292467,0.079654,0.104594",
            "point:platform@-0.102022,0.107951,-0.226217",
        ],
        "x=-0.1345,y=0.1051,z=0.9062,rpy=0.6703/0.4578/1.1408",
        "x=-0.1356,y=-0.0878,z=1.4949,rpy=-0.0945/0.1785/-1.5109",
        depth="constant:1",
    )
    assert found.run_outcome.name == "local minimum"
    assert "the assumed depths, lose rank" in found.run_outcome.reason


@pytest.mark.parametrize("depth", ["constant:1e300", "constant:0", "constant:nan", "constant", "near"])
def test_a_depth_that_cannot_be_is_refused(depth: str) -> None:
    with pytest.raises(BadRequest, match="exact, desired or constant:METRES"):
        platform(depth=depth)
