"""MMT Figs 8, 10(b) and 16: constructed singular poses, their words verified from the robot's geometry alone."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from analysis.singularity.found import found
from hrsynth.analysis.singularity.singularities import Example, Singularity
from hrsynth.geometry.vectors import Array, invert_pose, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from kinematics.robots import state_of
from oracle import Oracle

CASES = [("3rrr_m1",), ("gough_stewart", "1,2,3"), ("quattro_rigid", "1,4"), ("quattro", "1,4"), ("quattro_rigid",)]
CLEAR = 1e-3
"""Smallest singular value that counts as clearly not singular, a centimetre away."""
SHARP = 1e-9


def carried(at: ClosedConfiguration, point: Array, link: str) -> Array:
    """Where a point of a link at the zero configuration is now (metres)."""
    zero = at.model.mechanism.links[link].pose
    moved = at.pose(link) @ invert_pose(zero) @ np.append(point, 1.0)
    return np.asarray(moved[:3])


def centre(at: ClosedConfiguration, name: str) -> Array:
    """The centre of a joint (metres)."""
    joint = at.model.mechanism.joints[name]
    return carried(at, joint.point, joint.predecessor)


def velocity(at: ClosedConfiguration, twist: Array, point: Array) -> Array:
    """The velocity of a point of the platform for a twist at the platform frame's origin."""
    return np.asarray(twist[:3] + np.cross(twist[3:], point - at.pose(at.model.mechanism.platform)[:3, 3]))


def the_lost(example: Example) -> Array:
    (lost,) = example.unobserved
    return np.asarray(lost.twist)


@cache
def answer(*case: str) -> Singularity:
    return found(*case)


def examples(*case: str) -> tuple[Example, ...]:
    found = answer(*case).examples
    assert found
    return found


@pytest.mark.some(1)
@pytest.mark.parametrize("case", CASES)
def test_the_rank_is_lost_there_and_full_a_centimetre_away(case: tuple[str, ...]) -> None:
    for each in examples(*case):
        assert each.sigma < SHARP
        assert each.nearby > CLEAR


@pytest.mark.some(2)
@pytest.mark.parametrize("case", CASES)
def test_the_oracle_sees_the_same_lost_freedom(case: tuple[str, ...]) -> None:
    """In maximal coordinates, without the engine: one twist of the platform that keeps the observed directions."""
    found = answer(*case)
    observation_model = found.observation_model
    for each in examples(*case):
        at = each.configuration
        oracle = Oracle(at.model.mechanism)
        state = state_of(at.model, at.q)
        assert oracle.error(state) < SHARP
        basis = oracle.relation(state, observation_model.observations, unit_length=1.0)
        _, values, right = np.linalg.svd(basis[6:])
        idle = right[int(np.sum(values > 1e-7)) :].T
        U, sizes, _ = np.linalg.svd(basis[:6] @ idle)
        assert int(np.sum(sizes > 1e-6)) == 1
        assert np.linalg.norm(np.cross(U[:3, 0], normalise_vector(the_lost(each))[:3])) < 1e-6
        assert abs(U[:, 0] @ normalise_vector(the_lost(each))) == pytest.approx(1, abs=1e-9)


def test_fig_8_the_lines_along_the_cranks_meet_and_the_platform_turns_about_that_point() -> None:
    """3-ΠR̲R: the normals of the tips' paths are the lines through B_i parallel to the cranks."""
    for each in examples("3rrr_m1"):
        at, lost = each.configuration, the_lost(each)
        tips = [centre(at, f"wrist_{i}") for i in "123"]
        cranks = [normalise_vector(centre(at, f"elbow_{i}") - centre(at, f"shoulder_{i}")) for i in "123"]
        across = np.array([np.cross([0, 0, 1.0], crank)[:2] for crank in cranks])
        offsets = np.array([row @ tip[:2] for row, tip in zip(across, tips, strict=True)])
        point = np.append(np.linalg.lstsq(across, offsets, rcond=None)[0], tips[0][2])
        assert np.linalg.matrix_rank(across, tol=1e-3) == 2
        assert max(np.linalg.norm(np.cross(crank, point - tip)) for crank, tip in zip(cranks, tips, strict=True)) < 1e-8
        np.testing.assert_allclose(velocity(at, lost, point), 0, atol=1e-7 * np.linalg.norm(lost))
        assert abs(lost[5]) > 0.1 * np.linalg.norm(lost)
        assert "rotation" in each.unobserved[0].name


def test_fig_10b_four_planes_meet_in_a_point() -> None:
    """3-U̲PS: the planes through B_i normal to the rods, and the plane B1B2B3, as four rows (n, −n·B) of rank three."""
    for each in examples("gough_stewart", "1,2,3"):
        at, lost = each.configuration, the_lost(each)
        tips = [centre(at, f"wrist_{i}") for i in "123"]
        rods = [normalise_vector(tip - centre(at, f"shoulder_{i}")) for i, tip in zip("123", tips, strict=True)]
        normal = normalise_vector(np.cross(tips[1] - tips[0], tips[2] - tips[0]))
        normals = [*rods, normal]
        planes = np.array([[*n, -n @ (tip - tips[0])] for n, tip in zip(normals, [*tips, tips[0]], strict=True)])
        values = np.linalg.svd(planes, compute_uv=False)
        assert values[3] < 1e-9 < 1e-4 < values[2]
        for rod, tip in zip(rods, tips, strict=True):
            speed = velocity(at, lost, tip)
            assert np.linalg.norm(np.cross(rod, speed)) < 1e-7 * np.linalg.norm(lost)


def tangent(at: ClosedConfiguration, leg: str) -> Array:
    """The unit tangent of the elbow's path, midway between the two balls, from the file's joints."""
    shoulder = at.model.mechanism.joints[f"shoulder_{leg}"]
    elbow = (centre(at, f"elbow_{leg}a") + centre(at, f"elbow_{leg}b")) / 2
    return normalise_vector(np.cross(shoulder.axis, elbow - shoulder.point))


@pytest.mark.parametrize(("case", "legs"), [(("quattro_rigid", "1,4"), "14"), (("quattro_rigid",), "1234")])
def test_fig_16_the_tangents_are_parallel_and_the_platform_moves_along_them(case: tuple[str, ...], legs: str) -> None:
    for each in examples(*case):
        at, lost = each.configuration, normalise_vector(the_lost(each))
        np.testing.assert_allclose(lost[3:], 0, atol=1e-8)
        for leg in legs:
            assert np.linalg.norm(np.cross(tangent(at, leg), lost[:3])) < 1e-7


def test_the_halves_of_the_articulated_platform() -> None:
    """det(τ1, τ4, e) = 0 with e = z × D1D2 from the hinges of the platform."""
    for each in examples("quattro", "1,4"):
        at = each.configuration
        hinges = [j for j in at.model.mechanism.joints.values() if j.name.startswith("hinge_")]
        one, two = (centre(at, joint.name) for joint in hinges)
        e = normalise_vector(np.cross([0, 0, 1.0], two - one))
        assert abs(np.linalg.det([tangent(at, "1"), tangent(at, "4"), e])) < 1e-8
        assert np.linalg.norm(np.cross(tangent(at, "1"), tangent(at, "4"))) > CLEAR


def test_the_rigid_platform_is_singular_on_its_axis_though_all_legs_are_watched() -> None:
    places = [np.hypot(each.pose.x, each.pose.y) for each in examples("quattro_rigid")]
    assert min(places) < 1e-7
