"""Generated code against the package's own kinematics (Pinocchio's model, closed by Gauss-Newton) at many points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hrsynth
from codegen.robots import (
    MAIN,
    Motors,
    answered,
    box_of,
    compiled,
    made,
    module_of,
    own_pose,
)
from hrsynth.codegen.export import export
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.kinematics.tasks import solve
from hrsynth.mechanism import Mechanism


def along(low: Array, high: Array, count: int) -> Array:
    """Points (count, n) of a curve through all of a box, near to each other, from its middle on."""
    t = np.linspace(0, 2 * np.pi, count)
    turns = np.sqrt([2, 3, 5, 7, 11, 13][: len(low)]) * (1 if len(low) == 1 else max(2.0, (count / 400) ** 0.5))
    return np.asarray((low + high) / 2 + 0.9999 * (high - low) / 2 * np.sin(t[:, None] * turns))


def own_poses(robot: Mechanism, motors: tuple[str, ...], q: Array) -> Array:
    """The platform's poses (n, 4, 4), each found from the one before; the first is led to from zero."""
    model, found = PinocchioModel(robot), np.zeros((len(q), 4, 4))
    here = model.q0
    for s in np.linspace(0, 1, 20):
        here, _ = solve(model, here, Motors(dict(zip(motors, s * q[0], strict=True))), tolerance=1e-13)
    for k, row in enumerate(q):
        here, left = solve(model, here, Motors(dict(zip(motors, row, strict=True))), tolerance=1e-14, iterations=60)
        assert left < 1e-12
        found[k] = model.pose(here, robot.platform)
    np.testing.assert_allclose(found[-1], own_pose(model, dict(zip(motors, q[-1], strict=True)), 40), atol=1e-11)
    return found


FORMS = {
    "3ppr_m1": 0.01,
    "3prp": 0.1,
    "3prr_m1": 0.02,
    "3puu": 0.05,
    "3rpr_m1": 0.1,
    "3rpr_m2": 0.01,
    "3rps": 0.02,
    "3rrr_m1": 0.05,
    "3rrr_m2": 0.05,
    "3upu": 0.02,
    "6pus": 0.002,
    "delta": 0.1,
    "gough_stewart": 0.001,
    "prrrp_m2": 0.05,
    "prrrp_parallel": 0.05,
    "quattro": 0.0005,
    "rprpr_m1": 0.05,
    "rprpr_m2": 0.05,
    "rrrrr_m1": 0.1,
    "rrrrr_m2": 0.1,
}
"""Robots whose motors follow from the pose in closed form, one or more for each form."""
HALF = {
    "four_bar": 1.0,
    "geared": 0.5,
    "screw": 4.0,
    "rrrrr_m1": 0.1,
    "prrrp_m1": 0.05,
    "3rrr_m1": 0.02,
    "3rps": 0.01,
    "delta": 0.1,
    "quattro": 0.0005,
    "gough_stewart": 0.001,
    "3prp": 0.1,
    "3rpr_m2": 0.01,
    "rrrrr_m2": 0.1,
}
"""Half the width of each motor's interval (rad, or characteristic lengths)."""


def differs(name: str, count: int, folder: Path | None) -> float:
    """The largest difference of poses, and of their motors where they are found in closed form (1, radians, or
    characteristic lengths), at points of a curve, in a random order."""
    robot = made(name)
    found = export(robot, "python", box_of(robot, HALF[name]))
    q = along(*found.proof.proved, count)
    X = own_poses(robot, found.proof.motors, q)
    order = np.random.default_rng(1).permutation(count)
    module = module_of(found.code)
    status, x, R, p = module.forward(q[order])
    assert np.all(status == 0)
    off = max(np.abs(R - X[order, :3, :3]).max(), np.abs(p - X[order, :3, 3]).max() / robot.length)
    units = np.array([robot.length if robot.joints[name].type.has_translation else 1.0 for name in found.proof.motors])
    if found.closed:
        status, back = module.inverse(X[order, :3, :3], X[order, :3, 3])
        assert np.all(status == 0)
        off = max(off, np.abs((back - q[order]) / units).max())
    if folder is not None:
        code = export(robot, "c++", box_of(robot, HALF[name]), jumps=True).code
        rows = answered(compiled(folder, code, MAIN, "-DNAME=" + "_" * robot.name[0].isdigit() + robot.name), q[order])
        assert np.all(rows[:, 0] == 0)
        first = 2 + x.shape[1]
        off = max(
            off,
            np.abs(rows[:, first + 3 : first + 12].reshape(-1, 3, 3) - X[order, :3, :3]).max(),
            np.abs(rows[:, first : first + 3] - X[order, :3, 3]).max() / robot.length,
            np.abs(rows[:, 2:first] - x).max(),
        )
        if found.closed:
            assert np.all(rows[:, 1] == 0)
            off = max(off, np.abs((rows[:, -q.shape[1] :] - q[order]) / units).max())
    return float(off)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["screw", "geared"])
