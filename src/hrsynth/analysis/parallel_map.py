"""One analysis over many robots, legs and poses, in several processes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import closing
from functools import partial
from inspect import signature
from itertools import product
from math import ceil
from typing import Any

from ..errors import BadRequest, HrsynthError
from ..mechanism.pose import AskedPose, PoseLike, parse_poses
from ..processes import run_shared
from ..progress import report
from ..results import Result, shorten_value
from .observation_inputs import LegsLike, normalise_names
from .observed import RobotLike, read_robot

PARTS_PER_PROCESS_MIN = 2
"""Minimum number of work items per process, if there are so many."""
RAISE, KEEP = "raise", "keep"
"""Handling of an analysis that fails: raise its error, or keep it in place of the result."""

Given = dict[str, Any]
"""Arguments of one analysis."""


def map_robots(
    analysis: str | Callable[..., Any],
    robots: RobotLike | Iterable[RobotLike],
    *,
    poses: PoseLike | Iterable[PoseLike] | None = None,
    legs: Iterable[LegsLike] | None = None,
    jobs: int | None = None,
    errors: str = RAISE,
    **options: Any,
) -> list[Any]:
    """Results of one analysis for each of the robots, each set of legs and each pose, computed in parallel.

    Parameters
    ----------
    analysis
        Public function or its name, or your own function with the same parameters. It receives a pose as ``at``, or as
        ``goal`` without ``at``, and a set of legs as ``observe``.
    robots
        Robots, as for the function.
    poses, legs
        Poses and sets of legs; default: none is passed.
    jobs
        Number of processes; default: one per core. With 1 all is computed in this process.
    errors
        ``raise``, or ``keep``: an ``HrsynthError`` then takes the place of the result.
    options
        Further options, the same for all.

    Returns
    -------
    list
        Results, ordered by robot, then legs, then pose (fastest).

    Raises
    ------
    BadRequest
        For invalid arguments; and what the analysis raises.

    Notes
    -----
    The samples of a robot are computed once in each process. Errors contain the request.

    Examples
    --------
    >>> hrsynth.map_robots("check", ["3rrr_m1"], poses=["x=0,phi=0", "x=0.01,phi=0"], legs=["1,2", "all"], jobs=1)[0]
    <Check: 3rrr_m1, observing 1, 2: x=0,y=-0.015,z=0,phi=0deg regular, observes 2 of 3 dof>
    """
    function: Callable[..., Any] = _find_function(analysis)
    if errors not in (RAISE, KEEP):
        raise BadRequest("errors", errors, (RAISE, KEEP))
    if jobs is not None and (isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1):
        raise BadRequest("--jobs", jobs, "1 or more")
    several: Any = [robots] if isinstance(robots, str | os.PathLike) or not isinstance(robots, Iterable) else robots
    every = [_read(each, errors) for each in several]
    sets = [legs] if isinstance(legs, str) else legs
    watched: list[Given] = [{}] if sets is None else [{"observe": normalise_names(each)} for each in sets]
    asked: list[Given] = [{}] if poses is None else [{_place(function): each} for each in parse_poses(poses)]
    groups = [{"robot": robot, **seen, **options} for robot, seen in product(every, watched)]
    workers = jobs or os.cpu_count() or 1
    size = max(1, ceil(len(asked) / ceil(PARTS_PER_PROCESS_MIN * workers / max(1, len(groups)))))
    parts = [[{**group, **at} for at in asked[k : k + size]] for group in groups for k in range(0, len(asked), size)]
    answers: list[Any] = []
    with closing(
        run_shared([partial(_answer_part, function, errors, part) for part in parts], min(workers, len(parts)))
    ) as done:
        for found in done:
            answers += found
            report("questions", len(answers), len(groups) * len(asked))
            if errors == RAISE and isinstance(answers[-1], HrsynthError):
                raise answers[-1]
    return answers


def _read(given: RobotLike, errors: str) -> RobotLike:
    """Read the robot once; if errors are kept, return one that cannot be read as it was given."""
    try:
        return read_robot(given)
    except HrsynthError:
        if errors == RAISE:
            raise
        return given


def _find_function(analysis: str | Callable[..., Any]) -> Callable[..., Any]:
    if callable(analysis):
        return analysis
    try:
        found = Result.public(analysis)
    except (AttributeError, TypeError):
        found = None
    if not (callable(found) and "robot" in signature(found).parameters):
        raise BadRequest("analysis", analysis, "a function of hrsynth that takes a robot, or its name, such as check")
    return found


def _answer_part(function: Callable[..., Any], errors: str, part: list[Given]) -> list[Any]:
    """Results of a part, up to its first error if that ends all; the request is added to the error."""
    found: list[Any] = []
    for given in part:
        try:
            found.append(function(**{**given, "robot": read_robot(given["robot"])}))
        except Exception as error:
            error.add_note("request: " + ", ".join(f"{name} {_describe(value)}" for name, value in given.items()))
            if not isinstance(error, HrsynthError):
                raise
            found.append(error)
            if errors == RAISE:
                break
    return found


def _describe(value: Any) -> str:
    return str(value) if isinstance(value, AskedPose | tuple) else shorten_value(value)


def _place(function: Callable[..., Any]) -> str:
    """The parameter that takes a pose."""
    known = signature(function).parameters
    for name in ("at", "goal"):
        if name in known:
            return name
    raise BadRequest(f"{function.__name__} has no parameter for a pose", remedy="Use an analysis with at or goal.")
