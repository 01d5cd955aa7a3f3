"""Krawczyk's operator: what it accepts holds exactly one zero, counted by bisection of a polynomial."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb
from hypothesis import assume, given
from hypothesis import strategies as st

from hrsynth.geometry.affine import make_affine
from hrsynth.geometry.vectors import Array
from hrsynth.solving.krawczyk import bound_contraction, bound_image, enclose_zero

ROOTS = st.lists(st.integers(-40, 40), min_size=3, max_size=3, unique=True)


class Cubic:
    """(x − a)(x − b)(x − c) as an equation in one unknown."""

    def __init__(self, roots: Sequence[float]) -> None:
        self.roots = roots

    def value(self, x: Sequence[Any]) -> Any:
        a, b, c = self.roots
        return (x[0] - a) * (x[0] - b) * (x[0] - c)

    def slopes(self, x: Sequence[Any]) -> list[Any]:
        a, b, c = self.roots
        return [(x[0] - a) * (x[0] - b) + (x[0] - a) * (x[0] - c) + (x[0] - b) * (x[0] - c)]


@given(ROOTS, st.integers(0, 2), st.floats(-1e-3, 1e-3))
def test_a_box_of_balls_holds_its_zero_and_no_other(roots: list[int], which: int, off: float):
    box = enclose_zero([Cubic(roots)], [arb(roots[which] + off)])
    assert box is not None
    assert [root for root in roots if box[0].contains(root)] == [roots[which]]


def test_a_double_zero_is_not_enclosed():
    assert enclose_zero([Cubic([1, 1, 5])], [arb(1)]) is None


@given(ROOTS, st.floats(-45, 45), st.floats(1e-3, 30))
def test_an_image_inside_its_box_means_exactly_one_zero(roots: list[int], middle: float, radius: float):
    """For affine forms, and only then: boxes with none or several zeros are never accepted."""
    cubic = Cubic(roots)
    slope = cubic.slopes([middle])[0]
    assume(abs(slope) > 1e-6)
    Y: Array = np.array([[[1 / slope]]])
    form = make_affine(np.array([middle]), np.zeros((1, 0)), np.array([radius]))
    J = cubic.slopes([form])[0]
    J.v, J.r = J.v[..., None, None], J.r[..., None, None]
    step = np.abs(Y[:, 0] * cubic.value([middle])) * (1 + 1e-12)
    reach = bound_image(step, bound_contraction(Y, J), np.array([[radius]]))
    if reach[0, 0] < radius:
        assert sum(abs(root - middle) < radius for root in roots) == 1


def test_small_boxes_about_zeros_are_accepted():
    cubic, Y = Cubic([-2, 0, 3]), np.array([[[-1 / 6]]])
    form = make_affine(np.array([0.01]), np.zeros((1, 0)), np.array([0.05]))
    J = cubic.slopes([form])[0]
    J.v, J.r = J.v[..., None, None], J.r[..., None, None]
    step = np.abs(Y[:, 0] * cubic.value([0.01]))
    assert bound_image(step, bound_contraction(Y, J), np.array([[0.05]]))[0, 0] < 0.05
