"""The Delta-like family: an actuated R or P at the base, then two rods, UU or US (MMT 4.2.2).

In every robot the base frame is the world's, z upwards; the R axis of arm i is horizontal and normal to
[cos θ_i, sin θ_i, 0], and its coordinate grows with q_i of MMT (B.2). All constructors place the platform first and
compute the arms or sliders from it, so that the rods have exactly the given length. Lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import Array, rotate_about_axis
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from .geometry import (
    THREE_ANGLES,
    Z,
    add_wrist,
    compute_polar_point,
    compute_radial,
    compute_tangent,
    list_six_angles,
    locate_on_circle,
    locate_on_line,
    locate_six_tips,
)

QUATTRO_ANGLES = (-3 * math.pi / 4, -math.pi / 4, math.pi / 4, 3 * math.pi / 4)
"""θ_i of both Quattros (rad): MMT Appendix B.1, IROS IV-A."""


@dataclass(frozen=True)
class _DrivenLeg:
    """A leg up to its rods, which join B_i on the driven link (``type`` R: an arm, P: a slider) to C_i; shapes (3,).
    ``side``: along which two rods are set apart, or the first axis of a rod's U."""

    type: str
    at: Array
    axis: Array
    B: Array
    C: Array
    side: Array

    def add(self, b: Builder, leg: int) -> str:
        """Adds ``arm_i`` or ``slider_i`` on its actuated joint and gives its name."""
        link, joint = {"R": ("arm", "shoulder"), "P": ("slider", "guide")}[self.type]
        b.link(f"{link}_{leg}", at=self.at)
        b.joint(f"{joint}_{leg}", self.type, "base", f"{link}_{leg}", at=self.at, axis=self.axis, motor=f"motor_{leg}")
        return f"{link}_{leg}"


def _make_arm_leg(angle: float, radius: float, C: Array, proximal: float, distal: float) -> _DrivenLeg:
    """A leg whose arm turns about A_i, at ``angle`` on a circle: knee outwards, ‖C_i − B_i‖ = ``distal``."""
    A = compute_polar_point(radius, angle)
    B = locate_on_circle(A, compute_radial(angle), Z, proximal, C, distal, outward=True)
    return _DrivenLeg("R", A, -compute_tangent(angle), B, C, compute_tangent(angle))


def _make_rail_leg(
    start: Array, direction: Array, C: Array, distal: float, side: Array, forward: bool = True
) -> _DrivenLeg:
    """A leg whose slider moves on a rail, with ‖C_i − B_i‖ = ``distal``."""
    B = locate_on_line(start, direction, C, distal, forward)
    return _DrivenLeg("P", B, direction, B, C, side)


def _make_inclined_rail_leg(angle: float, radius: float, slope: float, C: Array, distal: float) -> _DrivenLeg:
    """A leg whose rail starts at ``angle`` on a circle, descending outwards by ``slope`` (rad) below the horizontal."""
    direction = math.cos(slope) * compute_radial(angle) - math.sin(slope) * Z
    return _make_rail_leg(compute_polar_point(radius, angle), direction, C, distal, compute_tangent(angle))


def _add_pairs(b: Builder, legs: Iterable[_DrivenLeg], half: float, plates: Sequence[str]) -> None:
    """Adds legs that end in a {2-SS}: equal parallel rods at ± ``half`` along their sides, on their plates; the first
    plate hangs on the first rod."""
    for leg, (each, plate) in enumerate(zip(legs, plates, strict=True), start=1):
        proximal = each.add(b, leg)
        for letter, offset in (("a", half * each.side), ("b", -half * each.side)):
            rod = f"rod_{leg}{letter}"
            b.link(rod, at=each.B + offset)
            b.joint(f"elbow_{leg}{letter}", "S", proximal, rod, at=each.B + offset)
            b.joint(f"wrist_{leg}{letter}", "S", rod, plate, at=each.C + offset, loop=(leg, letter) != (1, "a"))


def _build_from_pairs(name: str, home: Array, legs: Sequence[_DrivenLeg], half: float) -> Mechanism:
    """n-R̲-{2-SS} or n-P̲-{2-SS} with a rigid platform, its frame at ``home``."""
    b = Builder(name)
    b.link("base")
    _add_pairs(b, legs, half, ["platform"] * len(legs))
    b.link("platform", at=home)
    return b.build(platform="platform")


def _build_from_rods(name: str, home: Array, legs: Sequence[_DrivenLeg], end: str) -> Mechanism:
    """Legs that end in one rod: U at B_i (its second axis normal to the first and the rod), then S or U at C_i."""
    b = Builder(name)
    b.link("base")
    for leg, each in enumerate(legs, start=1):
        proximal, second = each.add(b, leg), np.cross(each.side, each.C - each.B)
        b.link(f"rod_{leg}", at=each.B)
        b.joint(f"elbow_{leg}", "U", proximal, f"rod_{leg}", at=each.B, axis=each.side, axis2=second)
        add_wrist(b, leg, end, each.C, second, each.side)
    b.link("platform", at=home)
    return b.build(platform="platform")


