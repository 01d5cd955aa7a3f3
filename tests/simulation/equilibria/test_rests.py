"""All rests of a loop: what is told of each, against the oracle in maximal coordinates and against simulated runs."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import replace
from functools import cache
from itertools import combinations, islice, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import least_squares

import hrsynth
from hrsynth.analysis.modes.modes import modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.constraints.pattern import list_placing_links
from hrsynth.equations.measured_error import CriticalPointEquations
from hrsynth.errors import BadRequest
from hrsynth.geometry.affine import AffineForms
from hrsynth.geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from hrsynth.geometry.vectors import build_pose, compare_poses
from hrsynth.kinematics.chart import TangentChart
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import locate_joint
from hrsynth.mechanism.model import Limits
from hrsynth.present.text.equilibria import format_equilibria as text
from hrsynth.simulation.equilibria.completeness import CompletenessProof
from hrsynth.simulation.equilibria.critical_poses import CriticalPoses, PoseToJoints, _held_sets, critical_poses
from hrsynth.simulation.equilibria.descent import CriticalPoint, Tangents, descend, walk_at_random
from hrsynth.simulation.equilibria.enclosure import _rates, enclose_points
from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch, _sort, _ways, equilibria
from hrsynth.simulation.equilibria.equilibrium import Equilibria, Equilibrium, SignedModes, stability
from hrsynth.simulation.equilibria.exhaustive_search import cover, reachable_box
from hrsynth.simulation.equilibria.pose_error import PoseError
from hrsynth.simulation.equilibria.pose_system import LegSystem
from hrsynth.simulation.equilibria.search import DistinctPoints, anywhere, starts
from hrsynth.simulation.law import FixedDirections, directions
from hrsynth.simulation.run import Loop
from oracle import Oracle
from simulation.equilibria import many
from simulation.equilibria.count import Descent, counted
from simulation.scenes import GOALS, Legs, goal, setting

FIVE_BAR, POSE = "rrrrr_m1", "x=0.02,y=0.25"


@cache
def listed(name: str = FIVE_BAR, pose: str = POSE) -> Equilibria:
    return equilibria(name, goal=pose)


def test_without_a_pose_the_goal_is_the_zero_configuration(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(EquilibriumSearch, "answer", lambda search, *_, **__: search)
    found, robot = equilibria(FIVE_BAR), hrsynth.observe(FIVE_BAR)
    zero = robot.all_samples.start
    assert all(np.allclose(found.goal.pose(link), zero.pose(link), atol=1e-12) for link in robot.mechanism.links)
    there = equilibria(FIVE_BAR, goal=str(robot.motion.pose(zero.pose(robot.motion.link))))
    assert np.allclose(np.array(found.desired), np.array(there.desired), atol=1e-9)


SLIDES = """<robot name="far"><link name="base"/><link name="c1"/><link name="r1"/><link name="c2"/><link name="r2"/>
<joint name="a1" type="prismatic"><parent link="base"/><child link="c1"/><origin xyz="{0} {1} 0"/>
  <axis xyz="{2} {3} 0"/><limit lower="-6" upper="6" effort="0" velocity="0"/></joint>
<joint name="b1" type="continuous"><parent link="c1"/><child link="r1"/><axis xyz="0 0 1"/></joint>
<joint name="a2" type="prismatic"><parent link="base"/><child link="c2"/><origin xyz="{4} {5} 0"/>
  <axis xyz="{6} {7} 0"/><limit lower="-6" upper="6" effort="0" velocity="0"/></joint>
<joint name="b2" type="continuous"><parent link="c2"/><child link="r2"/><axis xyz="0 0 1"/></joint>
<loop name="c" type="revolute"><predecessor link="r1"><origin xyz="{8} {9} 0"/></predecessor>
  <successor link="r2"><origin xyz="{10} {11} 0"/></successor><axis xyz="0 0 1"/></loop>
<transmission name="m1"><type>transmission_interface/SimpleTransmission</type><joint name="a1"/>
  <actuator name="m1"/></transmission>
<transmission name="m2"><type>transmission_interface/SimpleTransmission</type><joint name="a2"/>
  <actuator name="m2"/></transmission>
