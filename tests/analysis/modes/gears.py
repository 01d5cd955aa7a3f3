"""Planar linkages with gears, and how many closings they have by a polynomial of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

FIVE = np.array([[0, 0], [-0.2, 0.5], [0.5, 1.1], [1.3, 0.6], [1.0, 0.0]])


def five_bar(ratio: float, seed: int = 0, sense: int = 1) -> tuple[Mechanism, Array]:
    """A five-bar whose cranks are geared, the axis of the second of the ``sense``; its joints' centres in the plane."""
    P = FIVE + np.random.default_rng(seed).uniform(-0.15, 0.15, FIVE.shape)
    at = [(*p, 0.0) for p in P]
    b = Builder("geared")
    for link, k in (("base", 0), ("crank", 0), ("coupler", 1), ("floating", 2), ("driven", 4)):
        b.link(link, at=(0, 0, 0) if link == "base" else at[k])
    b.joint("A", "R", "base", "crank", at=at[0], axis=(0, 0, 1), motor=True)
    b.joint("B", "R", "crank", "coupler", at=at[1], axis=(0, 0, 1))
    b.joint("C", "R", "coupler", "floating", at=at[2], axis=(0, 0, 1), loop=True)
    b.joint("D", "R", "driven", "floating", at=at[3], axis=(0, 0, 1))
    b.joint("E", "R", "base", "driven", at=at[4], axis=(0, 0, sense))
    b.coupling("gear", "A", "E", ratio * sense)
    b.observe("1", "coupler", (*(P[2] - P[1]), 0))
    return b.build(platform="floating"), P[:, 0] + 1j * P[:, 1]


def closings(ratio: Fraction, points: Array) -> tuple[int, Array]:
    """With the coupler's direction held: how many closings the five-bar has, and the turns of the floating bar (rad) at
    the real ones, by the roots of |C(z) - D(z)|² = l², z the crank's turn over the ratio's denominator."""
    A, B, C, D, E = points
    p, q = ratio.numerator, ratio.denominator
    terms = {0: C - B + A - E, q: B - A}
    terms[p] = terms.get(p, 0) - (D - E)
    total: dict[int, complex] = {0: -(abs(C - D) ** 2)}
    for k, a in terms.items():
        for m, b in terms.items():
            total[k - m] = total.get(k - m, 0) + a * np.conj(b)
    most = max(total)
    roots = np.roots([total.get(k, 0) for k in range(most, -most - 1, -1)])
    real = roots[np.abs(np.abs(roots) - 1.0) < 1e-9]
    return len(roots), np.array([np.angle(sum(a * z**k for k, a in terms.items()) / (C - D)) for z in real])


def linkage(
    points: Sequence[Sequence[float]],
    links: Mapping[str, Sequence[int]],
    platform: str,
    motor: str,
    slides: Mapping[int, Sequence[float]] | None = None,
    couplings: Sequence[tuple[str, str, float]] = (),
) -> Mechanism:
    """Links with the numbers of their joints, R, or P along ``slides``; the first link is the base."""
    b, base = Builder("linkage"), next(iter(links))
    for link, joints in links.items():
        b.link(link, at=(0, 0, 0) if link == base else (*points[joints[0]], 0))
    reached = {base}
    for k, point in enumerate(points):
        ends = [link for link, joints in links.items() if k in joints]
        one, other = sorted(ends, key=lambda link: link not in reached)
        kind, axis = ("R", (0, 0, 1)) if k not in (slides or {}) else ("P", (*(slides or {})[k], 0))
        b.joint(f"j{k}", kind, one, other, at=(*point, 0), axis=axis, motor=motor == f"j{k}", loop=other in reached)
        reached |= {one, other}
    for k, (one, other, ratio) in enumerate(couplings):
        b.coupling(f"gear{k}", one, other, ratio)
    return b.build(platform=platform)
