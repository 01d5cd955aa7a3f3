"""Paths and atlases of what cameras see: the enclosed condition is that of the configurations, its sign that of a
determinant of image coordinates or wrenches; what cannot be enclosed is sampled and undecided."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import hrsynth
from hrsynth.analysis.aspects.condition_enclosure import ConditionEnclosure
from hrsynth.analysis.aspects.leg_forms import LegPattern
from hrsynth.analysis.aspects.path import PathAnswer, PathPlanner
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity.condition_check import compute_smallest_values
from hrsynth.constraints.condition import NamedCondition
from hrsynth.description import load
from hrsynth.geometry.balls import bound_norm_below, enclose_intervals
from hrsynth.geometry.so3 import convert_vectors_to_rotations
from hrsynth.geometry.vectors import build_pose
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.cameras import CameraObservation

Array = NDArray[np.float64]

BODY = """<robot name="body"><link name="base"/><link name="platform"/>
  <joint name="free" type="floating"><parent link="base"/><child link="platform"/><origin xyz="0.1 0.05 1.2"/></joint>
  <hrsynth serial="true"><platform link="platform"/></hrsynth></robot>"""
EYE = "eye=base@0.3,0.1,-0.4/0.1,0.05,0"
PLACES = np.array([[0.1, 0, 0], [-0.1, 0.1, 0], [0, 0.1, 0.1]])
POINTS = [f"point:platform@{','.join(map(str, place))}" for place in PLACES]
AXES = ("1,0.2,0.1", "0.1,1,0.3", "0.3,0.1,1")
LINES = [f"image_line:platform@{','.join(map(str, place))}/{axis}" for place, axis in zip(PLACES, AXES, strict=True)]
EDGES = [f"edge{each.removeprefix('image_line')}/{r}" for each, r in zip(LINES, (0.02, -0.03, 0.01), strict=True)]
SETS = {
    "points": POINTS,
    "lines": LINES,
    "edges": EDGES,
    "two lines": [POINTS[0], *LINES[1:]],
    "space": ["line:platform@0.1,0,0/1,0.2,0.1", "point:platform@0,0.2,0"],
    "mixture": [EDGES[0], POINTS[1], "inclination:platform", "distance:platform@0,0,0.1", "depth:platform@0.1,0,0"],
}


@cache
def body(folder: Path) -> Mechanism:
    (folder / "body.urdf").write_text(BODY)
    return load(folder / "body.urdf")


@pytest.mark.some(2)
@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("robot", ["body", pytest.param("gough_stewart", marks=pytest.mark.slow)])
def test_what_is_enclosed_is_the_condition_of_the_configurations(name: str, robot: str, tmp_path: Path) -> None:
    """In numbers, and in balls, which hold the numbers."""
    given = body(tmp_path) if robot == "body" else load(robot)
    aspects = PathPlanner.of(ObservedRobot.of(given, camera=EYE, sensor=SETS[name], samples=5))
    assert isinstance(aspects.condition, NamedCondition)
    assert isinstance(aspects.pattern, LegPattern), aspects.pattern
    assert not aspects.pattern.fitted
    at = aspects.members
    scene = aspects.structure.values_at(at)
    expected = (
        aspects.condition.evaluate(scene)
        if aspects.condition.signed
        else compute_smallest_values(aspects.condition.rows(scene))
    )
    p, R = aspects.pattern.coordinates.of(at)
    for i, each in enumerate(at):
        enclosure: ConditionEnclosure = aspects.enclosure(each)
        reached, value = enclosure.at(p[i : i + 1], R[i : i + 1])
        assert reached.all()
        assert value[0] == pytest.approx(expected[i], rel=1e-8, abs=1e-10)
        sure, wide = enclosure.at(
            *(
                np.array([enclose_intervals([x], [x])[0] for x in part.ravel()]).reshape(1, *part.shape)
                for part in (p[i], R[i])
            )
        )
        assert sure.all()
        bound = bound_norm_below(wide)[0]
        assert 0 <= bound <= abs(value[0]) * (1 + 1e-9)
        assert bound > 0.9 * abs(value[0]) or not enclosure.has_sign


def camera() -> Array:
    (found,) = {
        id(o.camera): o.camera
        for o in ObservedRobot.of("gough_stewart", camera=EYE, sensor=POINTS, samples=3).observed
        if isinstance(o, CameraObservation)
    }.values()
    assert found is not None
    return found.pose


def image_sign(view: Array, X: Array) -> float:
    """The sign of the determinant of the image coordinates' derivatives, on the sphere of rays: Z ≠ 0 apart."""

    def seen(step: Array) -> Array:
        turned = X @ build_pose(step[:3], convert_vectors_to_rotations(step[3:]))
        p = (np.linalg.inv(view) @ turned @ np.hstack([PLACES, np.ones((3, 1))]).T)[:3]
        return np.concatenate([p[0] / p[2], p[1] / p[2]])

    slope = np.array([(seen(1e-6 * e) - seen(-1e-6 * e)) / 2e-6 for e in np.eye(6)])
    Z = (np.linalg.inv(view) @ X @ np.hstack([PLACES, np.ones((3, 1))]).T)[2]
    return float(np.sign(np.linalg.det(slope)) * np.prod(np.sign(Z)))


