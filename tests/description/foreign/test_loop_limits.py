"""Limits of the joint that closes a loop count from the zero configuration, also where the file has another one."""

from __future__ import annotations

import re
from math import acos, atan2, cos, hypot, sin
from pathlib import Path

import pytest

import hrsynth
from description.samples import FOUR_BAR
from hrsynth.description import load

LIMIT = '<limit lower="-0.3" upper="0.4" effort="1" velocity="1"/>'
BARS = FOUR_BAR.replace('<axis xyz="0 1 0"/>\n  </loop>', f'<axis xyz="0 1 0"/>{LIMIT}</loop>')
"""A parallelogram: crank and rocker of 1 m along z, two metres apart."""


def closed(a: float) -> tuple[float, float, float]:
    """The turns about y of knee, rocker and tip (bar on rocker) where the crank has turned by a, of an uneven four-bar:
    crank 1 m, bar 2 m, rocker 1.2 m, ground 2 m, by the triangle of knee, tip and the rocker's foot."""
    x, z = sin(a), cos(a)
    gap = hypot(2 - x, z)
    along = atan2(-z, 2 - x)
    bar = along + acos((4 + gap * gap - 1.44) / (4 * gap))
    tip = x + 2 * cos(bar), z + 2 * sin(bar)
    return -bar, atan2(tip[0] - 2, tip[1]), 0.0


def uneven(folder: Path) -> tuple[Path, float, float]:
    """The four-bar as a file with the crank upright at zero, and how rocker and bar turn while the crank turns 0.3."""
    (bar_0, rocker_0, _), (bar_1, rocker_1, _) = closed(0.0), closed(0.3)
    text = BARS.replace('<origin xyz="0 0 1"/>\n    <axis', f'<origin xyz="0 0 1" rpy="0 {bar_0!r} 0"/>\n    <axis', 1)
    pivot = '<origin xyz="2 0 0"{}/>\n    <axis'
    text = text.replace(pivot.format(""), pivot.format(f' rpy="0 {rocker_0!r} 0"'), 1)
    text = re.sub(r'(<predecessor link="rocker">\s*<origin xyz=")0 0 1', r"\g<1>0 0 1.2", text)
    path = folder / "bars.urdf"
    path.write_text(text)
    return path, rocker_1 - rocker_0, bar_1 - bar_0


def test_of_a_keyframe(tmp_path: Path):
    path, rocker, bar = uneven(tmp_path)
    values = {"a": 0.3, "b": bar - 0.3, "c": rocker}
    (tmp_path / "bars.srdf").write_text(
        '<robot name="four_bar"><group_state name="up" group="g">'
        + "".join(f'<joint name="{name}" value="{value!r}"/>' for name, value in values.items())
        + "</group_state></robot>"
    )
    limits = load(path, keyframe=f"{tmp_path / 'bars.srdf'}:up").joints["d"].limits
    assert limits is not None
    assert (limits.lower, limits.upper) == pytest.approx((-0.3 - (bar - rocker), 0.4 - (bar - rocker)), abs=1e-9)


def test_of_a_mended_file(tmp_path: Path):
    """The knee's origin turned by 0.2: the file is open, and mended at another zero; the true four-bar is the judge."""
    path, _, _ = uneven(tmp_path)
    text = path.read_text()
    turned = re.sub(r'rpy="0 (\S+) 0"', lambda found: f'rpy="0 {float(found[1]) + 0.2!r} 0"', text, count=1)
    path.write_text(turned)
    hrsynth.lint(path, fix=True, output=tmp_path / "mended.urdf")
    robot = load(tmp_path / "mended.urdf")
    bar, rocker, crank = (robot.links[name].pose for name in ("bar", "rocker", "crank"))
    a = atan2(crank[0, 2], crank[0, 0])
    assert (atan2(bar[0, 2], bar[0, 0]), atan2(rocker[0, 2], rocker[0, 0])) == pytest.approx(closed(a)[:2], abs=1e-9)
    tip = closed(a)[0] - (closed(0.0)[0] + 0.2) - (closed(a)[1] - closed(0.0)[1])
    found = robot.joints["d"].limits
    assert found is not None
    assert (found.lower, found.upper) == pytest.approx((-0.3 - tip, 0.4 - tip), abs=1e-9)
