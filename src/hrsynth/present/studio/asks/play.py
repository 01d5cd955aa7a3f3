"""Motion along an unobserved twist: the platform moves back and forth while the observed directions stay."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....analysis.configuration_report import ConfigurationAnalysis
from ....errors import BadRequest
from ....kinematics.self_motions import follow_motion
from ....kinematics.tasks import FixedValuesTask, stack_task
from ....kinematics.velocity_relation import ObservationModel
from ...view.states import RealAndHiddenState
from ..request import STUDIO_LIST_NAMES_MAX, Request
from .move import describe_state

PLAY_CONFIGURATIONS_COUNT = 12
"""Configurations in each direction."""


def answer(request: Request) -> dict[str, Any]:
    """Return the motion along the unobserved twist number ``lost`` at ``here``, as ``watch`` lists them; only ``here``
    if the directions stay constant to first order only."""
    number = request.count("lost", 0, STUDIO_LIST_NAMES_MAX)
    setup, mover = request.seeing(), request.mover(request.has_flag("hidden"))
    here = request.here(mover)
    lost = ConfigurationAnalysis.of(setup).examine(here.real).hidden.unobserved
    if number is None or number >= len(lost):
        raise BadRequest("lost: no such unobserved twist", number, f"0 to {len(lost) - 1}" if lost else "none")
    question = setup.samples.observation_model
    ways = [
        mover.follow_hidden(here, way)
        for way in follow_motion(
            here.real, question, lost[number].twist[: question.twist_rows], PLAY_CONFIGURATIONS_COUNT
        )
    ]
    frames = {
        id(each): {**describe_state(request, mover, each), "here": request.describe_here(each)}
        for each in (here, *ways[0], *ways[1])
    }
    cycle = [here, *_mirror_path(ways[0]), here, *_mirror_path(ways[1])]
    return {
        "frames": [frames[id(each)] for each in cycle],
        "words": _describe_play(lost[number].name, question, here, [*ways[0], *ways[1]]),
    }


def _mirror_path(way: list[RealAndHiddenState]) -> list[RealAndHiddenState]:
    return [*way, *reversed(way[:-1])]


def _describe_play(
    name: str, question: ObservationModel, here: RealAndHiddenState, way: list[RealAndHiddenState]
) -> str:
    """Describe the motion, and how constant the directions are."""
    if not way:
        return f"{name}: no finite motion found; the observed directions are constant to first order only"
    held = FixedValuesTask.at(here.real.model, here.real.q, question.reference, question.observations)
    worst = max(float(np.linalg.norm(stack_task(each.real.model, each.real.q, held)[0])) for each in way)
    return f"{name}: the observed directions stay constant; residual of loops and directions {worst:.0e}"
