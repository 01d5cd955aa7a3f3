"""Known complex counts, each at twenty random robots: proved, and equal to the degree of a resultant by NumPy alone.

Tips go on circles c + r (e cos θ + f sin θ), with z = exp(iθ), or on lines c + s u. The resultant of the conditions
that the platform's tips keep their distances (in the plane: that the third tip follows from the others) is a Laurent
polynomial of the first parameter; its values on the unit circle and one Fourier transform give its coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import hrsynth
from analysis.modes.test_motions import flat, pod, tilted, triangle
from hrsynth.geometry.vectors import Array, normalise_vector, rotate_about_axis
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

Path = Array
"""How a tip moves, (3, 3): the coefficients of z⁻¹, z⁰, z¹ of a circle, or of s⁰, s¹, s² of a line."""
SAMPLES = 64
NEGLIGIBLE = 1e-9


def circle(axis: Array, through: Array, tip: Array) -> Path:
    """About the line through a point along a unit vector."""
    centre = through + axis * float(axis @ (tip - through))
    e, f = tip - centre, np.cross(axis, tip - centre)
    return np.array([(e + 1j * f) / 2, centre, (e - 1j * f) / 2])


def line(anchor: Array, tip: Array) -> Path:
    """From an anchor through a tip."""
    return np.array([anchor, normalise_vector(tip - anchor), np.zeros(3)], dtype=complex)


def squared(one: Path, other: Path, distance: float, low: int) -> Array:
    """|p − q|² − d² as a table of coefficients (3, 3) of both parameters, from their power ``low`` (circles: −1) on:
    the others are zero, e ± i f being isotropic."""
    zero = -low
    table = np.zeros((5, 5), dtype=complex)
    for i in range(3):
        for j in range(3):
            table[i + j, 2 * zero] += one[i] @ one[j]
            table[2 * zero, i + j] += other[i] @ other[j]
            table[zero + i, zero + j] -= 2 * one[i] @ other[j]
    table[2 * zero, 2 * zero] -= distance**2
    assert np.abs(table).sum() == pytest.approx(np.abs(table[zero : zero + 3, zero : zero + 3]).sum())
    return table[zero : zero + 3, zero : zero + 3]


def powers(x: complex, low: int) -> Array:
    """Three powers of a number from ``low`` on."""
    return x ** np.arange(low, low + 3.0)


def coefficients(values: Callable[[complex], complex]) -> Array:
    """The Laurent coefficients of a polynomial of which the values on the unit circle are known, without small ones at
    both ends."""
    found = np.fft.fftshift(np.fft.fft([values(np.exp(2j * math.pi * k / SAMPLES)) for k in range(SAMPLES)]))
    large = np.nonzero(np.abs(found) > NEGLIGIBLE * np.abs(found).max())[0]
    return found[large[0] : large[-1] + 1]


def spatial_resultant(paths: list[Path], tips: Array, low: int) -> Array:
    """Of three tips of a body in space: the resultant of their three distances."""
    one, two, three = (
        squared(paths[i], paths[j], float(np.linalg.norm(tips[i] - tips[j])), low) for i, j in ((0, 1), (1, 2), (0, 2))
    )

    def values(x: complex) -> complex:
        second, third = powers(x, low) @ one, powers(x, low) @ three
        value = second[2] ** 4 * third[2] ** 4
        for y in np.roots(second[::-1]):
            for z in np.roots(third[::-1]):
                value *= powers(y, 0) @ two @ powers(z, 0)
        return value

    return coefficients(values)


def planar_resultant(centres: Array, tips: Array) -> Array:
    """Of three tips of a body in the plane on circles through them: the third tip is the first, moved by what the
    second is from it, turned and scaled as in the platform. Numbers of the plane are complex; conjugates count as
    numbers of their own."""
    c, b = centres[:, 0] + 1j * centres[:, 1], tips[:, 0] + 1j * tips[:, 1]
    arms, d, m = b - c, b[1] - b[0], b[2] - b[0]

    def values(x: complex) -> complex:
        at, back = c[0] + arms[0] * x, np.conj(c[0]) + np.conj(arms[0]) / x
        p, q = at - c[1], back - np.conj(c[1])
        on_second = [q * d, p * q + abs(d) ** 2 - abs(arms[1]) ** 2, p * np.conj(d)]  # times w, the body's turn
        p, q = at - c[2], back - np.conj(c[2])
        value = on_second[0] ** 2
        for w in np.roots(on_second):
            value *= q * m * w * w + (p * q + abs(m) ** 2 - abs(arms[2]) ** 2) * w + p * np.conj(m)
        return value

    return coefficients(values)


def legs(kinds: str, points: Array, axes: Array, tips: Array, motor: int) -> Mechanism:
    """Three legs with joints of ``kinds``, S at the tips; the points and axes (3, n, 3) of the joints before it."""
    b = Builder(f"3{kinds}S")
    b.link("base")
    b.link("platform", at=tips.mean(axis=0))
    for k in range(3):
        last = "base"
        for n, kind in enumerate(kinds):
            b.link(f"link_{k}_{n}", at=points[k, n])
            b.joint(f"joint_{k}_{n}", kind, last, f"link_{k}_{n}", at=points[k, n], axis=axes[k, n], motor=n == motor)
            last = f"link_{k}_{n}"
        b.joint(f"ball_{k}", "S", last, "platform", at=tips[k], loop=k > 0)
    return b.build(platform="platform")


def on_circles(kinds: str, motor: int, seed: int) -> tuple[Mechanism, bool, Array]:
    """3-RPS, 3-RRS, 3-PRS with the motors held: each tip goes on a circle about its R that is not driven."""
    rng, tilt = tilted(seed)
    spread = np.column_stack([triangle(rng), np.zeros(3)])
    feet = spread + rng.uniform(-0.05, 0.05, (3, 3))
    points = np.stack([feet, 0.8 * spread + rng.uniform(-0.1, 0.1, (3, 3)) + [0, 0, 0.25]], axis=1) @ tilt.T
    tips = (0.5 * spread + rng.uniform(-0.1, 0.1, (3, 3)) + [0, 0, 0.6]) @ tilt.T
    axes = np.array([[normalise_vector(v) for v in rng.normal(size=(2, 3))] for _ in range(3)])
    if kinds == "RP":
        axes[:, 1] = [normalise_vector(tip - at) for tip, at in zip(tips, points[:, 0], strict=True)]
        points[:, 1] = (points[:, 0] + tips) / 2
        axes[:, 0] = [
            normalise_vector(np.cross(axis, other)) for axis, other in zip(axes[:, 0], axes[:, 1], strict=True)
        ]
    free = kinds.index("R") if kinds != "RR" else 1
    paths = [circle(axes[k, free], points[k, free], tips[k]) for k in range(3)]
    return legs(kinds, points, axes, tips, motor), True, spatial_resultant(paths, tips, -1)


def hexa(seed: int) -> tuple[Mechanism, bool, Array]:
    """Arms and rods, the rods watched: a tip goes on the arm's circle, moved along the rod."""
    rng, tilt = tilted(seed)
    spread = np.column_stack([triangle(rng), np.zeros(3)])
    A, tips = spread @ tilt.T, (0.4 * spread + rng.uniform(-0.05, 0.05, (3, 3)) + [0, 0, 0.7]) @ tilt.T
    knees = (1.3 * spread + rng.uniform(-0.1, 0.1, (3, 3)) + [0, 0, 0.2]) @ tilt.T
    axes = [normalise_vector(np.cross(knee - at, rng.normal(size=3))) for knee, at in zip(knees, A, strict=True)]
    b = Builder("hexa")
    b.link("base")
    b.link("platform", at=tips.mean(axis=0))
    for k in range(3):
        b.link(f"arm_{k}", at=A[k])
        b.link(f"rod_{k}", at=knees[k])
        b.joint(f"shoulder_{k}", "R", "base", f"arm_{k}", at=A[k], axis=axes[k], motor=True)
        b.joint(
            f"elbow_{k}",
            "U",
            f"arm_{k}",
            f"rod_{k}",
            at=knees[k],
            axis=axes[k],
            axis2=np.cross(axes[k], tips[k] - knees[k]),
        )
        b.joint(f"ball_{k}", "S", f"rod_{k}", "platform", at=tips[k], loop=k > 0)
    paths = [circle(axes[k], A[k] + tips[k] - knees[k], tips[k]) for k in range(3)]
    return b.build(platform="platform"), False, spatial_resultant(paths, tips, -1)


