"""What answers print: poses that can be typed again, loops as the file names them, axes in one sense, numbers."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import numpy as np
import pytest

import hrsynth
from hrsynth.cli import execute
from hrsynth.description import list_robots
from hrsynth.geometry.vectors import orient_axis
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism.normal import normal_form
from hrsynth.mechanism.pose import Pose
from hrsynth.present.text.tables import table

NUMBER = r"-?\d[\d.]*(?:e[-+]\d+)?"


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]):
    def call(text: str) -> str:
        capsys.readouterr()
        assert execute(text.split()) == 0, capsys.readouterr().err
        return capsys.readouterr().out

    return call


ASKED = [
    ("check quattro --observe 1,4 --at x=0.02,{}", 1),
    ("modes 3rrr_m1 --at x=0.01,{}", 3),
    ("path 3rrr_m1 --start x=0,y=0,{} --goal x=0.02", 3),
    ("servo 3rrr_m1 --start {} --goal x=0.02", 3),
    ("accuracy 3rrr_m1 --cone 0.1deg --at x=0.01,{}", 1),
    ("select 3rrr_m1 --start {} --goal x=0.02 --runs 0", 2),
]


@pytest.mark.some(1, 6)
@pytest.mark.parametrize(("command", "least"), ASKED, ids=lambda each: str(each).partition(" ")[0])
@pytest.mark.parametrize(("typed", "told"), [("phi=5deg", "5"), ("phi=0.1", "5.729578"), ("rpy=0/0/5deg", "5")])
def test_a_turn_about_one_axis_is_told_in_one_way_however_it_was_typed(
    printed, command: str, least: int, typed: str, told: str
):
    text = printed(command.format(typed))
    poses = re.findall(r"x=\S+", text)
    assert len(poses) >= least
    assert all(re.search(rf"phi={NUMBER}deg", pose) for pose in poses), poses
    assert re.search(rf"\bphi={re.escape(told)}deg\b", text)


@pytest.mark.parametrize("command", ["modes", "aspects"])
def test_what_is_held_is_called_what_it_is(printed, command: str):
    assert "fixed     measured values at" in printed(f"{command} 3rpr_m1 --sensor encoder:slide_1")
    assert "fixed     observed directions at" in printed(f"{command} 3rpr_m1")


def test_turns_are_those_of_the_platform(printed):
    assert "phi=0deg" in printed("check quattro --at x=0.02")
    assert "rpy=0/0/0" in printed("check gough_stewart --at x=0.02")


@pytest.mark.parametrize("typed", ["phi=30deg", "phi=0.4", "rpy=0/0/20deg"])
def test_what_is_printed_can_be_typed_again(typed: str):
    first = hrsynth.check("quattro", at=f"x=0.02,y=0.01,z=-0.71,{typed}").postures[0].pose
    again = hrsynth.check("quattro", at=str(first)).postures[0].pose
    assert str(again) == str(first)
    assert np.allclose([again.x, again.y, again.z, *again.rpy], [first.x, first.y, first.z, *first.rpy], atol=1e-6)
    assert first.to_dict().keys() == {"x", "y", "z", "rpy"}


def test_an_error_shows_a_pose_as_it_was_typed(capsys):
    assert execute(["check", "quattro", "--at", "x=9,phi=30deg"]) == 3
    assert "the pose x=9,phi=30deg is not reached" in capsys.readouterr().err
    assert str(Pose.parse(" x = 0.020, phi = 10 deg")) == "x=0.020,phi=10 deg"
    assert Pose.parse("phi=180deg") == Pose(phi=math.pi)


def test_a_turn_that_is_not_phi_is_told_by_rpy():
    found = hrsynth.check("gough_stewart", at=["phi=5deg", "rpy=10deg/5deg/0"])
    assert str(found.postures[0].pose).endswith("phi=5deg")
    assert str(found.postures[1].pose).endswith("rpy=10deg/5deg/0deg")


@pytest.mark.parametrize("name", list(list_robots()))
def test_loops_are_named_as_in_the_file(name: str):
    robot = hrsynth.load(name)
    written = [joint.name for joint in robot.joints.values() if not joint.in_tree]
    named = PinocchioModel(robot).loops
    assert sorted(named) == sorted(written)
    mechanism = normal_form(robot).mechanism
    inside = {joint.name for joint in mechanism.joints.values() if not joint.in_tree}
    assert {*PinocchioModel(mechanism).loops} >= inside & {*written}


def test_a_cut_is_called_by_a_loop_of_its_own_ring():
    """The redundant loop of a five-bar is the file's, not the joint at which the model is cut."""
    (redundant,) = hrsynth.check("rrrrr_m1").redundant
    assert (redundant.loop, redundant.rows) == ("end", 3)


