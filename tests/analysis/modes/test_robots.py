"""No mode of a whole robot is missing, and none is listed that is none: by random closings, screws and symmetries."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from analysis.modes.closings import asked, bodies_of, compared, distance, motor_places
from hrsynth.analysis.controllability import legs
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.assembly_mode import AssemblyMode
from hrsynth.analysis.modes.condition_modes import solve_posed
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.analysis.modes.natural_modes import solve_natural
from hrsynth.analysis.modes.tip_modes import drop_couplings, solve_tips
from hrsynth.analysis.modes.tip_systems import MODES_TIME_LIMIT_S, Model
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import observe as watched
from hrsynth.description import list_robots, load
from hrsynth.errors import (
    BadRequest,
    ExternalSolverFailure,
    HrsynthError,
    MissingExtra,
    PoseReachFailure,
    TooLarge,
    UnsupportedLocus,
)
from hrsynth.geometry.vectors import Array, build_pose, compare_poses, invert_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.goal_error import drift
from hrsynth.mechanism import Joint, JointType, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Coupling
from hrsynth.mechanism.pose import Pose
from hrsynth.present.show import text
from hrsynth.solving.platform.solve import SystemModes
from kinematics.robots import state_of
from oracle import Oracle
from strategies import PLANAR_WORDS, POD_WORDS, deltas, planar, pods, random_rotation, reordered, transformed

Legs = tuple[str, ...]
FAST = [
    ("3rrr_m1", None, False),
    ("3rps", None, False),
    ("3rpr_m2", None, True),
    ("quattro", ("1", "4"), False),
    ("gough_stewart", ("1", "3", "5"), False),
    ("rrrrr_m1", None, True),
    ("3prp", None, True),
]
FEW, MANY = 40, 100
"""Random starts of a whole robot."""


@cache
def listed(name: str, observe: Legs | None, real: bool, sample: int | None = None) -> AssemblyModes | str:
    """The modes at zero, or at the pose of a sample; what is said where there is no list."""
    try:
        found = modes(load(list_robots()[name]), observe, real=real)
        if sample is not None and found.model is not None:
            at = found.setup.motion.pose(found.setup.configurations[sample].pose(found.setup.motion.link))
            found = modes(load(list_robots()[name]), observe, at=at, real=real)
    except PoseReachFailure as error:
        return str(error)
    return found


def check_completeness(found: AssemblyModes, starts: int, seed: int = 0) -> frozenset[int]:
    """What closes is listed, and no leg is said to be open where it closes; the modes that were met."""
    result = compared(found, starts, seed)
    assert found.found.complete, found.found.proof
    assert result.closed > starts // 4
    assert result.missing == (), f"{len(result.missing)} of {result.closed} closings are no mode"
    assert result.closed_though_open == ()
    return result.met


def check_modes(found: AssemblyModes) -> None:
    """By screws: each reachable mode is closed and has the goal's measurements; exactly one is the goal."""
    mechanism = found.setup.mechanism
    oracle = Oracle(mechanism)
    start = state_of(found.goal.model, found.goal.q)
    assert sum(mode.goal for mode in found.modes) == 1
    for mode in found.modes:
        assert mode.reachable == (not mode.unclosed_legs and not mode.beyond_limits)
        assert mode.reachable or not mode.goal
        assert (mode.configuration is None) == bool(mode.unclosed_legs)
        if mode.configuration is None:
            continue
        at = mode.configuration
        state = np.array([at.pose(link) for link in mechanism.links])
        assert oracle.error(state) < 1e-8
        assert distance(found, mode, at) < 1e-8
        if found.kind == "hidden":
            u, wanted = (oracle.directions(each, asked(found).observations) for each in (state, start))
            assert np.abs(u - wanted).max() < 1e-8
        else:
            places = [
                motor_places(mechanism, {link: c.pose(link) for link in mechanism.links}) for c in (at, found.goal)
            ]
            assert max(np.abs(one - other).max() for one, other in zip(*places, strict=True)) < 1e-8


@pytest.mark.some(3)
@pytest.mark.parametrize(("name", "observe", "real"), FAST)
def test_what_closes_is_listed(name: str, observe: Legs | None, real: bool):
    found = listed(name, observe, real)
    assert not isinstance(found, str), found
    check_modes(found)
    met = check_completeness(found, FEW)
    assert any(found.modes[k].goal for k in met)


