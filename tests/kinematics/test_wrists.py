"""Three R through one point make every small turn, not every turn: what stands for them asks for none that they cannot
make. The three angles are computed here, from the axes as drawn."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.check import check
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.pose_continuation import track_to_pose
from hrsynth.errors import PoseReachFailure
from hrsynth.geometry.so3 import convert_rotations_to_vectors
from hrsynth.geometry.vectors import rotate_about_axis
from hrsynth.kinematics.assembly import ASSEMBLED, BEYOND, Assembler
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.limits import CoordinateIntervals, compute_tilt_margins
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.pose import Pose
from strategies import oblique, pods, random_direction, random_rotation, serial, transformed

Rng = np.random.Generator


def product(axes: list[np.ndarray], angles: np.ndarray) -> np.ndarray:
    R = np.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        R = R @ rotate_about_axis(axis, angle)
    return R


def three_angles(axes: list[np.ndarray], R: np.ndarray) -> np.ndarray | None:
    """Angles with R = R₁ R₂ R₃: a₁·R₂ a₃ = a₁·R a₃ gives the second, then the others; None where there are none."""
    a, b, c = axes
    K, A, B = (a @ b) * (b @ c), a @ c - (a @ b) * (b @ c), a @ np.cross(b, c)
    cosine = (a @ R @ c - K) / np.hypot(A, B)
    if abs(cosine) > 1:
        return None
    second = np.arctan2(B, A) + np.arccos(cosine)

    def turn(axis: np.ndarray, one: np.ndarray, other: np.ndarray) -> float:
        return float(np.arctan2(axis @ np.cross(one, other), one @ other - (axis @ one) * (axis @ other)))

    first = turn(a, rotate_about_axis(b, second) @ c, R @ c)
    rest = convert_rotations_to_vectors((rotate_about_axis(a, first) @ rotate_about_axis(b, second)).T @ R)
    angles = np.array([first, second, rest @ c])
    np.testing.assert_allclose(product(axes, angles), R, atol=1e-6)
    return angles


def chain(axes: list[np.ndarray], rng: Rng, types: str) -> Mechanism:
    """base – joints through one point, ends exchanged at random – tip, and a loop around."""
    b, rest = Builder("chain"), list(axes)
    for name in ("base", *(f"link_{i}" for i in range(1, len(types))), "tip"):
        b.link(name)
    names = ["base", *(f"link_{i}" for i in range(1, len(types))), "tip"]
    for i, letter in enumerate(types):
        own = [rest.pop(0) for _ in range(2 if letter == "U" else 1)]
        ends = [names[i], names[i + 1]]
        if rng.integers(2):
            ends, own = ends[::-1], [-axis for axis in own[::-1]]
        b.joint(f"joint_{i}", letter, *ends, at=(0, 0, 0), axis=own[0], axis2=own[1] if letter == "U" else None)
    b.joint("loop", "S", "base", "tip", at=(1, 1, 1), loop=True)
    return b.build("tip")


@pytest.mark.some(2)
@pytest.mark.parametrize("types", ["RRR", "RRRR", "UR", "RU", "RUR", "RRRRR"])
@pytest.mark.parametrize("seed", range(6))
def test_the_interval_is_what_the_axes_reach(types: str, seed: int) -> None:
    """Turns of the axes are within it, and their extremes, refined by halving steps, come to its ends."""
    rng = np.random.default_rng(seed)
    axes: list[np.ndarray] = []
    for letter in types:
        axes.append(random_direction(rng))
        if letter == "U":
            axes.append(np.cross(axes[-1], random_direction(rng)))
            axes[-1] /= np.linalg.norm(axes[-1])
    mechanism = reduce_to_normal_form(chain(axes, rng, types)).mechanism
    (joint,) = (joint for name, joint in mechanism.joints.items() if name != "loop")
    assert joint.type == "S"
    if joint.predecessor != "base":
        joint = joint.turned()
    low, high = (0.0, np.pi) if joint.wrist is None else (joint.wrist.low, joint.wrist.high)

    def angle(angles: np.ndarray) -> float:
        return float(np.arccos(np.clip(axes[0] @ product(axes, angles) @ axes[-1], -1, 1)))

    for sign, end in ((1, low), (-1, high)):
        best, size = rng.uniform(-np.pi, np.pi, len(axes)), 2.0
        while size > 1e-4:
            trials = [best + size * rng.normal(size=len(axes)) for _ in range(20)]
            for each in trials:
                assert low - 1e-7 <= angle(each) <= high + 1e-7
                if joint.wrist is not None:
                    carried = joint.wrist.carried(np.eye(3), product(axes, each))
                    assert carried.margin() > -1e-7
            better = min(trials, key=lambda each: sign * angle(each))
            best, size = (better, size) if sign * angle(better) < sign * angle(best) else (best, size / 2)
        assert angle(best) == pytest.approx(end, abs=1e-3)


def test_perpendicular_neighbours_make_every_turn() -> None:
    rng = np.random.default_rng(0)
    first, second, third = random_rotation(rng).T
    for types in ("RRR", "UR", "RU"):
        assert not reduce_to_normal_form(chain([first, second, third], rng, types)).mechanism.tilt_limits
    lean = rotate_about_axis(first, 0.3) @ third
    assert reduce_to_normal_form(chain([first, second, lean], rng, "UR")).mechanism.tilt_limits


def robots(seed: int) -> tuple[ObservedRobot, ObservedRobot, list[np.ndarray]]:
    """A robot whose first tip is an S, aslant; the same with three oblique R for it; their axes."""
    rng = np.random.default_rng(seed)
    # axes normal to the rods: all legs follow large turns
    free = transformed(pods(["RPS", *["UPS"] * 4], rng, square=True), random_rotation(rng), rng.normal(size=3))
    held = oblique(free, rng, "tip_1", rng.uniform(0.2, 0.4, 2))
    axes = [held.joints[f"tip_1__{k}"].axis for k in (1, 2, 3)]
    return ObservedRobot.of(free, samples=3), ObservedRobot.of(held, samples=3), axes


def turned_platforms(free: ObservedRobot, rng: Rng, count: int) -> list[np.ndarray]:
    """Poses of the platform turned about the centre of its first tip, which all legs can follow."""
    mechanism, found = free.mechanism, []
    for _ in range(count):
        D, centre = np.eye(4), mechanism.joints["tip_1"].point
        D[:3, :3] = rotate_about_axis(random_direction(rng), rng.uniform(0.05, 1.1))
        D[:3, 3] = centre - D[:3, :3] @ centre
        found.append(D @ mechanism.links["platform"].pose)
    return found


def turn_of_tip(at: ClosedConfiguration) -> np.ndarray:
    """The turn of the first tip, seen from the rod."""
    links = at.model.mechanism.links
    A, B = (at.pose(link)[:3, :3] @ links[link].pose[:3, :3].T for link in ("upper_1", "platform"))
    return A.T @ B


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", range(4))
def test_a_robot_is_assembled_where_its_three_axes_can_turn(seed: int) -> None:
    """Within the limits exactly where three angles exist; beyond them it is proved, by the margins too."""
    free, setup, axes = robots(seed)
    (name,) = setup.mechanism.tilt_limits
    assert setup.batch is None
    build = Assembler(setup.decomposition, setup.all_samples.model.length, setup.mechanism.reference)
    # the assembled configuration has a zero of its own, at which no joint has turned
    zero = {link: setup.mechanism.links[link].pose for link in ("upper_1", "platform")}
    seen = set()
    for X in turned_platforms(free, np.random.default_rng(seed), 16):
        found = build.at({leg.platform_link: X for leg in setup.decomposition.legs}, ())
        at = found.configuration
        assert at is not None
        A, B = (at.pose(link)[:3, :3] @ zero[link][:3, :3].T for link in ("upper_1", "platform"))
        possible = three_angles(axes, A.T @ B) is not None
        seen.add(possible)
        assert (found.verdict, found.beyond) == ((ASSEMBLED, ()) if possible else (BEYOND, (name,)))
        for value in (
            compute_tilt_margins(at.model, at.q)[name],
            CoordinateIntervals.of(at.model, at.q).margins(at.model, at.q)[name],
            at.model.mechanism.tilt_limits[name].margin(),
        ):
            assert (value >= 0) == possible
    assert seen == {True, False}


def reached(setup: ObservedRobot, pose: Pose) -> ClosedConfiguration | PoseReachFailure:
    try:
        return track_to_pose(setup.all_samples.start, setup.all_samples.observation_model, pose, setup.motion)
    except PoseReachFailure as error:
        return error


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_way_ends_where_the_three_axes_turn_no_further(seed: int) -> None:
    """What is reached has three angles; else, and where the way to it passes where there are none, the answer names the
    joint. The robot with an S reaches all."""
    free, setup, axes = robots(seed)
    (name,) = setup.mechanism.tilt_limits
    count = {True: 0, False: 0}
    for X in turned_platforms(free, np.random.default_rng(seed), 8):
        pose = Pose.of(X)
        there, here = reached(free, pose), reached(setup, pose)
        assert isinstance(there, ClosedConfiguration)
        if isinstance(here, ClosedConfiguration):
            assert three_angles(axes, turn_of_tip(here)) is not None
            assert three_angles(axes, turn_of_tip(there)) is not None
        else:
            assert here.wrist == name
            assert f"joint {name}, which replaces several R" in str(here)
        count[isinstance(here, ClosedConfiguration)] += 1
    assert min(count.values()) > 0


@pytest.mark.parametrize("apart", [2e-3, 9e-3, 0.3])
def test_check_says_where_three_axes_lie_in_a_plane(apart: float) -> None:
    """Three R with perpendicular neighbours make every turn, but lose one where the outer two are parallel; the S that
    stands for them does not, and `check` names it."""
    rng = np.random.default_rng(3)
    free = pods(["RPS", *["UPS"] * 4], rng, square=True)
    first, second, _ = random_rotation(rng).T
    axes = [first, second, rotate_about_axis(second, apart) @ first]
    found = check(serial(free, rng, free.joints["tip_1"], axes))
    assert np.linalg.svd(np.array(axes), compute_uv=False)[-1] == pytest.approx(apart / np.sqrt(2), rel=1e-1)
    (posture,) = found.postures
    assert not posture.beyond_limits
    assert posture.singular_spherical_joints == ({"tip_1__1": pytest.approx(apart, abs=1e-9)} if apart < 0.01 else {})
    assert ("about two axes only; not counted" in str(found)) is (apart < 0.01)
