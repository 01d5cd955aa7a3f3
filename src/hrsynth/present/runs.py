"""A servo run → a picture: errors, position and turn against time, and the way (MMT Figs. 22-29)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..geometry.vectors import Array
from ..simulation.result import Servo
from ..tolerances import REST_OF_RUN, UNMOVED
from .plots import panels, png

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours that colour-blind readers tell apart."""
STYLES = ("solid", "dashed", "dashdot", "dotted", "solid", "dashed")


def picture(found: Servo) -> bytes:
    """The run as PNG."""
    figure, (errors, places, turns, way) = panels(2, 2, 10.0, 7.6)
    times = found.run.times
    for i, observation in enumerate(found.setting.observed):
        errors.plot(times, found.errors[:, i], color=COLOURS[i % 6], linestyle=STYLES[i % 6],
                    label=f"leg {observation.leg}")
    errors.set(ylabel=r"error of the direction $\|e_i\|$", ylim=(0, None))
    errors.legend(frameon=False)
    path, goal = found.way, found.goal_position
    moved = [i for i in range(3) if np.ptp(path[:, i]) > UNMOVED or abs(path[-1, i] - goal[i]) > UNMOVED] or [0]
    for i in moved:
        places.plot(times, path[:, i] - goal[i], color=COLOURS[i], linestyle=STYLES[i], label="xyz"[i])
    places.set(ylabel="position minus that of the goal (m)")
    places.legend(frameon=False)
    if found.turns.max() > UNMOVED:
        turns.plot(times, np.degrees(found.turns), color=COLOURS[0])
        turns.set(ylabel="turn away from the goal (degrees)", ylim=(0, max(1.0, 1.1 * np.degrees(found.turns.max()))))
    else:
        turns.plot(times, found.track.smallest, color=COLOURS[0])
        turns.set(ylabel="smallest singular value of $M^T$", ylim=(0, None))
    for place in (errors, places, turns):
        place.axhline(0, color="0.6", linewidth=0.8)
        place.set(xlabel="time (s)", xlim=(0, _until(found) or 1.0))
    _draw_way(way, found, path, goal)
    legs = ", ".join(found.setting.labels)
    figure.suptitle(f"{found.setting.robot.name}, legs {legs} observed: ended at {_ENDS[found.ended]}\n"
                    f"from {found.start} to {found.goal}", fontsize=10)
    return png(figure)


_ENDS = {"goal": "the goal", "mode": "another assembly mode", "antipodal": "an antipodal pose",
         "local minimum": "a local minimum", "boundary": "a boundary of the workspace", "time": "the end of its time",
         "undecided": "a place that is not decided"}


def _until(found: Servo) -> float:
    """The time (s) after which nothing is left to be seen."""
    sizes = found.errors.max(axis=1)
    late = np.nonzero(sizes > REST_OF_RUN * sizes.max())[0]
    return float(found.run.times[min(late[-1] + 1, len(sizes) - 1)]) if len(late) else float(found.run.times[-1])


def _draw_way(way: Any, found: Servo, path: Array, goal: Array) -> None:
    """The way in the plane of the two coordinates that change most, with start, goal, end, and the other modes."""
    modes = [] if found.ending.modes is None else [mode for mode in found.ending.modes.modes if not mode.goal]
    ends = np.array([[getattr(mode.pose, name) for name in "xyz"] for mode in modes]).reshape(-1, 3)
    spread = np.ptp(np.vstack([path, goal, ends]), axis=0)
    i, j = sorted(np.argsort(spread)[-2:])
    way.plot(path[:, i], path[:, j], color=COLOURS[0])
    way.plot(*path[0, [i, j]], "s", color="black", label="start")
    way.plot(*goal[[i, j]], "*", markersize=15, color=COLOURS[2], label="goal")
    if len(ends):
        way.plot(ends[:, i], ends[:, j], "D", markerfacecolor="none", color=COLOURS[3], label="other modes")
    way.plot(*path[-1, [i, j]], "o", markersize=7, markerfacecolor="none", markeredgewidth=2, color=COLOURS[1],
             label="end")
    for passage in found.track.passages or ():
        way.plot(*path[passage.place, [i, j]], "x", markersize=10, color="crimson", label="crossing")
    way.set(xlabel=f"{'xyz'[i]} (m)", ylabel=f"{'xyz'[j]} (m)")
    way.set_aspect("equal", adjustable="datalim")
    way.legend(frameon=False)