@pytest.mark.parametrize("name", ["prrrp_m1", "linear_delta", "3prp"])
def test_slides_that_motors_hold_stay_where_they_are(name: str):
    """Away from zero too: a real robot closes at its modes, or beyond limits."""
    found = listed(name, None, True, 3)
    assert not isinstance(found, str), found
    check_modes(found)
    assert len(found.modes) > 1


@cache
def sets_of(name: str) -> list[Legs | None]:
    """All legs, and three of the smallest sets with the best verdict."""
    return [None, *(tuple(each) for each in legs(load(list_robots()[name])).minimal[:3])]


@pytest.mark.long
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("name", list_robots())
def test_what_closes_is_listed_for_all_robots_and_leg_sets(name: str, real: bool):
    """At a generic pose, and with all legs at the zero configuration, which often is symmetric."""
    for observe in [None] if real else sets_of(name):
        for sample in (3,) if observe else (3, None):
            found = listed(name, observe, real, sample)
            if isinstance(found, str):
                assert real, f"{observe}: {found}"
            elif found.found.continuous_family:
                assert found.modes == ()
                assert f"dimension {found.found.continuous_family}" in str(found.found.singular_solutions)
            else:
                check_modes(found)
                if found.found.complex is None:
                    assert real, f"{observe}: {found.found.proof}"
                else:
                    check_completeness(found, MANY)


def robot_of(kind: str, seed: int) -> tuple[Mechanism, bool]:
    """A random robot in a tilted base, and whether its motors are to be held instead of its directions."""
    rng = np.random.default_rng(seed)
    if kind == "planar":
        words = [PLANAR_WORDS[k] for k in rng.integers(len(PLANAR_WORDS), size=3)]
        return planar(words, rng, [{int(rng.integers(3))} for _ in words]), bool(rng.integers(2))
    if kind == "planar, a point":
        words = [("RRR", "RPR", "PRR", "PPR")[k] for k in rng.integers(4, size=2)]
        return planar(words, rng, [{int(rng.integers(3))} for _ in words], point=True), bool(rng.integers(2))
    if kind == "pod":
        words = ["UPS"] * 6 if seed % 2 else [POD_WORDS[k] for k in rng.integers(len(POD_WORDS), size=3)]
        return pods(words, rng), False
    n = int(rng.integers(2, 5))
    return deltas("RP"[seed % 2] * n, ["2-SS" if seed % 3 else "UU"] * n, rng, seed % 4 != 3), False


KINDS = ("planar", "planar, a point", "pod", "delta")


def check_random(kind: str, seed: int, starts: int) -> str:
    """What became of a random robot: ``listed``, ``continuum`` or ``found``."""
    mechanism, real = robot_of(kind, seed)
    found = modes(mechanism, real=real)
    if found.found.continuous_family:
        return "continuum"
    check_modes(found)
    if found.found.complex is None:
        return "found"
    check_completeness(found, starts)
    return "listed"


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed"), [("planar", 2), ("planar, a point", 1), ("pod", 0), ("delta", 0)])
def test_what_closes_is_listed_for_random_robots(kind: str, seed: int):
    assert check_random(kind, seed, 20) in ("listed", "continuum", "found")


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("kind", KINDS)
def test_what_closes_is_listed_for_many_random_robots(kind: str):
    outcomes = [check_random(kind, seed, 100) for seed in range(100, 115)]
    assert outcomes.count("listed") >= 3


def same_modes(one: AssemblyModes, other: AssemblyModes, X: Array | None = None) -> None:
    """The modes of one, moved by X (4, 4), are those of the other."""
    assert one.found.complex == other.found.complex
    assert one.found.complete == other.found.complete
    assert len(one.modes) == len(other.modes)
    X = np.eye(4) if X is None else X
    for mode in one.modes:
        twins = [
            each
            for each in other.modes
            if all(np.abs(X @ Y - each.bodies[body]).max() < 1e-7 for body, Y in mode.bodies.items())
        ]
        assert len(twins) == 1
        assert (twins[0].goal, twins[0].reachable) == (mode.goal, mode.reachable)
        assert len(twins[0].unclosed_legs) == len(mode.unclosed_legs)


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe", "real"), [FAST[2], FAST[3]])
def test_modes_move_with_the_robot(name: str, observe: Legs | None, real: bool):
    rng = np.random.default_rng(5)
    R, p = random_rotation(rng), rng.normal(size=3)
    found = listed(name, observe, real)
    assert not isinstance(found, str), found
    moved = modes(transformed(load(list_robots()[name]), R, p), observe, real=real)
    same_modes(found, moved, build_pose(p, R))


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe"), [("3rrr_m1", None), ("quattro", ("rod_1a", "rod_4a"))])
def test_the_order_of_legs_and_links_does_not_matter(name: str, observe: Legs | None):
    """Legs are named by their links here: their labels follow the order."""
    found = listed(name, observe, False)
    assert not isinstance(found, str), found
    mechanism = load(list_robots()[name])
    same_modes(found, modes(mechanism, (observe or ("3", "1", "2"))[::-1]))
    same_modes(found, modes(reordered(mechanism, np.random.default_rng(2)), observe))


