"""Self-motions that are known in closed form are found wherever they are; singular poses are none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import Array, normalise_vector, rotate_about_axis
from hrsynth.kinematics.self_motions import SelfMotion
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Limits


def tilted(seed: int) -> tuple[np.random.Generator, Array]:
    """Random numbers, and a random rotation (3, 3) of the base."""
    rng = np.random.default_rng(seed)
    return rng, rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))


def pod(anchors: Array, tips: Array, base: str, end: str, axis: Array) -> Mechanism:
    """Telescopic legs, driven, from ``anchors`` (n, 3) to ``tips`` (n, 3); ``axis`` of the base joints, in the plane
    the only one of R, in space the first of U."""
    b = Builder("pod")
    b.link("base")
    b.link("platform", at=tips.mean(axis=0))
    for k, (A, B) in enumerate(zip(anchors, tips, strict=True), 1):
        b.link(f"tube_{k}", at=A)
        b.link(f"rod_{k}", at=B)
        second = np.cross(axis, B - A) if base == "U" else None
        b.joint(f"foot_{k}", base, "base", f"tube_{k}", at=A, axis=axis, axis2=second)
        b.joint(f"slide_{k}", "P", f"tube_{k}", f"rod_{k}", at=(A + B) / 2, axis=normalise_vector(B - A), motor=True)
        b.joint(f"ball_{k}", end, f"rod_{k}", "platform", at=B, axis=axis if end == "R" else None, loop=k > 1)
    return b.build(platform="platform")


def triangle(rng: np.random.Generator) -> Array:
    """Three points (3, 2) of the plane on a circle of radius 0.5 about the origin, well apart."""
    angles = np.array([0.0, 2.1, 4.2]) + rng.uniform(-0.5, 0.5, 3)
    return 0.5 * np.column_stack([np.cos(angles), np.sin(angles)])


def flat(points: Array, tilt: Array) -> Array:
    """Points (n, 2) of the plane in space, in the tilted base (n, 3)."""
    return np.column_stack([points, np.zeros(len(points))]) @ tilt.T


def turned(angle: float) -> Array:
    """The rotation (2, 2) of the plane."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def platforms(motion: SelfMotion) -> Array:
    """The displacements (n, 4, 4) of the platform along a motion, since the zero configuration."""
    at = motion.configuration
    return np.array(
        [each["platform"] @ np.linalg.inv(at.model.mechanism.links["platform"].pose) for each in motion.way]
    )


def lengths(motion: SelfMotion, anchors: Array, tips: Array) -> Array:
    """The lengths of the legs (n, legs) along a motion, by anchors and tips alone."""
    return np.array([np.linalg.norm(tips @ D[:3, :3].T + D[:3, 3] - anchors, axis=1) for D in platforms(motion)])


def check_found(found: AssemblyModes, motion: SelfMotion, anchors: Array, tips: Array) -> None:
    """A motion keeps the legs' lengths; it is told as found, with what moves; what lies on it is no mode."""
    assert np.abs(lengths(motion, anchors, tips) - np.linalg.norm(tips - anchors, axis=1)).max() < 1e-9
    assert not found.found.complete
    assert found.found.complex is None
    assert found.found.continuous_family == max(each.dimension for each in found.self_motions)
    assert "found, not proved: a self-motion" in hrsynth.text(found)
    assert set(motion.links) == set(motion.configuration.model.mechanism.links) - {"base"}


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [1, 2])
def test_equal_parallel_legs_carry_a_congruent_platform_on_a_circle(seed: int):
    """3-RPR with the motors held. The tips of equal parallel legs go on equal circles; besides, the platform may be
    turned about the circumcentre by ±2 asin(r / 2R), for all chords are equal then."""
    rng, tilt = tilted(seed)
    A, r = triangle(rng), rng.uniform(0.3, 0.7)
    B = A + r * turned(rng.uniform(0, 6)) @ [1.0, 0.0]
    anchors, tips = flat(A, tilt), flat(B, tilt)
    found = hrsynth.modes(pod(anchors, tips, "R", "R", tilt[:, 2]), real=True)
    (motion,) = found.self_motions
    check_found(found, motion, anchors, tips)
    assert (motion.goal, motion.dimension, motion.returns, motion.turn) == (True, 1, True, 0.0)
    assert motion.shift == pytest.approx(2 * math.pi * r, rel=0.01)
    assert np.abs(platforms(motion)[:, :3, :3] - np.eye(3)).max() < 1e-8
    told = sorted(
        math.acos((np.trace((mode.bodies["platform"] @ np.linalg.inv(found.goal.pose("platform")))[:3, :3]) - 1) / 2)
        for mode in found.modes
    )
    assert told == pytest.approx([2 * math.asin(r / (2 * 0.5))] * 2, abs=1e-6)


