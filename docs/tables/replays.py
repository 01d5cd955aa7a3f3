"""The table of servo runs that the papers print, beside what the same runs do here."""

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
    "same ending?",
    "printed : computed",
    "bound",
    "word",
)
BENCH_LASTS = 8.0
"""Time constants 1 / λ of a run on the physics bench."""
DRAWS = 4
"""Draws of the noise over which errors of runs without dynamics that are ranked are taken together: those of one
differ by a third."""
ALIKE = 1.5
"""Ratio of root mean square errors up to which two accuracies are about the same."""


@cache
def compute_run(replay: Replay, seed: int = 0) -> Servo:
    """The run with one draw of the noise."""
    return servo(
        load(list_robots()[replay.robot]),
        replay.legs,
        start=replay.way[0],
        goal=replay.way[1],
        gain=replay.gain,
        noise=replay.noise,
        dynamics=replay.physics,
        time=BENCH_LASTS / replay.gain if replay.physics else None,
        seed=seed,
    )


def table(replays: Sequence[Replay] = REPLAYS) -> str:
    """The Markdown table of all replays."""
    return markdown(HEADS, map(row, replays))


def row(replay: Replay) -> tuple[str, ...]:
    """One run's row."""
    found = compute_run(replay)
    here = found.outcome
    if found.spread is not None:
        s = found.spread
        metres, radians = _error(replay)
        turns = found.setup.motion.rotations.shape[1]
        here += f" ± {1e3 * metres:.2g} mm" + (f", {radians:.1g} rad" if turns else "")
        if s.aside:
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
    """How the figures compare: the distance of two places, or the ratios of errors and their order."""
    if found.spread is None:
        printed = [float(v) for v in replay.said.strip("()").replace("−", "-").split(",")]
        apart = math.dist(printed, [v or 0.0 for v in (found.pose.x, found.pose.y, found.pose.z)])
        return f"{1e3 * apart:.0f} mm apart"
    ratios = [
        f"{theirs / mine:.2g} ({unit})"
        for theirs, mine, unit in zip(replay.printed, _error(replay), ("position", "orientation"), strict=True)
        if theirs is not None
    ]
    if replay.order:
        ratios.append(f"order {'as printed' if _in_order(replay) else 'differs'}")
    return ", ".join(ratios) or "–"


def _in_order(replay: Replay) -> bool:
    """Whether the errors of position rank as printed."""
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
    """The largest error that directions within a cone of the printed noise can cause at the goal, to first order."""
    if replay.noise is None or "deg" not in replay.noise:
        return "–"
    found = accuracy(load(list_robots()[replay.robot]), replay.legs, cone=replay.noise, at=replay.way[1]).poses[0]
    turn = f", {found.orientation.largest:.1g} rad" if found.orientation.largest > 0 else ""
    return f"{1e3 * found.position.largest:.2g} mm{turn}"


def _error(replay: Replay) -> tuple[float, float]:
    """The root mean square error of all draws together (m, rad)."""
    draws = DRAWS if replay.order and not replay.physics else 1
    spreads = [compute_run(replay, seed).spread for seed in range(draws)]
    squares = [(each.rms_metres**2, each.rms_radians**2) for each in spreads if each is not None]
    metres, radians = np.sqrt(np.mean(squares, axis=0))
    return float(metres), float(radians)


def _place(pose: Pose) -> str:
    return f"({', '.join(f'{round(v or 0.0, 3) + 0.0:g}' for v in (pose.x, pose.y, pose.z))})".replace("-", "−")
