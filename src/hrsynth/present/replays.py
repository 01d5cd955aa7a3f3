"""The table of servo runs that the papers print, beside what the same runs do here."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from ..description import load, shipped
from ..families.replays import REPLAYS, Replay
from ..mechanism.pose import Pose
from ..simulation.result import Servo
from ..simulation.servo import servo
from .markdown import table as markdown

START = "<!-- generated: replays -->"
HEADS = ("source", "robot", "legs", "noise", "printed", "computed", "agree?", "word")
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
    return servo(load(shipped()[replay.robot]), replay.legs, start=replay.way[0], goal=replay.way[1], gain=replay.gain,
                 noise=replay.noise, physics=replay.physics,
                 time=BENCH_LASTS / replay.gain if replay.physics else None, seed=seed)


def table(replays: Sequence[Replay] = REPLAYS) -> str:
    """The Markdown table of all replays."""
    return markdown(HEADS, map(row, replays))


def row(replay: Replay) -> tuple[str, ...]:
    """One run's row."""
    found = compute_run(replay)
    here = found.ended
    if found.spread is not None:
        s = found.spread
        metres, radians = _error(replay)
        turns = found.setting.motion.rotations.shape[1]
        here += f" ± {1e3 * metres:.2g} mm" + (f", {radians:.1g} rad" if turns else "")
        if s.aside:
            here += f", about {_place(Pose(*s.mean))}"
    else:
        here += f" {_place(found.pose)}"
    noise = "–" if replay.noise is None else replay.noise if "deg" in replay.noise else f"{replay.noise} rad, bench"
    return (replay.source, f"`{replay.robot}`", ", ".join(replay.legs), noise, f"{replay.ended} {replay.said}",
            here, _agrees(replay, found), replay.remark)


def _agrees(replay: Replay, found: Servo) -> str:
    """Whether the ending is the printed one, and for accuracies whether their order is."""
    same = "yes" if found.ended == replay.ended else "no"
    if not replay.order:
        return same
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
            return f"{same}; order of errors no"
    return f"{same}; order of errors yes"


def _error(replay: Replay) -> tuple[float, float]:
    """The root mean square error of all draws together (m, rad)."""
    draws = DRAWS if replay.order and not replay.physics else 1
    spreads = [compute_run(replay, seed).spread for seed in range(draws)]
    squares = [(each.rms_metres ** 2, each.rms_radians ** 2) for each in spreads if each is not None]
    metres, radians = np.sqrt(np.mean(squares, axis=0))
    return float(metres), float(radians)


def _place(pose: Pose) -> str:
    return f"({', '.join(f'{round(v or 0.0, 3) + 0.0:g}' for v in (pose.x, pose.y, pose.z))})".replace("-", "−")
