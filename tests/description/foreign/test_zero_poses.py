"""Zero poses that are special, and the postures that files name instead."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from description.foreign.test_traps import read
from hrsynth import check, derive, legs, modes, observe
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.errors import BadRequest
from hrsynth.geometry.so3 import convert_to_quaternions, convert_vectors_to_rotations
from hrsynth.mechanism import Mechanism
from oracle import Oracle, span


def numbers(*values: float) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def leg(seed: int, crank: float = 0.0, hips: int = 0) -> str:
    """The leg of a walking robot, thrown: hip, knee and shin in a row, held by a rod with two balls; below it a foot on
    a four-bar whose crank makes ``crank`` with its rod: at 0 a dead point. ``hips`` more hinges bear the hip."""
    rng = np.random.default_rng(seed)
    turned = numbers(*convert_to_quaternions(convert_vectors_to_rotations(rng.normal(size=3))))
    a, b, c, d = rng.uniform([0.3, 0.35, 0.05, 0.2], [0.5, 0.5, 0.08, 0.3])
    joints = "".join(
        f'<body name="hip{k}" pos="{numbers(*rng.uniform(-0.1, 0.1, 3))}">'
        f'<joint name="hip{k}" axis="{numbers(*rng.normal(size=3))}"/>'
        for k in range(hips)
    )
    pin = np.array([c * np.cos(crank), c * np.sin(crank)])
    end = pin + [d, 0.0]  # where the foot's rod ends, in the shin
    pivot = end - [0.02, c]
    ball = np.array([0.05, 0.08, 0.03])  # of the long rod, on the shin
    return f"""<mujoco model="leg"><compiler angle="radian"/><worldbody>
 <body name="pelvis" quat="{turned}" pos="{numbers(*rng.normal(size=3))}">{joints}
  <body name="rod"><joint name="top" type="ball"/></body>
  <body name="thigh" pos="0.1 0 0"><joint name="knee" axis="0 0 1"/>
   <body name="spring" pos="0.05 {numbers(-a)} 0"><joint name="spring" axis="0 0 1"/>
    <body name="shin" pos="{numbers(b)} 0 0"><joint name="shin" axis="0 0 1"/>
     <body name="crank"><joint name="crank" axis="0 0 1"/>
      <body name="link" pos="{numbers(*pin)} 0"><joint name="link" axis="0 0 1"/></body></body>
     <body name="foot" pos="{numbers(*pivot)} 0"><joint name="foot" axis="0 0 1"/></body>
 </body></body></body></body>{"</body>" * hips}</worldbody>
 <equality><connect body1="link" body2="foot" anchor="{numbers(d)} 0 0"/>
  <connect body1="rod" body2="shin" anchor="{numbers(0.15 + b + ball[0], ball[1] - a, ball[2])}"/></equality>
 <actuator><motor joint="knee"/><motor joint="foot"/></actuator></mujoco>"""


def seen(robot: Mechanism, walk: np.random.Generator) -> dict[tuple[str, ...], int]:
    """How many of the platform's freedoms each set of default segments sees at random configurations, by screws: the
    dof less the dimension of what moves with all directions at rest."""
    setup = ObservedRobot.of(robot)
    oracle = Oracle(setup.mechanism)
    (state,) = oracle.random_walk(walk, 1)
    sets = {each.legs: [o for o in setup.segments if o.leg in each.legs] for each in legs(robot).sets}
    found = {}
    for labels, observed in sets.items():
        rho = oracle.relation(state, observed)
        t, u = rho[:6], rho[6:]
        _, s, right = np.linalg.svd(u)
        still = right[int(np.sum(s > 1e-7)) :].T
        found[labels] = span(t).shape[1] - (span(t @ still).shape[1] if still.size else 0)
    return found


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_leg_at_a_dead_point_is_judged_at_generic_configurations(seed: int, tmp_path: Path):
    robot = read(tmp_path, leg(seed), "xml", base="pelvis", platform="foot")
    answer = legs(robot)
    assert {each.legs: each.rank for each in answer.sets} == seen(robot, np.random.default_rng(seed))
    assert max(each.rank for each in answer.sets) < answer.dof == 3
    special = [note.text for note in robot.notes if "special" in note.text]
    assert len(special) == 1
    (posture,) = check(robot).postures
    assert not any(posture.hidden.singularity_indices.to_dict().values())
    setup = ObservedRobot.of(robot)
    assert (setup.all_samples.led, posture.hidden.rank) == (True, answer.sets[-1].rank)


@pytest.mark.some(1)
@pytest.mark.parametrize("hips", [1, 2])
def test_a_dead_point_below_further_joints_is_no_meeting_of_modes(hips: int, tmp_path: Path):
    robot = read(tmp_path, leg(0, hips=hips), "xml", base="pelvis", platform="foot", keyframe="zero")
    answer = legs(robot)
    assert {each.legs: each.rank for each in answer.sets} == seen(robot, np.random.default_rng(hips))
    left = read(tmp_path, leg(0, hips=hips), "xml", base="pelvis", platform="foot")
    assert any("the zero configuration is" in note.text for note in left.notes)
    assert [each.rank for each in legs(left).sets] == [each.rank for each in answer.sets]


def test_every_question_is_answered_at_a_dead_point(tmp_path: Path):
    robot = read(tmp_path, leg(0), "xml", base="pelvis", platform="foot", keyframe="zero")
    (posture,) = check(robot).postures
    generic = legs(robot).sets[-1]
    assert posture.hidden.rank == posture.dof
    assert f"but not generic: {generic.dof - generic.rank} fewer unobserved than at generic poses" in str(check(robot))
    assert modes(robot).found.continuous_family is not None
    assert derive(robot).verdict.rank == generic.rank


def test_a_regular_zero_pose_is_kept(tmp_path: Path):
    robot = read(tmp_path, leg(0, crank=0.7), "xml", base="pelvis", platform="foot")
    assert not [note for note in robot.notes if note.kind == "solved"]


MOVING = {
    "urdf": '<link name="base"/><link name="a"/><link name="tip"/>'
    '<joint name="i" type="continuous"><parent link="base"/><child link="a"/></joint>'
    '<joint name="j" type="continuous"><parent link="a"/><child link="tip"/><axis xyz="0 1 0"/></joint>',
    "sdf": '<link name="base"/><link name="a"/><link name="tip"/><joint name="i" type="revolute"><parent>base</parent>'
    '<child>a</child><axis><xyz>1 0 0</xyz></axis></joint><joint name="j" type="revolute"><parent>a</parent>'
    "<child>tip</child><axis><xyz>0 1 0</xyz></axis></joint>",
}
STILL = {
    "urdf": {
        "spare": '<link name="spare"/>',
        "floor": '<link name="{0}"/><link name="floor"/><joint name="w" type="fixed"><parent link="{0}"/>'
        '<child link="floor"/></joint>',
    },
    "sdf": {
        "spare": '<link name="spare"/>',
        "floor": '<link name="floor"/><joint name="w" type="fixed"><parent>world</parent><child>floor</child></joint>',
    },
}
FRAMES = {"urdf": '<robot name="r">{}</robot>', "sdf": '<sdf version="1.9"><model name="r">{}</model></sdf>'}


@pytest.mark.filterwarnings("ignore::hrsynth.errors.AssumedPlatform")
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("still", [("spare",), ("floor",), ("spare", "floor")])
@pytest.mark.parametrize("dialect", FRAMES)
def test_what_does_not_move_is_never_the_base_of_what_does(
    dialect: str, still: tuple[str, ...], first: bool, tmp_path: Path
):
    parts = "".join(STILL[dialect][each].format("world") for each in still)
    text = FRAMES[dialect].format(parts + MOVING[dialect] if first else MOVING[dialect] + parts)
    robot = read(tmp_path, text, dialect)
    assert robot.differences(read(tmp_path, FRAMES[dialect].format(MOVING[dialect]), dialect)) == []
    (told,) = [note.text for note in robot.notes if note.kind == "ignored"]
    assert all(each in told for each in still)


@pytest.mark.filterwarnings("ignore::hrsynth.errors.AssumedBase")
@pytest.mark.parametrize("welded", [0, 1, 3])
@pytest.mark.parametrize("legs", [2, 3, 5])
def test_a_robot_floats_wherever_its_legs_are_welded(legs: int, welded: int, tmp_path: Path):
    """Legs on the bodies that are welded below the floating one: from two on, its six freedoms are left out."""
    text = ""
    for k in reversed(range(welded + 1)):
        hips = (f'<body name="leg{leg}"><joint axis="0 1 0"/><geom size="1"/></body>' for leg in range(legs))
        below = "".join(hip for leg, hip in enumerate(hips) if leg % (welded + 1) == k)
        text = f'<body name="b{k}">{"<freejoint/>" if k == 0 else ""}<geom size="1"/>{below}{text}</body>'
    robot = read(tmp_path, f"<mujoco><worldbody>{text}</worldbody></mujoco>", "xml", platform="leg0")
    assert robot.base == "b0"
    assert sum(joint.type.freedoms for joint in robot.joints.values()) == legs


TREE = """<mujoco model="tree"><compiler angle="{unit}"/><worldbody>
 <body name="trunk" pos="0 0 1"><freejoint/><geom size="0.1"/>
  <body name="thigh" pos="0.1 0.2 0" euler="{euler}"><joint name="hip" axis="1 2 0" ref="{ref}"/><geom size="0.1"/>
   <body name="shank" pos="0.3 0 0"><joint name="slide" type="slide" axis="0 1 1" ref="0.25"/>
    <joint name="turn" axis="0 0 1" pos="0.1 0 0"/><geom size="0.1"/>
    <body name="foot" pos="0 0.1 0.2"><joint name="ankle" type="ball" pos="0.02 0 0.01"/><geom size="0.1"/></body>
 </body></body></body></worldbody>
 <keyframe><key name="crouch" qpos="{qpos}"/><key qpos="{other}"/><key name="short" qpos="1 2"/></keyframe></mujoco>"""


@pytest.mark.parametrize("unit", ["radian", "degree"])
def test_keyframes_place_all_links_as_mujoco_does(unit: str, tmp_path: Path):
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(3)
    scale = 1.0 if unit == "radian" else 180 / np.pi
    poses = rng.uniform(-0.8, 0.8, (2, 14))
    text = TREE.format(
        unit=unit,
        euler=numbers(*(scale * rng.normal(size=3))),
        ref=numbers(0.4 * scale),
        qpos=numbers(*poses[0]),
        other=numbers(*poses[1]),
    )
    sound = text.replace('<key name="short" qpos="1 2"/>', "")
    model = mujoco.MjModel.from_xml_string(sound)
    for number, name in enumerate(("crouch", "1")):
        robot = read(tmp_path, text, "xml", platform="foot", base="world", keyframe=name)
        assert any("keyframe 'short'" in note.text for note in robot.notes)
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, number)
        mujoco.mj_forward(model, data)
        for link in ("trunk", "thigh", "shank", "foot"):
            body = data.body(link)
            assert np.allclose(robot.links[link].pose[:3, 3], body.xpos, atol=1e-12)
            assert np.allclose(robot.links[link].pose[:3, :3], body.xmat.reshape(3, 3), atol=1e-12)
    with pytest.raises(BadRequest, match="expected crouch, 1"):
        read(tmp_path, text, "xml", platform="foot", keyframe="stand")


def test_a_keyframe_that_is_open_is_closed_beside_itself(tmp_path: Path):
    robot = read(
        tmp_path,
        leg(1).replace(
            "</mujoco>",
            """<keyframe><key name="home" qpos="0.99 0 0.1 0.1
                 0.2 -0.1 0.1 0.9 -0.9 0.05"/></keyframe></mujoco>""",
        ),
        "xml",
        base="pelvis",
        platform="foot",
        keyframe="home",
    )
    (note,) = [note.text for note in robot.notes if note.kind == "solved"]
    assert note.startswith("at the keyframe 'home' the loop")
    oracle = Oracle(robot)
    assert oracle.error(oracle.zero()) < 1e-9


ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="fore"/><link name="cart"/>
 <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
 <joint name="b" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/>
  <axis xyz="0 1 0"/></joint>
 <joint name="c" type="prismatic"><parent link="fore"/><child link="cart"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""
