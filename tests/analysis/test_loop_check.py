"""``check`` of what names no platform, or has no segment: mobility and constraints of any mechanism."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import hrsynth
from hrsynth.analysis.check import Check, LoopCheck
from hrsynth.cli import run_command
from hrsynth.cli.schema import build_schema
from hrsynth.description import list_robots, load, save
from hrsynth.description.assembly.choices import choices
from hrsynth.description.overrides import Overrides
from hrsynth.errors import BadRequest, NoPlatform, NoSegment
from hrsynth.index import list_analyses
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.model import PlatformChoice
from oracle import Oracle

OPEN = PlatformChoice("open", "several links could be it. Choose it with --platform LINK")
TREE = ["1 0 0", "0 1 0", "0.6 0 0.8"]


def opened(name: str) -> Mechanism:
    """A shipped robot whose file leaves open which link is the platform."""
    return replace(load(name), choice=OPEN)


def joint(name: str, parent: str, child: str, axis: str, xyz: str = "0 0 0") -> str:
    return (
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>'
    )


def spherical(legs: int, own: str = "") -> str:
    """Legs RRR whose axes all meet in one point: no link has two joint centres."""
    turns = [("1 0 0", "0 1 0", "0 0 1"), ("0 1 0", "0 0 1", "1 0 0"), ("0 0 1", "1 0 0", "0 1 0")]
    text = '<link name="base"/><link name="plate"/>'
    for leg in range(legs):
        one, two, last = turns[leg]
        text += f'<link name="a{leg}"/><link name="b{leg}"/>'
        text += joint(f"p{leg}", "base", f"a{leg}", one) + joint(f"q{leg}", f"a{leg}", f"b{leg}", two)
        if leg == 0:
            text += joint("r0", "b0", "plate", last)
        else:
            text += (
                f'<loop name="r{leg}" type="revolute"><predecessor link="b{leg}"/><successor link="plate"/>'
                f'<axis xyz="{last}"/></loop>'
            )
    return f'<robot name="ball">{text}{own}</robot>'


def tree(branches: int, long: int) -> str:
    """Chains of R side by side: nothing tells which of their ends is the platform."""
    text = '<link name="base"/>'
    for branch in range(branches):
        for number in range(long):
            name, parent = f"l{branch}_{number}", f"l{branch}_{number - 1}" if number else "base"
            text += f'<link name="{name}"/>' + joint(f"j{branch}_{number}", parent, name, TREE[number % 3], "0.1 0 0.3")
    return f'<robot name="tree">{text}</robot>'


@pytest.mark.some(6, 6)
@pytest.mark.parametrize("name", list_robots())
def test_mobility_and_rank_are_those_of_an_independent_count(name: str):
    robot = opened(name)
    if robot.formation:
        return
    found = hrsynth.check(robot)
    assert isinstance(found, LoopCheck)
    oracle = Oracle(robot)
    assert found.mobility.total == oracle.mobility(oracle.zero())
    told = found.constraints
    assert found.mobility.total == told.coordinates - told.rank
    assert sum(each.rows for each in found.redundant) == told.rows - told.rank
    assert {each.loop for each in found.redundant} <= {*told.loops}
    assert told.gap == pytest.approx(told.smallest_kept / told.largest_dropped)
    assert found.mobility.total == hrsynth.observe(load(name), samples=4).mobility_as_written.total
    assert OPEN.reason in found.more


@pytest.mark.parametrize(("branches", "long"), [(2, 1), (2, 3), (3, 2), (4, 4)])
def test_the_mobility_of_an_open_tree_is_the_sum_of_its_freedoms(branches: int, long: int):
    found = hrsynth.check(load(tree(branches, long)))
    assert isinstance(found, LoopCheck)
    assert (found.mobility.total, found.constraints.rows, found.redundant) == (branches * long, 0, ())
    assert "none, an open tree" in hrsynth.text(found)
    motors = ",".join(f"j{branch}_{k}" for branch in range(branches) for k in range(long))
    wanted = f"no joint has a motor: try --motors {motors} (all joints: no loop is closed)"
    if branches * long > 12:
        wanted = f"no joint has a motor, and {branches * long} move independently: close the loops first (--close A:B)"
    assert found.more[-1] == wanted


@pytest.mark.parametrize("legs", [2, 3])
def test_what_no_segment_tells_is_answered_and_viewed(legs: int, tmp_path: Path):
    robot = load(spherical(legs), platform="plate")
    with pytest.raises(NoSegment):
        hrsynth.observe(robot)
    found = hrsynth.check(robot)
    assert isinstance(found, LoopCheck)
    assert (found.mobility.total, sum(each.rows for each in found.redundant)) == (3, 3 * (legs - 1))
    assert "segment" in found.more[0]
    shown = hrsynth.view(robot)
    assert len(shown.sliders) == 3
    assert shown.arrows == ()
    with pytest.raises(NoSegment):
        hrsynth.view(robot, hidden=True)


WAY: dict[str, object] = {"start": "x=0", "goal": "x=0.01"}
GIVEN: dict[str, dict[str, object]] = {
    "accuracy": {"cone": "0.1deg"},
    "basins": {"goal": "x=0", "grid": "x=0:0.1:2"},
    "path": WAY,
    "select": WAY,
    "servo": WAY,
}
"""What questions cannot be asked without."""


@pytest.mark.parametrize("command", sorted(list_analyses().keys() - {"check", "view"}))
def test_every_other_question_asks_for_the_platform(command: str):
    for robot in (opened("3rrr_m1"), load(tree(2, 2))):
        with pytest.raises(NoPlatform, match="Choose it with --platform LINK"):
            getattr(hrsynth, command)(robot, **GIVEN.get(command, {}))
    assert isinstance(hrsynth.check(opened("3rrr_m1")), LoopCheck)


@pytest.mark.parametrize("name", ["3rrr_m1", "delta", "quattro", "rrrrr_m1"])
def test_motors_are_proposed_where_none_is_driven(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """Of these robots the motors are those proposed; ``derive``, ``check`` and ``export`` tell them in one line."""
    robot = load(name)
    still = replace(robot, joints={name: replace(joint, motor=None) for name, joint in robot.joints.items()})
    names = [joint.name for joint in robot.joints.values() if joint.is_actuated]
    assert robot.proposed_motors is None
    assert still.proposed_motors == f"no joint has a motor: try --motors {','.join(names)} (the joints at the base)"
    save(still, tmp_path / "still.urdf")
    told = f"--motors {','.join(names)} (the joints at the base)"
    for command, status in (("derive", 0), ("check", 0), ("export", 2)):
        capsys.readouterr()
        output = ["-o", str(tmp_path / "code.hpp")] if command == "export" else []
        assert run_command([command, str(tmp_path / "still.urdf"), *output]) == status
        assert [told in line for line in capsys.readouterr().err.splitlines()].count(True) == 1
    found = choices(tmp_path / "still.urdf", Overrides())
    assert found.proposed_motors == names


@pytest.mark.parametrize("more", [{"at": "x=0"}, {"grid": "x=0:1:2"}, {"observe": "1"}, {"camera": "base"}])
def test_what_is_asked_of_a_platform_or_legs_is_refused_without(more: dict[str, str]):
    hrsynth.check(load("3rrr_m1"))  # an equal robot whose platform is named, asked before
    with pytest.raises(NoPlatform):
        hrsynth.check(opened("3rrr_m1"), **more)
    with pytest.raises(BadRequest):
        hrsynth.check(load(spherical(3), platform="plate"), **more)


def test_a_platform_that_is_named_makes_it_the_whole_answer(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / "tree.urdf"
    path.write_text(tree(2, 3))
    for options, kind in (([], "constraints"), (["--platform", "l0_2"], "configurations")):
        capsys.readouterr()
        assert run_command(["check", str(path), *options, "--json"]) == 0
        record = json.loads(capsys.readouterr().out)
        assert kind in record
        assert list(Draft202012Validator(build_schema("check")).iter_errors(record)) == []
        assert (record["platform"]["link"] is None) is (not options)
        less = {name: value for name, value in record.items() if name != kind}
        assert list(Draft202012Validator(build_schema("check")).iter_errors(less)) != []
    assert isinstance(hrsynth.check(load(path, platform="l0_2")), Check)


@pytest.mark.some(4, 4)
@pytest.mark.parametrize("ending", ["urdf", "xml", "sdf", "yaml"])
@pytest.mark.parametrize("name", ["3rrr_m1", "delta", "gough_stewart", "i4l", "rrrrr_m1"])
def test_a_robot_without_a_platform_is_written_without_one(tmp_path: Path, name: str, ending: str):
    robot = replace(opened(name), observations=())
    save(robot, tmp_path / f"robot.{ending}")
    assert "platform: " not in (tmp_path / f"robot.{ending}").read_text()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        again = load(tmp_path / f"robot.{ending}")
    assert again.choice is not None
    assert again.choice.chosen in ("assumption", "open")
    one, two = Oracle(robot), Oracle(again)
    assert one.mobility(one.zero()) == two.mobility(two.zero())


def test_lint_looks_at_all_of_a_file_without_a_platform(tmp_path: Path):
    path = tmp_path / "tree.urdf"
    path.write_text(tree(2, 2))
    found = {each.rule: each for each in hrsynth.lint(path).findings}
    assert "several links could be" in found["option-missing"].message
    assert "motor-none" in found


@pytest.mark.parametrize("text", [tree(2, 2), spherical(3)], ids=["tree", "spherical"])
@pytest.mark.parametrize("command", ["check", "convert", "lint", "view"])
def test_the_json_of_what_needs_no_platform_is_what_its_schema_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str, text: str
):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    more = {"convert": [str(tmp_path / "robot.xml")], "view": ["--static", str(tmp_path / "view.html")]}
    capsys.readouterr()
    assert run_command([command, str(path), *more.get(command, []), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert list(Draft202012Validator(build_schema(command)).iter_errors(record)) == []