<hrsynth><platform link="r1"/><observe leg="1" link="r1" axis="{8} {9} 0"/>
  <observe leg="2" link="r2" axis="{10} {11} 0"/></hrsynth></robot>"""


class OnSlides:
    """Two rods on slides that are nearly parallel, the first the platform: E = ½ (sin² φ₁ + sin² φ₂), and whatever the
    angles are, slides close the loop. So its rests are the pairs of quarter turns."""

    def __init__(self, folder: Path, seed: int) -> None:
        rng = np.random.default_rng(seed)
        ways = rng.uniform(1.3, 1.5), rng.uniform(1.6, 1.8)
        self.axes = np.array([[np.cos(way), np.sin(way)] for way in ways])
        self.feet, self.rods = rng.uniform(0, 0.4, (2, 2)), rng.uniform(0.3, 0.9, (2, 2))
        self.rods[1] = self.feet[0] + self.rods[0] - self.feet[1]
        numbers = np.concatenate([*np.stack([self.feet, self.axes], axis=1).reshape(2, 4), self.rods.ravel()])
        (folder / "far.urdf").write_text(SLIDES.format(*map(repr, map(float, numbers))))
        self.robot = hrsynth.observe(folder / "far.urdf")

    @property
    def rests(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The slides and the platform's x axis at each."""
        found = []
        for k, m in ((k, m) for k in range(4) for m in range(4)):
            ends = [
                foot + self.turned(rod, turns) for foot, rod, turns in zip(self.feet, self.rods, (k, m), strict=True)
            ]
            slides = np.linalg.solve(np.column_stack([self.axes[0], -self.axes[1]]), ends[1] - ends[0])
            found.append((slides, self.turned(np.array([1.0, 0.0]), k)))
        return found

    @staticmethod
    def turned(vector: np.ndarray, quarters: int) -> np.ndarray:
        """A vector after quarter turns."""
        z = complex(*vector) * 1j**quarters
        return np.array([z.real, z.imag])

    def count(self, slides: np.ndarray, turn: np.ndarray, poses: list[np.ndarray]) -> int:
        """How many of the platform's poses (4, 4) are that rest."""
        wanted = [*(self.feet[0] + slides[0] * self.axes[0]), *turn]
        return sum(np.abs(np.array([*X[:2, 3], *X[:2, 0]]) - wanted).max() < 1e-6 for X in poses)


def test_starts_go_as_far_as_slides_do(tmp_path: Path):
    """Turns are drawn evenly, however far the slides are to go for that."""
    robot = OnSlides(tmp_path, 0).robot
    search = EquilibriumSearch.of(robot, robot.all_samples.start)
    q = anywhere(search.system, np.random.default_rng(0), 200)
    turns = q[:, [not each.slides for each in search.system.system.coordinates]]
    for quarters in product(range(4), repeat=2):
        assert np.any(np.all(np.cos(turns - np.pi / 2 * np.array(quarters)) > 0.7, axis=1))


@pytest.mark.some(1, 4)
@pytest.mark.parametrize("seed", range(5))
def test_boxes_prove_all_rests_of_a_rod_on_slides_that_is_the_platform(seed: int, tmp_path: Path):
    case = OnSlides(tmp_path, seed)
    told = cover(case.robot, case.robot.all_samples.start, budget=2_000_000)
    assert told.is_complete
    assert told.bounded
    assert len(told.found) == 16
    poses = [build_pose(box.p, box.R) for box in told.found]
    assert all(case.count(slides, turn, poses) == 1 for slides, turn in case.rests)


@pytest.mark.slow
def test_rests_are_found_as_far_as_slides_go(tmp_path: Path):
    """All that lie within the limits, without boxes."""
    case = OnSlides(tmp_path, 0)
    found = equilibria(case.robot)
    poses = [each.configuration.pose("r1") for each in (*found.equilibria, *found.singular)]
    within = [each for each in case.rests if np.abs(each[0]).max() < 6]
    assert any(np.abs(slides).max() > 3 for slides, _ in within)
    assert all(case.count(slides, turn, poses) == 1 for slides, turn in within)


@pytest.mark.slow
def test_the_order_of_rests_is_that_of_what_they_are():
    """Not of how they were found, nor of the last digits of their errors, which differ between libraries."""
    found, rng = listed(), np.random.default_rng(0)
    rests, link, length = [*found.equilibria, *found.singular], found.setup.motion.link, found.goal.model.length
    ordered = _sort(rests, link, length)
    assert [*dict.fromkeys(each.kind for each in ordered)] == ["goal", "assembly mode", "antipodal", "critical"]
    for _ in range(20):
        other = [
            replace(rests[i], error=rests[i].error * (1 + 1e-9 * rng.normal()) + 1e-14 * rng.random())
            for i in rng.permutation(len(rests))
        ]
        assert [each.configuration for each in _sort(other, link, length)] == [each.configuration for each in ordered]
    assert found.equilibria == tuple(each for each in ordered if each in found.equilibria)


def link_poses(scene: Descent, each: Equilibrium) -> np.ndarray:
    return np.array([each.configuration.pose(link) for link in scene.oracle.index])


def nearby(found: Equilibria, each: Equilibrium, size: float = 1e-3) -> ClosedConfiguration:
    """A closed configuration next to a rest."""
    chart = TangentChart.around(each.configuration, found.setup.all_samples.observation_model)
    way = np.random.default_rng(0).normal(size=chart.basis.shape[1])
    return chart.at(size * way / np.linalg.norm(way), each.configuration.q)