def delta(
    *,
    base_radius: float = 0.2,
    platform_radius: float = 0.06,
    proximal: float = 0.25,
    distal: float = 0.6,
    half_width: float = 0.04,
    home: ArrayLike = (0.0, 0.0, -0.6),
) -> Mechanism:
    """Clavel's Delta, 3-R̲-{2-SS}: three translations (MMT 4.2.2, reference [38]).

    Parameters
    ----------
    base_radius, platform_radius
        Distances of A_i from the base's axis and of C_i from P.
    proximal, distal
        Lengths of an arm and of a rod.
    half_width
        Half the distance between the two rods of a leg.
    home
        P at the zero configuration, shape (3,).
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_arm_leg(a, base_radius, P + compute_polar_point(platform_radius, a), proximal, distal)
        for a in THREE_ANGLES
    ]
    return _build_from_pairs("delta", P, legs, half_width)


def quattro_rigid(
    *,
    base_radius: float = 0.296,
    platform_radius: float = 0.102,
    proximal: float = 0.380,
    distal: float = 0.825,
    half_width: float = 0.05,
    home: ArrayLike = (0.0, 0.0, -0.7),
) -> Mechanism:
    """The Quattro with a rigid platform, 4-R̲-{2-SS}: three translations, four motors (IROS II-A, IV-A).

    l₁, l₂, A_i = 0.296 [cos θ_i, sin θ_i, 0] and PC_i = 0.102 [cos θ_i, sin θ_i, 0] are printed in IROS IV-A; the rods'
    distance and the zero configuration are free choices. Parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_arm_leg(a, base_radius, P + compute_polar_point(platform_radius, a), proximal, distal)
        for a in QUATTRO_ANGLES
    ]
    return _build_from_pairs("quattro_rigid", P, legs, half_width)


def quattro(
    *,
    base_radius: float = 0.275,
    proximal: float = 0.380,
    distal: float = 0.825,
    plate_x: float = 0.066,
    plate_y: float = 0.048,
    half_bar: float = 0.043,
    side_bar_offset: float = 0.057,
    half_width: float = 0.05,
    home: ArrayLike = (0.0, 0.0, -0.7),
) -> Mechanism:
    """The Quattro with its articulated platform: three translations and a rotation about z (MMT 4.2.2, Appendix B.1).

    The platform link is the bar D1D2, its frame at P, the midpoint; it turns by φ with the bar. At the zero
    configuration (φ = 0) D1D2 lies along y and the E offsets along x, so that the parallelogram D1 D2 E4 E1 is open.
    Plate 12 carries C1, C2 and D1, plate 34 carries C3, C4 and D2; both keep their orientation. Of the two equal side
    bars E1E4 and E2E3 one is modelled: the other only repeats its constraint.

    Parameters
    ----------
    plate_x, plate_y
        Components of D1C1 … D2C4: [∓0.066, ∓0.048, 0].
    half_bar
        ‖PD1‖ = ‖PD2‖.
    side_bar_offset
        ‖E1D1‖ = ‖E4D2‖, along x.
    base_radius, proximal, distal, half_width, home
        As in :func:`delta`; ``half_width`` and ``home`` are free choices.
    """
    P = np.asarray(home, dtype=float)
    D1, D2 = P - [0, half_bar, 0], P + [0, half_bar, 0]
    tips = [
        D1 + [-plate_x, -plate_y, 0],
        D1 + [plate_x, -plate_y, 0],
        D2 + [plate_x, plate_y, 0],
        D2 + [-plate_x, plate_y, 0],
    ]
    E1, E4 = D1 - [side_bar_offset, 0, 0], D2 - [side_bar_offset, 0, 0]
    b = Builder("quattro")
    b.link("base")
    legs = [
        _make_arm_leg(angle, base_radius, C, proximal, distal) for angle, C in zip(QUATTRO_ANGLES, tips, strict=True)
    ]
    _add_pairs(b, legs, half_width, ["plate_12", "plate_12", "plate_34", "plate_34"])
    for name, origin in (("plate_12", D1), ("platform", P), ("plate_34", D2), ("side_bar", E1)):
        b.link(name, at=origin)
    b.joint("hinge_1", "R", "plate_12", "platform", at=D1, axis=Z)
    b.joint("hinge_2", "R", "platform", "plate_34", at=D2, axis=Z)
    b.joint("side_hinge_1", "R", "plate_12", "side_bar", at=E1, axis=Z)
    b.joint("side_hinge_4", "R", "side_bar", "plate_34", at=E4, axis=Z, loop=True)
    return b.build(platform="platform")


