"""Writing then reading gives the same mechanism, and writing that gives the same text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import strategies as some
from description.samples import FOUR_BAR, every_joint, moved, rotation, with_rods
from hrsynth.description import build_spanning_mechanism, native, numerals, xml
from hrsynth.description.jointgraph import LOOP_TYPES, FrameSpec, JointSpec
from hrsynth.description.jointmotion import compute_closure_residual
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import build_pose, convert_rpy_to_rotation
from hrsynth.mechanism.model import Coupling, Joint, JointType, Limits, Link, Mechanism, Motor
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations.direction import Direction

IN_TREE = list(JointType)
IN_LOOP = [kind for kind in JointType if kind is not JointType.FREE]
SEEDS = st.integers(0, 2**32 - 1)


def check_round_trip(mechanism: Mechanism) -> Mechanism:
    """The law of this file; the mechanism as read."""
    text = native.write(mechanism)
    read = native.parse(text)
    assert read.differences(build_spanning_mechanism(mechanism)) == []
    assert native.write(read) == text
    return read


@pytest.mark.some(32)
@pytest.mark.parametrize("kind", IN_TREE)
@pytest.mark.parametrize("seed", range(8))
def test_a_tree_joint_of_every_type(kind: JointType, seed: int):
    read = check_round_trip(every_joint([kind, kind], [JointType.SPHERICAL], seed))
    assert [joint.type for joint in read.joints.values()] == [kind, kind, JointType.SPHERICAL]


@pytest.mark.some(28)
@pytest.mark.parametrize("kind", IN_LOOP)
@pytest.mark.parametrize("seed", range(8))
def test_a_loop_of_every_type(kind: JointType, seed: int):
    read = check_round_trip(every_joint([JointType.REVOLUTE] * 3, [kind, kind], seed))
    assert [joint.type for joint in read.joints.values() if not joint.in_tree] == [kind, kind]


@pytest.mark.slow
@settings(deadline=None, max_examples=150)
@given(
    st.lists(st.sampled_from(IN_TREE), min_size=1, max_size=12),
    st.lists(st.sampled_from(IN_LOOP), max_size=6),
    SEEDS,
    st.sampled_from([1.0, 1e-3, 0.99, 500.0]),
)
@example(tree=[JointType.REVOLUTE], loops=[JointType.FIXED], seed=222, scale=500.0)  # a platform that cannot move
def test_any_tree_with_any_loops_at_any_size(tree: list[JointType], loops: list[JointType], seed: int, scale: float):
    mechanism = every_joint(tree, loops, seed, scale)
    read = check_round_trip(mechanism)
    motors = {name: joint.motor for name, joint in mechanism.joints.items()}
    assert {name: joint.motor for name, joint in read.joints.items()} == motors
    assert (read.name, read.xml, read.camera) == (mechanism.name, mechanism.xml, mechanism.camera)


@settings(deadline=None, max_examples=60)
@given(some.mechanisms(), SEEDS, st.sets(st.sampled_from(["transformed", "split", "recut", "reordered"])))
def test_robots_in_any_position_cut_anywhere(mechanism: Mechanism, seed: int, changes: set[str]):
    rng = np.random.default_rng(seed)
    if "transformed" in changes:
        mechanism = some.transformed(mechanism, some.random_rotation(rng), rng.normal(size=3))
    for change in ("split", "recut", "reordered"):
        if change in changes:
            mechanism = getattr(some, change)(mechanism, rng)
    check_round_trip(mechanism)


@pytest.mark.parametrize("seed", range(5))
def test_the_base_frame_is_where_the_base_link_is(seed: int):
    rng = np.random.default_rng(seed)
    robot = with_rods()
    seen = moved(robot, build_pose(rng.normal(size=3), rotation(rng)))
    assert native.parse(native.write(seen)).differences(build_spanning_mechanism(robot)) == []


@settings(deadline=None, max_examples=60)
@given(some.parallel_robots())
def test_a_written_file_is_assembled_at_zero(mechanism: Mechanism):
    root = xml.parse_document(native.write(mechanism), "f")
    poses = {mechanism.base: np.eye(4)}
    joints = root.findall("joint")
    while joints:
        joint = joints.pop(0)
        parent = poses.get(joint.find("parent").get("link"))
        if parent is None:
            joints.append(joint)
        else:
            poses[joint.find("child").get("link")] = parent @ _pose(joint.find("origin"))
    loops = root.findall("loop")
    for loop in loops:
        ends = [
            poses[loop.find(tag).get("link")] @ _pose(loop.find(tag).find("origin"))
            for tag in ("predecessor", "successor")
        ]
        axes = [
            np.array([float(word) for word in loop.find(tag).get("xyz").split()])
            for tag in ("axis", "axis2")
            if loop.find(tag) is not None
        ]
        kind = LOOP_TYPES[loop.get("type")]
        spec = JointSpec(loop.get("name"), kind, (FrameSpec("a"), FrameSpec("b")), tuple(axes))
        assert compute_closure_residual(spec, ends[0], ends[1], mechanism.length) <= 1e-12
        if kind is JointType.UNIVERSAL:
            assert abs((ends[0][:3, :3] @ axes[0]) @ (ends[1][:3, :3] @ axes[1])) <= 1e-12
    assert loops


def _pose(origin):
    numbers = [
        [float(word) for word in (origin.get(key, "0 0 0") if origin is not None else "0 0 0").split()]
        for key in ("xyz", "rpy")
    ]
    return build_pose(numbers[0], convert_rpy_to_rotation(*numbers[1]))


@settings(max_examples=300)
@given(SEEDS)
def test_written_angles_give_the_rotation(seed: int):
    R = rotation(np.random.default_rng(seed))
    assert np.max(np.abs(convert_rpy_to_rotation(*numerals.compute_rounded_rpy(R)) - R)) < 5e-13


@settings(max_examples=300)
@given(SEEDS)
def test_a_written_axis_is_a_unit_vector_and_a_fixed_point(seed: int):
    direction = np.random.default_rng(seed).normal(size=3)
    text = numerals.format_axis(direction)
    read = numerals.parse(text, 3)
    assert abs(np.linalg.norm(read) - 1) < 2e-15
    assert numerals.format_axis(read) == text
    assert np.linalg.norm(np.cross(read, direction)) < 1e-12 * np.linalg.norm(direction)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-0.0, "0"),
        (1e-16, "0"),
        (-1e-14, "0"),
        (0.1 + 0.2, "0.3"),
        (2.0, "2"),
        (-0.25, "-0.25"),
        (1 / 3, "0.3333333333333"),
        (1e-7, "1e-07"),
    ],
)
def test_numbers_are_short(value: float, text: str):
    assert numerals.format_decimal(value, 13) == text


def test_the_file_of_the_contract_reads_as_it_says():
    robot = native.parse(FOUR_BAR, "four_bar.urdf")
    assert (robot.name, robot.base, robot.platform, robot.file) == ("four_bar", "base", "bar", "four_bar.urdf")
    assert {name: joint.type.value for name, joint in robot.joints.items()} == dict.fromkeys("abcd", "R")
    assert [joint.name for joint in robot.joints.values() if not joint.in_tree] == ["d"]
    assert robot.joints["a"].limits == Limits(-1, 1, 2, 5)
    assert robot.joints["a"].motor.name == "m"
    assert np.allclose(robot.joints["d"].point, (2, 0, 1))
    assert np.allclose(robot.joints["d"].axis, (0, 1, 0))
    assert np.allclose(robot.links["bar"].pose, build_pose((0, 0, 1)))
    assert (robot.links["crank"].line, robot.joints["d"].line, robot.observations[0].line) == (3, 25, 39)
    check_round_trip(robot)


def test_the_spanning_tree_stays_where_it_is_one():
    robot = with_rods()
    assert build_spanning_mechanism(robot).differences(robot) == []
    assert list(build_spanning_mechanism(robot).joints) == list(robot.joints)


def test_a_new_spanning_tree_prefers_single_freedoms_and_leaves_balls_as_loops():
    robot = with_rods()
    turned = {name: replace(joint.turned(), in_tree=False) for name, joint in robot.joints.items()}
    loose = replace(robot, joints=turned)
    tree = build_spanning_mechanism(loose)
    assert all(tree.joints[f"shoulder_{leg}"].in_tree for leg in range(3))
    assert sum(joint.in_tree for joint in tree.joints.values()) == len(tree.links) - 1
    assert next(iter(tree.links)) == "base"
    assert [joint.in_tree for joint in tree.joints.values()] == [True] * 10 + [False] * 5
    assert list(build_spanning_mechanism(tree).joints) == list(tree.joints)
    check_round_trip(loose)


def test_two_revolutes_that_one_motor_drives_stay_two():
    text = native.write(every_joint([JointType.UNIVERSAL], [JointType.REVOLUTE], 0))
    assert "tree_0__2" in text
    both = native.parse(text)
    assert both.joints["tree_0"].type is JointType.UNIVERSAL
    joints = [replace(joint, motor=Motor("m") if joint.in_tree else None) for joint in both.joints.values()]
    driven = both.changed(joints=joints)
    lines = native.write(driven).splitlines()
    start = next(number for number, line in enumerate(lines) if '<transmission name="m__2">' in line)
    one = native.parse("\n".join(lines[:start] + lines[start + 7 :]))
    assert {name: joint.is_actuated for name, joint in one.joints.items() if joint.in_tree and joint.type.freedoms} == {
        "tree_0__1": True,
        "tree_0__2": False,
    }
    check_round_trip(one)


@pytest.mark.parametrize("bend", [1e-3, 0.3])
def test_two_revolutes_that_are_not_perpendicular_stay_two(bend: float):
    link, end = Link("N__1"), Link("end")
    axis = np.array([np.sin(bend), np.cos(bend), 0])
    joints = [
        Joint("N__1", JointType.REVOLUTE, "base", "N__1", np.zeros(3), (np.array([1.0, 0, 0]),)),
        Joint("N__2", JointType.REVOLUTE, "N__1", "end", np.zeros(3), (axis,)),
    ]
    robot = Mechanism.of("bent", [Link("base"), link, end], joints, platform="end")
    assert set(check_round_trip(robot).joints) == {"N__1", "N__2"}


def test_a_chain_whose_link_in_between_bears_something_stays_a_chain():
    text = native.write(every_joint([JointType.SPHERICAL], [JointType.REVOLUTE], 2)).replace(
        '<link name="tree_0__2"/>', '<link name="tree_0__2"><inertial/></link>'
    )
    assert [name for name in native.parse(text).joints if name.startswith("tree_0__")] == [
        "tree_0__1",
        "tree_0__2",
        "tree_0__3",
    ]
    check_round_trip(native.parse(text))


@pytest.mark.parametrize("number", [1, 2])
def test_a_chain_with_a_coupled_joint_stays_a_chain(number: int):
    chain = native.write(every_joint([JointType.UNIVERSAL, JointType.REVOLUTE], [JointType.REVOLUTE], 2))
    carried = {joint.name: joint.successor for joint in native.parse(chain.replace("tree_0__", "N_")).joints.values()}
    names = (carried[name].replace("N_", "tree_0__") for name in (f"N_{number}", "tree_1"))
    one, two = (f'<{end} link="{name}"/>' for end, name in zip(("predecessor", "successor"), names, strict=True))
    text = chain.replace("<hrsynth", f'<coupling name="g">{one}{two}<ratio value="2"/></coupling><hrsynth')
    robot = check_round_trip(native.parse(text))
    (gear,) = robot.couplings
    assert (gear.driver, gear.driven) == (f"tree_0__{number}", "tree_1")


def test_a_coupling_may_name_a_link_fixed_to_the_one_that_its_joint_carries():
    coupling = '<coupling name="g"><predecessor link="{}"/><successor link="rocker"/><ratio value="-1"/></coupling>'
    weld = '<link name="tip"/><joint name="weld" type="fixed"><parent link="crank"/><child link="tip"/></joint>'
    one, other = (
        native.parse(FOUR_BAR.replace("<transmission", weld + coupling.format(link) + "<transmission"))
        for link in ("crank", "tip")
    )
    assert one.couplings[0].driver == "a"
    assert other.differences(one) == []


def test_both_motors_of_a_universal_joint_are_one():
    robot = every_joint([JointType.UNIVERSAL], [JointType.REVOLUTE], 0)
    robot = robot.changed(joints=[replace(robot.joints["tree_0"], motor=Motor("m"))])
    text = native.write(robot)
    assert text.count("<transmission") - text.count('<transmission name="drive_loop') == 2
    assert native.parse(text).joints["tree_0"].motor == Motor("m")


INTERFACE = "<hardwareInterface>hardware_interface/VelocityJointInterface</hardwareInterface>"


@pytest.mark.parametrize("interface", ["", INTERFACE])
def test_a_motor_of_the_usual_form_is_but_a_name(interface: str):
    text = FOUR_BAR.replace(
        '<joint name="a"/>',
        f"""<type>transmission_interface/SimpleTransmission</type>
        <joint name="a">{interface}</joint><actuator name="m"/>""",
    )
    assert native.parse(text).joints["a"].motor == Motor("m")
    assert "<hardwareInterface>" in native.write(native.parse(text))


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_urdf_types_that_are_no_joint_type_of_a_file(kind: str):
    text = FOUR_BAR.replace('<joint name="c" type="continuous">', f'<joint name="c" type="{kind}">')
    text = text.replace('<joint name="a"/>', '<joint name="a"/></transmission><transmission name="n"><joint name="c"/>')
    robot = check_round_trip(native.parse(text))
    types = {name: joint.type.value for name, joint in robot.joints.items()}
    if kind == "planar":
        assert types == {"a": "R", "b": "R", "c__x": "P", "c__y": "P", "c__turn": "R", "d": "R"}
        assert [robot.joints[name].motor.name for name in ("c__x", "c__y", "c__turn")] == ["n__x", "n__y", "n__turn"]
        assert abs(robot.joints["c__x"].axis @ robot.joints["c__y"].axis) < 1e-15
        assert np.allclose(robot.joints["c__turn"].axis, (0, 1, 0))
    else:
        assert types["c"] == "6"


KEPT = [
    ('<link name="bar"/>', '<link name="bar"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>'),
    ('<link name="crank"/>', '<link name="crank" type="x &amp; &quot;y&quot;"><inertial/><collision name="é"/></link>'),
    ('<child link="bar"/>', '<child link="bar"/><calibration rising="0"/><dynamics damping="1"/>'),
    ('<loop name="d" type="revolute">', '<loop name="d" type="revolute" independent="true"><note> two  words </note>'),
    (
        "<hrsynth>",
        '<gazebo reference="bar"><a:b xmlns:a="urn:c=d" a:e="1">text<!-- note --><f/>tail</a:b></gazebo><hrsynth>',
    ),
    ("<hrsynth>", '<hrsynth extra="1"><later kind="z"/>'),
    ("<robot ", '<robot xmlns:xacro="urn:x" version="1.0" xacro:a="b=c" '),
    (
        '<joint name="a"/>',
        '<type>T</type><joint name="a"><hardwareInterface>H</hardwareInterface></joint>'
        '<actuator name="z"><mechanicalReduction>50</mechanicalReduction></actuator>',
    ),
    ('<joint name="a"/>', '<joint name="a"/><joint name="c"/><actuator name="both"/>'),
]


@pytest.mark.parametrize(("old", "new"), KEPT)
def test_unknown_elements_and_attributes_are_kept(old: str, new: str):
    robot = native.parse(FOUR_BAR.replace(old, new))
    text = native.write(robot)
    assert native.write(native.parse(text)) == text
    again = native.parse(text)
    assert again.differences(robot) == []
    assert again.xml == robot.xml
    assert [joint.motor for joint in again.joints.values()] == [joint.motor for joint in robot.joints.values()]
    for word in (
        "a.stl",
        "x &amp; &quot;y&quot;",
        "é",
        'multiplier="-1"',
        " two  words ",
        'independent="true"',
        "text",
        "<!-- note -->",
        "tail",
        'a:e="1"',
        'extra="1"',
        'kind="z"',
        "b=c",
        "H</hardware",
        ">50<",
        "both",
    ):
        assert (word in new) == (word in text)


LIMITS = [
    ("R", None),
    ("R", Limits(-1, 2)),
    ("R", Limits(lower=-1)),
    ("R", Limits(upper=1)),
    ("R", Limits(0, 0, 1, 1)),
    ("R", Limits(velocity=3)),
    ("R", Limits(effort=3.3)),
    ("R", Limits(-1, 2, 3, 4)),
    ("P", None),
    ("P", Limits(-1, 2)),
    ("P", Limits(upper=0.1)),
    ("P", Limits(velocity=0.0)),
    ("P", Limits(-1, 2, 3, 4)),
    ("U", Limits(-1, 1)),
    ("C", None),
    ("C", Limits(0, 1, 2)),
    ("F", Limits(0, 1)),
]


@pytest.mark.parametrize(("letter", "limits"), LIMITS)
@pytest.mark.parametrize("in_tree", [True, False])
def test_limits_come_back(letter: str, limits: Limits | None, in_tree: bool):
    kinds = [JointType(letter)], [JointType.SPHERICAL]
    robot = every_joint(*(kinds if in_tree else kinds[::-1]), 3)
    name = next(name for name, joint in robot.joints.items() if joint.type is JointType(letter))
    robot = robot.changed(joints=[replace(robot.joints[name], limits=limits)])
    assert check_round_trip(robot).joints[name].limits == limits


@pytest.mark.parametrize(
    ("attributes", "limits"),
    [
        ('lower="-1"', Limits(-1, 0)),
        ('upper="1"', Limits(0, 1)),
        ("", None),
        ('effort="1" velocity="2"', Limits(velocity=2, effort=1)),
    ],
)
def test_limits_that_urdf_has_defaults_for(attributes: str, limits: Limits | None):
    text = FOUR_BAR.replace('lower="-1" upper="1" effort="5" velocity="2"', attributes)
    assert check_round_trip(native.parse(text)).joints["a"].limits == limits


def test_gears_come_back():
    gears = Coupling("g", "shoulder_0", "shoulder_1", -1 / 3), Coupling("h", "shoulder_1", "shoulder_2", 2.0)
    robot = replace(with_rods(), couplings=gears)
    read = check_round_trip(robot)
    assert read.couplings == gears


class Elsewhere(Observation):
    """An observation that the dialect has no element for."""


SERIAL = Mechanism.of(
    "s",
    [Link("base"), Link("end")],
    [Joint("j", JointType.REVOLUTE, "base", "end", np.zeros(3), (np.eye(3)[0],))],
    platform="end",
)


def test_a_mechanism_without_loops_says_so():
    assert 'serial="true"' in native.write(SERIAL)
    check_round_trip(SERIAL)


@pytest.mark.parametrize(
    "robot",
    [
        replace(SERIAL, observations=(Elsewhere("1", "end"),)),
        replace(SERIAL, name="a\0b"),
        SERIAL.changed(links=[Link("lost")]),
        SERIAL.changed(links=[Link("end", build_pose((np.nan, 0, 0)))]),
        SERIAL.changed(links=[Link("end", build_pose((1e10, 0, 0)))]),
        SERIAL.changed(links=[Link("end", xml=("<broken",))]),
        SERIAL.changed(joints=[Joint(name, JointType.FREE, "base", "end", np.zeros(3)) for name in "fg"]),
        SERIAL.changed(
            joints=[Joint("j", JointType.UNIVERSAL, "base", "end", np.zeros(3), (np.eye(3)[0], np.ones(3)))]
        ),
        SERIAL.changed(
            links=[Link("j__1", xml=("<inertial/>",))],
            joints=[
                Joint("j", JointType.SPHERICAL, "base", "end", np.zeros(3)),
                Joint("k", JointType.FIXED, "end", "j__1", np.zeros(3)),
            ],
        ),
    ],
    ids=["observation", "name", "lost", "nan", "far", "fragment", "free", "universal", "taken"],
)
def test_what_the_dialect_cannot_say_is_refused(robot: Mechanism):
    with pytest.raises(BadRequest) as caught:
        native.write(robot)
    assert len(caught.value.lines()) == 1
    assert "\n" not in caught.value.lines()[0]


def test_an_observed_direction_is_read_in_its_links_frame():
    robot = with_rods()
    read = native.parse(native.write(robot))
    for mine, theirs in zip(robot.observations, read.observations, strict=True):
        assert isinstance(mine, Direction)
        assert isinstance(theirs, Direction)
        assert np.allclose(mine.direction, theirs.direction, atol=1e-13)