@pytest.mark.parametrize(
    ("name", "observe"), [("3rrr_m1", None), pytest.param("quattro", ("1", "4"), marks=pytest.mark.slow)]
)
def test_from_another_mode_the_list_is_the_same(name: str, observe: Legs | None):
    """A servo loop cannot tell the modes apart, so no list may depend on which of them is the goal."""
    found = listed(name, observe, False)
    assert not isinstance(found, str), found
    reached = []
    for mode in found.modes:
        if mode.goal or not mode.reachable:
            continue
        try:
            other = modes(found.setup.robot, observe, at=mode.pose)
        except HrsynthError:
            continue
        if np.abs(asked_directions(other) - asked_directions(found)).max() < 1e-9:
            reached.append(mode)
            assert len(other.modes) == len(found.modes)
            for each in found.modes:
                assert any(
                    all(np.abs(X - model.bodies[body]).max() < 1e-6 for body, X in each.bodies.items())
                    for model in other.modes
                )
    assert reached or len(found.modes) == 1


def asked_directions(found: AssemblyModes) -> Array:
    """The goal's directions by screws (k, 3)."""
    oracle = Oracle(found.setup.mechanism)
    return oracle.directions(state_of(found.goal.model, found.goal.q), asked(found).observations)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "observe", "size"),
    [
        ("3rrr_m1", ("1",), 2),
        ("gough_stewart", ("1", "2"), 2),
        ("quattro", ("1",), 2),
        ("prrrp_parallel", None, 1),
        ("3ppr_m1", None, 3),
        ("3prp", None, 2),
        ("uranesx", None, 1),
    ],
)
def test_a_pose_that_is_left_undetermined_is_a_continuum(name: str, observe: Legs | None, size: int):
    found = listed(name, observe, False)
    assert not isinstance(found, str), found
    assert (found.found.continuous_family, found.modes, found.near_modes, found.found.complete) == (size, (), (), False)
    assert f"dimension {size}" in str(found.found.singular_solutions)
    assert found.to_dict()["continuous_family"] == size


@pytest.mark.parametrize(
    "arguments",
    [
        {"observe": ["7"]},
        {"observe": []},
        {"at": "phi=3deg,rpy=0/0/0"},
        {"at": "nonsense"},
        {"at": Pose(rpy=(0.1, 0.2, 0.3))},
        {"camera": "nowhere"},
    ],
)
def test_what_is_asked_wrongly_is_refused_in_one_line(arguments):
    with pytest.raises(BadRequest) as caught:
        modes(load(list_robots()["quattro"]), **arguments)
    assert "\n" not in str(caught.value)


