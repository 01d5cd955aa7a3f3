"""Each pair of the six modes of a random 3-ΠR̲R: joined by a certified path, or proved separated."""

from __future__ import annotations

from itertools import combinations, islice

import numpy as np
import pytest

from analysis.aspects.certified import check_certified
from analysis.aspects.six_modes import LEGS, SixModes, determinants, six_modes, tips_at
from hrsynth.analysis.aspects.path import PATH_INTERVALS_MAX, PathAnswer, PathPlanner
from hrsynth.analysis.aspects.path_segments import WorkingModeChange
from hrsynth.analysis.aspects.verdicts import SAME, SEPARATED, UNDECIDED
from hrsynth.geometry.vectors import Array
from hrsynth.kinematics.configuration import measure

PAIRS = list(combinations(range(6), 2))


def joined(instance: SixModes) -> tuple[PathPlanner, dict[tuple[int, int], PathAnswer], Array]:
    """Answers for all pairs of modes, and the determinant at each mode (characteristic lengths)."""
    aspects = PathPlanner.of(instance.robot)
    places = instance.configurations(aspects.setup.samples.model)
    values = determinants(instance, tips_at(instance, instance.poses), instance.ends) / instance.robot.length
    return aspects, {(i, j): aspects.join(places[i], places[j]) for i, j in PAIRS}, values


def check_path(instance: SixModes, answer: PathAnswer, pair: tuple[int, int], points: int) -> None:
    """Along a path, by two circles a leg alone: each leg reaches, the determinant keeps its sign and its margin, and
    the cranks end at the goal's."""
    robot, carriage = instance.robot, answer.coordinates
    assert carriage is not None
    assert answer.margin is not None
    feet, knees, homes = (np.array([robot.joints[f"joint_{i}_{k}"].point for i in LEGS]) for k in (1, 2, 3))
    cranks, rods = np.linalg.norm(knees - feet, axis=1), np.linalg.norm(homes - knees, axis=1)
    start, goal = pair
    branches = _sides(instance, tips_at(instance, instance.poses), instance.ends)
    branch, sign = branches[start].copy(), 0.0
    at = instance.poses[start]
    for way in answer.segments:
        p, R, *leading = way.at(np.linspace(0, 1, points))
        X = np.array([carriage.frame(*each) for each in zip(p, R, strict=True)])
        assert np.max(np.abs(X[0] - at)) < 1e-9
        at, tips = X[-1], tips_at(instance, X)
        ends = _ends(instance, tips, feet, cranks, rods, branch)
        if isinstance(way, WorkingModeChange):
            limb, carried = leading[0]
            assert np.max(np.abs(ends[[0], limb] - carriage.length * carried[0])) < 1e-7
            ends[:, limb] = carriage.length * carried
            branch[limb] *= -1
            assert np.max(np.abs(_ends(instance, tips[-1:], feet, cranks, rods, branch) - ends[-1])) < 1e-7
        assert np.max(np.abs(np.linalg.norm(ends - feet, axis=2) - cranks)) < 1e-9
        assert np.max(np.abs(np.linalg.norm(tips - ends, axis=2) - rods)) < 1e-9
        values = determinants(instance, tips, ends) / robot.length
        sign = sign or float(np.sign(values[0]))
        assert np.all(np.sign(values) == sign)
        assert np.min(np.abs(values)) >= answer.margin - 1e-9
    assert np.max(np.abs(at - instance.poses[goal])) < 1e-9
    assert np.all(branch == branches[goal])


def _sides(instance: SixModes, tips: Array, ends: Array) -> Array:
    """On which side of the line to its tip each crank ends, ±1."""
    feet = np.array([instance.robot.joints[f"joint_{i}_1"].point for i in LEGS])
    return np.sign(np.cross(tips - feet, ends - feet) @ instance.robot.joints["joint_1_1"].axis)


def _ends(instance: SixModes, tips: Array, feet: Array, cranks: Array, rods: Array, branch: Array) -> Array:
    """Where the cranks end, by the law of cosines."""
    D = tips - feet
    far = np.linalg.norm(D, axis=2)
    cosines = (far**2 + cranks**2 - rods**2) / (2 * far * cranks)
    assert np.max(np.abs(cosines)) < 1 + 1e-9, "a leg does not reach"
    angles = branch * np.arccos(np.clip(cosines, -1, 1))
    along = D / far[..., None]
    aside = np.cross(instance.robot.joints["joint_1_1"].axis, along)
    return feet + cranks[:, None] * (np.cos(angles)[..., None] * along + np.sin(angles)[..., None] * aside)


def check_instance(instance: SixModes, points: int, followed: int) -> tuple[int, int]:
    """The law for all pairs of an instance: how many of equal sign there are, and how many of them are decided."""
    aspects, answers, values = joined(instance)
    decided = 0
    for (i, j), answer in answers.items():
        assert abs(answer.start.value) == pytest.approx(abs(values[i]), abs=1e-9)
        assert answer.boxes <= PATH_INTERVALS_MAX
        if values[i] * values[j] < 0:
            assert (answer.verdict, answer.certified) == (SEPARATED, True)
            continue
        assert answer.verdict in (SAME, UNDECIDED)
        if answer.verdict == SAME:
            decided += 1
            check_path(instance, answer, (i, j), points)
    proved = [answer for answer in answers.values() if answer.verdict == SAME]
    for answer in proved[:followed]:
        check_certified(aspects, answer, 60)
    return sum(values[i] * values[j] > 0 for i, j in PAIRS), decided


@pytest.mark.slow
def test_modes_of_one_sign_are_joined_and_of_opposite_signs_separated():
    counts = np.array([check_instance(instance, 100, 1) for instance in islice(six_modes(1), 2)])
    assert np.all(counts[:, 1] >= 0.9 * counts[:, 0])


@pytest.mark.long
def test_fifty_robots_with_six_modes():
    counts = np.array([check_instance(instance, 300, 1) for instance in islice(six_modes(0), 50)])
    equal, decided = counts.sum(axis=0)
    assert equal >= 250
    assert decided >= 0.9 * equal


def test_all_six_modes_have_the_directions_that_are_watched():
    for instance in islice(six_modes(2), 3):
        aspects = PathPlanner.of(instance.robot)
        observation_model = aspects.setup.samples.observation_model
        seen = [
            np.array(measure(at.model, at.q, observation_model.reference, observation_model.observations)[2])
            for at in instance.configurations(aspects.setup.samples.model)
        ]
        assert np.max(np.abs(np.array(seen) - seen[0])) < 1e-9
        apart = [np.max(np.abs(one - two)) for one, two in combinations(instance.poses, 2)]
        assert min(apart) > 1e-4
