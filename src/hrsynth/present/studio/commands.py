"""Command line and line of Python that compute what a panel shows."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np

from ...analysis.observed import ObservedRobot
from ...batch.pose_continuation import track_to_pose
from ...errors import HrsynthError
from ...index import list_analysis_options
from ...kinematics.configuration import ClosedConfiguration
from ...tolerances import PRINTED_POSE_TOL
from .request import Request

NONE = {"command": "", "python": ""}
"""Lines of an answer that no command gives."""


def format_commands(request: Request, name: str, *more: str, watching: bool = True, **given: Any) -> dict[str, str]:
    """Return the fields ``command`` and ``python`` of an answer: the command ``name`` with the options ``given``, and
    ``more`` words of the command line; ``watching``: with the observed legs."""
    words = ["hrsynth", name, request.source.robot]
    python = []
    if watching and request.watched:
        words += ["--observe", ",".join(request.watched)]
        python.append(repr(list(request.watched)))
    if request.camera is not None:
        words += ["--camera", request.camera]
        python.append(f"camera={request.camera!r}")
    robot = repr(request.source.robot)
    said = dict(request.source.options)
    for option, value in said.items():
        flag = f"--{option.replace('_', '-')}"
        if value is True:
            words.append(flag)
        elif option == "close":
            words += [word for each in value for word in (flag, each)]
        else:
            words += [flag, ",".join(value) if isinstance(value, tuple) else str(value)]
    if said:
        values = ", ".join(
            f"{option}={list(value) if isinstance(value, tuple) else value!r}" for option, value in said.items()
        )
        robot = f"hrsynth.load({robot}, {values})"
    declared = {each.name: each for each in list_analysis_options(name)} if given else {}
    words += [word for each, value in given.items() for word in declared[each].typed(value)]
    python += [f"{each}={value!r}" for each, value in given.items()]
    return {"command": shlex.join([*words, *more]), "python": f"hrsynth.{name}({', '.join([robot, *python])})"}


def format_pose(setup: ObservedRobot, at: ClosedConfiguration) -> str:
    """Format the platform's pose as an option, to nine digits."""
    given = setup.motion.pose(at.pose(setup.motion.link)).given
    return ",".join(f"{name}={'/'.join(map(format_digits, values))}" for name, values in given.items())


def is_reproduced_by_pose(setup: ObservedRobot, *at: ClosedConfiguration) -> bool:
    """Return True if a command with the poses of these configurations reaches them, not another mode."""
    drawn, motion = setup.all_samples, setup.motion
    for each in at:
        if np.array_equal(each.q, drawn.start.q):
            continue
        try:
            there = track_to_pose(drawn.start, drawn.observation_model, motion.pose(each.pose(motion.link)), motion)
        except HrsynthError:
            return False
        if (
            np.linalg.norm(drawn.observation_model.target(there).error_and_jacobian(each.model, each.q)[0])
            > PRINTED_POSE_TOL
        ):
            return False
    return True


def format_commands_at(request: Request, name: str, setup: ObservedRobot, here: ClosedConfiguration) -> dict[str, str]:
    """Return the lines of an analysis at a configuration, none if no command reaches it."""
    pose = format_pose(setup, here)
    return format_commands(request, name, at=pose) if is_reproduced_by_pose(setup, here) else NONE


def format_digits(value: float) -> str:
    """Format a number as it is typed: to a tenth of a nanometre, nine digits."""
    return f"{round(float(value), 10) + 0.0:.9g}"
