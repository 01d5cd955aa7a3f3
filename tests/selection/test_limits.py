"""Poses beyond the limits of a joint are told by every question about poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.description import list_robots, load

LIMIT = 0.05


@pytest.fixture
def limited(tmp_path: Path) -> Path:
    """A 3-RRR whose first motor turns by so much either way."""
    path = tmp_path / "limited.urdf"
    path.write_text(
        list_robots()["3rrr_m1"]
        .read_text()
        .replace(
            '<joint name="shoulder_1" type="continuous">',
            f'<joint name="shoulder_1" type="revolute">'
            f'<limit lower="{-LIMIT}" upper="{LIMIT}" effort="1" velocity="1"/>',
        )
    )
    return path


def crank(x: float) -> float:
    """How far the first crank turns where the platform is moved by x: two circles."""
    joints = load("3rrr_m1").joints
    A, E, W = (joints[name].point[:2] for name in ("shoulder_1", "elbow_1", "wrist_1"))
    r, s, to = np.linalg.norm(E - A), np.linalg.norm(W - E), W + [x, 0] - A
    side = np.sign((W - A)[0] * (E - A)[1] - (W - A)[1] * (E - A)[0])
    d = np.linalg.norm(to)
    angle = np.arctan2(to[1], to[0]) + side * np.arccos((r**2 + d**2 - s**2) / (2 * r * d))
    return float((angle - np.arctan2(*(E - A)[::-1]) + np.pi) % (2 * np.pi) - np.pi)


def test_poses_beyond_limits_are_named(limited: Path):
    values = np.linspace(-0.04, 0.04, 9)
    beyond = [abs(crank(x)) > LIMIT for x in values]
    assert 0 < sum(beyond) < len(beyond)
    found = hrsynth.accuracy(limited, cone="0.1deg", at=[f"x={x},y=0,phi=0" for x in values])
    assert [each.beyond_limits for each in found.poses] == [("shoulder_1",) if far else () for far in beyond]
    assert "exceeded: shoulder_1" in str(found)
    checked = str(hrsynth.check(limited, grid="x=-0.04:0.04:9,y=0,phi=0"))
    assert f"{sum(beyond)} beyond joint limits" in checked
    assert f"{sum(beyond)} poses beyond joint limits" in str(
        hrsynth.accuracy(limited, cone="0.1deg", grid="x=-0.04:0.04:9,y=0,phi=0")
    )
    for robot in (limited, "3rrr_m1"):
        assert "limits" not in str(hrsynth.accuracy(robot, cone="0.1deg", at="x=0,y=0,phi=0"))


@pytest.mark.parametrize("x", [0.02, -0.02, 0.005])
def test_ends_beyond_limits_discard_all_sets(limited: Path, x: float):
    start, goal = "x=0,y=0,phi=0", f"x={x},y=0,phi=0"
    for name, ends in {"goal": (start, goal), "start": (goal, start)}.items():
        found = hrsynth.select(limited, start=ends[0], goal=ends[1], runs=0, equilibria=0)
        reason = f"the {name} is beyond the limits of shoulder_1"
        told = [each.discarded for each in found.candidates if each.legs == ("1", "2", "3")]
        assert told == [reason if abs(crank(x)) > LIMIT else None]
        assert bool(found.kept) == (abs(crank(x)) <= LIMIT)
