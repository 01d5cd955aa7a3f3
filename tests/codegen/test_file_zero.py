"""Generated code counts from the file's zero, wherever reading had to move the robot's: the judge is the file's text,
its origins and axes multiplied out by themselves."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from codegen.robots import LIMIT, MAIN, OK, SINGULAR, answered, compiled, module_of
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array, build_pose, rotate_about_axis

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


@dataclass(frozen=True)
class FileJoint:
    """A joint of a URDF file: its origin, axis and what else it says; ``closes`` gives the frame of a loop."""

    name: str
    parent: str
    child: str
    at: tuple[float, float, float]
    axis: str
    motor: bool = False
    extra: str = ""
    slides: bool = False
    closes: tuple[float, float, float] | None = None

    def text(self) -> str:
        axis = f'<axis xyz="{" ".join(map(str, AXES[self.axis]))}"/>'
        place = "{0!r} {1!r} {2!r}".format
        if self.closes is not None:
            return (
                f'<loop name="{self.name}" type="revolute"><predecessor link="{self.parent}"><origin xyz="'
                f'{place(*self.at)}"/></predecessor><successor link="{self.child}"><origin xyz="'
                f'{place(*self.closes)}"/></successor>{axis}</loop>'
            )
        limit = "" if "<limit" in self.extra else '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
        return (
            f'<joint name="{self.name}" type="{"prismatic" if self.slides else "revolute"}"><parent link="'
            f'{self.parent}"/><child link="{self.child}"/><origin xyz="{place(*self.at)}"/>{axis}{limit}'
            f"{self.extra}</joint>"
        )

    def displacement(self, value: float) -> Array:
        axis = np.array(AXES[self.axis], dtype=float)
        return build_pose(value * axis) if self.slides else build_pose(rotation=rotate_about_axis(axis, value))


@dataclass(frozen=True)
class Case:
    """A file whose zero configuration is moved while it is read, its platform, and motors at which its code answers."""

    joints: tuple[FileJoint, ...]
    platform: str
    box: tuple[tuple[float, float], ...]

    def file(self, folder: Path) -> Path:
        names = dict.fromkeys(link for joint in self.joints for link in (joint.parent, joint.child))
        links = "".join(f'<link name="{name}"/>' for name in names)
        motors = "".join(
            f'<transmission name="t_{joint.name}"><joint name="{joint.name}"/></transmission>'
            for joint in self.joints
            if joint.motor
        )
        path = folder / "robot.urdf"
        path.write_text(f'<robot name="moved">{links}{"".join(each.text() for each in self.joints)}{motors}</robot>')
        return path

    def poses(self, values: Mapping[str, float]) -> dict[str, Array]:
        """The poses of all links for the file's coordinates of the joints of its tree."""
        found = {self.joints[0].parent: np.eye(4)}
        for joint in self.joints:
            if joint.closes is None:
                moved = joint.displacement(values.get(joint.name, 0.0))
                found[joint.child] = found[joint.parent] @ build_pose(joint.at) @ moved
        return found


def _mimic(driver: str, ratio: float, offset: float) -> str:
    return f'<mimic joint="{driver}" multiplier="{ratio!r}" offset="{offset!r}"/>'


def follower(seed: int, slides: bool = False) -> Case:
    """An arm whose second joint follows the first with an offset."""
    rng = np.random.default_rng(seed)
    a, b, c = (tuple(each) for each in rng.uniform(0.1, 0.4, (3, 3)).round(3).tolist())
    return Case(
        (
            FileJoint("j1", "base", "one", a, "z", motor=True),
            FileJoint("j2", "one", "two", b, "y", extra=_mimic("j1", 0.4, 0.25 - 0.1 * seed), slides=slides),
            FileJoint("j3", "two", "hand", c, "x", motor=True),
        ),
        "hand",
        ((-0.1, 0.1), (-0.1, 0.1)),
    )


def open_bars(seed: int) -> Case:
    """A four-bar, all upright at zero: its passive joints close it."""
    sizes = np.random.default_rng(seed).uniform((0.1, 0.4, 0.3, 0.3), (0.14, 0.5, 0.4, 0.4))
    crank, rod, rocker, ground = sizes.tolist()
    return Case(
        (
            FileJoint("drive", "base", "crank", (0.0, 0.0, 0.0), "y", motor=True),
            FileJoint("knee", "crank", "rod", (0.0, 0.0, crank), "y", extra='<limit lower="-3" upper="3"/>'),
            FileJoint("swing", "base", "rocker", (ground, 0.0, 0.0), "y"),
            FileJoint("pin", "rod", "rocker", (0.0, 0.0, rod), "y", closes=(0.0, 0.0, rocker)),
        ),
        "rod",
        ((-0.05, 0.05),),
    )


