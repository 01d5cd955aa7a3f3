"""A lost freedom as a motion: the platform goes forth and back while the watched directions stay."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....analysis.modes.motions import follow_motion
from ....analysis.posture import ConfigurationAnalysis
from ....budgets import LARGEST_STUDIO_LIST
from ....errors import BadRequest
from ....kinematics.relation import Measurement
from ....kinematics.tasks import Held, system
from ...view.states import Posed
from ..request import Request
from .move import state

STEPS = 12
"""Configurations each way."""


def answer(request: Request) -> dict[str, Any]:
    """The motion of the lost freedom number ``lost`` at ``here``, as ``watch`` lists them; no more than where it is
    where the directions stay to first order only."""
    number = request.count("lost", 0, LARGEST_STUDIO_LIST)
    setting, mover = request.seeing(), request.mover(request.flag("hidden"))
    here = request.here(mover)
    lost = ConfigurationAnalysis.of(setting).examine(here.real).hidden.lost
    if number is None or number >= len(lost):
        raise BadRequest("number of a lost freedom", number, f"0 to {len(lost) - 1}" if lost else "none is lost here")
    question = setting.samples.question
    ways = [
        mover.follow_hidden(here, way)
        for way in follow_motion(here.real, question, lost[number].twist[: question.twist_rows], STEPS)
    ]
    frames = {
        id(each): {**state(request, mover, each), "here": request.describe_here(each)}
        for each in (here, *ways[0], *ways[1])
    }
    cycle = [here, *_there_and_back(ways[0]), here, *_there_and_back(ways[1])]
    return {
        "frames": [frames[id(each)] for each in cycle],
        "words": _words(lost[number].name, question, here, [*ways[0], *ways[1]]),
    }


def _there_and_back(way: list[Posed]) -> list[Posed]:
    return [*way, *reversed(way[:-1])]


def _words(name: str, question: Measurement, here: Posed, way: list[Posed]) -> str:
    """What is played, and how well the directions stay."""
    if not way:
        return f"{name}: no motion along it was found, the watched directions stay to first order only"
    held = Held.at(here.real.twin, here.real.q, question.reference, question.observations)
    worst = max(float(np.linalg.norm(system(each.real.twin, each.real.q, held)[0])) for each in way)
    return f"{name}: the watched directions stay, loops and directions to {worst:.0e}"