STATES = """<robot name="arm"><group_state name="ready" group="arm"><joint name="a" value="0.5"/>
 <joint name="b" value="0.6 0.8"/><joint name="c" value="0.2"/><joint name="root_joint" value="1 2 3"/></group_state>
 <group_state name="ready" group="other"><joint name="a" value="-0.5"/></group_state></robot>"""
WORLD = """<sdf version="1.7"><world name="w"><model name="arm"><link name="base"/>
 <link name="upper"><pose>0 0 0.1 0 0 0</pose></link><link name="fore"><pose>0.3 0 0.1 0 0 0</pose></link>
 <link name="cart"><pose>0.3 0 0.1 0 0 0</pose></link>
 <joint name="a" type="revolute"><parent>base</parent><child>upper</child><axis><xyz>0 1 0</xyz></axis></joint>
 <joint name="b" type="revolute"><parent>upper</parent><child>fore</child><axis><xyz>0 1 0</xyz></axis></joint>
 <joint name="c" type="prismatic"><parent>fore</parent><child>cart</child><axis><xyz>1 0 0</xyz></axis></joint></model>
 <state world_name="ready"><model name="arm"><joint name="a"><angle axis="0">0.5</angle></joint>
 <joint name="b"><angle axis="0">0.9272952180016122</angle></joint>
 <joint name="c"><angle axis="0">0.2</angle></joint></model></state></world></sdf>"""


