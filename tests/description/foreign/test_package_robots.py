"""The robots of example-robot-data: read as open chains, as yourdfpy reads them; its robot with closed loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hrsynth.analysis.check import check
from hrsynth.description import formats, load
from hrsynth.description.jointgraph import JointGraph
from hrsynth.description.reading import open_robot_file
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import JointType


def folder() -> Path | None:
    """Where the package keeps its robots."""
    import sys

    for path in sys.path:
        robots = Path(path) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
        if robots.is_dir():
            return robots
    return None


ROBOTS = folder()
FILES = [] if ROBOTS is None else sorted(ROBOTS.rglob("*.urdf"))
pytestmark = pytest.mark.skipif(ROBOTS is None, reason="example-robot-data is not installed")
EMPTY = "ur3.urdf"  # macros alone, no links


def read(path: Path) -> JointGraph:
    found = formats.read(open_robot_file(path))
    assert isinstance(found, JointGraph)
    return found


@pytest.mark.some(23)
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_yourdfpy_agrees_on_every_tree(path: Path):
    if path.name == EMPTY:
        with pytest.raises(BadRobotFile, match="no links"):
            read(path)
        return
    yourdfpy = pytest.importorskip("yourdfpy")
    theirs = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=False).robot
    ours = read(path)
    assert set(ours.links) == {link.name for link in theirs.links}
    assert set(ours.joints) == {joint.name for joint in theirs.joints}
    for joint in theirs.joints:
        edge = ours.joints[joint.name]
        assert edge.links == (joint.parent, joint.child)
        assert (edge.type is JointType.FIXED) == (joint.type == "fixed")
        origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin)
        assert np.allclose(edge.ends[0].X, origin, atol=1e-12)
        if edge.axes:
            assert np.linalg.norm(np.cross(edge.axes[0], joint.axis)) < 1e-9 * np.linalg.norm(joint.axis)
            assert edge.axes[0] @ joint.axis > 0
    gears = {
        (joint.name, joint.mimic.joint, joint.mimic.multiplier)
        for joint in theirs.joints
        if joint.mimic is not None and joint.mimic.joint in ours.joints and joint.type != "fixed"
    }
    assert {(gear.driven, gear.driver, gear.ratio) for gear in ours.gears} == {
        (driven, driver, 1.0 if ratio is None else ratio)
        for driven, driver, ratio in gears
        if ours.joints[driver].type is not JointType.FIXED
    }


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
@pytest.mark.slow
def test_every_tree_is_a_mechanism(path: Path):
    if path.name == EMPTY:
        pytest.skip("macros alone")
    graph = read(path)
    carried = {edge.links[1] for edge in graph.joints.values()}
    tips = [link for link in graph.links if link in carried and all(link != e.links[0] for e in graph.joints.values())]
    if all(edge.type is JointType.FIXED for edge in graph.joints.values()):
        with pytest.raises(BadRequest, match="no link moves"):
            load(path)
        return
    robot = load(path, platform=tips[-1])
    model = PinocchioModel(robot)
    free = sum(joint.type.freedoms for joint in robot.joints.values())
    assert ClosedConfiguration.of(model, model.q0).kernel()[0].shape[1] == free - len(robot.couplings)


# closed loops: freedoms of the whole with its pelvis held, and of one leg between pelvis and foot
LEGS = {
    "cassie.sdf": (10, 5),
    "cassie_v2.sdf": (12, 6),
    "cassie_simple.sdf": (11, 5),
    "cassie_reduced.sdf": (11, 5),
    "cassie_wo_gearbox_spring.sdf": (13, 6),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [each if each == "cassie.sdf" else pytest.param(each, marks=pytest.mark.slow) for each in LEGS]
)
def test_its_robot_with_closed_loops_has_its_mobility(name: str):
    assert ROBOTS is not None
    path = ROBOTS / "cassie_description" / "robots" / name
    whole, leg = LEGS[name]
    for freedoms, robot in (
        (whole, load(path, platform="left-foot")),
        (leg, load(path, base="pelvis", platform="left-foot")),
    ):
        model = PinocchioModel(robot)
        kernel, rank = ClosedConfiguration.of(model, model.q0).kernel()
        assert kernel.shape[1] == freedoms
        assert rank.gap > 1e3


@pytest.mark.slow
def test_a_leg_is_checked_between_pelvis_and_foot():
    assert ROBOTS is not None
    path = ROBOTS / "cassie_description" / "robots" / "cassie.sdf"
    for side in ("left", "right"):
        found = check(load(path, base="pelvis", platform=f"{side}-foot"))
        assert found.postures[0].dof == 5
        assert found.postures[0].has_decided_ranks
