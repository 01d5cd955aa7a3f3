"""Poses turned by exactly half a turn: each answer is about that pose, or says that it is not reached.

The sines of all small-angle formulas vanish there as they do where nothing is turned.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import numpy as np
import pytest

from hrsynth.analysis import check as checks
from hrsynth.analysis.accuracy import accuracy as accuracies
from hrsynth.analysis.accuracy.measurement_bounds import MeasurementBounds
from hrsynth.analysis.aspects.path import PathPlanner
from hrsynth.analysis.modes.modes import modes
from hrsynth.analysis.observed import ObservedRobot, build_motor_model
from hrsynth.analysis.singularity.condition_check import compute_smallest_value
from hrsynth.analysis.singularity.locus import compute_locus
from hrsynth.batch.iterative_leg import IterativeLeg
from hrsynth.batch.pose_continuation import track_to_pose
from hrsynth.description import load
from hrsynth.errors import BadRequest, NoReachablePose, PoseReachFailure
from hrsynth.geometry.vectors import Array, convert_rpy_to_rotation
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.continuation import track
from hrsynth.kinematics.tasks import PoseAndValuesTask
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.legs import Leg
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.observations.encoder import AngleEncoder
from hrsynth.mechanism.pose import Grid, Pose
from hrsynth.selection import select as selections
from hrsynth.simulation.servo import servo
from kinematics.robots import state_of
from oracle import Oracle
from strategies import planar, pods, random_direction, random_rotation, transformed

NEAR = 1e-8


def tilted(name: str) -> Mechanism:
    rng = np.random.default_rng(3)
    return transformed(load(name), random_rotation(rng), rng.normal(scale=0.3, size=3))


ROBOTS: dict[str, tuple[Callable[[], Mechanism], str | None, int]] = {
    "gough_stewart": (partial(load, "gough_stewart"), "1,3,5", 250),
    "gough_stewart, tilted": (partial(tilted, "gough_stewart"), "1,3,5", 200),
    "pod": (lambda: pods(["SPS"] * 6, np.random.default_rng(0)), "1,3,5", 100),
    "hexaglide": (partial(load, "hexaglide"), "1,3,5", 100),
    "quattro": (partial(load, "quattro"), "1,4", 100),
    "3rpr_m1": (partial(load, "3rpr_m1"), None, 100),
    "3rpr_m1, tilted": (partial(tilted, "3rpr_m1"), None, 50),
    "planar": (lambda: planar(["RPR"] * 3, np.random.default_rng(1), [{1}] * 3), None, 50),
    "3rrr_m1": (partial(load, "3rrr_m1"), None, 50),
}
"""Robots, what is watched, and how many of the thousand poses each has."""
sampled = cache(partial(ObservedRobot.of, samples=3))
"""Robots are sampled once, not again at each question."""


@dataclass(frozen=True, eq=False)
class Case:
    """A robot, what is watched, and its setting."""

    robot: Mechanism
    observe: str | None

    @property
    def setting(self) -> ObservedRobot:
        return sampled(self.robot, self.observe)

    @cached_property
    def aspects(self) -> PathPlanner:
        return PathPlanner.of(self.setting)


@cache
def case_of(name: str) -> Case:
    return Case(ROBOTS[name][0](), ROBOTS[name][1])


def half_turn(axis: Array) -> Array:
    """The rotation by exactly π about a unit vector."""
    return 2 * np.outer(axis, axis) - np.eye(3)


def wanted_poses(setup: ObservedRobot, count: int, seed: int) -> Iterator[tuple[Array, Pose]]:
    """Poses (4, 4) near home turned by half a turn about random axes, at first the coordinate axes; as matrices and
    as a user writes them."""
    rng, motion = np.random.default_rng(seed), setup.motion
    for number in range(count):
        axis = np.eye(3)[number] if number < 3 and not seed else random_direction(rng)
        if motion.rotations.shape[1] == 1:
            axis = motion.rotations[:, 0]
        along = motion.translations
        shift = 0.1 * setup.all_samples.model.length * along @ rng.uniform(-1, 1, along.shape[1])
        X = motion.home.copy()
        X[:3, :3] = half_turn(axis) @ X[:3, :3]
        X[:3, 3] = motion.position(motion.home) + shift - X[:3, :3] @ motion.point
        pose = motion.pose(X)
        assert rotation(pose) == pytest.approx(X[:3, :3], abs=1e-12)
        yield X, pose


def rotation(pose: Pose) -> Array:
    assert pose.rpy is not None
    return convert_rpy_to_rotation(*pose.rpy)


def assert_there(setup: ObservedRobot, at: ClosedConfiguration, X: Array) -> None:
    """By the poses of all links: the platform is at X, all loops are closed."""
    assert np.abs(at.pose(setup.motion.link) - X).max() < NEAR
    assert Oracle(at.model.mechanism).error(state_of(at.model, at.q)) < NEAR


Answer = Sequence[ClosedConfiguration]


def reached(case: Case, pose: Pose) -> Answer:
    all_samples = case.setting.all_samples
    return [track_to_pose(all_samples.start, all_samples.observation_model, pose, case.setting.motion)]


def led_whole(case: Case, pose: Pose) -> Answer:
    """Led to the whole pose, as trajectories are."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = pose.rotation, [pose.x, pose.y, pose.z]
    at, came = track(case.setting.all_samples.start, case.setting.motion, case.setting.motion.whole(X))
    if came < 1:
        raise PoseReachFailure(case.robot.name, str(pose), came, "")
    return [at]


