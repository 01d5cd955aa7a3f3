"""A written file is a URDF tree to every other loader, with the links where the mechanism has them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from description.samples import every_joint, with_rods
from hrsynth.analysis.derive import derive
from hrsynth.description import build_spanning_mechanism, list_robots, load, native
from hrsynth.errors import BadRequest
from hrsynth.mechanism.model import JointType, Mechanism

ROBOTS = (
    {"rods": with_rods()}
    | {
        f"sorts {seed}": every_joint(
            [kind for kind in JointType if kind is not JointType.FREE] * 2,
            [kind for kind in JointType if kind is not JointType.FREE],
            seed,
        )
        for seed in range(3)
    }
    | {"free": every_joint([JointType.FREE, JointType.PRISMATIC], [JointType.SPHERICAL], 5)}
)
ROBOTS |= {name: load(path) for name, path in list_robots().items()}


@pytest.fixture(params=ROBOTS.values(), ids=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Mechanism:
    """A mechanism as it is written."""
    return build_spanning_mechanism(request.param)


def test_pinocchio_loads_the_tree(robot: Mechanism):
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(native.write(robot))
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for link in robot.links.values():
        frame = model.getFrameId(link.name, pin.FrameType.BODY)
        assert np.allclose(data.oMf[frame].homogeneous, link.pose, atol=1e-10)
    assert model.nv == sum(joint.type.freedoms for joint in robot.joints.values() if joint.in_tree)


def test_yourdfpy_loads_the_tree(robot: Mechanism):
    yourdfpy = pytest.importorskip("yourdfpy")
    loaded = yourdfpy.URDF.load(io.BytesIO(native.write(robot).encode()), load_meshes=False, build_scene_graph=True)
    assert loaded.base_link == robot.base
    assert set(robot.links) <= set(loaded.link_map)
    for link in robot.links.values():
        assert np.allclose(loaded.get_transform(link.name, robot.base), link.pose, atol=1e-10)


@pytest.mark.filterwarnings("ignore")
def test_urdf_parser_py_loads_the_tree(robot: Mechanism):
    urdf = pytest.importorskip("urdf_parser_py.urdf")
    loaded = urdf.URDF.from_xml_string(native.write(robot).encode())
    assert loaded.get_root() == robot.base
    assert set(robot.links) <= set(loaded.link_map)
    for joint in robot.joints.values():
        if joint.in_tree:
            assert loaded.get_chain(robot.base, joint.successor)[-1] == joint.successor


def test_an_object_of_yourdfpy_is_read_as_the_file_that_it_writes(tmp_path: Path):
    yourdfpy = pytest.importorskip("yourdfpy")
    tree = yourdfpy.URDF.load(str(list_robots()["rrrrr_m1"]), load_meshes=False)
    tree.write_xml_file(str(tmp_path / "tree.urdf"))
    said = {
        "close": "dist_1:dist_2@-0.16896249413879,0.10701250195374,0:revolute/0,0,1",
        "motors": "shoulder_1,shoulder_2",
        "platform": "dist_1",
    }
    found = load(tree, **said)
    assert found == load(tmp_path / "tree.urdf", **said)
    assert derive(found).hidden_architecture == derive(load("rrrrr_m1")).hidden_architecture
    assert (found.file, found.sha256) == (str(list_robots()["rrrrr_m1"]), None)
    for other in (5, None, tree.robot):
        with pytest.raises(BadRequest, match=r"expected a path, .*, a yourdfpy\.URDF, a model of MuJoCo or Pinocchio$"):
            load(other)