@pytest.mark.slow
def test_a_self_motion_away_from_the_pose_is_found():
    """The same robot at one of its two other modes, which is regular."""
    rng, tilt = tilted(3)
    A, angle = triangle(rng), 0.9
    anchors, tips = flat(A, tilt), flat(A @ turned(angle).T, tilt)
    found = hrsynth.modes(pod(anchors, tips, "R", "R", tilt[:, 2]), real=True)
    (motion,) = found.self_motions
    check_found(found, motion, anchors, tips)
    assert (motion.goal, motion.dimension, motion.returns) == (False, 1, True)
    assert motion.shift == pytest.approx(2 * math.pi * 2 * 0.5 * math.sin(angle / 2), rel=0.01)
    assert [mode.goal for mode in found.modes] == [True, False]


@pytest.mark.slow
def test_an_octahedron_of_bricard_moves():
    """R. Bricard 1897, symmetric to a line: opposite corners of the octahedron change places by a half turn about it.
    Three corners are the base, the opposite ones the platform, the six edges between them the legs."""
    rng, tilt = tilted(4)
    corners = rng.uniform(0.15, 0.5, (3, 3)) * np.array([[1, 1, 1], [-1, 1, -1], [0.3, -1, 0.6]])
    opposite = corners * [-1, -1, 1]
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]
    anchors = np.array([corners[i] for i, _ in pairs]) @ tilt.T
    tips = np.array([opposite[j] for _, j in pairs]) @ tilt.T
    found = hrsynth.modes(pod(anchors, tips, "U", "S", normalise_vector(rng.normal(size=3))), real=True)
    motion = next(each for each in found.self_motions if each.goal)
    check_found(found, motion, anchors, tips)
    assert motion.dimension == 1
    assert motion.turn > 0.2


@pytest.mark.slow
def test_equal_parallel_legs_in_space_carry_a_congruent_platform_on_a_sphere():
    """Two ways to move, though to first order it could turn about the legs' direction as well."""
    rng, tilt = tilted(5)
    anchors, way = rng.uniform(-0.4, 0.4, (6, 3)) @ tilt.T, rng.uniform(0.2, 0.5, 3)
    found = hrsynth.modes(pod(anchors, anchors + way, "U", "S", normalise_vector(rng.normal(size=3))), real=True)
    motion = next(each for each in found.self_motions if each.goal)
    check_found(found, motion, anchors, anchors + way)
    assert motion.dimension == 2
    assert np.linalg.norm(platforms(motion)[:, :3, 3] + way, axis=1) == pytest.approx(np.linalg.norm(way), abs=1e-9)


@pytest.mark.slow
def test_a_platform_on_points_of_similar_conics_moves_generically():
    """Architecturally singular: base and platform similar (M. Husty, A. Karger 2000). It moves through every pose."""
    rng, tilt = tilted(6)
    angles = np.arange(6) * math.pi / 3 + rng.uniform(-0.3, 0.3, 6)
    A = np.column_stack([0.4 * np.cos(angles), 0.3 * np.sin(angles), np.zeros(6)])
    D = rotate_about_axis(rng.normal(size=3), 0.4)
    anchors, tips = A @ tilt.T, (0.6 * A @ D.T + [0.05, 0.02, 0.4]) @ tilt.T
    found = hrsynth.modes(pod(anchors, tips, "U", "S", normalise_vector(rng.normal(size=3))), real=True)
    (motion,) = found.self_motions
    assert found.found.continuous_family == motion.dimension == 1
    assert np.abs(lengths(motion, anchors, tips) - np.linalg.norm(tips - anchors, axis=1)).max() < 1e-9
    assert "leave 1 of the platform's dof undetermined" in str(found.found.singular_solutions)