@pytest.mark.slow
def test_enclosed_rests_are_rests_for_the_oracle() -> None:
    """The gradient of E along the oracle's constraints vanishes at each, and the signs of its Hessian there, by
    differences along the oracle's kernel, are those that are proved."""
    found = listed()
    scene = Descent(found)
    assert len(found.points) >= 30
    for each in found.points:
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


@pytest.mark.slow
def test_lists_of_modes_are_among_the_rests() -> None:
    """Every mode of the goal's directions at which the robot is assembled is a rest that attracts, and those with legs
    reversed are the modes of the rest itself."""
    found = listed()
    assert found.points[0].kind == "goal"
    for signs in found.lists:
        own = [each for each in found.points if each.kind != "critical" and each.reversed == signs.reversed]
        assert signs.boxes == len(own)
        if not own:
            assert signs.is_proved_empty
            continue
        again = modes(found.setup, at=own[0].configuration)
        assert signs.complete == again.found.complete
        assert len(own) == sum(each.configuration is not None for each in again.modes)
        assert all(each.stable for each in own)


@pytest.mark.slow
def test_every_choice_of_signs_is_told() -> None:
    """The list of each set of reversed legs, those without a pose as well."""
    found = listed()
    assert {signs.reversed for signs in found.lists} == {(), ("1",), ("2",), ("1", "2")}
    assert sum(signs.boxes or 0 for signs in found.lists) == sum(each.error < 1e-8 for each in found.points)


@pytest.mark.slow
def test_the_sides_of_rests_are_those_of_the_condition() -> None:
    """With the distal links held in direction the five-bar's end moves as its cranks' ends do: it loses a freedom where
    the cranks are parallel."""
    found = listed()

    def sine(at: ClosedConfiguration) -> float:
        ends = [
            [locate_joint(at, at.model.mechanism.joints[name])[0] for name in leg.joints[:2]]
            for leg in found.setup.decomposition.legs
        ]
        one, other = ((b - a) / np.linalg.norm(b - a) for a, b in ends)
        return float(np.cross(one, other)[2])

    side = np.sign(sine(found.goal))
    assert {each.side for each in found.points} == {"goal", "other", None}
    for each in found.points:
        value = sine(each.configuration)
        told = {None: 0.0, "goal": side, "other": -side}[each.side]
        assert told == (np.sign(value) if abs(value) > 1e-4 else 0.0)


def test_eigenvalues_are_enclosed() -> None:
    """Those of H and JᵀJ along the kernel of DG, held coordinates left out, by another way."""
    rng = np.random.default_rng(0)
    size, count = 6, 3
    for trial in range(20):
        H, J, DG = rng.normal(size=(size, size)), rng.normal(size=(5, size)), rng.normal(size=(count, size))
        free = np.ones(size)
        free[0] = trial % 2
        K, gram = np.zeros((size + count,) * 2), J.T @ J * np.outer(free, free)
        K[:size, :size] = (H + H.T) * np.outer(free, free) + np.diag(1 - free)
        K[size:, :size] = DG * free
        K[:size, size:] = K[size:, :size].T
        one, other = (AffineForms(each[None, None], np.full((1, *each.shape), 1e-12)) for each in (K, gram))
        (told,) = _rates(one, other, free[None], count)
        Z = null_space(DG[:, free > 0])
        kept = np.ix_(free > 0, free > 0)
        wanted = np.sort(np.linalg.eigvals(np.linalg.solve(Z.T @ gram[kept] @ Z, Z.T @ K[:size, :size][kept] @ Z)).real)
        assert len(told) == len(wanted) == size - count - (free[0] == 0)
        assert all(
            low <= value <= high < low + 1e-2 * max(1, abs(value))
            for (low, high), value in zip(told, wanted, strict=True)
        )


