"""Measure both sides of a benchmark, and write the rows of the table."""

from __future__ import annotations

import os
import resource
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from unittest import mock

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch import program
from hrsynth.batch.engine import Batch
from hrsynth.description import load
from hrsynth.geometry.so3 import convert_vectors_to_rotations
from hrsynth.geometry.vectors import Array

SIDE, TURNS = 201, 5
Row = tuple[str, str, str, str]
Run = Callable[[], object]


def spent() -> float:
    """Processor time until now (s), that of programs which were called included."""
    called = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + called.ru_utime + called.ru_stime


@contextmanager
def threads(count: int) -> Iterator[None]:
    """numba's sweeps on so many threads."""
    with mock.patch.object(program, "count_threads", return_value=count):
        yield


def least(*runs: Run, turns: int = TURNS, clock: Callable[[], float] = spent) -> list[float]:
    """The least processor time of each run (s), or time by another ``clock``, taken in turn."""
    best = [np.inf] * len(runs)
    for run in runs:
        run()
    for _ in range(turns):
        for i, run in enumerate(runs):
            start = clock()
            run()
            best[i] = min(best[i], clock() - start)
    return best


def alone(command: Sequence[str]) -> tuple[float, float]:
    """Processor time (s) and most memory (MB) of a command."""
    _, status, used = os.wait4(subprocess.Popen(command, stdout=subprocess.DEVNULL).pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)}: status {status}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def compiled(robot: str) -> tuple[ObservedRobot, Batch]:
    setup = ObservedRobot.of(load(robot))
    assert setup.batch is not None
    return setup, setup.batch


def plane(batch: Batch, size: float, phi: float = 0.0, side: int = SIDE) -> Array:
    """A square of poses around the zero configuration, rotated by phi about z; (side², 4, 4)."""
    steps = np.linspace(-size, size, side)
    X = np.tile(batch.home, (side * side, 1, 1))
    X[:, 0, 3] += np.repeat(steps, side)
    X[:, 1, 3] += np.tile(steps, side)
    X[:, :3, :3] = convert_vectors_to_rotations(np.array([0.0, 0.0, phi])) @ X[:, :3, :3]
    return X


def same(ours: Array, theirs: Array, tolerance: float) -> None:
    worst = float(np.nanmax(np.abs(ours - theirs)) / np.nanmax(np.abs(theirs)))
    if not worst <= tolerance:
        raise SystemExit(f"the two sides differ by {worst:.2g}, allowed: {tolerance:.2g}")


def compare(ours: str, what: str, mine: float, other: str, theirs: float, n: int, m: int | None = None) -> Row:
    rate, their_rate = n / mine, (m or n) / theirs
    return (
        what,
        f"{ours}: {spoken(rate)} poses/s",
        f"{other}: {spoken(their_rate)} poses/s",
        f"{rate / their_rate:.{0 if rate > 20 * their_rate else 1}f}",
    )


def spoken(rate: float) -> str:
    return f"{rate / 1e6:.2f} M" if rate > 1e4 else f"{rate:.0f}"