def wrench_sign(setup: ObservedRobot, X: Array) -> float:
    """The sign of the determinant of the wrenches of lines, which change without jumps."""
    rows = [
        wrench
        for o in setup.observed
        if isinstance(o, CameraObservation)
        for wrench in o.wrenches(o.sighting(np.eye(4), X))
    ]
    return float(np.sign(np.linalg.det(np.array(rows, dtype=float))))


@pytest.mark.parametrize("name", ["points", "lines"])
def test_the_sign_of_the_condition_is_that_of_a_determinant(name: str, tmp_path: Path) -> None:
    setup = ObservedRobot.of(body(tmp_path), camera=EYE, sensor=SETS[name], samples=3)
    aspects = PathPlanner.of(setup)
    assert isinstance(aspects.pattern, LegPattern)
    coordinates, enclosure = aspects.pattern.coordinates, aspects.enclosure(setup.all_samples.start)
    rng, view = np.random.default_rng(0), camera()
    p = rng.normal(size=(300, 3)) * 0.5 + np.array([0.1, 0.05, 0.3])
    R = convert_vectors_to_rotations(rng.normal(size=(300, 3)) * 2)
    found = np.sign(enclosure.at(p, R)[1])
    frames = [coordinates.frame(a, b) for a, b in zip(p, R, strict=True)]
    expected = np.array([image_sign(view, X) if name == "points" else wrench_sign(setup, X) for X in frames])
    assert len({*found}) == 2
    assert abs(np.sum(found * expected)) == len(found)


def signs_along(answer: PathAnswer, view: Array) -> set[float]:
    """The determinant's signs at many poses of a path."""
    assert answer.coordinates is not None
    found = set()
    for way in answer.segments:
        places, turns = way.at(np.linspace(0, 1, 300))[:2]
        found |= {image_sign(view, answer.coordinates.frame(p, R)) for p, R in zip(places, turns, strict=True)}
    return found


def test_a_second_pose_with_the_same_image_of_three_points_is_reached_without_a_singularity(tmp_path: Path) -> None:
    """The atlas of a body that nothing holds: its pairs are those of path; no sign of the determinant changes."""
    robot = body(tmp_path)
    found = hrsynth.aspects(robot, camera=EYE, sensor=POINTS)
    assert len(found.places) == len(found.listed.modes) > 1
    for pair in found.pairs:
        if pair.answer is None:
            continue
        ends = [
            image_sign(camera(), at.pose("platform"))
            for at in (found.places[k - 1] for k in pair.numbers)
            if at is not None
        ]
        if pair.verdict == "same aspect":
            assert signs_along(pair.answer, camera()) == set(ends)
            assert len(set(ends)) == 1
        if pair.verdict == "separated":
            assert len(set(ends)) == 2
    assert any(pair.verdict == "same aspect" and pair.certified for pair in found.pairs)
    assert all(pair["path"] is None or pair["path"]["sampled"] is None for pair in found.to_dict()["pairs"])


def test_opposite_signs_separate(tmp_path: Path) -> None:
    setup = ObservedRobot.of(body(tmp_path), camera=EYE, sensor=LINES, samples=3)
    signs: dict[float, str] = {}
    rng = np.random.default_rng(4)
    for _ in range(40):
        x, y, z = rng.uniform(-0.3, 0.3, 2).tolist() + [float(rng.uniform(0.8, 1.4))]
        text = f"x={x:.3f},y={y:.3f},z={z:.3f},rpy=0/0/0"
        signs.setdefault(wrench_sign(setup, build_pose([round(x, 3), round(y, 3), round(z, 3)])), text)
    assert len(signs) == 2
    found = hrsynth.path(setup, start=signs[1.0], goal=signs[-1.0])
    assert (found.verdict, found.certified) == ("separated", True)
    assert "has a value" in found.reason
    assert "behind a camera" in found.not_proved


def test_where_nothing_is_enclosed_the_way_is_sampled(tmp_path: Path) -> None:
    """An arm, encoders beside a direction, a conic: undecided, with the smallest singular value of sampled poses."""
    spots = ("0.5,0.1,0", "0.6,0.1,0.1", "0.5,0.3,0.1", "0.4,0.1,0.2")
    arm = ObservedRobot.of(
        "example:panda", camera="hand=panda_hand@0,0,-0.3", samples=3, sensor=[f"point:world@{spot}" for spot in spots]
    )
    motors = ObservedRobot.of("3rrr_m1", "1", sensor=["encoder:shoulder_1", "encoder:shoulder_2"], samples=3)
    for setup, start, goal in (
        (arm, "x=0.3,y=0.1,z=0.5", "x=0.35,y=0.2,z=0.5"),
        (motors, "x=0,y=0,phi=0", "x=0.02,y=0,phi=0"),
    ):
        found = hrsynth.path(setup, start=start, goal=goal)
        assert (found.verdict, found.certified) == ("undecided", False)
        assert found.road is not None
        assert found.road.reached == 1
        assert 0 < found.road.least <= min(abs(found.start.value), abs(found.goal.value)) * (1 + 1e-9)
        assert "sampled" in hrsynth.text(found)
        assert "straight path" in hrsynth.text(found)
