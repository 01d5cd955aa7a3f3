"""What a foreign file says is not lost or doubled: on the way into any dialect and back, nor told by names alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from description.foreign.examples import FILES
from description.foreign.test_dialects import lines, mobility, written
from hrsynth.description import load, save
from hrsynth.errors import BadRobotFile
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.normal import normal_form


def moving(robot: Mechanism) -> list[str]:
    return sorted(str(joint.type) for joint in normal_form(robot).mechanism.joints.values())


def refused(path: Path) -> str:
    with pytest.raises(BadRobotFile) as caught:
        load(path)
    (line,) = caught.value.lines()
    return line


@pytest.mark.parametrize("ending", [".urdf", ".xml", ".sdf", ".yaml"])
@pytest.mark.parametrize("name", FILES)
def test_any_source_comes_back_the_same_from_any_dialect(name: str, ending: str, tmp_path: Path):
    robot = load(written(tmp_path, FILES[name]), platform="bar")
    save(robot, tmp_path / f"out{ending}")
    for given in ({}, {"platform": "bar"}):
        back = load(tmp_path / f"out{ending}", **given)
        assert lines(normal_form(back).mechanism) == lines(normal_form(robot).mechanism)
        assert moving(back) == moving(robot)
        assert mobility(back) == mobility(robot)
        assert back.platform == robot.platform
        assert {j.name for j in back.joints.values() if j.actuated} == {
            j.name for j in robot.joints.values() if j.actuated}
        assert np.allclose(back.links["bar"].pose, robot.links["bar"].pose, atol=1e-12)


@pytest.mark.parametrize("lost", ["1", "2"])
def test_a_closing_frame_without_partner_is_refused_by_name(lost: str, tmp_path: Path):
    text = FILES["urdf: onshape"]["robot.urdf"].replace(f"closing_d_{lost}", "other")
    line = refused(written(tmp_path, {"robot.urdf": text}))
    other = {"1": "2", "2": "1"}[lost]
    assert f"closing frame 'closing_d_{other}' without its partner" in line
    assert f"robot.urdf:{1 + text[:text.index('closing_d_')].count(chr(10))}:" in line


@pytest.mark.parametrize(("types", "told"), [("['planar']", "of type 'planar'"), ("[]", "without a type"),
                                             ("['6d']", None), ("['3D']", None)])
def test_the_type_of_a_closure_is_never_guessed_in_silence(types: str, told: str | None, tmp_path: Path):
    files = dict(FILES["gepetto: 3d" if told is None and "3" in types else "gepetto: 6d"])
    settings = next(name for name in files if name.endswith(".yaml"))
    files[settings] = files[settings].replace("['3d']", types).replace("['6d']", types)
    notes = [note.text for note in load(written(tmp_path, files)).notes if "is read as rigid" in note.text]
    assert len(notes) == (told is not None)
    assert told is None or told in notes[0]


@pytest.mark.parametrize("types", ["[3]", "['6d', '6d']", "[[6d]]"])
def test_what_is_no_type_of_a_closure_is_refused(types: str, tmp_path: Path):
    files = dict(FILES["gepetto: 6d"])
    settings = next(name for name in files if name.endswith(".yaml"))
    files[settings] = files[settings].replace("['6d']", types)
    assert "type: " in refused(written(tmp_path, files))
