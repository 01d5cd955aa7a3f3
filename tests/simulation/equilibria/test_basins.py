"""Where many runs end: the law abreast is the law, and what runs abreast end at is what single runs end at."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from scipy.integrate import solve_ivp

import hrsynth
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.errors import BadRequest, NoReachablePose
from hrsynth.geometry.screws import compute_point_velocity
from hrsynth.geometry.vectors import convert_rpy_to_rotation
from hrsynth.mechanism.pose import parse_pose
from hrsynth.present.basins import (
    EQUILIBRIUM_LABEL_POINTS_COUNT,
    MARKS,
    SHADES,
    choose_basin_colours,
    draw_basins,
    place_letters,
)
from hrsynth.present.figure_format import PNG
from hrsynth.present.outputs import OUTPUTS
from hrsynth.present.runs import ENDS
from hrsynth.simulation.equilibria import basins as module
from hrsynth.simulation.equilibria.batched_runs import BatchedRuns, Runs
from hrsynth.simulation.equilibria.flow import Flow
from hrsynth.simulation.law import CONTROLLER_DAMPING_MIN, directions
from hrsynth.simulation.outcome import ENDINGS, RunOutcome
from hrsynth.simulation.servo import ServoTask
from strategies import transformed

HORIZON = 60.0


@cache
def task(name: str, legs: str | None = None, to: str | None = None) -> tuple[ServoTask, Flow]:
    setup = ObservedRobot.of(name, legs)
    goal = setup.all_samples.start if to is None else solve_configurations(setup, [parse_pose(to)])[0]
    made = ServoTask.between(setup, goal, goal)
    return made, Flow(setup.placer, tuple(setup.labels), made.directions)


def poses(flow: Flow, count: int, seed: int, wide: float) -> np.ndarray:
    """Random poses that are reached, about home."""
    y = np.random.default_rng(seed).uniform(-wide, wide, (20 * count, flow.batch.span.shape[1]))
    X = flow.move(np.repeat(flow.batch.home[None], len(y), axis=0), y)
    return X[flow.batch.reaches(X)][:count]


def runs(flow: Flow, X: np.ndarray) -> Runs:
    return BatchedRuns(flow, X, 20 * flow.batch.length).run(HORIZON)


def none(flow: Flow, n: int) -> np.ndarray:
    return np.zeros((n, len(flow.legs)), dtype=bool)


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("name", "legs", "singular"),
    [
        ("quattro", "1,4", [-0.1757, -0.1931, -0.6481, 0.262]),
        ("3rpr_m1", None, None),
        ("gough_stewart", "1,3,5", None),
        ("delta", "1,2", None),
        ("hexa", None, None),
    ],
)
def test_the_law_abreast_is_the_law(name: str, legs: str | None, singular: list[float] | None):
    made, flow = task(name, legs)
    X = poses(flow, 6, 1, 0.4)
    if singular is not None:
        c, s = np.cos(singular[3]), np.sin(singular[3])
        near = flow.batch.home.copy()
        near[:3, 3], near[:2, :2] = singular[:3], [[c, -s], [s, c]]
        X = np.concatenate([X, near[None]])
    found = flow.at(X, none(flow, len(X)), none(flow, len(X)), flow.roots(X, none(flow, len(X)))[0])
    assert singular is None or found.weakest[-1] < CONTROLLER_DAMPING_MIN / 10
    motion, length = made.setup.motion, flow.batch.length
    for pose, at, velocity, size in zip(
        X, flow.configurations(X, none(flow, len(X))), found.velocity, found.size, strict=True
    ):
        assert at is not None
        command = made.law.at(at, made.desired(0.0))
        twists = at.velocity(motion.link) @ command.velocity / made.law.gain
        there = compute_point_velocity(twists[:, None], pose[:3, :3] @ motion.point / length)[:, 0] * length
        expected = np.concatenate([there, twists[3:]]) if motion.body else there
        ours = flow.batch.span @ velocity
        np.testing.assert_allclose(ours[: len(expected)], expected, atol=1e-6 * max(1.0, np.abs(expected).max()))
        assert size == pytest.approx(command.size, abs=1e-9)


@pytest.mark.parametrize(("name", "legs"), [("quattro", "1,4"), ("3rrr_m1", None)])
def test_nothing_is_commanded_where_a_leg_does_not_reach(name: str, legs: str | None):
    _, flow = task(name, legs)
    far = flow.batch.home.copy()
    far[:3, 3] += 50 * flow.batch.length
    X = np.stack([flow.batch.home, far])
    found = flow.at(X, none(flow, 2), none(flow, 2), flow.roots(np.stack([flow.batch.home] * 2), none(flow, 2))[0])
    assert found.reached.tolist() == [True, False]
    for each in (found.velocity, found.size, found.weakest, found.u):
        assert np.isfinite(each[0]).all()
        assert np.isnan(each[1]).all()
    assert np.array_equal(found.moves, [found.velocity[0], np.zeros_like(found.velocity[1])])


def ends_agree(name: str, legs: str | None, X: np.ndarray, to: str | None = None) -> int:
    """Hold runs abreast against single ones; how many."""
    made, flow = task(name, legs, to)
    found = runs(flow, X)
    link, count = made.setup.motion.link, 0
    for i, at in enumerate(flow.configurations(X, none(flow, len(X)))):
        single = ServoTask.between(made.setup, at, made.goal).loop().simulate(at, made.conditions.horizon)
        assert single.stopped == found.stopped[i] or {single.stopped, found.stopped[i]} <= {"poised", "rest"}
        np.testing.assert_allclose(single.last.pose(link), found.X[i], atol=1e-4)
        count += 1
    return count


@pytest.mark.slow
def test_runs_abreast_end_where_single_runs_end():
    assert ends_agree("3rrr_m1", None, poses(task("3rrr_m1")[1], 2, 2, 1.0)) == 2


@pytest.mark.some(0, 3)
@pytest.mark.parametrize(
    ("name", "legs"),
    [
        ("3prr_m1", None),
        ("3puu", None),
        ("3rpr_m2", None),
        ("3ruu", None),
        ("3upu", None),
        ("6pus", None),
        ("delta", None),
        ("delta", "1,2"),
        ("gough_stewart", "1,3,5"),
        ("linear_delta", None),
        ("orthoglide", None),
        ("quattro", None),
        ("quattro", "1,4"),
        ("quattro", "2,3"),
        ("quattro_rigid", "1,2"),
    ],
)
def test_runs_of_all_robots_abreast_end_where_single_runs_end(name: str, legs: str | None):
    X = poses(task(name, legs)[1], 6, 7, 0.7)
    assert ends_agree(name, legs, X) == len(X) > 2


@pytest.mark.slow
def test_a_leg_is_passed_at_whose_limit_the_law_changes_abruptly():
    legs, to = "2,4,5", "x=0.226256,y=0.0454127,z=-0.583372,rpy=0.850469/-0.102548/-0.554838"
    motion = task("hexa", legs, to)[0].setup.motion
    start = parse_pose("x=0.342403,y=0.0901673,z=-0.353974,rpy=-0.481852/-0.152309/-0.40517")
    X = motion.home.copy()
    X[:3, :3] = convert_rpy_to_rotation(*start.rpy)
    X[:3, 3] = np.array([start.x, start.y, start.z]) - X[:3, :3] @ motion.point
    assert ends_agree("hexa", legs, X[None], to) == 1


def test_a_stretched_leg_that_is_not_watched_holds_the_platform():
    _, found = stretched()
    _, flow = task("quattro", "1,4")
    assert list(found.stopped) == ["rest", "rest"]
    assert found.active.any(axis=1).all()
    assert not found.active[:, flow.seen].any()
    assert (found.size > 0.05).all()


@pytest.mark.slow
def test_single_runs_end_at_the_stretched_leg_too():
    assert ends_agree("quattro", "1,4", stretched()[0]) == 2


def stretched() -> tuple[np.ndarray, Runs]:
    """Two starts whose runs end where legs that are not watched are stretched, and these runs."""
    _, flow = task("quattro", "1,4")
    X = np.repeat(flow.batch.home[None], 2, axis=0)
    X[:, :3, 3] = [[-0.5, -0.35, -0.7], [-0.5, 0.35, -0.7]]
    return X, runs(flow, X)


@pytest.mark.slow
def test_a_watched_leg_passes_its_fixed_point_with_its_direction():
    """A rod through a point turns over there: the direction is kept, the working mode is not."""
    _, flow = task("3rpr_m1")
    X = poses(flow, 60, 5, 1.2)[20:]
    found = runs(flow, X)
    crossed = found.flipped.any(axis=1)
    assert crossed.any()
    assert set(found.stopped[crossed]) <= {"served", "rest", "away"}


@pytest.mark.slow
def test_single_runs_pass_fixed_points_too():
    _, flow = task("3rpr_m1")
    X = poses(flow, 60, 5, 1.2)
    crossed = runs(flow, X).flipped.any(axis=1)
    assert ends_agree("3rpr_m1", None, X[crossed][:4]) > 1


def planar(x: np.ndarray, base: np.ndarray, tips: np.ndarray) -> np.ndarray:
    """The directions (3, 2) of rods from base points to the tips of a platform at x, y, φ."""
    c, s = np.cos(x[2]), np.sin(x[2])
    arms = x[:2] + tips @ np.array([[c, s], [-s, c]]) - base
    return arms / np.linalg.norm(arms, axis=1)[:, None]


@pytest.mark.slow
def test_runs_end_where_plain_integration_of_the_plane_does():
    """The law in three coordinates, e_i = sin ∠(u_i, u_di), by SciPy: no mechanism, no batch."""
    made, flow = task("3rpr_m1")
    setup, model = made.setup, made.goal.model
    mechanism, platform = setup.mechanism, setup.mechanism.platform
    turning = [joint for joint in mechanism.joints.values() if joint.type.name == "REVOLUTE"]
    base = np.array([joint.point[:2] for joint in turning if mechanism.base in joint.links])
    home = made.goal.pose(platform)
    tips = np.array([joint.point[:2] - home[:2, 3] for joint in turning if platform in joint.links])
    assert base.shape == tips.shape == (3, 2)
    start = np.array([*home[:2, 3], 0.0])
    wanted = planar(start, base, tips)
    scale = np.array([model.length, model.length, 1.0])

    def error(x: np.ndarray) -> np.ndarray:
        u = planar(x, base, tips)
        return u[:, 0] * wanted[:, 1] - u[:, 1] * wanted[:, 0]

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        steps = 1e-6 * np.diag(scale)
        L = np.array([(error(x + step) - error(x - step)) / 2e-6 for step in steps]).T
        return -scale * np.linalg.solve(L, error(x))

    X, smooth = poses(flow, 40, 11, 0.8), 0
    found = runs(flow, X)
    for pose, end, weak, flipped in zip(X, found.X, found.weak, found.flipped, strict=True):
        if weak or flipped.any():
            continue  # where the law is damped, or a rod turns over, these three coordinates are not enough
        turn = home[:2, :2].T @ pose[:2, :2]
        begin = [*pose[:2, 3], np.arctan2(turn[1, 0], turn[0, 0])]
        plain = solve_ivp(rate, (0, 30), begin, rtol=1e-7, atol=1e-9).y[:, -1]
        np.testing.assert_allclose(end[:2, 3], plain[:2], atol=1e-6)
        across = home[:2, :2] @ np.array([np.cos(plain[2]), np.sin(plain[2])])
        np.testing.assert_allclose(end[:2, 0], across, atol=1e-6)
        smooth += 1
        if smooth == 8:
            break
    assert smooth == 8


GRID = "x=0:0.3:6,y=0:0.3:7,phi=0"


@cache
def small() -> module.Basins:
    return hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid=GRID, jobs=1)


@pytest.mark.slow
def test_every_start_has_its_end():
    found = small()
    assert found.cells.shape == (6, 7)
    assert sum(each.count for each in found.ends) == found.starts == 42
    assert sum(each.share for each in found.ends) == pytest.approx(1)
    assert found.ends[0].run_outcome.name == "goal"
    assert len(found.ends) > 1
    assert found.checked == found.agreed == 2
    for number, each in enumerate(found.ends):
        assert np.sum(found.cells == number) == each.count


@pytest.fixture(autouse=True)
def few_single_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FLOW_CHECKED", 2)


@pytest.mark.slow
def test_ends_do_not_depend_on_how_the_work_is_shared_out(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "FLOW_PART", 5)
    hrsynth.clear_cache()
    found = hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid=GRID, jobs=1)
    # at a singularity of the law the last digits decide
    firm = ~(found.damped | small().damped)
    assert firm.sum() > 20
    np.testing.assert_array_equal(found.cells[firm], small().cells[firm])
    assert [each.run_outcome.name for each in found.ends] == [each.run_outcome.name for each in small().ends]


@pytest.mark.long
def test_ends_do_not_depend_on_the_number_of_processes(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "FLOW_PART", 20)
    both = [hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid=GRID, jobs=jobs) for jobs in (1, 2)]
    assert both[0].to_dict() == both[1].to_dict()


@pytest.mark.slow
def test_every_start_within_the_certified_radius_ends_at_the_goal():
    found = small()
    assert found.certified is not None
    assert found.certified.length > 0
    goal = found.target.pose(found.setup.motion.link)
    _, flow = task("3rpr_m1")
    flow = Flow(flow.placer, flow.watched, directions(found.target, found.setup.samples.observation_model)[0])
    rng = np.random.default_rng(0)
    y = rng.uniform(-1, 1, (200, 3)) * [found.certified.length / flow.batch.length] * 2 + [0]
    X = flow.move(
        np.repeat(goal[None], 200, axis=0), y * [1, 1, 0] + rng.uniform(-1, 1, (200, 1)) * [0, 0, found.certified.angle]
    )
    X = X[[found.certified.has_start(each) for each in X]]
    assert len(X) > 20
    np.testing.assert_allclose(runs(flow, X).X, np.broadcast_to(goal, X.shape), atol=1e-8)


@pytest.mark.slow
def test_what_is_drawn_as_certified_is_around_the_goal():
    found = hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid="x=-0.1:0.1:5,y=-0.1:0.1:5,phi=0", jobs=1)
    grid, inside = found.region
    x, y = (values for _, values in grid.axes)
    far = np.hypot(*np.meshgrid(x, y, indexing="ij"))
    np.testing.assert_array_equal(inside, far <= found.certified.length)
    goal = found.ends[0].count * 0.05**2
    assert found.covered == pytest.approx(np.pi * found.certified.length**2 / goal, rel=0.05)


@pytest.mark.slow
def test_the_table_has_a_line_a_start():
    content = next(file for file in OUTPUTS["basins"].files).content(small(), ".csv", {})[0]
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert len(rows) == 42
    names = {letter: each.run_outcome.name for letter, each in zip("ABCDEFG", small().ends, strict=False)}
    assert all(names[row["end"]] == row["outcome"] for row in rows)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("grid", ["x=-0.02:0.02:4,y=0.02,phi=0", "x=-0.02:0.02:3,y=0:0.01:2,phi=-0.1:0.1:2"])
def test_lines_and_boxes_are_drawn(grid: str, tmp_path):
    found = hrsynth.basins("3rrr_m1", goal="x=0,y=0,phi=0", grid=grid, jobs=1)
    hrsynth.draw(found, tmp_path / "basins.png")
    assert (tmp_path / "basins.png").read_bytes().startswith(b"\x89PNG")
    assert "100 %" in repr(found)
    assert "goal" in hrsynth.text(found)


@pytest.mark.slow
def test_ends_are_drawn_where_a_robot_stands_aslant_too(tmp_path, monkeypatch: pytest.MonkeyPatch):
    R = convert_rpy_to_rotation(0.5, -0.3, 0.2)
    robot = transformed(hrsynth.load("3rrr_m1"), R, np.array([0.1, 0.2, 0.3]))
    x, y, _ = hrsynth.observe(robot).motion.home[:3, 3]
    grid = f"x={x - 0.01}:{x + 0.01}:2,y={y - 0.01}:{y + 0.01}:2,phi=0"
    found = hrsynth.basins(robot, goal=f"x={x},y={y},phi=0", grid=grid, jobs=1)
    drawn = []
    plot = Axes.plot
    monkeypatch.setattr(Axes, "plot", lambda *given, **style: (drawn.append(given[1:]), plot(*given, **style))[1])
    hrsynth.draw(found, tmp_path / "basins.png")
    assert any(len(given) > 2 and given[2] == MARKS["goal"] and np.size(given[0]) == 1 for given in drawn)


@pytest.mark.slow
def test_other_robots_are_simulated_one_by_one():
    found = hrsynth.basins("rrrrr_m1", goal="x=0.02,y=0.24", grid="x=0:0.02:2,y=0.22:0.24:2", jobs=1)
    assert not found.batched
    assert found.followed == found.starts == 4
    assert [each.run_outcome.name for each in found.ends] == ["goal"]


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        ({"plane": "z=-0.7", "grid": "x=0:0.1:2"}, "cannot be combined with --plane"),
        ({"grid": "x=0:1:400,y=0:1:400"}, "160000"),
        ({"jobs": 0, "grid": "x=0:0.1:2"}, "jobs"),
    ],
)
def test_what_cannot_be_asked_is_refused(asked: dict[str, str], word: str):
    with pytest.raises(BadRequest, match=word):
        hrsynth.basins("quattro", "1,4", goal="z=-0.7", **asked)


def test_every_ending_has_its_colours_and_its_mark():
    assert set(ENDINGS) == set(SHADES) == set(MARKS)


@pytest.mark.slow
@pytest.mark.parametrize("marks", [[(0, 0), (26, 0), (0, 0), (7, 0)], [(0, 0), (18, 0)], [(0, 0), (18, 18), (36, 0)]])
def test_letters_of_ends_that_are_near_each_other_are_apart(marks: list[tuple[float, float]]):
    """A letter is 9 points tall: none is on another one, nor on the mark of another end."""
    places = np.array(marks, dtype=float)
    letters = places + np.array(place_letters(places, EQUILIBRIUM_LABEL_POINTS_COUNT))
    assert np.linalg.norm(letters - places, axis=1) == pytest.approx(EQUILIBRIUM_LABEL_POINTS_COUNT)
    assert min(np.linalg.norm(a - b) for i, a in enumerate(letters) for b in letters[:i]) > 9
    assert min(np.linalg.norm(a - b) for a in letters for b in places) > 9


@pytest.mark.slow
def test_a_servo_run_takes_the_example_of_each_end_and_ends_there():
    """The platform's turn follows from x and y: an example that says another one is refused."""
    found = hrsynth.basins("rrrrr_m1", goal="x=0.02,y=0.15", grid="x=-0.01:0.24:2,y=-0.08:0.1:2", jobs=1)
    assert len(found.ends) > 2
    for each in found.ends:
        run = hrsynth.servo("rrrrr_m1", start=str(each.example), goal="x=0.02,y=0.15")
        assert run.outcome == each.run_outcome.name
        assert str(run.pose) == str(each.pose)
        assert run.start.rpy != (0, 0, 0)


