"""Two files of one robot: the same in any dialect, frame, zero and names; each difference is found by its rule."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

import hrsynth
from hrsynth.description import load, save
from hrsynth.geometry.vectors import normalise_vector, rotate_about_axis
from hrsynth.linting.matching import RobotMatch
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.model import Limits, Motor
from linting.defects import damaged, put, sound
from strategies import random_rotation

ROBOTS = ("3rrr_m1", "quattro", "3rps")
Change = Callable[[Mechanism], Mechanism]


def differs(one: Path, other: Path) -> Counter[str]:
    """The rules that say that two files differ."""
    found = hrsynth.lint(one, compare=other, ignore=("constraint-dead", "constraint-redundant", "motors-few"))
    return Counter(each.rule for each in found.findings if each.rule.startswith("differs-"))


def written(folder: Path, name: str, robot: Mechanism) -> Path:
    save(robot, folder / name)
    return folder / name


def joint(name: str, **fields: object) -> Change:
    return lambda robot: robot.changed(joints=[replace(robot.joints[name], **fields)])


def moved(robot: Mechanism) -> Mechanism:
    """A rod a little longer: one wrist's centre elsewhere on both of its links."""
    found = robot.joints["wrist_2"]
    return robot.changed(joints=[replace(found, point=found.point + 1e-3 * np.array([1.0, 2.0, 0.0]))])


def turned_axis(robot: Mechanism) -> Mechanism:
    found = robot.joints["elbow_1"]
    return robot.changed(joints=[replace(found, axes=(normalise_vector(found.axis + np.array([1e-3, 0, 0])),))])


CHANGES: dict[str, tuple[Change, set[str]]] = {
    "motor": (joint("shoulder_1", motor=None), {"differs-motor"}),
    "another motor": (joint("elbow_1", motor=Motor("m")), {"differs-motor"}),
    "limit": (joint("shoulder_1", limits=Limits(-1.0, 1.0)), {"differs-limit"}),
    "rod": (moved, {"differs-geometry"}),
    "axis": (turned_axis, {"differs-geometry"}),
    "type": (joint("wrist_3", type=JointType.SPHERICAL, axes=()), {"differs-type"}),
    "closure": (lambda robot: robot.changed(remove_joints=["wrist_3"]), {"differs-joint"}),
    "sense": (
        lambda robot: robot.changed(
            joints=[replace(robot.joints["shoulder_1"], axes=(-robot.joints["shoulder_1"].axis,))]
        ),
        {"differs-sense"},
    ),
    "platform": (lambda robot: replace(robot, platform="dist_1"), {"differs-ends"}),
}


@pytest.mark.some(3)
@pytest.mark.parametrize("name", CHANGES)
def test_each_difference_is_found_from_both_sides(name: str, tmp_path: Path):
    change, rules = CHANGES[name]
    robot = load("3rrr_m1")
    one = written(tmp_path, "one.urdf", robot)
    other = written(tmp_path, "other.urdf", change(robot))
    assert set(differs(one, other)) == rules
    assert set(differs(other, one)) == rules
    assert differs(one, one) == Counter()


@pytest.mark.some(2)
@pytest.mark.parametrize("ending", [".xml", ".sdf", ".yaml"])
def test_a_difference_is_found_between_dialects(ending: str, tmp_path: Path):
    robot = load("3rrr_m1")
    one = written(tmp_path, "one.urdf", robot)
    assert differs(one, written(tmp_path, f"same{ending}", robot)) == Counter()
    other = written(tmp_path, f"other{ending}", moved(robot))
    assert set(differs(one, other)) == {"differs-geometry"}


def test_masses_and_inertias_are_compared_in_any_frame(tmp_path: Path):
    one, other, third = tmp_path / "one.urdf", tmp_path / "other.urdf", tmp_path / "third.urdf"
    one.write_text(sound())
    other.write_text(damaged(sound(), put("link/inertial/mass", value="2.5")))
    third.write_text(damaged(sound(), put("link/inertial/inertia", ixx="0.03", iyy="0.02", izz="0.04")))
    assert set(differs(one, other)) == {"differs-mass"}
    assert set(differs(one, third)) == set()  # the same body, its frame turned by a quarter about z
    third.write_text(damaged(sound(), put("link/inertial/inertia", ixx="0.021")))
    assert set(differs(one, third)) == {"differs-mass"}


