"""Verdicts: what each set of legs sees, held against configurations to which small steps lead."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from adversary.case import HELD, REFUSED, UNCLEAR, WRONG, Case
from adversary.robot import Items
from adversary.search import Local

MOST = 24
"""Sets of legs of one robot that are looked at."""


def generic(case: Case, items: Items | None) -> tuple[int, int] | str:
    """Freedoms of the platform and how many are seen, the same at all configurations of the walk; else why not."""
    at, _ = case.walked
    if len(at) < 3:
        return "small steps do not lead away from zero"
    if items is None:
        return "a measurement is no direction of a link"
    U = case.study.rates(items, at)
    return agreed(case.study.locals(at), U)


def agreed(here: Iterable[Local], rates: Iterable[np.ndarray]) -> tuple[int, int] | str:
    """Freedoms and seen freedoms, the same at all configurations."""
    found = [local.sees(np.asarray(u, dtype=float)) for local, u in zip(here, rates, strict=True)]
    clear = {(dof, seen) for dof, seen, sure in found if sure}
    if not all(sure for _, _, sure in found):
        return "singular values near the cutoff"
    return clear.pop() if len(clear) == 1 else "the ranks of the walk differ"


def verdicts(case: Case) -> None:
    """The verdict of every set of legs (``legs``), and the ranks at zero (``check``)."""
    import hrsynth

    if len(case.robot.motors) >= 6 and case.rng.random() < 0.5:
        return  # 63 sets of legs: half of these robots are enough
    told = case.asked("verdict", lambda: hrsynth.legs(case.engine))
    seen = case.asked("check", lambda: hrsynth.check(case.engine))
    if told is None or seen is None:
        return
    segments = {each.leg: each for each in seen.setup.segments}
    case.enough = told.minimal
    judge(case, told, segments)
    if case.rng.random() < 0.1:
        again = case.asked("seeds", lambda: hrsynth.legs(case.engine, seed=int(case.rng.integers(1, 99))))
        if again is not None:
            first, other = ({each.legs: each.rank for each in one.sets} for one in (told, again))
            case.say("seeds", HELD if first == other else WRONG, "" if first == other else f"{first} and {other}")


def judge(case: Case, told: object, segments: dict[str, object]) -> None:
    """Hold the verdicts of a table of legs against the walk."""
    sets = told.sets  # type: ignore[attr-defined]
    for each in [sets[i] for i in sorted(case.rng.permutation(len(sets))[:MOST])]:
        items = case.directions([segments[leg] for leg in each.legs])
        own = generic(case, items)
        named = f"legs {', '.join(each.legs)}: rank {each.rank} of {each.dof}"
        if isinstance(own, str):
            case.say("verdict", UNCLEAR, own)
        elif own == (each.dof, each.rank) and (each.verdict == "controllable") == (own[0] == own[1]):
            case.say("verdict", HELD)
        else:
            case.say("verdict", WRONG, f"{named} ({each.verdict}), by small steps {own[1]} of {own[0]}")


def cures(case: Case) -> None:
    """Every cure of ``advise`` (some of them, where there are many)."""
    import hrsynth

    told = case.asked("cure", lambda: hrsynth.advise(case.engine, case.observe()))
    if told is None or not told.sets:
        return
    chosen = case.rng.permutation(len(told.sets))[:6]
    judge_cures(case, told, [told.sets[i] for i in chosen])


def judge_cures(case: Case, told: object, sets: Iterable[object]) -> None:
    """Hold cures against the walk."""
    at, _ = case.walked
    if len(at) < 3:
        case.say("cure", UNCLEAR, "small steps do not lead away from zero")
        return
    here = case.study.locals(at)
    observed = list(told.setup.observed)  # type: ignore[attr-defined]
    for each in sets:
        measured = [*observed, *(m.observation for m in each.measurements)]  # type: ignore[attr-defined]
        names = ", ".join(f"{m.kind} of {m.of}" for m in each.measurements)  # type: ignore[attr-defined]
        blocks = [rows_of(case, one, at) for one in measured]
        if any(block is None for block in blocks):
            case.say("cure", UNCLEAR, "a link of the normal form")
            continue
        own = agreed(here, np.concatenate([b for b in blocks if b is not None], axis=1))
        rank = each.verdict.rank  # type: ignore[attr-defined]
        if isinstance(own, str):
            case.say("cure", UNCLEAR, own)
        else:
            case.say(
                "cure",
                HELD if own[1] == rank else WRONG,
                "" if own[1] == rank else f"{names}: rank {rank} told, by small steps {own[1]} of {own[0]}",
            )


def rows_of(case: Case, measured: object, at: object) -> np.ndarray | None:
    """Rates (N, r, n) of any measurement, in the metric of ``Local``."""
    from adversary.robot import things

    robot, kind = case.robot, type(measured).__name__
    link, seen_from = measured.link, measured.seen_from or robot.links[0]  # type: ignore[attr-defined]
    if link not in robot.links or seen_from not in robot.links:
        return None
    frames = robot.frames(at)  # type: ignore[arg-type]
    metric = np.where(robot.slides, robot.length, 1.0)
    if kind == "Direction":
        return case.study.rates(things(robot, [(link, measured.direction, False)]), at)  # type: ignore[attr-defined,arg-type]
    if kind == "SpaceLine":
        x, J = robot.items(
            things(
                robot,
                [
                    (link, measured.at, True),  # type: ignore[attr-defined]
                    (link, measured.axis, False),  # type: ignore[attr-defined]
                ],
            ),
            frames,
        )  # type: ignore[attr-defined]
        rate = np.cross(J[:, 0], x[:, 1, None]) + np.cross(x[:, 0, None], J[:, 1])
        return np.swapaxes(np.concatenate([J[:, 1], rate / robot.length], axis=2), 1, 2) * metric
    axis = np.asarray(measured.axis)  # type: ignore[attr-defined]
    a = frames[0][:, robot.number(seen_from)] @ axis
    masks = robot.carried[robot.number(link)].astype(float) - robot.carried[robot.number(seen_from)]
    twist = frames[2] * masks[None, :, None]
    if kind == "AngleEncoder":
        return (np.einsum("nki,ni->nk", twist[..., :3], a) * metric)[:, None]
    if kind == "SlideEncoder":
        point = robot.items(things(robot, [(link, measured.point, True)]), frames)[0][:, 0]  # type: ignore[attr-defined]
        slip = twist[..., 3:] + np.cross(twist[..., :3], point[:, None])
        return (np.einsum("nki,ni->nk", slip, a) * metric / robot.length)[:, None]
    return None


__all__ = ["REFUSED", "agreed", "cures", "generic", "judge", "judge_cures", "verdicts"]