def test_postures_of_srdf_and_sdf(tmp_path: Path):
    (tmp_path / "robot.srdf").write_text(STATES)
    (tmp_path / "urdf").mkdir()
    elsewhere = tmp_path / "urdf" / "arm.urdf"
    elsewhere.write_text(ARM)
    robots = [
        read(tmp_path, ARM, keyframe="ready"),
        read(tmp_path, WORLD, "sdf", keyframe="ready"),
        load(elsewhere, keyframe=f"{tmp_path / 'robot.srdf'}:ready"),
    ]
    (tmp_path / "srdf").mkdir()
    (tmp_path / "robot.srdf").rename(tmp_path / "srdf" / "arm.srdf")
    robots.append(load(elsewhere, keyframe="ready"))
    one, two = 0.5, 0.5 + np.arctan2(0.8, 0.6)
    reached = [0.3 * np.cos(one) + 0.2 * np.cos(two), 0, 0.1 - 0.3 * np.sin(one) - 0.2 * np.sin(two)]
    for robot in robots:
        assert np.allclose(robot.links["cart"].pose[:3, 3], reached, atol=1e-12)
        assert robot.joints["a"].limits is None or np.isclose(robot.joints["a"].limits.upper, 1.5)
    assert any("root_joint" in note.text for note in robots[0].notes)
    other = load(elsewhere, keyframe="other/ready")
    assert np.allclose(other.links["upper"].pose[:3, 0], convert_vectors_to_rotations(np.array([0, -0.5, 0]))[:, 0])
    with pytest.raises(BadRequest, match="ready"):
        load(elsewhere, keyframe="sleep")


