"""What attracts, by descent alone, and where far runs end."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch
from hrsynth.simulation.equilibria.equilibrium import Equilibrium
from hrsynth.simulation.equilibria.search import starts
from simulation.scenes import far_pairs, setting

SAME = 1e-6


def same(one: Equilibrium, other: Equilibrium) -> bool:
    names = one.configuration.model.mechanism.links
    return all(np.abs(one.configuration.pose(link) - other.configuration.pose(link)).max() < SAME for link in names)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rrrrr_m1", pytest.param("3rps", marks=pytest.mark.slow)])
def test_descent_alone_finds_what_attracts(name: str) -> None:
    """All that the search for all critical points often comes to; from starts that are given, too."""
    _, goal = next(far_pairs(name, 4, 1))
    search = EquilibriumSearch.of(setting(name), goal)
    homes = np.array([search.system.system.read(at.pose) for at in (goal, *setting(name).configurations)])
    given = list(islice(starts(search.system, homes), 4))
    found = search.answer(minima=True, rounds=given)
    assert found.starts <= sum(map(len, given))
    assert len(found.stable) > 1
    for each in search.answer(rounds=given).stable:
        assert each.hits < 5 or any(same(each, other) for other in found.stable)
