"""Poses that are asked for: what is examined is that pose, half turns included, and its ranks are right."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, UNCLEAR, WRONG, Case, rpy_of
from adversary.claims.lists import asked_of
from adversary.drafts import across, turn, unit
from adversary.robot import Array


def poses(case: Case) -> None:
    """``check`` at a pose to which small steps lead, and at one turned by half a turn."""
    import hrsynth

    at, _ = case.walked
    if not len(at):
        return
    chosen = at[[int(case.rng.integers(len(at)))]]
    for asked in (case.text_of(chosen), half_turned(case)):
        told = (
            None
            if asked is None
            else case.asked("asked pose", lambda asked=asked: hrsynth.check(case.engine, case.observe(), at=[asked]))
        )
        if told is not None:
            judge(case, told, asked)


def half_turned(case: Case) -> str | None:
    """The zero pose turned by exactly π: about any axis, or about the only one; None of a point or without turns."""
    study, robot = case.study, case.robot
    if robot.point is not None:
        return None
    at, _ = case.walked
    spins = np.hstack([local.T[3:] for local in study.locals(at)])
    left, s, _ = np.linalg.svd(spins)
    free = int(np.sum(s > 1e-6))
    if not free:
        return None
    axis: Array = left[:, 0] if free == 1 else unit(left[:, :free] @ case.rng.normal(size=free))
    x, R = (each[0] for each in study.poses(robot.zero()))
    if free == 3 and case.rng.random() < 0.5:
        axis = across(case.rng.normal(size=3), case.rng) if case.rng.random() < 0.5 else np.eye(3)[case.rng.integers(3)]
    turned = turn(axis, np.pi) @ R
    return (
        ",".join(f"{n}={float(v)!r}" for n, v in zip("xyz", x, strict=True))
        + ",rpy="
        + "/".join(repr(a) for a in rpy_of(turned))
    )


def judge(case: Case, told: Any, asked: str) -> None:
    """Hold a posture against the pose that was asked for and the own ranks there."""
    posture = told.postures[0]
    asked_of(case, "asked pose", asked, posture.pose)
    at = case.fitted(posture.configuration)
    items = case.directions(told.setup.observed)
    if at is None:
        case.say("ranks there", WRONG, f"the configuration at {posture.pose} does not close (asked {asked})")
        return
    if items is None:
        case.say("ranks there", UNCLEAR, "a measurement is no direction of a link")
        return
    dof, seen, clear = case.study.locals(at)[0].sees(np.asarray(case.study.rates(items, at)[0], dtype=float))
    if not clear or not posture.has_decided_ranks:
        case.say("ranks there", UNCLEAR, "singular values near the cutoff")
        return
    good = (posture.dof, posture.hidden.rank) == (dof, seen)
    text = f"at {asked}: dof {posture.dof}, rank {posture.hidden.rank} told, {dof} and {seen} found"
    case.say("ranks there", HELD if good else WRONG, "" if good else text)
