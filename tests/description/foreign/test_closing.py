"""How a file's zero pose is left where it is open or singular: within limits, motors last, by a small step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hrsynth
from description.foreign.test_dialects import mobility
from hrsynth.description import load
from hrsynth.mechanism import Mechanism


def press(folder: Path, seed: int, side: float, wide: float = 0.3, drive: float | None = None) -> Path:
    """A four-bar, its links along z at zero where it is open, whose knee may be where it is in one of its assemblies at
    an angle of the crank, by default a random one, or ``wide`` from there."""
    rng = np.random.default_rng(seed)
    crank, rod, rocker, ground = rng.uniform((0.08, 0.24, 0.18, 0.26), (0.12, 0.28, 0.22, 0.3))
    drive = rng.uniform(0.8, 2.2) * rng.choice([-1, 1]) if drive is None else drive
    tip = crank * np.array([np.sin(drive), np.cos(drive)])  # x, z
    gap = np.array([ground, 0.0]) - tip
    far = np.linalg.norm(gap)
    along = np.arctan2(gap[0], gap[1])
    knee = along + side * np.arccos((rod**2 + far**2 - rocker**2) / (2 * rod * far)) - drive
    knee = float(np.angle(np.exp(1j * knee)))
    joint = (
        '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>'
        '<axis xyz="0 1 0"/><limit lower="{:.4f}" upper="{:.4f}" effort="1" velocity="1"/></joint>\n'
    ).format
    path = folder / "press.urdf"
    path.write_text(
        '<robot name="press"><link name="frame"/><link name="crank"/><link name="rod"/><link name="rocker"/>'
        + joint("drive", "frame", "crank", "0 0 0", -3.1, 3.1)
        + joint("knee", "crank", "rod", f"0 0 {crank:.9f}", knee - wide, knee + wide)
        + joint("swing", "frame", "rocker", f"{ground:.9f} 0 0", -3.1, 3.1)
        + f'<loop name="pin" type="revolute"><predecessor link="rod"><origin xyz="0 0 {rod:.9f}"/></predecessor>'
        f'<successor link="rocker"><origin xyz="0 0 {rocker:.9f}"/></successor><axis xyz="0 1 0"/></loop>'
        '\n<transmission name="m"><joint name="drive"/></transmission></robot>'
    )
    return path


def includes_zero(robot: Mechanism) -> bool:
    return all(lower <= 1e-9 and upper >= -1e-9 for lower, upper in robot.joint_ranges.values())


@pytest.mark.some(3)
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("seed", range(5))
def test_open_loops_are_closed_within_the_limits(seed: int, side: int, tmp_path: Path):
    """They tell which of two assemblies is meant; what lint writes is within its limits too."""
    path = press(tmp_path, seed, side)
    robot = load(path, platform="rod")
    assert includes_zero(robot)
    assert robot.filed["knee"] == pytest.approx(
        (
            robot.joint_ranges["knee"][0] + float(robot.joints["knee"].offset[0]),
            robot.joint_ranges["knee"][1] + float(robot.joints["knee"].offset[0]),
        )
    )
    hrsynth.lint(path, platform="rod", fix=True, output=tmp_path / "mended.urdf")
    mended = load(tmp_path / "mended.urdf", platform="rod")
    assert not any(note.kind == "solved" for note in mended.notes)
    assert includes_zero(mended)


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", range(5))
def test_motors_stay_where_passive_joints_close_the_loops(seed: int, tmp_path: Path):
    robot = load(press(tmp_path, seed, (-1) ** seed, drive=0.0), platform="rod")
    assert robot.joints["drive"].offset is None
    assert robot.joints["knee"].offset is not None


@pytest.mark.slow
def test_what_no_assembly_allows_is_not_mended(tmp_path: Path):
    """The rocker may only point away from the crank: closed beyond its limits, and the file stays as it is."""
    path = press(tmp_path, 0, 1)
    text = path.read_text()
    place = text.index('lower="', text.index('name="swing"'))
    path.write_text(text[:place] + 'lower="1.5" upper="1.7"' + text[text.index(" effort", place) :])
    assert not includes_zero(load(path, platform="rod"))
    before = path.read_text()
    assert not hrsynth.lint(path, platform="rod", fix=True).fixed
    assert path.read_text() == before


def legged(folder: Path, legs: int) -> Path:
    """Five-bars of cranks and shins, each of whose knees is a U: at zero, where a leg is its mirror image, singular."""
    crank, shin = 0.08, np.array([0.08, -0.17])
    text = "<sdf version='1.9'><model name='hopper'><link name='hip'/>"
    for k in range(legs):
        for side, sign in (("f", 1), ("b", -1)):
            tip = f"{sign * crank * np.cos(0.25):.12f} {k} {-crank * np.sin(0.25):.12f}"
            name, ends = f"{side}{k}", "<parent>{}</parent><child>{}_{}</child>".format
            text += (
                f"<link name='crank_{name}'/><link name='shin_{name}'><pose>{tip} 0 0 0</pose></link>"
                f"<joint name='m_{name}' type='revolute'>{ends('hip', 'crank', name)}"
                f"<axis><xyz>0 1 0</xyz></axis></joint><joint name='knee_{name}' type='universal'>"
                f"{ends(f'crank_{name}', 'shin', name)}<axis><xyz>0 1 0</xyz></axis>"
                "<axis2><xyz>1 0 0</xyz></axis2></joint>"
            )
        toe = f"{-crank * np.cos(0.25):.12f} 0 {shin[1]:.12f}"
        text += (
            f"<joint name='toe{k}' type='revolute'><pose>{toe} 0 0 0</pose>"
            f"{ends(f'shin_f{k}', 'shin', f'b{k}')}<axis><xyz>0 1 0</xyz></axis></joint>"
        )
    path = folder / "hopper.sdf"
    path.write_text(text + "</model></sdf>")
    return path


def moved_by(robot: Mechanism) -> float:
    return max(
        (
            float(np.abs(joint.offset).max())
            for joint in robot.joints.values()
            if joint.offset is not None and joint.offset.ndim == 1
        ),
        default=0.0,
    )


@pytest.mark.parametrize("legs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_singular_zero_pose_is_left_by_a_small_step(legs: int, tmp_path: Path):
    """Of all legs at once; one that is asked for stays."""
    path = legged(tmp_path, legs)
    robot = load(path, platform="shin_b0")
    assert any("singular (its loops have" in note.text for note in robot.notes)
    assert 0 < moved_by(robot) < 0.6
    assert hrsynth.check(robot).to_dict()["mobility"]["total"] == 2 * legs
    stayed = load(path, platform="shin_b0", keyframe="zero")
    assert moved_by(stayed) == 0
    assert not any(note.kind == "solved" for note in stayed.notes)


def four_bar(folder: Path, seed: int, dialect: str) -> Path:
    """A planar four-bar about y that a hinge would close and a rigid closure locks: of links of random lengths, on a
    free hinge of its own."""
    rng = np.random.default_rng(seed)
    crank, rod, ground = rng.uniform(0.1, 0.3, size=(3, 2)).round(4)
    tip = crank + rod - ground
    chain = [("turn", "base", "frame", (0, 0)), ("crank", "frame", "a", (0, 0)), ("knee", "a", "b", crank)]
    chain += [("rocker", "frame", "c", ground)]
    if dialect == "gepetto":
        joint = (
            '<link name="{2}"/><joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/>'
            '<origin xyz="{3} 0 {4}"/><axis xyz="0 1 0"/></joint>'
        ).format
        frame = (
            '<link name="{0}"/><joint name="at_{0}" type="fixed"><parent link="{1}"/><child link="{0}"/>'
            '<origin xyz="{2} 0 {3}"/></joint>'
        ).format
        (folder / "robot.urdf").write_text(
            '<robot name="bars"><link name="base"/>'
            + "".join(joint(name, parent, child, *at) for name, parent, child, at in chain)
            + frame("end_b", "b", *rod)
            + frame("end_c", "c", *tip)
            + "</robot>"
        )
        (folder / "robot.yaml").write_text("closed_loop: [[end_b, end_c]]\ntype: [6d]\nname_mot: [turn, crank]\n")
        return folder / "robot.urdf"
    body = '<body name="{2}" pos="{3} 0 {4}"><joint name="{0}" axis="0 1 0"/><geom size=".01"/>'.format
    turn, first, second, other = (body(name, parent, child, *at) for name, parent, child, at in chain)
    (folder / "robot.xml").write_text(
        f'<mujoco><worldbody>{turn}{first}{second}<site name="at_b" pos="{rod[0]} 0 {rod[1]}"/></body></body>{other}'
        f'<site name="at_c" pos="{tip[0]} 0 {tip[1]}"/></body></body></worldbody>'
        '<equality><weld name="loop_1" site1="at_b" site2="at_c"/></equality></mujoco>'
    )
    return folder / "robot.xml"


@pytest.mark.parametrize("dialect", ["gepetto", "mjcf"])
@pytest.mark.parametrize("seed", range(3))
def test_a_closure_that_locks_its_loop_is_named_with_one_that_does_not(seed: int, dialect: str, tmp_path: Path):
    """Four bodies in a plane with five hinges have two freedoms; rigid in place of the last one, one (Gruebler)."""
    path = four_bar(tmp_path, seed, dialect)
    robot = load(path, platform="b")
    (text,) = (note.text for note in robot.notes if "locks" in note.text)
    locked = text.removeprefix("the closure 'loop_1' locks ").partition(";")[0]
    assert {*locked.split(", ")} == {"crank", "knee", "rocker"}
    assert mobility(robot) == 3 * 4 - 2 * 4 - 3
    option = text.partition("--close ")[2].rstrip(")")
    freed = load(path, platform="b", close=option)
    assert mobility(freed) == 3 * 4 - 2 * 5
    assert not any("locks" in note.text for note in freed.notes)
    found = [each for each in hrsynth.lint(path, platform="b").findings if each.rule == "closure-locks"]
    assert [option in each.message for each in found] == [True]