def checked(case: Case, pose: Pose) -> Answer:
    return [posture.configuration for posture in checks.check(case.robot, case.observe, at=[pose]).postures]


def beside(case: Case, pose: Pose) -> Grid:
    """The grid of the pose and another beside it."""
    part = case.setting.motion.parts[0]
    start = getattr(pose, part)
    ends = np.array([start, start + 0.01 * case.setting.all_samples.model.length])
    return Grid(((part, ends),), replace(pose, **{part: None}))


def swept(case: Case, pose: Pose) -> Answer:
    """A grid of two poses, the first the wanted one."""
    grid = beside(case, pose)
    cells = checks.check(case.robot, case.observe, grid=grid).grid
    assert cells is not None
    if cells.postures[0] is None:
        raise NoReachablePose(case.robot.name, str(grid), "")
    return [cells.postures[0].configuration]


def moded(case: Case, pose: Pose) -> Answer:
    found = modes(case.setting, at=pose)
    assert found.found.continuous_family or sum(mode.goal for mode in found.modes) == 1
    return [found.goal, *(mode.configuration for mode in found.modes if mode.goal and mode.configuration is not None)]


def pathed(case: Case, pose: Pose) -> Answer:
    (at,) = reached(case, pose)
    answer = case.aspects.join(case.setting.all_samples.start, at, budget=20)
    assert answer.poses[-1] == answer.goal.pose
    return [answer.goal.configuration]


def exact(case: Case, pose: Pose) -> Answer:
    (error,) = accuracies.accuracy(case.robot, case.observe, cone=1e-3, at=[pose]).poses
    assert rotation(error.pose) == pytest.approx(rotation(pose), abs=NEAR)
    return reached(case, pose)


def mapped(case: Case, pose: Pose) -> Answer:
    """A grid of two poses: the error at the first is that of the single pose."""
    grid, at = beside(case, pose), reached(case, pose)
    field = accuracies.accuracy(case.robot, case.observe, cone=1e-3, grid=grid).field
    assert field is not None
    if field.reached[0]:
        single = accuracies.compute_errors_at(
            case.setting, MeasurementBounds(np.full(len(case.setting.observed), 1e-3)), at[0]
        )
        assert field.position[0] == pytest.approx(single.position.largest, rel=1e-2)
    return at


def located(case: Case, pose: Pose) -> Answer:
    """Over a plane of poses turned alike: the nearest cell's distance from a singularity is that of its pose."""
    plane = Pose(z=pose.z if case.setting.motion.translations.shape[1] == 3 else None, rpy=pose.rpy)
    found = compute_locus(case.setting, plane=plane, steps=5)
    cell = np.unravel_index(np.nanargmax(found.hidden.type2), found.grid.shape)
    (there,) = found.grid.poses_at([tuple(map(int, cell))])
    assert there.rpy == plane.rpy
    (at,) = reached(case, there)
    assert found.hidden.type2[cell] == pytest.approx(
        compute_smallest_value(at, case.setting.samples.observation_model), rel=1e-6
    )
    return reached(case, pose)


def served(case: Case, pose: Pose) -> Answer:
    """A run is told to have ended at the goal only at the goal."""
    found = servo(case.robot, case.observe, start=Pose(), goal=pose, time=0.3)
    if found.outcome == "goal":
        assert_there(case.setting, found.settled, found.target.pose(case.setting.motion.link))
    else:
        assert found.from_goal[1] > 1e-6
    return [found.target]


def selected(case: Case, pose: Pose) -> Answer:
    found = selections.select(case.robot, start=Pose(), goal=pose, size=1, runs=0)
    assert rotation(found.goal) == pytest.approx(rotation(pose), abs=NEAR)
    return reached(case, pose)


