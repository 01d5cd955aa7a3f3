"""The planar robots of MMT Table 1, with two and three dof, moving in the plane z = 0 of the base.

A leg is a chain base – ``prox_i`` – ``dist_i`` – platform with three joints of type R (axis z) or P. Joint names give
the place and the type: ``shoulder_i`` (R) or ``guide_i`` (P) on the base, ``elbow_i`` (R) or ``slide_i`` (P) between
the two links, ``wrist_i`` (R) or ``slide_i`` (P) on the platform. All dimensions are free choices (the papers give
none): generic ones, so that neither the robots nor their hidden robots are near a singularity at the zero
configuration. Lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadRequest
from ..geometry.vectors import Array, normalise_vector
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from .geometry import Z, compute_polar_point, compute_radial, locate_on_circle, locate_on_line

Pairs = Sequence[tuple[float, float]]
Pose = tuple[float, float, float]

BASE: Pairs = ((0.300, math.radians(88)), (0.310, math.radians(211)), (0.290, math.radians(332)))
"""Polar coordinates of A_i in the base: a slightly irregular triangle."""
PLATFORM: Pairs = ((0.100, math.radians(93)), (0.105, math.radians(208)), (0.095, math.radians(329)))
"""Polar coordinates of C_i in the platform."""
HOME = (0.010, -0.015, math.radians(22))
"""Platform pose x, y (m), φ (rad) at the zero configuration."""


@dataclass(frozen=True)
class _PlanarLeg:
    """The points of a leg's three joints and, where a joint is a P, its axis; shapes (3,)."""

    points: tuple[Array, Array, Array]
    axes: tuple[Array, Array, Array] = (Z, Z, Z)


def _add(b: Builder, leg: int, types: str, geometry: _PlanarLeg, motor: int, frame: Array | None = None) -> None:
    """Adds ``prox_i`` and ``dist_i`` with the first two joints; ``frame``: the origin of ``dist_i``."""
    if motor not in (1, 2):
        raise BadRequest("motor: the actuated joint of each leg", motor, "1 or 2")
    place = [
        {"R": turning, "P": sliding}[letter]
        for turning, sliding, letter in zip(("shoulder", "elbow"), ("guide", "slide"), types, strict=False)
    ]
    for number, (link, parent) in enumerate(((f"prox_{leg}", "base"), (f"dist_{leg}", f"prox_{leg}"))):
        point = geometry.points[number]
        b.link(link, at=point if frame is None or number == 0 else frame)
        b.joint(
            f"{place[number]}_{leg}",
            types[number],
            parent,
            link,
            at=point,
            axis=geometry.axes[number],
            motor=f"motor_{leg}" if motor == number + 1 else False,
        )


def _locate_elbow(A: Array, C: Array, proximal: float, distal: float, left: bool) -> Array:
    """The elbow of two links from A to C, to the left or the right of AC; shape (3,)."""
    side = np.cross(Z, normalise_vector(C - A)) * (1 if left else -1)
    return locate_on_circle(A, side, normalise_vector(C - A), proximal, C, distal, outward=True)


# ---------------------------------------------------------------------------------------------------------- two dof


def _pair(name: str, types: str, legs: Sequence[_PlanarLeg], motor: int, point_body: bool = False) -> Mechanism:
    """Two planar legs that share their end joint; the platform is ``dist_1`` with its frame there, or a point body."""
    b = Builder(name)
    b.link("base")
    end = legs[0].points[2]
    for number, geometry in enumerate(legs, start=1):
        _add(b, number, types, geometry, motor, end if number == 1 and not point_body else None)
    if not point_body:
        b.joint("end", "R", "dist_1", "dist_2", at=end, axis=Z, loop=True)
        return b.build(platform="dist_1")
    return _add_platform(b, "R", legs, end)


def _add_platform(b: Builder, kind: str, legs: Sequence[_PlanarLeg], home: ArrayLike) -> Mechanism:
    """The legs' last joints on a platform of its own, which hangs on the first leg."""
    b.link("platform", at=home)
    for number, leg in enumerate(legs, start=1):
        b.joint(
            f"{'wrist' if kind == 'R' else 'slide'}_{number}",
            kind,
            f"dist_{number}",
            "platform",
            at=leg.points[2],
            axis=leg.axes[2],
            loop=number != 1,
        )
    return b.build(platform="platform")


