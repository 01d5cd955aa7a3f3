"""What every answer can do: it is pickled, copied and compared, by what it says and not by what computed it."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.errors import MissingExtra
from hrsynth.mechanism.model import PlatformChoice
from hrsynth.results import Result

START, GOAL = "x=0,y=0,z=-0.75,phi=0", "x=-0.2,y=0,z=-0.56,phi=0"
LEGS = ["1", "4"]
ASKED = {
    "robot": lambda: hrsynth.load("quattro"),
    "observe": lambda: hrsynth.observe(hrsynth.load("quattro"), LEGS),
    "derive": lambda: hrsynth.derive(hrsynth.load("quattro"), LEGS),
    "certificate": lambda: hrsynth.derive(hrsynth.load("quattro"), LEGS).equivalence,
    "verdict": lambda: hrsynth.derive(hrsynth.load("quattro"), LEGS).verdict,
    "legs": lambda: hrsynth.legs(hrsynth.load("3rpr_m1")),
    "check": lambda: hrsynth.check(hrsynth.load("quattro"), LEGS, at=[START], grid="x=-0.1:0.1:3,y=0,z=-0.7"),
    "check loops": lambda: hrsynth.check(
        hrsynth.load("quattro").changed(choice=PlatformChoice("open", "several could be"))
    ),
    "singularities": lambda: hrsynth.singularities(hrsynth.load("quattro"), LEGS, points=50),
    "advise": lambda: hrsynth.advise(hrsynth.load("quattro"), ["1"]),
    "accuracy": lambda: hrsynth.accuracy(hrsynth.load("quattro"), LEGS, cone="0.1deg", plane="z=-0.7", steps=5),
    "branch": lambda: hrsynth.branch(hrsynth.load("rrrrr_m1"), "shoulder_1=-0.05:0.05,shoulder_2=-0.05:0.05"),
    "modes": lambda: hrsynth.modes(hrsynth.load("quattro"), LEGS, at=GOAL),
    "modes planar": lambda: hrsynth.modes(hrsynth.load("3rrr_m1")),
    "aspects": lambda: hrsynth.aspects(hrsynth.load("3rrr_m1")),
    "lint": lambda: hrsynth.lint("quattro"),
    "path": lambda: hrsynth.path(hrsynth.load("3rrr_m1"), start="x=0.01,y=0,phi=0", goal="x=-0.01,y=0,phi=0.05"),
    "servo": lambda: hrsynth.servo(hrsynth.load("3rrr_m1"), start="x=0.01,y=0,phi=0", goal="x=-0.01,y=0,phi=0.05"),
    "equilibria": lambda: hrsynth.equilibria(hrsynth.load("rrrrr_m1"), goal="x=0,y=0.25"),
    "basins": lambda: hrsynth.basins("rrrrr_m1", goal="x=0,y=0.25", grid="x=-0.01:0.01:2,y=0.25", jobs=1),
    "select": lambda: hrsynth.select(
        hrsynth.load("3rrr_m1"), start="x=0.01,y=0,phi=0", goal="x=-0.01,y=0,phi=0.05", runs=1, examine=1
    ),
    "export": lambda: hrsynth.export("prrrp_m1", box="guide_1=-0.001:0.001,guide_2=-0.001:0.001", jumps=True),
    "view": lambda: hrsynth.view(hrsynth.load("3rrr_m1"), hidden=True),
}


@cache
def asked(name: str) -> Result | ObservedRobot:
    return ASKED[name]()


def kinds() -> set[type]:
    return {each for each in Result.__subclasses__() if each.__module__.startswith("hrsynth.")}


@pytest.mark.slow
def test_every_kind_of_answer_is_tried():
    assert kinds() <= {type(asked(name)) for name in ASKED}


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ASKED)
def test_an_answer_is_pickled_and_copied_and_is_the_same(name):
    found = asked(name)
    for other in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert other is not found
        assert other == found
        assert hash(other) == hash(found)
        assert repr(other) == repr(found)
        if isinstance(found, Result):
            assert str(other) == str(found)
            assert other.to_dict() == found.to_dict() if name != "robot" else not other.differences(found)


@pytest.mark.slow
def test_an_answer_is_not_that_of_another_question():
    found = [asked(name) for name in ASKED]
    for i, one in enumerate(found):
        assert [one == other for other in found] == [i == j for j in range(len(found))]
    robot = hrsynth.load("quattro")
    assert asked("derive") != hrsynth.derive(robot, ["1", "3"])
    assert asked("modes") != hrsynth.modes(robot, LEGS, at="x=-0.19,y=0,z=-0.56,phi=0")
    assert asked("observe") != hrsynth.observe(robot, LEGS, seed=1)
    assert asked("observe") != hrsynth.observe(robot, ["4", "1"])


def test_a_robot_is_equal_to_itself_wherever_it_is_read_and_to_no_other(tmp_path):
    robot = hrsynth.load("quattro")
    hrsynth.save(robot, tmp_path / "other.urdf")
    again = hrsynth.load(tmp_path / "other.urdf")
    assert again == robot
    assert hash(again) == hash(robot)
    assert again.file != robot.file
    joint = next(iter(robot.joints.values()))
    moved = robot.changed(joints=[replace(joint, point=joint.point + [0, 0, 1e-12])])
    assert moved != robot


@pytest.mark.slow
def test_what_was_loaded_goes_on_working():
    """Models, formulas and batches are made again: a loaded answer answers further questions as its original."""
    one, other = asked("observe"), pickle.loads(pickle.dumps(asked("observe")))
    assert hrsynth.derive(other) == hrsynth.derive(one)
    assert hrsynth.check(other, grid="x=-0.1:0.1:3,y=0,z=-0.7") == hrsynth.check(one, grid="x=-0.1:0.1:3,y=0,z=-0.7")
    found = asked("modes planar")
    assert hrsynth.certificate(pickle.loads(pickle.dumps(found))) == hrsynth.certificate(found)
    for name in ("modes planar", "servo", "accuracy"):
        found = asked(name)
        assert hrsynth.draw(pickle.loads(pickle.dumps(found))).content == hrsynth.draw(found).content, name


def test_results_are_tables_of_pandas():
    """Of a grid the table that is written, else one row; without pandas a line with a remedy."""
    found = hrsynth.check("rrrrr_m1", grid="x=0:0.02:2,y=0.2:0.22:3")
    if find_spec("pandas") is None:
        with pytest.raises(MissingExtra, match=r"a table of pandas needs .*pip install pandas\."):
            found.to_pandas()
        pytest.skip("pandas is not here")
    table = found.to_pandas()
    assert table.shape[0] == 6
    np.testing.assert_allclose(table[["x", "y"]], [(x, y) for x in (0, 0.02) for y in (0.2, 0.21, 0.22)])
    legs = hrsynth.legs("rrrrr_m1")
    assert legs.to_pandas().iloc[0].to_dict() == legs.to_row()


def test_arrays_stay_read_only():
    robot = pickle.loads(pickle.dumps(hrsynth.load("quattro")))
    for joint in robot.joints.values():
        assert not joint.point.flags.writeable
        assert not any(axis.flags.writeable for axis in joint.axes)
    with pytest.raises(ValueError, match="read-only"):
        next(iter(robot.links.values())).pose[0, 3] = 1.0


@pytest.mark.slow
def test_an_answer_is_read_in_another_process(tmp_path):
    """Nothing in it depends on what was computed in the process that made it."""
    for name in ("singularities", "modes", "derive"):
        (tmp_path / name).write_bytes(pickle.dumps(asked(name)))
    code = (
        "import pickle, sys; from pathlib import Path\n"
        "for file in sorted(Path(sys.argv[1]).iterdir()): print(repr(pickle.loads(file.read_bytes())))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, tmp_path],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": str(Path(hrsynth.__file__).parents[1]), "PYTHONIOENCODING": "utf-8"},
    )
    assert run.stdout.splitlines() == [repr(asked(name)) for name in ("derive", "modes", "singularities")]


def test_a_verdict_is_equal_to_its_word():
    verdict = asked("verdict")
    assert verdict == "controllable"
    assert verdict != "partially controllable"
    assert verdict in {"controllable"}
    assert asked("derive").exact == "controllable"
    assert hrsynth.derive(hrsynth.load("quattro"), ["1"]).verdict == "partially controllable"
    assert asked("path") == asked("path").verdict
    assert asked("derive") != "controllable"


def test_equal_arrays_of_other_shapes_are_not_equal():
    from hrsynth.results import freeze_content

    assert freeze_content(np.zeros((2, 3))) != freeze_content(np.zeros((3, 2)))
    assert freeze_content(np.zeros(3)) == freeze_content(-np.zeros(3))


LONGEST = 200
"""Characters of any value at a prompt."""


def inside(value: object, depth: int, seen: set[int]) -> Iterator[object]:
    """All values of the package that are reached from an answer by fields, some of each tuple."""
    if id(value) in seen or depth < 0:
        return
    seen.add(id(value))
    if isinstance(value, tuple | list | dict):
        for each in islice(value.values() if isinstance(value, dict) else value, 4):
            yield from inside(each, depth, seen)
    elif type(value).__module__.startswith("hrsynth."):
        yield value
        for field in fields(value) if is_dataclass(value) else ():
            if not field.repr:
                continue
            yield from inside(getattr(value, field.name), depth - 1, seen)


@pytest.mark.slow
@pytest.mark.some(8)
@pytest.mark.parametrize("name", ASKED)
def test_whatever_an_answer_holds_is_one_line_at_a_prompt(name):
    complaints = [
        f"{type(each).__name__}: {len(repr(each))} characters"
        for each in inside(asked(name), 5, set())
        if len(repr(each)) > LONGEST or "\n" in repr(each)
    ]
    assert complaints == []


def test_a_batch_and_what_it_evaluates_are_one_line():
    seen = asked("observe")
    for each in (seen.batch, seen.placer, seen.batch.evaluate(seen.batch.home[None], cones=0.01), seen.motion):
        assert len(repr(each)) <= LONGEST
        assert "\n" not in repr(each)


def test_many_poses_are_one_line():
    found = hrsynth.check(asked("observe"), at=[[0.001 * k, 0, -0.7] for k in range(20)])
    assert len(repr(found)) <= LONGEST
    assert len(str(found).splitlines()) > 100
