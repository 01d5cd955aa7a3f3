"""Kinds of files that people have: namespaces, names of types, motors of controllers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from description.foreign.examples import FILES, MJCF, MOTOR, SDF, C, X, along, at, ends, rpy, urdf
from description.foreign.test_closures import read
from description.foreign.test_dialects import mobility, written
from description.foreign.test_traps import bars, origin
from hrsynth import check
from hrsynth.description import load, native, save
from hrsynth.description.overrides import Overrides
from hrsynth.errors import BadMechanism, BadRequest, BadRobotFile, LoopClosureFailure

KINDS = ("fixed", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar")


@pytest.mark.some(6)
@pytest.mark.parametrize("name", [name for name, files in FILES.items() if all("<" in text for text in files.values())])
def test_a_default_namespace_changes_nothing(name: str, tmp_path: Path):
    plain = load(written(tmp_path, FILES[name]), platform="bar")
    files = dict(FILES[name])
    first = next(iter(files))
    start = next(tag for tag in ("<robot", "<sdf", "<mujoco") if tag in files[first])
    files[first] = files[first].replace(start, f'{start} xmlns="http://drake.mit.edu"', 1)
    robot = load(written(tmp_path, files), platform="bar")
    assert robot.differences(plain) == []
    assert all("xmlns" not in text for link in robot.links.values() for text in link.xml)


@pytest.mark.parametrize("ending", ["", "_joint", "_constraint"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_constraint_has_the_type_that_its_name_says(kind: str, ending: str, tmp_path: Path):
    second = "1 0 0" if kind == "universal" else "0 1 0"
    origins = {link: f'xyz="{at(link, C)}" rpy="{rpy(X[link][:3, :3].T)}"' for link in ("rocker", "bar")}
    sides = "".join(
        f'<{side} link="{link}"/><{side}_origin {origins[link]}/><{side}_axis xyz="{axis}"/>'
        for side, link, axis in (("parent", "rocker", "0 1 0"), ("child", "bar", second))
    )
    constraint = f'<constraint name="d" type="{kind}{ending}">{sides}</constraint>'
    loop = (
        f'<loop name="d" type="{kind}"><predecessor link="rocker"><origin {origins["rocker"]}/></predecessor>'
        f'<successor link="bar"><origin {origins["bar"]}/></successor><axis xyz="0 1 0"/><axis2 xyz="{second}"/></loop>'
    )
    robots = [read(tmp_path, urdf(text), platform="bar") for text in (constraint, loop)]
    assert mobility(robots[0]) == mobility(robots[1])
    assert robots[0].joints["d"].type is robots[1].joints["d"].type


CONTROL = (
    '<ros2_control name="c" type="system"><hardware><plugin>p/S</plugin></hardware>{}<sensor name="s"/></ros2_control>'
)


@given(st.sets(st.sampled_from("abc")), st.none() | st.sets(st.sampled_from("abc"), min_size=1))
def test_command_interfaces_are_motors_also_in_the_file_that_is_written(driven: set[str], wanted: set[str] | None):
    """Joint names that the file does not have, and state interfaces, are no motors."""
    command = '<command_interface name="position"/>'
    text = "".join(
        f'<joint name="{name}">{command * (name in driven | {"x"})}<state_interface name="position"/></joint>'
        for name in "abcx"
    )
    closure = f'<loop name="d" type="spherical">{ends("predecessor", "rocker")}{ends("successor", "bar")}</loop>'
    file = urdf(closure + CONTROL.format(text)).replace(MOTOR, "")
    robot = load(file, platform="bar", motors=None if wanted is None else sorted(wanted))
    assert {joint.name for joint in robot.joints.values() if joint.is_actuated} == (
        driven if wanted is None else wanted
    )
    again = load(native.write(robot))
    assert again.differences(robot) == []
    assert "<sensor" in native.write(again)


def test_a_follower_with_a_command_interface_is_no_motor():
    mimic = '<joint name="c" type="continuous"><mimic joint="a"/>'
    text = "".join(f'<joint name="{name}"><command_interface name="position"/></joint>' for name in "ac")
    file = urdf(CONTROL.format(text)).replace(MOTOR, "").replace('<joint name="c" type="continuous">', mimic)
    robot = load(file, platform="bar")
    assert [joint.name for joint in robot.joints.values() if joint.is_actuated] == ["a"]


def commas(text: str) -> str:
    return text.replace(" ", ",")


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("kind", ["revolute", "cylindrical"])
def test_an_axis_is_given_in_the_frame_of_the_first_link(kind: str, second: bool):
    """The frames of both links are tilted, so neither z axis is the hinge; the second axis may be given too."""
    axes = "/".join(commas(along(link)) for link in ("rocker", "bar")[: 1 + second])
    closure = f"rocker@{commas(at('rocker', C))}:bar@{commas(at('bar', C))}:{kind}/{axes}"
    robot = load(urdf(""), platform="bar", close=closure)
    loop = f'<loop name="d" type="{kind}">{ends("predecessor", "rocker")}{ends("successor", "bar")}'
    turned = loop.replace('"/></successor>', f'" rpy="{rpy(X["bar"][:3, :3].T @ X["rocker"][:3, :3])}"/></successor>')
    meant = load(urdf(f'{turned}<axis xyz="{along("rocker")}"/></loop>'), platform="bar")
    assert mobility(robot) == mobility(meant)
    one, two = (next(each for each in each.joints.values() if not each.in_tree) for each in (robot, meant))
    assert one.type is two.type
    assert abs(one.axis @ two.axis) == pytest.approx(1)
    assert one.point == pytest.approx(two.point)


def test_a_universal_closure_has_an_axis_in_each_frame():
    closure = f"rocker@{commas(at('rocker', C))}:bar@{commas(at('bar', C))}:universal"
    axes = commas(along("rocker")), commas(along("bar", [1, 0, 0]))
    robot = load(urdf(""), platform="bar", close=f"{closure}/{axes[0]}/{axes[1]}")
    joint = next(joint for joint in robot.joints.values() if not joint.in_tree)
    assert [abs(axis @ each) for axis, each in zip(joint.axes, ([0, 1, 0], [1, 0, 0]), strict=True)] == pytest.approx(
        [1, 1]
    )


@pytest.mark.parametrize(
    ("end", "asked"),
    [
        (":revolute", "revolute/x,y,z, the axis in rocker's frame"),
        (":planar/0,0,1/0,0,1/0,0,1", "planar/x,y,z"),
        (":universal/0,0,1", "universal/x,y,z/x,y,z, an axis in each frame"),
        (":fixed/0,0,1", "no axis for this type"),
        (":revolute/0,0,0", "a non-zero vector"),
        (":revolute/0,0", "TYPE/x,y,z"),
    ],
)
def test_an_axis_that_is_missing_or_wrong_is_asked_for(end: str, asked: str):
    with pytest.raises(BadRequest, match=re.escape(asked)):
        load(urdf(""), platform="bar", close=f"rocker:bar{end}")


WELD = "<drake:weld_constraint><parent>one</parent><child>two</child></drake:weld_constraint>"


def framed_sdf(closure: str) -> str:
    """The four-bar without its loop, its last pin on a link of its own, and frames in which that link is welded."""
    frames = "".join(
        f'<frame name="{name}" attached_to="{link}"><pose>{at(link, C)} {rpy(X[link][:3, :3].T)}</pose></frame>'
        for name, link in (("one", "rocker"), ("two", "bar"))
    )
    text = SDF["1.7"]
    start = text.index('<joint name="d"')
    text = text[:start] + text[text.index("</joint>", start) + 8 :]
    return text.replace("</model>", frames + closure + "</model>")


@pytest.mark.parametrize("unit", [None, "mm"])
def test_frames_of_sdformat_are_ends_of_closures(unit: str | None):
    robot = load(framed_sdf(""), platform="bar", close="one:two:revolute/0,1,0", unit=unit)
    assert mobility(robot) == 1
    assert mobility(load(framed_sdf(""), platform="bar", close="one@0.1,0,0:two@0.1,0,0:fixed", unit=unit)) == 0
    with pytest.raises(BadRequest, match=r"no such link or frame: got 'tow', expected two"):
        load(framed_sdf(""), close="one:tow")


def test_a_weld_of_drake_is_read_and_advice_on_others_can_be_typed():
    assert mobility(load(framed_sdf(WELD), platform="bar")) == 0
    robot = load(framed_sdf(WELD.replace("weld", "distance")), platform="bar")
    (said,) = (word for note in robot.notes for word in re.findall(r"--close (\S+)", note.text) if "one" in word)
    assert mobility(load(framed_sdf(""), platform="bar", close=said)) == 0


POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:0f4c\nsize 48211\n"
PAGES = (
    "\n<!DOCTYPE html>\n<html><head><title>robot.urdf</title>",
    '<?xml version="1.0"?>\n<!-- a page -->\n<html xmlns="http://www.w3.org/1999/xhtml"><p>',
    "\ufeff<HTML>",
)


@pytest.mark.parametrize("text", [POINTER, *PAGES])
@pytest.mark.parametrize("ending", ["urdf", "sdf", "xml", "usd", "usda", "usdc", "yaml", "xacro"])
def test_what_is_downloaded_instead_of_a_file_is_said(ending: str, text: str, tmp_path: Path):
    path = tmp_path / f"robot.{ending}"
    path.write_text(text)
    with pytest.raises(BadRobotFile, match="git lfs pull" if text == POINTER else "a web page") as error:
        load(path)
    (line,) = error.value.lines()
    assert line.startswith(str(path))


def model_of(name: str) -> str:
    """The four-bar's model, without the document around it, under another name."""
    return re.sub(r'<model name="\w+"', f'<model name="{name}"', SDF["1.7"][SDF["1.7"].index("<model") :]).rpartition(
        "</sdf>"
    )[0]


