"""The Delta-like family: an actuated R or P at the base, then two rods, UU or US (MMT 4.2.2).

In every robot the base frame is the world's, z upwards; the R axis of arm i is horizontal and normal to
[cos θ_i, sin θ_i, 0], and its coordinate grows with q_i of MMT (B.2). All constructors place the platform first and
compute the arms or sliders from it, so that the rods have exactly the length that was asked for. Lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.vectors import Array, rotation_about
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from .geometry import Z, on_circle, on_line, polar, radial, tangent

QUATTRO_ANGLES = (-3 * math.pi / 4, -math.pi / 4, math.pi / 4, 3 * math.pi / 4)
"""θ_i of both Quattros (rad): MMT Appendix B.1, IROS IV-A."""
THREE_ANGLES = (0.0, 2 * math.pi / 3, 4 * math.pi / 3)


def _arm(b: Builder, leg: int, angle: float, A: Array, C: Array, proximal: float, distal: float) -> Array:
    """Adds ``arm_i`` on its actuated R and gives B_i, knee outwards, with ‖C_i − B_i‖ = ``distal``; shape (3,)."""
    B = on_circle(A, radial(angle), Z, proximal, C, distal, outward=True)
    b.link(f"arm_{leg}", at=A)
    b.joint(f"shoulder_{leg}", "R", "base", f"arm_{leg}", at=A, axis=-tangent(angle), motor=f"motor_{leg}")
    return B


def _slider(b: Builder, leg: int, rail: Array, direction: Array, C: Array, distal: float, forward: bool) -> Array:
    """Adds ``slider_i`` on its actuated P and gives B_i with ‖C_i − B_i‖ = ``distal``; shape (3,)."""
    B = on_line(rail, direction, C, distal, forward)
    b.link(f"slider_{leg}", at=B)
    b.joint(f"guide_{leg}", "P", "base", f"slider_{leg}", at=B, axis=direction, motor=f"motor_{leg}")
    return B


def _two_rods(b: Builder, leg: int, proximal: str, plate: str, B: Array, C: Array, side: Array, half: float,
              carries: bool) -> None:
    """Adds a {2-SS}: equal parallel rods at ± ``half`` along ``side``; ``carries``: the plate hangs on the first."""
    for letter, offset in (("a", half * side), ("b", -half * side)):
        rod = f"rod_{leg}{letter}"
        b.link(rod, at=B + offset)
        b.joint(f"elbow_{leg}{letter}", "S", proximal, rod, at=B + offset)
        b.joint(f"wrist_{leg}{letter}", "S", rod, plate, at=C + offset, loop=not (carries and letter == "a"))


def _rotary(name: str, angles: Sequence[float], base: Sequence[Array], tips: Sequence[Array], proximal: float,
            distal: float, half: float, home: ArrayLike) -> Mechanism:
    """n-R̲-{2-SS} with a rigid platform: A_i in ``base``, C_i in ``tips``, the platform frame at ``home``."""
    b = Builder(name)
    b.link("base")
    for leg, (angle, A, C) in enumerate(zip(angles, base, tips, strict=True), start=1):
        B = _arm(b, leg, angle, A, C, proximal, distal)
        _two_rods(b, leg, f"arm_{leg}", "platform", B, C, tangent(angle), half, carries=leg == 1)
    b.link("platform", at=home)
    return b.build(platform="platform")


def delta(*, base_radius: float = 0.2, platform_radius: float = 0.06, proximal: float = 0.25, distal: float = 0.6,
          half_width: float = 0.04, home: ArrayLike = (0.0, 0.0, -0.6)) -> Mechanism:
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
    return _rotary("delta", THREE_ANGLES, [polar(base_radius, a) for a in THREE_ANGLES],
                   [P + polar(platform_radius, a) for a in THREE_ANGLES], proximal, distal, half_width, P)


def quattro_rigid(*, base_radius: float = 0.296, platform_radius: float = 0.102, proximal: float = 0.380,
                  distal: float = 0.825, half_width: float = 0.05,
                  home: ArrayLike = (0.0, 0.0, -0.7)) -> Mechanism:
    """The Quattro with a rigid platform, 4-R̲-{2-SS}: three translations, four motors (IROS II-A, IV-A).

    l₁, l₂, A_i = 0.296 [cos θ_i, sin θ_i, 0] and PC_i = 0.102 [cos θ_i, sin θ_i, 0] are printed in IROS IV-A; the rods'
    distance and the home pose are free choices. Parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    return _rotary("quattro_rigid", QUATTRO_ANGLES, [polar(base_radius, a) for a in QUATTRO_ANGLES],
                   [P + polar(platform_radius, a) for a in QUATTRO_ANGLES], proximal, distal, half_width, P)


