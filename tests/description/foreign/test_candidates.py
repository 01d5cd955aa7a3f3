"""A file without a loop is told to have none, and where it could have one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.foreign.examples import TREE, A, B, C, D, _frame, urdf, words
from description.foreign.test_dialects import lines, mobility
from hrsynth.analysis.pose_requests import observe
from hrsynth.description import formats, load
from hrsynth.description.assembly.candidates import ClosureCandidate, closure_candidates
from hrsynth.description.jointgraph import JointGraph
from hrsynth.description.reading import open_robot_file
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import build_pose, convert_rpy_to_rotation, invert_pose
from hrsynth.mechanism.normal import reduce_to_normal_form

FRAMES = _frame("hook", "rocker", C) + _frame("eye", "bar", C)


def candidates(folder: Path, text: str, base: str = "base") -> tuple[ClosureCandidate, ...]:
    path = folder / "robot.urdf"
    path.write_text(text)
    graph = formats.read(open_robot_file(path))
    assert isinstance(graph, JointGraph)
    return closure_candidates(graph, base)


def chain(rng: np.random.Generator, links: int) -> str:
    """A chain of R joints with random frames; those of the first link's hook and the last link's eye coincide."""
    text, X = "", np.eye(4)
    for k in range(links):
        angles, shift, axis = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3), rng.normal(size=3)
        text += (
            f'<link name="k{k + 1}"/><joint name="j{k}" type="continuous"><parent link="k{k}"/>'
            f'<child link="k{k + 1}"/><origin xyz="{words(shift)}" rpy="{words(angles)}"/>'
            f'<axis xyz="{words(axis)}"/></joint>'
        )
        X = X @ build_pose(shift, convert_rpy_to_rotation(*angles))
    hook = rng.uniform(-1, 1, 3)
    eye = (invert_pose(X) @ np.append(hook, 1))[:3]
    for name, link, point in (("hook", "k0", hook), ("eye", f"k{links}", eye)):
        text += (
            f'<link name="{name}"/><joint name="{name}_fixed" type="fixed"><parent link="{link}"/>'
            f'<child link="{name}"/><origin xyz="{words(point)}"/></joint>'
        )
    return f'<robot name="chain"><link name="k0"/>{text}</robot>'


def test_frames_that_coincide_are_told_and_close_the_loop(tmp_path: Path):
    (found,) = candidates(tmp_path, urdf(FRAMES))
    assert set(found.links) == {"hook", "eye"}
    assert found.coincides
    robot = load(tmp_path / "robot.urdf", close=found.wish, platform="bar")
    assert mobility(reduce_to_normal_form(robot).mechanism) == 1
    assert lines(reduce_to_normal_form(robot).mechanism) == sorted(tuple(point + 0.0) for point in (A, B, C, D))


def test_a_robot_without_a_loop_is_told_to_have_none(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(FRAMES))
    (told,) = [note.text for note in load(path, platform="bar").notes if note.kind == "open"]
    assert "no element of the file closes a loop" in told
    assert "--close hook:eye" in told
    with pytest.raises(BadRequest, match=r"closes a loop.*--close hook:eye"):
        observe(load(path))
    path.write_text(urdf(""))
    told = next(note.text for note in load(path, platform="bar").notes if note.kind == "open")
    assert told.endswith("open chain")


def test_a_robot_with_a_loop_is_not(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(FRAMES))
    assert not [note for note in load(path, close="hook:eye").notes if note.kind == "open"]


@pytest.mark.parametrize("seed", range(12))
def test_any_chain_whose_ends_meet_is_found_and_others_are_not(seed: int, tmp_path: Path):
    rng = np.random.default_rng(seed)
    text = chain(rng, 3 + seed % 4)
    assert {frozenset(each.links) for each in candidates(tmp_path, text, "k0")} == {frozenset({"hook", "eye"})}
    away = text.replace('<link name="hook"/>', "")
    start = away.index('<joint name="hook_fixed"')
    away = away[:start] + away[away.index("</joint>", start) + 8 :]
    assert candidates(tmp_path, away, "k0") == ()


def test_joints_through_one_point_are_no_closure(tmp_path: Path):
    """Three R through one point keep their frames together whatever they do."""
    text = TREE.replace('<link name="base"/>', '<link name="base"/><link name="w1"/><link name="w2"/><link name="w3"/>')
    for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"), 1):
        parent = "bar" if k == 1 else f"w{k - 1}"
        text += (
            f'<joint name="w{k}" type="continuous"><parent link="{parent}"/><child link="w{k}"/>'
            f'<origin xyz="{0.3 if k == 1 else 0} 0 0"/><axis xyz="{axis}"/></joint>'
        )
    assert candidates(tmp_path, f'<robot name="wrist">{text}</robot>') == ()


def test_the_nearest_come_first_and_rounding_counts_as_meeting(tmp_path: Path):
    near = FRAMES + _frame("far", "base", A + [0.0, 0.0, 0.5]) + _frame("other", "rocker", A + [0.0, 0.01, 0.5])
    found = candidates(tmp_path, urdf(near))
    assert [set(each.links) for each in found] == [{"hook", "eye"}]  # base and rocker are joined already
    near = FRAMES + _frame("far", "base", C + [0.0, 0.01, 0.0])
    found = candidates(tmp_path, urdf(near))
    assert set(found[0].links) == {"hook", "eye"}
    assert [each.coincides for each in found] == [True, False]
    assert found[1].distance == pytest.approx(0.01)
    assert set(found[1].links) == {"far", "eye"}


@pytest.mark.parametrize(("links", "frames", "told"), [(7, True, True), (13, False, True), (7, False, False)])
def test_motors_of_a_robot_with_open_loops_are_not_proposed(links: int, frames: bool, told: bool, tmp_path: Path):
    path = tmp_path / "robot.urdf"
    text = chain(np.random.default_rng(3), links)
    path.write_text(text if frames else text[: text.index('<link name="hook"')] + "</robot>")
    said = str(load(path, platform=f"k{links}").proposed_motors)
    assert ("close the loops first" in said) is told
    assert (f"{links} move independently" in said) is told
    if frames:
        robot = load(path, platform=f"k{links}", close="hook:eye")
        assert str(robot.proposed_motors).startswith("no joint has a motor: try --motors j0")
        assert not any("open chain" in note.text for note in robot.notes)
        findings = hrsynth.lint(path, platform=f"k{links}", close="hook:eye").findings
        assert not any(each.rule == "frames-coincide" for each in findings)
        assert any(each.rule == "frames-coincide" for each in hrsynth.lint(path).findings)
