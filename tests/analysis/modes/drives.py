"""Planar robots with one leg driven through a loop, and their poses with the motors held, by the oracle."""

from __future__ import annotations

import numpy as np

from hrsynth.geometry.vectors import Array, invert_pose, rotate_about_axis
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from oracle import ALL, SQUARE, Oracle, Rows, exponential


def driven(drive: str, seed: int, watched: str = "rod_1") -> Mechanism:
    """3-RRR in a tilted plane; the first leg's crank is driven through a ``four-bar``, by a ``strut`` R-P-R of which P
    has the motor, or by a crank and a ``ball rod`` beside the plane."""
    rng = np.random.default_rng(seed)
    T = rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))
    n = T[:, 2]

    def flat(size: float) -> Array:
        return T[:, :2] @ rng.normal(scale=size, size=2)

    b, middle = Builder("driven"), flat(0.2)
    b.link("base")
    b.link("platform", at=middle)
    for leg in (1, 2, 3):
        turn = 2.1 * leg + rng.normal(scale=0.2)
        out = T @ [np.cos(turn), np.sin(turn), 0]
        A, B = 1.5 * out, middle + 0.4 * rotate_about_axis(n, 0.3) @ out
        E = A + flat(0.5)
        b.link(f"crank_{leg}", at=A)
        b.link(f"rod_{leg}", at=E)
        b.joint(f"shoulder_{leg}", "R", "base", f"crank_{leg}", at=A, axis=n, motor=leg > 1)
        b.joint(f"elbow_{leg}", "R", f"crank_{leg}", f"rod_{leg}", at=E, axis=n)
        b.joint(f"wrist_{leg}", "R", f"rod_{leg}", "platform", at=B, axis=n, loop=leg > 1)
        if leg > 1:
            b.observe(str(leg), f"rod_{leg}", B - E)
            continue
        beside = 0.3 * n if drive == "ball rod" else np.zeros(3)
        foot, D = A + flat(0.6) + beside, A + flat(0.4)
        C = foot + flat(0.3)
        ends = {} if drive == "ball rod" else {"axis": n}
        if drive == "strut":
            b.link("cylinder", at=foot)
            b.link("piston", at=D)
            b.joint("foot", "R", "base", "cylinder", at=foot, axis=n)
            b.joint("slide", "P", "cylinder", "piston", at=(foot + D) / 2, axis=D - foot, motor=True)
            b.joint("head", "R", "piston", "crank_1", at=D, axis=n, loop=True)
        else:
            b.link("driver", at=foot)
            b.link("coupler", at=C)
            b.joint("drive", "R", "base", "driver", at=foot, axis=n, motor=True)
            b.joint("knee", "R" if ends else "S", "driver", "coupler", at=C, **ends)
            b.joint("head", "R" if ends else "S", "coupler", "crank_1", at=D, loop=True, **ends)
        b.observe("1", watched, B - E if watched == "rod_1" else D - C)
    return b.build(platform="platform")


def closings(robot: Mechanism, starts: int, seed: int) -> list[Array]:
    """Poses (4, 4) of the platform with the motors held, from links scattered at random in their plane."""
    oracle, rng = Oracle(robot), np.random.default_rng(seed)
    n, zero = robot.joints["shoulder_1"].axis, oracle.zero()
    rows = Rows() + oracle.rows
    for joint in robot.joints.values():
        if joint.is_actuated:
            i, j = oracle.index[joint.predecessor], oracle.index[joint.successor]
            rows.tie(i, j, np.eye(4), invert_pose(zero[j]) @ zero[i], ALL, SQUARE)
    found = []
    for _ in range(starts):
        state = oracle.zero()
        for k in oracle.moving:
            shift = rng.normal(size=3)
            state[k, :3, :3] = exponential(n * rng.uniform(-3.1, 3.1)) @ state[k, :3, :3]
            state[k, :3, 3] += shift - n * float(n @ shift)
        state, left = oracle._settle(rows, state, 100)
        if left < 1e-11 and rows.stands(state):
            found.append(oracle.pose(state, "platform"))
    return found
