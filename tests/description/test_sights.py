"""Cameras and observations of all kinds in files and on the command line: read, written and read again, or refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.cli import run_command
from hrsynth.description import build_spanning_mechanism, load, native, save
from hrsynth.description.observation_text import add_observations, parse_camera, parse_sensor
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.geometry.vectors import build_pose
from hrsynth.mechanism.cameras import CameraObservation, NamedCamera
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.observations import list_kinds
from hrsynth.mechanism.observations.encoder import Encoder
from strategies import random_direction, random_rotation

PAGE = Path(__file__).resolve().parents[2] / "docs" / "pages" / "robot_file.md"
BODY = """<robot name="body">
  <link name="base"/> <link name="object"/>
  <joint name="free" type="floating"> <parent link="base"/> <child link="object"/> <origin xyz="0.1 0.2 1"/> </joint>
  <hrsynth> <platform link="object"/>
    <camera name="eye" link="base"> <origin xyz="0.1 0 0" rpy="0.1 0 0"/> <image focal="800" width="640"/> </camera>
    OBSERVE
  </hrsynth>
</robot>"""
SEEDS = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def seeing_all(robot: str, rng: np.random.Generator) -> Mechanism:
    """A shipped robot with two cameras, and an observation of every kind by one or the other."""
    mechanism = load(robot)
    links = [link for link in mechanism.links if link != mechanism.base]
    cameras = [
        NamedCamera("eye", mechanism.base, build_pose(rng.normal(size=3), random_rotation(rng)), 812.5, 640),
        NamedCamera("the hand", mechanism.platform, build_pose(rng.normal(size=3), random_rotation(rng))),
    ]
    joint = next(joint.name for joint in mechanism.joints.values() if joint.type in ("R", "P"))
    specs = []
    for word, kind in list_kinds().items():
        if kind is Encoder:
            specs.append(parse_sensor(f"encoder:{joint}", ["eye"]))
            continue
        text = f"eye={word}:{rng.choice(links)}" if word != "inclination" else f"{word}:{mechanism.platform}"
        for name, vector in (("at", rng.normal(size=3)), ("axis", random_direction(rng))):
            if name in kind.needs:
                text += ("@" if name == "at" else "/") + ",".join(map(repr, vector.tolist()))
        specs.append(parse_sensor(text + f"/{'-' * (word == 'edge')}0.02" * ("radius" in kind.needs), []))
    seen = replace(specs[0], camera="the hand", link=mechanism.base, leg="seen by the hand")
    return add_observations(mechanism, [*specs, seen], cameras)


@pytest.mark.parametrize("robot", ["gough_stewart", "delta", "3rrr_m1"])
@settings(max_examples=5, deadline=None)
@given(rng=SEEDS)
def test_every_kind_is_written_and_read_again(robot: str, rng: np.random.Generator) -> None:
    mechanism = seeing_all(robot, rng)
    text = native.write(mechanism)
    read = native.parse(text)
    assert read.differences(build_spanning_mechanism(mechanism)) == []
    assert len(read.observations) == len(load(robot).observations) + 14
    assert native.write(read) == text


@pytest.mark.some(3)
@pytest.mark.parametrize("ending", ["xml", "sdf", "yaml", "usda"])
@pytest.mark.parametrize("robot", ["gough_stewart", "3rrr_m1"])
def test_every_kind_survives_in_other_dialects(robot: str, ending: str, tmp_path: Path) -> None:
    """The values at zero are the same; links are where they were."""
    if ending == "usda":
        pytest.importorskip("pxr")
    mechanism = seeing_all(robot, np.random.default_rng(2))
    save(mechanism, tmp_path / f"robot.{ending}")
    read = load(tmp_path / f"robot.{ending}")
    assert [(o.kind, o.leg) for o in read.observations] == [(o.kind, o.leg) for o in mechanism.observations]
    assert [camera.name for camera in read.cameras] == ["eye", "the hand"]
    for mine, theirs in zip(mechanism.observations, read.observations, strict=True):
        values = [
            o.value(robot.links[o.seen_from or robot.reference].pose, robot.links[o.link].pose)
            for o, robot in ((mine, mechanism), (theirs, read))
        ]
        np.testing.assert_allclose(values[1], values[0], atol=1e-9)


def test_the_normal_form_sees_the_same() -> None:
    mechanism = seeing_all("delta", np.random.default_rng(3))
    normal = reduce_to_normal_form(mechanism).mechanism
    for mine, theirs in zip(mechanism.observations, normal.observations, strict=True):
        values = [
            o.value(robot.links[o.seen_from or robot.reference].pose, robot.links[o.link].pose)
            for o, robot in ((mine, mechanism), (theirs, normal))
        ]
        np.testing.assert_allclose(values[1], values[0], atol=1e-12)


WRONG = [
    ('<observe kind="pint" link="object" at="0 0 0"/>', "unknown kind of observation: got pint, expected circle"),
    ('<observe kind="point" link="object"/>', "observe point without the attribute: got at"),
    ('<observe kind="point" link="thing" at="0 0 0"/>', "observe point: unknown link: got thing, expected base, ob"),
    ('<observe kind="point" link="object" at="0 0"/>', "observe point: at: got 0 0, expected 3 numbers"),
    ('<observe kind="point" link="object" at="0 0 nan"/>', "observe point: at: got 0 0 nan, expected finite"),
    ('<observe kind="point" camera="ear" link="object" at="0 0 0"/>', "unknown camera: got ear, expected eye"),
    ('<observe kind="point" camera="eye" link="base" at="0 0 0"/>', "the camera is on the same link: got base"),
    ('<observe kind="line" link="object" at="0 0 0" axis="0 0 0"/>', "axis: got 0 0 0, expected a non-zero vector"),
    ('<observe kind="edge" link="object" at="0 0 0" axis="0 0 1" radius="0"/>', "radius .m.: got 0.0"),
    ('<observe kind="edges" link="object" at="0 0 0" axis="0 0 1" radius="-1"/>', "got -1.0, expected more than 0"),
    ('<observe kind="inclination" link="base"/>', "the base does not move: got base"),
    ('<observe kind="encoder" joint="gear"/>', "unknown joint: got gear, expected free"),
    ('<observe kind="encoder" joint="free"/>', "type of joint 'free': got free, expected one with one axis"),
    ('<observe kind="direction" camera="eye" link="object"/>', "observe direction without the attribute: got axis"),
    (
        '<observe kind="point" link="object" at="0 0 0" radius="0.1"/>',
        "observe point does not use this attribute: got radius, expected link, at",
    ),
    (
        '<observe kind="encoder" joint="free" link="object"/>',
        "observe encoder does not use this attribute: got link, expected joint",
    ),
    ('<camera name="eye" link="object"/>', "camera name already used: got eye"),
    ('<camera name="ear" link="thing"/>', "camera 'ear': unknown link: got thing"),
    ('<camera name="ear" link="base"> <image focal="-1"/> </camera>', "focal of <image>: got -1, expected more"),
    ('<observe kind="point" leg="a,b" link="object" at="0 0 0"/>', "label not usable in a list: got a,b"),
    (2 * '<observe kind="point" leg="a" link="object" at="0 0 0"/>', "label already used: got a"),
]


@pytest.mark.parametrize(("line", "said"), WRONG)
def test_what_is_wrong_in_a_file_is_said_in_its_line(line: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "body.urdf"
    file.write_text(BODY.replace("OBSERVE", line))
    with pytest.raises(BadRobotFile, match=f"^{re.escape(str(file))}:6: .*{said}"):
        load(file)


ASKED_WRONG = [
    (["--sensor", "point"], "--sensor: got 'point', expected "),
    (["--sensor", "point:platform"], "point on the link"),
    (["--sensor", "point:platform@1,2"], "observe point: at: got '1 2', expected 3 numbers"),
    (["--sensor", "point:thing@1,2,3"], "unknown link: got 'thing', expected base"),
    (["--sensor", "=point:platform@1,2,3"], "--sensor =point:platform@1,2,3: the camera's name: got ''"),
    (["--sensor", "point:platform@1,2,3,"], "an empty number: got '1,2,3,'"),
    (
        ["--sensor", "line:platform@1,2,3/0,0,0"],
        "--sensor line:platform@1,2,3/0,0,0: observe line: axis: got '0 0 0'",
    ),
    (
        ["--sensor", "direction:platform/0,0,0"],
        "--sensor direction:platform/0,0,0: observe direction: axis: got '0 0 0'",
    ),
    (["--sensor", "image_circle:platform@1,2,3/0,0,1/-1"], "radius (m): got -1.0, expected more than 0"),
    (["--camera", "eye=base@0,0,0,"], "--camera eye=base@0,0,0,: an empty number"),
    (
        ["--camera", "eye=base@0,0,0"],
        "--camera eye: no observation uses this camera of gough_stewart. Add --sensor eye=",
    ),
    (
        ["--camera", "eye=base", "--camera", "far=base", "--sensor", "eye=point:platform@1,2,3"],
        "--camera far: no observation uses this camera of gough_stewart. Add --sensor far=",
    ),
    (["--sensor", "line:platform@1,2,3"], "without the attribute: got 'axis'"),
    (["--sensor", "point:platform@1,2,3/0,0,1"], "too many values for this kind: got '0,0,1', expected at"),
    (
        ["--sensor", "direction:platform@0,0,0/1,0,0"],
        "kind direction has no point: got '0,0,0', expected direction:LINK/dx,dy,dz",
    ),
    (["--sensor", "encoder:shoulder_1@0,0,0"], "kind encoder has no point: got '0,0,0'"),
    (["--sensor", "ear=point:platform@1,2,3"], "unknown camera: got 'ear', expected a camera declared with"),
    (["--camera", "a=base", "--camera", "a=rod_1", "--sensor", "point:platform@1,2,3"], "camera name already used"),
    (
        ["--camera", "a=base", "--camera", "b=rod_1", "--sensor", "point:platform@1,2,3"],
        "no camera named: expected a=po",
    ),
    (
        ["--camera", "a=base@1,2", "--sensor", "point:platform@1,2,3"],
        "--camera a=base@1,2: got '1,2', expected 3 num",
    ),
    (["--camera", "a=base@1deg,2,3", "--sensor", "point:platform@1,2,3"], "got '1deg,2,3', expected metres"),
    (["--camera", "a=base@1,2,3/1,2,3/4/5", "--sensor", "point:platform@1,2,3"], "got 'a=base@1,2,3/1,2,3/4/5'"),
    (
        ["--camera", "a=base@1,2,3/1,2,3/4,5", "--sensor", "point:platform@1,2,3"],
        "got '4,5', expected the focal length",
    ),
    (
        ["--camera", "a=base@1,2,3/1,2,3/-4", "--sensor", "point:platform@1,2,3"],
        "got '-4', expected the focal length",
    ),
    (
        ["--camera", "nowhere", "--sensor", "point:platform@1,2,3"],
        "--camera: link of gough_stewart: got 'nowhere', expected base",
    ),
]


@pytest.mark.parametrize(("words", "said"), ASKED_WRONG)
def test_what_is_wrong_on_the_command_line_is_one_line(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["legs", "gough_stewart", *words]) == 2
    told = capsys.readouterr().err
    assert told.startswith("hrsynth: ")
    assert told.count("\n") == 1
    assert said in told


@pytest.mark.parametrize("command", ["servo"])
def test_commands_that_know_segments_only_say_so(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(add_observations(load("delta"), [parse_sensor("point:platform@0,0,0.1", [])]), tmp_path / "delta.urdf")
    words = ["--start", "x=0", "--goal", "x=0.01", "--dynamics"]
    assert run_command([command, str(tmp_path / "delta.urdf"), *words]) == 2
    assert "supports directions of segments only: got 'observation point_1 (point)'" in capsys.readouterr().err


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "words",
    [
        "aspects",
        "path --start x=0 --goal x=0.01",
        "accuracy --noise 0.1deg,1mm",
        "derive",
        "select --start x=0 --goal x=0.01 --noise 0.1deg,1mm --runs 0",
    ],
)
def test_commands_read_what_a_file_observes(words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sights = [parse_sensor(text, ["eye"]) for text in ("point:platform@0,0,0.1", "distance:platform@0,0,0.1")]
    below = parse_camera("eye=base@0,0,0/180deg,0,0")
    save(add_observations(load("delta"), sights, [below]), tmp_path / "delta.urdf")
    command, *more = words.split()
    assert run_command([command, str(tmp_path / "delta.urdf"), *more, "--json"]) == 0
    assert '"kind": "point"' in (told := capsys.readouterr().out) or command == "select"
    assert "distance_1" in told


def test_the_command_line_and_python_see_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    sensor = ["point:platform@0.1,0,0", "hand=point:world@0,0,-1", "direction:rod_1/0,0,1", "encoder:slide_1"]
    cameras = ["eye=base@0.3,0.1,0/10deg,0,0", "hand=platform@0,0,0.1"]
    words = [
        word for name, texts in (("--sensor", sensor), ("--camera", cameras)) for text in texts for word in (name, text)
    ]
    sensor[0] = words[1] = "eye=" + sensor[0]
    assert run_command(["check", "gough_stewart", "--observe", "1", *words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["observed"]
    setup = ObservedRobot.of("gough_stewart", "1", cameras, sensor=sensor)
    assert told == [o.to_dict() for o in setup.observed]
    assert [(each["leg"], each["kind"], each["camera"]) for each in told] == [
        ("1", "direction", None),
        ("point_1", "point", "eye"),
        ("point_2", "point", "hand"),
        ("direction_1", "direction", None),
        ("encoder_1", "encoder", None),
    ]
    point = setup.observed[1]
    assert isinstance(point, CameraObservation)
    assert point.camera is not None
    np.testing.assert_allclose(point.camera.pose, parse_camera(cameras[0]).pose)


@pytest.mark.parametrize("asked", [{"sensor": 5}, {"sensor": [3]}, {"camera": 4}])
def test_what_is_no_text_is_refused(asked: dict[str, Any]) -> None:
    with pytest.raises(BadRequest, match=r"--camera, --sensor: got .*, expected texts such as"):
        ObservedRobot.of("gough_stewart", **asked)


def test_names_with_slashes_and_equals_signs_are_asked_for() -> None:
    """As in MJCF that is put together of parts, arm/link: a slash was taken for the start of an axis."""
    name = "arm/left=1/link"
    for text, link, at, axis in (
        (f"eye=line:{name}@1,2,3/0,0,1", name, (1, 2, 3), (0, 0, 1)),
        (f"point:{name}@1,2,3", name, (1, 2, 3), None),
        (f"eye=direction:{name}/0,0,1", name, None, (0, 0, 1)),
        (f"inclination:{name}", name, None, None),
        (f"inclination:{name}/0,0,1", name, None, (0, 0, 1)),
        (f"encoder:{name}", name, None, None),
    ):
        spec = parse_sensor(text, [])
        assert (spec.link, spec.at, spec.axis, spec.camera) == (link, at, axis, "eye" if "eye" in text else None)


def test_what_a_file_lists_is_watched_and_can_be_chosen(tmp_path: Path) -> None:
    file = tmp_path / "body.urdf"
    points = "\n".join(f'<observe kind="point" camera="eye" link="object" at="{x}"/>' for x in ("1 0 0", "0 1 0"))
    file.write_text(BODY.replace("OBSERVE", points))
    robot = load(file)
    assert [o.leg for o in robot.observations] == ["point_1", "point_2"]
    assert [o.line for o in robot.observations] == [6, 7]
    with pytest.raises(BadRequest, match="world"):
        parse_sensor("hand=point:world", [])


def test_every_element_is_documented() -> None:
    text = PAGE.read_text("utf-8")
    words = [
        "<camera",
        "name=",
        "link=",
        "<origin",
        "<image",
        "focal=",
        "width=",
        "height=",
        "<observe",
        "kind=",
        "camera=",
        "`at`",
        "`axis`",
        "`radius`",
        "`joint`",
        "`leg`",
    ]
    assert [word for word in words if word not in text.replace("at=", "`at`")] == []
    assert {name.rstrip("?") for kind in list_kinds().values() for name in kind.needs} == {
        "at",
        "axis",
        "radius",
        "joint",
    }


def test_the_help_names_every_kind(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["derive", "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert [kind for kind in list_kinds() if kind not in told[told.index("--sensor") :]] == []
