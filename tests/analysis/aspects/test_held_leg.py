"""Sections with one rod held: cusps and nodes by the derivatives of a coupler curve, modes by counting crossings."""

from __future__ import annotations

from functools import cache
from itertools import islice

import numpy as np
import pytest

import hrsynth
from analysis.aspects.six_modes import six_modes
from hrsynth.analysis.aspects.aspects import AspectTable, aspects
from hrsynth.analysis.aspects.singularity_slice import SectionPoint, SingularitySlice, compute_singularity_slice
from hrsynth.analysis.aspects.three_cranks import ThreeCranks, count_modes, recognise_three_cranks
from hrsynth.description import native
from hrsynth.families.planar import six_poses
from hrsynth.kinematics.configuration import ClosedConfiguration

STEP = 2e-3


@cache
def classic() -> AspectTable:
    return aspects(six_poses())


@cache
def drawn_of(seed: int | None) -> SingularitySlice:
    """The classic robot, or a random robot in a random plane with its second leg held."""
    if seed is None:
        made = classic().section
        assert not isinstance(made, str)
        return made[0]
    (instance,) = islice(six_modes(seed), 1)
    found = aspects(instance.robot, ["2", "3", "1"])
    made = found.section
    assert not isinstance(made, str)
    assert made[0].robot.labels == ("2", "3", "1")
    return made[0]


