"""Names, the place of the base, the order of the legs and the choice of cut joints change nothing."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import strategies
from hrsynth.analysis.derive import Derivation, derive
from hrsynth.description import list_robots, load
from hrsynth.mechanism import Mechanism

CHANGES = ("transformed", "renamed", "reordered", "recut", "split")
QUICK = ("3rrr_m1", "rrrrr_m1", "prrrp_parallel_point", "3upu", "delta", "quattro", "uranesx")


def changed(mechanism: Mechanism, change: str, rng: np.random.Generator) -> Mechanism:
    """The same robot, written differently."""
    if change == "transformed":
        return strategies.transformed(mechanism, strategies.random_rotation(rng), rng.normal(size=3))
    return getattr(strategies, change)(mechanism, rng)


def essence(found: Derivation) -> tuple[object, ...]:
    """What may not depend on the way of writing; legs as a multiset."""
    hidden = found.hidden_architecture
    words = None if hidden is None else sorted((word.text(), count) for count, word in hidden.terms)
    return (
        words,
        found.verdict.verdict,
        found.verdict.rank,
        found.dof,
        found.mobility,
        len(found.verdict.unobserved),
        found.equivalence.passed,
        found.unchecked and found.unchecked.equivalent,
    )


@cache
def as_shipped(name: str) -> tuple[object, ...]:
    """The essence of a shipped robot as its file has it."""
    return essence(derive(load(name)))


@pytest.mark.some(1, 40)
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in list_robots()])
def test_the_same_robot_written_differently_has_the_same_hidden_robot(name: str, change: str) -> None:
    rng = np.random.default_rng(sorted(list_robots()).index(name))
    assert essence(derive(changed(load(name), change, rng))) == as_shipped(name)


@pytest.mark.slow
@given(st.data(), st.integers(0, 2**31))
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_random_robots_are_certified_and_keep_their_hidden_robot(data: st.DataObject, seed: int) -> None:
    robot = data.draw(strategies.parallel_robots())
    found = derive(robot)
    assert found.equivalence.passed
    assert found.equivalence.largest_angle < 1e-6
    assert found.equivalence.smallest_gap > 1e3
    change = data.draw(st.sampled_from(CHANGES))
    assert essence(derive(changed(robot, change, np.random.default_rng(seed)))) == essence(found)


@pytest.mark.long
@given(strategies.parallel_robots())
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_many_random_robots_are_certified(robot: Mechanism) -> None:
    found = derive(robot)
    assert found.equivalence.passed
    assert found.hidden is None or found.equivalence.smallest_gap > 1e3
