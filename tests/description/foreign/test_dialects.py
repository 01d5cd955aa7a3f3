"""The same four-bar, whatever dialect says it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from description.foreign.examples import FILES, A, B, C, D, Y
from hrsynth.description import load
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form
from oracle import Oracle


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).write_text(text)
    return folder / next(iter(files))


def mobility(mechanism: Mechanism) -> int:
    """By screws, in maximal coordinates."""
    oracle = Oracle(mechanism)
    return oracle.mobility(oracle.zero())


def lines(mechanism: Mechanism) -> list[tuple[float, ...]]:
    """Where the axes of all R joints pierce the plane y = 0, in order; they must be parallel to y."""
    X = mechanism.links[mechanism.base].pose
    found = []
    for joint in mechanism.joints.values():
        axis = X[:3, :3].T @ joint.axis
        assert joint.type is JointType.REVOLUTE
        assert np.linalg.norm(np.cross(axis, Y)) < 1e-9
        found.append(joint.point - axis * (joint.point @ Y) / (axis @ Y))
    return sorted(tuple(np.round(point, 9) + 0.0) for point in found)


@pytest.mark.some(10)
@pytest.mark.parametrize("name", FILES)
def test_every_dialect_says_the_same_four_bar(name: str, tmp_path: Path):
    robot = load(written(tmp_path, FILES[name]))
    normal = reduce_to_normal_form(robot).mechanism
    assert lines(normal) == sorted(tuple(point + 0.0) for point in (A, B, C, D))
    assert robot.platform in ("bar", "pin", "two")
    assert robot.base == "base"
    assert mobility(normal) == 1
    motors = {joint.name for joint in robot.joints.values() if joint.is_actuated}
    assert motors == (set() if name.startswith("sdf") else {"a"})


@pytest.mark.some(7)
@pytest.mark.parametrize("name", FILES)
def test_what_was_guessed_is_told(name: str, tmp_path: Path):
    path = written(tmp_path, FILES[name])
    assert any(note.kind == "assumption" and "platform" in note.text for note in load(path).notes)
    given = load(path, platform="bar")
    assert given.platform == "bar"
    assert not any("platform" in note.text for note in given.notes)


@pytest.mark.parametrize("files", [FILES["gepetto: 3d"], FILES["gepetto: 6d"]])
def test_a_folder_and_either_file_are_one_robot(files: dict[str, str], tmp_path: Path):
    path = written(tmp_path, files)
    robots = [load(each) for each in (tmp_path, path, tmp_path / "robot.yaml")]
    assert all(robots[0].differences(other) == [] for other in robots[1:])


def test_the_dialect_is_known_by_content_not_by_ending(tmp_path: Path):
    for number, name in enumerate(("urdf: urdf+", "mjcf: connect", "sdf: 1.7")):
        text = next(iter(FILES[name].values()))
        (tmp_path / f"{number}.txt").write_text(text)
        assert load(tmp_path / f"{number}.txt", platform="bar").name == "four_bar"