def misses(drawn: SingularitySlice, place: SectionPoint) -> np.ndarray:
    """How far (squared) a corner is from its circle while the other two go along theirs by −3 to 3 steps from a place:
    with the directions held, the modes are its zeros. Of the three corners the one that leaves the others farthest from
    the end of their way."""
    robot, held = drawn.robot, np.array([drawn.held, *np.exp(1j * np.array(place.directions))])
    centres = robot.feet + robot.rods * held
    start = centres[0] + robot.cranks[0] * np.exp(1j * place.crank)
    tips = start + robot.corners * np.exp(1j * place.turn)
    assert np.abs(tips - centres) == pytest.approx(robot.cranks, abs=1e-6)
    found = [_misses(robot, centres, tips, place.turn, order) for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    return max(found, key=lambda each: each[0])[1]


def _misses(
    robot: ThreeCranks, centres: np.ndarray, tips: np.ndarray, turn: float, order: tuple[int, ...]
) -> tuple[float, np.ndarray]:
    i, j, k = order
    a = centres[i] + (tips[i] - centres[i]) * np.exp(1j * STEP * np.arange(-3, 4))
    away, arm = centres[j] - a, robot.corners[j] - robot.corners[i]
    share = (np.abs(away) ** 2 + abs(arm) ** 2 - robot.cranks[j] ** 2) / 2
    margin = (np.abs(away) * abs(arm)) ** 2 - share**2
    aside = np.sqrt(np.maximum(margin, 0))
    ways = [away * (share + side * 1j * aside) / np.abs(away) ** 2 / arm for side in (1, -1)]
    way = min(ways, key=lambda each: abs(each[3] - np.exp(1j * turn)))
    third = a + way * (robot.corners[k] - robot.corners[i])
    return float(margin.min()), np.abs(third - centres[k]) ** 2 - robot.cranks[k] ** 2


def derivatives(values: np.ndarray) -> tuple[float, float, float, float]:
    """The value and the first three derivatives at the middle of seven places, to fourth order in the step."""
    first = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60 @ values / STEP
    second = np.array([2, -27, 270, -490, 270, -27, 2]) / 180 @ values / STEP**2
    third = np.array([1, -8, 13, 0, -13, 8, -1]) / 8 @ values / STEP**3
    return float(values[3]), float(first), float(second), float(third)


@pytest.fixture(params=[None, pytest.param(3, marks=pytest.mark.slow)])
def drawn(request: pytest.FixtureRequest) -> SingularitySlice:
    return drawn_of(request.param)


@pytest.mark.slow
def test_three_modes_meet_at_a_cusp(drawn: SingularitySlice):
    """The distance to the third circle has a triple zero there."""
    assert len(drawn.cusps) >= 2
    enclosed = [cusp for cusp in drawn.cusps if cusp.radius is not None]
    assert len(enclosed) >= 0.8 * len(drawn.cusps)
    for cusp in enclosed:
        value, first, second, third = derivatives(misses(drawn, cusp))
        assert max(abs(value), abs(first), abs(second)) < 1e-4 * max(1.0, abs(third))
        assert abs(third) > 1e-3
        assert cusp.radius < 1e-4


@pytest.mark.slow
def test_two_modes_meet_twice_at_a_node(drawn: SingularitySlice):
    for one, other in drawn.nodes:
        assert np.max(np.abs(np.exp(1j * np.array(one.directions)) - np.exp(1j * np.array(other.directions)))) < 1e-9
        angles = np.array([[each.crank, each.turn] for each in (one, other)])
        assert np.max(np.abs(np.diff(np.exp(1j * angles), axis=0))) > 1e-4
        for place in (one, other):
            value, first, second, _ = derivatives(misses(drawn, place))
            assert max(abs(value), abs(first)) < 1e-4 * max(1.0, abs(second))
            assert abs(second) > 1e-6


@pytest.mark.slow
def test_the_curve_is_where_two_modes_meet(drawn: SingularitySlice):
    """All along the curve the distance to the third circle has a double zero, and pieces are closed."""
    for piece in drawn.curve:
        assert np.max(np.abs(np.exp(1j * piece[0]) - np.exp(1j * piece[-1]))) < 1e-6
        for crank, turn, *directions in piece[:: max(1, len(piece) // 60)]:
            value, first, second, third = derivatives(misses(drawn, SectionPoint(crank, turn, tuple(directions), None)))
            assert max(abs(value), abs(first)) < 1e-4 * max(1.0, abs(second), abs(third))


@pytest.mark.slow
def test_the_number_of_modes_changes_at_the_curve_alone(drawn: SingularitySlice):
    """Neighbouring directions with different numbers of modes are apart from the curve's image by a cell at most."""
    ticks = np.linspace(-np.pi, np.pi, 73)
    counts = count_modes(drawn.robot, drawn.held, ticks, ticks, 2000)
    assert set(np.unique(counts)) <= {0, 2, 4, 6}
    image = np.vstack([piece[:, 2:] for piece in drawn.curve])
    cell = ticks[1] - ticks[0]
    for i, j in np.argwhere(counts[1:] != counts[:-1]):
        gap = np.abs((image - [ticks[i] + cell / 2, ticks[j]] + np.pi) % (2 * np.pi) - np.pi)
        assert np.min(gap.max(axis=1)) <= cell


@pytest.mark.slow
def test_the_section_holds_all_modes_of_the_goal():
    found = classic()
    made = found.section
    assert not isinstance(made, str)
    drawn, places = made
    goal = places[1]
    assert sorted(places) == [1, 2, 3, 4, 5, 6]
    first, second = np.angle(goal.rods[1:])[:, None]
    assert count_modes(drawn.robot, drawn.held, first, second, 4000) == [[6]]
    for place in places.values():
        assert np.max(np.abs(place.rods - goal.rods)) < 1e-9
        assert np.abs(place.cranks) == pytest.approx(drawn.robot.cranks, abs=1e-9)


def test_modes_are_counted_where_the_second_corner_just_reaches_its_circle():
    """Few places count what many do: a whole column of the picture was wrong where two ways of the first corner nearly
    join, or have nearly parted."""
    rng = np.random.default_rng(3)
    feet = np.array([0, 2, 1 + 1.7j]) + 0.3 * (rng.normal(size=3) + 1j * rng.normal(size=3))
    cranks, rods = rng.uniform(0.6, 1.4, (2, 3))
    robot = ThreeCranks(
        ("1", "2", "3"), feet, cranks, rods, np.array([0, rng.uniform(0.5, 1), rng.uniform(0.3, 1) * np.exp(1j)])
    )
    first, second = np.linspace(-np.pi, np.pi, 161), np.linspace(-np.pi, np.pi, 16)
    few, many = (count_modes(robot, 1 + 0j, first, second, steps) for steps in (480, 6000))
    assert set(np.unique(many)) == {0, 2, 4, 6}
    assert np.sum(few != many) <= 1


@pytest.mark.parametrize("axis", ["0 0 1", "0 0 -1"])
def test_the_turn_of_a_mode_is_counted_as_phi_of_its_pose(axis: str):
    """Whatever the sense of the file's axes."""
    text = hrsynth.list_robots()["3rrr_m1"].read_text(encoding="utf-8")
    assert '<axis xyz="0 0 1"/>' in text
    found = aspects(native.parse(text.replace('<axis xyz="0 0 1"/>', f'<axis xyz="{axis}"/>')))
    places = [at for at in found.places if at is not None]
    made = recognise_three_cranks(found.aspects, places)
    assert not isinstance(made, str)
    turns = [at.pose(found.aspects.setup.mechanism.platform)[:3, 0] for at in places]
    phi = [np.arctan2(turn[1], turn[0]) for turn in turns]
    assert len(phi) == 2
    assert abs(phi[1] - phi[0]) > 0.1
    assert [place.turn for place in made[1]] == pytest.approx([each - phi[0] for each in phi], abs=1e-9)


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("name", "observe", "reason"),
    [
        ("quattro", "1,4", "plane"),
        ("3prr_m1", None, "cranks"),
        ("3rpr_m1", None, "cranks"),
        ("rrrrr_m1", None, "plane"),
        ("3rrr_m1", "prox_1,prox_2,prox_3", "rod"),
        ("3rrr_m1", "1,2,prox_3", "rod"),
    ],
)
def test_other_robots_have_no_such_section(name: str, observe: str | None, reason: str):
    found = aspects(hrsynth.load(name), observe)
    made = found.section
    assert isinstance(made, str)
    assert reason in made
    at: list[ClosedConfiguration] = [found.listed.goal]
    assert recognise_three_cranks(found.aspects, at) == made


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [1, 6, 9, 10])
def test_cusps_of_random_cranks_come_in_pairs_and_are_cusps(seed: int):
    """Any lengths, no robot: the number of cusps on closed pieces is even; where cranks of legs are in one line the
    equations vanish without a cusp, which is not told as one."""
    rng = np.random.default_rng(seed)
    feet, corners = (size * (rng.normal(size=3) + 1j * rng.normal(size=3)) for size in (1.0, 0.7))
    robot = ThreeCranks(("1", "2", "3"), feet, rng.uniform(0.3, 1.5, 3), rng.uniform(0.3, 1.5, 3), corners - corners[0])
    found = compute_singularity_slice(robot, np.exp(1j * rng.uniform(0, 6)))
    assert len(found.cusps) % 2 == 0
    for cusp in found.cusps:
        value, first, second, third = derivatives(misses(found, cusp))
        assert max(abs(value), abs(first), abs(second)) < 1e-3 * max(1.0, abs(third))
        assert abs(third) > 1e-4