@pytest.mark.slow
def test_rates_are_those_of_the_law() -> None:
    """About rests where the error does not vanish, differences of the velocity that the law commands."""
    setup = ObservedRobot.of("quattro_rigid")
    goal = setup.configurations[3]
    search = EquilibriumSearch.of(setup, goal)
    seen = setup.samples.members[0].relation
    idle = seen.mobility - seen.dimension
    (q,) = islice(starts(search.system, np.array([search.system.system.read(goal.pose)])), 1)
    ends = [each for each in descend(search.system, q[:60], np.ones(60, dtype=np.intp), idle) if each.value > 1e-3]
    own = [
        (box.rates, at)
        for box, each in zip(enclose_points(search.system, ends, idle), ends, strict=True)
        if box is not None and box.rates and (at := search._place(each.q)) is not None
    ][:4]
    assert own
    for rates, at in own:
        chart = TangentChart.around(at, setup.all_samples.observation_model)
        back = np.linalg.pinv(chart.basis)
        A = []
        for way in 1e-5 * np.eye(chart.basis.shape[1]):
            pair = [
                back @ search.law.at(chart.at(sign * way, at.q), FixedDirections(search.desired)(0.0)).velocity
                for sign in (1, -1)
            ]
            A.append((pair[0] - pair[1]) / 2e-5)
        # idle motions are not commanded: as many eigenvalues vanish
        values = np.sort(-np.linalg.eigvals(np.array(A).T).real)
        values = sorted(sorted(values, key=abs)[len(values) - len(rates) :])
        assert values == pytest.approx([(low + high) / 2 for low, high in rates], rel=1e-3, abs=1e-3)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    "name",
    ["prrrp_m1", pytest.param("rrrrr_m1", marks=pytest.mark.slow), pytest.param("3prr_m1", marks=pytest.mark.slow)],
)
def test_what_is_said_to_be_all_is_what_boxes_prove(name: str) -> None:
    """Each proved critical pose is a rest of the list, and each rest one of them; what a shorter list lacks is told
    beside it, of one with a rest more it is not said."""
    setup = ObservedRobot.of(name)
    search = EquilibriumSearch.of(setup, setup.all_samples.start)
    found = search.answer(complete=True)
    assert found.complete
    assert found.subdivision is not None
    assert len(found.points) == len(found.subdivision.result.found)
    covers = CompletenessProof(search.system, setup, found.subdivision.result, found.subdivision.result)
    assert found.subdivision.only_proved == ()
    counted_from = found.subdivision.result.error.coordinates
    for k, each in enumerate(found.points):
        short = covers.judge([*found.points[:k], *found.points[k + 1 :]])
        assert short is not None
        assert short.complete
        (missing,) = short.only_proved
        assert counted_from.motion.goal(missing.pose).is_met(each.configuration.pose(counted_from.motion.link), 1e-6)
        assert missing.stability == each.stability
        assert missing.error[0] - 1e-9 <= each.error <= missing.error[1] + 1e-9
        assert f"{missing.stability} at {missing.pose}" in text(replace(found, subdivision=short))
    twice = covers.judge([*found.points, replace(found.points[0], configuration=nearby(found, found.points[0]))])
    assert twice is not None
    assert (twice.only_found, twice.complete) == (1, False)


@pytest.mark.slow
def test_of_one_pose_the_enclosed_rest_is_told() -> None:
    """Where loops are singular, a mode is found to half the digits: its error did not vanish, and it was *critical*
    beside nothing that said *mode* (quattro, legs 1 and 4, z = −0.7)."""
    found = listed()
    search = EquilibriumSearch.of(found.setup, found.goal)
    for mode in (each for each in found.points if each.kind == "assembly mode"):
        vague = replace(mode, kind="critical", error=4e-7, shift=np.inf, turn=np.inf, decided=False)
        for both in ([vague, mode], [mode, vague]):
            (told,) = _ways(both, search)
            assert (told.kind, told.proved, told.working_modes) == ("assembly mode", True, 2)


@pytest.mark.slow
def test_runs_end_at_what_attracts_and_leave_the_rest() -> None:
    """From next to each rest that attracts a run ends there; from next to a saddle it does not."""
    found = listed()
    search = EquilibriumSearch.of(found.setup, found.goal)
    loop = Loop(
        replace(search.law, gain=0.8), found.setup.all_samples.observation_model, FixedDirections(found.desired)
    )
    saddle = next(each for each in found.points if each.stability == "saddle")
    for each in (*found.stable[:4], *found.stable[-1:], saddle):
        run = loop.simulate(nearby(found, each), 60.0)
        away = np.abs(run.last.pose(found.setup.motion.link) - each.configuration.pose(found.setup.motion.link))
        assert (away.max() < 1e-4) == (each.stable is True)


@pytest.mark.slow
def test_nothing_is_enclosed_beside_a_rest() -> None:
    """A box that is centred 1e-4 beside a rest proves nothing, or holds the rest itself."""
    found = listed()
    search = EquilibriumSearch.of(found.setup, found.goal)
    for each in found.points[:4]:
        q = search.system.system.read(each.configuration.pose)
        moved = CriticalPoint(q + 1e-4, np.zeros(search.system.size[1]), 0.0, np.zeros(2), 0.0)
        (box,) = enclose_points(search.system, [moved], 0)
        assert box is None or np.all(np.abs(box.q - q) <= box.radius)


