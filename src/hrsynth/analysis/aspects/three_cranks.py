"""Planar platform whose corners hang on three observed rods, each at the end of a crank: its numbers in the plane.

With the rods' directions fixed each corner is on a circle: the hidden 3-ΠR̲R (MMT Table 1), with up to six modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...closed_forms.legs import OnCrank
from ...geometry.vectors import Array, find_perpendicular
from ...kinematics.configuration import ClosedConfiguration, measure
from ...tolerances import RELATION_ANGLE_TOL
from .leg_forms import LegPattern
from .path import PathPlanner

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class ThreeCranks:
    """Robot with three cranks: base centres A_k, lengths of cranks l_k and rods d_k, corners b_k relative to the first
    at the goal's rotation, all (3,), in characteristic lengths, points of the plane as complex numbers; ``labels`` of
    the legs."""

    labels: tuple[str, ...]
    feet: Complex
    cranks: Array
    rods: Array
    corners: Complex


@dataclass(frozen=True, eq=False)
class CrankPlace:
    """Pose of the robot: cranks w_k and rods e_k (3,) and the platform's rotation since the goal (rad)."""

    cranks: Complex
    rods: Complex
    turn: float


def recognise_three_cranks(
    aspects: PathPlanner, configurations: Sequence[ClosedConfiguration]
) -> tuple[ThreeCranks, list[CrankPlace]] | str:
    """Return the robot in its plane, legs in the order in which they are observed, the first configuration being the
    goal, and its pose at each of them; or the reason why it is not such a robot."""
    setup, pattern = aspects.setup, aspects.pattern
    if aspects.structure.motion != "planar" or not isinstance(pattern, LegPattern):
        return "the platform and its legs do not move in a plane, or have no closed forms"
    labels = [o.leg for o in setup.observed]
    if (len(labels), len(set(labels))) != (3, 3) or setup.mechanism.reference != setup.mechanism.base:
        return "the observations are not one direction of each of three legs, from the base"
    limbs = {limb.label: (k, limb) for k, limb in enumerate(pattern.subchains)}
    chosen = [(k, limb) for k, limb in (limbs[label] for label in labels) if isinstance(limb, OnCrank)]
    if not len(pattern.subchains) == len(chosen) == 3:
        return "the legs are not three rods on cranks"
    normal = setup.motion.normal
    x = find_perpendicular(normal)
    plane = np.array([x, np.cross(normal, x)]).T @ [1, 1j]
    feet = np.array([limb.centre for _, limb in chosen])
    places, tips = [], []
    home = pattern.coordinates.of(configurations[:1])[1][0]
    for at in configurations:
        (p, R), forms = pattern.coordinates.of([at]), aspects.enclosure(at).forms
        corners = np.array([limb.tip.value(p, R)[0] for _, limb in chosen])
        ends = np.array(
            [forms.subchains[k].solve(limb.tip.value(p, R), forms.subchains[k].mode)[1][0] for k, limb in chosen]
        )
        seen = measure(at.model, at.q, setup.mechanism.base, setup.observed)[2]
        rods = corners - ends
        across = np.linalg.norm(np.cross(rods, seen), axis=1) / np.linalg.norm(rods, axis=1)
        if np.max(across) > RELATION_ANGLE_TOL:
            return "the observed direction of a leg is not that of its rod"
        places.append(CrankPlace((ends - feet) @ plane, rods @ plane, float(np.angle((R[0] @ home.T @ x) @ plane))))
        tips.append(corners @ plane)
    cranks, rods = (np.array([getattr(limb, name) for _, limb in chosen]) for name in ("radius", "rod"))
    return ThreeCranks(tuple(labels), feet @ plane, cranks, rods, tips[0] - tips[0][0]), places


def count_modes(robot: ThreeCranks, held: complex, first: Array, second: Array, steps: int) -> NDArray[np.int_]:
    """Count the modes where the second and third rod have these directions (n,), (m,) (rad), (n, m): the number of
    times that the third corner crosses its circle while the first two go around theirs, sampled at ``steps`` points.
    The first corner goes as far as the second reaches its circle, ``about`` the line to that circle's centre either
    way; points are dense at both ends, where the two solutions of the second corner meet."""
    hub, arm = robot.feet[0] + robot.rods[0] * held, abs(robot.corners[1])
    ends = robot.feet[2] + robot.rods[2] * np.exp(1j * second)[:, None]
    part = (1 - np.cos(np.pi * np.arange(steps // 2 + 1) / (steps // 2))) / 2
    counts = np.zeros((len(first), len(second)), dtype=int)
    for row, angle in enumerate(first):
        to = robot.feet[1] + robot.rods[1] * np.exp(1j * angle) - hub
        reach = np.array([arm - robot.cranks[1], arm + robot.cranks[1]]) ** 2
        scale = max(2 * abs(to) * robot.cranks[0], np.finfo(float).tiny)
        cosines = (abs(to) ** 2 + robot.cranks[0] ** 2 - reach) / scale
        near, far = np.arccos(np.clip(cosines, -1, 1))
        about = np.angle(to) + np.array([[1], [-1]]) * (near + (far - near) * part)
        a = robot.cranks[0] * np.exp(1j * about)
        away = to - a
        share = (np.abs(away) ** 2 + arm**2 - robot.cranks[1] ** 2) / 2
        aside = np.sqrt(np.maximum((np.abs(away) * arm) ** 2 - share**2, 0))
        for sign in (1, -1):
            corners = a + away * (share + sign * 1j * aside) / np.abs(away) ** 2 * robot.corners[2] / robot.corners[1]
            out = np.abs(hub + corners[:, None] - ends) > robot.cranks[2]
            counts[row] += np.sum(out[..., 1:] != out[..., :-1], axis=(0, 2))
    return counts
