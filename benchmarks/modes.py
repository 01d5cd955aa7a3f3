"""Time until all modes of random platforms take, with their proof, next to Newton's method from many starts.

    python benchmarks/modes.py [instances]

Median and 90 % quantile of processor time in ms after imports. Newton's method (100 real starts, 30 rounds, in one
NumPy batch) proves nothing and may miss modes; how often it did is printed beside it. msolve (where it is installed)
solves the same systems in the pose's own coordinates, its own processor time with ours; how often it differs in the
number of modes is printed too. Families with tips on surfaces that only msolve solves come last.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from analysis.modes.draws import FAMILIES, MEETING, SURFACES
from analysis.modes.laws import installed
from analysis.modes.newton import real_ones, solutions
from hrsynth.solving.platform.constrained_platform import System
from hrsynth.solving.platform.solve import SystemModes, solve, solve_by_msolve

BASELINE = 20
"""Instances on which Newton's method is tried."""

EXTERNAL = 3
"""Instances on which msolve is tried."""


def timed(solver: Callable[[System], SystemModes], system: System) -> tuple[float, SystemModes]:
    """Processor time in ms, that of subprocesses included, and the modes."""
    before = sum(os.times()[:4])
    found = solver(system)
    return 1e3 * (sum(os.times()[:4]) - before), found


def against_newton(systems: Sequence[System], median: float) -> str:
    newton, missed = [], 0
    for seed, system in enumerate(systems):
        start = time.process_time()
        found = solutions(system, 100, np.random.default_rng(seed), real=True, rounds=30)
        newton.append(1e3 * (time.process_time() - start))
        missed += len(real_ones(found)) < len(solve(system).modes)
    return f"{np.median(newton):9.1f}{np.median(newton) / median:7.0f}{missed:6} of {len(newton)}"


def against_msolve(systems: Sequence[System], median: float) -> str:
    runs = [timed(solve_by_msolve, system) for system in systems]
    differ = sum(len(found.modes) != len(solve(system).modes) for (_, found), system in zip(runs, systems, strict=True))
    spent = np.median([ms for ms, _ in runs])
    return f"{spent:10.0f}{spent / median:7.0f}{differ:6} of {len(runs)}"


def main(instances: int) -> None:
    print(
        f"{'family':46}{'median':>8}{'90 %':>8}{'Newton':>9}{'ratio':>7}{'missed':>10}{'msolve':>10}{'ratio':>7}"
        f"{'differ':>10}"
    )
    for name, family in (FAMILIES | MEETING).items():
        systems = [family.draw(np.random.default_rng(seed)).system for seed in range(instances)]
        solve(systems[0])
        spent = []
        for system in systems:
            start = time.process_time()
            solve(system)
            spent.append(1e3 * (time.process_time() - start))
        median, late = float(np.median(spent)), np.quantile(spent, 0.9)
        newton = against_newton(systems[:BASELINE], median) if name in FAMILIES else " " * 26
        external = against_msolve(systems[:EXTERNAL], median) if installed() else ""
        print(f"{name:46}{median:8.2f}{late:8.2f}{newton}{external}", flush=True)
    for name, family in SURFACES.items() if installed() else ():
        systems = [family.draw(np.random.default_rng(seed)).system for seed in range(EXTERNAL)]
        spent = [timed(solve, system)[0] for system in systems]
        print(f"{name:46}{np.median(spent):8.0f}{np.quantile(spent, 0.9):8.0f}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