@pytest.mark.slow
def test_what_is_alone_in_its_box_may_share_its_pose() -> None:
    """A rod may point either way at one pose: two rests there, whose boxes of joint coordinates are far apart."""
    found = equilibria("rprpr_m2", goal="x=0.03,y=0.22")
    scale = found.setup.mechanism.length
    same = [
        (one, other)
        for one, other in combinations([each for each in found.points if each.proved], 2)
        if all(
            compare_poses(one.configuration.pose(link), other.configuration.pose(link), scale) < 1e-9
            for link in list_placing_links(found.setup.decomposition)
        )
    ]
    assert same
    system = EquilibriumSearch.of(found.setup, found.goal).system
    for pair in same:
        points = [
            CriticalPoint(system.system.read(each.configuration.pose), np.zeros(system.size[1]), 0.0, np.zeros(2), 0.0)
            for each in pair
        ]
        one, other = enclose_points(system, points, 0)
        assert one is not None
        assert other is not None
        away = np.abs((one.q - other.q + np.pi) % (2 * np.pi) - np.pi)
        assert np.max(away) > 0.1 > 1e6 * max(one.radius.max(), other.radius.max())
    assert "each unique within" in text(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "turns", "words"),
    [
        ("linear_delta", 1, ", in the orientation of the goal"),
        ("3upu", 2, ", in the 2 orientations in which the platform translates"),
        ("3rrr_m1", 1, ""),
    ],
)
def test_where_a_platform_only_translates_nothing_is_said_of_other_turns(name: str, turns: int, words: str) -> None:
    """Of poses with reversed legs that boxes exclude, and of those that they count where no list does."""
    found, lists = listed(), (SignedModes(("1",), None, 0, turns),)
    told = text(replace(found, setup=ObservedRobot.of(name), lists=lists))
    assert f"poses with leg 1 reversed: none, proved by boxes of poses{words}" in told.splitlines()[-2]
    open_ = replace(found.lists[0].listed, found=replace(found.lists[0].listed.found, complete=False))
    told = text(replace(found, setup=ObservedRobot.of(name), lists=(SignedModes(("1",), open_, 3, turns),)))
    assert told.splitlines()[-2].endswith(f"poses with leg 1 reversed: 3, proved to be all by boxes of poses{words}")
    told = text(replace(found, lists=(SignedModes((), open_, None),)))
    assert "found, not proved to be all" in told.splitlines()[-2]


@pytest.mark.slow
def test_few_random_starts_find_no_other() -> None:
    """Gradient descent and Newton's method in the oracle's coordinates find members of the list alone."""
    result = counted(listed(), 25)
    assert not result.strangers
    assert len(result.met) > 5


@pytest.mark.slow
def test_a_thousand_starts_at_once_find_no_other() -> None:
    """The same by a program whose derivatives are by hand, which are those of what they are derivatives of."""
    scene, rng = many.Many(listed()), np.random.default_rng(2)
    at = scene.starts(40, rng)
    B = scene.basis(at)
    mu, x = rng.normal(size=(40, 3 * len(scene.legs))), rng.normal(size=(40, B.shape[2]))
    ends = [scene.stepped(at, B, sign * 1e-4 * x) for sign in (1, 0, -1)]
    up, here, down = (scene.error(end) + (mu * scene.closing(end)).sum(axis=1) for end in ends)
    slope = scene.slope(at, B) + np.einsum("nrk,nr->nk", scene.rates(at, B), mu)
    assert np.abs((up - down) / 2e-4 - (slope * x).sum(axis=1)).max() < 1e-5
    assert (
        np.abs((up - 2 * here + down) / 1e-8 - np.einsum("nk,nkl,nl->n", x, scene.hessian(at, mu, B), x)).max() < 1e-4
    )
    result = many.counted(listed(), 1000)
    assert not result.outside
    assert result.ends["descent", many.MEMBER] == 1000
    assert len(result.met) > 25


