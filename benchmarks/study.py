"""A study in parallel processes: singularity distances of 1,000 poses of 20 robots, 50 of each.

OMP_NUM_THREADS=1 python benchmarks/study.py [JOBS]
"""

from __future__ import annotations

import sys
import time

import hrsynth

ROBOTS = list(hrsynth.list_robots())[:20]
POSES = 50


def singular_values(robot: object) -> list[float | None]:
    """The smallest singular value of Mᵀ at random reachable poses of a robot."""
    setup = hrsynth.observe(robot, samples=POSES)
    poses = [at.pose(setup.motion.link) for at in setup.configurations]
    return [hrsynth.check(setup, at=pose).postures[0].distances.type2 for pose in poses]


if __name__ == "__main__":
    start = time.perf_counter()
    found = hrsynth.map_robots(singular_values, ROBOTS, jobs=int(sys.argv[1]) if len(sys.argv) > 1 else None)
    took = time.perf_counter() - start
    for name, values in zip(ROBOTS, found, strict=True):
        known = [value for value in values if value is not None]
        print(f"{name:20} {len(values)} poses, smallest singular value {min(known, default=float('nan')):.3g}")
    print(f"{sum(map(len, found))} poses of {len(found)} robots in {took:.1f} s")