def test_axes_have_one_sense():
    rng = np.random.default_rng(1)
    for axis in rng.normal(size=(200, 3)):
        assert np.array_equal(orient_axis(axis), orient_axis(-axis))
        assert orient_axis(axis)[np.argmax(np.abs(axis))] > 0
    for a, b in pairwise(rng.permuted(np.array([[1, -1, 1e-9]] * 20) / math.sqrt(2), axis=1)):
        assert [orient_axis(v)[np.argmax(np.abs(v) > 0.5)] > 0 for v in (a, b, -a, -b)] == [True] * 4


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["quattro", "3prp", "uranesx", "3puu", "gough_stewart", "delta", "3rrr_m1"])
def test_printed_axes_have_that_sense(printed, name: str):
    text = printed(f"legs {name}")
    if name != "gough_stewart":
        text += (
            printed(f"accuracy {name} --cone 0.1deg")
            if "controllable" in printed(f"derive {name}").split("verdict")[1].split()[:1]
            else ""
        )
    text = re.sub(r"\s+", " ", text)
    text = re.sub(r"along \([^)]*\) of its frame", "", text)  # what a camera sees of a link has a sense of its own
    vectors = [tuple(map(float, found)) for found in re.findall(rf"along \(?({NUMBER}) ({NUMBER}) ({NUMBER})", text)]
    assert vectors or "along" not in re.sub("along [xyz]", "", text)
    for vector in vectors:
        assert max(vector) >= 0.999 * max(map(abs, vector)), vector


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("check rrrrr_m1 --at x=0,y=0.3332", "not bounded to first order, per degree of direction error"),
        ("accuracy rrrrr_m1 --cone 0.1deg --at x=0,y=0.3332", "position     not bounded to first order"),
        (
            "accuracy rrrrr_m1 --cone 0.1deg --grid x=0:0.02:2,y=0.3331:0.3332:2",
            "; not bounded to first order at 1 poses",
        ),
        (
            "accuracy rrrrr_m1 --cone 0.1deg --grid x=0:0.00001:2,y=0.3332:0.33320001:2",
            "position     not bounded to first order at 4 poses\n",
        ),
    ],
)
def test_numbers_beyond_sense_are_not_printed(printed, command: str, said: str):
    text = printed(command)
    assert said in text
    numbers = [float(number) for number in re.findall(rf"({NUMBER}) (?:mm|degrees)", text)]
    assert all(number < 400 for number in numbers)


def test_numbers_with_sense_are_printed(printed):
    assert re.search(r"error gain +5\.27 mm and 0\.816 deg per degree of direction error", printed("check rrrrr_m1"))


@pytest.mark.parametrize(
    ("robot", "grid", "lines"),
    [
        ("quattro", "x=-0.1:0.1:3,y=0:0.1:3", ["free, chosen nearest to the zero configuration: z = -0.7, phi"]),
        (
            "quattro",
            "x=-0.1:0.1:3,z=-0.7",
            ["fixed: z=-0.7", "free, chosen nearest to the zero configuration: y = 0, phi"],
        ),
        ("quattro", "x=-0.1:0.1:3,y=0,z=-0.7,phi=10deg", ["fixed: y=0,z=-0.7,phi=10deg", "no free coordinate"]),
        (
            "gough_stewart",
            "x=-0.01:0.01:2,y=0,z=0.3,phi=0",
            ["fixed: y=0,z=0.3,phi=0", "free, chosen nearest to the zero configuration: orientation but phi"],
        ),
        ("rrrrr_m1", "x=0:0.02:2,y=0.2:0.22:2", ["no free coordinate"]),
    ],
)
def test_a_grid_says_what_it_held(printed, robot: str, grid: str, lines: list[str]):
    text = printed(f"check {robot} --grid {grid}")
    rows = [line.strip() for line in text[text.index("\ngrid ") :].splitlines()[2:]]
    assert rows == lines


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "command",
    [
        "legs quattro",
        "legs example:panda",
        "advise example:panda",
        "advise quattro --observe 1 --candidate-sensor point:platform",
    ],
)
def test_tables_and_lists_are_not_wider_than_a_hundred_columns(printed, command: str):
    """No word is lost, and vectors stay whole."""
    text = printed(command)
    lines = text[text.index("\n\n") :].splitlines()
    assert max(map(len, lines)) <= 105
    assert sum(len(line) > 100 for line in lines) <= 1  # the sentence with the smallest gap
    assert not [line for line in lines if re.search(rf"\({NUMBER}( {NUMBER})?$", line)]


def test_a_wrapped_column_keeps_its_words():
    words = " ".join(f"word{i}" for i in range(60))
    lines = table([("a", words), ("b", "")], ("one", "two")).splitlines()
    assert max(map(len, lines)) <= 100
    assert " ".join(line[5:] for line in lines[2:-1]) == words
    assert [line[:1] for line in lines[2:]] == ["a", *" " * (len(lines) - 4), "b"]


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("check 3rrr_m1 --at phi=10", "--at phi=10: taken as radians, 573 degrees"),
        ("check 3rrr_m1 --at x=0,phi=0.1 --at phi=-4", "--at phi=-4: taken as radians, -229 degrees"),
        ("path 3rrr_m1 --start phi=0 --goal phi=5", "--goal phi=5: taken as radians, 286 degrees"),
        ("check 3rrr_m1 --at phi=3", None),
        ("check 3rrr_m1 --at x=4,phi=0.2", None),
        ("check 3rrr_m1 --at phi=10deg", None),
    ],
)
def test_a_turn_of_more_than_half_a_circle_without_a_unit_is_told_in_degrees(
    command: str, told: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    execute(command.split())
    said = capsys.readouterr().err
    assert ("radians" in said) is (told is not None)
    assert told is None or told in said


@pytest.mark.parametrize(
    ("command", "usual"),
    [
        ("basins 3rrr_m1 --at x=0", "--goal"),
        ("equilibria 3rrr_m1 --at x=0", "--goal"),
        ("path 3rrr_m1 --at x=0", "--goal"),
    ],
)
def test_the_pose_of_a_question_is_named_where_another_name_is_given(
    command: str, usual: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert execute(command.split()) == 2
    assert f"allowed: {usual} for the pose of this question" in capsys.readouterr().err


def test_ranges_have_units(printed):
    told = printed("accuracy 3rrr_m1 --cone 0.1deg --grid x=-0.01:0.01:2,phi=0:0.1:2,y=0")
    assert "x -0.01 to 0.01 m, phi 0 to 0.1 rad" in told
