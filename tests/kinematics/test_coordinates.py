"""A platform's own coordinates: as many as its freedoms, independent, with the Jacobian of their errors."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.analysis.setting import prepare
from hrsynth.description import load
from hrsynth.kinematics.coordinates import Coordinates

EXPECTED = {
    "rrrrr_m1": ("x", "y"),
    "3rrr_m1": ("x", "y", "phi"),
    "3rps": ("z", "turn about x", "turn about y"),
    "delta": ("x", "y", "z"),
    "quattro": ("x", "y", "z", "phi"),
    "gough_stewart": ("x", "y", "z", "turn about x", "turn about y", "turn about z"),
}


def made(name: str) -> tuple[Coordinates, object]:
    setting = prepare(load(name))
    start = setting.everything.start
    return Coordinates.of(start, setting.everything.question, setting.motion), setting


@pytest.mark.parametrize("name", EXPECTED)
def test_a_platform_has_as_many_coordinates_as_freedoms(name: str):
    coordinates, setting = made(name)
    assert coordinates.names == EXPECTED[name]
    assert len(coordinates.names) == setting.dof


@pytest.mark.parametrize("name", ["quattro", "gough_stewart", "3rps"])
def test_the_jacobian_is_that_of_the_error(name: str):
    coordinates, setting = made(name)
    step = 1e-6
    for at in setting.configurations[:3]:
        rows = coordinates.rows(at.twin, at.q)[1]
        for k, direction in enumerate(np.eye(at.twin.nv)):
            ahead, behind = (coordinates.rows(at.twin, at.twin.moved(at.q, s * direction))[0] for s in (step, -step))
            assert rows[:, k] == pytest.approx((ahead - behind) / (2 * step), abs=1e-7)


def test_half_the_way_has_half_the_coordinates():
    coordinates, setting = made("gough_stewart")
    X = setting.configurations[0].pose(setting.motion.link)
    half = coordinates.towards(X, 0.5)
    assert half.values == pytest.approx((coordinates.read(X) + coordinates.values) / 2)
    assert coordinates.towards(X, 1.0).values == pytest.approx(coordinates.values)


@pytest.mark.parametrize("name", ["rrrrr_m1", "3rps"])
def test_one_coordinate_changes_in_equal_steps_and_the_others_stay(name: str):
    coordinates, setting = made(name)
    start = setting.everything.start
    for index, place in enumerate(coordinates.places):
        way = coordinates.along(start, index, (0.05, 0.1), 4)
        values = np.array([value for value, _ in way])
        home = int(np.argmin(np.abs(values - coordinates.values[index])))
        for side in (values[: home + 1], values[home:]):
            assert np.ptp(np.diff(side)) < 1e-9
        for value, at in way:
            wanted = coordinates.values.copy()
            wanted[index] = value
            assert coordinates.read(at.pose(setting.motion.link)) == pytest.approx(wanted, abs=1e-8), place
