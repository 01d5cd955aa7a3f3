"""Response times of the studio: moves a second of each shipped robot along its sliders, the hidden robot beside it,
and the time until a leg that is ticked is judged. One process, by processor time and by the clock.

    OMP_NUM_THREADS=1 python benchmarks/studio.py [ROBOT …]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import hrsynth
from hrsynth.present.studio.analysis_service import AnalysisService

STEPS = 20
DESK = AnalysisService()


def took(ask: Callable[[], Any]) -> tuple[Any, float, float]:
    """The answer, and seconds of processor time and by the clock."""
    spent, began = time.process_time(), time.perf_counter()
    answer = ask()
    return answer, time.process_time() - spent, time.perf_counter() - began


def moves(robot: dict[str, str]) -> Iterator[tuple[float, float, float]]:
    """Seconds by both clocks, and the residual, of each step along each slider to a third of its way."""
    scene = DESK.answer({"ask": "open", "robot": robot})
    DESK.answer({"ask": "move", "robot": robot, "hidden": True})
    for number, slider in enumerate(scene["sliders"]):
        values, here = [*scene["values"]], None
        for _ in range(STEPS):
            values[number] += (slider["max"] - slider["home"]) / (3 * STEPS)
            asked = {"ask": "move", "robot": robot, "values": [*values], "here": here, "hidden": True}
            moved, spent, passed = took(lambda asked=asked: DESK.answer(asked))  # type: ignore[misc]
            here = moved["here"]
            yield spent, passed, moved["residual"]


def main(*names: str) -> None:
    """Print the table."""
    print("| robot | moves a second (processor, clock) | slowest (s) | residual | first verdict (s) | a leg less (s) |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in names or hrsynth.list_robots():
        robot = {"source": f"shipped:{name}"}
        _, _, first = took(lambda robot=robot: DESK.answer({"ask": "watch", "robot": robot}))  # type: ignore[misc]
        legs = [leg["name"] for leg in DESK.answer({"ask": "open", "robot": robot})["legs"] if leg["watched"]]
        fewer = {"ask": "watch", "robot": robot, "watch": legs[1:]}
        _, _, less = took(lambda fewer=fewer: DESK.answer(fewer))  # type: ignore[misc]
        spent, passed, residual = np.array(list(moves(robot))).T
        print(
            f"| {name} | {1 / np.median(spent):.0f}, {1 / np.median(passed):.0f} | {passed.max():.3f} "
            f"| {residual.max():.0e} | {first:.2f} | {less:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
