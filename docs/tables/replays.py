"""The table of servo runs that the papers print, with the same runs computed here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from hrsynth.analysis.accuracy.accuracy import accuracy
from hrsynth.description import list_robots, load
from hrsynth.mechanism.pose import Pose
from hrsynth.simulation.result import Servo
from hrsynth.simulation.servo import servo

from .markdown import table as markdown
from .printed_runs import REPLAYS, Replay

START = "<!-- generated: replays -->"
HEADS = (
    "source",
    "robot",
    "legs",
    "noise",
    "printed",
    "computed",
    "same outcome?",
    "printed : computed",
    "bound",
    "remark",
)
BENCH_LASTS = 8.0
"""Time constants 1 / λ of a run with dynamics."""
DRAWS = 4
"""Noise samples over which errors of ranked runs without dynamics are averaged: single ones differ by a third."""
ALIKE = 1.5
"""Ratio of root mean square errors up to which two accuracies are about the same."""


@cache
def compute_run(replay: Replay, seed: int = 0) -> Servo:
    """Run a replay with one noise sample."""
    return servo(
        load(list_robots()[replay.robot]),
        replay.legs,
        start=replay.way[0],
        goal=replay.way[1],
        gain=replay.gain,
        noise=replay.noise,
        dynamics=replay.dynamics,
        time=BENCH_LASTS / replay.gain if replay.dynamics else None,
        seed=seed,
    )


def table(replays: Sequence[Replay] = REPLAYS) -> str:
    """Return the Markdown table of all replays."""
    return markdown(HEADS, map(row, replays))


def row(replay: Replay) -> tuple[str, ...]:
    """Return the row of one run."""
    found = compute_run(replay)
    here = found.outcome
    if found.spread is not None:
        s = found.spread
        metres, radians = _error(replay)
        turns = found.setup.motion.rotations.shape[1]
        here += f" ± {1e3 * metres:.2g} mm" + (f", {radians:.1g} rad" if turns else "")
        if s.has_bias:
            here += f", about {_place(Pose(*s.mean))}"
    else:
        here += f" {_place(found.pose)}"
    noise = "–" if replay.noise is None else replay.noise if "deg" in replay.noise else f"{replay.noise} rad, dynamics"
    same = "yes" if found.outcome == replay.ended else "no"
    return (
        replay.source,
        f"`{replay.robot}`",
        ", ".join(replay.legs),
        noise,
        f"{replay.ended} {replay.said}",
        here,
        same,
        _figures(replay, found),
        _bound(replay),
        replay.remark,
    )


def _figures(replay: Replay, found: Servo) -> str:
    """Compare printed and computed figures: distance of two positions, or ratios of errors and their order."""
    if found.spread is None:
        printed = [float(v) for v in replay.said.strip("()").replace("−", "-").split(",")]
        distance = math.dist(printed, [v or 0.0 for v in (found.pose.x, found.pose.y, found.pose.z)])
        return f"{1e3 * distance:.0f} mm"
    ratios = [
        f"{theirs / mine:.2g} ({unit})"
        for theirs, mine, unit in zip(replay.printed, _error(replay), ("position", "orientation"), strict=True)
        if theirs is not None
    ]
    if replay.order:
        ratios.append(f"order {'as printed' if _in_order(replay) else 'differs'}")
    return ", ".join(ratios) or "–"


def _in_order(replay: Replay) -> bool:
    """Return True if the errors of position rank as printed."""
    mine, _ = _error(replay)
    for other in REPLAYS:
        if other.order != replay.order or other is replay:
            continue
        theirs, _ = _error(other)
        if other.place == replay.place:
            fits = max(mine, theirs) / min(mine, theirs) <= ALIKE
        else:
            fits = (mine < theirs) == (replay.place < other.place)
        if not fits:
            return False
    return True


def _bound(replay: Replay) -> str:
    """Return the largest first-order error at the goal for directions within a cone of the printed noise."""
    if replay.noise is None or "deg" not in replay.noise:
        return "–"
    found = accuracy(load(list_robots()[replay.robot]), replay.legs, cone=replay.noise, at=replay.way[1]).poses[0]
    turn = f", {found.orientation.largest:.1g} rad" if found.orientation.largest > 0 else ""
    return f"{1e3 * found.position.largest:.2g} mm{turn}"


def _error(replay: Replay) -> tuple[float, float]:
    """Return the root mean square error of all noise samples (m, rad)."""
    draws = DRAWS if replay.order and not replay.dynamics else 1
    spreads = [compute_run(replay, seed).spread for seed in range(draws)]
    squares = [(each.rms_metres**2, each.rms_radians**2) for each in spreads if each is not None]
    metres, radians = np.sqrt(np.mean(squares, axis=0))
    return float(metres), float(radians)


def _place(pose: Pose) -> str:
    return f"({', '.join(f'{round(v or 0.0, 3) + 0.0:g}' for v in (pose.x, pose.y, pose.z))})".replace("-", "−")
