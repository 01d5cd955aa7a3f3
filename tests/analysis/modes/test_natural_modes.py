"""Lists of modes in natural coordinates: those of the other ways, and robots that no other way lists."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from adversary.kinds import KINDS
from analysis.modes.ankles import ankle
from analysis.modes.closings import closings
from analysis.modes.test_planar_loops import LINKS, STEPHENSON, linkage
from analysis.modes.test_sighted import ROBOTS as SEEN
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.analysis.modes.natural_modes import NaturalPlatform, solve_natural
from hrsynth.analysis.modes.tip_systems import Model
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.errors import ExternalSolverFailure, UnsupportedLocus
from hrsynth.geometry.vectors import Array, compare_poses
from hrsynth.kinematics.goal_error import drift
from hrsynth.mechanism import Coupling, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.solving.platform.solve import SystemModes
from kinematics.robots import ROBOTS
from strategies import planar, pods

SAME = 1e-6
"""Difference up to which two poses are one."""
TOO_LARGE = {"3rps", "6pus", "gough_stewart", "hexa", "hexaglide"}
"""Shipped robots whose real modes are not confined: six unknowns with 16 to 40 solutions."""
FAMILIES = {"3ppr_m1", "3ppr_m2", "3prp", "3rrp", "hexaglide", "i4l", "prrrp_parallel", "uranesx"}
"""Shipped robots whose hidden modes are families."""


def solve(robot: Mechanism, real: bool) -> tuple[Model, SystemModes]:
    """The list in natural coordinates."""
    setup = ObservedRobot.of(robot, driven=real)
    goal = setup.all_samples.start
    measured, error = MeasuredRobot.of(setup, real), drift(goal, None, setup.normal.moved)
    try:
        return solve_natural(measured, goal, error)
    except ExternalSolverFailure as unsolved:
        try:
            return solve_natural(measured, goal, error, keeps=True)
        except UnsupportedLocus:
            raise unsolved from None


def poses_of(made: Model, found: SystemModes) -> list[Array]:
    """Poses (4, 4) of the first link on which legs end."""
    return [next(iter(made.bodies(mode.q).values())) for mode in found.modes]


def compare(robot: Mechanism, real: bool) -> None:
    """Check that both lists have the same poses and as many complex ones. Poses that the robot is not assembled at are
    in the other lists alone, poses of other operation modes in this one alone."""
    listed, (made, found) = hrsynth.modes(robot, real=real, cone=0), solve(robot, real)
    assert found.complete
    assert listed.found.complete
    body, length = next(iter(made.bodies(made.home))), listed.goal.model.length
    own, others = poses_of(made, found), [(mode, mode.bodies[body]) for mode in listed.modes if mode.bodies]
    for mode, X in others:
        near = min(compare_poses(X, each, length) for each in own) < SAME
        assert near == (mode.reachable is not False and mode.configuration is not None)
    for X in own:
        turned = np.abs(X[:3, :3] - listed.goal.pose(body)[:3, :3]).max() > 1.0
        assert turned or min(compare_poses(X, each, length) for _, each in others) < SAME
    if len(own) == len(others):
        assert found.complex == listed.found.complex


@pytest.mark.some(3)
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("name", [name for name in ROBOTS if not name.endswith("point")])
def test_shipped_robots_have_the_same_lists(name: str, real: bool):
    if name in (TOO_LARGE if real else FAMILIES):
        with pytest.raises(ExternalSolverFailure, match="not confined" if real else "not isolated"):
            solve(hrsynth.load(name), real)
    else:
        compare(hrsynth.load(name), real)


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", range(4))
def test_random_robots_have_the_same_lists(seed: int):
    rng = np.random.default_rng(seed)
    for words in (("RRR", "RRR", "RRR"), ("RPR", "RRR", "PRR"), ("PRR", "PRR", "RPR")):
        robot = planar(words, rng, [(0,)] * 3)
        compare(robot, real=False)
        compare(robot, real=True)
        assert solve(robot, real=True)[1].enclosed
    compare(pods(("UPS",) * 6, rng), real=False)
    for kind in ("SPU", "RSU", "RUS"):
        compare(ankle(kind, seed, offset=0.05)[0], real=True)


@pytest.mark.parametrize(
    ("motor", "platform", "count"), [("j0", "coupler", 2), ("j6", "coupler", 6), ("j3", "coupler", 2), ("j0", "c", 4)]
)
def test_six_bars_of_two_loops(motor: str, platform: str, count: int):
    """Stephenson's: a coupler curve meets a circle in six."""
    assert solve(linkage(STEPHENSON, LINKS, platform, motor), real=True)[1].complex == count