def test_couplings_inside_a_branch(name: str) -> None:
    assert differs(name, 300, None) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("name", HALF)
def test_a_hundred_thousand_points(name: str, tmp_path: Path) -> None:
    assert differs(name, 100_000, tmp_path) < 1e-12


def check_motors_of_poses(name: str, count: int) -> None:
    """In closed form the motors of a pose are those by which Pinocchio's model came there; it answers just where
    they lie in the box, and never for poses that the robot does not reach."""
    robot = hrsynth.load(name)
    found = export(robot, "python", box_of(robot, FORMS[name]))
    assert found.closed
    assert found.proof.parts[0].volume_fraction == 1.0
    made = module_of(found.code)
    low, high = found.proof.proved
    wider = 1.3 if len(low) < 4 else 1.06
    q = along(wider * low, wider * high, count)
    X = own_poses(robot, found.proof.motors, q)
    inside = np.all((q >= low) & (q <= high), axis=1)
    assert count // 20 < inside.sum() < count
    status, back = made.inverse(X[:, :3, :3], X[:, :3, 3])
    assert set(status[~inside]) == {made.OUTSIDE}
    assert not back[~inside].any()
    assert set(status[inside]) == {made.OK}
    units = np.array([robot.length if robot.joints[each].type.has_translation else 1.0 for each in found.proof.motors])
    np.testing.assert_allclose(back[inside] / units, q[inside] / units, rtol=0, atol=1e-12)
    far = made.inverse(X[inside, :3, :3], X[inside, :3, 3] + 30 * robot.length * np.array([1.0, 0.5, 0.2]))[0]
    assert set(far) <= {made.UNREACHED, made.OUTSIDE}
    turned = made.inverse(X[inside, :3, :3] @ np.diag([1.0, -1.0, -1.0]), X[inside, :3, 3])[0]
    assert set(turned) <= {made.UNREACHED, made.OUTSIDE}


def test_motors_of_poses_in_closed_form() -> None:
    check_motors_of_poses("rrrrr_m2", 100)


@pytest.mark.some(0, 8)
@pytest.mark.parametrize("name", FORMS)
def test_motors_of_poses_for_each_form(name: str) -> None:
    check_motors_of_poses(name, 150)


def test_a_pose_of_another_branch_is_not_reached() -> None:
    """A five-bar's platform mirrored at the line of its elbows: the same motors close the loop there."""
    robot = hrsynth.load("rrrrr_m1")
    made = module_of(export(robot, "python", box_of(robot, 0.1)).code)
    elbow, other, tip = (robot.joints[name].point for name in ("elbow_1", "elbow_2", "end"))
    line, arm = (other - elbow) / np.linalg.norm(other - elbow), tip - elbow
    mirrored = 2 * (line @ arm) * line - arm
    turn = np.arctan2(np.cross(arm, mirrored)[2], arm @ mirrored)
    Z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    X = robot.links[robot.platform].pose
    assert np.linalg.norm(elbow + mirrored - other) == pytest.approx(np.linalg.norm(tip - other))
    poses = np.array([X[:3, :3], Z @ X[:3, :3]]), np.array([X[:3, 3], elbow + Z @ (X[:3, 3] - elbow)])
    assert made.inverse(*poses)[0].tolist() == [made.OK, made.UNREACHED]
