"""One law over all rules and all robots: no accepted step changes the relation, and the oracle is the judge.

The oracle leads every rewritten mechanism along the poses and observed directions of the real robot, and compares the
two relations there; the engine that accepted the step has no say in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.kinematics.equivalence import EquivalenceCheck, check_equivalence
from hrsynth.mechanism.model import Mechanism
from hrsynth.rewrite.evidence import Evidence
from hrsynth.rewrite.rule import Rule
from hrsynth.rewrite.rules import list_rules
from hrsynth.rewrite.strategy import FORMS, RewriteTrace
from hrsynth.tolerances import RELATION_ANGLE_TOL
from kinematics.robots import ROBOTS, led, seen_by_oracle, setting_of, state_of
from oracle import Oracle, same_relation
from strategies import deltas, planar, pods

SUBSETS = {
    "delta": (("1",), ("1", "2"), ("2", "3"), ("arm_1", "rod_2a")),
    "quattro": (("1", "4"), ("1", "2"), ("3",), ("1", "2", "3")),
    "quattro_rigid": (("1", "3"), ("1", "2"), ("2",)),
    "orthoglide": (("1",), ("1", "3")),
    "linear_delta": (("2", "3"),),
    "uranesx": (("1", "2"),),
    "i4l": (("1", "2"), ("1", "3")),
    "3ruu": (("1", "2"),),
    "3puu": (("1",),),
    "3upu": (("1", "2"), ("3",)),
    "3rps": (("1", "2"),),
    "3rrr_m1": (("1", "2"), ("3",)),
    "gough_stewart": (("1", "2", "3"), ("2", "5")),
    "rrrrr_m1": (("1",),),
    "prrrp_parallel_point": (("1",),),
}
CASES = [*((robot, None) for robot in ROBOTS), *((robot, legs) for robot, sets in SUBSETS.items() for legs in sets)]
CAMERAS = [
    ("delta", "platform"),
    ("delta", "arm_1"),
    ("gough_stewart", "platform"),
    ("3rrr_m1", "platform"),
    ("3upu", "platform"),
    ("quattro", "platform"),
]


USERS = (("delta", None), ("gough_stewart", None), ("3rrr_m1", None), ("quattro", ("1", "4")))
"""Robots of which each rule is accepted by one at least."""


@dataclass
class Recorder:
    """A check that keeps every proposal which the certificate passes."""

    setting: ObservedRobot
    passed: list[Mechanism] = field(default_factory=list)
    refused: list[tuple[Mechanism, EquivalenceCheck]] = field(default_factory=list)

    def __call__(self, mechanism: Mechanism, bodies: tuple[str, ...]) -> EquivalenceCheck:
        found = check_equivalence(self.setting.samples, mechanism, count=3, bodies=bodies, complete=False)
        if found.passed:
            self.passed.append(mechanism)
        else:
            self.refused.append((mechanism, found))
        return found


def rewritten(setup: ObservedRobot, form: str = "simplified") -> tuple[RewriteTrace, Recorder]:
    recorder = Recorder(setup)
    evidence = Evidence(setup.decomposition, setup.samples)
    return FORMS[form](RewriteTrace.of(evidence, recorder)), recorder


def obeys(setup: ObservedRobot, form: str = "simplified", thorough: bool = False) -> RewriteTrace:
    """The law, for one robot: every step that passed, or (not ``thorough``) at most six of them, last ones included."""
    result, recorder = rewritten(setup, form)
    samples = setup.samples
    observation_model, length = samples.observation_model, samples.model.length
    real = Oracle(setup.mechanism)
    found = recorder.passed
    if not thorough and len(found) > 6:
        found = [found[int(k)] for k in np.unique(np.linspace(0, len(found) - 1, 6).round())]
    for member in samples.members[: 3 if thorough else 1]:
        state = state_of(samples.model, member.configuration.q)
        assert real.error(state) < 1e-9
        ours = seen_by_oracle(real, state, observation_model, length)
        for mechanism in found:
            oracle, reached = led(mechanism, observation_model, member.way)
            assert same_relation(ours, seen_by_oracle(oracle, reached, observation_model, length)) < RELATION_ANGLE_TOL
    accepted = [step for step in result.steps if step.accepted]
    assert accepted[0].rule == "motors off"
    assert all(step.reason for step in result.steps)
    assert all(step.largest_angle is None or step.largest_angle < RELATION_ANGLE_TOL for step in accepted)
    assert all(
        "refused, " in step.reason
        for step in result.steps
        if not step.accepted and step.largest_angle is not None and "discarded" not in step.reason
    )
    assert len(recorder.passed) >= sum(step.largest_angle is not None for step in accepted)
    return result


def name(case: object) -> str:
    return "all" if case is None else "-".join(case) if isinstance(case, tuple) else str(case)


@cache
def accepted() -> frozenset[str]:
    return frozenset(
        step.rule
        for robot, legs in USERS
        for step in rewritten(setting_of(robot, legs, None, 3))[0].steps
        if step.accepted
    )


@pytest.mark.some(5)
@pytest.mark.parametrize("rule", list_rules(), ids=lambda rule: rule.name)
def test_every_rule_has_a_robot(rule: Rule[Any, Any]) -> None:
    """Whatever file lies among the rules is found, has a stage of its own choice, and is accepted somewhere."""
    assert rule in list_rules(rule.stage)
    assert rule.source
    assert rule.name in accepted()


@pytest.mark.some(3, 16)
@pytest.mark.parametrize(("robot", "legs"), CASES, ids=name)
def test_no_accepted_step_changes_the_relation(robot: str, legs: tuple[str, ...] | None) -> None:
    assert obeys(setting_of(robot, legs, None, 3)).steps


@pytest.mark.some(2)
@pytest.mark.parametrize(("robot", "camera"), CAMERAS)
def test_no_accepted_step_changes_the_relation_seen_from_a_moving_link(robot: str, camera: str) -> None:
    assert obeys(setting_of(robot, None, camera, 3)).steps


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "legs"),
    [
        ("delta", None),
        ("quattro", ("1", "4")),
        ("3rrr_m1", None),
        ("gough_stewart", ("1", "2", "3")),
        ("3upu", ("1",)),
        ("prrrp_m1", None),
        ("hexa", ("1",)),
    ],
    ids=name,
)
def test_the_general_form_keeps_all_legs(robot: str, legs: tuple[str, ...] | None) -> None:
    setup = setting_of(robot, legs, None, 3)
    result = obeys(setup, "general")
    state = result.state
    assert state.removed == ()
    assert tuple(leg.label for leg in state.decomposition().legs) == setup.decomposition.labels
    assert setup.mechanism.links.keys() <= state.mechanism.links.keys()
    assert not any(step.rule in ("pi form", "leg removal", "end change") for step in result.steps)
    if robot in ("delta", "quattro", "3rrr_m1", "hexa"):
        assert "{R-PP}" in state.architecture().ascii


@pytest.mark.some(0, 4)
@pytest.mark.parametrize(("robot", "legs"), CASES, ids=name)
def test_no_accepted_step_changes_the_relation_anywhere(robot: str, legs: tuple[str, ...] | None) -> None:
    assert obeys(setting_of(robot, legs, None, 3), thorough=True).steps


@pytest.mark.some(0, 4)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["planar", "pods", "aligned", "random"])
def test_the_law_on_random_robots(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 17])
    if kind == "planar":
        robot = planar([str(w) for w in rng.choice(["RRR", "RPR", "PRR", "RRP"], 3)], rng, [{0}, {0}, {0}])
    elif kind == "pods":
        robot = pods(["UPS", "RPS", "UPS", "UPS", "UPS"][: int(rng.integers(3, 6))], rng)
    else:
        robot = deltas(["R", "R", "P"], [str(w) for w in rng.choice(["2-SS", "US"], 3)], rng, kind == "aligned")
    labels = tuple(o.leg for o in robot.observations)
    for legs in (None, labels[: int(rng.integers(1, len(labels)))]):
        assert obeys(ObservedRobot.of(robot, legs, samples=3)).steps
