"""Couplings of joints: read in MJCF as MuJoCo holds them, kept by every dialect, never lost in a joint of several."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from description.foreign.test_traps import full_mobility
from hrsynth.description import load, save
from hrsynth.errors import BadRobotFile
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::hrsynth.errors.AssumedPlatform")

ENDINGS = (".urdf", ".sdf", ".usda", ".xml")
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1", "s": "0.6 0 0.8"}


def arm(axes: str, more: str) -> str:
    """A chain of joints q0, q1 … with these axes (capital letters: slides); all rotations meet in one point."""
    text = "".join(
        f'<body name="p{k}" pos="{0.1 if letter.isupper() else 0} 0 0"><joint name="q{k}" axis="{AXES[letter.lower()]}"'
        f' type="{"slide" if letter.isupper() else "hinge"}"/><geom size="0.01"/>'
        for k, letter in enumerate(axes)
    )
    return (
        '<mujoco><compiler angle="radian"/><worldbody><geom size="0.01"/>'
        f"{text}{'</body>' * len(axes)}</worldbody>{more}</mujoco>"
    )


def read(folder: Path, text: str, **given: str) -> Mechanism:
    (folder / "arm.xml").write_text(text)
    return load(folder / "arm.xml", **given)


def equality_rows(text: str, q: Array | None = None) -> Array:
    """MuJoCo's rows of the equalities at q, one column a joint."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    data.qpos[:] = data.qpos if q is None else q
    mujoco.mj_forward(model, data)
    return np.array(data.efc_J).reshape(-1, model.nv)[: data.ne]


def assert_same_motions(robot: Mechanism, rows: Array) -> None:
    """The couplings of a chain allow the velocities that MuJoCo's rows allow."""
    joints = list(robot.joints)
    own = np.zeros((len(robot.couplings), len(joints)))
    for row, each in zip(own, robot.couplings, strict=True):
        row[joints.index(each.driven)] = 1.0
        row[joints.index(each.driver)] = -each.ratio
    ranks = [np.linalg.matrix_rank(each, 1e-9) for each in (own, rows, np.vstack([own, rows]))]
    assert ranks == [len(rows)] * 3


@pytest.mark.parametrize("axes", ["zyy", "zxs", "zyx", "zzy", "Zzy", "yYX", "szyx"])
def test_no_dialect_loses_a_coupling_in_a_joint_of_several(axes: str, tmp_path: Path):
    """Axes that meet at right angles, in one point or coincide are joined to U, S or R, unless they are coupled."""
    rng = np.random.default_rng(len(axes) + ord(axes[1]))
    for number in range(2):
        driver, driven = rng.permutation(len(axes))[:2]
        one = f'<joint joint1="q{driven}" joint2="q{driver}" polycoef="0 {rng.uniform(0.5, 2)} 0 0 0"/>'
        text = arm(axes, f"<equality>{one}</equality>")
        robot = read(tmp_path, text)
        assert_same_motions(robot, equality_rows(text))
        for ending in ENDINGS:
            lost = save(robot, tmp_path / f"again{number}{ending}")
            if ending == ".usda" and axes[driver].isupper() != axes[driven].isupper():
                assert [note.text.endswith("translation; not written: joint") for note in lost] == [True]
                continue
            again = load(tmp_path / f"again{number}{ending}")
            normal = reduce_to_normal_form(again).mechanism
            assert full_mobility(again) == full_mobility(normal) == len(axes) - 1
            assert normal.couplings == again.couplings


@pytest.mark.parametrize("tag", ["joint", "tendon"])
@pytest.mark.parametrize("name", ["", 'name="{}"', 'name="q{}"'])
def test_equalities_keep_apart_whatever_their_names(tag: str, name: str, tmp_path: Path):
    tendons = "".join(
        f'<fixed name="t{k}"><joint joint="q{k}" coef="2"/><joint joint="q{k + 2}" coef="1"/></fixed>' for k in (0, 1)
    )
    pairs = {
        "joint": 'joint1="q{0}" joint2="q{1}" polycoef="0 -1 0 0 0"',
        "tendon": 'tendon1="t{0}"',
    }
    equalities = "".join(f"<{tag} {name.format(k)} {pairs[tag].format(k, k + 2)}/>" for k in (0, 1))
    text = arm("zyxz", f"<tendon>{tendons}</tendon><equality>{equalities}</equality>")
    robot = read(tmp_path, text)
    assert_same_motions(robot, equality_rows(text))
    assert len({each.name for each in robot.couplings} | {*robot.joints} | {*robot.links}) == 2 + 4 + 5
    for ending in ENDINGS:
        save(robot, tmp_path / f"again{ending}")
        again = load(tmp_path / f"again{ending}")
        assert_same_motions(again, equality_rows(text))


def tendon(name: str, **pulled: float) -> str:
    return (
        f'<fixed name="{name}">' + "".join(f'<joint joint="{q}" coef="{c}"/>' for q, c in pulled.items()) + "</fixed>"
    )


TENDONS = "".join(
    (
        tendon("a", q0=0.7, q1=-1.3),
        tendon("b", q1=0.5),
        tendon("c", q1=0.4, q0=1.1),
        tendon("d", q2=-0.8),
        tendon("e", q2=1.0, q1=2.0),
    )
)