def world(*models: str) -> str:
    return f'<sdf version="1.7"><world name="w">{"".join(models)}</world></sdf>'


TABLE = '<model name="table"><static>true</static><link name="top"/></model>'


def test_one_of_several_models_is_chosen_by_its_name(tmp_path: Path):
    text = world(model_of("left"), TABLE, model_of("right"))
    with pytest.raises(
        BadRobotFile, match=r"several models with joints: got left, right, expected one \(--model NAME\)"
    ):
        load(text)
    with pytest.raises(BadRequest, match=r"no such model: got 'rigt', expected right"):
        load(text, model="rigt")
    robot = load(text, model="right", platform="bar")
    alone = load(world(model_of("right")), platform="bar")
    assert robot.name == "right"
    assert robot.differences(alone) == []
    assert [note.text for note in robot.notes if "models" in note.text] == ["2 other models in the file: left, table"]
    with pytest.raises(BadRequest, match="only SDFormat files hold several models"):
        load(FILES["urdf: urdf+"]["robot.urdf"], model="right")


@pytest.mark.parametrize("uri", ["model://arm", "arm", "arm/model.sdf", "file://arm/model.sdf"])
def test_an_included_model_is_read_in_the_folder_of_the_file(uri: str, tmp_path: Path):
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "model.sdf").write_text(SDF["1.7"])
    main = tmp_path / "world.sdf"
    include = "<include><uri>{}</uri><name>{}</name></include>"
    main.write_text(world(include.format(uri, "here"), include.format("model://sun", "sun")))
    robot = load(main, platform="bar")
    assert robot.differences(load(SDF["1.7"].replace("four_bar", "here"), platform="bar")) == []
    assert any("model://sun" in note.text and str(tmp_path) in note.text for note in robot.notes)
    (tmp_path / "arm" / "model.sdf").rename(tmp_path.parent / "outside.sdf")
    for outside in (f"{uri}", "../outside.sdf", str(tmp_path.parent / "outside.sdf")):
        main.write_text(world(include.format(outside, "here")))
        with pytest.raises(BadRobotFile, match=f"model not found: got .*{re.escape(str(tmp_path))}, where it was"):
            load(main)


