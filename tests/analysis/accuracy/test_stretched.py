"""Errors at a pose with a stretched leg, of which the direction is no function of the pose, but the pose of it."""

from itertools import product

import numpy as np
import pytest

import hrsynth
from hrsynth.geometry.vectors import Array
from kinematics.test_leg_reach import stretched


def closed(directions: Array) -> Array:
    """The pose x, y, φ of the plate, counted from zero, for the angles of the rods: Newton's method on pose and cranks,
    from the stretched pose."""
    angles = 2 * np.pi * np.arange(3) / 3
    base, tips = (r * np.stack([np.cos(angles), np.sin(angles)], axis=1) for r in (1.0, 0.3))
    knees = 0.65 * base + 0.4 * np.array([[0], [1], [1]]) * np.stack([-base[:, 1], base[:, 0]], axis=1)
    cranks, rods = np.linalg.norm(knees - base, axis=1), np.linalg.norm(tips - knees, axis=1)
    v = np.array([0.0, 0.0, 0.0, *np.arctan2(*(knees - base).T[::-1])])

    def error(v: Array) -> Array:
        R = np.array([[np.cos(v[2]), -np.sin(v[2])], [np.sin(v[2]), np.cos(v[2])]])
        ends = (
            base
            + cranks[:, None] * np.stack([np.cos(v[3:]), np.sin(v[3:])], axis=1)
            + rods[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=1)
        )
        return np.ravel(ends - (v[:2] + tips @ R.T))

    for _ in range(30):
        J = np.stack([(error(v + h) - error(v - h)) / 2e-6 for h in 1e-6 * np.eye(6)], axis=1)
        v = v - np.linalg.solve(J, error(v))
    assert np.abs(error(v)).max() < 1e-12
    return np.asarray(v[:3])


@pytest.mark.slow
def test_errors_at_a_stretched_leg() -> None:
    angles = 2 * np.pi * np.arange(3) / 3
    tips, base = (r * np.stack([np.cos(angles), np.sin(angles)], axis=1) for r in (0.3, 1.0))
    knees = 0.65 * base + 0.4 * np.array([[0], [1], [1]]) * np.stack([-base[:, 1], base[:, 0]], axis=1)
    rods = np.arctan2(*(tips - knees).T[::-1])
    by = np.radians(0.1)
    poses = np.array([closed(rods + by * np.array(signs)) for signs in product((-1, 1), repeat=3)])
    found = hrsynth.accuracy(stretched(), cone="0.1deg", at="x=0,y=0,phi=0", nonlinear=4)
    text = str(found)
    assert "no Mᵀ at the pose" in text
    assert "inf" not in text.replace("infinite", "")
    assert np.degrees(np.abs(poses[:, 2]).max()) == pytest.approx(
        float(text.partition("orientation")[2].split()[0]), rel=0.02
    )
    assert 1e3 * np.linalg.norm(poses[:, :2], axis=1).max() == pytest.approx(
        float(text.partition("position")[2].split()[0]), rel=0.02
    )
