"""Time limits of tests in seconds of an ordinary machine: a slower one has more, as a fixed loop measures."""

from __future__ import annotations

import time
from functools import cache

ORDINARY_S = 0.008
"""Time of the loop on an ordinary machine."""


@cache
def measure_slowness() -> float:
    """How many times as long as an ordinary machine this one takes for a fixed loop, at least 1."""
    times = []
    for _ in range(5):
        start = time.process_time()
        sum(i * i for i in range(200_000))
        times.append(time.process_time() - start)
    return max(1.0, sorted(times)[2] / ORDINARY_S)


def allow(seconds: float) -> float:
    """The limit on this machine of what takes so long on an ordinary one."""
    return seconds * measure_slowness()