def five_bar(bearer: str, *, seed: int = 0, more: str = "") -> str:
    """A five-bar in a turned plane on a carriage that ``bearer`` bears."""
    rng = np.random.default_rng(seed)
    turned = numbers(*convert_to_quaternions(convert_vectors_to_rotations(rng.normal(size=3))))
    return f"""<mujoco model="cart"><compiler angle="radian"/><worldbody><body name="stand" quat="{turned}">
 <body name="carriage">{bearer}
  <body name="a1"><joint name="a1" axis="0 0 1"/><body name="b1" pos="0.1 0.3 0"><joint name="b1" axis="0 0 1"/></body>
  </body>
  <body name="a2" pos="0.4 0 0"><joint name="a2" axis="0 0 1"/>
   <body name="b2" pos="0.05 0.25 0"><joint name="b2" axis="0 0 1"/></body></body></body></body>{more}</worldbody>
 <equality><connect body1="b1" body2="b2" anchor="0.15 0.2 0"/></equality>
 <actuator><motor joint="a1"/><motor joint="a2"/></actuator></mujoco>"""


RAIL = '<joint name="rail" type="slide" axis="0 0 1"/>'


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "bearer", [RAIL, "<freejoint name='rail'/>", RAIL + '<joint name="up" type="slide" axis="0 1 0"/>']
)
def test_what_bears_the_base_is_no_leg(bearer: str, tmp_path: Path):
    robot = read(tmp_path, five_bar(bearer), "xml", platform="b2")
    assert robot.base == "carriage"
    assert "rail" not in robot.joints
    assert any("it is the base" in note.text and "rail" in note.text for note in robot.notes)
    fixed = read(tmp_path, five_bar(""), "xml", platform="b2", base="carriage")
    assert [each.rank for each in legs(robot).sets] == [each.rank for each in legs(fixed).sets]
    assert legs(robot).dof == legs(fixed).dof == 2


