"""The n-Pods: telescopic legs UPS, UPU, RPS (MMT 4.2.1).

In every leg ``cylinder_i`` is joined to the base, ``rod_i`` slides in it along the leg, and its tip is joined to the
platform. The base frame is the world's, z upwards. All dimensions are free choices (the papers give none), of a
desktop machine. Lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import Array, normalise_vector, rotate_about_axis
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from .geometry import THREE_ANGLES, Z, add_wrist, compute_polar_point, compute_tangent, list_six_angles, locate_six_tips


def _build_n_pod(
    name: str, home: ArrayLike, base: str, end: str, legs: Iterable[tuple[Array, Array, Array]]
) -> Mechanism:
    """Legs from A_i to B_i: ``base`` joint U or R, actuated P, ``end`` joint S or U; ``legs`` are A_i, B_i and the
    (first) axis of the base joint."""
    b = Builder(name)
    b.link("base")
    for leg, (A, B, first) in enumerate(legs, start=1):
        cylinder, rod, second = f"cylinder_{leg}", f"rod_{leg}", np.cross(first, B - A)
        b.link(cylinder, at=A)
        b.link(rod, at=(A + B) / 2)
        b.joint(f"shoulder_{leg}", base, "base", cylinder, at=A, axis=first, axis2=second if base == "U" else None)
        b.joint(f"slide_{leg}", "P", cylinder, rod, at=(A + B) / 2, axis=normalise_vector(B - A), motor=f"motor_{leg}")
        add_wrist(b, leg, end, B, second, first)
    b.link("platform", at=home)
    return b.build(platform="platform")


def _place_three_legs(base_radius: float, platform_radius: float, P: Array) -> list[tuple[Array, Array, Array]]:
    """Three such legs a third of a turn apart, their first axes tangential."""
    return [
        (compute_polar_point(base_radius, a), P + compute_polar_point(platform_radius, a), compute_tangent(a))
        for a in THREE_ANGLES
    ]


def gough_stewart(
    *,
    base_radius: float = 0.3,
    base_half: float = math.radians(20),
    platform_radius: float = 0.2,
    platform_half: float = math.radians(20),
    home: ArrayLike = (0.012, 0.004, 0.3),
    twist: float = math.radians(-25),
    tilt: float = math.radians(2),
) -> Mechanism:
    """The Gough-Stewart platform, 6-UP̲S on two semi-regular hexagons: six dof (MMT 4.2.1, reference [14]).

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
    tips = locate_six_tips(
        P, rotate_about_axis((1, 0, 0), tilt) @ rotate_about_axis(Z, twist), platform_radius, platform_half
    )
    legs = [
        (compute_polar_point(base_radius, a), B, compute_tangent(a))
        for a, B in zip(list_six_angles(base_half), tips, strict=True)
    ]
    return _build_n_pod("gough_stewart", P, "U", "S", legs)


def three_upu(
    *, base_radius: float = 0.3, platform_radius: float = 0.12, home: ArrayLike = (0.02, -0.015, 0.35)
) -> Mechanism:
    """Tsai's 3-UP̲U: three translations (MMT 4.2.1, reference [37]).

    In each leg the outer axes of the two U, fixed in the base and in the platform, are parallel (tangential), and so
    are the two inner ones, normal to the leg. Parameters as in :func:`gough_stewart`.
    """
    P = np.asarray(home, dtype=float)
    return _build_n_pod("3upu", P, "U", "U", _place_three_legs(base_radius, platform_radius, P))


def three_rps(*, base_radius: float = 0.4, platform_radius: float = 0.15, height: float = 0.3) -> Mechanism:
    """The 3-RP̲S with tangential base R: a height and two tilts (MMT 4.2.1, reference [41]).

    The other three coordinates change a little with them (parasitic motions).

    ``height``: of P, above the base's origin, at the zero configuration. Other parameters as in :func:`gough_stewart`.
    """
    P = np.array([0.0, 0.0, height])
    return _build_n_pod("3rps", P, "R", "S", _place_three_legs(base_radius, platform_radius, P))
