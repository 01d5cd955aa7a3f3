"""Words, expression and rank agree on every robot, and a wrong condition is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import sympy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import strategies
from analysis.singularity.found import found
from analysis.singularity.test_conditions import CASES, HEAVY
from hrsynth.analysis.singularity.condition_check import Agreement, compare_condition, compute_smallest_value
from hrsynth.analysis.singularity.rank_descent import descend_to_rank_loss
from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.constraints.condition import Condition, derive_condition
from hrsynth.constraints.locked_legs import LockedLeg
from hrsynth.constraints.pattern import ConstraintPattern, PatternValues
from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest, Disagreement
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism import Mechanism
from hrsynth.tolerances import RANK_CUTOFF_FRACTION, RANK_GAP_MIN

ANGLE = 1e-8


def check(answer: Singularity, points: int) -> None:
    checked = answer.checked
    assert (checked is None) is answer.always
    assert answer.always is (answer.verdict.rank < answer.verdict.dof)
    if checked is None:
        return
    assert (checked.points, checked.disagreements) == (points, 0)
    assert checked.largest_angle < ANGLE
    assert checked.smallest > 0
    if answer.condition.signed:
        assert sum(checked.sides) == points
    if answer.condition.never:
        assert checked.on_locus == ()
    for each in answer.examples:
        assert each.sigma < RANK_CUTOFF_FRACTION < each.nearby
        assert each.unobserved


@pytest.mark.some(1, 8)
@pytest.mark.parametrize(
    ("robot", "legs", "real"),
    [
        pytest.param(*case, marks=pytest.mark.slow if case[0] in HEAVY and case[1:] == (None, False) else ())
        for case in CASES
    ],
)
def test_shipped_robots(robot: str, legs: str | None, real: bool) -> None:
    check(found(robot, legs, real=real), 100)


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("robot", list_robots())
def test_shipped_robots_at_ten_thousand_poses(robot: str) -> None:
    check(singularities(load(robot)), 10_000)


@pytest.mark.some(0, 4)
@pytest.mark.parametrize("robot", list_robots())
def test_shipped_robots_with_their_own_motors(robot: str) -> None:
    check(singularities(load(robot), real=True, points=1000), 1000)


@pytest.mark.slow
def test_a_zero_of_the_expression_where_the_platform_has_fewer_freedoms_is_no_disagreement() -> None:
    """det(p1, p2, p3) also vanishes where the platform itself has two freedoms: nothing is lost to the motors there."""
    check(singularities(load("3upu"), real=True, points=40), 40)


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs", "real"),
    [
        ("3rrr_m1", None, False),
        ("rrrrr_m1", None, False),
        ("gough_stewart", "1,2,3", False),
        ("quattro", "1,4", False),
        ("3rrr_m2", None, True),
        ("rrrrr_m1", None, True),
    ],
)
def test_a_condition_whose_sign_changes_has_poses_on_its_locus(robot: str, legs: str | None, real: bool) -> None:
    answer = singularities(load(robot), legs, real=real, points=500)
    assert answer.condition.signed
    assert min(answer.checked.sides) > 0
    assert len(answer.examples) > 0


@pytest.mark.slow
@given(
    robot=st.one_of(strategies.planar_robots(point=None), strategies.delta_like(), strategies.parallel_robots()),
    seed=st.integers(0, 2**31),
    real=st.booleans(),
)
@settings(max_examples=3, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_random_robots(robot: Mechanism, seed: int, real: bool) -> None:
    check_random_robot(robot, seed, real, 12)


@pytest.mark.long
@given(robot=strategies.parallel_robots(), seed=st.integers(0, 2**31), real=st.booleans())
@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_many_random_robots(robot: Mechanism, seed: int, real: bool) -> None:
    check_random_robot(robot, seed, real, 100)


def check_random_robot(robot: Mechanism, seed: int, real: bool, points: int) -> None:
    """Words, expression and rank agree, and turning the whole robot changes neither words nor expression."""
    one = singularities(robot, real=real, points=points)
    check(one, points)
    rng = np.random.default_rng(seed)
    turned = strategies.transformed(robot, strategies.random_rotation(rng), rng.normal(size=3))
    two = singularities(turned, real=real, points=points)
    check(two, points)
    assert one.pattern.motion == two.pattern.motion
    assert one.to_dict()["expression"] == two.to_dict()["expression"]
    if one.condition is not None:
        assert one.words == two.words


# ---- what is wrong is told


def again(answer: Singularity, pattern: ConstraintPattern, wrong: Condition, points: int = 60) -> Agreement:
    return compare_condition(answer.setup.samples.start, answer.observation_model, pattern, wrong, points)


def with_leg(pattern: ConstraintPattern, leg: LockedLeg) -> ConstraintPattern:
    return replace(pattern, legs=(leg, *pattern.legs[1:]))


def elsewhere(answer: Singularity) -> LockedLeg:
    """The first leg with its tip a hand's breadth off."""
    leg = answer.pattern.legs[0]
    return replace(leg, tip=replace(leg.tip, place=leg.tip.place + [0.1, 0.2, 0.0]))