def _list_bases(distance: float) -> list[Array]:
    """The two base points, on the x axis."""
    return [np.array([sign * distance / 2, 0.0, 0.0]) for sign in (-1, 1)]


def rrrrr(
    *,
    motor: int = 1,
    base_distance: float = 0.2,
    proximal: float = 0.16,
    distal: float = 0.2,
    home: tuple[float, float] = (0.02, 0.24),
) -> Mechanism:
    """The five-bar RRRRR: its end joint moves in the plane (MMT 4.1.2, Fig. 5).

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: R̲RRRR̲ or RR̲RR̲R.
    base_distance
        Distance of the two base joints.
    proximal, distal
        Lengths of the links; elbows outwards.
    home
        The end joint at the zero configuration, x and y.
    """
    P = np.array([*home, 0.0])
    legs = [
        _PlanarLeg((A, _locate_elbow(A, P, proximal, distal, left=left), P))
        for A, left in zip(_list_bases(base_distance), (True, False), strict=True)
    ]
    return _pair(f"rrrrr_m{motor}", "RRR", legs, motor)


def rprpr(*, motor: int = 1, base_distance: float = 0.3, home: tuple[float, float] = (0.03, 0.22)) -> Mechanism:
    """RPRPR: two telescopic legs that share their end joint (MMT 4.1.2).

    ``motor`` 1: R̲PRPR̲; 2: RP̲RP̲R. Other parameters as in :func:`rrrrr`.
    """
    P = np.array([*home, 0.0])
    legs = [_PlanarLeg((A, (A + P) / 2, P), (Z, P - A, Z)) for A in _list_bases(base_distance)]
    return _pair(f"rprpr_m{motor}", "RPR", legs, motor)


def _build_prrrp(
    name: str,
    motor: int,
    base_distance: float,
    rails: tuple[float, float],
    distal: float,
    home: tuple[float, float],
    point_body: bool = False,
) -> Mechanism:
    P = np.array([*home, 0.0])
    legs = []
    for A, angle in zip(_list_bases(base_distance), rails, strict=True):
        B = locate_on_line(A, compute_radial(angle), P, distal)
        legs.append(_PlanarLeg((B, B, P), (compute_radial(angle), Z, Z)))
    return _pair(name, "PRR", legs, motor, point_body)


def prrrp(
    *,
    motor: int = 1,
    base_distance: float = 0.4,
    rails: tuple[float, float] = (math.radians(60), math.radians(105)),
    distal: float = 0.3,
    home: tuple[float, float] = (0.02, 0.2),
) -> Mechanism:
    """PRRRP with rails that are not parallel (MMT 4.1.2).

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: P̲RRRP̲ or PR̲RR̲P.
    base_distance
        Distance, along x, of the points where the rails start.
    rails
        Angles of the rails to the x axis (rad).
    distal
        Length of the links.
    home
        The end joint at the zero configuration, x and y.
    """
    return _build_prrrp(f"prrrp_m{motor}", motor, base_distance, rails, distal, home)


def prrrp_parallel(
    *,
    base_distance: float = 0.4,
    distal: float = 0.3,
    home: tuple[float, float] = (0.03, 0.1),
    point_body: bool = False,
) -> Mechanism:
    """P̲RRRP̲ with both rails along y: the legs do not show the translation along them (MMT 4.3, Fig. 17).

    ``point_body``: the platform is a separate link on two coaxial R at the end joint (its spin is an internal motion),
    instead of the last segment of leg 1. Other parameters as in :func:`prrrp`.
    """
    name = "prrrp_parallel_point" if point_body else "prrrp_parallel"
    return _build_prrrp(name, 1, base_distance, (math.pi / 2, math.pi / 2), distal, home, point_body)


# -------------------------------------------------------------------------------------------------------- three dof