def orthoglide(
    *,
    distal: float = 0.31,
    platform_radius: float = 0.04,
    half_width: float = 0.03,
    home: ArrayLike = (0.03, -0.02, 0.04),
) -> Mechanism:
    """The Orthoglide, 3-P̲-{2-SS} with orthogonal P axes that meet: three translations (MMT 4.2.2, reference [40]).

    Leg i slides along axis i of the base frame; its rods lie on the positive side and are set apart along the next axis
    (y, z, x). At ``home`` = 0 the rods would be along the rails, the isotropic configuration; the default leaves it a
    little.

    Parameters
    ----------
    distal, half_width, home
        As in :func:`delta`.
    platform_radius
        Distance of C_i from P, along axis i.
    """
    P, axes = np.asarray(home, dtype=float), np.eye(3)
    legs = [
        _make_rail_leg(np.zeros(3), axis, P + platform_radius * axis, distal, side)
        for axis, side in zip(axes, np.roll(axes, -1, axis=0), strict=True)
    ]
    return _build_from_pairs("orthoglide", P, legs, half_width)


def linear_delta(
    *,
    base_radius: float = 0.15,
    slope: float = math.radians(20),
    platform_radius: float = 0.06,
    distal: float = 0.5,
    half_width: float = 0.04,
    home: ArrayLike = (0.02, -0.03, -0.4),
) -> Mechanism:
    """A general linear Delta, 3-P̲-{2-SS} with inclined rails: three translations (MMT 4.2.2).

    Rail i starts at A_i on a circle of ``base_radius`` and descends outwards by ``slope`` (rad) below the horizontal.
    Other parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_inclined_rail_leg(a, base_radius, slope, P + compute_polar_point(platform_radius, a), distal)
        for a in THREE_ANGLES
    ]
    return _build_from_pairs("linear_delta", P, legs, half_width)


def uranesx(
    *,
    base_radius: float = 0.4,
    platform_radius: float = 0.08,
    distal: float = 0.55,
    half_width: float = 0.04,
    home: ArrayLike = (0.03, -0.02, -0.4),
) -> Mechanism:
    """The UraneSX, 3-P̲-{2-SS} with parallel rails along z: three translations (MMT 4.3, reference [48]).

    The legs' directions do not show the translation along the rails. Parameters as in :func:`delta`; the rails
    stand on a circle of ``base_radius``.
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_rail_leg(
            compute_polar_point(base_radius, a),
            Z,
            P + compute_polar_point(platform_radius, a),
            distal,
            compute_tangent(a),
        )
        for a in THREE_ANGLES
    ]
    return _build_from_pairs("uranesx", P, legs, half_width)


def i4l(
    *,
    rail_distance: float = 0.35,
    plate_x: float = 0.06,
    plate_y: float = 0.05,
    distal: float = 0.6,
    half_width: float = 0.04,
    home: ArrayLike = (0.02, 0.01, -0.4),
) -> Mechanism:
    """The I4L, 4-P̲-{2-SS}: rails along x, a platform of two plates that slide on each other along y (MMT 4.3).

    Plate 12 carries legs 1 and 2, which come from the side of negative x, ``platform`` carries legs 3 and 4, from
    positive x; both keep their orientation, and a passive P along y joins them. The mobility is four: three
    translations of the platform, and the translation of plate 12 on it. In the robot of reference [44] a rack and
    pinion converts that into a rotation of the tool; it is left out here, so the platform has three dof, and the
    directions of legs 1 and 2 also depend on plate 12. The legs' directions do not show the translation along the
    rails.

    Parameters
    ----------
    rail_distance
        Distance of the two lines of rails, at y = ± ``rail_distance``, from the base's x axis.
    plate_x, plate_y
        Components of PC_i: [∓, ∓, 0].
    distal, half_width, home
        As in :func:`delta`.
    """
    P, x = np.asarray(home, dtype=float), np.array([1.0, 0, 0])
    legs = [
        _make_rail_leg(
            np.array([0, sy * rail_distance, 0]),
            x,
            P + [sx * plate_x, sy * plate_y, 0],
            distal,
            compute_tangent(math.atan2(sy, sx)),
            forward=sx > 0,
        )
        for sx, sy in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    ]
    b = Builder("i4l")
    b.link("base")
    _add_pairs(b, legs, half_width, ["plate_12", "plate_12", "platform", "platform"])
    b.link("plate_12", at=P)
    b.link("platform", at=P)
    b.joint("slide", "P", "plate_12", "platform", at=P, axis=(0, 1, 0))
    return b.build(platform="platform")


