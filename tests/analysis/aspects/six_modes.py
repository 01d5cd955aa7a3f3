"""Random 3-RRR robots in random planes whose three forearm directions belong to six real poses of the platform.

With its forearms watched such a robot hides a 3-ΠR̲R; its assembly modes are the poses at which the three tips lie on
circles (a crank turned about the forearm's end at the base). At each of them the real robot can be assembled: the
forearms have their directions, the cranks follow.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hrsynth.geometry.loci import Circle
from hrsynth.geometry.vectors import Array, build_pose, find_perpendicular, invert_pose, normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism import Mechanism
from hrsynth.solving.platform.rigid import Planar
from hrsynth.solving.platform.solve import solve
from strategies import planar

LEGS = (1, 2, 3)
TURNS = 360
"""Places of the first tip at which the others are looked for, to count poses beforehand."""


@dataclass(frozen=True, eq=False)
class SixModes:
    """A robot, its platform poses (6, 4, 4) with the directions of the zero configuration, and the cranks' ends at them
    (6, 3, 3)."""

    robot: Mechanism
    poses: Array
    ends: Array

    def configurations(self, model: PinocchioModel) -> list[ClosedConfiguration]:
        """The robot at its poses, its joint angles by the turns of its links."""
        return [self._at(model, X, ends) for X, ends in zip(self.poses, self.ends, strict=True)]

    def _at(self, model: PinocchioModel, X: Array, ends: Array) -> ClosedConfiguration:
        robot, n = self.robot, normal(self.robot)
        feet = [robot.joints[f"joint_{i}_1"].point for i in LEGS]
        knees = [robot.joints[f"joint_{i}_2"].point for i in LEGS]
        turn = X[:3, :3] @ robot.links[robot.platform].pose[:3, :3].T
        x = normalise_vector(knees[0] - feet[0])
        turns = {robot.base: 0.0, robot.platform: angle(n, x, turn @ x)}
        for i, foot, knee, end in zip(LEGS, feet, knees, ends, strict=True):
            turns |= {f"lower_{i}": angle(n, knee - foot, end - foot), f"upper_{i}": 0.0}
        step = np.zeros(model.nv)
        for joint in robot.joints.values():
            step[list(model.coordinates[joint.name])] = turns[joint.successor] - turns[joint.predecessor]
        return ClosedConfiguration.of(model, model.integrate(model.q0, step))


def normal(robot: Mechanism) -> Array:
    """The normal of the plane of motion."""
    return robot.joints["joint_1_1"].axis


def angle(n: Array, one: Array, two: Array) -> float:
    """The angle from a vector to another about ``n``."""
    return float(np.arctan2(n @ np.cross(one, two), one @ two))


def six_modes(seed: int) -> Iterator[SixModes]:
    """Robots without end, the same for the same seed."""
    rng = np.random.default_rng(seed)
    while True:
        robot = planar(["RRR"] * 3, rng, [{0}] * 3)
        system = circles(robot)
        if crossings(system) != 6:
            continue
        found = solve(system)
        if len(found.modes) == found.complex == 6 and found.complete:
            X_P = invert_pose(system.X_plane) @ robot.links[robot.platform].pose
            poses = np.array([mode.pose @ X_P for mode in found.modes])
            tips = np.array([[(mode.pose @ [*tip, 0, 1])[:3] for tip in system.tips] for mode in found.modes])
            rods = np.array([robot.joints[f"joint_{i}_3"].point - robot.joints[f"joint_{i}_2"].point for i in LEGS])
            yield SixModes(robot, poses, tips - rods)


def circles(robot: Mechanism) -> Planar:
    """The circles of the tips with the forearms' directions held."""
    feet, knees, tips = ([robot.joints[f"joint_{i}_{k}"].point for i in LEGS] for k in (1, 2, 3))
    n = normal(robot)
    x = normalise_vector(knees[0] - feet[0])
    X = build_pose(tips[0], np.column_stack([x, np.cross(n, x), n]))
    curves = tuple(
        Circle(foot + tip - knee, n, float(np.linalg.norm(knee - foot)))
        for foot, knee, tip in zip(feet, knees, tips, strict=True)
    )
    return Planar(curves, np.array([(tip - tips[0]) @ X[:3, :2] for tip in tips]), X)


def crossings(system: Planar) -> int:
    """How often the third tip crosses its circle while the first two go around theirs: the number of real poses, but
    for pairs nearer than a step."""
    a, b, c = ((curve.centre - system.X_plane[:3, 3]) @ system.X_plane[:3, :2] @ [1, 1j] for curve in system.curves)
    r, s, t = (curve.radius for curve in system.curves)
    p, q, w = system.tips @ [1, 1j]
    first = a + r * np.exp(2j * np.pi * np.arange(TURNS + 1) / TURNS)
    away, arm = b - first, abs(q - p)
    share = (np.abs(away) ** 2 + arm**2 - s**2) / 2
    reserve = (np.abs(away) * arm) ** 2 - share**2
    aside = np.sqrt(np.maximum(reserve, 0))
    # beyond its reach the second tip has no place; at the two limits its two ways meet
    total, there = 0, reserve > 0
    ways = [
        np.abs(first + away * (share + sign * 1j * aside) / np.abs(away) ** 2 * (w - p) / (q - p) - c) > t
        for sign in (1, -1)
    ]
    for way in ways:
        total += int(np.count_nonzero((way[1:] != way[:-1]) & there[1:] & there[:-1]))
    limits = np.flatnonzero(there[1:] != there[:-1])
    inner = np.where(there[limits], limits, limits + 1)
    return total + int(np.count_nonzero(ways[0][inner] != ways[1][inner]))


def determinants(instance: SixModes, tips: Array, ends: Array) -> Array:
    """det of the lines (n,) through tips (n, 3, 3) along cranks that end at (n, 3, 3), metres: zero where they meet."""
    n, feet = normal(instance.robot), np.array([instance.robot.joints[f"joint_{i}_1"].point for i in LEGS])
    cranks = ends - feet
    cranks = cranks / np.linalg.norm(cranks, axis=2, keepdims=True)
    x = find_perpendicular(n)
    moments = np.cross(tips - tips[:, :1], cranks) @ n
    return np.linalg.det(np.stack([cranks @ x, cranks @ np.cross(n, x), moments], axis=2))


def tips_at(instance: SixModes, X: Array) -> Array:
    """The tips (n, 3, 3) at platform poses (n, 4, 4)."""
    robot = instance.robot
    home = invert_pose(robot.links[robot.platform].pose)
    tips = [X @ home @ np.append(robot.joints[f"joint_{i}_3"].point, 1.0) for i in LEGS]
    return np.stack(tips, axis=1)[:, :, :3]
