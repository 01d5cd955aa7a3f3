"""Models of MuJoCo and Pinocchio in memory are the robots that they were made from, and have Pinocchio's poses."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hrsynth
from description.foreign.test_models import FIGURES, model
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.joint_coordinates import collect_link_poses
from hrsynth.kinematics.locked_twists import set_zero
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Mechanism
from kinematics.robots import ROBOTS, walked
from strategies import random_rotation

AGREE = 1e-9
JOINTS = {
    "RX": pin.JointModelRX(),
    "revolute": pin.JointModelRevoluteUnaligned(np.array([0.36, 0.48, 0.8])),
    "unbounded": pin.JointModelRUBZ(),
    "PY": pin.JointModelPY(),
    "prismatic": pin.JointModelPrismaticUnaligned(np.array([0.48, 0.6, 0.64])),
    "ball": pin.JointModelSpherical(),
    "ZYX": pin.JointModelSphericalZYX(),
    "planar": pin.JointModelPlanar(),
    "translation": pin.JointModelTranslation(),
    "universal": pin.JointModelUniversal(np.array([1.0, 0, 0]), np.array([0.0, 0.6, 0.8])),
}


def poses(robot: Mechanism, links: Any) -> Array:
    """Poses of links, seen from the first."""
    found = np.array([robot.links[name].pose for name in links])
    return np.asarray(np.linalg.inv(found[0]) @ found)


def in_memory(robot: Mechanism) -> Iterator[Mechanism]:
    """The robot by way of Pinocchio, and by way of MuJoCo's compiled and other models."""
    mujoco = pytest.importorskip("mujoco")
    yield hrsynth.load(robot.to_pinocchio(), platform=robot.platform)
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        made = robot.to_mujoco()
    yield hrsynth.load(made, platform=robot.platform)
    with tempfile.TemporaryDirectory() as folder:
        hrsynth.save(robot, f"{folder}/robot.xml")
        spec = mujoco.MjSpec.from_file(f"{folder}/robot.xml")
        yield hrsynth.load(spec, platform=robot.platform)


def check_same(robot: Mechanism) -> None:
    expected = ObservedRobot.of(robot, samples=3).mobility
    for other in in_memory(robot):
        links = [name for name in robot.links if name in other.links]
        assert len(links) >= len(robot.links) - 1  # a base that is fixed to the world becomes the world
        np.testing.assert_allclose(poses(other, links), poses(robot, links), rtol=0, atol=AGREE)
        assert ObservedRobot.of(other, samples=3).mobility == expected
        assert sum(each.is_actuated for each in other.joints.values()) == sum(
            each.is_actuated for each in robot.joints.values()
        )


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_is_the_same_by_way_of_other_programs(name: str):
    check_same(set_zero(walked(PinocchioModel(hrsynth.load(name)))))


@pytest.mark.some(4)
@pytest.mark.parametrize("name", FIGURES)
def test_robots_of_others_are_the_same_by_way_of_other_programs(name: str):
    check_same(model(name))


@pytest.mark.parametrize("seed", range(6))
def test_links_of_any_pinocchio_tree_are_where_pinocchio_has_them(seed: int):
    """With every type of joint, chains of them in one, links beside their joints, and a random configuration."""
    rng = np.random.default_rng(seed)

    def place(turned: bool = True) -> Any:
        return pin.SE3(random_rotation(rng) if turned else np.eye(3), rng.uniform(-1, 1, 3))

    tree = pin.Model()
    chain = pin.JointModelComposite()
    for each in rng.choice(list(JOINTS), 3, replace=False):
        if each not in ("unbounded", "planar", "ball"):
            chain.addJoint(JOINTS[each], place())
    chain.addJoint(pin.JointModelRY(), place())
    own = [*JOINTS.items(), ("chain", chain)]
    for k in rng.permutation(len(own)):
        name, joint = own[k]
        i = tree.addJoint(int(rng.integers(tree.njoints)), joint, place(), name)
        tree.addBodyFrame(f"{name}_link", i, (pin.SE3.Identity(), place(turned=False), place())[seed % 3], 0)
        tree.addBodyFrame(f"{name}_tool", i, place(), 0)
        tree.appendBodyToJoint(i, pin.Inertia.Random(), place())
    q = pin.randomConfiguration(tree, np.full(tree.nq, -1.0), np.full(tree.nq, 1.0))
    data = tree.createData()
    pin.framesForwardKinematics(tree, data, q)
    robot = hrsynth.load((tree, [], q), platform="PY_tool", as_written=True)
    frames = {each.name: data.oMf[i].homogeneous for i, each in enumerate(tree.frames) if each.name in robot.links}
    assert len(frames) == 2 * len(own)
    start = np.linalg.inv(frames.get(robot.base, np.eye(4)))
    for name, X in frames.items():
        np.testing.assert_allclose(robot.links[name].pose, start @ X, atol=AGREE)