@pytest.mark.slow
def test_critical_poses_are_rests_and_joints_go_there() -> None:
    """Each pose that is found without joints is one at which the robot rests, its directions are those of that rest;
    the joints that are found from the goal alone have both where they are to be."""
    found = listed()
    told = critical_poses(found.setup, found.goal)
    assert told is not None
    error, poses, *_ = told
    assert len(poses) >= 25
    assert error.coordinates is not None
    p = error.length * error.coordinates.of([each.configuration for each in found.points])[0]
    u = np.array([directions(each.configuration, found.setup.samples.observation_model)[0] for each in found.points])
    for at, seen, falling in zip(poses.p, poses.directions, poses.falling, strict=True):
        away = np.maximum(np.abs(p - at).max(axis=1) / error.length, np.abs(u - seen).max(axis=(1, 2)))
        assert away.min() < 1e-5
        assert np.sum(np.array(found.points[int(away.argmin())].curvatures) < 0) == falling
    search = EquilibriumSearch.of(found.setup, found.goal)
    lift = PoseToJoints(search.system, search.law.observation_model.observations, error)
    q, done = lift(poses, search.system.system.read(found.goal.pose)[None])
    assert done.sum() > len(poses) / 2
    assert np.abs(lift.values_at(q[done]) - lift.desired_values(poses.some(done))).max() < 1e-8
    assert np.abs(CriticalPointEquations(search.system, list(q[done].T)).G).max() < 1e-8


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "legs"), [("quattro", ("1", "4")), ("quattro_rigid", None), ("delta", None)])
def test_no_loop_is_open_for_the_oracle(name: str, legs: Legs | None) -> None:
    """Equations that follow from the others at samples do not where loops are singular: they hold all the same where
    random closings, walks from there and joints of a pose are led; where they do not, nothing is a rest."""
    found, rng = setting(name, legs), np.random.default_rng(0)
    search, oracle = (
        EquilibriumSearch.of(found, goal(name) if name in GOALS else found.configurations[3]),
        Oracle(found.mechanism),
    )

    def left(q: np.ndarray) -> np.ndarray:
        poses = [search.system.system.pose(link, q.T) for link in oracle.index]
        return np.array(
            [oracle.error(state) for state in np.stack([np.broadcast_to(X, (len(q), 4, 4)) for X in poses], axis=1)]
        )

    closings = anywhere(search.system, rng, 40)
    assert len(closings) > 20
    assert left(closings).max() < 1e-9
    home = search.system.system.read(search.goal.pose)[None]
    walks = walk_at_random(search.system, np.repeat(home, 20, axis=0), rng, 12)
    assert np.abs(walks - home).max(axis=1).min() > 0.1
    assert left(walks).max() < 1e-9
    error = PoseError.of(found, search.goal)
    assert error.coordinates is not None
    p, R = error.coordinates.of([at for q in walks if (at := search._place(q)) is not None])
    u = np.array(
        [directions(at, found.samples.observation_model)[0] for q in walks if (at := search._place(q)) is not None]
    )
    places = CriticalPoses(error.length * p, R, u, *np.zeros((2, len(p)), dtype=np.intp))
    q, done = PoseToJoints(search.system, search.law.observation_model.observations, error)(places, home)
    assert done.sum() > len(p) / 2
    assert left(q[done]).max() < 1e-8
    known, astray = DistinctPoints(search.system, found), rng.uniform(-np.pi, np.pi, (30, home.shape[1]))
    for _ in range(40):
        here = CriticalPointEquations(search.system, list(astray.T))
        astray = astray + np.clip(Tangents.of(here.DG).closing(here.G), -0.3, 0.3)
    astray = astray[np.linalg.norm(CriticalPointEquations(search.system, list(astray.T)).G, axis=1) < 1e-11]
    open_ = left(astray) > 1e-3
    assert open_.any() == (name != "delta")
    assert (
        known.add(
            [CriticalPoint(each, np.zeros(search.system.size[1]), 0.0, np.ones(4), 0.0) for each in astray[open_]]
        )
        == 0
    )


@pytest.mark.parametrize(
    ("name", "legs"), [("quattro", "1,4"), ("3rpr_m1", None), ("gough_stewart", "1,3,5"), ("linear_delta", "1")]
)
def test_equations_over_the_pose_are_what_their_derivatives_say(name: str, legs: str | None) -> None:
    """E and the equations of watched legs and of all that can be held: differences along a line are the gradient and
    the Hessian; at drawn poses the watched legs close, and E is that of the pose."""
    setup = ObservedRobot.of(name, legs)
    error, rng = PoseError.of(setup, setup.configurations[3]), np.random.default_rng(0)
    low, high, _ = reachable_box(error, 3.0)
    for held in _held_sets(error):
        system = LegSystem.of(error, held)
        n, k = system.quaternion.stop, error.shifts.shape[1]
        x = np.concatenate([rng.uniform(low[:k], high[:k], (2000, k)), rng.normal(size=(2000, n - k))], axis=1)
        y = system.draw(x, rng)[:20]
        assert len(y) == 20
        at = system.at(list(y.T))
        if not held:
            assert np.abs(at.G).max(initial=0.0) < 1e-12
            w = np.array([error._direction(each, error.p, error.R.ravel(), lambda value: value) for each in error.seen])
            assert pytest.approx(0.5 * (1 - np.einsum("cia,ia->ci", system.directions(y), w) ** 2).sum(axis=1)) == at.E
        y += 0.1 * rng.normal(size=y.shape)
        at, way = system.at(list(y.T)), rng.normal(size=y.shape)
        mu = rng.normal(size=at.G.shape)
        ends = [system.at(list((y + sign * 1e-4 * way).T)) for sign in (1, 0, -1)]
        up, here, down = (each.E + (mu * each.G).sum(axis=1) for each in ends)
        slope = at.slope + np.einsum("cm,cmn->cn", mu, at.DG)
        assert (up - down) / 2e-4 == pytest.approx((slope * way).sum(axis=1), rel=1e-5, abs=1e-5)
        assert (up - 2 * here + down) / 1e-8 == pytest.approx(
            np.einsum("cn,cnm,cm->c", way, at.bend(mu), way), rel=1e-4, abs=1e-4
        )


@pytest.mark.long
@pytest.mark.parametrize(("name", "legs"), many.COUNTS)
def test_a_thousand_random_starts_find_no_other(name: str, legs: str | None) -> None:
    """The same of the robots whose lists are told in the documentation, by the program that leads all at once; of those
    in space the lists are known not to be whole: descent leads nearly always to a member."""
    result = many.counted(many.listed(name, legs), 1000)
    assert (name, legs) not in many.WHOLE or not result.outside
    assert result.ends["descent", many.MEMBER] > 950