def draw(kind: str, seed: int, folder: Path) -> Mechanism:
    """A robot of one of the adversary's kinds, as it is read from a file."""
    path = folder / f"{kind}.urdf"
    path.write_text(KINDS[kind](np.random.default_rng(seed)).text(), encoding="utf-8")
    return hrsynth.load(path)


def count_others(listed: AssemblyModes, starts: int) -> int:
    """The number of random closings; none ends at a pose of the platform that is not listed."""
    found, link = closings(listed, starts), listed.setup.motion.link
    for at in found:
        apart = [compare_poses(at.pose(link), m.bodies[link], at.model.length) for m in listed.modes if m.bodies]
        assert min(apart) < SAME
    return len(found)


@pytest.mark.some(2, 4)
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 6, 7])
def test_four_ruu_robots_have_one_mode(seed: int, tmp_path: Path):
    """Upright and tilted, of random dimensions: found by no other way."""
    listed = hrsynth.modes(draw("schoenflies", seed, tmp_path), cone=0)
    assert (listed.found.complete, listed.found.bound, len(listed.modes)) == (True, "combinations", 1)
    assert listed.modes[0].goal
    assert listed.within == "poses in space"
    assert count_others(listed, 60) > 0


@pytest.mark.slow
def test_directions_that_no_sample_turns_are_kept():
    """A robot that translates in its operation mode; in others too many solutions are left."""
    setup = ObservedRobot.of(hrsynth.load("quattro"), driven=True)
    measured, goal = MeasuredRobot.of(setup, real=True), setup.all_samples.start
    with pytest.raises(ExternalSolverFailure):
        solve_natural(measured, goal)
    made, found = solve_natural(measured, goal, keeps=True)
    assert (found.complete, found.complex, len(found.modes)) == (True, 4, 4)
    assert isinstance(made.system, NaturalPlatform)
    assert made.system.kept


@pytest.mark.some(2)
@pytest.mark.parametrize("name", ["seen from the base", "cameras on both", "beside legs, from the platform", "an arm"])
def test_what_cameras_and_sensors_measure_is_held(name: str):
    """Points, distances, cameras on the platform: all poses of the other lists, antipodal ones too."""
    setup = SEEN[name]()
    listed = hrsynth.modes(setup, at=setup.configurations[0], cone=0)
    made, found = solve_natural(MeasuredRobot.of(setup), listed.goal, drift(listed.goal))
    assert listed.found.complete
    body, own = next(iter(made.bodies(made.home))), poses_of(made, found)
    others = [mode.bodies[body] for mode in (*listed.modes, *listed.antipodal) if mode.bodies]
    for X in others:
        assert min(compare_poses(X, each, listed.goal.model.length) for each in own) < SAME
    assert len(own) == len(others) or listed.within == "poses with the rotation of this one"


def test_what_is_not_known_is_refused():
    """A goal that is not exact, a family."""
    setup = ObservedRobot.of("3rrr_m1")
    with pytest.raises(UnsupportedLocus, match="is not bounded"):
        solve_natural(MeasuredRobot.of(setup), setup.all_samples.start, np.inf)
    with pytest.raises(ExternalSolverFailure, match="the goal is not isolated"):
        solve(hrsynth.load("3prp"), real=False)


def test_an_uncertain_goal_gives_wider_boxes_or_none():
    """Radii grow with the goal's error, and what is not proved then is refused."""
    setup = ObservedRobot.of("3rrr_m1")
    goal, measured = setup.all_samples.start, MeasuredRobot.of(setup)
    radii = [max(mode.radius for mode in solve_natural(measured, goal, error)[1].modes) for error in (0.0, 1e-9)]
    assert 10 * radii[0] < radii[1] < 1e-4
    with pytest.raises(ExternalSolverFailure):
        solve_natural(measured, goal, 1e-2)


def test_the_answer_says_what_was_proved(tmp_path: Path):
    text = str(hrsynth.modes(draw("schoenflies", 0, tmp_path), cone=0))
    assert "1 real of 1 complex, proved to be all among poses in space" in " ".join(text.split())
    assert "coordinates of points and directions" in text
    assert "a mode by construction, pose not proved, known to" in text


@pytest.mark.parametrize(
    ("name", "ways"), [("3rps", ["loci of tips"]), ("3prp", ["loci of tips", "conditions on the pose"])]
)
def test_ways_are_recorded_until_one_lists_all(name: str, ways: list[str]):
    listed = hrsynth.modes(name, real=True, cone=0)
    assert [(way.way, way.outcome == "all modes") for way in listed.ways] == [(way, way == ways[-1]) for way in ways]
    assert [way["way"] for way in json.loads(hrsynth.to_json(listed))["ways"]] == ways


