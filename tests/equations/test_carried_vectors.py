"""Second derivatives of loop equations, against differences of the first."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import hrsynth
from hrsynth.equations.carried_vectors import SweptChains, Total, add_bend, build_row_product
from hrsynth.equations.joint_equations import build_loop_system, evaluate_residuals


@settings(max_examples=12, deadline=None)
@given(st.sampled_from(["rrrrr_m1", "3rps", "delta", "gough_stewart", "3prp"]), st.integers(0, 100))
def test_second_derivatives_of_loops(name: str, seed: int) -> None:
    """They are those of the first ones, by differences."""
    robot, rng = hrsynth.load(name), np.random.default_rng(seed)
    system = build_loop_system(robot, [each for each, joint in robot.joints.items() if joint.is_actuated])
    values, h = rng.uniform(-0.7, 0.7, len(system.coordinates)), 1e-5
    carrier = SweptChains(system, [values[None, i] for i in range(len(values))])
    for loop in system.loops:
        whole = [Total(np.zeros(1), 2 * (len(values),)) for _ in loop.rows]
        for bend, row in zip(whole, loop.rows, strict=True):
            add_bend(bend, build_row_product(carrier, loop, row))
        for j in loop.coordinates:
            moved = values.copy(), values.copy()
            moved[0][j] += h
            moved[1][j] -= h
            up, down = (evaluate_residuals(system, loop, list(each), loop.rows)[1] for each in moved)
            for bend, after, before in zip(whole, up, down, strict=True):
                for i in after:
                    rate = (np.asarray(after[i]) - np.asarray(before[i])) / (2 * h)
                    assert np.allclose(bend.sum[0, i, j], rate, atol=1e-8)