def quattro(*, base_radius: float = 0.275, proximal: float = 0.380, distal: float = 0.825,
            plate_x: float = 0.066, plate_y: float = 0.048, half_bar: float = 0.043, side_bar_offset: float = 0.057,
            half_width: float = 0.05, home: ArrayLike = (0.0, 0.0, -0.7)) -> Mechanism:
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
    tips = [D1 + [-plate_x, -plate_y, 0], D1 + [plate_x, -plate_y, 0],
            D2 + [plate_x, plate_y, 0], D2 + [-plate_x, plate_y, 0]]
    E1, E4 = D1 - [side_bar_offset, 0, 0], D2 - [side_bar_offset, 0, 0]
    b = Builder("quattro")
    b.link("base")
    for leg, (angle, C) in enumerate(zip(QUATTRO_ANGLES, tips, strict=True), start=1):
        B = _arm(b, leg, angle, polar(base_radius, angle), C, proximal, distal)
        _two_rods(b, leg, f"arm_{leg}", "plate_12" if leg < 3 else "plate_34", B, C, tangent(angle), half_width,
                  carries=leg == 1)
    b.link("plate_12", at=D1)
    b.link("platform", at=P)
    b.link("plate_34", at=D2)
    b.link("side_bar", at=E1)
    b.joint("hinge_1", "R", "plate_12", "platform", at=D1, axis=Z)
    b.joint("hinge_2", "R", "platform", "plate_34", at=D2, axis=Z)
    b.joint("side_hinge_1", "R", "plate_12", "side_bar", at=E1, axis=Z)
    b.joint("side_hinge_4", "R", "side_bar", "plate_34", at=E4, axis=Z, loop=True)
    return b.build(platform="platform")


def orthoglide(*, distal: float = 0.31, platform_radius: float = 0.04, half_width: float = 0.03,
               home: ArrayLike = (0.03, -0.02, 0.04)) -> Mechanism:
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
    b = Builder("orthoglide")
    b.link("base")
    for leg in (1, 2, 3):
        axis, side = axes[leg - 1], axes[leg % 3]
        C = P + platform_radius * axis
        B = _slider(b, leg, np.zeros(3), axis, C, distal, forward=True)
        _two_rods(b, leg, f"slider_{leg}", "platform", B, C, side, half_width, carries=leg == 1)
    b.link("platform", at=P)
    return b.build(platform="platform")


def _linear(name: str, angles: Sequence[float], rails: Sequence[Array], directions: Sequence[Array],
            tips: Sequence[Array], distal: float, half: float, P: Array) -> Mechanism:
    """n-P̲-{2-SS} with a rigid platform; the rods of leg i are set apart along the tangent at θ_i."""
    b = Builder(name)
    b.link("base")
    for leg, (angle, rail, direction, C) in enumerate(zip(angles, rails, directions, tips, strict=True), start=1):
        B = _slider(b, leg, rail, direction, C, distal, forward=True)
        _two_rods(b, leg, f"slider_{leg}", "platform", B, C, tangent(angle), half, carries=leg == 1)
    b.link("platform", at=P)
    return b.build(platform="platform")


