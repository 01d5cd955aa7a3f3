"""Elements of MJCF that stand for others, and conventions of a document: as MuJoCo reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from description.foreign.test_couplings import assert_same_motions
from description.foreign.test_traps import full_mobility
from hrsynth.description import load
from hrsynth.errors import BadRobotFile
from hrsynth.mechanism import Mechanism

mujoco = pytest.importorskip("mujoco")
pytestmark = [
    pytest.mark.filterwarnings(f"ignore::hrsynth.errors.{each}") for each in ("AssumedPlatform", "AssumedBase")
]

LEG = (
    '<body name="b" pos="0 0 1"><joint name="k" axis="1 0 0" range="-20 30"/><geom size="0.1"/><site name="s"/>'
    '<body name="c" pos="0.3 0 0"><joint name="l" type="slide" axis="0 0 1"/><geom size="0.1"/></body></body>'
)
TIES = (
    '<tendon><fixed name="t"><joint joint="k" coef="1"/><joint joint="l" coef="0.5"/></fixed></tendon>'
    '<equality><tendon tendon1="t"/></equality><actuator><motor name="m" joint="k"/></actuator>'
)
CHILD = """<mujoco model="child"><compiler angle="radian" eulerseq="zyx"/>
<default><joint range="-1 1" axis="0 1 0"/><default class="c"><joint range="-.5 .5"/></default></default>
<worldbody><body name="b" pos="0 0 1" euler=".1 .2 .3"><joint name="k"/><geom size="0.1"/>
<body name="c" childclass="c" pos=".1 0 0"><joint name="l"/><geom size="0.1"/><site name="s"/>
<frame name="f" pos="0 1 0" euler=".3 0 .1"><body name="d"><joint name="n"/><geom size="0.1"/></body></frame>
</body></body><body name="w" pos="0 2 0"><joint name="o"/><geom size="0.1"/></body></worldbody>
<equality><joint name="e" joint1="k" joint2="l" polycoef="0 2 0 0 0"/><joint joint1="n" joint2="o"/></equality>
<actuator><motor joint="l"/><motor name="m" joint="o"/></actuator></mujoco>"""
MODELS = (
    '<asset><model name="child" file="parts/child.xml"/></asset><default><joint type="slide" range="1 2"/></default>'
)


def assert_read_as_by_mujoco(folder: Path, text: str) -> Mechanism:
    """Bodies, joints, ranges, motors and couplings of a chain or tree."""
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "child.xml").write_text(CHILD)
    (folder / "robot.xml").write_text(text)
    robot = load(folder / "robot.xml", platform=text.partition("platform ")[2].partition(" ")[0])
    model = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = {model.body(k).name: data.body(k) for k in range(model.nbody)}
    assert bodies.keys() == robot.links.keys()
    for name, link in robot.links.items():
        assert np.allclose(link.pose[:3, 3], bodies[name].xpos, atol=1e-12)
        assert np.allclose(link.pose[:3, :3].ravel(), bodies[name].xmat, atol=1e-12)
    joints = [model.joint(k) for k in range(model.njnt)]
    assert [each.name for each in joints] == list(robot.joints)
    for each, joint in zip(joints, robot.joints.values(), strict=True):
        given = (0, 0) if joint.limits is None else (joint.limits.lower, joint.limits.upper)
        assert np.allclose(model.jnt_range[each.id], given)
        assert (joint.type.value == "P") == (each.type[0] == mujoco.mjtJoint.mjJNT_SLIDE)
        assert np.allclose(joint.axis, data.joint(each.id).xaxis)
    driven = {joints[k].name for k in model.actuator_trnid[:, 0]}
    assert {joint.name for joint in robot.joints.values() if joint.is_actuated} == driven
    assert_same_motions(robot, np.array(data.efc_J).reshape(-1, model.nv)[: data.ne])
    return robot


def model(inside: str, more: str = "") -> str:
    return f'<mujoco><worldbody><geom size="0.1"/>{inside}</worldbody>{more}</mujoco>'


@pytest.mark.parametrize(
    "text",
    [
        model(f'<replicate count="3" euler="0 0 120" offset=".1 .2 .3">{LEG}</replicate><!-- platform c2 -->', TIES),
        model(f'<replicate count="12" sep="-" euler="10 20 30">{LEG}</replicate><!-- platform c-07 -->', TIES),
        model(
            '<replicate count="2" offset="1 0 0" sep="_"><replicate count="3" euler="0 30 0">'
            f"{LEG}</replicate></replicate><!-- platform c1_0 -->",
            TIES,
        ),
        model(
            '<body name="a" pos="1 0 0"><joint name="j"/><geom size="0.1"/><frame euler="90 0 0">'
            f'<replicate count="2" euler="0 0 90">{LEG}</replicate></frame></body><!-- platform c0 -->',
            TIES,
        ),
        *(
            model(
                f'<body name="z" pos="5 0 0"><joint name="j"/><geom size="0.1"/>{attached}</body>'
                f"<!-- platform {platform} -->",
                MODELS,
            )
            for attached, platform in (
                ('<attach model="child" body="b" prefix="L"/>', "Ld"),
                ('<attach model="child" prefix="L"/>', "Ld"),
                ('<attach model="child" body="c" prefix="L"/>', "Ld"),
                ('<attach model="child" frame="f" prefix="L"/>', "Ld"),
                ('<attach model="child" body="d" prefix="L"/>', "Ld"),
                ('<frame pos="1 0 0" euler="0 0 90"><attach model="child" body="b" prefix="R_"/></frame>', "R_d"),
                ('<attach model="child" body="b" prefix="L"/><attach model="child" body="b" prefix="M"/>', "Ld"),
            )
        ),
        model(
            '<frame childclass="c" pos="0 0 1" axisangle="1 0 0 30"><body name="b"><joint name="k"/><geom size="0.1"/>'
            '<body name="p" euler="10 20 30"><joint name="l" class="d"/><geom size="0.1"/></body></body></frame>'
            "<!-- platform p -->",
            '<compiler eulerseq="XzY"/><default><joint axis="0 1 0"/><default class="c"><joint range="-90 45"/>'
            '<default class="d"><joint type="slide"/></default></default></default>',
        ),
    ],
)
def test_what_stands_for_other_elements_is_read_as_mujoco_does(text: str, tmp_path: Path):
    assert_read_as_by_mujoco(tmp_path, text)


def test_an_attached_model_that_is_written_again_has_its_meshes_and_colours(tmp_path: Path):
    child = CHILD.replace(
        "<worldbody>",
        '<asset><mesh name="hull" file="hull.stl"/></asset><worldbody><geom type="mesh" mesh="hull"/>',
    ).replace('<geom size="0.1"/>', '<geom type="mesh" mesh="hull"/>', 1)
    child = child.replace('angle="radian"', 'angle="radian" meshdir="meshes"')
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "child.xml").write_text(child)
    (tmp_path / "robot.xml").write_text(model('<attach model="child" body="b" prefix="L"/>', MODELS))
    text = "".join(load(tmp_path / "robot.xml").links["Lb"].xml)
    assert 'filename="parts/meshes/hull.stl"' in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            model('<attach model="none" body="b" prefix="L"/>', MODELS),
            "<attach>: unknown model: got none, expected child",
        ),
        (model('<attach model="child" body="none"/>', MODELS), "<attach>: unknown body of model 'child': got none"),
        (model("", '<asset><model file="../out.xml"/></asset>'), "<model>: outside of the model's folder"),
        (model("", '<asset><model file="robot.xml"/></asset>'), "<model>: repeated file"),
        (model("", '<asset><model file="parts/ring.xml"/></asset>'), "ring.xml:1: <model>: repeated file"),
        (model("", '<asset><model file="none.xml"/></asset>'), "<model>: no such file"),
        (model("", '<asset><model file="parts/copies.xml"/></asset>'), "root element: got replicate, expected mujoco"),
        (model("", '<asset><model file="/etc/passwd"/></asset>'), "<model>: outside of the model's folder"),
        (model(f'<replicate count="x">{LEG}</replicate>'), "count: got x, expected a whole number"),
        (model(f'<replicate count="99999999">{LEG}</replicate>'), "expected a whole number of up to 4 digits"),
        (model(f'<replicate count="9999">{LEG}</replicate>'), "<replicate>: too many elements with all copies"),
        (
            model('<replicate count="99">' * 9 + LEG + "</replicate>" * 9),
            "<replicate>: too many elements with all copies",
        ),
        (
            model(
                f'<replicate count="2">{LEG}</replicate>', '<equality><connect body1="b" anchor="0 0 0"/></equality>'
            ).replace("connect body1", 'connect body2="c1" body1'),
            "connect of an unknown body: got b",
        ),
    ],
)
def test_other_models_and_copies_stay_in_bounds(text: str, words: str, tmp_path: Path):
    (tmp_path / "out.xml").write_text(CHILD)
    (tmp_path / "in" / "parts").mkdir(parents=True)
    (tmp_path / "in" / "parts" / "child.xml").write_text(CHILD)
    (tmp_path / "in" / "parts" / "ring.xml").write_text(model("", '<asset><model file="ring.xml"/></asset>'))
    (tmp_path / "in" / "parts" / "copies.xml").write_text('<replicate count="2"/>')
    (tmp_path / "in" / "robot.xml").write_text(text)
    with pytest.raises(BadRobotFile) as caught:
        load(tmp_path / "in" / "robot.xml")
    (line,) = caught.value.lines()
    assert words in line


def test_models_in_models_are_not_read_too_deep(tmp_path: Path):
    for number in range(8):
        attach = f'<attach model="m{number + 1}" prefix="p"/>' if number < 7 else LEG
        asset = f'<asset><model name="m{number + 1}" file="m{number + 1}.xml"/></asset>' if number < 7 else ""
        (tmp_path / f"m{number}.xml").write_text(model("<frame>" * 230 + attach + "</frame>" * 230, asset))
    with pytest.raises(BadRobotFile, match="too deep"):
        load(tmp_path / "m0.xml")


def test_a_defect_of_an_attached_model_is_told_with_its_file_and_line(tmp_path: Path):
    (tmp_path / "child.xml").write_text(CHILD.replace('joint name="l"', 'joint name="l" axis="0 0 x"'))
    (tmp_path / "robot.xml").write_text(
        model('<attach model="child" prefix="L"/>', '<asset><model name="child" file="child.xml"/></asset>')
    )
    with pytest.raises(BadRobotFile) as caught:
        load(tmp_path / "robot.xml")
    assert [f"{tmp_path / 'child.xml'}:4: " in line for line in caught.value.lines()] == [True]


def test_equalities_that_the_file_switches_off_are_told(tmp_path: Path):
    tie = '<equality><joint name="e" joint1="k" joint2="l"/></equality><option><flag equality="{}"/></option>'
    for flag, count in (("enable", 1), ("disable", 0)):
        (tmp_path / "robot.xml").write_text(model(LEG, tie.format(flag)))
        robot = load(tmp_path / "robot.xml")
        assert len(robot.couplings) == count
        assert any("the inactive equality 'e'" in note.text for note in robot.notes) is (flag == "disable")


@pytest.mark.parametrize(("scale", "kind"), [("", "F"), ('torquescale="2"', "F"), ('torquescale="0"', "S")])
def test_a_weld_without_torque_is_a_point(scale: str, kind: str, tmp_path: Path):
    """As MuJoCo's rank: three rows that hold directions are zero."""
    loose = '<body name="p" pos="0 0 2"><freejoint name="g"/><geom size="0.1"/></body>'
    tie = f'<equality><weld name="e" body1="c" body2="p" anchor="0.1 0 0" {scale}/></equality>'
    (tmp_path / "robot.xml").write_text(model(LEG + loose, tie))
    robot = load(tmp_path / "robot.xml", platform="p", as_written=True)
    assert robot.joints["e"].type.value == kind
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    read.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(read)
    mujoco.mj_forward(read, data)
    rank = np.linalg.matrix_rank(np.array(data.efc_J).reshape(-1, read.nv)[: data.ne])
    assert rank == 6 - robot.joints["e"].type.freedoms


def test_an_open_chain_that_floats_stands_on_its_trunk(tmp_path: Path):
    """Its mobility is that of MuJoCo's model without the six coordinates of the trunk."""
    arm = LEG.replace('name="b"', 'name="arm"').replace(
        "</body></body>", '</body></body><body name="wheel"><joint/></body>'
    )
    trunk = f'<body name="hull" pos="0 0 1"><freejoint/><geom size="0.1"/>{arm}</body>'
    text = model(
        trunk.replace("<joint/>", '<joint/><geom size="0.1"/>'), '<equality><joint joint1="l" joint2="k"/></equality>'
    )
    (tmp_path / "robot.xml").write_text(text)
    for base in (None, "hull"):
        robot = load(tmp_path / "robot.xml", platform="c", base=base)
        assert robot.base == "hull"
        assert all(joint.type.value != "6" for joint in robot.joints.values())
        read = mujoco.MjModel.from_xml_string(text)
        assert full_mobility(robot) == read.nv - 6 - 1 - (base is not None)
    told = " ".join(note.text for note in load(tmp_path / "robot.xml", platform="c").notes)
    assert "'hull' floats on the free joint 'hull_joint': it is the base; the link below it is left out" in told