@pytest.mark.parametrize("name", ["3rrr_m1", "3prr_m1", "3rpr_m2", "6pus", "gough_stewart", "3upu"])
def test_another_zero_is_told_as_that_and_as_nothing_else(name: str, tmp_path: Path):
    """The same robot, counted from another closed pose: slides lie elsewhere along their axes, of a U joint each link
    carries one axis."""
    robot = load(name)
    at = hrsynth.check(robot, at="x=0.02,y=0.01").postures[0].configuration
    poses = {name: at.pose(name) for name in robot.links}
    there = with_zero(robot, poses)
    one, other = written(tmp_path, "one.urdf", robot), written(tmp_path, "other.urdf", there)
    assert set(differs(one, other)) == {"differs-zero"}


def mirrored(robot: Mechanism, seed: int) -> Mechanism:
    """Its image in any mirror."""
    T = random_rotation(np.random.default_rng(seed))
    S = T @ np.diag([1.0, 1.0, -1.0]) @ T.T
    joints = {
        each.name: replace(each, point=S @ each.point, axes=tuple(S @ axis for axis in each.axes))
        for each in robot.joints.values()
    }
    links = {}
    for name, link in robot.links.items():
        X = link.pose.copy()
        X[:3, 3] = S @ X[:3, 3]
        links[name] = replace(link, pose=X)
    return replace(robot, joints=joints, links=links, observations=())


@pytest.mark.parametrize(
    ("name", "same"),
    [
        ("3rrr_m1", True),
        ("3rpr_m2", True),
        ("3prr_m1", True),
        ("3rps", False),
        pytest.param("6pus", False, marks=pytest.mark.slow),
    ],
)
def test_a_planar_robot_is_its_own_mirror_image(name: str, same: bool):
    """Turned by half a turn about a line in its plane; a robot in space with skew joints on a link is not."""
    robot = load(name)
    if not same:  # shipped ones are symmetric: joints of the platform out of one plane, in no order
        rng = np.random.default_rng(2)
        robot = robot.changed(
            joints=[
                replace(each, point=each.point + 0.1 * robot.length * rng.normal(size=3))
                for each in robot.joints.values()
            ]
        )
    else:  # axes weigh more than places where the legs begin near to each other
        robot = robot.changed(joints=[replace(each, point=0.2 * each.point) for each in robot.joints_of(robot.base)])
    for seed in range(5):
        match = RobotMatch(robot, mirrored(robot, seed))
        missed = max(max(fit.misses.values()) for link in robot.links if (fit := match.fit(link)))
        assert (missed < 1e-7) == same


@pytest.mark.parametrize(
    ("first", "second", "told"), [(0.3, 0.0, False), (0.35, -0.05, False), (0.35, 0.0, True), (-0.3, 0.0, False)]
)
def test_a_link_farther_along_the_axis_of_a_hinge_is_another_robot(
    tmp_path: Path, first: float, second: float, told: bool
):
    """Each link fits by itself, as a hinge may have its centre anywhere on its axis: not so both links of it. The
    offset of Denavit and Hartenberg is the sum of both numbers; negative it is the same robot, seen from its back."""
    files = []
    for name, (one, two) in {"a": (0.3, 0.0), "b": (first, second)}.items():
        joints = [("0 0 0", "0 0 1"), (f"{one} 0.05 0.1", "1 0 0"), (f"{two} 0 0.07", "0 1 0"), ("0 0 0.3", "1 0 0")]
        text = "".join(f'<link name="l{number}"/>' for number in range(5)) + "".join(
            f'<joint name="q{number}" type="continuous"><parent link="l{number}"/><child link="l{number + 1}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/></joint>'
            for number, (place, axis) in enumerate(joints)
        )
        files.append(tmp_path / f"{name}.urdf")
        files[-1].write_text(f'<robot name="arm">{text}<hrsynth><platform link="l4"/></hrsynth></robot>')
    assert ("differs-geometry" in differs(*files)) == told
    assert ("differs-geometry" in differs(*files[::-1])) == told


def with_zero(robot: Mechanism, poses: dict[str, np.ndarray]) -> Mechanism:
    """The robot with its links at other closed poses for its zero."""
    motion = {name: poses[name] @ np.linalg.inv(link.pose) for name, link in robot.links.items()}
    joints = {}
    for each in robot.joints.values():
        X = motion[each.predecessor]
        axes = tuple(motion[link][:3, :3] @ axis for link, axis in zip(each.links, each.axes, strict=False))
        joints[each.name] = replace(each, point=X[:3, :3] @ each.point + X[:3, 3], axes=axes)
    links = {name: replace(link, pose=poses[name]) for name, link in robot.links.items()}
    return replace(robot, links=links, joints=joints)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("seed", [0, 1])