SQUARE = np.array([[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.1, -0.1, 0]])
TILTED = "x=0.1,y=0,z=1.2,rpy=0.3/-0.5/0.2"
BODY = """<robot name="body"><link name="base"/><link name="platform"/>
  <joint name="free" type="floating"><parent link="base"/><child link="platform"/><origin xyz="0 0 1.2"/></joint>
  <hrsynth serial="true"><platform link="platform"/></hrsynth></robot>"""


def seen(points: np.ndarray, link: str = "platform") -> list[str]:
    return [f"point:{link}@{x},{y},{z}" for x, y, z in points]


def body(folder: Path, sensor: list[str], **options: Any) -> Equilibria:
    """The endings of a body that nothing holds before a camera."""
    (folder / "body.urdf").write_text(BODY)
    return equilibria(folder / "body.urdf", sensor=sensor, camera="eye=base@0,0,0", **options)


def pulled(x: np.ndarray, at: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """∇½‖e‖², e that of image points at a pose x (translation, rotation vector), by hand."""
    arms = at @ convert_vectors_to_rotations(x[3:]).T
    p = arms + x[:3]
    e = p[:, :2] / p[:, 2:] - wanted
    force = np.column_stack([e, -np.sum(p[:, :2] / p[:, 2:] * e, axis=1)]) / p[:, 2:]
    return np.concatenate([force.sum(axis=0), np.cross(arms, force).sum(axis=0)])


@pytest.mark.long
def test_four_image_points_of_a_tilted_square(tmp_path: Path) -> None:
    """The goal and the pose tilted the other way attract, a saddle lies between them; by hand they are rests, gradient
    descent in maximal coordinates ends at them alone, and zeros of the gradient by least squares are no others."""
    found = body(tmp_path, seen(SQUARE), goal=TILTED)
    poses = [each.configuration.pose("platform") for each in found.points]
    p = SQUARE @ poses[0][:3, :3].T + poses[0][:3, 3]
    wanted = p[:, :2] / p[:, 2:]
    assert [(each.kind, each.stability) for each in found.points] == [
        ("goal", "stable"),
        ("critical", "stable"),
        ("critical", "saddle"),
        ("critical", "saddle"),
    ]
    assert all(each.proved and each.decided for each in found.points)
    for each, X in zip(found.points, poses, strict=True):
        x = np.append(X[:3, 3], convert_rotations_to_vectors(X[:3, :3]))
        assert pulled(x, SQUARE, wanted) == pytest.approx(np.zeros(6), abs=1e-11)
        shown = SQUARE @ X[:3, :3].T + X[:3, 3]
        assert np.linalg.norm(shown[:, :2] / shown[:, 2:] - wanted) == pytest.approx(each.error, abs=1e-12)
    result = counted(found, 25)
    assert not result.strangers
    assert {0, 1} <= result.met
    rng, met = np.random.default_rng(0), set()
    for _ in range(150):
        z, way = rng.uniform(0.5, 3), rng.normal(size=3)
        away = z * rng.uniform(-0.5, 0.5, 2)
        turn = rng.uniform(0, 2.5) * way / np.linalg.norm(way)
        start = np.array([*away, z, *turn])
        with suppress(ValueError):
            end = least_squares(pulled, start, args=(SQUARE, wanted), xtol=1e-15, ftol=1e-15, gtol=1e-15).x
            X = build_pose(end[:3], convert_vectors_to_rotations(end[3:]))
            ahead = np.min(SQUARE @ X[2, :3] + X[2, 3])
            if np.abs(pulled(end, SQUARE, wanted)).max() < 1e-11 and 1e-3 < ahead < 30:
                apart = [np.abs(X - each).max() for each in poses]
                assert min(apart) < 1e-3
                met.add(int(np.argmin(apart)))
    assert met


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    "sensor",
    [
        ["circle:platform@0.1,0,0/0,0.3,1", "distance:platform@0.1,0.1,0"],
        ["edges:platform@0.1,0,0/0,1,0.2/0.02", "edge:platform@0.1,0.1,0/1,0,0/0.02"],
        ["inclination:platform", "position:platform@0.1,0,0", "direction:platform/1,0,0"],
    ],
    ids=["circle and distance", "edges", "inclination, position and direction"],
)
def test_rests_of_all_kinds_are_those_of_the_law(sensor: list[str], tmp_path: Path) -> None:
    """The law commands nothing there, and from next to one that attracts a run ends at it."""
    found = body(tmp_path, sensor, goal=TILTED)
    assert found.points[0].kind == "goal"
    assert all(each.stable and each.proved for each in found.points if each.error < 1e-9)
    search = EquilibriumSearch.of(found.setup, found.goal)
    loop = Loop(
        replace(search.law, gain=0.8), found.setup.all_samples.observation_model, FixedDirections(found.desired)
    )
    for each in found.points[:3]:
        command = search.law.at(each.configuration, FixedDirections(found.desired)(0.0))
        assert command.size == pytest.approx(each.error, abs=1e-9)
        assert command.pull < 1e-7
        if each.singular is None:
            assert command.speed < 1e-6
            run = loop.simulate(nearby(found, each), 60.0)
            away = np.abs(run.last.pose("platform") - each.configuration.pose("platform"))
            assert (away.max() < 1e-4) == (each.stable is True)


