"""Verdict on the observed legs: unobserved twists, the hidden robot, its singularities, the smallest sets."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from ....analysis.accuracy.measurement_bounds import MeasurementBounds
from ....analysis.accuracy.pose_errors import compute_error_axes
from ....analysis.configuration_report import ConfigurationAnalysis
from ....analysis.freedoms import Freedom
from ....analysis.measured import MeasuredRobot
from ....analysis.observed import ObservedRobot
from ....analysis.verdict import CONTROLLABLE, Verdict, compute_verdict
from ....constraints.condition import describe_permanent_loss
from ....errors import HrsynthError, UndecidedRank
from ....kinematics.configuration import ClosedConfiguration
from ....mechanism.observation import list_labels
from ....mechanism.observations.direction import Direction
from ....tolerances import CACHED_OBSERVED_ROBOTS_COUNT, NAMED_TWIST_TOL
from ...text.poses import STATES
from ...text.robots import describe_exact, describe_zero, format_certificate
from ...view.scale import CONE, choose_error_unit, describe_no_error, describe_pose_error
from ...view.states import HIDDEN
from ...view.view import build_machine
from ..commands import format_commands
from ..request import Request

STUDIO_SMALLEST_SETS_MAX = 10
"""Largest number of smallest sets that are listed."""


def answer(request: Request) -> dict[str, Any]:
    """Return the verdict on the observed legs, at ``here``."""
    setup = request.setup
    best = [each for each in find_smallest_sets(observe_all_legs(setup)) if each.rank]
    sets = {
        "sets": [{"legs": list(each.legs), "words": describe_set(each)} for each in best[:STUDIO_SMALLEST_SETS_MAX]],
        "more_sets": max(0, len(best) - STUDIO_SMALLEST_SETS_MAX),
    }
    if request.has_no_observation:
        return {
            "verdict": {"controllable": False, "words": "no leg is observed", "certainty": ""},
            "rank": 0,
            "dof": setup.dof,
            "lost": [],
            "hidden": None,
            "hidden_words": "",
            "condition": "",
            **sets,
            "ellipsoid": None,
            "error": describe_no_error(choose_error_unit(setup), "no leg is observed"),
            **format_commands(request, "legs"),
        }
    derivation, mover = request.derivation, request.mover()
    verdict, here = derivation.verdict, request.here(mover)
    posture = ConfigurationAnalysis.of(setup).examine(here.real)
    point = setup.motion.position(here.real.pose(setup.motion.link))
    return {
        "verdict": {
            "controllable": verdict == CONTROLLABLE,
            "words": verdict.verdict,
            "certainty": describe_exact(derivation.exact, verdict.rank),
        },
        "rank": posture.hidden.rank,
        "dof": verdict.dof,
        "here": STATES[posture.hidden.state],
        "lost": [describe_lost(each, point.tolist()) for each in posture.hidden.unobserved],
        "hidden": build_hidden_machine(request),
        "hidden_words": describe_hidden_robot(request),
        "condition": describe_condition(setup),
        **sets,
        "ellipsoid": compute_ellipsoid(setup, here.real),
        "error": describe_pose_error(setup, here.real),
        **format_commands(request, "derive"),
    }


def describe_set(verdict: Verdict) -> str:
    """Describe the verdict on a set of legs, and a lower rank at the zero configuration."""
    return "; ".join([verdict.verdict, *describe_zero(verdict)])


def describe_lost(freedom: Freedom, point: list[float]) -> dict[str, Any]:
    """Return an unobserved twist; its ``kind`` is translation or rotation (also of a screw)."""
    turns = bool(np.linalg.norm(freedom.twist[3:]) > NAMED_TWIST_TOL)
    return {
        "words": freedom.name,
        "twist": freedom.to_dict()["twist"],
        "point": point,
        "kind": "rotation" if turns else "translation",
    }


def build_hidden_machine(request: Request) -> dict[str, Any] | None:
    """Return the hidden robot as a machine to be drawn, None if every observed direction is constant."""
    found = request.derivation
    if found.hidden is None:
        return None
    mover = request.mover(hidden=True)
    posed = [mover.home, *(mover.with_hidden(end.real) for pair in request.ends for end in pair)]
    places = [mover.places(each)[HIDDEN] for each in posed if each.hidden is not None]
    return build_machine(HIDDEN, request.setup, found.hidden, str(found.hidden_architecture), places, ()).scene()


def describe_hidden_robot(request: Request) -> str:
    """Describe the legs of the hidden robot, and the equivalence check."""
    found = request.derivation
    legs = found.hidden_architecture
    return (
        f"{legs}; equivalence check {format_certificate(found.equivalence)}"
        if legs
        else "none: every observed direction is constant"
    )


def describe_condition(setup: ObservedRobot) -> str:
    """Describe the Type 2 condition."""
    robot = MeasuredRobot.of(setup)
    try:
        if robot.verdict.unobserved:
            return describe_permanent_loss(robot.pattern, robot.verdict.never)
        return robot.condition.words
    except HrsynthError as problem:
        return str(problem)


def observe_all_legs(setup: ObservedRobot) -> ObservedRobot:
    """Return the robot with all legs observed."""
    return ObservedRobot.of(setup.robot, "all")


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def find_smallest_sets(setup: ObservedRobot) -> tuple[Verdict, ...]:
    """Return the verdicts on the smallest sets of observed legs with the rank of all legs, as in ``hrsynth legs``."""
    labels = list_labels(setup.observed)
    best = compute_verdict(setup, labels, setup.samples).rank
    for size in range(1, len(labels) + 1):
        found = []
        for chosen in combinations(labels, size):
            samples = setup.all_samples.restrict([each for each in setup.observed if each.leg in chosen], ways=False)
            if max(member.relation.rank for member in samples.members) == best:
                with suppress(UndecidedRank):
                    found.append(compute_verdict(setup, chosen, samples))
        if found:
            return tuple(found)
    return ()


def compute_ellipsoid(setup: ObservedRobot, at: ClosedConfiguration) -> dict[str, Any] | None:
    """Return the ellipsoid of position errors for 0.1° of each direction (:func:`.compute_error_axes`); None if they
    are unbounded or zero."""
    if not all(isinstance(each, Direction) for each in setup.observed):
        return None
    axes = compute_error_axes(
        at, setup.samples.observation_model, MeasurementBounds(np.full(len(setup.observed), CONE))
    )
    if axes is None or not axes.any():
        return None
    return {"center": setup.motion.position(at.pose(setup.motion.link)).tolist(), "axes": axes.tolist()}
