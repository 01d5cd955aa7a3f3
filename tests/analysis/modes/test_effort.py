"""What is too large says so with its size, by an estimate that does not depend on the machine."""

from __future__ import annotations

import pytest

import hrsynth
from analysis.modes.pods import pods
from hrsynth.analysis.modes.tip_systems import solve_all
from hrsynth.description import list_robots, load
from hrsynth.errors import TooLarge


def test_fewer_branches_are_solved_with_less_effort_and_that_is_told():
    robot, _ = pods(["RRPS", "RRPS", "RRPS"], 1)
    whole, few = (hrsynth.modes(robot, time_limit=time_limit) for time_limit in (10.0, 0.05))
    assert whole.found.complete
    assert not few.found.complete
    assert few.found.bound == "none"
    assert "only 2 of 8 combinations" in few.found.proof
    assert "the time limit is 0.05 s" in few.found.proof
    assert len(few.modes) <= len(whole.modes)
    assert few.modes[0].goal


def test_a_system_that_needs_more_is_not_started():
    robot = load(list_robots()["hexa"])
    confined = hrsynth.modes(robot, real=True).confined
    assert confined is not None
    with pytest.raises(
        TooLarge, match=r"6 legs and 6 dof, needs about 0\.4 s, more than the time limit of 0\.1 s\. Raise --time-limit"
    ):
        solve_all(confined, time_limit=0.1)


def test_effort_may_be_without_end():
    assert hrsynth.modes("rrrrr_m1", time_limit=float("inf")).found.complete