@pytest.mark.parametrize(
    "equalities",
    [
        '<tendon tendon1="a"/>',
        '<tendon tendon1="a" tendon2="b"/>',
        '<tendon tendon1="a" tendon2="c"/>',
        '<tendon tendon1="a" tendon2="c" polycoef="0 0.5 0 0 0"/>',
        '<tendon tendon1="b" tendon2="d" polycoef="0 -0.3 0 0 0"/>',
        '<tendon tendon1="d" tendon2="b" polycoef="0 0.3 0.2 -0.5 1"/>',
        '<tendon tendon1="a"/><tendon tendon1="e"/>',
        '<joint joint1="q2" joint2="q0" polycoef="0 0.3 0.2 -0.5 1"/><tendon tendon1="a"/>',
    ],
)
def test_relations_of_joints_are_those_of_mujoco(equalities: str, tmp_path: Path):
    """At zero and at a keyframe: MuJoCo's own rows there."""
    start, rng = np.zeros(3), np.random.default_rng(3)
    for name in ("zero", "k"):
        text = arm("yxZ", f"<tendon>{TENDONS}</tendon><equality>{equalities}</equality>")
        key = f'<keyframe><key name="k" qpos="{" ".join(map(repr, map(float, start)))}"/></keyframe></mujoco>'
        robot = read(tmp_path, text.replace("</mujoco>", key), keyframe=name)
        q = np.array([0.0 if joint.offset is None else -joint.offset[0] for joint in robot.joints.values()])
        rows = equality_rows(text, -q)
        assert_same_motions(robot, rows)
        start = rng.uniform(-0.4, 0.4, 3)


def test_a_curve_is_told_with_its_slope(tmp_path: Path):
    text = arm("yx", '<equality><joint joint1="q1" joint2="q0" polycoef="0.1 1.05 -0.12 0.02 0"/></equality>')
    key = '<keyframe><key name="k" qpos="0.5 0.6"/></keyframe></mujoco>'
    robot = read(tmp_path, text.replace("</mujoco>", key), keyframe="k")
    slope = 1.05 - 2 * 0.12 * 0.5 + 3 * 0.02 * 0.25
    (coupling,) = robot.couplings
    assert coupling.ratio == pytest.approx(slope)
    assert f"coupling 'joint' is a curve: its ratio is the slope {slope:.6g} at q0 = 0.5" in "".join(
        note.text for note in robot.notes
    )


@pytest.mark.parametrize(
    ("equality", "words"),
    [
        ('<tendon tendon1="a" tendon2="d"/>', "a relation of joints: got q2, q0, q1, expected one or two joints"),
        ('<tendon tendon1="a" tendon2="b" polycoef="0 1 1 0 0"/>', "got q1, q0, expected one or two joints"),
        ('<tendon tendon1="none"/>', "unknown tendon: got none"),
        ('<joint joint1="none" joint2="q0"/>', "unknown joint: got none"),
    ],
)
def test_other_relations_are_refused_in_one_line(equality: str, words: str, tmp_path: Path):
    text = arm("yxZ", f"<tendon>{TENDONS}</tendon>\n<equality>{equality}</equality>")
    with pytest.raises(BadRobotFile) as caught:
        read(tmp_path, text)
    (line,) = caught.value.lines()
    assert "arm.xml:2: " in line
    assert words in line


@pytest.mark.parametrize(
    "equality", ['<joint joint1="q1" polycoef="0.3 0 0 0 0"/>', '<tendon tendon1="b" polycoef="0.15"/>']
)
def test_a_joint_without_a_driver_is_fixed_where_mujoco_holds_it(equality: str, tmp_path: Path):
    text = arm("yxZ", f"<tendon>{TENDONS}</tendon><equality>{equality}</equality>")
    robot = read(tmp_path, text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[1] = 0.3
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-12
    for name, link in robot.links.items():
        assert np.allclose(link.pose[:3, 3], data.body(name).xpos)
        assert np.allclose(link.pose[:3, :3].ravel(), data.body(name).xmat)


def motors(robot: Mechanism) -> list[str]:
    return [joint.name for joint in robot.joints.values() if joint.is_actuated]


def test_the_motor_of_a_tendon_drives_coupled_joints_or_one(tmp_path: Path):
    def driven(equality: str, pulling: str) -> Mechanism:
        actuator = f'<actuator><motor tendon="{pulling}"/></actuator>'
        return read(tmp_path, arm("yxZ", f"<tendon>{TENDONS}</tendon><equality>{equality}</equality>{actuator}"))

    assert motors(driven('<tendon tendon1="a"/>', "c")) == ["q0"]
    assert motors(driven('<tendon tendon1="a"/>', "b")) == ["q0"]
    assert motors(driven("", "d")) == ["q2"]
    assert motors(driven('<joint joint1="q1"/>', "c")) == ["q0"]
    alone = driven("", "c")
    assert motors(alone) == []
    (told,) = (note.text for note in alone.notes if note.kind == "ignored")
    assert told == "an unnamed <motor>, whose tendon pulls q1, q0: a motor drives one joint, or coupled ones"
