"""Joint limits of singular poses and maps: joints beyond them are those that the poses of the links show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hrsynth.analysis.accuracy.accuracy import accuracy
from hrsynth.analysis.check import check
from hrsynth.analysis.singularity.locus import compute_locus
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.description import load
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.mechanism import Joint, JointType, Mechanism
from hrsynth.mechanism.model import Limits

ROUNDING = 1e-7


def limited(robot: str, among: Callable[[Joint], bool], low: float, high: float) -> Mechanism:
    """A shipped robot with limits on some of its R and P joints."""
    given = load(robot)
    kinds = (JointType.REVOLUTE, JointType.PRISMATIC)
    chosen = [joint for joint in given.joints.values() if joint.type in kinds and among(joint)]
    return given.changed(joints=[replace(joint, limits=Limits(low, high)) for joint in chosen])


def measure(at: ClosedConfiguration, joint: Joint) -> float:
    """A joint's displacement or angle from zero, by the poses of its two links alone."""
    links = at.model.mechanism.links
    one, two = (at.pose(link) @ np.linalg.inv(links[link].pose) for link in (joint.predecessor, joint.successor))
    moved: Array = np.linalg.inv(one) @ two
    axis = joint.axes[0]
    if joint.type is JointType.PRISMATIC:
        return float(axis @ (moved[:3, :3] @ joint.point + moved[:3, 3] - joint.point))
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    turned = moved[:3, :3] @ across
    return float(np.arctan2(axis @ np.cross(across, turned), across @ turned))


def list_beyond(at: ClosedConfiguration) -> set[str]:
    return {
        joint.name
        for joint in at.model.mechanism.joints.values()
        if joint.limits is not None
        and not joint.limits.lower - ROUNDING <= measure(at, joint) <= joint.limits.upper + ROUNDING
    }


def is_elbow(joint: Joint) -> bool:
    return joint.name.startswith("elbow")


def is_motor(joint: Joint) -> bool:
    return joint.is_actuated


ROBOTS = [
    pytest.param("3rrr_m1", is_elbow, -0.6, 0.6, False, id="3rrr"),
    pytest.param("3rrr_m1", is_motor, -0.3, 0.3, True, id="3rrr_real"),
    pytest.param("3rpr_m1", is_motor, -0.05, 0.05, False, id="3rpr"),
    pytest.param("rrrrr_m1", is_motor, -0.02, 0.02, False, id="rrrrr_none_within"),
    pytest.param("orthoglide", is_motor, -0.1, 0.1, True, id="orthoglide_real", marks=pytest.mark.slow),
    pytest.param("gough_stewart", is_motor, -0.2, 0.2, True, id="gough_stewart_real", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("name", "among", "low", "high", "real"), ROBOTS)
def test_singular_poses_within_limits_come_first_and_others_are_marked(
    name: str, among: Callable[[Joint], bool], low: float, high: float, real: bool
) -> None:
    found = singularities(limited(name, among, low, high), real=real, points=400)
    told = [list_beyond(each.configuration) for each in found.examples]
    assert [set(each.beyond_limits) for each in found.examples] == told
    assert [bool(each) for each in told] == sorted(bool(each) for each in told)
    assert found.checked is not None
    if not found.examples:
        return
    assert bool(told[0]) == all(list_beyond(at) for at in found.checked.on_locus)
    assert ("none found within joint limits" in str(found)) == bool(told[0])
    assert str(found).count("  beyond joint limits: ") == sum(map(bool, told))


@pytest.mark.parametrize("name", ["3rrr_m1", "3rpr_m1"])
def test_a_singular_pose_within_limits_is_found_where_one_is_known(name: str) -> None:
    """Limits are drawn around zero and one singular pose of the robot without limits."""
    free = singularities(load(name), points=400)
    at = free.examples[-1].configuration
    joints = []
    for joint in load(name).joints.values():
        if joint.type in (JointType.REVOLUTE, JointType.PRISMATIC):
            there = measure(at, at.model.mechanism.joints[joint.name])
            joints.append(replace(joint, limits=Limits(min(there, 0.0) - 0.05, max(there, 0.0) + 0.05)))
    found = singularities(load(name).changed(joints=joints), points=400)
    assert found.examples[0].beyond_limits == ()
    assert list_beyond(found.examples[0].configuration) == set()


@pytest.mark.parametrize(
    ("name", "among", "plane", "axes"),
    [
        ("3rrr_m1", is_elbow, "phi=0.2", "x=-0.1:0.1:9,y=-0.1:0.1:9"),
        pytest.param("orthoglide", is_motor, "z=0.02", "x=-0.2:0.2:9,y=-0.2:0.2:9", marks=pytest.mark.slow),
    ],
)
def test_maps_mark_the_poses_beyond_limits(name: str, among: Callable[[Joint], bool], plane: str, axes: str) -> None:
    robot = limited(name, among, -0.1, 0.15)
    checked = check(robot, grid=f"{axes},{plane}").grid
    assert checked is not None
    assert checked.beyond is not None
    expected = [each is not None and bool(list_beyond(each.configuration)) for each in checked.postures]
    assert 0 < sum(expected) < len(expected)
    np.testing.assert_array_equal(checked.beyond.ravel(), expected)
    errors = accuracy(robot, cone="0.1deg", grid=f"{axes},{plane}").field
    assert errors is not None
    np.testing.assert_array_equal(errors.beyond, checked.beyond)
    locus = compute_locus(robot, plane=plane, steps=7)
    there = check(robot, grid=locus.grid).grid
    assert there is not None
    np.testing.assert_array_equal(locus.beyond, there.beyond)
    assert locus.to_dict()["beyond_limits"] == there.to_dict()["beyond_limits"]


def test_a_robot_without_limits_has_no_marks() -> None:
    checked = check(load("3rrr_m1"), grid="x=0:0.1:3,y=0").grid
    assert checked is not None
    assert checked.beyond is None
    assert "beyond_limits" not in checked.to_dict()


def test_the_curve_over_motors_goes_on_beyond_limits() -> None:
    """As the cells do, which are marked there."""
    grid = "motors:shoulder_1=-1:1:11,shoulder_2=-1:1:11"
    free = accuracy(load("rrrrr_m1"), cone="0.1deg", grid=grid).field
    bound = accuracy(limited("rrrrr_m1", is_elbow, -0.3, 0.3), cone="0.1deg", grid=grid).field
    assert free is not None
    assert bound is not None
    assert bound.beyond is not None
    assert bound.beyond.any()
    assert len(free.curve)
    np.testing.assert_allclose(bound.curve, free.curve, atol=1e-9)
