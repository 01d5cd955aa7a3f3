"""Time limits of tests in seconds of an ordinary machine: a slower one has more, as a fixed loop measures."""

from __future__ import annotations

import time

ORDINARY_S = 0.008
"""Time of the loop on an ordinary machine."""
_measured = [1.0]


def measure_slowness() -> float:
    """How many times as long as an ordinary machine this one takes for a fixed loop, at least 1: the most that was
    measured here, for other work may slow it down at any time."""
    times = []
    for _ in range(5):
        start = time.process_time()
        sum(i * i for i in range(200_000))
        times.append(time.process_time() - start)
    _measured.append(sorted(times)[2] / ORDINARY_S)
    return max(_measured)


def allow(seconds: float) -> float:
    """The limit on this machine of what takes so long on an ordinary one."""
    return seconds * measure_slowness()


measure_slowness()