def test_models_that_include_themselves_end(tmp_path: Path):
    inner = '<sdf version="1.7"><model name="m"><link name="a"/><include><uri>m.sdf</uri></include></model></sdf>'
    (tmp_path / "m.sdf").write_text(inner)
    with pytest.raises(BadRobotFile, match="too many <include>"):
        load(tmp_path / "m.sdf")


BOX = '<body name="{0}" pos="1 1 0"><freejoint name="f{0}"/><geom type="box" size="1 1 1"/></body>'


@given(st.integers(0, 3), st.booleans())
def test_loose_bodies_beside_a_robot_are_left_out_and_told(count: int, floats: bool):
    """Their six freedoms each are none of the robot's, whether it stands or floats."""
    boxes = "".join(BOX.format(f"box{k}") for k in range(count))
    text = MJCF["connect"]
    if floats:
        text = re.sub(r"(<body name=\"base\"[^>]*>)", r"\1<freejoint/>", text)
    robot = load(text.replace("</worldbody>", boxes + "</worldbody>"), platform="bar")
    assert mobility(robot) == mobility(load(text, platform="bar"))
    told = [note.text for note in robot.notes if "loose bodies" in note.text]
    assert len(told) == bool(count)
    assert all(f"box{k}" in told[0] for k in range(count))
    if count:
        scene = load(text.replace("</worldbody>", boxes + "</worldbody>"), platform="box0")
        assert "box0" in scene.links


def opened_bars(size: float, posture: str = "") -> str:
    """Three bars of one size in a row on the x axis, and a frame at the end that the base cannot reach."""
    rows = [("p", "one", "base", origin(0)), ("q", "two", "one", origin(size)), ("r", "tip", "two", origin(size))]
    return bars(rows, posture)


@pytest.mark.parametrize(
    ("size", "point", "remedy"),
    [
        (0.1, 2000.0, r"Points of --close are in metres: one is 2e\+03 m from the frame of 'base'"),
        (100.0, 500.0, "Use --unit mm if the file is in millimetres"),
        (0.3, 0.9, "Correct the ends given with --close"),
    ],
)
def test_a_loop_that_stays_open_is_told_in_metres_with_a_remedy(size: float, point: float, remedy: str):
    """The tip reaches 2 sizes (and its own offset of none), so the least opening is what remains to the point."""
    with pytest.raises(LoopClosureFailure, match=remedy) as error:
        load(opened_bars(size), platform="tip", close=f"tip:base@{point},0,0")
    said = re.search(r"is open by (\S+) m between 'tip' and 'base'", str(error.value))
    assert said is not None
    assert float(said[1]) == pytest.approx(point - 2 * size, rel=1e-2)
    assert "keyframe" not in str(error.value)