COMMANDS = {
    each.__name__: each for each in (reached, led_whole, checked, swept, moded, pathed, exact, mapped, served, selected)
}
SLOW = {"located": located}


def answers(robot: str, command: str, count: int, seed: int) -> Counter[str]:
    """How many poses were answered and how many refused; each answer is about the pose that was wanted."""
    case, told = case_of(robot), Counter[str]()
    for X, pose in wanted_poses(case.setting, count, seed):
        try:
            found = (COMMANDS | SLOW)[command](case, pose)
        except (PoseReachFailure, NoReachablePose, BadRequest) as error:
            told[type(error).__name__] += len(error.lines())
            continue
        for at in found:
            assert_there(case.setting, at, X)
        told["answered"] += 1
    return told


def test_a_motor_at_half_a_turn_is_held_from_either_side() -> None:
    """Its angle is π and −π there; the way to it is as short from both sides."""
    case = case_of("3rrr_m1")
    setup, model = case.setting, case.setting.all_samples.model
    (encoder, *_) = build_motor_model(setup).observations
    assert isinstance(encoder, AngleEncoder)
    bare = PoseAndValuesTask(setup.motion.link, np.eye(4), np.zeros(3), setup.mechanism.reference, ())
    (crank,) = model.coordinates[encoder.joint]
    for angle in (np.pi, -np.pi):
        for side in (1e-2, -1e-2):
            q = model.q0.copy()
            q[model.model.joints[model.model.getJointId(encoder.joint)].idx_q] = angle + side
            error, rows = replace(bare, measured=((encoder, np.array([angle])),)).error_and_jacobian(model, q)
            assert error[-1] == pytest.approx(side, abs=1e-12)
            assert rows[-1, crank] == pytest.approx(1)


def test_a_link_that_has_turned_over_does_not_close_its_leg() -> None:
    """A rod that a C and a planar joint hold on the crank: half a turn of the C leaves the plane where it is, but for
    its sense."""
    b = Builder("turned")
    for name in ("base", "crank", "rod", "plate"):
        b.link(name)
    b.joint("foot", "R", "base", "crank", (0, 0, 0), axis=(0, 0, 1), motor=True)
    b.joint("guide", "C", "crank", "rod", (1, 0, 0), axis=(1, 0, 0))
    b.joint("table", "E", "crank", "rod", (2, 0, 0), axis=(0, 0, 1))
    b.joint("ball", "S", "rod", "plate", (3, 0, 0))
    mechanism = b.build("plate")
    leg = Leg("1", ("crank", "rod"), ("foot", "guide", "table", "ball"), "plate")
    chain = IterativeLeg.of(mechanism, leg, Direction("1", "rod", np.array([1.0, 0.0, 0.0])), None)
    q, ends = chain.start(1), np.eye(4)[None]
    assert chain.close(q, ends, 1)[1] == pytest.approx([0], abs=1e-12)
    q[0, chain.system.names.index("guide.2")] = np.pi
    ends[0, :3, :3] = chain.frames(["plate"], q)["plate"][0, :3, :3]
    assert chain.close(q, ends, 1)[1] == [np.inf]


@pytest.fixture(autouse=True)
def prepared_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def prepared(
        robot: Mechanism | ObservedRobot, observe: str | None = None, *_: object, **__: object
    ) -> ObservedRobot:
        return robot if isinstance(robot, ObservedRobot) else sampled(robot, observe)

    monkeypatch.setattr(ObservedRobot, "of", prepared)


QUICK = ("reached", "led_whole", "checked", "swept", "moded")


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("robot", "command"),
    [
        *(("3rpr_m1, tilted", command) for command in COMMANDS),
        *(("gough_stewart", command) for command in QUICK),
        *(
            pytest.param("gough_stewart", command, marks=pytest.mark.slow)
            for command in COMMANDS
            if command not in QUICK
        ),
    ],
)
def test_an_answer_is_about_the_pose_that_was_wanted(robot: str, command: str) -> None:
    assert answers(robot, command, 3, 0)["answered"] == 3


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["3rpr_m1, tilted", "gough_stewart"])
def test_a_map_is_of_the_poses_that_were_wanted(robot: str) -> None:
    assert answers(robot, "located", 2, 0)["answered"] == 2


@pytest.mark.slow
def test_a_pose_out_of_reach_is_refused() -> None:
    assert answers("3rrr_m1", "reached", 3, 0) == {"PoseReachFailure": 3}


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_thousand_poses(robot: str, command: str) -> None:
    told = answers(robot, command, ROBOTS[robot][2], 1)
    print(robot, command, dict(told))
    assert sum(told.values()) == ROBOTS[robot][2]
