"""Numbers in files: parsed strictly, written on a grid, so that writing what was read gives the same digits.

A written number is a multiple of 10^-n, with n so large that rounding stays below every tolerance and so small that
the noise of floating-point products (a few units of 1e-16) never moves a number to the next multiple.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import Array, build_pose, convert_rpy_to_rotation, rotate_about_axis
from ..tolerances import EXACT_INCIDENCE_TOL, GEOMETRY_DIFFERENCE_TOL, TOLERANCE_AMBIGUITY_FRACTION

ROUNDED_UNIT_VECTOR_TOL = 2e-3
"""Largest deviation of a rounded unit vector's length, or of an angle (rad) from a simple one."""
FILE_NUMBER_MAX = 1e9
"""Largest magnitude of a number that a robot file may hold (metres, radians)."""
ROUNDED_DECIMALS_MIN = 3
"""Decimals from which a file's numbers can be rounded; with fewer they are typed."""
ROUNDED_NUMBERS_MIN_COUNT = 5
"""Number of such numbers that shows the rounding of a file."""
SURELY_ROUNDED_DECIMALS_MIN = 4
"""Decimals from which numbers are rounded in any case."""
ROUNDED_DECIMALS_MAX = 11
"""Decimals up to which numbers can be rounded."""
ROUNDED_INCIDENCE_FRACTION = 2.5
"""Deviation of special geometry in units of the last decimal of a file's numbers."""
ANGLE_DECIMALS_COUNT = 13
"""Decimals of angles and of the components of axes."""

SIMPLE_ANGLE = math.pi / 12
"""Step of which typed angles are multiples."""
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?", re.ASCII)