def test_a_keyframe_is_proposed_where_there_is_one(tmp_path: Path):
    (tmp_path / "robot.urdf").write_text(opened_bars(0.3))
    (tmp_path / "robot.srdf").write_text('<robot name="bars"><group_state name="bent" group="all"/></robot>')
    with pytest.raises(LoopClosureFailure, match="--keyframe bent"):
        load(tmp_path / "robot.urdf", platform="tip", close="tip:base@0.9,0,0")


@pytest.mark.parametrize("masses", [{}, {"crank": 2.0}, {"crank": 2.0, "bar": 0.0004}])
def test_mass_that_mujoco_adds_is_told(masses: dict[str, float], tmp_path: Path):
    """MuJoCo's own sum of masses is that of the file and what the note says; without any mass nothing is told."""
    text = next(iter(FILES["urdf: urdf+"].values()))
    for link, mass in masses.items():
        inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        text = text.replace(
            f'<link name="{link}"/>', f'<link name="{link}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'
        )
    told = [note.text for note in save(load(text, platform="bar"), tmp_path / "out.xml") if "boundmass" in note.text]
    assert len(told) == bool(masses)
    if masses:
        mujoco = pytest.importorskip("mujoco")
        model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
        (added,) = re.findall(r"(\S+) kg are added", told[0])
        assert sum(model.body_mass) == pytest.approx(sum(masses.values()) + float(added), rel=1e-3)


def test_a_tolerance_of_numpy_is_printed_as_a_number():
    assert Overrides(tolerance=np.float64(1e-3)).words == ("--tolerance", "0.001")


SCREW_JOINT = (
    '<joint name="{}" type="{}"><parent>{}</parent><child>{}</child><axis><xyz>0 0 1</xyz></axis>'
    "<thread_pitch>-500</thread_pitch></joint>"
)
SCREW_LOOP = {
    "turn": SCREW_JOINT.format("turn", "revolute", "frame", "spindle"),
    "guide": SCREW_JOINT.format("guide", "prismatic", "frame", "nut"),
    "thread": SCREW_JOINT.format("thread", "screw", "spindle", "nut"),
}


def test_a_screw_that_closes_a_loop_is_refused_with_a_remedy_that_holds(tmp_path: Path):
    """Turn and slide of a spindle and its nut: two coordinates, one condition."""
    path = tmp_path / "robot.sdf"

    def write(*order: str) -> None:
        links = '<link name="frame"/><link name="spindle"/><link name="nut"/>'
        parts = links + "".join(map(SCREW_LOOP.__getitem__, ("turn", *order)))
        path.write_text(f'<sdf version="1.6"><model name="m">{parts}</model></sdf>')

    write("guide", "thread")
    with pytest.raises(BadMechanism, match="'thread__thread' of a joint that closes a loop, not supported") as error:
        load(path, platform="nut")
    assert "before another joint of its loop" in error.value.lines()[0]
    write("thread", "guide")
    assert check(load(path, platform="nut")).mobility.total == 1


@pytest.mark.parametrize("name", ["b", "c"])
def test_links_that_gazebo_adds_are_refused_where_a_joint_needs_them(name: str, tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(
        '<robot name="r"><link name="base"/><link name="a"/>\n<joint name="j" type="continuous"><parent link="base"/>'
        '<child link="a"/></joint>\n<gazebo><link name="b"/><link name="c"/></gazebo><gazebo>\n'
        f'<joint name="k" type="revolute"><parent>a</parent><child>{name}</child></joint></gazebo></robot>'
    )
    with pytest.raises(BadRobotFile) as error:
        load(path)
    (line,) = error.value.lines()
    assert line.startswith(
        f"{path}:4: joint of <gazebo> to a link that <gazebo> adds, which is not supported: got {name}"
    )


@pytest.mark.parametrize("name", ["../part.xml", "../../part.xml", "below/../../part.xml"])
def test_an_include_above_the_model_is_refused_by_its_name(name: str, tmp_path: Path):
    path = tmp_path / "models" / "robot.xml"
    path.parent.mkdir()
    (tmp_path / "part.xml").write_text("<mujoco/>")
    path.write_text(f'<mujoco>\n<include file="{name}"/></mujoco>')
    with pytest.raises(BadRobotFile) as error:
        load(path)
    (line,) = error.value.lines()
    assert line.startswith(f"{path}:2: <include>: outside of the model's folder: got {name}, expected a file beside")
    assert "open a copy" in line
