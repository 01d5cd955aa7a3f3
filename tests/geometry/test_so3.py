"""Exponential and logarithm of rotations are inverse everywhere, half turns and small ones included."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from hrsynth.geometry.so3 import (
    compute_rotation_angle,
    compute_rotation_vector_rate,
    convert_rotations_to_vectors,
    convert_to_quaternions,
    convert_vectors_to_rotations,
    find_smallest_rotations,
    turn_about,
    wrap_angle,
)
from hrsynth.geometry.vectors import Array, convert_rpy_to_rotation, hat
from hrsynth.mechanism.pose import Pose, compute_rpy

NEAR = 1e-12
parts = st.floats(-1, 1, allow_subnormal=False)
axes = st.tuples(parts, parts, parts).filter(lambda v: np.linalg.norm(v) > 1e-3).map(
    lambda v: v / np.linalg.norm(v)
) | st.sampled_from([sign * axis for axis in np.eye(3) for sign in (1, -1)])
sizes = st.integers(-16, -1).map(lambda power: 10.0**power)
angles = (
    st.floats(0, np.pi)
    | st.sampled_from([0.0, np.pi / 2, 2 * np.pi / 3, np.pi])
    | sizes
    | sizes.map(lambda less: np.pi - less)
)


@given(axes, angles)
@settings(max_examples=300)
def test_the_logarithm_is_the_inverse_of_the_exponential(axis: Array, angle: float) -> None:
    R = convert_vectors_to_rotations(angle * axis)
    vector = convert_rotations_to_vectors(R)
    assert np.abs(convert_vectors_to_rotations(vector) - R).max() < NEAR
    assert np.linalg.norm(vector) == pytest.approx(angle, abs=NEAR)
    assert compute_rotation_angle(R) == pytest.approx(angle, abs=NEAR)
    apart = [float(np.abs(vector - sign * angle * axis).max()) for sign in (1, -1)]
    assert min(apart[:1] if angle < np.pi - NEAR else apart) < NEAR
    assert convert_rotations_to_vectors(R[None])[0] == pytest.approx(vector, abs=NEAR) or angle > np.pi - NEAR
    assert np.abs(convert_vectors_to_rotations(convert_rotations_to_vectors(R[None]))[0] - R).max() < NEAR


@given(axes, angles)
def test_the_exponential_is_that_of_matrices(axis: Array, angle: float) -> None:
    assert np.abs(convert_vectors_to_rotations(angle * axis) - expm(angle * hat(axis))).max() < NEAR


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3)])
def test_half_a_turn_about_a_coordinate_axis_is_exact(axis: Array) -> None:
    R = np.diag(2 * axis**2 - 1)
    assert np.abs(np.abs(convert_rotations_to_vectors(R)) - np.pi * np.abs(axis)).max() == 0
    assert np.abs(np.abs(convert_rotations_to_vectors(R[None])) - np.pi * np.abs(axis)).max() == 0


def test_many_at_once_are_as_one_by_one() -> None:
    vectors = np.random.default_rng(0).normal(size=(4, 5, 3))
    R = convert_vectors_to_rotations(vectors)
    for place in np.ndindex(4, 5):
        assert R[place] == pytest.approx(convert_vectors_to_rotations(vectors[place]), abs=1e-15)
        assert convert_rotations_to_vectors(R)[place] == pytest.approx(
            convert_rotations_to_vectors(R[place]), abs=1e-14
        )
        assert hat(vectors)[place] == pytest.approx(hat(vectors[place]))


@given(axes, angles)
def test_a_quaternion_turns_as_its_rotation(axis: Array, angle: float) -> None:
    R = convert_vectors_to_rotations(angle * axis)
    w, *v = convert_to_quaternions(R[None])[0]
    assert w >= 0
    assert pytest.approx(np.eye(3) + 2 * w * hat(v) + 2 * hat(v) @ hat(v), abs=NEAR) == R


@given(axes, st.floats(0.01, 3.1), axes)
def test_the_rate_of_the_logarithm(axis: Array, angle: float, omega: Array) -> None:
    R, h = convert_vectors_to_rotations(angle * axis), 1e-6
    ahead, behind = (convert_rotations_to_vectors(convert_vectors_to_rotations(step * omega) @ R) for step in (h, -h))
    assert compute_rotation_vector_rate(angle * axis) @ omega == pytest.approx((ahead - behind) / (2 * h), abs=1e-6)


@given(axes)
def test_the_rate_at_half_a_turn_and_at_none(axis: Array) -> None:
    near = (np.pi - 1e-9) * axis
    assert compute_rotation_vector_rate(np.pi * axis) == pytest.approx(compute_rotation_vector_rate(near), abs=1e-8)
    assert compute_rotation_vector_rate(1e-9 * axis) == pytest.approx(np.eye(3), abs=1e-8)


@example(np.array([0.0, -1.0, 0.0]), np.array([0.0, 1.0, 5.58119574e-159]))
@example(np.array([0.0, -1.0, 0.0]), np.array([1e-310, 1.0, 0.0]))
@example(np.array([0.0, 1.0, 0.0]), np.array([1e-78, 1.0, 1e-80]))
@example(np.array([0.0, -1.0, 0.0]), np.array([1e-78, 1.0, 1e-80]))
@given(axes, axes)
def test_the_smallest_turn_between_two_directions(a: Array, b: Array) -> None:
    for other in (b, -a, a):
        vector = find_smallest_rotations(a, other)
        assert convert_vectors_to_rotations(vector) @ a == pytest.approx(other, abs=1e-9)
        assert np.linalg.norm(vector) == pytest.approx(np.arctan2(np.linalg.norm(np.cross(a, other)), a @ other))
        assert abs(vector @ a) < 1e-9


@given(axes, st.floats(-np.pi, np.pi))
def test_the_turn_about_an_axis_is_found_whole(axis: Array, angle: float) -> None:
    found = turn_about(axis, convert_vectors_to_rotations(angle * axis))[0]
    assert abs(wrap_angle(found - angle)) < NEAR


def test_a_swing_of_half_a_turn_has_no_twist() -> None:
    assert np.isnan(turn_about(np.array([0.0, 0.0, 1.0]), np.diag([1.0, -1.0, -1.0]))[0])


@given(axes, angles | st.just(np.pi))
def test_a_printed_rotation_can_be_typed_back(axis: Array, angle: float) -> None:
    R = convert_vectors_to_rotations(angle * axis)
    assert convert_rpy_to_rotation(*compute_rpy(R)) == pytest.approx(R, abs=2 * NEAR)
    assert compute_rotation_angle(Pose.parse(str(Pose(rpy=compute_rpy(R)))).rotation @ R.T) < 2e-6


@given(st.floats(-4, 4), st.sampled_from([np.pi / 2, -np.pi / 2]), st.floats(-4, 4), st.just(0.0) | sizes)
def test_a_rotation_next_to_a_right_pitch_can_be_typed_back(roll: float, pitch: float, yaw: float, off: float) -> None:
    R = convert_rpy_to_rotation(roll, pitch + off, yaw)
    assert convert_rpy_to_rotation(*compute_rpy(R)) == pytest.approx(R, abs=2 * NEAR)