def test_names_and_frames_do_not_matter(name: str, seed: int):
    """Renamed links and joints, turned link frames: every joint is matched by its place, and what is matched fits."""
    rng = np.random.default_rng(seed)
    robot = load(name)
    joints = {
        f"j{number}": replace(
            each, name=f"j{number}", predecessor=f"l_{each.predecessor}", successor=f"l_{each.successor}"
        )
        for number, each in enumerate(robot.joints.values())
    }
    links = {}
    for link in robot.links.values():
        X = link.pose.copy()
        if link.name != robot.base:
            X[:3, :3] = X[:3, :3] @ random_rotation(rng)
        links[f"l_{link.name}"] = replace(link, name=f"l_{link.name}", pose=X)
    other = replace(
        robot,
        joints=joints,
        links=links,
        base=f"l_{robot.base}",
        platform=f"l_{robot.platform}",
        observations=(),
        couplings=(),
    )
    match = RobotMatch(robot, other)
    numbers = {each: f"j{number}" for number, each in enumerate(robot.joints)}
    assert match.joints == numbers
    for link in robot.links:
        fit = match.fit(link)
        assert match.links[link] == f"l_{link}"
        assert fit is not None
        assert max(fit.misses.values()) < 1e-9


@pytest.mark.some(3)
@pytest.mark.parametrize("seed", range(5))
def test_a_link_is_fitted_wherever_it_is_and_where_on_its_axes_hinges_have_their_centres(seed: int):
    """One link with joints of several types, moved rigidly, its hinges slid along their axes: nothing is missed; a
    centre off by 1e-3 is, by as much."""
    rng = np.random.default_rng(seed)
    robot = load("quattro")
    R, p = rotate_about_axis(normalise_vector(rng.normal(size=3)), 2.0), rng.normal(size=3)
    joints = {}
    for each in robot.joints.values():
        slide = rng.normal() * each.axis if each.type is JointType.REVOLUTE else 0.0
        joints[each.name] = replace(
            each, point=R @ (each.point + slide) + p, axes=tuple(R @ axis for axis in each.axes)
        )
    other = replace(robot, joints=joints)
    match = RobotMatch(robot, other)
    for link in robot.links:
        fit = match.fit(link)
        assert fit is not None
        assert max(fit.misses.values()) < 1e-7, link
    bent = other.joints["wrist_1a"]
    off = normalise_vector(rng.normal(size=3)) * 1e-3 * robot.length
    match = RobotMatch(robot, other.changed(joints=[replace(bent, point=bent.point + off)]))
    missed = [max(fit.misses.values()) for link in bent.links if (fit := match.fit(link))]
    assert 1e-5 < max(missed) < 1.1e-3


def test_gears_are_compared(tmp_path: Path):
    gear = (
        '<robot name="g"><link name="a"/><link name="b"/><link name="c"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint><joint name="k" type="continuous"><parent link="a"/>'
        '<child link="c"/><origin xyz="1 0 0"/></joint><coupling name="t"><predecessor link="b"/>'
        '<successor link="c"/><ratio value="{}"/></coupling></robot>'
    )
    for name, ratio in (("one", "2"), ("other", "3")):
        (tmp_path / f"{name}.urdf").write_text(gear.format(ratio))
    found = hrsynth.lint(tmp_path / "one.urdf", compare=tmp_path / "other.urdf", platform="c")
    (said,) = [each.message for each in found.findings if each.rule.startswith("differs-")]
    assert said == "coupling 't' with the ratio 2 here, coupling 't' with the ratio 3 there"


def test_one_line_files_keep_their_names(tmp_path: Path):
    """Elements in one line are told apart by their names."""
    root = etree.fromstring(sound(), etree.XMLParser(remove_blank_text=True))
    path = tmp_path / "robot.urdf"
    path.write_text(etree.tostring(root, encoding="unicode"))
    model = damaged(path.read_text(), put('link[@name="prox_1"]/inertial/mass', value="-1.5"))
    path.write_text(model.replace("\n", ""))
    found = hrsynth.lint(path, fix=True)
    assert [each.rule for each in found.fixed] == ["mass-negative"]
    assert not found.has_severity("warning")
