"""Relations that hold by the file: links and joints carry them, wherever the robot goes and in whatever mode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.incidences import Incidences
from hrsynth.mechanism.structural_incidences import GeometricIncidence, find_structural_incidences, list_incidences
from mechanism.relating import miss, observed, recognised, walked
from oracle import NotAssembled, Oracle, Undecided
from strategies import parallel_robots, planar, random_rotation, spherical, transformed

FAR = (0.3, 0.5, 0.7)
"""Twists (characteristic lengths, radians) by which each link is thrown before the loops are closed again."""


def scattered(mechanism: Mechanism, tries: int, seed: int) -> Iterator[Array]:
    """Up to four closed states from links thrown anywhere: of any operation mode, any assembly mode."""
    oracle, rng, given = Oracle(mechanism), np.random.default_rng(seed), 0
    units = oracle._units
    for number in range(tries):
        try:
            thrown = FAR[number % len(FAR)] * units * rng.normal(size=len(units))
            yield oracle.close(oracle.moved(oracle.zero(), thrown), iterations=200)
            given += 1
        except NotAssembled:
            continue
        if given == 4:
            return


def by_the_file(mechanism: Mechanism, relations: Incidences) -> list[GeometricIncidence]:
    every = list_incidences(relations)
    return [
        tie for tie, holds in zip(every, find_structural_incidences(mechanism, relations, every), strict=True) if holds
    ]


def check(mechanism: Mechanism, seed: int, tries: int) -> int:
    """What is carried from zero holds in all states; how many were there."""
    relations = recognised(mechanism, walked(mechanism, 1, seed))
    states = list(scattered(mechanism, tries, seed))
    for tie in by_the_file(mechanism, relations):
        assert max((miss(tie, mechanism, relations, state) for state in states), default=0.0) < 1e-7, tie.words(
            relations
        )
    return len(states)


@pytest.mark.some(6)
@pytest.mark.parametrize("name", list_robots())
def test_what_is_carried_holds_in_all_modes(name: str) -> None:
    assert check(observed(load(name)), seed=1, tries=60) > 0


@given(parallel_robots(), st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_what_is_carried_holds_on_random_robots(mechanism: Mechanism, seed: int) -> None:
    rng = np.random.default_rng(seed)
    try:
        check(transformed(mechanism, random_rotation(rng), rng.normal(size=3)), seed, 3)
    except (NotAssembled, Undecided):
        assume(False)


@pytest.mark.some(11)
@pytest.mark.parametrize("name", list_robots())
def test_zero_alone_carries_nothing_that_motion_breaks(name: str) -> None:
    """What holds by accident at zero is not carried: all that is carried from zero alone is found over a walk too."""
    robot = observed(load(name))
    at_zero = recognised(robot, walked(robot, 0, seed=0))
    for state in walked(robot, 2, seed=5):
        assert max((miss(tie, robot, at_zero, state) for tie in by_the_file(robot, at_zero)), default=0.0) < 1e-8


def test_planar_and_spherical_robots_are_carried_whole() -> None:
    """All axes of a planar robot are normal to all that moves, those of a spherical one go through one point."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        for robot in (planar(["RRR", "RPR", "PRR"], rng, [{0}] * 3), spherical(rng)):
            relations = recognised(robot, walked(robot, 2, seed))
            assert all(find_structural_incidences(robot, relations, list_incidences(relations)))


def test_a_relation_across_a_joint_that_breaks_it_is_not_carried() -> None:
    """Two parallel R with a skew one between them: parallel at zero, not carried; with a P between, carried."""
    for kind, holds in (("R", False), ("P", True), ("C", False), ("S", False)):
        builder = Builder("chain")
        for number in range(4):
            builder.link(f"link_{number}", at=(number, 0, 0))
        for number, (letter, axis) in enumerate((("R", (0, 0, 1)), (kind, (0, 1, 0)), ("R", (0, 0, 1)))):
            builder.joint(
                f"joint_{number}",
                letter,
                f"link_{number}",
                f"link_{number + 1}",
                (number, 0, 0),
                axis=None if letter == "S" else axis,
            )
        builder.observe("1", "link_3", (0.3, 0.4, 0.5))
        robot = builder.build(platform="link_3")
        relations = recognised(robot, walked(robot, 0, seed=0))
        every = list_incidences(relations)
        same = [
            (tie, holds)
            for tie, holds in zip(every, find_structural_incidences(robot, relations, every), strict=True)
            if tie.kind == "same"
        ]
        across = [known for tie, known in same if {"link_0", "link_3"} & set(tie.links)]
        assert relations.axes["joint_0"] == relations.axes["joint_2"]
        assert across
        assert all(across) == holds


def test_words_of_relations_name_joints() -> None:
    robot = observed(load("delta"))
    relations = recognised(robot, walked(robot, 2, seed=1))
    words = {tie.words(relations) for tie in list_incidences(relations)}
    assert any("a parallelogram except for slides along" in text or ": a parallelogram" in text for text in words)
    assert all(any(name in text for name in robot.joints) or "observed" in text for text in words)


def test_a_watched_link_is_kept_with_its_relation() -> None:
    robot = observed(load("delta"))
    relations = recognised(robot, walked(robot, 2, seed=1))
    assert relations.watched == tuple(o.link for o in robot.observations)
    tie = GeometricIncidence("seen", links=("platform",), sight=relations.sights[0])
    assert not find_structural_incidences(robot, relations, [tie])[0]
    assert find_structural_incidences(robot, relations, [replace(tie, links=(relations.watched[0],))])[0]