def test_a_robot_is_closed_where_its_modes_are():
    """The search itself: its closings are closed, and they differ."""
    found = listed("3rrr_m1", None, False)
    assert not isinstance(found, str), found
    assert len(compared(found, FEW).met) == len(found.modes) == 2
    poses = [bodies_of(found, mode.configuration)["platform"] for mode in found.modes]
    assert np.abs(poses[0] - poses[1]).max() > 1e-2


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_four_bar_has_two_modes_with_one_link_watched_and_one_with_both(seed: int):
    """With one crank held the coupler turns over; with both held, legs at rest, only the pose itself is left."""
    rng = np.random.default_rng(seed)
    corners = np.array([[0, 0, 0], [0.1, 0, 0.4], [0.6, 0, 0.5], [0.5, 0, 0]]) + rng.normal(scale=0.03, size=(4, 3))
    corners[:, 1] = 0
    built = Builder("four_bar")
    for name, corner in (("base", corners[0]), ("crank", corners[0]), ("coupler", corners[1]), ("rocker", corners[3])):
        built.link(name, corner)
    for number, (one, other) in enumerate(
        [("base", "crank"), ("crank", "coupler"), ("coupler", "rocker"), ("rocker", "base")]
    ):
        built.joint(f"hinge_{number}", "R", one, other, corners[number], axis=(0, 1, 0), motor=number == 0)
    robot = built.build("coupler")
    for observe, count in ((["1"], 2), (["2"], 2), (None, 1)):
        found = modes(robot, observe)
        assert (found.found.complex, len(found.modes), found.found.complete) == (count, count, True)
        assert found.modes[0].goal
        assert all(mode.reachable for mode in found.modes)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "one", "other", "ratio", "real"),
    [
        ("delta", "shoulder_1", "shoulder_2", -0.5, False),
        ("3rps", "slide_1", "slide_3", 2.0, True),
        ("gough_stewart", "slide_1", "slide_4", 1.0, False),
        pytest.param("gough_stewart", "slide_1", "slide_2", -1.0, True, marks=pytest.mark.slow),
        pytest.param("hexa", "shoulder_2", "shoulder_5", 0.5, True, marks=pytest.mark.slow),
    ],
)
def test_couplings_in_space_rule_poses_out(name: str, one: str, other: str, ratio: float, real: bool):
    """Lists are those of the robot without them, with the tied motor held; closings with them are among these."""
    robot = load(list_robots()[name])
    ends = [robot.joints[joint] for joint in (one, other)]
    coupled = robot.changed(joints=[replace(ends[1], motor=None)], couplings=(Coupling("gear", one, other, ratio),))
    found, free = modes(coupled, real=real), modes(robot, real=real)
    assert found.found.complex == free.found.complex
    assert found.found.proof == f"without couplings, which only exclude poses: {free.found.proof}"
    if name != "delta":  # its parallelograms cross at most closings
        check_completeness(found, FEW, seed=1)
    assert next(mode for mode in found.modes if mode.goal).reachable
    for mode, of_free in zip(found.modes, free.modes, strict=True):
        if mode.configuration is not None:
            assert distance(free, of_free, mode.configuration) < 1e-9
            places = [moved_since_zero(found, mode.configuration, joint) for joint in ends]
            assert places[1] == pytest.approx(ratio * places[0], abs=1e-8)
        elif of_free.configuration is not None and mode.open_couplings:
            places = [moved_since_zero(free, of_free.configuration, joint) for joint in ends]
            assert abs(places[1] - ratio * places[0]) > 1e-6
            assert (mode.unclosed_legs, mode.open_couplings, mode.to_dict()["open_couplings"]) == (
                (),
                ("gear",),
                ["gear"],
            )
            assert "only with coupling gear left open" in text(found)
        if real:
            assert mode.assembly == of_free.assembly


def test_a_coupling_that_is_solved_for_leaves_the_poses_at_which_it_closes():
    """Of the robot without it, that moves more, those poses at which both slides have the same length."""
    robot = load(list_robots()["3rps"])
    ends = [robot.joints[joint] for joint in ("slide_2", "slide_1")]
    coupled = robot.changed(
        joints=[replace(ends[1], motor=None)], couplings=(Coupling("gear", "slide_2", "slide_1", 1.0),)
    )
    found, free = modes(coupled), modes(robot)
    closed = list[AssemblyMode]()
    for mode in free.modes:
        places = [moved_since_zero(free, mode.configuration, joint) for joint in ends]
        closed += [mode] if abs(places[1] - places[0]) < 1e-6 else []
    assert 1 < len(closed) < len(free.modes)
    assert len(found.modes) == len(closed)
    assert found.found.complete
    for mode in found.modes:
        assert mode.open_couplings == ()
        assert min(distance(free, each, mode.configuration) for each in closed) < 1e-8


def test_there_is_no_matrix_at_a_stretched_leg():
    """Arm and rod of leg 1 lie in a line: they bend while the platform rests, as the law of cosines says to first
    order, so no twist of the platform gives the rod's rate."""
    corners = np.array(
        [[-1, 0], [1, 0], [0, 2.5], [-0.4, 0.8], [1.1, 0.9], [-0.5, 2.0], [0.2, 1.6], [0.5, 1.5], [0.3, 1.9]]
    )
    feet, knees, tips = np.column_stack([corners, np.zeros(9)]).reshape(3, 3, 3)
    b = Builder("stretched")
    b.link("base")
    b.link("platform", at=tips.mean(axis=0))
    for k, (A, K, B) in enumerate(zip(feet, knees, tips, strict=True), 1):
        b.link(f"arm_{k}", at=A)
        b.link(f"rod_{k}", at=K)
        b.joint(f"shoulder_{k}", "R", "base", f"arm_{k}", at=A, axis=(0, 0, 1), motor=True)
        b.joint(f"elbow_{k}", "R", f"arm_{k}", f"rod_{k}", at=K, axis=(0, 0, 1))
        b.joint(f"wrist_{k}", "R", f"rod_{k}", "platform", at=B, axis=(0, 0, 1), loop=k > 1)
    stretched = b.build(platform="platform")
    for real, said in ((False, "no interaction matrix"), (True, "the motors can move there")):
        found = modes(stretched, real=real)
        assert said in text(found)
        for mode in found.modes:
            if mode.configuration is not None:
                knee, moved = mode.configuration.pose("rod_1")[:3, 3], mode.configuration.pose("platform")
                tip = moved[:3, :3] @ (tips[0] - tips.mean(axis=0)) + moved[:3, 3]
                straight = np.linalg.norm(np.cross(knee - feet[0], tip - knee)) < 1e-7
                assert (mode.type2_distance is None) is bool(straight)


