"""Places of joints for a chosen platform pose: points on circles and lines, in closed form."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadRequest
from ..geometry.vectors import Array, normalise_vector
from ..mechanism.builder import Builder

Z = np.array([0.0, 0.0, 1.0])
THREE_ANGLES = (0.0, 2 * math.pi / 3, 4 * math.pi / 3)


def compute_polar_point(radius: float, angle: float, height: float = 0.0) -> Array:
    """The point [r cos θ, r sin θ, z], shape (3,); lengths in m, the angle in rad."""
    return np.array([radius * math.cos(angle), radius * math.sin(angle), height])


def compute_radial(angle: float) -> Array:
    """The unit vector [cos θ, sin θ, 0], shape (3,)."""
    return compute_polar_point(1.0, angle)


def compute_tangent(angle: float) -> Array:
    """The unit vector [-sin θ, cos θ, 0] = z × radial, shape (3,)."""
    return compute_polar_point(1.0, angle + math.pi / 2)


def list_six_angles(half: float) -> list[float]:
    """Six angles in three pairs: legs 2k+1 and 2k+2 at 120° k ∓ ``half`` (rad)."""
    return [2 * math.pi / 3 * pair + sign * half for pair in range(3) for sign in (-1, 1)]


def locate_six_tips(P: Array, R: Array, radius: float, half: float) -> list[Array]:
    """Tips of six legs on a platform at P, turned by R: legs 2k+1 and 2k+2 at 120° k ∓ (60° − ``half``)."""
    return [P + R @ compute_polar_point(radius, angle) for angle in list_six_angles(math.pi / 3 - half)]


def locate_on_circle(
    centre: Array, x: Array, z: Array, radius: float, target: Array, length: float, outward: bool
) -> Array:
    """The point B on a circle with ‖B − target‖ = length: MMT (B.4), solved without the half-angle tangent.

    The circle lies in the plane of the unit vectors ``x`` and ``z`` about ``centre``. Of the two solutions, ``outward``
    takes the one farther along ``x`` (the knee points away from the axis). Shapes (3,), lengths in m. Raises
    :class:`BadRequest` where the target is out of reach.
    """
    rest = target - centre
    along, up = float(rest @ x), float(rest @ z)
    reach = math.hypot(along, up)
    cosine = (float(rest @ rest) + radius**2 - length**2) / (2 * radius * reach)
    if not abs(cosine) < 1:
        raise BadRequest(
            "the tip is out of the leg's reach",
            round(float(np.linalg.norm(rest)), 6),
            f"a distance that links of {radius} m and {length} m can bridge",
        )
    angles = [math.atan2(up, along) + sign * math.acos(cosine) for sign in (1, -1)]
    angle = (max if outward else min)(angles, key=math.cos)
    return centre + radius * (math.cos(angle) * x + math.sin(angle) * z)


def locate_on_line(point: Array, direction: ArrayLike, target: Array, length: float, forward: bool = False) -> Array:
    """The point B on a line with ‖B − target‖ = length; ``forward`` takes the solution farther along ``direction``.

    Shapes (3,), lengths in m. Raises :class:`BadRequest` where the line does not come so near.
    """
    d = normalise_vector(direction)
    rest = target - point
    foot = float(rest @ d)
    square = length**2 - float(rest @ rest) + foot**2
    if not square > 0:
        raise BadRequest(
            "the rail does not come near enough to the tip",
            round(math.sqrt(length**2 - square), 6),
            f"a distance below {length} m",
        )
    return point + (foot + (1 if forward else -1) * math.sqrt(square)) * d


def add_wrist(b: Builder, leg: int, type: str, C: Array, second: Array, first: Array) -> None:
    """Adds the joint S or U (with its two axes) from ``rod_i`` to the platform, which hangs on the first rod."""
    axes = (second, first) if type == "U" else (None, None)
    b.joint(f"wrist_{leg}", type, f"rod_{leg}", "platform", at=C, axis=axes[0], axis2=axes[1], loop=leg != 1)
