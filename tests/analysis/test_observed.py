"""What was asked is a value: a question asked of an observed robot answers as one that is asked with its parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.advice import advise
from hrsynth.analysis.check import check
from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import derive
from hrsynth.analysis.modes.modes import modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.description import load
from hrsynth.errors import BadRequest, NoSegment
from strategies import spherical

QUESTIONS: dict[str, Callable[..., Any]] = {
    "derive": derive,
    "check": check,
    "advise": advise,
    "modes": modes,
    "singularities": lambda *asked, **more: singularities(*asked, points=20, **more),
}


@pytest.mark.some(2)
@pytest.mark.parametrize("name", QUESTIONS)
def test_an_observed_robot_is_asked_as_its_parts_are(name: str) -> None:
    observation_model, robot = QUESTIONS[name], load("3rrr_m1")
    observed = hrsynth.observe(robot, "1,2", "platform", seed=3)
    assert observation_model(observed).to_dict() == observation_model(robot, "1,2", "platform", seed=3).to_dict()


def test_a_pose_takes_the_place_of_the_zero_configuration() -> None:
    robot, pose = load("3rrr_m1"), "x=0.02,y=0.03"
    observed = hrsynth.observe(robot, at=pose)
    assert legs(observed).to_dict() == legs(robot, at=pose).to_dict()
    assert derive(observed).to_dict() == derive(robot, at=pose).to_dict()


def test_one_observed_robot_is_sampled_once() -> None:
    told: list[str] = []
    observed = hrsynth.observe(load("delta"))
    with hrsynth.on_progress(told.append):
        derive(observed)
        modes(observed, at=observed.all_samples.start)
    assert "sampling" not in told
    assert {"certificate", "modes"} <= set(told)


@pytest.mark.parametrize("more", [{"observe": "1"}, {"camera": "platform"}, {"at": "mode:1"}])
def test_what_is_watched_is_asked_once(more: dict[str, str]) -> None:
    observed = hrsynth.observe(load("delta"), "1,2")
    assert ObservedRobot.of(observed) is observed
    with pytest.raises(BadRequest, match="given twice"):
        derive(observed, **more)


def test_a_question_about_motors_needs_no_segments() -> None:
    """The links of a spherical robot have no length."""
    watched = spherical(np.random.default_rng(0))
    robot = replace(watched, observations=())
    with pytest.raises(NoSegment):
        modes(robot)
    found, other = (modes(each, real=True) for each in (robot, watched))
    assert len(found.modes) == len(other.modes) > 1
    for one, two in zip(found.modes, other.modes, strict=True):
        assert one.pose.rpy == pytest.approx(two.pose.rpy, abs=1e-9)
    assert singularities(robot, real=True, points=20).verdict.rank == 3
