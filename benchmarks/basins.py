"""Time of `hrsynth basins`: starts of a plane, batched, as many processes as cores, against one `servo` for each
(a few of them), in one run; then the same share of the work in one process, by processor time.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/basins.py [STARTS A SIDE [SINGLE RUNS]]
"""

from __future__ import annotations

import os
import sys
import time

import hrsynth

CASES = (
    ("quattro", "1,4", "x=0,y=0,z=-0.7,phi=0", "x=-0.3:0.3:{0},y=-0.3:0.3:{0},z=-0.7,phi=0"),
    ("quattro", None, "x=0,y=0,z=-0.7,phi=0", "x=-0.3:0.3:{0},y=-0.3:0.3:{0},z=-0.7,phi=0"),
    ("3rrr_m1", None, "x=0,y=0,phi=0", "x=-0.1:0.1:{0},y=-0.1:0.1:{0},phi=0"),
)
"""Robot, legs, goal and starts."""


def main(side: int = 100, single: int = 10) -> None:
    """Print the table."""
    print(
        f"| robot | legs | starts | batched, {os.cpu_count()} processes (s) | one process, processor (s) "
        "| one by one (s a run) | ratio |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    for name, legs, goal, grid in CASES:
        hrsynth.observe(name, legs)
        began = time.perf_counter()
        found = hrsynth.basins(name, legs, goal=goal, grid=grid.format(side))
        passed = time.perf_counter() - began
        began = time.process_time()
        hrsynth.basins(name, legs, goal=goal, grid=grid.format(side), jobs=1)
        spent = time.process_time() - began
        poses = [pose for pose, cell in zip(found.grid.poses(), found.cells.ravel(), strict=True) if cell >= 0]
        chosen = poses[:: max(1, len(poses) // single)][:single]
        began = time.process_time()
        for pose in chosen:
            hrsynth.servo(name, legs, start=pose, goal=goal)
        each = (time.process_time() - began) / len(chosen)
        print(
            f"| {name} | {legs or 'all'} | {found.starts:,} | {passed:.1f} | {spent:.1f} | {each:.2f} "
            f"| {each * found.starts / spent:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