def test_a_rail_is_kept_where_it_is_asked_for_or_a_part_of_a_loop(tmp_path: Path):
    kept = read(tmp_path, five_bar(RAIL), "xml", platform="b2", base="stand")
    assert ("rail" in kept.joints, legs(kept).dof) == (True, 3)
    held = five_bar(RAIL, more='<body name="strut"><joint name="s" axis="1 0 0"/></body>').replace(
        "<equality>", '<equality><connect body1="strut" body2="carriage" anchor="0 0.1 0"/>'
    )
    assert "rail" in read(tmp_path, held, "xml", platform="b2").joints
    carried = five_bar("").replace(
        '<body name="stand"', '<body name="stage"><joint name="rail" type="slide"/></body><body name="stand"'
    )
    assert read(tmp_path, carried, "xml", platform="b2", base="carriage").base == "carriage"


def test_feet_are_offered_as_platforms(tmp_path: Path):
    text = leg(0)
    body, closures = text.partition("  <body")[1:][0] + text.partition("  <body")[2], text.partition("<equality>")[2]
    body, closures = body.partition("</body></worldbody>")[0], closures.partition("</equality>")[0]
    sides = [[re.sub(r'\b(name|body1|body2)="', rf'\1="{side}_', part) for part in (body, closures)] for side in "lr"]
    walker = (
        '<mujoco><compiler angle="radian"/><worldbody><body name="pelvis"><freejoint/>'
        + sides[0][0]
        + sides[1][0]
        + "</body></worldbody><equality>"
        + sides[0][1]
        + sides[1][1]
        + "</equality></mujoco>"
    )
    with pytest.raises(BadRequest) as caught:
        observe(read(tmp_path, walker, "xml"))
    offered = str(caught.value).partition("such as ")[2].split(", ")
    assert offered[:2] == ["l_foot", "r_foot"]
    assert {"l_crank", "l_link", "r_crank", "r_link"} <= set(offered)
    for name in offered[:3]:
        assert read(tmp_path, walker, "xml", platform=name).platform == name


def test_a_zero_pose_that_loses_a_freedom_is_called_singular(tmp_path: Path):
    flat = five_bar("").replace('"0.1 0.3 0"', '"0 0.3 0"').replace('"0.05 0.25 0"', '"0 0.3 0"')
    flat = flat.replace('anchor="0.15 0.2 0"', 'anchor="0.15 0 0"')
    stays = read(tmp_path, flat, "xml", platform="b1", base="carriage", keyframe="zero")
    left = read(tmp_path, flat, "xml", platform="b1", base="carriage")
    assert check(stays).postures[0].hidden.singularity_indices.is_type2
    assert any(
        "the zero configuration is a Type 2 singularity of all legs together" in note.text for note in left.notes
    )
    assert not check(left).postures[0].hidden.singularity_indices.is_type2
    assert [each.rank for each in legs(stays).sets] == [each.rank for each in legs(left, seed=1).sets]
