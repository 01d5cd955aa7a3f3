"""Legs placed by brute force: Gauss-Newton on all joint values at once, from many starts, in plain NumPy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from hrsynth.geometry.vectors import hat
from hrsynth.mechanism import Joint, Mechanism
from hrsynth.mechanism.legs import Leg

SIZES = {"R": 1, "P": 1, "U": 2, "S": 3, "C": 2, "F": 0}
STEPS = 60
Screw = tuple[int, bool, np.ndarray, np.ndarray]


def miss(
    mechanism: Mechanism, leg: Leg, D: np.ndarray, point: np.ndarray | None, rng: np.random.Generator, starts: int = 25
) -> float:
    """The smallest residual (characteristic lengths, entries of rotations) with which a leg closes that ends displaced
    by D (4, 4) from zero, or whose ``point`` (3,) (at zero) is displaced so."""
    joints = [mechanism.joints[name] for name in leg.joints]
    places, count = {}, 0
    for joint in joints:
        places[joint.name] = range(count, count + SIZES[joint.type.value])
        count += SIZES[joint.type.value]
    ways = list(_ways(mechanism.base, leg, joints, places, frozenset({mechanism.base})))
    slides = np.zeros(count, dtype=bool)
    for way in ways:
        for place, sliding, _, _ in way:
            slides[place] = sliding

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([_missed(way, x, D, point, mechanism.length) for way in ways], axis=1)

    x = np.where(slides, 2 * rng.normal(size=(starts, count)), rng.uniform(-np.pi, np.pi, (starts, count)))
    x[0] = 0
    damping, error, small = np.full(starts, 1e-2), residual(x), 1e-7
    for _ in range(STEPS):
        shifts = small * np.eye(count)
        J = np.stack([(residual(x + s) - residual(x - s)) / (2 * small) for s in shifts], axis=2)
        normal = J.transpose(0, 2, 1) @ J + damping[:, None, None] * np.eye(count)
        trial = x - np.linalg.solve(normal, J.transpose(0, 2, 1) @ error[:, :, None])[:, :, 0]
        found = residual(trial)
        better = (found**2).sum(axis=1) < (error**2).sum(axis=1)
        x[better], error[better] = trial[better], found[better]
        damping = np.where(better, np.maximum(0.2 * damping, 1e-14), np.minimum(5 * damping, 1e6))
        if np.abs(error).max(axis=1).min() < 1e-10:
            break
    return float(np.abs(error).max(axis=1).min())


def _ways(
    link: str, leg: Leg, joints: list[Joint], places: Mapping[str, range], been: frozenset[str]
) -> Iterator[list[Screw]]:
    if link == leg.platform_link:
        yield []
        return
    for joint in joints:
        far = joint.other(link) if link in joint.links else link
        if far not in been and (far == leg.platform_link or far in leg.links):
            for rest in _ways(far, leg, joints, places, been | {far}):
                yield _screws(joint, joint.predecessor == link, places[joint.name]) + rest


def _screws(joint: Joint, forward: bool, places: range) -> list[Screw]:
    kind, point = joint.type.value, np.array(joint.point)
    axes = list(np.eye(3)) if kind == "S" else [np.array(axis) for axis in joint.axes]
    if kind == "C":
        axes = 2 * axes
    slides = [kind == "P" or (kind == "C" and k == 0) for k in range(len(axes))]
    found = [(place, sliding, axis, point) for place, sliding, axis in zip(places, slides, axes, strict=True)]
    return found if forward else [(place, sliding, -axis, point) for place, sliding, axis, point in found[::-1]]


def _missed(way: list[Screw], x: np.ndarray, D: np.ndarray, point: np.ndarray | None, length: float) -> np.ndarray:
    R, t = np.broadcast_to(np.eye(3), (len(x), 3, 3)), np.zeros((len(x), 3))
    for place, sliding, axis, on in way:
        value = x[:, place, None]
        if sliding:
            t = t + (R @ axis) * value * length
        else:
            K = hat(axis)
            E = np.eye(3) + np.sin(value)[..., None] * K + (1 - np.cos(value))[..., None] * (K @ K)
            t = t + R @ on
            R = R @ E
            t = t - R @ on
    if point is not None:
        return (t + R @ point - D[:3, :3] @ point - D[:3, 3]) / length
    return np.concatenate([(t - D[:3, 3]) / length, (R - D[:3, :3]).reshape(-1, 9)], axis=1)
