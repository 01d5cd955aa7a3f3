"""Screws of joints: what a joint allows and what it transmits are each other's complements."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from hrsynth.mechanism.model import JointType
from hrsynth.mechanism.screws import list_allowed_twists, list_transmitted_wrenches


@pytest.mark.parametrize("kind", list(JointType))
def test_what_a_joint_allows_is_reciprocal_to_all_that_it_transmits(kind: JointType) -> None:
    rng = np.random.default_rng(7)
    point, *axes = (np.array([Fraction(int(x)) for x in rng.integers(-9, 10, 3)], dtype=object) for _ in range(3))
    twists, wrenches = (
        np.array(each(kind, point, axes if kind is JointType.UNIVERSAL else axes[:1]), dtype=object).reshape(-1, 6)
        for each in (list_allowed_twists, list_transmitted_wrenches)
    )
    assert len(twists) == kind.freedoms == 6 - len(wrenches)
    assert not (twists @ wrenches.T).any()
    for screws in (twists, wrenches):
        assert np.linalg.matrix_rank(screws.astype(float)) == len(screws)