def three_ruu(
    *,
    base_radius: float = 0.2,
    platform_radius: float = 0.06,
    proximal: float = 0.25,
    distal: float = 0.6,
    home: ArrayLike = (0.0, 0.0, -0.6),
) -> Mechanism:
    """Tsai and Joshi's 3-R̲UU: three translations (MMT 4.2.2, reference [45]).

    In each leg the first axis of the elbow's U and the last axis of the platform's U are parallel to the base R, and
    the two inner axes are parallel to each other. Parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_arm_leg(a, base_radius, P + compute_polar_point(platform_radius, a), proximal, distal)
        for a in THREE_ANGLES
    ]
    return _build_from_rods("3ruu", P, legs, "U")


def three_puu(
    *,
    base_radius: float = 0.15,
    slope: float = math.radians(20),
    platform_radius: float = 0.06,
    distal: float = 0.5,
    home: ArrayLike = (0.02, -0.03, -0.4),
) -> Mechanism:
    """Tsai and Joshi's 3-P̲UU with inclined rails: three translations (MMT 4.2.2, reference [45]).

    In each leg the first axis of the elbow's U and the last axis of the platform's U are parallel (tangential), and so
    are the two inner axes. Parameters as in :func:`linear_delta`.
    """
    P = np.asarray(home, dtype=float)
    legs = [
        _make_inclined_rail_leg(a, base_radius, slope, P + compute_polar_point(platform_radius, a), distal)
        for a in THREE_ANGLES
    ]
    return _build_from_rods("3puu", P, legs, "U")


def hexa(
    *,
    base_radius: float = 0.25,
    base_half: float = math.radians(26),
    platform_radius: float = 0.18,
    platform_half: float = math.radians(20),
    proximal: float = 0.25,
    distal: float = 0.55,
    home: ArrayLike = (0.02, -0.01, -0.6),
    twist: float = math.radians(5),
) -> Mechanism:
    """The Hexa, 6-R̲US: six dof (MMT 4.2.2, reference [46]).

    The first axis of each elbow's U is parallel to the base R.

    Parameters
    ----------
    base_half, platform_half
        Half the angle (rad) between the two neighbours of a pair of A_i, of C_i.
    twist
        The platform's rotation about z at the zero configuration (rad).
    base_radius, platform_radius, proximal, distal, home
        As in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    tips = locate_six_tips(P, rotate_about_axis(Z, twist), platform_radius, platform_half)
    legs = [
        _make_arm_leg(a, base_radius, C, proximal, distal)
        for a, C in zip(list_six_angles(base_half), tips, strict=True)
    ]
    return _build_from_rods("hexa", P, legs, "S")


def hexaglide(
    *,
    rails: Sequence[float] = (-0.12, 0.24, 0.36, 0.12, -0.24, -0.36),
    ahead: Sequence[bool] = (True, True, False, True, True, False),
    platform_radius: float = 0.15,
    platform_half: float = math.radians(15),
    distal: float = 0.6,
    home: ArrayLike = (0.0, 0.02, -0.35),
    twist: float = math.radians(20),
) -> Mechanism:
    """The Hexaglide, 6-P̲US with six parallel rails along x: six dof (MMT 4.2.2, reference [47]).

    The legs' directions do not show the translation along the rails. The first axis of each elbow's U is y.

    Parameters
    ----------
    rails
        The y coordinate of each leg's rail, in the plane z = 0; different for all legs, in the order of the tips' y.
    ahead
        Whether the slider of each leg stands on the side of larger x, seen from its tip.
    platform_radius, platform_half, distal, home, twist
        As in :func:`hexa`.
    """
    P, (x, y, _) = np.asarray(home, dtype=float), np.eye(3)
    tips = locate_six_tips(P, rotate_about_axis(Z, twist), platform_radius, platform_half)
    legs = [
        _make_rail_leg(rail * y, x, C, distal, y, forward) for rail, forward, C in zip(rails, ahead, tips, strict=True)
    ]
    return _build_from_rods("hexaglide", P, legs, "S")


def six_pus(
    *,
    base_radius: float = 0.15,
    base_half: float = math.radians(20),
    slope: float = math.radians(20),
    platform_radius: float = 0.12,
    platform_half: float = math.radians(12),
    distal: float = 0.5,
    home: ArrayLike = (0.02, -0.01, -0.4),
    twist: float = math.radians(10),
) -> Mechanism:
    """A 6-P̲US with inclined rails: six dof (MMT 4.2.2).

    Rail i starts at A_i and descends outwards by ``slope`` (rad) below the horizontal; the first axis of each elbow's
    U is tangential. Other parameters as in :func:`hexa`.
    """
    P = np.asarray(home, dtype=float)
    tips = locate_six_tips(P, rotate_about_axis(Z, twist), platform_radius, platform_half)
    legs = [
        _make_inclined_rail_leg(a, base_radius, slope, C, distal)
        for a, C in zip(list_six_angles(base_half), tips, strict=True)
    ]
    return _build_from_rods("6pus", P, legs, "S")
