"""Bodies that nothing holds, seen by cameras: random geometry from a seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import observe
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism
from hrsynth.mechanism.observations import list_kinds as known
from strategies import random_direction, random_rotation


def written(values: Sequence[float] | Array) -> str:
    return ",".join(f"{float(v):.6f}" for v in values)


def free_body(rng: np.random.Generator) -> Mechanism:
    """About 1.2 m before the base's origin, turned any way."""
    at = (*rng.uniform(-0.2, 0.2, 2), rng.uniform(1.0, 1.4))
    builder = Builder("body")
    builder.link("base")
    builder.link("platform", at, random_rotation(rng))
    builder.joint("free", "6", "base", "platform", at)
    return builder.build(platform="platform")


def watched(kinds: Sequence[str], seed: int, cameras: bool = False) -> ObservedRobot:
    """A free body with random observations of these kinds by one camera on the base, or one for each."""
    rng = np.random.default_rng(seed)
    body = free_body(rng)
    eyes = [
        f"eye_{k}=base@{written(rng.uniform(-0.2, 0.2, 3))}/{written(rng.uniform(-0.2, 0.2, 3))}"
        for k in range(len(kinds) if cameras else 1)
    ]
    sensor = []
    for k, kind in enumerate(kinds):
        needs = known()[kind].needs
        at, axis = written(rng.uniform(-0.4, 0.4, 3)), written(random_direction(rng))
        sensor.append(
            f"eye_{k if cameras else 0}={kind}:platform"
            + (f"@{at}" if "at" in needs else "")
            + (f"/{axis}" if "axis" in needs else "")
            + ("/0.05" if "radius" in needs else "")
        )
    return observe(body, camera=eyes, sensor=sensor, samples=4)
