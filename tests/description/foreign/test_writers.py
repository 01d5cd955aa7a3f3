"""Written in any dialect and read back, a robot is the same; MuJoCo loads it and counts the same freedoms."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from description.foreign.test_traps import bars, full_mobility, origin, read
from description.samples import FOUR_BAR, every_joint
from hrsynth.description import build_spanning_mechanism, list_robots, load, save
from hrsynth.description.formats import list_writable_formats
from hrsynth.description.formats.mjcf.write import write
from hrsynth.errors import BadRequest
from hrsynth.geometry.ranks import rank_of
from hrsynth.mechanism import JointType, Mechanism

ENDINGS = (".xml", ".sdf", ".yaml")
SOME = ("3rps", "quattro", "rprpr_m1", "gough_stewart")
ROBOTS = [name if name in SOME else pytest.param(name, marks=pytest.mark.slow) for name in list_robots()]
KINDS = [kind for kind in JointType if kind is not JointType.FREE]


def bare(robot: Mechanism) -> Mechanism:
    """Without what only the native dialect keeps."""
    links = {name: replace(link, xml=()) for name, link in robot.links.items()}
    joints = {name: replace(joint, xml=(), limits=None) for name, joint in robot.joints.items()}
    return replace(robot, xml=(), links=links, joints=joints)


@pytest.mark.some(4)
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_shipped_robot_comes_back_the_same(name: str, ending: str, tmp_path: Path):
    robot = load(name)
    lost = save(robot, tmp_path / f"robot{ending}")
    back = load(tmp_path / f"robot{ending}")
    assert back.differences(build_spanning_mechanism(robot)) == []
    assert back.name == robot.name
    assert back.notes == ()
    assert lost == ()


@pytest.mark.some(3)
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("seed", [0, 2])
def test_joints_of_every_type_come_back(seed: int, ending: str, tmp_path: Path):
    robot = build_spanning_mechanism(every_joint([*KINDS, *KINDS], KINDS, seed))
    lost = save(robot, tmp_path / f"robot{ending}")
    back = load(tmp_path / f"robot{ending}")
    fixed = {name for name, joint in robot.joints.items() if joint.type is JointType.FIXED and joint.in_tree}
    names = {name for name in fixed if name not in back.joints}
    renamed = bare(robot).changed(remove_joints=names)
    found = bare(back)
    assert len(found.joints) == len(robot.joints)
    found = found.changed(remove_joints=[name for name in found.joints if name not in robot.joints])
    assert found.differences(renamed) == []
    assert bool(names) is (ending == ".xml")
    assert all(note.kind == "warning" for note in lost)
    assert any("fixed joints" in note.text for note in lost) is bool(names)


def test_gears_are_written_where_the_dialect_has_them(tmp_path: Path):
    text = bars([("p", "one", "base", origin(0)), ("q", "two", "one", origin(1))], "").replace(
        '<child link="two"/>', '<child link="two"/><mimic joint="p" multiplier="-2"/>'
    )
    robot = read(tmp_path, text)
    for ending in ENDINGS:
        assert save(robot, tmp_path / f"out{ending}") == ()
        back = load(tmp_path / f"out{ending}")
        assert [(c.driver, c.driven, c.ratio) for c in back.couplings] == [("p", "q", -2.0)]
        assert full_mobility(back) == 1
    twice = robot.changed(couplings=[*robot.couplings, replace(robot.couplings[0], name="again")])
    (lost,) = save(twice, tmp_path / "out.sdf")
    assert "mimic_q" in lost.text


@pytest.mark.parametrize("ending", [*ENDINGS, ".usda"])
def test_a_joint_keeps_the_name_that_a_link_has_too(ending: str, tmp_path: Path):
    if ending == ".usda":
        pytest.importorskip("pxr")
    text = FOUR_BAR.replace('"crank"', '"a"').replace('"rocker"', '"b"').replace('"c"', '"b c"').replace('"bar"', '"d"')
    (tmp_path / "robot.urdf").write_text(text)
    robot = load(tmp_path / "robot.urdf")
    save(robot, tmp_path / f"out{ending}")
    back = load(tmp_path / f"out{ending}")
    assert bare(back).differences(bare(robot)) == []
    assert [joint.name for joint in back.joints.values() if joint.is_actuated] == ["a"]


def test_an_unknown_dialect_is_refused_and_the_given_one_counts(tmp_path: Path):
    with pytest.raises(BadRequest, match=", ".join(each.name for each in list_writable_formats())):
        save(load("3rps"), tmp_path / "a.urdf", "step")
    save(load("3rps"), tmp_path / "a.txt", "sdf")
    assert load(tmp_path / "a.txt").differences(load("3rps")) == []


@pytest.mark.parametrize(("tree", "loops"), [("a", "a"), ("tree", "loops"), ("robot", "robot")])
def test_of_two_files_that_are_read_together_none_is_replaced_alone(tmp_path: Path, tree: str, loops: str):
    save(load("3rrr_m1"), tmp_path / "a.yaml")
    pair = [
        (tmp_path / "a.urdf").rename(tmp_path / f"{tree}.urdf"),
        (tmp_path / "a.yaml").rename(tmp_path / f"{loops}.yaml"),
    ]
    before = [each.read_bytes() for each in pair]
    assert load(pair[1]).differences(load("3rrr_m1")) == []
    for path, other in (pair, pair[::-1]):
        words = "with other content" if tree == loops and path is pair[1] else f"{other.name} next to it"
        with pytest.raises(BadRequest, match=words) as caught:
            save(load("delta"), path)
        assert re.search("another name|another output", str(caught.value))
        assert len(caught.value.lines()) == 1
    assert [each.read_bytes() for each in pair] == before
    save(load("delta"), tmp_path / "delta.urdf")
    save(load("delta"), tmp_path / "delta.urdf")


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_loads_what_is_written_and_counts_the_same_freedoms(name: str):
    mujoco = pytest.importorskip("mujoco")
    robot = load(name)
    model = mujoco.MjModel.from_xml_string(write(robot).texts[0])
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    J = data.efc_J.reshape(-1, model.nv)[: data.ne]
    rank = rank_of(np.linalg.svd(J, compute_uv=False)).decided(name)
    assert np.max(np.abs(data.efc_pos[: data.ne])) < 1e-12
    assert model.nv - rank == full_mobility(robot)
    assert model.nu >= sum(joint.is_actuated for joint in robot.joints.values())


def test_links_and_joints_of_sdf_share_no_name(tmp_path: Path):
    """As SDFormat demands since 1.7; what comes back is tested above."""
    save(build_spanning_mechanism(every_joint(KINDS, KINDS, 0)), tmp_path / "robot.sdf")
    names = [each.get("name") for each in etree.parse(tmp_path / "robot.sdf").iter("link", "joint")]
    assert len(set(names)) == len(names)


def test_which_limits_mjcf_loses_is_told_apart(tmp_path: Path):
    bound = '<axis xyz="0 1 0"/><limit lower="-1" upper="1"/>\n  </loop>'
    text = FOUR_BAR.replace('<axis xyz="0 1 0"/>\n  </loop>', bound)
    (tmp_path / "robot.urdf").write_text(text)
    lost = [note.text for note in save(load(tmp_path / "robot.urdf"), tmp_path / "out.xml")]
    assert lost == [
        "limits of closures are not written: d",
        "limits of velocity and force or torque are not written: a",
    ]
    limits = load(tmp_path / "out.xml", as_written=True).joints["a"].limits
    assert limits is not None
    assert (limits.lower, limits.upper) == (-1.0, 1.0)


def test_names_that_sdf_has_no_place_for_are_told(tmp_path: Path):
    (tmp_path / "robot.urdf").write_text(FOUR_BAR.replace('"crank"', '"a"').replace('"b"', '"b::c"'))
    (lost,) = save(load(tmp_path / "robot.urdf"), tmp_path / "out.sdf")
    assert all(each in lost.text for each in ("'a' (of a link and a joint)", "'b::c'"))
    (tmp_path / "robot.urdf").write_text(FOUR_BAR.replace('"crank"', '"__model__"'))
    with pytest.raises(BadRequest, match="__model__"):
        save(load(tmp_path / "robot.urdf"), tmp_path / "out.sdf")