def _locate_corners(base: Pairs, platform: Pairs, home: Pose) -> list[tuple[Array, Array]]:
    """A_i and C_i of the three legs in the base frame at the zero configuration."""
    x, y, phi = home
    return [
        (compute_polar_point(*a), np.array([x, y, 0.0]) + compute_polar_point(radius, angle + phi))
        for a, (radius, angle) in zip(base, platform, strict=True)
    ]


def _build_triple(name: str, types: str, legs: Sequence[_PlanarLeg], motor: int, home: Pose) -> Mechanism:
    """Three planar legs and a rigid platform; the platform frame has the axes of the base at the zero configuration."""
    b = Builder(name)
    b.link("base")
    for number, geometry in enumerate(legs, start=1):
        _add(b, number, types, geometry, motor)
    return _add_platform(b, types[2], legs, (home[0], home[1], 0.0))


def three_rrr(
    *,
    motor: int = 1,
    proximal: float = 0.17,
    distal: float = 0.16,
    base: Pairs = BASE,
    platform: Pairs = PLATFORM,
    home: Pose = HOME,
) -> Mechanism:
    """3-RRR: three planar dof (MMT 4.1.1, Table 1; Fig. 6).

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: 3-R̲RR or 3-RR̲R.
    proximal, distal
        Lengths of the links; elbows to the left of A_i C_i.
    base, platform
        Polar coordinates (m, rad) of A_i in the base frame, and of C_i about P before the turn by φ.
    home
        Platform pose x, y, φ at the zero configuration.
    """
    legs = [
        _PlanarLeg((A, _locate_elbow(A, C, proximal, distal, left=True), C))
        for A, C in _locate_corners(base, platform, home)
    ]
    return _build_triple(f"3rrr_m{motor}", "RRR", legs, motor, home)


def six_poses(
    *,
    motor: int = 1,
    rods: Sequence[float] = (0.25, 0.31, 0.25),
    directions: Sequence[float] = (math.radians(170), math.radians(285), math.radians(100)),
) -> Mechanism:
    """3-RRR that hides the six poses of C. Innocenti and V. Parenti-Castelli's 3-RPR (1992, reprinted in many places).

    With the directions of its rods fixed the corners of the platform, a triangle of 17.04, 16.54 and 20.84 cm, are
    14.98, 15.38 and 12 cm from (0, 0), (15.91, 0) and (0, 10): those are the lengths of its cranks.

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: 3-R̲RR or 3-RR̲R.
    rods
        Lengths of the observed links.
    directions
        Their directions at the zero configuration (rad), elbow to platform.
    """
    a, b, c = 0.1704, 0.1654, 0.2084
    along = (a * a + c * c - b * b) / (2 * a)
    corners = [np.array(corner) for corner in ((0, 0, 0), (a, 0, 0), (along, math.sqrt(c * c - along * along), 0))]
    cosine, sine = math.cos(0.245309531), math.sin(0.245309531)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    tips = [np.array([-0.148961281, 0.0158296166, 0]) + turn @ corner for corner in corners]
    centres = [np.array(centre) for centre in ((0, 0, 0), (0.1591, 0, 0), (0, 0.1, 0))]
    held = [rod * compute_radial(angle) for rod, angle in zip(rods, directions, strict=True)]
    legs = [_PlanarLeg((centre - rod, tip - rod, tip)) for centre, rod, tip in zip(centres, held, tips, strict=True)]
    x, y, _ = np.mean(tips, axis=0)
    return _build_triple("six_poses", "RRR", legs, motor, (float(x), float(y), 0.0))


def three_rpr(*, motor: int = 1, base: Pairs = BASE, platform: Pairs = PLATFORM, home: Pose = HOME) -> Mechanism:
    """3-RPR: three planar dof (MMT 4.1.1, Table 1).

    ``motor`` 1: 3-R̲PR; 2: 3-RP̲R. Other parameters as in :func:`three_rrr`.
    """
    legs = [_PlanarLeg((A, (A + C) / 2, C), (Z, C - A, Z)) for A, C in _locate_corners(base, platform, home)]
    return _build_triple(f"3rpr_m{motor}", "RPR", legs, motor, home)


