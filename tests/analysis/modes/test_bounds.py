"""The bounds on the number of modes (MMT 4.1.2, 4.2; proofs.md 8) are reached, by whole robots, and never passed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.modes.bounds import row, seen
from analysis.modes.draws import FAMILIES, Draw
from analysis.modes.laws import draw
from analysis.modes.reached import six_ups, three_rrr, two_plates
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.description import list_robots, load
from hrsynth.mechanism import Mechanism
from hrsynth.solving.platform.solve import solve
from strategies import planar

PLANAR = {
    "3rrr_m1": 6,
    "3rrr_m2": 6,
    "3rpr_m1": 2,
    "3rpr_m2": 2,
    "3prr_m1": 2,
    "3prr_m2": 2,
    "rrrrr_m1": 2,
    "rrrrr_m2": 2,
    "rprpr_m1": 1,
    "rprpr_m2": 1,
    "prrrp_m1": 1,
    "prrrp_m2": 1,
}
"""Complex modes of the planar hidden robots that decide the pose."""
UNDECIDED = {"3ppr_m1": 3, "3ppr_m2": 3, "3prp": 2, "3rrp": 2, "prrrp_parallel": 1, "prrrp_parallel_point": 1}
"""Freedoms that the directions leave of the other planar robots."""
TWICE = {name for name in (*PLANAR, *UNDECIDED) if name.endswith(("_m2", "_point"))}
"""The same robots with their motors elsewhere: what is watched is the same."""
WORDS = {"RRR": 6, "RPR": 2, "PRR": 2}


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "seed", "count", "robot", "watched"),
    [
        ("planar, three circles", 47, 6, three_rrr, "1,2,3"),
        ("spatial, three lines", 259, 8, six_ups, "1,2,3"),
        ("two bodies, circles", 2197, 8, two_plates, "1,2"),
        pytest.param("two bodies, circles parallel", 0, 4, two_plates, "1,2", marks=pytest.mark.slow),
    ],
)
def test_a_robot_reaches_the_bound(name: str, seed: int, count: int, robot: Callable[..., Mechanism], watched: str):
    """The curves of a system with that many real modes, carried by a robot that is analysed from its joints alone."""
    drawn: Draw = draw(name, seed)
    wanted = solve(drawn.system).modes
    found = modes(robot(drawn, np.random.default_rng(seed)), watched)
    assert found.found.complete, found.found.proof
    assert found.found.complex == FAMILIES[name].count == count
    assert len(found.modes) == len(wanted) == count
    assert sum(mode.goal for mode in found.modes) == 1
    link = "plate_1" if robot is two_plates else "platform"
    goal = next(mode.bodies[link] for mode in found.modes if mode.goal)
    back = np.linalg.inv(drawn.goal)
    for mode in wanted:
        moved = mode.pose @ back @ goal
        assert min(np.abs(each.bodies[link] - moved).max() for each in found.modes) < 1e-7


def test_a_symmetric_robot_reaches_eight():
    """The 3-RPS at its symmetric home: three poses lie over one root, and are told apart."""
    found = modes(load(list_robots()["3rps"]))
    assert found.found.complete
    assert found.found.complex == len(found.modes) == 8
    assert all(mode.reachable for mode in found.modes)


def shown(names: dict[str, int]) -> list[object]:
    return [pytest.param(name, marks=pytest.mark.slow) if name in TWICE else name for name in names]


@pytest.mark.parametrize("name", shown(PLANAR))
def test_planar_hidden_robots_have_as_many_modes_as_the_paper_bounds(name: str):
    found = modes(load(list_robots()[name]))
    assert found.found.complex == PLANAR[name]
    assert len(found.modes) in range(1 if PLANAR[name] == 1 else 2, PLANAR[name] + 1)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", shown(UNDECIDED))
def test_the_other_planar_hidden_robots_leave_a_continuum(name: str):
    assert modes(load(list_robots()[name])).found.continuous_family == UNDECIDED[name]


def member(word: str, seed: int) -> AssemblyModes:
    """A random planar robot with three legs of one kind, in a tilted base."""
    return modes(planar([word] * 3, np.random.default_rng(seed), [{0}] * 3))


@pytest.mark.parametrize("word", WORDS)
def test_random_planar_robots_keep_to_their_bounds(word: str):
    found = member(word, 0)
    assert found.found.complete
    assert found.found.complex == WORDS[word]
    assert 2 <= len(found.modes) <= WORDS[word]


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("word", WORDS)
def test_random_planar_robots_reach_their_bounds(word: str):
    """Six real modes by random search over robots; where lines meet, two are reached always."""
    most = 0
    for seed in range(60):
        found = member(word, seed)
        assert found.found.complete
        assert found.found.complex == WORDS[word]
        assert sum(mode.goal for mode in found.modes) == 1
        most = max(most, len(found.modes))
    assert most >= (4 if word == "RRR" else 2)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_no_instance_passes_the_bound_or_misses_its_goal(name: str):
    """Other instances than those of the law over families; ``make bounds`` takes 10,000."""
    result = seen(name, range(10_000, 10_300))
    assert (result.over, result.unproved, result.far) == ((), (), ()), row(name, result)
    assert len(result.ill) <= 2
