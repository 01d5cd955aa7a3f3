"""Products of vectors for numbers of any kind, against NumPy; quaternions and rotations are inverse to each other."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.geometry.so3 import convert_from_quaternion, convert_to_quaternions, convert_vectors_to_rotations
from hrsynth.geometry.vectors import cross, dot, hat, measure_angle, sort_rows, triple

SHAPES = [((3,), (3,)), ((5, 3), (3,)), ((4, 1, 3), (5, 3))]


@pytest.mark.parametrize("shapes", SHAPES)
def test_products_are_numpys(shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    rng = np.random.default_rng(0)
    a, b = (rng.normal(size=shape) for shape in shapes)
    assert np.array_equal(cross(a, b), np.cross(a, b))
    assert dot(a, b) == pytest.approx(np.einsum("...i,...i", *np.broadcast_arrays(a, b)))
    assert triple(a, b, b) == pytest.approx(0, abs=1e-15)
    assert (hat(a) @ b[..., None])[..., 0] == pytest.approx(np.cross(a, b))


@pytest.mark.parametrize("axis", [-1, -2, -3])
def test_products_run_along_any_dimension(axis: int) -> None:
    rng = np.random.default_rng(1)
    a, b = (np.moveaxis(rng.normal(size=(2, 4, 3)), -1, axis) for _ in range(2))
    assert np.array_equal(cross(a, b, axis), np.cross(a, b, axis=axis))
    assert np.array_equal(dot(a, b, axis), (a * b).sum(axis))


@pytest.mark.parametrize("count", [(), (4,)])
def test_products_of_exact_numbers_are_exact(count: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    a, b = (np.vectorize(Fraction, otypes=[object])(rng.integers(1, 10**9, (*count, 3)), 10**9 + 7) for _ in range(2))
    found = cross(a, b)
    assert found.dtype == object
    assert not dot(a, found).any()
    assert not dot(b, found).any()
    assert all(isinstance(x, Fraction) for x in found.flat)


def test_quaternions_and_rotations_are_inverse() -> None:
    rng = np.random.default_rng(3)
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1)[:, None] * np.where(q[:, :1] < 0, -1.0, 1.0)
    R = np.array([convert_from_quaternion(each) for each in q])
    assert convert_to_quaternions(R) == pytest.approx(q, abs=1e-14)
    assert R @ R.swapaxes(1, 2) == pytest.approx(np.broadcast_to(np.eye(3), R.shape), abs=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi / 2, np.pi - 1e-9])
def test_the_angle_between_a_vector_and_its_turn(angle: float) -> None:
    rng = np.random.default_rng(4)
    v = rng.normal(size=3)
    normal = np.cross(v, rng.normal(size=3))
    turned = convert_vectors_to_rotations(angle * normal / np.linalg.norm(normal)) @ v
    assert measure_angle(v, turned) == pytest.approx(angle, abs=1e-14)


@given(st.lists(st.tuples(*3 * [st.integers(-2, 2)]), min_size=1, max_size=12, unique=True), st.randoms())
def test_an_order_is_that_of_the_rows_whatever_their_last_digits_and_places(rows, random) -> None:
    """Rows of small integers, none twice, have one order."""
    random.shuffle(rows)
    near = [
        [value * (1 + 1e-9 * random.uniform(-1, 1)) + 1e-12 * random.uniform(-1, 1) for value in row] for row in rows
    ]
    assert [rows[i] for i in sort_rows(np.array(near), 1e-6)] == sorted(rows)
