"""Type 2 conditions of observations of any kind: points, lines, axes, cameras that are fixed or carried."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from hrsynth.analysis.aspects.path import path
from hrsynth.analysis.derive import derive
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity.condition_check import compute_spectrum
from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.constraints.vector_algebra import evaluate
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.locked_twists import compute_interaction
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

EYE = "eye=base@0.3,0.1,0"
POINTS = [
    "point:platform@0.1,0,0",
    "point:platform@-0.1,0.1,0",
    "point:platform@0,0.1,0.1",
    "point:platform@0.1,0.1,-0.05",
]
LINES = [
    "image_line:platform@0.1,0.2,0/1,0.2,0.1",
    "image_line:platform@-0.1,0.1,0.2/0.1,1,0.3",
    "image_line:platform@0,-0.1,0.1/0.2,0.3,1",
]
UPRIGHT = "inclination:platform"


def seen(*sensor: str, camera: str | list[str] = EYE, robot: str = "gough_stewart", points: int = 60) -> Singularity:
    return singularities(robot, camera=camera, sensor=list(sensor), points=points)


def off_the_cylinder(P: Array, C: Array) -> float:
    """By how much C is off the circular cylinder over the circle through three points."""
    n = np.cross(P[1] - P[0], P[2] - P[0])
    A = np.array([P[1] - P[0], P[2] - P[0], n])
    centre = np.linalg.solve(A, [(P[1] @ P[1] - P[0] @ P[0]) / 2, (P[2] @ P[2] - P[0] @ P[0]) / 2, n @ P[0]])
    away = C - centre
    return float(np.linalg.norm(away - (away @ n) / (n @ n) * n) - np.linalg.norm(P[0] - centre))


@pytest.mark.slow
def test_three_points_name_the_danger_cylinder() -> None:
    found = seen(*POINTS[:3])
    assert found.words == "C lies on the danger cylinder, the circular cylinder over the circle through B1, B2, B3"
    assert found.checked is not None
    assert found.checked.on_locus
    record = found.to_dict()
    assert record["measured"] == {"kind": "observations", "of": ["point_1", "point_2", "point_3"]}
    assert "danger" not in record["parts"][0]["meaning"]
    assert record["where"]["C"] == "centre of camera eye, fixed in base"
    for at in found.checked.on_locus:
        X, C = at.pose("platform"), np.array([0.3, 0.1, 0])
        P = np.array([[0.1, 0, 0], [-0.1, 0.1, 0], [0, 0.1, 0.1]]) @ X[:3, :3].T + X[:3, 3]
        assert abs(off_the_cylinder(P, C)) < 1e-7
        assert abs(off_the_cylinder(P, C + [0.01, 0, 0])) > 1e-5


@pytest.mark.slow
def test_four_points_are_on_all_danger_cylinders() -> None:
    found = seen(*POINTS)
    assert "every tip Bi along ri (i = 1, 2, 3, 4); C is then on the danger cylinders of all threes" in found.words
    assert found.checked is not None
    places = np.array([[0.1, 0, 0], [-0.1, 0.1, 0], [0, 0.1, 0.1], [0.1, 0.1, -0.05]])
    for at in found.checked.on_locus:
        X = at.pose("platform")
        P = places @ X[:3, :3].T + X[:3, 3]
        for three in combinations(range(4), 3):
            assert abs(off_the_cylinder(P[list(three)], np.array([0.3, 0.1, 0]))) < 1e-6


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (LINES, "the normals n4, n5, n6 are parallel to one plane"),
        (
            [each.replace("image_line", "line") for each in LINES],
            "never: the axes d4, d5, d6 are constant and not all parallel",
        ),
        (
            [each.partition("/")[0].replace("image_line", "distance") for each in LINES],
            "the directions r4, r5, r6 are parallel to one plane",
        ),
        ([LINES[0].replace("image_line", "line"), POINTS[0]], "the axes d4 and the directions r5 are parallel"),
        (POINTS[:3], "the directions r4, r5, r6 are all parallel"),
    ],
)
def test_a_platform_that_translates_has_a_condition_of_all_kinds(sensor: list[str], words: str) -> None:
    """Three vectors have rank two just there; each is named by what it is."""
    setup = ObservedRobot.of("delta", camera=EYE, sensor=sensor)
    assert MeasuredRobot.of(setup).condition.words == words


def test_points_on_one_line() -> None:
    found = seen("point:platform@0.1,0,0", "point:platform@0.2,0,0", "point:platform@0.4,0,0")
    assert found.always
    assert found.words.endswith("because B1, B2, B3 are on one line, about which the platform can rotate")


@pytest.mark.parametrize(
    ("sensor", "words", "expression"),
    [
        (
            LINES,
            "the images of the lines meet in a point, or C and the footpoints of its perpendiculars on the lines",
            "det(e1, e2, e3)*det(n1, n2, n3)",
        ),
        pytest.param(
            [*POINTS[:2], UPRIGHT],
            "C lies in the plane through B1, B2 that is parallel to d3 × B1B2",
            "det(r1, r2, cross(d3, -B1 + B2))",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            [POINTS[0], LINES[1], UPRIGHT],
            "the image of point_1 lies on that of image_line_1 (r1 is normal",
            "dot(d3, e2)*dot(n2, r1)",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_closed_conditions(sensor: list[str], words: str, expression: str) -> None:
    found = seen(*sensor)
    assert words in found.words
    assert found.condition is not None
    assert str(found.condition.expression) == expression
    assert found.checked is not None
    assert found.checked.on_locus
    if found.condition.parts:
        here = found.pattern.values_at(found.checked.on_locus)
        factors = np.abs([evaluate(part, here.values) for part, _ in found.condition.parts])
        assert factors.min(axis=0).max() < 1e-8


@pytest.mark.some(0, 5)
@pytest.mark.parametrize(
    ("robot", "camera", "sensor", "words"),
    [
        (
            "gough_stewart",
            EYE,
            [*POINTS[:2], LINES[0]],
            "along r2 and B3 normal to n3, and rotates it about a normal of e3",
        ),
        ("gough_stewart", EYE, [POINTS[0], *LINES[1:]], "and rotates it about the normal of e2, e3"),
        (
            "gough_stewart",
            EYE,
            [x.replace("image_line", "edge") + "/0.005" for x in LINES],
            "footpoints of its perpendiculars",
        ),
        ("gough_stewart", EYE, ["circle:platform@0.1,0,0/1,0,0", POINTS[1]], "leaves B1 fixed and moves B2 along r2"),
        (
            "gough_stewart",
            [EYE, "other=base@-0.3,0.2,-0.2"],
            [f"{c}={p}" for c, p in zip(("eye", "other", "eye"), POINTS, strict=False)],
            "the plane B1B2B3",
        ),
        (
            "gough_stewart",
            "hand=platform@0,0,0.1",
            ["point:world@0.1,0,0", "point:world@0.3,0.2,0", "point:world@-.1,.4,.2"],
            "danger cylinder",
        ),
        (
            "example:panda",
            "hand=panda_hand",
            ["point:world@0.5,0.1,0", "point:world@0.6,0.1,0.1", "point:world@0.5,0.3,0.1"],
            "danger cylinder",
        ),
        ("delta", "eye=base@0.3,0.1,-1", POINTS[:2], "are parallel"),
        ("3rps", EYE, POINTS[:2], "B3 normal to a3, B4 along r4 and B5 along r5"),
    ],
)
def test_words_expression_and_rank_agree(robot: str, camera: str | list[str], sensor: list[str], words: str) -> None:
    """``singular`` itself compares them, with Pinocchio's rank and with what each observation leaves."""
    assert words in seen(*sensor, camera=camera, robot=robot).words


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "sensor",
    [
        ["image_circle:platform@0.1,0,0.1/0,1,1/0.05", "point:platform@0,0.1,0"],
        ["line:platform@0.1,0,0.1/0,1,1", "distance:platform@0,0.1,0", "depth:platform@0.3,0,0"],
    ],
)
@pytest.mark.parametrize("robot", ["gough_stewart", "delta"])
def test_the_screws_of_all_joints_give_pinocchios_singular_values(robot: str, sensor: list[str]) -> None:
    """Lengths are in characteristic lengths in both, whatever the robot's size."""
    setup = ObservedRobot.of(robot, camera="eye=base@0.3,0.1,0.2", sensor=sensor)
    observation_model, chunk = setup.samples.observation_model, setup.configurations[:5]
    smallest, largest = compute_spectrum(chunk, observation_model)
    for at, low, high in zip(chunk, smallest, largest, strict=True):
        found = np.linalg.svd(compute_interaction(at, observation_model), compute_uv=False)
        assert found[-1] == pytest.approx(low, rel=1e-8)
        assert found[0] == pytest.approx(high, rel=1e-8)


