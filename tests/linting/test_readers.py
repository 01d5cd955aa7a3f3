"""What is said of other programs is what they do, where they are installed."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest

import hrsynth
from description.foreign.examples import URDF
from hrsynth.linting.rules.readers import ASKED, CONSTRUCTS, PROGRAMS, READ, REFUSED, SILENT, TOLD

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
WRITTEN = {
    "urdf+": "loop",
    "two joints, one child": "second joint of one child",
    "gazebo": "gazebo/joint",
    "constraint": "constraint",
    "loop_joint": "loop_joint",
    "onshape": "closing frames",
}
MODEL = """<mujoco><compiler angle="radian"/><worldbody><body name="a">
 <inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><joint name="ja" axis="0 1 0"/>
 <body name="b" pos="0 0 1"><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><joint name="jb" axis="0 1 0"/></body>
 <body name="c" pos="1 0 0"><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><joint name="jc" axis="0 1 0"/></body>
</body></worldbody><equality>{}</equality></mujoco>"""
EQUALITIES = {
    "equality/connect": '<connect name="x" body1="b" body2="c" anchor="0 0 0.1"/>',
    "equality/weld": '<weld name="x" body1="b" body2="c"/>',
    "equality/joint": '<joint name="x" joint1="jb" joint2="jc" polycoef="0 2 0 0 0"/>',
}


def with_masses(name: str) -> str:
    return re.sub(r'<link name="([^"]*)"/>', rf'<link name="\1">{INERTIAL}</link>', URDF[name])


def test_the_table_speaks_of_known_programs_in_known_words():
    for known in CONSTRUCTS.values():
        assert set(known) <= set(PROGRAMS)
        assert set(known.values()) <= {SILENT, REFUSED, READ, TOLD, ASKED}


@pytest.mark.parametrize("name", WRITTEN)
def test_mujoco_reads_of_a_urdf_what_is_said(name: str):
    mujoco = pytest.importorskip("mujoco")
    said = CONSTRUCTS[WRITTEN[name]]["mujoco"]
    if said == REFUSED:
        with pytest.raises(ValueError):
            mujoco.MjModel.from_xml_string(with_masses(name))
    else:
        model = mujoco.MjModel.from_xml_string(with_masses(name))
        assert (said, model.neq, model.nv) == (SILENT, 0, 3)


@pytest.mark.parametrize("name", WRITTEN)
def test_pinocchio_reads_of_a_urdf_what_is_said(name: str):
    import pinocchio as pin

    assert CONSTRUCTS[WRITTEN[name]]["pinocchio"] == SILENT
    assert pin.buildModelFromXML(with_masses(name)).nv == 3


@pytest.mark.parametrize("name", WRITTEN)
def test_yourdfpy_reads_of_a_urdf_what_is_said(name: str):
    yourdfpy = pytest.importorskip("yourdfpy")
    said = CONSTRUCTS[WRITTEN[name]]["yourdfpy"]
    text = io.BytesIO(with_masses(name).encode())
    if said == REFUSED:
        with pytest.raises(ValueError):
            yourdfpy.URDF.load(text, load_meshes=False)
    else:
        assert (said, yourdfpy.URDF.load(text, load_meshes=False).num_dofs) == (SILENT, 3)


@pytest.mark.parametrize("construct", EQUALITIES)
def test_equalities_of_mjcf_are_read_as_is_said(construct: str, tmp_path: Path):
    import pinocchio as pin

    path = tmp_path / "robot.xml"
    path.write_text(MODEL.format(EQUALITIES[construct]))
    _, *constraints = pin.buildModelAndConstraintsFromMJCF(str(path))
    asked = sum(len(each) for each in constraints) > 0
    assert CONSTRUCTS[construct]["pinocchio"] == (ASKED if asked else SILENT)
    mujoco = pytest.importorskip("mujoco")
    assert mujoco.MjModel.from_xml_path(str(path)).neq == 1
    assert CONSTRUCTS[construct]["mujoco"] == READ


def test_mimics_are_read_as_is_said():
    import pinocchio as pin

    text = (
        f'<robot name="m"><link name="a">{INERTIAL}</link><link name="b">{INERTIAL}</link><link name="c">{INERTIAL}'
        '</link><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
        '<joint name="k" type="continuous"><parent link="a"/><child link="c"/><mimic joint="j"/></joint></robot>'
    )
    assert (CONSTRUCTS["mimic"]["pinocchio"], pin.buildModelFromXML(text).nv) == (SILENT, 2)
    mujoco = pytest.importorskip("mujoco")
    assert (CONSTRUCTS["mimic"]["mujoco"], mujoco.MjModel.from_xml_string(text).neq) == (READ, 1)


@pytest.mark.some(2)
@pytest.mark.parametrize("name", WRITTEN)
def test_the_construct_of_a_file_is_recognised(name: str, tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(URDF[name])
    (found,) = [each for each in hrsynth.lint(path).findings if each.rule == "program-drops"]
    assert f"({WRITTEN[name]}): " in found.message
    assert found.severity == "note"
    asked = [each for each in hrsynth.lint(path, program=["mujoco", "isaac"]).findings if each.rule == "program-drops"]
    programs = {each.message.split("): ")[1].split()[0] for each in asked}
    assert programs == ({"mujoco"} if name in ("loop_joint", "two joints, one child") else {"mujoco", "isaac"})
    assert {each.severity for each in asked} == {"error"}


@pytest.mark.parametrize("name", ["rrrrr_m1", "quattro"])
def test_loops_of_an_articulation_must_be_excluded_for_isaac(name: str, tmp_path: Path):
    """As many joints as Euler's count of loops are named, and the command of the advice leaves none."""
    pytest.importorskip("pxr")
    path, written = tmp_path / "robot.usda", tmp_path / "OUT.usda"
    hrsynth.save(name, path)
    assert not any(each.rule == "program-drops" for each in hrsynth.lint(path, program="isaac").findings)
    whole = path.read_text()
    path.write_text(re.sub(r".*excludeFromArticulation.*\n", "", whole))
    robot = hrsynth.load(path)
    loops = len(robot.joints) - len(robot.links) + 1
    told = [each for each in hrsynth.lint(path, program="isaac").findings if each.rule == "program-drops"]
    assert len(told) == loops == whole.count("excludeFromArticulation")
    assert all("excludeFromArticulation" in str(each.advice) and "OUT.usda" in str(each.advice) for each in told)
    hrsynth.save(robot, written)
    assert not any(each.rule == "program-drops" for each in hrsynth.lint(written, program="isaac").findings)
    path.write_text(path.read_text().replace("PhysicsArticulationRootAPI", "OtherAPI"))
    assert not any(each.rule == "program-drops" for each in hrsynth.lint(path, program="isaac").findings)


@pytest.mark.parametrize("program", ["mujoco", "isaac", "gazebo-classic"])
def test_advice_is_about_the_program_that_was_named(program: str, tmp_path: Path):
    if program == "isaac":
        pytest.importorskip("pxr")
    path = tmp_path / "robot.urdf"
    path.write_text(URDF["urdf+"])
    (found,) = [each for each in hrsynth.lint(path, program=program).findings if each.rule == "program-drops"]
    (ending,) = re.findall(r"hrsynth convert IN OUT(\.\w+)", str(found.advice))
    hrsynth.save(hrsynth.load(path, platform="bar"), tmp_path / f"out{ending}")
    after = hrsynth.lint(tmp_path / f"out{ending}", program=program).findings
    assert not any(each.rule == "program-drops" for each in after)