def limited_knee() -> Case:
    """A four-bar whose knee's limits hold for one of its two assemblies, which takes the crank from its zero."""
    return Case(
        (
            FileJoint("drive", "base", "crank", (0.0, 0.0, 0.0), "y", motor=True),
            FileJoint("knee", "crank", "rod", (0.0, 0.0, 0.12), "y", extra='<limit lower="-2.9" upper="-0.4"/>'),
            FileJoint("swing", "base", "rocker", (0.3, 0.0, 0.0), "y"),
            FileJoint("pin", "rod", "rocker", (0.0, 0.0, 0.26), "y", closes=(0.0, 0.0, 0.2)),
        ),
        "rod",
        ((1.3, 1.5),),
    )


def flat_bars() -> Case:
    """A four-bar that lies flat at zero, where it is singular."""
    return Case(
        (
            FileJoint("drive", "base", "crank", (0.0, 0.0, 0.0), "z", motor=True),
            FileJoint("knee", "crank", "rod", (0.5, 0.0, 0.0), "z"),
            FileJoint("swing", "base", "rocker", (1.0, 0.0, 0.0), "z"),
            FileJoint("pin", "rod", "rocker", (1.0, 0.0, 0.0), "z", closes=(0.5, 0.0, 0.0)),
        ),
        "rod",
        (),
    )


def palletizer(seed: int) -> Case:
    """An arm on a parallelogram that is a rectangle at zero, where the watched forearm sees less than nearby."""
    a, b, c, d = np.random.default_rng(seed).uniform((0.3, 0.7, 0.3, 0.3), (0.5, 0.9, 0.4, 0.5)).round(3).tolist()
    at = (0.2, 0.0, 0.3)
    return Case(
        (
            FileJoint("A1", "base", "waist", (0.0, 0.0, a), "z", motor=True),
            FileJoint("A2", "waist", "arm", at, "y", motor=True),
            FileJoint("A3", "waist", "lever", at, "y", motor=True),
            FileJoint("p1", "lever", "strut", (-c, 0.0, 0.0), "y"),
            FileJoint("p2", "arm", "fore", (0.0, 0.0, b), "y"),
            FileJoint("A4", "fore", "w1", (d, 0.0, 0.1), "x", motor=True),
            FileJoint("A5", "w1", "w2", (0.4, 0.0, 0.0), "y", motor=True),
            FileJoint("A6", "w2", "flange", (0.1, 0.0, 0.0), "x", motor=True),
            FileJoint("p3", "strut", "fore", (0.0, 0.0, b), "y", closes=(-c, 0.0, 0.0)),
        ),
        "flange",
        ((-0.1, 0.1),) * 6,
    )


CASES = {
    "follower": follower(1),
    "follower of a slide": follower(2, slides=True),
    "third follower": follower(3),
    "open bars": open_bars(1),
    "more open bars": open_bars(2),
    "limited knee": limited_knee(),
    "flat bars": flat_bars(),
    "palletizer": palletizer(1),
    "second palletizer": palletizer(2),
    "third palletizer": palletizer(3),
}


def box_of(case: Case) -> dict[str, tuple[float, float]] | None:
    motors = [joint.name for joint in case.joints if joint.motor]
    return dict(zip(motors, case.box, strict=True)) if case.box else None


def asked(low: Array, high: Array) -> Array:
    """The file's zero, where it is in the range, and motors in it."""
    inside = np.random.default_rng(0).uniform(low, high, (4, len(low)))
    return np.array([np.zeros(len(low)), *inside]) if np.all((low <= 0) & (high >= 0)) else inside


def judged(case: Case, values: Mapping[str, float], position: Array, R: Array) -> None:
    """The platform is where the file's text puts it, and the loops meet."""
    poses = case.poses(values)
    np.testing.assert_allclose(poses[case.platform][:3, 3], position, atol=1e-10)
    np.testing.assert_allclose(poses[case.platform][:3, :3], R, atol=1e-10)
    for joint in case.joints:
        if joint.closes is not None:
            gap = poses[joint.parent] @ [*joint.at, 1.0] - poses[joint.child] @ [*joint.closes, 1.0]
            np.testing.assert_allclose(gap, 0.0, atol=1e-10)
        if "<mimic" in joint.extra:
            ratio, offset = (float(joint.extra.split(f'{key}="')[1].split('"')[0]) for key in ("multiplier", "offset"))
            assert values[joint.name] == pytest.approx(ratio * values["j1"] + offset, abs=1e-10)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", CASES)
