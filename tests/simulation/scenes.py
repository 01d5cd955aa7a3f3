"""Shipped robots ready to be servoed, and random pairs of poses for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest
from _pytest.mark import ParameterSet

from hrsynth.analysis.configuration_report import REGULAR, ConfigurationAnalysis
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.batch.pose_continuation import track_to_pose
from hrsynth.description import list_robots, load
from hrsynth.errors import PoseReachFailure
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.walking import walk_randomly
from hrsynth.mechanism.pose import parse_pose
from hrsynth.simulation.servo import ServoTask

CONTROLLABLE = [
    "3prr_m1",
    "3prr_m2",
    "3puu",
    "3rpr_m1",
    "3rpr_m2",
    "3rps",
    "3rrr_m1",
    "3rrr_m2",
    "3ruu",
    "3upu",
    "6pus",
    "delta",
    "gough_stewart",
    "hexa",
    "linear_delta",
    "orthoglide",
    "prrrp_m1",
    "prrrp_m2",
    "quattro",
    "quattro_rigid",
    "rprpr_m1",
    "rprpr_m2",
    "rrrrr_m1",
    "rrrrr_m2",
]
"""With all legs watched."""
FEW = ["3rpr_m1", "3rps", "delta", "gough_stewart", "quattro", "quattro_rigid", "rrrrr_m1"]
"""Of all kinds: the others are left to the slow tests."""
BLIND = sorted(set(list_robots()) - set(CONTROLLABLE))


def few_first(names: list[str]) -> list[ParameterSet]:
    """The names as parameters of a test, all but a few of them slow."""
    return [pytest.param(name, marks=[] if name in FEW else pytest.mark.slow) for name in names]


GOALS = {
    "3rpr_m1": "x=-0.0348661,y=-0.0173201,phi=15.870728deg",
    "3rps": "x=-0.000819689,y=0.00476579,z=0.257054,rpy=-0.238694/0.273538/-0.0330048",
    "3rrr_m1": "x=-0.0158034,y=0.0130921,phi=17.25872deg",
    "3upu": "x=0.0617457,y=-0.00740228,z=0.27462",
    "gough_stewart": "x=0.0498488,y=-0.00885807,z=0.249452,rpy=0.094409/-0.0413902/-0.00108564",
    "quattro": "x=0.072083,y=-0.0188462,z=-0.695841,phi=-20.228542deg",
    "quattro_rigid": "x=-0.0652662,y=-0.031127,z=-0.534986",
    "rrrrr_m1": "x=0.0722611,y=0.220195",
}
"""Poses in general position: the goals whose rests are listed and counted again."""
Legs = tuple[str, ...]


@cache
def setting(name: str, watched: Legs | None = None) -> ObservedRobot:
    """A shipped robot, all or some of its legs watched."""
    found = ObservedRobot.of(load(name)) if watched is None else setting(name)
    return found if watched is None else replace(found, observed=tuple(o for o in found.observed if o.leg in watched))


def goal(name: str) -> ClosedConfiguration:
    """The configuration at the pose of GOALS."""
    return solve_configurations(setting(name), [parse_pose(GOALS[name])])[0]


@cache
def home(name: str) -> ServoTask:
    """A scene that starts and ends at the first regular pose: parts of it are put to use."""
    found = setting(name)
    pose = next(str(found.motion.pose(at.pose(found.motion.link))) for at in regular(name, 0, 0.4))
    return ServoTask.of(found, start=pose, goal=pose)


def regular(
    name: str,
    seed: int,
    distance: float,
    steps: int = 12,
    apart: int = 1,
    tried: int = 600,
    watched: Legs | None = None,
) -> Iterator[ClosedConfiguration]:
    """Random configurations, in the working mode of the zero configuration, whose hidden robot is at least ``distance``
    from Type 2 singularities (part of the usual distance), ``apart`` steps of a random walk from each other; at most
    ``tried`` steps are made."""
    found = setting(name, watched)
    examiner = ConfigurationAnalysis(found)
    observation_model, start = found.all_samples.observation_model, found.all_samples.start
    usual = np.median([examiner.classify(at).distances.type2 or 0.0 for at in found.configurations])
    for at in islice(walk_randomly(start, tried, seed=seed, steps=steps), apart - 1, None, apart):
        posture = examiner.classify(at)
        if posture.hidden.state != REGULAR or (posture.distances.type2 or 0.0) < distance * usual:
            continue
        try:
            there = track_to_pose(start, observation_model, posture.pose, found.motion)
        except PoseReachFailure:
            continue
        yield there


def far_pairs(
    name: str, seed: int, count: int, watched: Legs | None = None
) -> Iterator[tuple[ClosedConfiguration, ClosedConfiguration]]:
    """Pairs of random configurations that are regular, ever so slightly."""
    found = list(
        islice(regular(name, seed, 0.05, steps=40, apart=15, tried=300 * count + 300, watched=watched), 2 * count)
    )
    return zip(found[::2], found[1::2], strict=False)