def test_a_joint_that_a_coupling_holds_apart_from_another_is_no_joint_without_it():
    """Two stages of a telescope, both driven: the link between them is there for the coupling alone."""
    robot = load(list_robots()["3rps"])
    slide, stage = robot.joints["slide_1"], "stage"
    inner = replace(slide, name="inner", predecessor=stage)
    coupled = robot.changed(
        links=[replace(robot.links[slide.successor], name=stage)],
        joints=[replace(slide, successor=stage), inner],
        couplings=(Coupling("belt", slide.name, inner.name, 1.0),),
    )
    setup = watched(coupled)
    assert stage in setup.mechanism.links
    assert drop_couplings(MeasuredRobot.of(setup, real=True), setup.all_samples.start) is None
    assert drop_couplings(MeasuredRobot.of(setup), setup.all_samples.start) is not None


def moved_since_zero(found: AssemblyModes, at: ClosedConfiguration, joint: Joint) -> float:
    """The turn (rad) or the slide (m) of a joint of one freedom since the zero configuration of the robot (a mode's own
    twin has its zero at the mode), from the poses of its links."""
    links = found.setup.all_samples.start.model.mechanism.links
    before, after = (at.pose(link) @ invert_pose(links[link].pose) for link in joint.links)
    D, axis = invert_pose(before) @ after, joint.axes[0]
    if joint.type is JointType.PRISMATIC:
        return float(axis @ D[:3, 3])
    across = D[:3, :3] - D[:3, :3].T
    return float(np.arctan2(axis @ [across[2, 1], across[0, 2], across[1, 0]], np.trace(D[:3, :3]) - 1.0))


WAYS = {
    "tips": partial(solve_tips, as_written=False, time_limit=MODES_TIME_LIMIT_S),
    "conditions": solve_posed,
    "natural": solve_natural,
}


@pytest.mark.some(1, 5)
@pytest.mark.parametrize("name", sorted(list_robots()))
def test_all_ways_list_the_same(name: str):
    """The known patterns and the general ways, wherever several of them prove a list: the same poses, and as many
    complex ones."""
    robot = load(list_robots()[name])
    sets = [*dict.fromkeys([None, *legs(robot).minimal[:2]]), "motors"]
    for observe in sets:
        setup = ObservedRobot.of(robot, None if observe == "motors" else observe)
        measured = MeasuredRobot.of(setup, observe == "motors")
        if measured.rank < setup.dof:
            continue
        goal = setup.all_samples.start
        exact, listed = drift(goal, None, setup.normal.moved), dict[str, tuple[Model, SystemModes]]()
        for way, solved in WAYS.items():
            with suppress(UnsupportedLocus, ExternalSolverFailure, TooLarge, MissingExtra):
                made, found = solved(measured, goal, exact)
                if found.complete:
                    listed[way] = made, found
        assert listed, observe
        (first, one), *_ = listed.values()
        # without links whose directions are known, natural coordinates list other operation modes too
        narrower = measured.generic_pattern.motion not in ("planar", "spatial")
        counts = {found.complex for way, (_, found) in listed.items() if not (narrower and way == "natural")}
        assert len(counts) <= 1, (observe, counts)
        for way, (made, found) in listed.items():
            assert len(found.modes) == len(one.modes) or (way == "natural" and narrower), (observe, way)
            for mode in one.modes:
                bodies = first.bodies(mode.q)
                assert (
                    min(
                        max(
                            compare_poses(X, made.bodies(each.q)[body], goal.model.length) for body, X in bodies.items()
                        )
                        for each in found.modes
                    )
                    < 1e-7
                ), (observe, way)
