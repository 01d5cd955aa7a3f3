"""Curves and surfaces as the checker reads them: in rational working coordinates, circles exactly round."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from ..geometry.loci import Circle, Line, Point, Reach, Sphere
from ..geometry.so3 import convert_to_quaternions
from ..geometry.vectors import cross, normalise_vector
from ..solving.platform.quadrics import UNIT, RoundedConic, WorkingFrame, build_spokes, convert_direction
from .closures import round_numbers, write_numbers
from .verify_certificate import dot


def point_on(curve: Reach, frame: WorkingFrame, turn: float, t: complex) -> Any:
    """The point (3,) of a curve at an unknown, complex ones too."""
    assert isinstance(curve, Line | Circle)
    return curve.at(2.0 * np.arctan(t) + turn if isinstance(curve, Circle) else frame.size * t)  # type: ignore[arg-type]


def reach_record(reach: Reach, frame: WorkingFrame, turn: float) -> dict[str, Any]:
    """A curve or surface in rational working coordinates (sizes)."""
    centre = round_numbers(frame.point(reach.centre))
    if isinstance(reach, Sphere):
        radius = round_numbers(reach.radius / frame.size)
        return {"sphere": write_numbers([centre, [radius * radius]])}
    if isinstance(reach, Circle):
        return {"circle": write_numbers([centre, *_spokes(reach, frame, turn)])}
    rest = [] if isinstance(reach, Point) else [reach.direction if isinstance(reach, Line) else reach.normal]
    exact = [[Fraction(int(x), UNIT) for x in convert_direction(each, frame, RoundedConic)] for each in rest]
    return {type(reach).__name__.lower(): write_numbers([centre, *exact])}


def _spokes(circle: Circle, frame: WorkingFrame, turn: float) -> list[list[Fraction]]:
    """Two spokes of a circle, exactly normal to each other and of one length: those of a rational rotation."""
    given = build_spokes(circle, frame, turn, RoundedConic)
    a, b = ([Fraction(int(x), UNIT) for x in each] for each in given)
    if len(a) == 2 or dot(a, b) == 0 == dot(a, a) - dot(b, b):
        return [a, b]
    first, second = normalise_vector(given[0].astype(float)), normalise_vector(given[1].astype(float))
    w, x, y, z = (
        Fraction(round(float(c) * UNIT))
        for c in convert_to_quaternions(np.column_stack([first, second, cross(first, second)]))
    )
    s = round_numbers(circle.radius / frame.size) / (w * w + x * x + y * y + z * z)
    return [
        [s * (w * w + x * x - y * y - z * z), 2 * s * (x * y + w * z), 2 * s * (x * z - w * y)],
        [2 * s * (x * y - w * z), s * (w * w - x * x + y * y - z * z), 2 * s * (y * z + w * x)],
    ]
