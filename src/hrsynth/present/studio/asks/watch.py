"""Verdict on the observed legs: unobserved twists, the hidden robot, its singularities, the smallest sets."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from ....analysis.accuracy.measurement_bounds import MeasurementBounds
from ....analysis.accuracy.pose_errors import error_axes
from ....analysis.configuration_report import ConfigurationAnalysis
from ....analysis.freedoms import Freedom
from ....analysis.measured import MeasuredRobot
from ....analysis.observed import ObservedRobot, restrict_samples
from ....analysis.verdict import CONTROLLABLE, Verdict, verdict_of
from ....budgets import REMEMBERED
from ....constraints.condition import always
from ....errors import HrsynthError, RankUndecided
from ....kinematics.configuration import ClosedConfiguration
from ....mechanism.observation import labels_of
from ....mechanism.observations.direction import Direction
from ....tolerances import NAMED
from ...text.poses import STATES
from ...text.robots import at_zero, certificate, exact_words
from ...view.scale import CONE, error, nothing, unit_of
from ...view.states import HIDDEN
from ...view.view import machine_of
from ..commands import lines
from ..request import Request

MOST_SETS = 10
"""Largest number of smallest sets that are listed."""


def answer(request: Request) -> dict[str, Any]:
    """Return the verdict on the observed legs, at ``here``."""
    setup = request.setup
    best = [each for each in smallest(all_legs(setup)) if each.rank]
    sets = {
        "sets": [{"legs": list(each.legs), "words": words(each)} for each in best[:MOST_SETS]],
        "more_sets": max(0, len(best) - MOST_SETS),
    }
    if request.blind:
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
            "error": nothing(unit_of(setup), "no leg is observed"),
            **lines(request, "legs"),
        }
    derivation, mover = request.derivation, request.mover()
    verdict, here = derivation.verdict, request.here(mover)
    posture = ConfigurationAnalysis.of(setup).examine(here.real)
    point = setup.motion.position(here.real.pose(setup.motion.link))
    return {
        "verdict": {
            "controllable": verdict == CONTROLLABLE,
            "words": verdict.verdict,
            "certainty": exact_words(derivation.exact, verdict.rank),
        },
        "rank": posture.hidden.rank,
        "dof": verdict.dof,
        "here": STATES[posture.hidden.state],
        "lost": [describe_lost(each, point.tolist()) for each in posture.hidden.unobserved],
        "hidden": hidden_machine(request),
        "hidden_words": hidden_words(request),
        "condition": condition(setup),
        **sets,
        "ellipsoid": ellipsoid(setup, here.real),
        "error": error(setup, here.real),
        **lines(request, "derive"),
    }


def words(verdict: Verdict) -> str:
    """Describe the verdict on a set of legs, and a lower rank at the zero configuration."""
    return "; ".join([verdict.verdict, *at_zero(verdict)])


def describe_lost(freedom: Freedom, point: list[float]) -> dict[str, Any]:
    """Return an unobserved twist; its ``kind`` is translation or rotation (also of a screw)."""
    turns = bool(np.linalg.norm(freedom.twist[3:]) > NAMED)
    return {
        "words": freedom.name,
        "twist": freedom.to_dict()["twist"],
        "point": point,
        "kind": "rotation" if turns else "translation",
    }


def hidden_machine(request: Request) -> dict[str, Any] | None:
    """Return the hidden robot as a machine to be drawn, None if every observed direction is constant."""
    found = request.derivation
    if found.hidden is None:
        return None
    mover = request.mover(hidden=True)
    posed = [mover.home, *(mover.with_hidden(end.real) for pair in request.ends for end in pair)]
    places = [mover.places(each)[HIDDEN] for each in posed if each.hidden is not None]
    return machine_of(HIDDEN, request.setup, found.hidden, str(found.hidden_architecture), places, ()).scene()


def hidden_words(request: Request) -> str:
    """Describe the legs of the hidden robot, and the equivalence check."""
    found = request.derivation
    legs = found.hidden_architecture
    return (
        f"{legs}; equivalence check {certificate(found.equivalence)}"
        if legs
        else "none: every observed direction is constant"
    )


def condition(setup: ObservedRobot) -> str:
    """Describe the Type 2 condition."""
    robot = MeasuredRobot.of_directions(setup)
    try:
        if robot.verdict.unobserved:
            return always(robot.pattern, robot.verdict.never)
        return robot.condition.words
    except HrsynthError as problem:
        return str(problem)


def all_legs(setup: ObservedRobot) -> ObservedRobot:
    """Return the robot with all legs observed."""
    return ObservedRobot.of(setup.robot, "all")


@lru_cache(maxsize=REMEMBERED)
def smallest(setup: ObservedRobot) -> tuple[Verdict, ...]:
    """Return the verdicts on the smallest sets of observed legs with the rank of all legs, as in ``hrsynth legs``."""
    labels = labels_of(setup.observed)
    best = verdict_of(setup, labels, setup.samples).rank
    for size in range(1, len(labels) + 1):
        found = []
        for chosen in combinations(labels, size):
            samples = restrict_samples(
                setup.all_samples, [each for each in setup.observed if each.leg in chosen], ways=False
            )
            if max(member.relation.rank for member in samples.members) == best:
                with suppress(RankUndecided):
                    found.append(verdict_of(setup, chosen, samples))
        if found:
            return tuple(found)
    return ()


def ellipsoid(setup: ObservedRobot, at: ClosedConfiguration) -> dict[str, Any] | None:
    """Return the ellipsoid of position errors for 0.1° of each direction (:func:`.error_axes`); None if they are
    unbounded or zero."""
    if not all(isinstance(each, Direction) for each in setup.observed):
        return None
    axes = error_axes(at, setup.samples.observation_model, MeasurementBounds(np.full(len(setup.observed), CONE)))
    if axes is None or not axes.any():
        return None
    return {"center": setup.motion.position(at.pose(setup.motion.link)).tolist(), "axes": axes.tolist()}