def of_another(answer: Singularity) -> LockedLeg:
    """The first leg with the line of the second."""
    first, second = answer.pattern.legs[:2]
    return replace(first, line=replace(second.line, symbol=first.line.symbol))


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", [("3rrr_m1",), ("3rpr_m1",), ("gough_stewart", "1,2,3"), ("hexa", "1,2,3")])
def test_another_tip_is_told(robot: Sequence[str]) -> None:
    answer = found(*robot)
    wrong = with_leg(answer.pattern, elsewhere(answer))
    with pytest.raises(Disagreement) as caught:
        again(answer, wrong, derive_condition(wrong, answer.observation_model))
    assert caught.value.angle > 1e-3
    assert answer.setup.mechanism.name in str(caught.value)


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "robot", [("3rrr_m1",), ("delta",), ("orthoglide",), ("gough_stewart", "1,2,3"), ("quattro", "1,4"), ("rrrrr_m1",)]
)
def test_another_line_is_told(robot: Sequence[str]) -> None:
    answer = found(*robot)
    wrong = with_leg(answer.pattern, of_another(answer))
    with pytest.raises(Disagreement) as caught:
        again(answer, wrong, derive_condition(wrong, answer.observation_model))
    assert caught.value.angle > 1e-3


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", [("3rrr_m1",), ("gough_stewart", "1,2,3"), ("quattro", "1,4")])
def test_another_expression_is_told(robot: Sequence[str]) -> None:
    """The legs are right, the expression is not: at the poses where it vanishes the rank is full."""
    answer = found(*robot)
    wrong = replace(answer.condition, expression=answer.condition.expression + sympy.Rational(1, 20))
    with pytest.raises(Disagreement) as caught:
        again(answer, answer.pattern, wrong, 150)
    assert caught.value.poses > 0
    assert caught.value.angle < ANGLE


class Never(Condition):
    """The claim that no freedom is ever lost."""

    def rows(self, here: PatternValues) -> Array:
        return np.broadcast_to(np.eye(3), (len(here.configurations), 3, 3)).copy()

    def expressed(self, here: PatternValues) -> Array:
        return np.ones(len(here.configurations))


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs", "real"),
    [
        ("3rrr_m1", None, False),
        ("3rps", None, False),
        ("3rpr_m1", None, True),
        ("gough_stewart", None, True),
        ("3prr_m1", None, True),
        ("orthoglide", None, True),
        ("prrrp_parallel", None, True),
    ],
)
def test_a_false_never_is_told_though_no_pose_that_was_drawn_is_singular(
    robot: str, legs: str | None, real: bool
) -> None:
    answer = found(robot, legs, real=real)
    assert answer.checked.smallest > RANK_CUTOFF_FRACTION * RANK_GAP_MIN
    with pytest.raises(Disagreement) as caught:
        again(answer, answer.pattern, Never("never", sympy.Integer(1), never=True), 20)
    assert caught.value.poses > 0
    assert caught.value.angle == 0.0


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "legs", "real"),
    [("3rrr_m1", None, False), ("3rpr_m1", None, False), ("3rps", None, True), ("gough_stewart", None, True)],
)
def test_where_the_rank_is_led_to_zero_the_expression_vanishes(robot: str, legs: str | None, real: bool) -> None:
    """The descent knows the relation alone, the expression names alone."""
    answer = found(robot, legs, real=real)
    start = answer.setup.samples.start
    ends = [
        at
        for drawn in walk_randomly(start, 40, 3, steps=8)
        if (at := descend_to_rank_loss(drawn, answer.observation_model)) is not None
        and at.kernel()[1].weakest > 0.05 * start.kernel()[1].weakest
    ]
    assert len(ends) > 4
    for at in ends:
        assert compute_smallest_value(at, answer.observation_model) < RANK_CUTOFF_FRACTION
        assert abs(answer.condition.evaluate(answer.pattern.values_at([at]))[0]) < 1e-6


@pytest.mark.slow
def test_the_rank_is_not_led_into_another_operation_mode() -> None:
    """Steps that closed the loops anew led this platform from translations to turns, in which it loses one."""
    answer = singularities(build_mechanism(parse("3(Ra!-Rb*-Rb-Ra-Ra)"), 0), real=True, points=60)
    assert answer.condition.never
    assert answer.checked.disagreements == 0


def test_the_right_condition_passes_again() -> None:
    answer = found("3rrr_m1")
    assert again(answer, answer.pattern, answer.condition).disagreements == 0


def test_a_robot_without_motors_has_no_real_condition() -> None:
    robot = load("3rrr_m1")
    still = replace(robot, joints={name: replace(joint, motor=None) for name, joint in robot.joints.items()})
    with pytest.raises(BadRequest, match=r"3rrr_m1: no motor\. Name one or more with --motors"):
        singularities(still, real=True, points=1)