POINTS = ("point:platform@0.1,0,0", "point:platform@-0.1,0.1,0", "point:platform@0,-0.1,0")


def test_a_goal_behind_the_camera_is_told_to_be_the_goal():
    seen = hrsynth.observe("gough_stewart", camera="eye=base@0,0,1.5", sensor=POINTS)
    with pytest.raises(BadRequest, match="camera at the goal"):
        hrsynth.basins(seen, goal="z=0.33", grid="x=0:0.1:2")


def test_why_runs_are_simulated_one_by_one_is_told():
    seen = hrsynth.observe("gough_stewart", camera="eye=base@0,0,-0.6", sensor=POINTS)
    assert module.hindrances(seen) == ("observations of kind point",)
    assert module.hindrances(ObservedRobot.of("rrrrr_m1")) == ("a leg has no closed form",)
    assert module.hindrances(ObservedRobot.of("3rrr_m1")) == ()


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    ("grid", "hollow"),
    [
        ("x=-0.02:0.02:2,y=-0.02:0.02:2,phi=0", False),
        ("x=-0.02:0.02:2,y=-0.02:0.02:2,phi=0.1", True),
        ("x=-0.02:0.02:2,y=0,phi=0.1", True),
    ],
)
def test_hollow_marks_are_in_the_legend_where_there_is_one(grid: str, hollow: bool):
    found = hrsynth.basins("3rrr_m1", goal="x=0,y=0,phi=0", grid=grid, jobs=1)
    drawn = draw_basins(found, replace(PNG, ending=".svg")).decode()
    assert ("hollow: other" in drawn) == hollow