@dataclass
class Digits:
    """Accuracy of a file's numbers, judged by their digits."""

    numbers: Counter[tuple[int, int]] = field(default_factory=Counter)
    """Count of numbers with so many decimals and significant digits."""
    rounded: bool = False
    """A unit vector misses length one, or an angle a simple fraction of a full rotation, by little."""

    def read(self, text: str) -> None:
        """Count the digits of numbers as they are written."""
        for word in text.split():
            number, _, exponent = word.lower().partition("e")
            decimals = len(number.partition(".")[2]) - int(exponent or 0)
            self.numbers[decimals, len(number.replace(".", "").lstrip("+-0"))] += 1

    def length(self, size: float) -> None:
        """Record the length of a vector that should have length one."""
        self.rounded |= EXACT_INCIDENCE_TOL < abs(size - 1) < ROUNDED_UNIT_VECTOR_TOL

    def angles(self, values: Array) -> None:
        """Record angles (rad) that miss a simple fraction of a full rotation by little."""
        steps = np.round(values / SIMPLE_ANGLE)
        misses = np.abs(values - steps * SIMPLE_ANGLE)[steps != 0]
        self.rounded |= bool(np.any((misses > EXACT_INCIDENCE_TOL) & (misses < ROUNDED_UNIT_VECTOR_TOL)))

    @property
    def last_place(self) -> float:
        """Size of the last decimal that one in five of the longer numbers reach; if more of them share their count of
        significant digits, that of the coarsest last digit of these; 0 if none are rounded."""
        longer = sorted(each for each in self.numbers.elements() if each[0] >= ROUNDED_DECIMALS_MIN)
        if len(longer) < ROUNDED_NUMBERS_MIN_COUNT:
            return 0.0
        decimals = longer[(4 * len(longer)) // 5][0]
        most = max(significant for _, significant in longer)
        full = [each for each, significant in longer if significant == most]
        if len(full) > sum(each == longer[-1][0] for each, _ in longer):
            decimals = full[0]
        self.rounded |= decimals >= SURELY_ROUNDED_DECIMALS_MIN
        return 10.0**-decimals if decimals <= ROUNDED_DECIMALS_MAX else 0.0

    def deviation(self, length: float = 1.0) -> float:
        """Return the rounding error of exact geometry due to the decimals of the file (characteristic lengths, rad);
        ``length`` is the characteristic length in the file's unit."""
        return ROUNDED_INCIDENCE_FRACTION * self.last_place * max(1.0, 1 / length)

    def rounding(self, length: float, opening: float) -> float:
        """Return that rounding error; 0 if nothing indicates rounding: neither vectors and angles nor the closure
        residual at zero."""
        most = self.deviation(length)
        shown = GEOMETRY_DIFFERENCE_TOL < opening <= TOLERANCE_AMBIGUITY_FRACTION * most
        return most if self.rounded or shown else 0.0


def parse(text: str, count: int) -> Array:
    """Return the ``count`` numbers of ``text``, shape (count,). Raises ``ValueError`` with the expected values."""
    words = text.split()
    for word in words:
        if not _NUMBER.fullmatch(word):
            raise ValueError("finite numbers")
        if not abs(float(word)) <= FILE_NUMBER_MAX:
            raise ValueError(f"numbers up to {FILE_NUMBER_MAX:g}")
    if len(words) != count:
        raise ValueError("one number" if count == 1 else f"{count} numbers")
    return np.array([float(word) for word in words])


def format_decimal(value: float, decimals: int) -> str:
    """Return ``value`` rounded to ``decimals``, at most 15 significant digits, in its shortest form; -0 is 0."""
    rounded = round(float(value), decimals)
    return f"{rounded:.15g}" if rounded else "0"


def format_exact(value: float) -> str:
    """Return ``value`` in the shortest form that reads back as the same float; integers without a point."""
    text = repr(float(value))
    return text.removesuffix(".0") if text != "-0.0" else "0"


def format_exact_vector(values: ArrayLike) -> str:
    """Return the numbers of a vector in that form."""
    return " ".join(format_exact(value) for value in np.asarray(values, dtype=float))


def count_length_decimals(scale: float) -> int:
    """Return the decimals of a length in a robot whose largest coordinate is ``scale`` metres: 14 significant
    digits."""
    return 13 - math.floor(math.log10(scale * (1 + 1e-7))) if scale > 0 else ANGLE_DECIMALS_COUNT


def format_vector(values: ArrayLike, decimals: int) -> str:
    """Return the numbers of a vector, each rounded to ``decimals``."""
    return " ".join(format_decimal(value, decimals) for value in np.asarray(values, dtype=float))


def format_axis(direction: ArrayLike) -> str:
    """Return a unit vector of shape (3,): two components on the grid, the largest one such that the length is one."""
    values = np.asarray(direction, dtype=float)
    values = values / np.linalg.norm(values)
    sizes = np.abs(values)
    largest = int(np.flatnonzero(sizes >= sizes.max() - 1e-9)[0])
    grid = [round(float(value), ANGLE_DECIMALS_COUNT) for value in values]
    rest = sum(value**2 for index, value in enumerate(grid) if index != largest)
    grid[largest] = math.copysign(math.sqrt(max(0.0, 1.0 - rest)), values[largest])
    return " ".join(format_decimal(value, 15) for value in grid)


def compute_rounded_rpy(rotation: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw of a rotation (3, 3), rounded.

    If the pitch is nearly ±90°, the yaw is rounded as coarsely as it is undetermined, and the roll compensates.
    """
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    yaw = 0.0
    if cosine > 1e-13:
        decimals = min(ANGLE_DECIMALS_COUNT, math.floor(14.37 + math.log10(cosine)))  # .37: changes at no round number
        yaw = round(math.atan2(rotation[1, 0], rotation[0, 0]), decimals)
    rest = rotate_about_axis((0, 0, 1), -yaw) @ rotation
    pitch = round(math.atan2(-rest[2, 0], rest[0, 0]), ANGLE_DECIMALS_COUNT)
    roll = round(math.atan2(-rest[1, 2], rest[1, 1]), ANGLE_DECIMALS_COUNT)
    return _normalise_half_turn(roll), _normalise_half_turn(pitch), _normalise_half_turn(yaw)


def _normalise_half_turn(angle: float) -> float:
    """Return the angle, with -π replaced by π."""
    return math.pi if abs(abs(angle) - math.pi) < 1e-12 else angle


def format_origin(X: Array, decimals: int) -> tuple[Array, dict[str, str]]:
    """Return a pose as the attributes of an ``<origin>``, and the pose (4, 4) that reading them gives."""
    attributes = {}
    xyz = format_vector(X[:3, 3], decimals)
    if xyz != "0 0 0":
        attributes["xyz"] = xyz
    angles = " ".join(format_decimal(angle, ANGLE_DECIMALS_COUNT) for angle in compute_rounded_rpy(X[:3, :3]))
    if angles != "0 0 0":
        attributes["rpy"] = angles
    return compute_origin_pose(parse(xyz, 3), parse(angles, 3)), attributes


def compute_origin_pose(xyz: Array, angles: Array) -> Array:
    """Return the pose (4, 4) of an ``<origin>``."""
    if not np.any(angles):
        return build_pose(xyz)
    return build_pose(xyz, convert_rpy_to_rotation(*angles))