def linear_delta(*, base_radius: float = 0.15, slope: float = math.radians(20), platform_radius: float = 0.06,
                 distal: float = 0.5, half_width: float = 0.04,
                 home: ArrayLike = (0.02, -0.03, -0.4)) -> Mechanism:
    """A general linear Delta, 3-P̲-{2-SS} with inclined rails: three translations (MMT 4.2.2).

    Rail i starts at A_i on a circle of ``base_radius`` and descends outwards by ``slope`` (rad) below the horizontal.
    Other parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    directions = [math.cos(slope) * radial(a) - math.sin(slope) * Z for a in THREE_ANGLES]
    return _linear("linear_delta", THREE_ANGLES, [polar(base_radius, a) for a in THREE_ANGLES], directions,
                   [P + polar(platform_radius, a) for a in THREE_ANGLES], distal, half_width, P)


def uranesx(*, base_radius: float = 0.4, platform_radius: float = 0.08, distal: float = 0.55, half_width: float = 0.04,
            home: ArrayLike = (0.03, -0.02, -0.4)) -> Mechanism:
    """The UraneSX, 3-P̲-{2-SS} with parallel rails along z: three translations (MMT 4.3, reference [48]).

    The translation along the rails cannot be seen in the legs' directions. Parameters as in :func:`delta`; the rails
    stand on a circle of ``base_radius``.
    """
    P = np.asarray(home, dtype=float)
    return _linear("uranesx", THREE_ANGLES, [polar(base_radius, a) for a in THREE_ANGLES], [Z] * 3,
                   [P + polar(platform_radius, a) for a in THREE_ANGLES], distal, half_width, P)


def i4l(*, rail_distance: float = 0.35, plate_x: float = 0.06, plate_y: float = 0.05, distal: float = 0.6,
        half_width: float = 0.04, home: ArrayLike = (0.02, 0.01, -0.4)) -> Mechanism:
    """The I4L, 4-P̲-{2-SS}: rails along x, a platform of two plates that slide on each other along y (MMT 4.3).

    Plate 12 carries legs 1 and 2, which come from the side of negative x, ``platform`` carries legs 3 and 4, from
    positive x; both keep their orientation, and a passive P along y joins them. The mechanism has four freedoms:
    three translations of the platform, and the slide of plate 12 on it. In the robot of reference [44] a rack and
    pinion turns that slide into a rotation of the tool; it is left out here, so the platform's twist has three
    freedoms, and the directions of legs 1 and 2 also depend on the slide. The translation along the rails cannot be
    seen in the legs' directions.

    Parameters
    ----------
    rail_distance
        Distance of the two lines of rails, at y = ± ``rail_distance``, from the base's x axis.
    plate_x, plate_y
        Components of PC_i: [∓, ∓, 0].
    distal, half_width, home
        As in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    quadrants = ((-1, -1), (-1, 1), (1, 1), (1, -1))
    b = Builder("i4l")
    b.link("base")
    for leg, (sx, sy) in enumerate(quadrants, start=1):
        C = P + [sx * plate_x, sy * plate_y, 0]
        B = _slider(b, leg, np.array([0, sy * rail_distance, 0]), np.array([1.0, 0, 0]), C, distal, forward=sx > 0)
        side = tangent(math.atan2(sy, sx))
        _two_rods(b, leg, f"slider_{leg}", "platform" if leg > 2 else "plate_12", B, C, side, half_width,
                  carries=leg == 1)
    b.link("plate_12", at=P)
    b.link("platform", at=P)
    b.joint("slide", "P", "plate_12", "platform", at=P, axis=(0, 1, 0))
    return b.build(platform="platform")


def _rod(b: Builder, leg: int, proximal: str, B: Array, C: Array, first: Array, end: str) -> None:
    """Adds a rod: U at B (``first`` on the proximal link, the second axis normal to it and the rod), then S or U."""
    second = np.cross(first, C - B)
    b.link(f"rod_{leg}", at=B)
    b.joint(f"elbow_{leg}", "U", proximal, f"rod_{leg}", at=B, axis=first, axis2=second)
    if end == "U":
        b.joint(f"wrist_{leg}", "U", f"rod_{leg}", "platform", at=C, axis=second, axis2=first, loop=leg != 1)
    else:
        b.joint(f"wrist_{leg}", "S", f"rod_{leg}", "platform", at=C, loop=leg != 1)


def three_ruu(*, base_radius: float = 0.2, platform_radius: float = 0.06, proximal: float = 0.25, distal: float = 0.6,
              home: ArrayLike = (0.0, 0.0, -0.6)) -> Mechanism:
    """Tsai and Joshi's 3-R̲UU: three translations (MMT 4.2.2, reference [45]).

    In each leg the first axis of the elbow's U and the last axis of the wrist's U are parallel to the base R, and the
    two inner axes are parallel to each other. Parameters as in :func:`delta`.
    """
    P = np.asarray(home, dtype=float)
    b = Builder("3ruu")
    b.link("base")
    for leg, angle in enumerate(THREE_ANGLES, start=1):
        C = P + polar(platform_radius, angle)
        B = _arm(b, leg, angle, polar(base_radius, angle), C, proximal, distal)
        _rod(b, leg, f"arm_{leg}", B, C, tangent(angle), "U")
    b.link("platform", at=P)
    return b.build(platform="platform")


def three_puu(*, base_radius: float = 0.15, slope: float = math.radians(20), platform_radius: float = 0.06,
              distal: float = 0.5, home: ArrayLike = (0.02, -0.03, -0.4)) -> Mechanism:
    """Tsai and Joshi's 3-P̲UU with inclined rails: three translations (MMT 4.2.2, reference [45]).

    In each leg the first axis of the elbow's U and the last axis of the wrist's U are parallel (tangential), and so
    are the two inner axes. Parameters as in :func:`linear_delta`.
    """
    P = np.asarray(home, dtype=float)
    b = Builder("3puu")
    b.link("base")
    for leg, angle in enumerate(THREE_ANGLES, start=1):
        C = P + polar(platform_radius, angle)
        direction = math.cos(slope) * radial(angle) - math.sin(slope) * Z
        B = _slider(b, leg, polar(base_radius, angle), direction, C, distal, forward=True)
        _rod(b, leg, f"slider_{leg}", B, C, tangent(angle), "U")
    b.link("platform", at=P)
    return b.build(platform="platform")


