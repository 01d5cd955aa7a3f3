"""What the tests of singularities share: answers, each found once with a few points."""

from __future__ import annotations

from functools import cache

from hrsynth.analysis.singularity.singularities import Singularity, singularities
from hrsynth.description import load

POINTS = 100


@cache
def found(robot: str, legs: str | None = None, *, camera: str | None = None, real: bool = False) -> Singularity:
    """The answer for a shipped robot; ``legs`` as on the command line."""
    return singularities(load(robot), None if legs is None else legs.split(","), camera, real=real, points=POINTS)
