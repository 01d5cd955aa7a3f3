"""The exact pose, of the file's decimals, in sixty digits, lies within the radius that is told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flint import arb, arb_mat, ctx

from analysis.modes.digits import BITS, File, column, turned
from hrsynth.analysis.modes.modes import AssemblyModes, drift, modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import list_robots, load
from hrsynth.errors import PoseReachFailure
from hrsynth.geometry.vectors import build_pose
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.pose import Pose

OUTSIDE_BEFORE = "x=-0.058,y=0.031,z=0.301,rpy=0/0/0"
QUICK = [
    ("gough_stewart", ("1", "4", "6"), OUTSIDE_BEFORE),
    pytest.param("quattro", ("1", "4"), "x=0.03,y=-0.02,z=-0.65", marks=pytest.mark.slow),
    ("3rrr_m1", None, "x=0.012,y=0.008,phi=0.1"),
]
MANY = [
    ("gough_stewart", ("1", "4", "6"), 40),
    ("quattro", ("1", "4"), 8),
    ("quattro_rigid", ("1", "3"), 8),
    ("hexa", ("1", "3", "5"), 6),
    ("3rps", None, 6),
    ("delta", None, 8),
    ("3rrr_m1", None, 12),
    ("3prr_m1", None, 12),
    ("6pus", ("1", "3", "5"), 6),
    ("3upu", None, 6),
    ("orthoglide", None, 8),
]

Decimals = dict[str, tuple[str, ...]]


def decimals(at: str) -> Decimals:
    """The numbers of a pose as they are written."""
    return {name: tuple(value.split("/")) for name, _, value in (part.partition("=") for part in at.split(","))}


def wanted(setup: ObservedRobot, at: Decimals) -> Callable[[Any], list[Any]]:
    """What a platform's pose misses of the numbers given."""

    def rows(poses: Any) -> list[Any]:
        R, p = poses[setup.motion.link]
        found = [p["xyz".index(name), 0] - arb(at[name][0]) for name in at if name in "xyz"]
        if "rpy" in at:
            x, y, z = (turned([arb(i == k) for i in range(3)], arb(at["rpy"][k])) for k in range(3))
            found += (R - z * y * x).entries()
        if "phi" in at:
            home = arb_mat(setup.motion.home[:3, :3].tolist())
            found += (R - turned([arb(float(v)) for v in setup.motion.normal], arb(at["phi"][0])) * home).entries()
        return found

    return rows


def missed(name: str, setup: ObservedRobot, at: Decimals, found: AssemblyModes) -> list[tuple[float, float]]:
    """For each proved mode at which the robot closes the part of its radius (of the shift, of the turn) at which the
    exact pose is."""
    file = File(str(list_robots()[name]))

    def start(at: ClosedConfiguration) -> dict[str, float]:
        return file.start({link: at.pose(link) for link in at.model.mechanism.links}, np.random.default_rng(0))

    q, left = file.solved(start(found.goal), wanted(setup, at))
    assert left < 1e-13
    with ctx.workprec(BITS):
        goal = file.poses(q)
        watched = [
            (o.link, column([arb(float(v)) for v in o.direction])) for o in setup.observed if isinstance(o, Direction)
        ]
        held = [(link, d, goal[link][0] * d) for link, d in watched]
    parts = []
    for mode in found.modes:
        if mode.configuration is None or not mode.proved:
            continue
        q, left = file.solved(
            start(mode.configuration),
            lambda poses: [e for link, d, u in held for e in (poses[link][0] * d - u).entries()],
        )
        assert left < 1e-13
        told = {link: mode.bodies[link] for link in mode.enclosed} or {
            setup.motion.link: build_pose((mode.pose.x, mode.pose.y, mode.pose.z), mode.pose.rotation)
        }
        with ctx.workprec(BITS):
            exact = file.poses(q)
            for link, X in told.items():
                R, p = exact[link]
                shift = np.linalg.norm([float(e) for e in (p - arb_mat(X[:3, 3:].tolist())).entries()])
                turn = np.linalg.norm([float(e) for e in (R - arb_mat(X[:3, :3].tolist())).entries()]) / np.sqrt(2)
                parts.append((float(shift) / mode.shift, float(turn) / mode.turn))
    return parts


@pytest.mark.some(1)
@pytest.mark.parametrize(("name", "observe", "at"), QUICK)
def test_the_exact_pose_is_within_the_radius(name: str, observe: tuple[str, ...] | None, at: str):
    setup = ObservedRobot.of(load(list_robots()[name]), observe)
    found = modes(setup, at=at)
    parts = missed(name, setup, decimals(at), found)
    assert len(parts) >= sum(mode.configuration is not None for mode in found.modes) > 0
    assert max(max(each) for each in parts) < 1
    assert max(mode.radius for mode in found.modes) < 1e-9


@pytest.mark.long
@pytest.mark.parametrize(("name", "observe", "count"), MANY)
def test_the_exact_pose_is_within_the_radius_at_many_goals(name: str, observe: tuple[str, ...] | None, count: int):
    setup = ObservedRobot.of(load(list_robots()[name]), observe)
    rng, seen = np.random.default_rng(1), 0
    for _ in range(count):
        at = goal_near_home(setup, rng)
        try:
            found = modes(setup, at=Pose.parse(at))
        except PoseReachFailure:
            continue
        parts = missed(name, setup, decimals(at), found)
        seen += len(parts)
        assert max((max(each) for each in parts), default=0.0) < 1, at
    assert seen > 0


def goal_near_home(setup: ObservedRobot, rng: np.random.Generator) -> str:
    """A pose with a few digits, of as many parts as there are freedoms."""
    motion = setup.motion
    home, length = motion.position(motion.home), setup.mechanism.length
    given = [
        f"{name}={home['xyz'.index(name)] + length * rng.uniform(-0.1, 0.1):.3f}"
        for name in motion.parts
        if name in "xyz"
    ]
    if motion.dof > 3:
        given.append(
            "rpy=" + "/".join(f"{v:.2f}" for v in rng.uniform(-0.3, 0.3, 3))
            if motion.rotations.shape[1] == 3
            else f"phi={rng.uniform(-0.3, 0.3):.2f}"
        )
    elif motion.is_planar:
        given.append(f"phi={rng.uniform(-0.3, 0.3):.2f}")
    return ",".join(given)


def test_a_goal_that_is_not_closed_drifts_by_what_it_misses():
    """The residual that is allowed counts, and near a fold nothing is known."""
    setup = ObservedRobot.of(load(list_robots()["gough_stewart"]), ("1", "4", "6"))
    goal = setup.all_samples.start
    off = ClosedConfiguration.of(goal.model, goal.model.integrate(goal.q, np.full(goal.model.nv, 1e-12)))
    assert drift(off) > drift(goal) + 0.3 * off.residual * goal.model.length
    assert drift(goal) < 1e-12