def slider_crank() -> Mechanism:
    b = Builder("slider-crank")
    for link, at in (("base", (0, 0, 0)), ("platform", (0.5, 0, 0)), ("crank", (0, -1, 0)), ("rod", (0.9, -0.9, 0))):
        b.link(link, at=at)
    b.joint("slide", "P", "base", "platform", at=(0.5, 0, 0), axis=(1, 0, 0))
    b.joint("drive", "R", "base", "crank", at=(0, -1, 0), axis=(0, 0, 1), motor=True)
    b.joint("knee", "R", "crank", "rod", at=(0.9, -0.9, 0), axis=(0, 0, 1))
    b.joint("pin", "R", "rod", "platform", at=(0.5, 0, 0), axis=(0, 0, 1), loop=True)
    return b.build(platform="platform")


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("sensor", "camera"),
    [
        ("distance:platform@0,0,0", "eye=base@-0.1,0.2,0"),
        ("encoder:slide", None),
        ("direction:rod/1,0,0", None),
        ("point:platform@0,0,0", "eye=base@0,0,-1"),
    ],
)
def test_legs_that_are_not_watched_hold_as_well(sensor: str, camera: str | None) -> None:
    """With one freedom the condition of what is seen alone is not the robot's: it is that of all joints."""
    robot = slider_crank()
    found = singularities(robot, camera=camera, sensor=[sensor], points=60)
    assert found.checked.disagreements == 0
    assert found.checked.smallest > 1e-4
    answer = path(robot, camera=camera, sensor=sensor, start="x=0.5", goal="x=0.3")
    assert answer.verdict == "undecided"
    assert "locus" not in answer.reason
    assert min(answer.start.value, answer.goal.value) > 1e-2


def test_a_robot_of_one_coordinate_is_read() -> None:
    b = Builder("slide")
    b.link("base")
    b.link("platform", at=(0.5, 0, 0))
    b.joint("slide", "P", "base", "platform", at=(0.5, 0, 0), axis=(1, 0, 0), motor=True)
    found = derive(b.build(platform="platform"), camera="eye=base@0.1,0,0", sensor="distance:platform@0,0,0")
    assert (found.verdict.rank, found.verdict.dof) == (1, 1)