def _six_angles(half: float, turn: float = 0.0) -> list[float]:
    """Six angles in three pairs, leg 2k+1 and 2k+2 at 120° k ∓ ``half``, all turned by ``turn`` (rad)."""
    return [turn + 2 * math.pi / 3 * pair + sign * half for pair in range(3) for sign in (-1, 1)]


def _six_tips(P: Array, radius: float, half: float, twist: float) -> list[Array]:
    """C_i of a hexapod: legs 2k+1 and 2k+2 end at 120° k ∓ (60° − ``half``), the platform turned by ``twist`` (rad)."""
    turn = rotation_about(Z, twist)
    return [P + turn @ polar(radius, angle) for angle in _six_angles(math.pi / 3 - half)]


def hexa(*, base_radius: float = 0.25, base_half: float = math.radians(26), platform_radius: float = 0.18,
         platform_half: float = math.radians(20), proximal: float = 0.25, distal: float = 0.55,
         home: ArrayLike = (0.02, -0.01, -0.6), twist: float = math.radians(5)) -> Mechanism:
    """The Hexa, 6-R̲US: six freedoms (MMT 4.2.2, reference [46]).

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
    b = Builder("hexa")
    b.link("base")
    tips = _six_tips(P, platform_radius, platform_half, twist)
    for leg, (angle, C) in enumerate(zip(_six_angles(base_half), tips, strict=True), start=1):
        B = _arm(b, leg, angle, polar(base_radius, angle), C, proximal, distal)
        _rod(b, leg, f"arm_{leg}", B, C, tangent(angle), "S")
    b.link("platform", at=P)
    return b.build(platform="platform")


def hexaglide(*, rails: Sequence[float] = (-0.12, 0.24, 0.36, 0.12, -0.24, -0.36),
              ahead: Sequence[bool] = (True, True, False, True, True, False), platform_radius: float = 0.15,
              platform_half: float = math.radians(15), distal: float = 0.6, home: ArrayLike = (0.0, 0.02, -0.35),
              twist: float = math.radians(20)) -> Mechanism:
    """The Hexaglide, 6-P̲US with six parallel rails along x: six freedoms (MMT 4.2.2, reference [47]).

    The translation along the rails cannot be seen in the legs' directions. The first axis of each elbow's U is y.

    Parameters
    ----------
    rails
        The y coordinate of each leg's rail, in the plane z = 0; different for all legs, in the order of the tips' y.
    ahead
        Whether the slider of each leg stands on the side of larger x, seen from its tip.
    platform_radius, platform_half, distal, home, twist
        As in :func:`hexa`.
    """
    P = np.asarray(home, dtype=float)
    b = Builder("hexaglide")
    b.link("base")
    tips = _six_tips(P, platform_radius, platform_half, twist)
    for leg, (y, forward, C) in enumerate(zip(rails, ahead, tips, strict=True), start=1):
        B = _slider(b, leg, np.array([0.0, y, 0.0]), np.array([1.0, 0.0, 0.0]), C, distal, forward)
        _rod(b, leg, f"slider_{leg}", B, C, np.array([0.0, 1.0, 0.0]), "S")
    b.link("platform", at=P)
    return b.build(platform="platform")


def six_pus(*, base_radius: float = 0.15, base_half: float = math.radians(20), slope: float = math.radians(20),
            platform_radius: float = 0.12, platform_half: float = math.radians(12), distal: float = 0.5,
            home: ArrayLike = (0.02, -0.01, -0.4), twist: float = math.radians(10)) -> Mechanism:
    """A 6-P̲US with inclined rails: six freedoms (MMT 4.2.2).

    Rail i starts at A_i and descends outwards by ``slope`` (rad) below the horizontal; the first axis of each elbow's
    U is tangential. Other parameters as in :func:`hexa`.
    """
    P = np.asarray(home, dtype=float)
    b = Builder("6pus")
    b.link("base")
    tips = _six_tips(P, platform_radius, platform_half, twist)
    for leg, (angle, C) in enumerate(zip(_six_angles(base_half), tips, strict=True), start=1):
        direction = math.cos(slope) * radial(angle) - math.sin(slope) * Z
        B = _slider(b, leg, polar(base_radius, angle), direction, C, distal, forward=True)
        _rod(b, leg, f"slider_{leg}", B, C, tangent(angle), "S")
    b.link("platform", at=P)
    return b.build(platform="platform")
