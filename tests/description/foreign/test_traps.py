"""What real files do: rounded numbers, flat and open zero poses, gears, joints cut elsewhere, odd conventions."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from description.foreign.examples import FILES, MJCF, TREE, A, B, C, D, at, ends, mjcf, urdf
from description.foreign.test_dialects import lines, mobility
from hrsynth.analysis.pose_requests import observe
from hrsynth.description import load
from hrsynth.errors import (
    BadMechanism,
    BadRequest,
    LoopClosureFailure,
    RoundingLimitedRank,
    UndecidedRank,
)
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.observations.direction import Direction

CHAIN = '<link name="{1}"/><joint name="{0}" type="{3}"><parent link="{2}"/><child link="{1}"/>{4}</joint>'


def read(folder: Path, text: str, ending: str = "urdf", **given: object) -> Mechanism:
    path = folder / f"robot.{ending}"
    path.write_text(text)
    return load(path, **given)


def bars(lengths: list[tuple[str, str, str, str]], closure: str) -> str:
    """A planar linkage along x at zero: (joint, link, parent, origin and axis), and its closure."""
    return (
        '<robot name="bars"><link name="base"/>'
        + "".join(CHAIN.format(joint, link, parent, "continuous", rest) for joint, link, parent, rest in lengths)
        + closure
        + "</robot>"
    )


def origin(x: float, extra: str = "") -> str:
    return f'<origin xyz="{x} 0 0"{extra}/><axis xyz="0 0 1"/>'


def revolute(pred: str, x: float, succ: str, y: float, rpy: str = "") -> str:
    return (
        f'<loop name="close" type="revolute"><predecessor link="{pred}"><origin xyz="{x} 0 0"/></predecessor>'
        f'<successor link="{succ}"><origin xyz="{y} 0 0"{rpy}/></successor><axis xyz="0 0 1"/></loop>'
    )


def full_mobility(mechanism: Mechanism) -> int:
    """With gears, by the engine."""
    model = PinocchioModel(mechanism)
    return ClosedConfiguration.of(model, model.q0).kernel()[0].shape[1]


def test_a_flat_zero_pose_is_left_and_said(tmp_path: Path):
    flat = bars(
        [("p", "one", "base", origin(0)), ("q", "two", "one", origin(0.5)), ("r", "three", "base", origin(1))],
        revolute("two", 1.0, "three", 0.5),
    )
    robot = read(tmp_path, flat)
    assert mobility(robot) == 1
    assert any("singular (its loops have mobility 2 there, 1 nearby)" in note.text for note in robot.notes)


def test_a_collinear_zero_pose_that_is_open_is_pushed_and_solved(tmp_path: Path):
    lengths = [
        ("p", "one", "base", origin(0)),
        ("q", "two", "one", origin(0.1)),
        ("r", "three", "two", origin(0.2)),
        ("s", "four", "base", origin(0)),
        ("t", "five", "four", origin(0.4)),
    ]
    robot = read(tmp_path, bars(lengths, revolute("three", 0.3, "five", 0.5)))
    assert mobility(robot) == 3
    (solved,) = [note.text for note in robot.notes if note.kind == "solved"]
    assert "after a random push out of a flat configuration" in solved
    assert "p = " in solved


def test_an_open_zero_pose_is_solved_with_its_joints_told(tmp_path: Path):
    moved = TREE.replace('<origin xyz="2.2 0.0 0.0"', '<origin xyz="2.4 0.0 0.0"')
    robot = read(
        tmp_path,
        urdf(
            f'<loop name="d" type="spherical">{ends("predecessor", "rocker")}{ends("successor", "bar")}</loop>'
        ).replace(TREE, moved),
    )
    assert mobility(reduce_to_normal_form(robot).mechanism) == 1
    (told,) = [note.text for note in robot.notes if note.kind == "solved"]
    assert "b = " in told
    assert "a = " not in told, "the motor stays"


def test_what_cannot_be_closed_is_refused(tmp_path: Path):
    far = bars([("p", "one", "base", origin(0)), ("q", "two", "base", origin(9))], revolute("one", 1.0, "two", 1.0))
    with pytest.raises(LoopClosureFailure, match=r"'close' is open by 7 m between 'one' and 'two' at"):
        read(tmp_path, far, platform="two")


def noisy(size: float) -> str:
    """A planar four-bar away from flat poses, whose closing axis is tilted by ``size``."""
    rest = ' rpy="0 0 {}"'.format
    lengths = [
        ("p", "one", "base", origin(0, rest(1.2))),
        ("q", "two", "one", origin(1, rest(-1.2))),
        ("r", "three", "base", origin(2, rest(1.2))),
    ]
    return bars(lengths, revolute("two", 2.0, "three", 1.0, f' rpy="{size} 0 0"'))


@pytest.mark.parametrize("size", [1e-9, 1e-7, 1e-5, 5e-5])
def test_an_overconstrained_loop_with_rounded_numbers_is_read_as_it_is_meant(size: float, tmp_path: Path):
    robot = read(tmp_path, noisy(size))
    assert mobility(robot) == 1
    axes = np.array([joint.axis for joint in robot.joints.values()])
    assert np.max(np.abs(np.cross(axes, axes[0]))) < 1e-12
    if size > 1e-8:
        assert any("rank gap of the loops as written" in note.text for note in robot.notes)


@pytest.mark.some(1)
@pytest.mark.parametrize("size", [3e-4, 1e-2])
def test_more_than_rounding_is_refused(size: float, tmp_path: Path):
    with pytest.raises((LoopClosureFailure, UndecidedRank)) as caught:
        read(tmp_path, noisy(size))
    assert caught.value.exit_status == 3


def test_rods_and_axes_of_six_digits_are_equal_and_parallel(tmp_path: Path):
    """Joint centres and axes that are moved by up to 2e-6 keep their parallelograms and what is idle."""
    from dataclasses import replace

    from description.samples import with_rods
    from hrsynth.analysis.observed import ObservedRobot
    from hrsynth.description.formats.sdf.write import write

    rng, robot = np.random.default_rng(3), replace(with_rods(), observations=())
    joints = {
        name: replace(
            joint,
            point=joint.point + 2e-6 * rng.uniform(-1, 1, 3),
            axes=tuple(axis + 2e-6 * rng.uniform(-1, 1, 3) for axis in joint.axes),
        )
        for name, joint in robot.joints.items()
    }
    setup = ObservedRobot.of(read(tmp_path, write(replace(robot, joints=joints)).texts[0], "sdf"), samples=3)
    meant = ObservedRobot.of(robot, samples=3)
    assert setup.decomposition.architecture() == meant.decomposition.architecture()
    assert (setup.dof, setup.mobility) == (meant.dof, meant.mobility)
    (note,) = [note.text for note in setup.robot.notes if "made exact" in note.text]
    assert float(note.split("largest change ")[1].split(";")[0]) < 1e-4


def test_a_mimic_is_a_gear_and_no_motor(tmp_path: Path):
    mimic = bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1)), ("r", "tip", "two", origin(1))], "")
    geared = mimic.replace('<child link="two"/>', '<child link="two"/><mimic joint="p" multiplier="-2" offset="0.5"/>')
    free, robot = read(tmp_path, mimic, platform="tip"), read(tmp_path, geared, platform="tip")
    assert full_mobility(free) == 3
    assert full_mobility(robot) == 2
    assert [(c.driver, c.driven, c.ratio) for c in robot.couplings] == [("p", "q", -2.0)]
    assert not any(joint.is_actuated for joint in robot.joints.values())
    x = robot.links["tip"].pose[:3, 0]
    q = [np.arctan2(robot.links[n].pose[1, 0], robot.links[n].pose[0, 0]) for n in ("one", "two")]
    assert q[1] - q[0] == pytest.approx(-2 * q[0] + 0.5)
    assert np.linalg.norm(x) == pytest.approx(1)


def test_a_gear_that_would_hold_its_joint_is_refused_and_the_joint_frozen(tmp_path: Path):
    text = bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1))], "").replace(
        '<child link="two"/>', '<child link="two"/><mimic joint="p" multiplier="0"/>'
    )
    told = r"urdf:\d+: coupling 'mimic_q' would fix joint 'q'; its ratio: got 0.0, .*freeze q"
    with pytest.raises(BadMechanism, match=told):
        read(tmp_path, text, platform="two")
    assert full_mobility(read(tmp_path, text, platform="two", freeze=["q"])) == 1


def test_a_frozen_joint_holds_those_that_gears_join_to_it(tmp_path: Path):
    text = bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1)), ("r", "tip", "two", origin(1))], "")
    geared = text.replace('<child link="two"/>', '<child link="two"/><mimic joint="p" multiplier="-2"/>')
    held = read(tmp_path, geared, platform="tip", freeze=["q"])
    assert full_mobility(held) == 1
    assert [joint.name for joint in held.joints.values() if joint.type is not JointType.FIXED] == ["r"]
    away = geared.replace('multiplier="-2"', 'multiplier="-2" offset="0.5"')
    with pytest.raises(BadRequest, match=r"--freeze p: the coupling .* moves joint 'q' away from zero"):
        read(tmp_path, away, platform="tip", freeze=["p"])


def test_gears_stay_with_their_joints_whatever_link_is_the_base(tmp_path: Path):
    text = bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1)), ("r", "tip", "two", origin(1))], "")
    for link, ratio in (("two", 0.5), ("tip", -0.7)):
        text = text.replace(f'<child link="{link}"/>', f'<child link="{link}"/><mimic joint="p" multiplier="{ratio}"/>')
    back = read(tmp_path, text, base="tip", platform="base")
    assert full_mobility(back) == 1
    assert [(c.driver, c.driven, c.ratio) for c in back.couplings] == [("p", "q", 0.5), ("p", "r", -0.7)]
    model = PinocchioModel(back)
    at_zero = ClosedConfiguration.of(model, model.q0)
    base, one = (at_zero.velocity(link)[5] @ at_zero.kernel()[0] for link in ("base", "one"))
    assert base / (one - base) == pytest.approx(-(1 + 0.5 - 0.7))
    part = read(tmp_path, text, base="base", platform="two")
    assert [each.name for each in part.couplings] == ["mimic_q"]
    with pytest.raises(BadRequest, match="couplings connect joints between 'one' and 'tip' through others: got 'p'"):
        read(tmp_path, text, base="one", platform="tip")


def test_a_screw_of_either_convention_couples_turn_and_travel(tmp_path: Path):
    text = (
        '<sdf version="1.10"><model name="m"><link name="base"/><link name="nut"/><joint name="s" type="screw">'
        "<parent>base</parent><child>nut</child><axis><xyz>0 0 1</xyz></axis>{}</joint></model></sdf>"
    )
    for pitch, lead in (
        ("<screw_thread_pitch>0.5</screw_thread_pitch>", 0.5),
        ("<thread_pitch>-4</thread_pitch>", 2 * np.pi / 4),
    ):
        robot = read(tmp_path, text.format(pitch), "sdf", platform="nut")
        assert full_mobility(robot) == 1
        model = PinocchioModel(robot)
        at_zero = ClosedConfiguration.of(model, model.q0)
        V = at_zero.velocity("nut") @ at_zero.kernel()[0]
        assert V[2] * model.length / V[5] == pytest.approx(lead / (2 * np.pi))


def test_a_gearbox_couples_the_two_joints_on_its_reference_body(tmp_path: Path):
    def joint(name: str, kind: str, parent: str, child: str, extra: str = "") -> str:
        return (
            f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
            f"<axis><xyz>0 0 1</xyz></axis>{extra}</joint>"
        )

    gear = "<gearbox_reference_body>base</gearbox_reference_body><gearbox_ratio>0.25</gearbox_ratio>"
    links = "".join(f'<link name="{name}"/>' for name in ("base", "fast", "slow"))
    joints = joint("i", "revolute", "base", "fast") + joint("o", "revolute", "base", "slow")
    joints += joint("g", "gearbox", "fast", "slow", gear)
    text = f'<sdf version="1.6"><model name="m">{links}{joints}</model></sdf>'
    robot = read(tmp_path, text, "sdf", platform="slow")
    assert full_mobility(robot) == 1
    assert [(c.driver, c.driven, c.ratio) for c in robot.couplings] == [("i", "o", -0.25)]


def test_a_mimic_of_sdformat_follows_its_joint_from_a_reference(tmp_path: Path):
    joint = (
        '<joint name="{}" type="revolute"><parent>{}</parent><child>{}</child><axis><xyz>0 0 1</xyz>{}</axis></joint>'
    )
    mimic = '<mimic joint="{}"><multiplier>-2</multiplier><offset>0.5</offset><reference>0.1</reference></mimic>'
    links = "".join(f'<link name="{name}"/>' for name in ("base", "one", "two"))
    joints = joint.format("p", "base", "one", "") + joint.format("q", "one", "two", mimic)
    text = f'<sdf version="1.11"><model name="m">{links}{joints}</model></sdf>'
    robot = read(tmp_path, text.format("p"), "sdf", platform="two")
    assert full_mobility(robot) == 1
    assert [(c.driver, c.driven, c.ratio) for c in robot.couplings] == [("p", "q", -2.0)]
    q = [np.arctan2(robot.links[n].pose[1, 0], robot.links[n].pose[0, 0]) for n in ("one", "two")]
    assert q[1] - q[0] == pytest.approx(-2 * (q[0] - 0.1) + 0.5)
    alone = read(tmp_path, text.format("x"), "sdf", platform="two")
    assert full_mobility(alone) == 2
    assert any("there is no joint 'x'" in note.text for note in alone.notes)


def test_missing_second_axes_are_the_default_and_a_guess(tmp_path: Path):
    text = (
        '<sdf version="1.5"><model name="m"><link name="base"/><link name="arm"/><joint name="u" type="{}">'
        "<parent>base</parent><child>arm</child><axis><xyz>{}</xyz></axis></joint></model></sdf>"
    )
    for kind in ("universal", "revolute2"):
        robot = read(tmp_path, text.format(kind, "1 0 0"), "sdf")
        (joint,) = robot.joints.values()
        assert joint.type is JointType.UNIVERSAL
        assert np.allclose(joint.axes, [[1, 0, 0], [0, 0, 1]])
        assert any("0 0 1, the format's default" in note.text for note in robot.notes)
    oblique = read(tmp_path, text.format("revolute2", "0 1 1"), "sdf")
    assert [joint.type.value for joint in oblique.joints.values()] == ["R", "R"]


def test_frames_that_do_not_coincide_are_brought_together(tmp_path: Path):
    text = (
        '<sdf version="1.7"><model name="m"><frame name="hook" attached_to="world"><pose>0 0 3 0 0 0</pose></frame>'
        '<link name="arm"/><link name="hand"><pose>1 0 0 0 0 0</pose></link>'
        '<joint name="j" type="revolute"><parent>hook</parent><child>arm</child></joint>'
        '<joint name="k" type="revolute"><parent>arm</parent><child>hand</child></joint></model></sdf>'
    )
    robot = read(tmp_path, text, "sdf")
    assert np.allclose(robot.links["arm"].pose[:3, 3], [0, 0, 3])
    assert np.allclose(robot.joints["k"].point, [1, 0, 3])
    assert robot.base == "world"


def test_efforts_of_zero_tell_the_motors_and_others_tell_nothing(tmp_path: Path):
    text = FILES["sdf: 1.7"]["robot.sdf"]
    efforts = text.replace("</xyz></axis>", "</xyz><limit><effort>5</effort></limit></axis>", 1)
    assert not any(joint.is_actuated for joint in read(tmp_path, efforts, "sdf").joints.values())
    mixed = efforts.replace("</xyz></axis>", "</xyz><limit><effort>0</effort></limit></axis>")
    robot = read(tmp_path, mixed, "sdf")
    assert {name for name, joint in robot.joints.items() if joint.is_actuated} == {"a"}
    assert any(note.kind == "assumption" and "motors" in note.text for note in robot.notes)


@pytest.mark.parametrize("R", ["xyz", "XYZ", "zyx"])
def test_euler_angles_follow_their_sequence(R: str, tmp_path: Path):
    from hrsynth.geometry.vectors import rotate_about_axis

    angles = np.radians([30, 40, 50])
    expected = np.eye(3)
    for letter, angle in zip(R, angles, strict=True):
        turn = rotate_about_axis(np.eye(3)["xyz".index(letter.lower())], angle)
        expected = expected @ turn if letter.islower() else turn @ expected
    head = f'<compiler eulerseq="{R}"/>'
    body = '<worldbody><body name="b" euler="{}"><joint/></body></worldbody></mujoco>'
    robot = read(tmp_path, f"<mujoco>{head}{body.format('30 40 50')}", "xml")
    assert np.allclose(robot.links["b"].pose[:3, :3], expected)
    text = " ".join(map(repr, map(float, angles)))
    radians = read(tmp_path, f'<mujoco><compiler angle="radian"/>{head}{body.format(text)}', "xml")
    assert np.allclose(radians.links["b"].pose[:3, :3], expected)


@pytest.mark.parametrize(
    ("given", "matrix"),
    [
        ('quat="0 0 0 2"', [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        ('axisangle="0 0 3 90"', [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ('xyaxes="0 1 0 -1 0 0"', [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ('zaxis="1 0 0"', [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
    ],
)
def test_orientations_of_mjcf(given: str, matrix: list, tmp_path: Path):
    robot = read(tmp_path, f'<mujoco><worldbody><body name="b" {given}><joint/></body></worldbody></mujoco>', "xml")
    assert np.allclose(robot.links["b"].pose[:3, :3], matrix)


def test_default_classes_are_inherited_and_overridden(tmp_path: Path):
    head = (
        '<default><joint axis="0 1 0"/><default class="s"><joint type="slide"/><default class="t">'
        '<joint axis="1 0 0"/></default></default></default>'
    )
    body = (
        '<worldbody><body name="p"><joint name="h"/><body name="q" childclass="s"><joint name="i"/><body name="r">'
        '<joint name="j" class="t"/></body></body></body></worldbody>'
    )
    joints = read(tmp_path, f"<mujoco>{head}{body}</mujoco>", "xml").joints
    assert [(joint.type.value, tuple(joint.axis)) for joint in joints.values()] == [
        ("R", (0, 1, 0)),
        ("P", (0, 1, 0)),
        ("P", (1, 0, 0)),
    ]


def test_unnamed_bodies_several_joints_and_the_free_world(tmp_path: Path):
    robot = read(
        tmp_path,
        '<mujoco><worldbody><body><freejoint/><body><joint type="slide" axis="1 0 0"/>'
        '<joint type="hinge" pos="0 0 1"/><joint axis="0 1 0"/></body></body></worldbody></mujoco>',
        "xml",
    )
    assert [joint.type.value for joint in robot.joints.values()] == ["6", "P", "R", "R"]
    assert full_mobility(robot) == 9
    assert robot.base == "world"


def test_equalities_that_are_off_or_hold_a_joint(tmp_path: Path):
    off = MJCF["connect"].replace('<connect name="d"', '<connect name="d" active="false"')
    assert mobility(read(tmp_path, off, "xml", platform="bar")) == 3
    held = mjcf('<joint joint1="c"/>')
    assert mobility(read(tmp_path, held, "xml", platform="bar")) == 2
    geared = mjcf('<joint joint1="b" joint2="a" polycoef="0 -1"/>')
    assert full_mobility(read(tmp_path, geared, "xml", platform="bar")) == 2
    curved = mjcf('<joint joint1="b" joint2="a" polycoef="0 -1 2"/>')
    assert full_mobility(read(tmp_path, curved, "xml", platform="bar")) == 2


def test_actuators_on_passive_joints_are_told(tmp_path: Path):
    everywhere = MJCF["connect"].replace("</actuator>", '<position joint="b"/><position joint="c"/></actuator>')
    notes = [str(note) for note in read(tmp_path, everywhere, "xml").notes]
    assert any(note.startswith("open: 3 coordinates have motors, but the mobility is 1") for note in notes)
    robot = read(tmp_path, everywhere, "xml", motors=["a"])
    assert not any(note.kind == "open" for note in robot.notes)
    assert not any(note.kind == "open" for note in read(tmp_path, MJCF["connect"], "xml").notes)


def test_joint_types_of_the_yaml_replace_those_of_the_urdf(tmp_path: Path):
    (tmp_path / "robot.yaml").write_text(
        "joint_name: ['q', 'r']\njoint_type: ['SPHERICAL', 'UJOINT_XY']\nclosed_loop: []\n"
    )
    robot = read(
        tmp_path,
        bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1)), ("r", "three", "two", origin(1))], ""),
    )
    assert [joint.type.value for joint in robot.joints.values()] == ["R", "S", "U"]
    assert np.allclose(robot.joints["r"].axes, [[1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("wish", "kind"),
    [
        ("rocker_tip:bar_tip", "R"),
        ("rocker_tip:bar_tip:spherical", "R"),
        ("rocker_tip:bar_tip:revolute/0,0,1", "R"),
        ("rocker_tip:bar_tip:fixed", None),
    ],
)
def test_a_closure_may_be_given(wish: str, kind: str | None, tmp_path: Path):
    from description.foreign.examples import _frame

    text = urdf(_frame("rocker_tip", "rocker", C) + _frame("bar_tip", "bar", C))
    if kind is None:
        robot = read(tmp_path, text, platform="bar", close=[wish])
        assert mobility(robot) == 0
        return
    robot = read(tmp_path, text, platform="bar", close=[wish])
    assert mobility(robot) == 1
    assert lines(reduce_to_normal_form(robot).mechanism) == sorted(tuple(p + 0.0) for p in (A, B, C, D))


def test_motors_platform_freeze_and_observed_links_may_be_given(tmp_path: Path):
    text = FILES["urdf: urdf+"]["robot.urdf"]
    robot = read(tmp_path, text, platform="bar", motors="c", observe=["crank"])
    assert {name for name, joint in robot.joints.items() if joint.is_actuated} == {"c"}
    (seen,) = robot.observations
    assert isinstance(seen, Direction)
    assert seen.link == "crank"
    direction = robot.links["crank"].pose[:3, :3] @ seen.direction
    assert np.allclose(direction, (B - A) / np.linalg.norm(B - A))
    assert mobility(read(tmp_path, text, platform="bar", freeze=["a"])) == 0
    for wrong in (
        {"platform": "none"},
        {"base": "none"},
        {"motors": "none"},
        {"freeze": ["none"]},
        {"observe": "none"},
        {"close": ["bar"]},
        {"close": ["bar:none"]},
        {"close": ["bar:bar"]},
        {"close": ["bar:base:odd"]},
        {"platform": "base"},
    ):
        with pytest.raises(BadRequest):
            read(tmp_path, text, **wrong)


def test_a_tool_on_a_fixed_joint_may_be_the_platform(tmp_path: Path):
    from description.foreign.examples import _frame
    from description.samples import FOUR_BAR
    from hrsynth.analysis.check import check
    from hrsynth.description import native

    tool = '<link name="tool"/><joint name="tool_frame" type="fixed"><parent link="bar"/><child link="tool"/></joint>'
    named = FOUR_BAR.replace('<platform link="bar"/>', '<platform link="tool"/>').replace(
        "<transmission", tool + "<transmission", 1
    )
    assert reduce_to_normal_form(native.parse(named)).mechanism.platform == "tool"
    assert check(native.parse(named)).postures[0].dof == 1
    text = FILES["urdf: urdf+"]["robot.urdf"].replace("</robot>", _frame("tool", "bar", B) + "</robot>")
    foreign = read(tmp_path, text)
    assert foreign.platform == "tool"


def test_the_way_between_two_links_is_all_that_counts(tmp_path: Path):
    limbs = (
        CHAIN.format("arm", "arm", "bar", "continuous", origin(1))
        + CHAIN.format("hand", "hand", "arm", "continuous", origin(1))
        + CHAIN.format("tail", "tail", "base", "continuous", origin(0))
    )
    text = FILES["urdf: urdf+"]["robot.urdf"].replace("</robot>", limbs + "</robot>")
    whole = read(tmp_path, text, platform="bar")
    part = read(tmp_path, text, platform="bar", base="base")
    turned = read(tmp_path, text, platform="base", base="hand")
    assert set(whole.links) - set(part.links) == {"arm", "hand", "tail"}
    assert any(note.kind == "ignored" for note in part.notes)
    assert (mobility(whole), mobility(part), mobility(turned)) == (4, 1, 3)
    assert turned.base == "hand"
    assert np.allclose(turned.links["hand"].pose, np.eye(4))


def test_candidates_are_named_where_no_guess_is_safe(tmp_path: Path):
    two = bars([("p", "left", "base", origin(0)), ("q", "right", "base", origin(1))], "")
    with pytest.raises(BadRequest, match="--platform LINK, such as left, right"):
        observe(read(tmp_path, two))
    assert at("base", A) == "0.0 0.0 0.0"


def test_loops_that_rounding_may_hold_are_refused_as_such(tmp_path: Path):
    """Bricard's loops move by a relation of their lengths and twists, which rounded numbers miss: their screws have
    rank five for the exact numbers, six for the rounded ones, by a singular value of the size of the rounding."""
    from hrsynth.families.__main__ import main
    from hrsynth.families.linkages import LINKAGES

    linkage = LINKAGES["line_symmetric_bricard"]()
    angles = linkage.close(np.linspace(0.5, 1.5, 6), 0.9)
    assert angles is not None
    screws = linkage.axes(angles)
    exact = np.linalg.svd(screws, compute_uv=False)
    rounded = np.linalg.svd(screws.round(5), compute_uv=False)
    assert exact[5] < 1e-12 < 1e-7 < rounded[5] < 1e-4
    main(str(tmp_path), "line_symmetric_bricard")
    whole = (tmp_path / "line_symmetric_bricard.urdf").read_text()
    text = re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda number: f"{float(number[0]):.5f}", whole)
    with pytest.raises(RoundingLimitedRank, match="is as large as 1 singular value of the loop Jacobian") as caught:
        read(tmp_path, text)
    assert "gap" not in str(caught.value)
    assert caught.value.directions == 1


def test_the_free_joint_of_a_platform_is_no_way_to_the_base(tmp_path: Path):
    legs, closures, sites = "", "", ""
    for k, (x, y) in enumerate([(0.3, 0.1), (-0.3, 0.0), (0.1, -0.3)], 1):
        legs += (
            f'<body name="crank{k}" pos="{x} {y} 0"><joint type="hinge" axis="0 0 1"/>'
            f'<body name="rod{k}" pos="0.02 0.1 0"><joint type="hinge" axis="0 0 1"/>'
            f'<site name="tip{k}" pos="{-0.7 * x} {-0.7 * y} 0"/></body></body>'
        )
        sites += f'<site name="at{k}" pos="{0.3 * x + 0.02} {0.3 * y + 0.1} 0"/>'
        closures += f'<connect site1="tip{k}" site2="at{k}"/>'
    robot = read(
        tmp_path,
        f'<mujoco><worldbody>{legs}<body name="plate"><freejoint/>{sites}</body></worldbody>'
        f"<equality>{closures}</equality></mujoco>",
        "xml",
    )
    assert robot.platform == "plate"
    assert "the platform is link 'plate', which 3 paths connect to the base" in "".join(map(str, robot.notes))
