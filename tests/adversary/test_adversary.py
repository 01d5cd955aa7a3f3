"""The standing adversary finds what is planted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from adversary.case import HELD, WRONG, Case
from adversary.claims import lists, verdicts
from adversary.run import ALL, made

ROBOTS = Path(__file__).resolve().parents[2] / "robots"


def shipped(name: str) -> Case:
    """A shipped robot under attack."""
    return Case(name, 0, ROBOTS / f"{name}.urdf", np.random.default_rng(0))


def outcomes(case: Case, claim: str) -> set[str]:
    """What was said of a claim."""
    return {said.outcome for said in case.found if said.claim == claim}


@pytest.mark.parametrize("kind", ALL)
def test_every_kind_makes_a_robot_whose_loops_close(kind, tmp_path):
    for seed in range(2):
        case = made(kind, seed, tmp_path)
        assert case.study.closed(case.robot.zero())[0] < 1e-12, (kind, seed)


def test_jacobians_are_those_of_differences(tmp_path):
    for kind in ("pods", "deltas", "translational", "spatial words"):
        robot = made(kind, 1, tmp_path).robot
        rng = np.random.default_rng(0)
        at = robot.moved(robot.zero(3), 0.3 * rng.normal(size=(3, robot.size)))
        d, h = rng.normal(size=(3, robot.size)), 1e-6
        J = robot.rows(robot.loops, robot.frames(at))[1]
        ahead, back = (robot.rows(robot.loops, robot.frames(robot.moved(at, s * h * d)))[0] for s in (1, -1))
        assert np.allclose((ahead - back) / (2 * h), np.einsum("nri,ni->nr", J, d), atol=1e-8), kind


@pytest.mark.parametrize(("name", "real"), [("3rrr_m1", False), ("3rrr_m1", True), ("rrrrr_m1", True)])
def test_a_mode_dropped_from_a_list_is_found(name, real):
    case = shipped(name)
    told = hrsynth.modes(case.engine, real=real)
    lists.judge(case, told, None, real)
    claim = f"{told.kind} modes"
    assert outcomes(case, claim) == {HELD}
    case.found.clear()
    lists.judge(case, replace(told, modes=told.modes[:-1]), None, real)
    assert outcomes(case, claim) == {WRONG}


def test_a_false_word_about_assembly_is_found():
    case = shipped("3rrr_m1")
    told = hrsynth.modes(case.engine)
    off = replace(told.modes[1].pose, x=told.modes[1].pose.x + 0.01)
    lists.judge(case, replace(told, modes=(told.modes[0], replace(told.modes[1], pose=off))), None, False)
    assert WRONG in outcomes(case, "assembled")
    never = replace(told.modes[1], reachable=False, configuration=None, **(
        {"assembly": "no"} if hasattr(told.modes[1], "assembly") else {}))
    lists.judge(case, replace(told, modes=(told.modes[0], never)), None, False)
    assert outcomes(case, "cannot be assembled") == {WRONG}


def test_a_pose_that_was_not_asked_for_is_found():
    case = shipped("3rrr_m1")
    told = hrsynth.modes(case.engine, at="x=0.02,y=0.01,z=0,rpy=0/0/0.1")
    for asked, outcome in (("x=0.02,y=0.01,z=0,rpy=0/0/0.1", HELD), ("x=0.02,y=0.01,z=0,rpy=0/0/0", WRONG)):
        case.found.clear()
        lists.asked_of(case, "asked pose", asked, told.pose)
        assert outcomes(case, "asked pose") == {outcome}


def test_a_false_verdict_is_found():
    case = shipped("quattro")
    told, seen = hrsynth.legs(case.engine), hrsynth.check(case.engine)
    segments = {each.leg: each for each in seen.setting.segments}
    verdicts.judge(case, told, segments)
    assert outcomes(case, "verdict") == {HELD}
    case.found.clear()
    flipped = tuple(replace(each, rank=each.rank + 1) for each in told.sets[:1])
    verdicts.judge(case, replace(told, sets=flipped), segments)
    assert outcomes(case, "verdict") == {WRONG}


def test_a_cure_that_does_not_cure_is_found():
    case = shipped("prrrp_parallel")
    told = hrsynth.advise(case.engine)
    verdicts.judge_cures(case, told, told.sets)
    assert outcomes(case, "cure") == {HELD}
    case.found.clear()
    none = replace(told.sets[0], measurements=())
    verdicts.judge_cures(case, told, [none])
    assert outcomes(case, "cure") == {WRONG}

