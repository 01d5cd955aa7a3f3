"""What a foreign file says is not lost or doubled: on the way into any dialect and back, nor told by names alone."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from description.foreign.examples import FILES
from description.foreign.test_dialects import lines, mobility, written
from description.foreign.test_traps import full_mobility
from hrsynth.description import load, save
from hrsynth.errors import BadRobotFile
from hrsynth.geometry.vectors import convert_rpy_to_rotation
from hrsynth.mechanism import Joint, JointType, Link, Mechanism, Motor
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form


def moving(robot: Mechanism) -> list[str]:
    return sorted(str(joint.type) for joint in reduce_to_normal_form(robot).mechanism.joints.values())


def refused(path: Path) -> str:
    with pytest.raises(BadRobotFile) as caught:
        load(path)
    (line,) = caught.value.lines()
    return line


@pytest.mark.some(6)
@pytest.mark.parametrize("ending", [".urdf", ".xml", ".sdf", ".yaml"])
@pytest.mark.parametrize("name", FILES)
def test_any_source_comes_back_the_same_from_any_dialect(name: str, ending: str, tmp_path: Path):
    robot = load(written(tmp_path, FILES[name]), platform="bar")
    save(robot, tmp_path / f"out{ending}")
    for given in ({}, {"platform": "bar"}):
        back = load(tmp_path / f"out{ending}", **given)
        assert lines(reduce_to_normal_form(back).mechanism) == lines(reduce_to_normal_form(robot).mechanism)
        assert moving(back) == moving(robot)
        assert mobility(back) == mobility(robot)
        assert back.platform == robot.platform
        assert {j.name for j in back.joints.values() if j.is_actuated} == {
            j.name for j in robot.joints.values() if j.is_actuated
        }
        assert np.allclose(back.links["bar"].pose, robot.links["bar"].pose, atol=1e-12)


@pytest.mark.parametrize("lost", ["1", "2"])
def test_a_closing_frame_without_partner_is_refused_by_name(lost: str, tmp_path: Path):
    text = FILES["urdf: onshape"]["robot.urdf"].replace(f"closing_d_{lost}", "other")
    line = refused(written(tmp_path, {"robot.urdf": text}))
    other = {"1": "2", "2": "1"}[lost]
    assert f"closing frame 'closing_d_{other}' without its partner" in line
    assert f"robot.urdf:{1 + text[: text.index('closing_d_')].count(chr(10))}:" in line


@pytest.mark.parametrize(
    ("types", "told"),
    [("['planar']", "of type 'planar'"), ("[]", "without a type"), ("['6d']", None), ("['3D']", None)],
)
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


TILT = convert_rpy_to_rotation(0.3, -0.4, 0.5)
SPACE = [["P", "P", "P", "S"], ["P", "P", "P", "R", "R", "R"], ["S", "P", "P", "P"]]


def placed(robot: Mechanism, word: list[str], axes: np.ndarray, driven: bool = False) -> Mechanism:
    """The robot with a chain of joints in front of all others that places its platform."""
    point = robot.links[robot.platform].pose[:3, 3]
    names = [f"place_{k}" for k in range(len(word))]
    links = {name: Link(name, robot.links[robot.platform].pose) for name in names[:-1]}
    ends = [robot.base, *links, robot.platform]
    joints = {
        name: Joint(
            name,
            JointType(kind),
            ends[k],
            ends[k + 1],
            point,
            (axes[k % 3],) * JointType(kind).axes,
            Motor("extra") if driven and k == 0 else None,
        )
        for k, (name, kind) in enumerate(zip(names, word, strict=True))
    }
    return dataclasses.replace(
        robot, links={**robot.links, **links}, joints={**joints, **robot.joints}, observations=()
    )


def foreign(robot: Mechanism, path: Path) -> Path:
    """A file that does not say what our writers add."""
    save(robot, path)
    text = re.sub(
        r"\s*<(text name=.hrsynth_platform|text name=.hrsynth_observe|hrsynth:platform|hrsynth:observe).*",
        "",
        path.read_text(),
    )
    assert "platform_1" not in text
    path.write_text(text)
    return path


def words(robot: Mechanism) -> list[str]:
    normal = reduce_to_normal_form(robot).mechanism
    return sorted(
        "".join(sorted(str(normal.joints[name].type) for name in leg.joints)) for leg in decompose(normal).legs
    )


@pytest.mark.some(1)
@pytest.mark.parametrize("ending", [".xml", ".sdf"])
@pytest.mark.parametrize("word", SPACE, ids="".join)
@pytest.mark.parametrize("name", ["gough_stewart", "3rps"])
def test_a_chain_that_places_the_platform_in_space_is_no_leg(name: str, word: list[str], ending: str, tmp_path: Path):
    robot = load(name)
    back = load(foreign(placed(robot, word, TILT.T), tmp_path / f"robot{ending}"), platform=robot.platform)
    assert words(back) == words(robot)
    assert full_mobility(back) == full_mobility(robot)
    (free,) = [joint for joint in back.joints.values() if joint.type is JointType.FREE]
    assert set(free.links) == {robot.base, robot.platform}
    assert sum("place_0" in note.text and "a free joint" in note.text for note in back.notes) == 1
    save(back, tmp_path / "again.xml")
    assert (tmp_path / "again.xml").read_text().count("<freejoint") == 1
    mujoco = pytest.importorskip("mujoco")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "again.xml")).nv >= 6
    for ending_again in (".xml", ".sdf", ".urdf", ".yaml"):
        save(back, tmp_path / f"again{ending_again}", None)
        again = load(tmp_path / f"again{ending_again}")
        assert words(again) == words(robot)
        assert again.base == robot.base
        assert full_mobility(again) == full_mobility(robot)
        for leftover in tmp_path.glob("again*"):
            leftover.unlink()


@pytest.mark.parametrize("word", [["P", "P", "R"], ["R", "P", "P"]], ids="".join)
@pytest.mark.parametrize("ending", [".xml", ".sdf"])
def test_a_chain_that_places_the_platform_in_its_plane_is_no_leg(ending: str, word: list[str], tmp_path: Path):
    robot = load("3rrr_m1")
    axes = np.eye(3) if word[0] == "P" else np.roll(np.eye(3), 1, axis=0)
    back = load(foreign(placed(robot, word, axes), tmp_path / f"robot{ending}"), platform=robot.platform)
    assert words(back) == words(robot)
    assert not {f"place_{k}" for k in range(3)} & {*back.joints, *back.links}
    assert sum("read as no leg" in note.text for note in back.notes) == 1


@pytest.mark.parametrize(
    ("name", "word", "driven"),
    [("3rps", "PPR", False), ("gough_stewart", "PPPS", True), ("gough_stewart", "PPR", False)],
)
def test_a_chain_that_is_driven_or_forbids_something_stays_a_leg(name: str, word: str, driven: bool, tmp_path: Path):
    robot = load(name)
    chain = placed(robot, list(word), np.eye(3), driven)
    back = load(foreign(chain, tmp_path / "robot.xml"), platform=robot.platform)
    assert {f"place_{k}" for k in range(len(word))} <= set(back.joints)
    assert not any("place_0" in note.text for note in back.notes if note.kind == "merged")


def test_legs_that_would_be_coordinates_alone_stay_legs(tmp_path: Path):
    robot = load("3rrr_m1")
    chain = placed(robot, ["P", "P", "R"], np.eye(3))
    two = {
        name.replace("place", "other"): dataclasses.replace(
            joint,
            name=name.replace("place", "other"),
            predecessor=joint.predecessor.replace("place", "other"),
            successor=joint.successor.replace("place", "other"),
        )
        for name, joint in chain.joints.items()
        if "place" in name
    }
    links = {f"other_{k}": Link(f"other_{k}", chain.links[f"place_{k}"].pose) for k in (0, 1)}
    both = chain.changed(joints=two.values(), links=links.values())
    back = load(foreign(both, tmp_path / "robot.xml"), platform=robot.platform)
    assert {"place_0", "other_0"} <= set(back.joints)


MESSAGES = {
    "ring": (
        "urdf",
        "<robot name='r'><link name='o'/><link name='a'/><link name='b'/>\n"
        "<joint name='j1' type='continuous'><parent link='a'/><child link='b'/></joint>\n"
        "<joint name='j2' type='continuous'><parent link='b'/><child link='a'/></joint></robot>",
        ["robot.urdf:3: joints that form a cycle: got j2, j1, expected a tree"],
    ),
    "gearbox": (
        "urdf",
        FILES["urdf: gazebo"]["robot.urdf"].replace(
            "</robot>",
            "<gazebo><joint name='g' type='gearbox'><parent>rocker</parent><child>bar</child></joint></gazebo></robot>",
        ),
        ["gearbox 'g': one revolute joint from its reference body: got "],
    ),
    "second link": (
        "urdf",
        "<robot name='r'><link name='a'/><link name='a'/>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint></robot>",
        ["robot.urdf:1: second link of the same name: got a"],
    ),
    "second body": (
        "xml",
        "<mujoco><worldbody><body name='a'><joint/><body name='a'><joint/></body></body></worldbody>"
        "<equality><connect body1='b' body2='a' anchor='0 0 0'/></equality></mujoco>",
        ["robot.xml:1: second body of the same name: got a"],
    ),
    "ring of frames": (
        "sdf",
        "<sdf version='1.9'><model name='m'><link name='a'><pose relative_to='b'/></link>"
        "<link name='b'><pose relative_to='a'/></link><joint name='j' type='ball'><parent>a</parent>"
        "<child>b</child></joint></model></sdf>",
        None,
    ),
    **{
        f"version {number}": (
            "sdf",
            FILES["sdf: 1.7"]["robot.sdf"].replace('"1.7"', f'"{number}"'),
            [f"version of <sdf>: got {number}, expected 1.4 to 1.12"],
        )
        for number in ("1.13", "9.9", "1.3", "abc")
    },
}


@pytest.mark.parametrize("name", MESSAGES)
def test_what_is_wrong_is_said_once_and_in_the_words_of_the_file(name: str, tmp_path: Path):
    ending, text, expected = MESSAGES[name]
    with pytest.raises(BadRobotFile) as caught:
        load(written(tmp_path, {f"robot.{ending}": text}))
    found = caught.value.lines()
    assert len(set(found)) == len(found)
    assert not any("None" in line or "\\n" in line for line in found)
    if expected is not None:
        assert len(found) == len(expected)
        assert all(words in line for words, line in zip(expected, found, strict=True))


def test_a_defect_of_an_included_file_is_told_with_that_file(tmp_path: Path):
    (tmp_path / "parts.xml").write_text(
        "<mujocoinclude>\n<equality>\n<connect body1='nix' body2='a' anchor='0 0 0'/></equality></mujocoinclude>"
    )
    main = "<mujoco><worldbody><body name='a'><joint/></body></worldbody>\n<include file='{}'/></mujoco>"
    assert refused(written(tmp_path, {"robot.xml": main.format("parts.xml")})).startswith(
        f"{tmp_path / 'parts.xml'}:3: connect of an unknown body: got nix"
    )
    line = refused(written(tmp_path, {"robot.xml": main.format("none.xml")}))
    assert line.startswith(f"{tmp_path / 'robot.xml'}:2: <include>: no such file: got none.xml")
    (tmp_path / "parts.xml").write_text("<mujocoinclude>\n<include file='none.xml'/></mujocoinclude>")
    assert refused(written(tmp_path, {"robot.xml": main.format("parts.xml")})).startswith(
        f"{tmp_path / 'parts.xml'}:2: <include>: no such file"
    )
