"""Paradoxical linkages: what the engine says of their mobility, constraints and modes, by Denavit and Hartenberg."""

from __future__ import annotations

import numpy as np
import pytest

import hrsynth
from families.linkages import LINKAGES, Linkage
from hrsynth.geometry.vectors import Array, rotation_about


def drawn(name: str, seed: int) -> tuple[Linkage, Array, Array]:
    """A linkage, closed angles, and how its base is turned."""
    rng = np.random.default_rng(seed)
    linkage = LINKAGES[name](rng)
    return linkage, linkage.regular(rng), rotation_about(rng.normal(size=3), rng.uniform(0, 3))


def check_mobility(name: str, seed: int) -> None:
    """One freedom where Kutzbach's formula has n − 6; 7 − n constraints of the one loop repeat others."""
    linkage, zero, tilt = drawn(name, seed)
    count = len(linkage.lengths)
    values = np.linalg.svd(linkage.axes(zero), compute_uv=False)
    assert values[count - 1] < 1e-9 < values[count - 2]
    found = hrsynth.check(linkage.mechanism(name, zero, tilt))
    (posture,) = found.postures
    assert (posture.mobility.total, posture.mobility.idle, posture.dof) == (1, 0, 1)
    ((rows, loop),) = [(each.rows, each.loop) for each in found.redundant]
    assert rows == 7 - count
    assert loop in found.setting.mechanism.joints


def check_modes(name: str, seed: int, starts: int) -> int:
    """With one joint driven the modes that are found are those that random starts of the closure equations find."""
    linkage, zero, tilt = drawn(name, seed)
    mechanism = linkage.mechanism(name, zero, tilt)
    found = hrsynth.modes(mechanism, real=True)
    assert found.found.continuum is None
    frame = np.eye(4)
    frame[:3, :3] = tilt
    frame = frame @ linkage.frames(zero)[1]
    platform = mechanism.platform
    back = np.linalg.inv(mechanism.links[platform].pose)
    told = [np.linalg.inv(frame) @ mode.bodies[platform] @ back @ frame for mode in found.modes if mode.bodies]
    ends = linkage.closed(np.random.default_rng(seed + 100), starts, zero[1])
    assert ends
    for end in ends:
        if np.linalg.svd(np.delete(linkage.axes(end), 1, 1), compute_uv=False)[-1] > 1e-4:  # no singular closure
            assert min(np.abs(linkage.moved(end, zero) - each).max() for each in told) < 1e-6
    return len(told)


@pytest.mark.parametrize("name", LINKAGES)
def test_a_paradoxical_linkage_has_one_freedom(name: str):
    check_mobility(name, 1)


@pytest.mark.parametrize("name", ["bennett", "myard", "schatz"])
def test_the_modes_of_a_driven_linkage_are_found(name: str):
    assert check_modes(name, 1, 10) >= 1


@pytest.mark.slow
@pytest.mark.parametrize("name", LINKAGES)
def test_many_linkages(name: str):
    for seed in range(2, 5):
        check_mobility(name, seed)
        check_modes(name, seed, 12)