def one_centre(seed: int) -> tuple[Mechanism, bool, Array]:
    """Three telescopic legs from one point, watched: their lines go through it."""
    rng, tilt = tilted(seed)
    A, spread = rng.uniform(-0.2, 0.2, 3), np.column_stack([triangle(rng), np.zeros(3)])
    tips = (spread + rng.uniform(-0.1, 0.1, (3, 3)) + [0, 0, 0.6]) @ tilt.T
    mechanism = pod(np.array([A] * 3), tips, "U", "S", normalise_vector(rng.normal(size=3)))
    return mechanism, False, spatial_resultant([line(A, tip) for tip in tips], tips, 0)


def planar(seed: int) -> tuple[Mechanism, bool, Array]:
    """3-RPR with the motors held."""
    rng, tilt = tilted(seed)
    A = triangle(rng)
    B = 0.5 * A @ rotate_about_axis((0, 0, 1), 0.4)[:2, :2].T + rng.uniform(-0.1, 0.1, (3, 2))
    return pod(flat(A, tilt), flat(B, tilt), "R", "R", tilt[:, 2]), True, planar_resultant(A, B)


CASES = {
    "three points on lines through one centre": (one_centre, 8),
    "hidden Hexa": (hexa, 16),
    "3-RPS": (lambda seed: on_circles("RP", 1, seed), 16),
    "3-RRS": (lambda seed: on_circles("RR", 0, seed), 16),
    "3-PRS": (lambda seed: on_circles("PR", 0, seed), 16),
    "planar six": (planar, 6),
}


def check_count(case: str, seed: int) -> None:
    """The count is that of the resultant, and proved; as many real modes as the resultant has real roots, where none is
    nearly real."""
    make, count = CASES[case]
    mechanism, real, resultant = make(seed)
    found = hrsynth.modes(mechanism, real=real)
    assert len(resultant) - 1 == count
    assert (found.found.complex, found.found.complete, found.found.bound) == (count, True, "resultant")
    roots = np.roots(resultant[::-1])
    off = np.abs(roots.imag / (1 + np.abs(roots))) if case.startswith("three") else np.abs(np.log(np.abs(roots)))
    if not np.any((off > 1e-7) & (off < 1e-4)):
        assert len(found.modes) == np.sum(off <= 1e-7)


@pytest.mark.some(2)
@pytest.mark.parametrize("case", CASES)
def test_a_known_count_is_proved(case: str):
    check_count(case, 1)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("case", CASES)
def test_a_known_count_is_proved_at_many_robots(case: str):
    for seed in range(2, 21):
        check_count(case, seed)
