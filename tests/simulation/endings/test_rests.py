"""All rests of a loop: what is told of each, against the oracle in maximal coordinates and against simulated runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hrsynth.analysis.modes.modes import modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.kinematics.chart import TangentChart
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.simulation.endings.enclosure import enclosed
from hrsynth.simulation.endings.endings import Endings, RestPoint, RestSearch, _ways, endings, stability
from hrsynth.simulation.endings.search import CriticalPoint
from hrsynth.simulation.law import FixedDirections
from hrsynth.simulation.run import Loop
from simulation.endings.count import Descent, counted

FIVE_BAR, POSE = "rrrrr_m1", "x=0.02,y=0.25"
COUNTS = [("3rpr_m1", None), ("rrrrr_m1", None), ("3rrr_m1", None), ("3rps", None), ("gough_stewart", "1,3,5"),
          ("quattro", "1,4"), ("quattro", "2,3"), ("quattro", None), ("quattro_rigid", None)]


@cache
def listed(name: str = FIVE_BAR, pose: str = POSE) -> Endings:
    return endings(name, at=pose)


def link_poses(scene: Descent, each: RestPoint) -> np.ndarray:
    return np.array([each.configuration.pose(link) for link in scene.oracle.index])


def nearby(found: Endings, each: RestPoint, size: float = 1e-3) -> ClosedConfiguration:
    """A closed configuration next to a rest."""
    chart = TangentChart.around(each.configuration, found.setting.everything.question)
    way = np.random.default_rng(0).normal(size=chart.basis.shape[1])
    return chart.at(size * way / np.linalg.norm(way), each.configuration.q)


def test_enclosed_rests_are_rests_for_the_oracle() -> None:
    """The gradient of E along the oracle's constraints vanishes at each, and the signs of its Hessian there, by
    differences along the oracle's kernel, are those that are proved."""
    found = listed()
    scene = Descent(found)
    assert len(found.rests) >= 30
    for each in found.rests:
        state = link_poses(scene, each)
        r, J = scene.constraints(state)
        slope = scene.along(J, scene.error(state)[1])
        assert np.linalg.norm(r) < 1e-10
        assert np.linalg.norm(slope) < 1e-9
        assert np.sqrt(max(0.0, 2 * scene.error(state)[0])) == pytest.approx(each.error, abs=1e-7)
        assert each.proved
        assert each.decided
        assert each.shift < 1e-8
        mu = -np.linalg.lstsq(J.T, scene.error(state)[1], rcond=None)[0]
        _, values, right = np.linalg.svd(J)
        Z = right[int(np.sum(values > 1e-9)) :].T
        H = []
        for way in Z.T:
            ends = [scene.moved(state, sign * 1e-5 * way) for sign in (1, -1)]
            pulls = [scene.error(end)[1] + scene.constraints(end)[1].T @ mu for end in ends]
            H.append(Z.T @ (pulls[0] - pulls[1]) / 2e-5)
        signs = np.sign(np.linalg.eigvalsh((np.array(H) + np.array(H).T) / 2))
        assert tuple(signs) == tuple(np.sign(each.curvatures))
        assert each.stability == {2: "stable", -2: "unstable", 0: "saddle"}[int(signs.sum())]


def test_lists_of_modes_are_among_the_rests() -> None:
    """Every mode of the goal's directions at which the robot is assembled is a rest that attracts, and those with legs
    reversed are the modes of the rest itself."""
    found = listed()
    assert found.rests[0].kind == "goal"
    for signs in found.lists:
        own = [each for each in found.rests if each.kind != "critical" and each.reversed == signs.reversed]
        again = modes(found.setting, at=own[0].configuration)
        assert signs.complete == again.found.complete
        assert len(own) == sum(each.configuration is not None for each in again.modes)
        assert all(each.stable for each in own)


def test_of_one_pose_the_enclosed_rest_is_told() -> None:
    """Where loops are singular, a mode is found to half the digits: its error did not vanish, and it was *critical*
    beside nothing that said *mode* (quattro, legs 1 and 4, z = −0.7)."""
    found = listed()
    search = RestSearch.of(found.setting, found.goal)
    for mode in (each for each in found.rests if each.kind == "mode"):
        vague = replace(mode, kind="critical", error=4e-7, shift=np.inf, turn=np.inf, decided=False)
        for both in ([vague, mode], [mode, vague]):
            (told,) = _ways(both, search)
            assert (told.kind, told.proved, told.ways) == ("mode", True, 2)


@pytest.mark.slow
def test_runs_end_at_what_attracts_and_leave_the_rest() -> None:
    """From next to each rest that attracts a run ends there; from next to a saddle it does not."""
    found = listed()
    search = RestSearch.of(found.setting, found.goal)
    loop = Loop(replace(search.law, gain=0.8), found.setting.everything.question, FixedDirections(found.desired))
    saddle = next(each for each in found.rests if each.stability == "saddle")
    for each in (*found.attracting[:4], *found.attracting[-1:], saddle):
        run = loop.simulate(nearby(found, each), 60.0)
        away = np.abs(run.last.pose(found.setting.motion.link) - each.configuration.pose(found.setting.motion.link))
        assert (away.max() < 1e-4) == (each.stable is True)


def test_nothing_is_enclosed_beside_a_rest() -> None:
    """A box that is centred 1e-4 beside a rest proves nothing, or holds the rest itself."""
    found = listed()
    search = RestSearch.of(found.setting, found.goal)
    for each in found.rests[:4]:
        q = search.system.system.read(each.configuration.pose)
        moved = CriticalPoint(q + 1e-4, np.zeros(search.system.size[1]), 0.0, np.zeros(2), 0.0)
        (box,) = enclosed(search.system, [moved], 0)
        assert box is None or np.all(np.abs(box.q - q) <= box.radius)


@pytest.mark.slow
def test_few_random_starts_find_no_other() -> None:
    """Gradient descent and Newton's method in the oracle's coordinates find members of the list alone."""
    result = counted(listed(), 25)
    assert not result.strangers
    assert len(result.met) > 5


@pytest.mark.long
@pytest.mark.parametrize(("name", "legs"), COUNTS)
def test_a_thousand_random_starts_find_no_other(name: str, legs: str | None) -> None:
    """The same of the robots whose lists are told in the documentation."""
    setting = ObservedRobot.of(name, legs)
    goal = setting.motion.pose(setting.configurations[3].pose(setting.motion.link))
    assert not counted(endings(setting, at=str(goal)), 1000).strangers


@pytest.mark.parametrize(("curvatures", "word"), [
    ([0.1, 2.0], "stable"), ([-0.1, 2.0], "saddle"), ([-2.0, -0.1], "unstable"), ([1e-9, 1.0], "undecided"),
    ([-1e-9, 1.0], "undecided"), ([-0.1, 1e-9], "unstable"), ([-0.1, 1e-9, 1.0], "saddle")])
def test_a_flat_direction_never_attracts_for_sure(curvatures: list[float], word: str) -> None:
    """Only where all curvatures are surely positive does a rest attract; one that is surely negative is enough that it
    does not."""
    assert stability(curvatures) == word