def test_what_is_not_read_is_said_in_a_line():
    tree = pin.Model()
    tree.addJoint(0, pin.JointModelHX(0.1), pin.SE3.Identity(), "screw")
    with pytest.raises(BadRequest, match="joint 'screw' of the model: got 'JointModelHX', expected turns"):
        hrsynth.load(tree)
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><worldbody><body name="a"><joint name="j"/><geom size="1"/></body></worldbody>
    <tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>{}</mujoco>"""
    for what, reason in (
        ("<equality><tendon tendon1='t'/></equality>", "equality 'equality_0' of the model: got 'tendon'"),
        ("<actuator><motor name='pull' tendon='t'/></actuator>", "an actuator of the model: got 'pull'"),
    ):
        with pytest.raises(BadRequest, match=reason):
            hrsynth.load(mujoco.MjModel.from_xml_string(text.format(what)))
    with pytest.raises(BadRequest, match=r"the MjSpec: got .*, expected one that MuJoCo compiles"):
        hrsynth.load(mujoco.MjSpec.from_string(text.format("<equality><weld body1='a' body2='b'/></equality>")))
    with pytest.raises(BadRequest, match="a model of MuJoCo or Pinocchio"):
        hrsynth.load((1, 2))


def test_couplings_and_texts_come_along():
    """Of a robot whose zero configuration is not that of its file."""
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><compiler angle="radian"/><custom><text name="hrsynth_platform_1" data="b"/></custom><worldbody>
    <body name="a"><joint name="j" ref="0.2" range="-1 1"/><geom size="1"/>
    <body name="b"><joint name="k" type="slide" ref="0.1"/><geom size="1"/></body></body></worldbody>
    <equality><joint joint1="k" joint2="j" polycoef="0.3 0.5 0 0 0"/></equality></mujoco>"""
    robot = hrsynth.load(text)
    for other in (hrsynth.load(mujoco.MjModel.from_xml_string(text)), hrsynth.load(mujoco.MjSpec.from_string(text))):
        assert other.platform == robot.platform == "b"
        assert [each.ratio for each in other.couplings] == [0.5]
        assert other.joints["j"].limits == robot.joints["j"].limits
        np.testing.assert_allclose(poses(other, ("a", "b")), poses(robot, ("a", "b")), atol=AGREE)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_keyframe_is_the_configuration_that_was_written(name: str, tmp_path):
    """Bodies of MuJoCo at the key lie where the links do, and both files, read back at it, are the moved robot."""
    mujoco = pytest.importorskip("mujoco")
    robot = hrsynth.load(name)
    moved = collect_link_poses(walked(ObservedRobot.of(robot).all_samples.model))
    assert moved is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = hrsynth.to_mujoco(robot, keyframes={"far": moved})
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("far").id)
        mujoco.mj_kinematics(model, data)
        for link, X in moved.items():
            body = data.body(link)
            np.testing.assert_allclose(body.xpos, X[:3, 3], atol=AGREE)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), X[:3, :3], atol=AGREE)
        for file in ("robot.urdf", "robot.xml"):
            hrsynth.save(robot, tmp_path / file, keyframes={"far": moved})
            read = hrsynth.load(tmp_path / file, keyframe="far")
            np.testing.assert_allclose(poses(read, moved), np.array([*moved.values()]), atol=1e-6)


def test_a_format_without_keyframes_is_refused(tmp_path):
    with pytest.raises(BadRequest, match="got 'sdf', expected mjcf, or native"):
        hrsynth.save("delta", tmp_path / "delta.sdf", keyframes={"zero": {}})
    assert not [*tmp_path.iterdir()]