@pytest.mark.slow
def test_the_legend_has_the_marks_that_are_drawn_and_no_others():
    """A mark of an end beyond the map is not drawn; ends of one kind have colours of their own, however many."""
    found = hrsynth.basins("3rrr_m1", goal="x=0,y=0,phi=0", grid="x=-0.02:0.02:2,y=-0.02:0.02:2,phi=0", jobs=1)
    (goal,) = found.ends
    near, far = goal.X.copy(), goal.X.copy()
    near[0, 3] += 0.01
    far[0, 3] += 1.0
    for X, told in ((near, True), (far, False)):
        ends = (
            goal,
            *(replace(goal, run_outcome=RunOutcome("limit reached", "a leg is stretched"), X=X) for _ in range(7)),
        )
        drawn = draw_basins(replace(found, ends=ends), replace(PNG, ending=".svg")).decode()
        assert (f"<!-- {ENDS['limit reached']} -->" in drawn) is told
        assert f"<!-- {ENDS['goal']} -->" in drawn
        shades = np.array([to_rgb(each) for each in choose_basin_colours(ends)])
        apart = np.abs(shades[:, None] - shades).max(axis=2) + np.eye(len(ends))
        assert apart.min() > 0.05
    assert choose_basin_colours(found.ends) == [SHADES["goal"][0]]


def test_starts_out_of_reach_are_refused():
    with pytest.raises(NoReachablePose, match="2 were tried"):
        hrsynth.basins("3rrr_m1", goal="x=0,y=0,phi=0", grid="x=5:6:2,y=0,phi=0")