@pytest.mark.long
@pytest.mark.parametrize(("depth", "mixed"), [("desired", False), ("constant:1", True)])
def test_rests_with_supposed_depths_are_those_of_the_law(depth: str, mixed: bool, tmp_path: Path) -> None:
    """There the law commands nothing, and its differences have the eigenvalues that are told."""
    sensor = ["image_line:platform@0.1,0,0/0,1,0", "distance:platform@0,0.1,0"] if mixed else []
    found = body(tmp_path, seen(SQUARE[: 3 if mixed else 4]) + sensor, goal=TILTED, depth=depth)
    search = EquilibriumSearch.of(found.setup, found.goal, depth)
    assert found.points[0].kind == "goal"
    assert not any(each.proved for each in found.points)
    for each in (each for each in found.points if each.singular is None):
        at, wanted = each.configuration, FixedDirections(found.desired)(0.0)
        assert search.law.at(at, wanted).speed < 1e-6
        chart = TangentChart.around(at, found.setup.all_samples.observation_model)
        back, A = np.linalg.pinv(chart.basis), []
        for way in 1e-6 * np.eye(chart.basis.shape[1]):
            pair = [back @ search.law.at(chart.at(sign * way, at.q), wanted).velocity for sign in (1, -1)]
            A.append((pair[0] - pair[1]) / 2e-6)
        values = np.sort(-np.linalg.eigvals(np.array(A).T).real)
        assert values == pytest.approx(each.curvatures, rel=1e-2, abs=1e-2)


def test_what_cannot_be_asked_of_cameras_is_refused_in_one_line(tmp_path: Path) -> None:
    for options, said in (
        ({"goal": "x=0,y=0,z=-0.5,rpy=0/0/0"}, "not in front of its camera at the goal"),
        ({"goal": TILTED, "complete": True}, "supports directions of segments only: got 'observation "),
    ):
        with pytest.raises(BadRequest, match=said):
            body(tmp_path, seen(SQUARE), **options)
    with pytest.raises(BadRequest, match="--camera eye: no observation uses this camera"):
        equilibria(FIVE_BAR, camera="eye=base@0,0,0", goal=POSE)


@pytest.mark.parametrize(
    ("curvatures", "word"),
    [
        ([0.1, 2.0], "stable"),
        ([-0.1, 2.0], "saddle"),
        ([-2.0, -0.1], "unstable"),
        ([1e-9, 1.0], "undecided"),
        ([-1e-9, 1.0], "undecided"),
        ([-0.1, 1e-9], "unstable"),
        ([-0.1, 1e-9, 1.0], "saddle"),
    ],
)
def test_a_flat_direction_never_attracts_for_sure(curvatures: list[float], word: str) -> None:
    """Only where all curvatures are surely positive does a rest attract; one that is surely negative is enough that it
    does not."""
    assert stability(curvatures) == word


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("reach", [0.3, 2.25])
def test_rests_within_the_limits_of_joints_are_counted(reach: float) -> None:
    robot = hrsynth.load(FIVE_BAR)
    motors = [joint for joint in robot.joints.values() if joint.is_actuated]
    found = equilibria(
        robot.changed(joints=[replace(joint, limits=Limits(-reach, reach)) for joint in motors]), goal=POSE
    )
    turns = [
        [each.configuration.q[list(each.configuration.model.coordinates[joint.name])] for joint in motors]
        for each in found.stable
    ]
    inside = sum(bool(np.all(np.abs(each) <= reach)) for each in turns)
    assert 0 < inside < len(turns)
    (told,) = [line.strip() for line in text(found).splitlines() if "within all joint limits" in line]
    alone = inside == 1
    assert told == f"within all joint limits: {inside} of these {len(turns)}" + " (the goal only)" * alone


@pytest.mark.slow
def test_rests_whose_rows_would_be_equal_are_one_row_with_their_number() -> None:
    """Where rods may point either way a pose has two rests, with equal rows if working modes are not known."""
    found = hrsynth.equilibria("rprpr_m2", goal="x=0.03,y=0.22")
    told = replace(found, points=tuple(replace(each, legs_in_other_mode=None, side=None) for each in found.points))
    pairs = [
        number
        for number in Counter(
            (str(each.pose), each.stability, each.kind, each.reversed, each.orthogonal_legs) for each in told.points
        ).values()
        if number > 1
    ]
    assert pairs
    text = " ".join(str(told).split())
    assert text.count("2 equilibria with different poses of other links") == len(pairs)
    assert "with different poses of other links" not in str(found)
    assert "more (--json lists them)" not in text
