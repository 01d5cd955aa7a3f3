"""Time of a hidden robot of three image points, and of one of three directions: ``python benchmarks/sensors.py``."""

from __future__ import annotations

from measure import least

from hrsynth.analysis.derive import derive
from hrsynth.analysis.result_cache import clear_cache

ROBOT = "gough_stewart"
POINTS = [f"point:platform@{at}" for at in ("0.1,0,0", "-0.1,0.1,0", "0,0.1,0.1")]


def check(**options: object) -> None:
    """Run the analysis without caches."""
    clear_cache()
    derive(ROBOT, **options)  # type: ignore[arg-type]


if __name__ == "__main__":
    directions, points = least(
        lambda: check(observe="1,2,3"), lambda: check(camera="cam=base@0.3,0.1,0", sensor=POINTS)
    )
    print(f"three directions {directions:.3f} s, three image points {points:.3f} s: {points / directions:.2f} times")