def test_two_circles_in_one_move_a_five_bar():
    """Both distal links watched: their tip goes on a circle about A_i + l₂ u_i, the same for both legs here."""
    rng, tilt = tilted(7)
    arm, tip = rng.uniform(0.2, 0.4, 2), np.array([0.05, 0.3])
    b = Builder("five_bar")
    b.link("base")
    for k, A in ((1, np.array([-0.2, 0.0])), (2, np.array([0.25, 0.0]))):
        at, knee = flat(np.array([A, A + arm]), tilt)
        b.link(f"arm_{k}", at=at)
        b.link(f"rod_{k}", at=knee)
        b.joint(f"shoulder_{k}", "R", "base", f"arm_{k}", at=at, axis=tilt[:, 2], motor=True)
        b.joint(f"elbow_{k}", "R", f"arm_{k}", f"rod_{k}", at=knee, axis=tilt[:, 2])
    b.joint("tip", "R", "rod_1", "rod_2", at=flat(np.array([tip + arm]), tilt)[0], axis=tilt[:, 2], loop=True)
    robot = b.build(platform="rod_1")
    found = hrsynth.modes(robot)
    (motion,) = found.self_motions
    assert (motion.goal, motion.dimension, motion.returns) == (True, 1, True)
    assert motion.shift == pytest.approx(2 * math.pi * np.linalg.norm(arm), rel=0.01)
    assert found.modes == ()
    assert (motion.beyond_limits, motion.to_dict()["within_m"]) == ((), motion.shift)
    # both arms turn alike: with the first held to 0.7 rad either way, the tip goes as far on its circle
    arm_1 = replace(robot.joints["shoulder_1"], limits=Limits(-0.7, 0.7))
    ended = hrsynth.modes(robot.changed(joints=[arm_1]))
    assert ended.self_motions[0].beyond_limits == ("shoulder_1",)
    assert ended.self_motions[0].shift == motion.shift
    assert ended.self_motions[0].inside == (pytest.approx(1.4 * np.linalg.norm(arm), rel=0.15), 0.0)
    assert "until it closed, beyond the limits of shoulder_1; within all limits over 0." in hrsynth.text(ended)


@pytest.mark.slow
def test_a_singular_pose_is_no_self_motion():
    """A 3-RPR whose legs' lines meet in a point: it can turn about it to first order only."""
    rng, tilt = tilted(8)
    A = triangle(rng)
    centre, reach = np.array([0.1, 0.05]), np.array([0.4, 0.55, 0.7])
    B = A + reach[:, None] * (centre - A)
    found = hrsynth.modes(pod(flat(A, tilt), flat(B, tilt), "R", "R", tilt[:, 2]), real=True)
    assert found.self_motions == ()
    assert found.found.continuous_family is None
    assert "singular pose" in str(found.found.singular_solutions)
    assert sum(mode.goal for mode in found.modes) == 1


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "observe"),
    [("i4l", "1"), ("3rrp", "1"), ("hexaglide", "1"), ("quattro", "1"), ("prrrp_parallel_point", None), ("3prp", None)],
)
def test_freedoms_that_are_never_seen_are_moved(name: str, observe: str | None):
    """As many ways to move as the rank at other configurations leaves."""
    found = hrsynth.modes(load(list_robots()[name]), observe)
    (motion,) = found.self_motions
    assert motion.dimension == found.found.continuous_family
    assert motion.goal
    assert "a continuous family" in found.count
