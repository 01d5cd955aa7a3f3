"""Which leg alone misses a pose: of cranks with rods by their lengths."""

import re

import numpy as np
import pytest

import hrsynth
from hrsynth.errors import PoseReachFailure
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

LENGTH = 0.35
"""Of the first leg's crank and of its rod."""


def stretched() -> Mechanism:
    """A planar 3-RRR of which the first leg is stretched at zero, from (1, 0) to (0.3, 0)."""
    b = Builder("stretched")
    for link in ("base", "plate", *(f"{each}{k}" for each in ("crank", "rod") for k in range(3))):
        b.link(link)
    for k, angle in enumerate(2 * np.pi * np.arange(3) / 3):
        u = np.array([np.cos(angle), np.sin(angle), 0])
        bend = 0.4 * (k > 0) * np.array([-u[1], u[0], 0])
        for name, near, far, at in (
            (f"motor{k}", "base", f"crank{k}", u),
            (f"knee{k}", f"crank{k}", f"rod{k}", 0.65 * u + bend),
            (f"tip{k}", f"rod{k}", "plate", 0.3 * u),
        ):
            b.joint(
                name,
                "R",
                near,
                far,
                at,
                axis=(0, 0, 1),
                motor=name.startswith("motor"),
                loop=k > 0 and name.startswith("tip"),
            )
    return b.build(platform="plate")


@pytest.mark.parametrize(("x", "misses"), [(0.31, 0.0), (0.35, 0.0), (0.29, 10.0), (0.2, 100.0)])
def test_a_leg_that_is_stretched_at_zero_misses_only_what_is_too_far(x: float, misses: float) -> None:
    """A leg does not bend by itself: its tip at (1 − x) from its base misses what is beyond both lengths, nothing
    else."""
    assert max(0.0, 1000 * ((1 - x) - 2 * LENGTH)) == pytest.approx(misses, abs=1e-9)
    with pytest.raises(PoseReachFailure) as refused:
        hrsynth.check(stretched(), at=f"x={x - 0.3},y=0,phi=0")  # the plate's frame lies at the origin at zero
    told = re.search(r"leg 1 alone misses it by ([\d.]+) mm", str(refused.value))
    assert (float(told[1]) if told else 0.0) == pytest.approx(misses, rel=1e-3)
