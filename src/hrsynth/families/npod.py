"""The n-Pods: telescopic legs UPS, UPU, RPS (MMT 4.2.1).

In every leg ``cylinder_i`` is joined to the base, ``rod_i`` slides in it along the leg, and its tip is joined to the
platform. The base frame is the world's, z upwards. All dimensions are free choices (the papers give none), of a
desktop machine. Lengths in m.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import Array, rotation_about, unit
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from .geometry import Z, polar, tangent

THREE_ANGLES = (0.0, 2 * math.pi / 3, 4 * math.pi / 3)


def _leg(b: Builder, leg: int, base: str, end: str, A: Array, B: Array, first: Array) -> None:
    """Adds a leg from A_i to B_i: ``base`` joint U or R, actuated P, ``end`` joint S or U; ``first``: base axis."""
    cylinder, rod = f"cylinder_{leg}", f"rod_{leg}"
    second = np.cross(first, B - A)
    b.link(cylinder, at=A)
    b.link(rod, at=(A + B) / 2)
    if base == "U":
        b.joint(f"shoulder_{leg}", "U", "base", cylinder, at=A, axis=first, axis2=second)
    else:
        b.joint(f"shoulder_{leg}", "R", "base", cylinder, at=A, axis=first)
    b.joint(f"slide_{leg}", "P", cylinder, rod, at=(A + B) / 2, axis=unit(B - A), motor=f"motor_{leg}")
    if end == "U":
        b.joint(f"wrist_{leg}", "U", rod, "platform", at=B, axis=second, axis2=first, loop=leg != 1)
    else:
        b.joint(f"wrist_{leg}", "S", rod, "platform", at=B, loop=leg != 1)


def gough_stewart(*, base_radius: float = 0.3, base_half: float = math.radians(20), platform_radius: float = 0.2,
                  platform_half: float = math.radians(20), home: ArrayLike = (0.012, 0.004, 0.3),
                  twist: float = math.radians(-25), tilt: float = math.radians(2)) -> Mechanism:
    """The Gough-Stewart platform, 6-UP̲S on two semi-regular hexagons: six freedoms (MMT 4.2.1, reference [14]).

    The first axis of each base U is tangential and fixed in the base, the second is fixed in the cylinder, normal to
    the leg.

    Parameters
    ----------
    base_radius, platform_radius
        Radii of the circles that carry A_i and B_i.
    base_half, platform_half
        Half the angle (rad) between the two neighbours of a pair; the platform's pairs stand between the base's.
    home
        P at the zero configuration, shape (3,).
    twist, tilt
        The platform's rotation about z, then about x, at the zero configuration (rad).
    """
    P = np.asarray(home, dtype=float)
    R = rotation_about((1, 0, 0), tilt) @ rotation_about(Z, twist)
    b = Builder("gough_stewart")
    b.link("base")
    for pair in range(3):
        for sign in (-1, 1):
            leg = 2 * pair + (1 if sign < 0 else 2)
            angle = 2 * math.pi / 3 * pair + sign * base_half
            tip = 2 * math.pi / 3 * pair + sign * (math.pi / 3 - platform_half)
            _leg(b, leg, "U", "S", polar(base_radius, angle), P + R @ polar(platform_radius, tip), tangent(angle))
    b.link("platform", at=P)
    return b.build(platform="platform")


def three_upu(*, base_radius: float = 0.3, platform_radius: float = 0.12,
              home: ArrayLike = (0.02, -0.015, 0.35)) -> Mechanism:
    """Tsai's 3-UP̲U: three translations (MMT 4.2.1, reference [37]).

    In each leg the outer axes of the two U, fixed in the base and in the platform, are parallel (tangential), and so
    are the two inner ones, normal to the leg. Parameters as in :func:`gough_stewart`.
    """
    P = np.asarray(home, dtype=float)
    b = Builder("3upu")
    b.link("base")
    for leg, angle in enumerate(THREE_ANGLES, start=1):
        _leg(b, leg, "U", "U", polar(base_radius, angle), P + polar(platform_radius, angle), tangent(angle))
    b.link("platform", at=P)
    return b.build(platform="platform")


def three_rps(*, base_radius: float = 0.4, platform_radius: float = 0.15, height: float = 0.3) -> Mechanism:
    """The 3-RP̲S with tangential base R: a height and two tilts (MMT 4.2.1, reference [41]).

    The other three freedoms move along a little (parasitic motions).

    ``height``: of P, above the base's origin, at the zero configuration. Other parameters as in :func:`gough_stewart`.
    """
    P = np.array([0.0, 0.0, height])
    b = Builder("3rps")
    b.link("base")
    for leg, angle in enumerate(THREE_ANGLES, start=1):
        _leg(b, leg, "R", "S", polar(base_radius, angle), P + polar(platform_radius, angle), tangent(angle))
    b.link("platform", at=P)
    return b.build(platform="platform")