def test_a_search_is_the_last_way(tmp_path: Path):
    """Where time is short, each way says why it gives no list."""
    listed = hrsynth.modes(draw("schoenflies", 0, tmp_path), cone=0, time_limit=0.01)
    assert [way.way for way in listed.ways][-2:] == [
        "natural coordinates, directions kept",
        "random starts of the whole robot",
    ]
    assert not listed.found.complete


def build_planar(joints: dict[str, tuple[str, str, str, tuple[float, float]]], platform: str, motors: str) -> Mechanism:
    """A mechanism of joints R and of slides along the normal (Z), the first that close no loop in its tree."""
    b, known = Builder("planar"), {"base"}
    b.link("base")
    for name, (kind, first, second, at) in joints.items():
        closes = second in known
        if not closes:
            b.link(second, at=(*at, 0))
            known.add(second)
        letter, axis = {"Z": ("P", (0, 0, 1)), "X": ("P", (1, 0, 0)), "Y": ("P", (0, 1, 0))}.get(
            kind, (kind, (0, 0, 1))
        )
        b.joint(name, letter, first, second, at=(*at, 0), axis=axis, motor=name in motors, loop=closes)
    return b.build(platform=platform)


FIVE_BAR = {
    "a": ("R", "base", "A1", (0.0, 0.0)),
    "b": ("R", "A1", "A2", (0.0, 0.5)),
    "c": ("R", "base", "B1", (1.0, 0.0)),
    "d": ("R", "B1", "B2", (1.2, 0.6)),
    "t": ("R", "A2", "plate", (0.5, 1.0)),
    "s": ("R", "B2", "plate", (0.5, 1.0)),
}


def test_a_leg_that_ends_beside_a_point_leaves_the_modes_found():
    """A third leg that restricts nothing ends on another link, which turns."""
    more = {
        "k": ("R", "base", "C1", (0.5, -0.3)),
        "l": ("R", "C1", "C2", (0.45, 0.3)),
        "n": ("R", "C2", "A2", (0.35, 0.7)),
    }
    plain, led = (hrsynth.modes(build_planar(j, "plate", "ac"), real=True, cone=0) for j in (FIVE_BAR, FIVE_BAR | more))
    assert (len(plain.modes), plain.found.complete, len(led.modes), led.found.complete) == (2, True, 2, False)


def test_a_list_with_a_parallelogram_says_that_it_is_not_crossed():
    """Crossed, it leaves the platform's rotation to a joint behind it: such poses are no part of the list."""
    robot = build_planar(
        {
            "x": ("X", "base", "p1", (0.3, 0.2)),
            "y": ("Y", "p1", "p2", (0.3, 0.2)),
            "z": ("Z", "p2", "plate", (0.3, 0.6)),
            "v": ("Z", "base", "car", (0.1, 0.3)),
            "b": ("R", "car", "s1", (0.1, 0.3)),
            "c": ("R", "car", "s2", (0.45, 0.35)),
            "d": ("R", "s1", "bar", (0.2, 0.75)),
            "e": ("R", "s2", "bar", (0.55, 0.8)),
            "f": ("R", "bar", "plate", (0.3, 0.6)),
        },
        "plate",
        "xv",
    )
    listed = hrsynth.modes(robot, real=True, cone=0)
    assert listed.found.complete
    assert str(listed.within).endswith("parallelograms not crossed")
    assert "parallelograms not crossed" in hrsynth.verify(hrsynth.certificate(listed), robot)
    poses = [at.pose("plate") for at in closings(listed, 60)]
    kept = [X for X in poses if np.abs(X - listed.goal.pose("plate"))[:3, :3].max() < SAME]
    assert max(min(compare_poses(X, m.bodies["plate"], 1.0) for m in listed.modes if m.bodies) for X in kept) > 0.01


def test_chains_of_gears_may_be_listed_at_turns_that_do_not_close():
    """z_a² = z_e and z_e = z_x² allow half a turn of x beside the couplings: it is listed, and not assembled."""
    joints = {name: FIVE_BAR[name] for name in "abcd"} | {
        "s": ("R", "B2", "A2", (0.6, 1.1)),
        "x": ("R", "base", "X", (2.0, 0.0)),
    }
    robot = build_planar(joints, "A2", "a")
    robot = robot.changed(couplings=(Coupling("g", "a", "c", 2.0), Coupling("h", "c", "x", 0.5)))
    listed = hrsynth.modes(robot, sensor="direction:A2/0,1,0", cone=0)
    assert listed.modes[0].goal