def three_prr(
    *,
    motor: int = 1,
    distal: float = 0.2,
    rail: float = math.radians(50),
    base: Pairs = BASE,
    platform: Pairs = PLATFORM,
    home: Pose = HOME,
) -> Mechanism:
    """3-PRR: three planar dof (MMT 4.1.1, Table 1).

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: 3-P̲RR or 3-PR̲R.
    distal
        Length of the links.
    rail
        Angle (rad) of rail i, through A_i, to the radius of A_i.
    base, platform, home
        As in :func:`three_rrr`.
    """
    legs = []
    for (_, angle), (A, C) in zip(base, _locate_corners(base, platform, home), strict=True):
        direction = compute_radial(angle + rail)
        B = locate_on_line(A, direction, C, distal, forward=True)
        legs.append(_PlanarLeg((B, B, C), (direction, Z, Z)))
    return _build_triple(f"3prr_m{motor}", "PRR", legs, motor, home)


def _place_slots(platform: Pairs, home: Pose, reach: float, slot: float) -> Iterator[tuple[float, Array, Array, Array]]:
    """For a P on the platform: the angle of C_i's radius, the joint B_i before it, C_i, the P's direction from C_i."""
    for (_, angle), (_, C) in zip(platform, _locate_corners(BASE, platform, home), strict=True):
        along = compute_radial(angle + home[2] + slot)
        yield angle + home[2], C + reach * along, C, along


def three_prp(
    *,
    reach: float = 0.15,
    rail: float = math.radians(75),
    slot: float = math.radians(15),
    platform: Pairs = PLATFORM,
    home: Pose = HOME,
) -> Mechanism:
    """3-P̲RP: three planar dof, of which the legs show the rotation only (MMT 4.1.1, Table 1).

    Parameters
    ----------
    reach
        Distance of the middle joint from C_i, along the P axis on the platform.
    rail, slot
        Angles (rad) of the base's and of the platform's P axes to the radius of C_i.
    platform, home
        As in :func:`three_rrr`.
    """
    legs = [
        _PlanarLeg((B, B, C), (compute_radial(angle + rail), Z, -along))
        for angle, B, C, along in _place_slots(platform, home, reach, slot)
    ]
    return _build_triple("3prp", "PRP", legs, 1, home)


def three_rrp(
    *,
    reach: float = 0.15,
    proximal: float = 0.18,
    bend: float = math.radians(80),
    slot: float = math.radians(15),
    platform: Pairs = PLATFORM,
    home: Pose = HOME,
) -> Mechanism:
    """3-R̲RP: three planar dof, of which the legs show the rotation only (MMT 4.1.1, Table 1).

    Parameters
    ----------
    proximal
        Length of the first link.
    bend
        Angle (rad) of the first link, seen from its elbow, to the radius of C_i.
    reach, slot, platform, home
        As in :func:`three_prp`.
    """
    legs = [
        _PlanarLeg((B + proximal * compute_radial(angle + bend), B, C), (Z, Z, -along))
        for angle, B, C, along in _place_slots(platform, home, reach, slot)
    ]
    return _build_triple("3rrp", "RRP", legs, 1, home)


def three_ppr(
    *,
    motor: int = 1,
    first: float = math.radians(50),
    second: float = math.radians(-40),
    base: Pairs = BASE,
    platform: Pairs = PLATFORM,
    home: Pose = HOME,
) -> Mechanism:
    """3-PPR: three planar dof, legs whose last segments never rotate: they show nothing (MMT 4.1.1, Table 1).

    Parameters
    ----------
    motor
        The actuated joint of each leg, 1 or 2: 3-P̲PR or 3-PP̲R.
    first, second
        Angles (rad) of the two P axes to the radius of A_i.
    base, platform, home
        As in :func:`three_rrr`.
    """
    legs = []
    for (_, angle), (A, C) in zip(base, _locate_corners(base, platform, home), strict=True):
        d, e = compute_radial(angle + first), compute_radial(angle + second)
        travel = np.linalg.solve(np.column_stack([d[:2], e[:2]]), (C - A)[:2])
        B = A + travel[0] * d
        legs.append(_PlanarLeg((B, B, C), (d, e, Z)))
    return _build_triple(f"3ppr_m{motor}", "PPR", legs, motor, home)
