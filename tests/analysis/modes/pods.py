"""Random legs in series on one platform, and all poses with their directions held by brute force.

Joint coordinates, products of exponentials, Levenberg and Marquardt's method for many random starts at once; NumPy
alone, no pose of the engine, no leg taken apart, no curve known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrsynth.geometry.vectors import Array, normalise_vector, rotate_about_axis
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

CLOSED = 1e-12
"""Error (m, pure numbers) at which a start has ended at a solution."""


@dataclass(frozen=True, eq=False)
class Serial:
    """A leg as a product of exponentials: turns and slides (letter, axis, point) in the base frame at zero, the tip,
    the direction that is held (None: none) and how many joints are before its link."""

    joints: tuple[tuple[str, Array, Array], ...]
    tip: Array
    held: Array | None
    before: int


def pods(words: Sequence[str], seed: int) -> tuple[Mechanism, list[Serial]]:
    """A platform on legs such as ``RRPS``: every centre and axis is random, a U has two normal axes that meet.

    The last link before the platform is watched: along its P, or from joint to joint.
    """
    rng = np.random.default_rng(seed)
    tilt = rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))
    middle = tilt @ (rng.normal(scale=0.3, size=3) + [0, 0, 1])
    b, legs = Builder("pods"), list[Serial]()
    b.link("base")
    b.link("platform", at=middle)
    for leg, word in enumerate(words, 1):
        foot, tip = tilt @ (rng.normal(size=3) * [1, 1, 0.2]), middle + rng.normal(scale=0.5, size=3)
        steps = np.linspace(0, 1, len(word))[1:-1, None]
        at = np.vstack([foot, foot + steps * (tip - foot) + rng.normal(scale=0.2, size=(len(steps), 3)), tip])
        links = ["base", *(f"link_{leg}_{k}" for k in range(1, len(word))), "platform"]
        for name, point in zip(links[1:-1], at, strict=False):
            b.link(name, at=point)
        joints, direction = list[tuple[str, Array, Array]](), normalise_vector(at[-1] - at[-2])
        for k, (letter, point) in enumerate(zip(word, at, strict=True)):
            near = tip - foot if letter in "PC" else np.zeros(3)
            axis = normalise_vector(near + rng.normal(scale=0.3, size=3))
            second = normalise_vector(np.cross(axis, rng.normal(size=3)))
            axes = {"S": {}, "U": {"axis": axis, "axis2": second}}.get(letter, {"axis": axis})
            b.joint(
                f"joint_{leg}_{k}",
                letter,
                links[k],
                links[k + 1],
                at=point,
                motor=k == 0,
                loop=letter == "S" and leg > 1,
                **axes,
            )
            joints += [("P", axis, point)] * (letter in "PC") + [("R", axis, point)] * (letter in "RUC")
            joints += [("R", second, point)] * (letter == "U")
            direction = axis if letter in "PC" and k == len(word) - 2 else direction
        b.observe(str(leg), links[-2], direction)
        legs.append(Serial(tuple(joints), tip, direction, len(joints)))
    return b.build(platform="platform"), legs


def displacements(legs: Sequence[Serial], starts: int, seed: int = 0, rounds: int = 80) -> list[Array]:
    """Displacements (4, 4) of the platform from zero with the directions held, from random starts.

    The tips keep their distances, and their sense where there are four; each held direction is at its value.
    """
    rng = np.random.default_rng(seed)
    letters = [letter for leg in legs for letter, _, _ in leg.joints]
    x = np.where(
        np.array(letters) == "P",
        rng.normal(scale=2.0, size=(starts, len(letters))),
        rng.uniform(-np.pi, np.pi, (starts, len(letters))),
    )
    damping = np.full(starts, 1e-2)
    r, J, tips = _rows(legs, x)
    cost = np.sum(r * r, axis=1)
    for _ in range(rounds):
        normal = np.einsum("nij,nik->njk", J, J) + damping[:, None, None] * np.eye(len(letters))
        step = -np.linalg.solve(normal, np.einsum("nij,ni->nj", J, r)[..., None])[..., 0]
        step /= np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 0.7)
        new = _rows(legs, x + step)
        now = np.sum(new[0] ** 2, axis=1)
        good = now < cost
        x[good] += step[good]
        for old, better in zip((r, J, tips, cost), (*new, now), strict=True):
            old[good] = better[good]
        damping = np.where(good, np.maximum(damping / 8, 1e-15), np.minimum(damping * 6, 1e6))
    home = np.array([leg.tip for leg in legs])
    found = [(_displacement(home, each), each) for each in tips[np.sqrt(cost) < CLOSED]]
    return [D for D, each in found if np.abs(home @ D[:3, :3].T + D[:3, 3] - each).max() < 1e-8]


def _displacement(home: Array, tips: Array) -> Array:
    """The rigid displacement (4, 4) that fits best (Kabsch)."""
    start, end = home - home.mean(axis=0), tips - tips.mean(axis=0)
    U, _, Vt = np.linalg.svd(start.T @ end)
    R = (U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt).T
    D = np.eye(4)
    D[:3, :3], D[:3, 3] = R, tips.mean(axis=0) - R @ home.mean(axis=0)
    return D


def _rows(legs: Sequence[Serial], x: Array) -> tuple[Array, Array, Array]:
    """Errors (n, rows), their Jacobian (n, rows, joints) and the tips (n, legs, 3)."""
    ends = np.cumsum([0, *(len(leg.joints) for leg in legs)])
    parts = [_leg(leg, x[:, ends[k] : ends[k + 1]]) for k, leg in enumerate(legs)]
    errors, rows = list[Array](), list[Array]()
    for i in range(len(legs)):
        for j in range(i):
            v, gap = parts[i][0] - parts[j][0], legs[i].tip - legs[j].tip
            row = np.zeros((len(x), 1, ends[-1]))
            for k, sign in ((i, 1), (j, -1)):
                row[:, 0, ends[k] : ends[k + 1]] = sign * np.einsum("ni,nik->nk", v, parts[k][1])
            errors.append((np.einsum("ni,ni->n", v, v) - gap @ gap)[:, None] / 2)
            rows.append(row)
    for k, part in enumerate(parts):
        if legs[k].held is not None:
            row = np.zeros((len(x), 3, ends[-1]))
            row[:, :, ends[k] : ends[k + 1]] = part[3]
            errors.append(part[2])
            rows.append(row)
    return np.concatenate(errors, axis=1), np.concatenate(rows, axis=1), np.stack([part[0] for part in parts], axis=1)


def _leg(leg: Serial, x: Array) -> tuple[Array, Array, Array, Array]:
    """Tip (n, 3) and its Jacobian (n, 3, joints); the error of the held direction and its Jacobian."""
    n = len(x)
    R, p, held_R = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1))
    axes, points = list[Array](), list[Array]()
    for k, (letter, axis, point) in enumerate(leg.joints):
        axes.append(R @ axis)
        points.append(R @ point + p)
        if letter == "P":
            p = p + x[:, k, None] * (R @ axis)
        else:
            K = np.cross(np.eye(3), axis)
            turn = np.eye(3) + np.sin(x[:, k])[:, None, None] * K + (1 - np.cos(x[:, k]))[:, None, None] * (K @ K)
            p = p + np.einsum("nij,nj->ni", R, point - turn @ point)
            R = R @ turn
        if k + 1 == leg.before:
            held_R = R
    tip, d = R @ leg.tip + p, np.zeros((n, 3)) if leg.held is None else held_R @ leg.held
    turns = [letter == "R" for letter, _, _ in leg.joints]
    J = np.stack([np.cross(a, tip - q) if t else a for t, a, q in zip(turns, axes, points, strict=True)], axis=-1)
    D = np.stack(
        [np.cross(a, d) if t and k < leg.before else 0 * a for k, (t, a) in enumerate(zip(turns, axes, strict=True))],
        axis=-1,
    )
    return tip, J, d - (np.zeros(3) if leg.held is None else leg.held), D