def test_motors_and_passive_joints_count_from_the_files_zero(name: str, tmp_path: Path):
    case = CASES[name]
    robot = hrsynth.load(case.file(tmp_path), platform=case.platform)
    assert any(note.kind == "solved" for note in robot.notes)
    made = module_of(hrsynth.export(robot, "python", box_of(case)).code)
    q = asked(made.LOWER, made.UPPER)
    status, x, R, p = made.forward(q)
    # a flat zero may be outside of what is proved
    assert np.all(status[1:] == made.OK)
    assert status[0] == made.OK or name == "flat bars"
    for row in np.flatnonzero(status == made.OK):
        judged(
            case, dict(zip([*made.MOTOR_NAMES, *made.PASSIVE_NAMES], [*q[row], *x[row]], strict=True)), p[row], R[row]
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_cpp_of_it_answers_the_same(name: str, tmp_path: Path):
    case = CASES[name]
    robot = hrsynth.load(case.file(tmp_path), platform=case.platform)
    made = module_of(hrsynth.export(robot, "python", box_of(case)).code)
    q = asked(made.LOWER, made.UPPER)
    status, x, R, p = made.forward(q)
    rows = answered(
        compiled(tmp_path, hrsynth.export(robot, "c++", box_of(case), jumps=True).code, MAIN, "-DNAME=moved"), q
    )
    good, own = status == made.OK, len(made.PASSIVE_NAMES)
    assert np.array_equal(
        np.isin(rows[:, 0], (OK, LIMIT, SINGULAR)), good
    )  # the hand may be singular, its pose is right
    for column, expected in ((2, x), (2 + own, p), (5 + own, R.reshape(-1, 9))):
        np.testing.assert_allclose(rows[good, column : column + expected.shape[1]], expected[good], atol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["palletizer", "limited knee", "follower"])
def test_ranges_are_those_of_the_file(name: str, tmp_path: Path):
    """Without a box that is asked for motors go from limit to limit, as the file has them."""
    case = CASES[name]
    robot = hrsynth.load(case.file(tmp_path), platform=case.platform)
    proof = hrsynth.branch(robot)
    assert proof.box == "limits of the file"
    for part in proof.parts:
        np.testing.assert_allclose(part.requested_box, [[-2] * len(part.motors), [2] * len(part.motors)], atol=1e-12)


def test_a_box_without_the_zero_configuration_names_it(tmp_path: Path):
    """The loop is open at the file's zero: the box has to hold where it was closed."""
    case = CASES["limited knee"]
    robot = hrsynth.load(case.file(tmp_path), platform=case.platform)
    with pytest.raises(BadRequest, match=r"with 1\.\d+ \(zero configuration\) in it"):
        hrsynth.export(robot, "python", {"drive": (-0.1, 0.1)})


def test_a_box_without_both_zeros_names_the_one_of_the_robot(tmp_path: Path):
    """And the motor whose interval lacks it, not those that hold it."""
    case = CASES["palletizer"]
    robot = hrsynth.load(case.file(tmp_path), platform=case.platform)
    zeros = {
        joint.name: 0.0 if joint.offset is None else float(joint.offset[0])
        for joint in robot.joints.values()
        if joint.is_actuated
    }
    *_, last = zeros
    assert any(zeros.values())
    box = {name: (zero - 0.05, zero + 0.05) for name, zero in zeros.items()} | {last: (1.8, 1.9)}
    with pytest.raises(BadRequest, match=rf"{last}=.* with {zeros[last]:.6g} \(zero configuration\) in it"):
        hrsynth.branch(robot, box)


def test_the_head_states_the_command_and_the_file(tmp_path: Path):
    path = CASES["follower"].file(tmp_path)
    robot = hrsynth.load(path, platform="hand", motors="j1,j3", keyframe="zero")
    head = hrsynth.export(robot, "python", {"j1": (-0.1, 0.1), "j3": (-0.1, 0.1)}).code.splitlines()[:4]
    assert head[1].endswith(
        "hrsynth export robot.urdf --platform hand --motors j1,j3 --keyframe zero --lang python "
        "--observe 1 --box j1=-0.1:0.1,j3=-0.1:0.1"
    )
    assert head[2] == f"# SHA-256 of robot.urdf: {hashlib.sha256(path.read_bytes()).hexdigest()}"
