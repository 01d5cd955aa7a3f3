"""Singular poses: those that are told are singular, and where there is said to be none, none is found."""

from __future__ import annotations

from typing import Any

import numpy as np

from adversary.case import HELD, SILENT, UNCLEAR, WRONG, Case
from adversary.claims.first_order import sees_least


def loci(case: Case) -> None:
    """``singular`` with few random poses."""
    import hrsynth

    told = case.asked("singular", lambda: hrsynth.singularities(case.engine, case.observe(), points=20))
    if told is not None:
        judge(case, told)


def judge(case: Case, told: Any) -> None:
    """Hold the singular poses, *never* and *always* against singular values of the own Jacobians."""
    items = case.directions(told.setup.observed)
    if items is None:
        case.say("singular", UNCLEAR, "a measurement is no direction of a link")
        return
    for each in told.examples:
        at = case.fitted(each.configuration)
        value = np.inf if at is None else float(sees_least(case, items, at)[0])
        case.say(
            "singular pose",
            HELD if value < 1e-5 else WRONG,
            "" if value < 1e-5 else f"{each.pose}: smallest singular value {value:.1e}",
        )
    walked, _ = case.walked
    values = sees_least(case, items, walked) if len(walked) else np.zeros(0)
    if told.always:
        good = not len(values) or float(values.max()) < 1e-6
        case.say("always singular", HELD if good else WRONG, "" if good else f"not where {values.max():.1e}")
    elif told.condition is not None and told.condition.never:
        good = not len(values) or float(values.min()) > 1e-6
        case.say("never singular", HELD if good else WRONG, "" if good else f"a pose with {values.min():.1e}")
    else:
        case.say("singular", SILENT, "somewhere")
