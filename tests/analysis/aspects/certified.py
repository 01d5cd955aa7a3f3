"""Certified paths looked at again by Pinocchio: loops closed and ranks taken at many points."""

from __future__ import annotations

import numpy as np

from hrsynth.analysis.aspects.path import PathAnswer, PathPlanner
from hrsynth.analysis.aspects.path_segments import WorkingModeChange
from hrsynth.analysis.singularity.condition_check import compute_smallest_value, compute_smallest_values
from hrsynth.constraints.condition import Condition
from hrsynth.constraints.named_vectors import normalise_rows
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.kinematics.tasks import PoseAndValuesTask, solve
from hrsynth.tolerances import CLOSURE_RESIDUAL_TOL, RANK_CUTOFF_FRACTION

FEWEST = 25
"""Steps on each part of a path, at least: with longer ones the solver of loops may leave a leg's working mode."""


def followed(aspects: PathPlanner, answer: PathAnswer, points: int) -> list[ClosedConfiguration]:
    """The real robot's configurations along a path, found by closing its loops, small step after small step; where a
    leg crosses its limit, with the direction of its rod."""
    assert answer.coordinates is not None
    carriage, observation_model = answer.coordinates, aspects.setup.samples.observation_model
    here, found = answer.start.configuration, []
    for way in answer.segments:
        fractions = np.linspace(0, 1, max(points // len(answer.segments), FEWEST) + 1)
        p, R = way.at(fractions)[:2]
        held = [() for _ in fractions]
        if isinstance(way, WorkingModeChange):
            (seen,) = [o for o in observation_model.observations if o.leg == way.leg]
            values = measure(here.model, here.q, observation_model.reference, [seen])[2]
            rods = normalise_rows(way.rod.at(fractions))
            assert np.linalg.norm(np.cross(values[0], rods[0])) < 1e-7, "the rod is what is watched"
            held = [((seen, np.sign(values[0] @ rods[0]) * rod),) for rod in rods]
        for place, turn, measured in zip(p, R, held, strict=True):
            X = np.eye(4)
            X[:3, 3] = carriage.length * place - carriage.motion.point
            point = None if carriage.turning else carriage.motion.point
            target = PoseAndValuesTask(
                carriage.motion.link,
                carriage.frame(place, turn) if carriage.turning else X,
                point,
                observation_model.reference,
                measured,
            )
            q, residual = solve(here.model, here.q, target, tolerance=1e-12)
            assert residual <= CLOSURE_RESIDUAL_TOL, "a leg does not reach"
            here = ClosedConfiguration.of(here.model, q)
            found.append(here)
    return found


def check_certified(aspects: PathPlanner, answer: PathAnswer, points: int) -> None:
    """Dense points of the path: all legs close, they lead to the goal, the condition's value keeps its side and stays
    above the margin."""
    assert answer.certified
    assert answer.margin is not None
    assert answer.margin > 0
    way = followed(aspects, answer, points)
    end = way[-1].pose(aspects.setup.mechanism.platform) - answer.goal.configuration.pose(
        aspects.setup.mechanism.platform
    )
    assert np.max(np.abs(end)) < 1e-7
    scene = aspects.structure.values_at(way)
    condition: Condition = aspects.condition
    values = condition.evaluate(scene) if answer.signed else compute_smallest_values(condition.rows(scene))
    assert np.all(np.sign(values) == np.sign(answer.start.value))
    assert np.min(np.abs(values)) >= answer.margin - 1e-9
    ranks = [
        compute_smallest_value(at, aspects.setup.samples.observation_model) for at in way[:: max(1, len(way) // 20)]
    ]
    assert min(ranks) > RANK_CUTOFF_FRACTION
