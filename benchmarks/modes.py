"""How long all modes of random platforms take, with their proof, next to Newton's method from many starts.

    python benchmarks/modes.py [instances]

Median and 90 % quantile of processor time in ms after imports. Newton's method (100 real starts, 30 rounds, in one
NumPy batch) proves nothing and may miss modes; how often it did is printed beside it.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from analysis.modes.draws import FAMILIES
from analysis.modes.newton import real_ones, solutions
from hrsynth.analysis.modes.solve import solve

BASELINE = 20
"""Instances on which Newton's method is tried."""


def main(instances: int) -> None:
    print(f"{'family':46}{'median':>8}{'90 %':>8}{'Newton':>9}{'ratio':>7}{'missed':>9}")
    for name, family in FAMILIES.items():
        systems = [family.draw(np.random.default_rng(seed)).system for seed in range(instances)]
        solve(systems[0])
        spent = []
        for system in systems:
            start = time.process_time()
            solve(system)
            spent.append(1e3 * (time.process_time() - start))
        newton, missed = [], 0
        for seed, system in enumerate(systems[:BASELINE]):
            start = time.process_time()
            found = solutions(system, 100, np.random.default_rng(seed), real=True, rounds=30)
            newton.append(1e3 * (time.process_time() - start))
            missed += len(real_ones(found)) < len(solve(system).modes)
        median, late = np.median(spent), np.quantile(spent, 0.9)
        print(f"{name:46}{median:8.2f}{late:8.2f}{np.median(newton):9.1f}{np.median(newton) / median:7.0f}"
              f"{missed:6} of {len(newton)}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
