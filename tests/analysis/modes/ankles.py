"""Humanoid ankles: a foot on a U joint and two legs with motors; and their modes counted with NumPy alone."""

from __future__ import annotations

import numpy as np

from hrsynth.geometry.vectors import Array, find_perpendicular, normalise_vector, rotate_about_axis
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

LEGS = ("SPU", "RSU", "RUS")
Rod = tuple[Array, Array]
"""Where a leg with its motor held turns on the shank, and where on the foot, at zero (3,)."""


def ankle(
    kind: str, seed: int, *, two_turns: bool = True, offset: float = 0.0
) -> tuple[Mechanism, tuple[Array, Array, Array, Array], list[Rod]]:
    """A random ankle in a tilted base; the U joint's centre and two axes, the second one's point, and both rods.

    ``two_turns``: the U joint is written as two R with a connector that has no length, or one of about the length
    ``offset``: the axes do not meet then.
    """
    rng = np.random.default_rng(seed)
    tilt = rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))

    def near(*at: float, by: float = 0.05) -> Array:
        return np.asarray(tilt @ (np.array(at) + by * rng.normal(size=3)))

    centre = near(0, 0, 0)
    first, second = normalise_vector(near(0, 1, 0, by=0.2)), normalise_vector(near(1, 0, 0, by=0.2))
    lower = centre + np.random.default_rng(seed).normal(size=3) * offset
    b, rods = Builder("ankle"), list[Rod]()
    b.link("shank")
    b.link("foot", at=near(0, 0, -0.05))
    if two_turns:
        b.link("cross", at=centre)
        b.joint("pitch", "R", "shank", "cross", at=centre, axis=first)
        b.joint("roll", "R", "cross", "foot", at=lower, axis=second)
    else:
        b.joint(
            "ankle",
            "U",
            "shank",
            "foot",
            at=centre,
            axis=first,
            axis2=normalise_vector(np.cross(np.cross(first, second), first)),
        )
        second = normalise_vector(np.cross(np.cross(first, second), first))
    for leg, side in (("1", 0.06), ("2", -0.06)):
        motor, end = near(-0.05, side, 0.3), near(-0.06, side, -0.04)
        ball = motor if kind == "SPU" else motor + near(-0.06, 0, 0)
        along = normalise_vector(end - ball)
        axes = {
            "axis": find_perpendicular(along),
            "axis2": normalise_vector(np.cross(along, find_perpendicular(along))),
        }
        b.link(f"crank_{leg}", at=motor)
        b.link(f"rod_{leg}", at=ball)
        if kind == "SPU":
            b.joint(f"ball_{leg}", "S", "shank", f"crank_{leg}", at=ball)
            b.joint(f"slide_{leg}", "P", f"crank_{leg}", f"rod_{leg}", at=ball, axis=along, motor=True)
            b.joint(f"end_{leg}", "U", f"rod_{leg}", "foot", at=end, loop=True, **axes)
        else:
            b.joint(
                f"crank_{leg}",
                "R",
                "shank",
                f"crank_{leg}",
                at=motor,
                axis=normalise_vector(near(0, 1, 0, by=0.2)),
                motor=True,
            )
            up, down = ({}, axes) if kind == "RSU" else (axes, {})
            b.joint(f"ball_{leg}", kind[1], f"crank_{leg}", f"rod_{leg}", at=ball, **up)
            b.joint(f"end_{leg}", kind[2], f"rod_{leg}", "foot", at=end, loop=True, **down)
        b.observe(leg, f"rod_{leg}", along)
        rods.append((ball, end))
    return b.build(platform="foot"), (centre, first, second, lower), rods


def carried(word: str, seed: int, on: tuple[int, str] | None = None) -> Mechanism:
    """A platform that a random leg of R and P carries, and as many telescopic legs with balls as that has joints.

    ``on``: the number of one of these with its foot or its end on the axis of the first or the last joint.
    """
    rng, b = np.random.default_rng(seed), Builder("carried")
    places = [0.3 * (rng.normal(size=3) + [0, 0, k]) for k in range(len(word))]
    links = ["base", *(f"link_{k}" for k in range(1, len(word))), "platform"]
    b.link("base")
    for link, at in zip(links[1:], places, strict=True):
        b.link(link, at=at)
    axes = [normalise_vector(rng.normal(size=3)) for _ in word]
    for k, kind in enumerate(word):
        b.joint(f"joint_{k}", kind, links[k], links[k + 1], at=places[k], axis=axes[k])
    for k in range(len(word)):
        foot, end = 0.6 * rng.normal(size=3), places[-1] + 0.3 * rng.normal(size=3)
        if on == (k, "foot"):
            foot = places[0] + 0.4 * axes[0]
        if on == (k, "end"):
            end = places[-1] + 0.2 * axes[-1]
        along = normalise_vector(end - foot)
        across = find_perpendicular(along)
        b.link(f"tube_{k}", at=foot)
        b.link(f"rod_{k}", at=end)
        b.joint(f"ball_{k}", "S", "base", f"tube_{k}", at=foot)
        b.joint(f"slide_{k}", "P", f"tube_{k}", f"rod_{k}", at=(foot + end) / 2, axis=along, motor=True)
        b.joint(f"end_{k}", "U", f"rod_{k}", "platform", at=end, axis=across, axis2=np.cross(along, across), loop=True)
    return b.build(platform="platform")


def counted(joint: tuple[Array, Array, Array, Array], rods: list[Rod]) -> tuple[int, int]:
    """Complex and real poses of the foot with both rods' lengths kept.

    With x = exp(iα), y = exp(iβ) of both turns, each length is x y times a polynomial of degree two in each; their
    resultant in y, by values at roots of unity, has the solutions' x as roots.
    """
    centre, a, c, lower = joint
    tables = []
    for ball, end in rods:
        angles = 2 * np.pi * np.arange(3) / 3
        rod = [
            [
                centre
                + rotate_about_axis(a, alpha) @ (lower + rotate_about_axis(c, beta) @ (end - lower) - centre)
                - ball
                for beta in angles
            ]
            for alpha in angles
        ]
        values = np.sum(np.square(rod), axis=2) - np.sum((end - ball) ** 2)
        tables.append(np.roll(np.fft.fft2(values), (1, 1), (0, 1)))  # powers -1, 0, 1 of x and of y
    nodes = np.exp(2j * np.pi * np.arange(16) / 16)
    powers = nodes[:, None] ** np.arange(3)
    f, g = (powers @ table for table in tables)
    zero = np.zeros_like(f[:, :1])
    sylvester = np.stack([np.hstack(row) for row in ((f, zero), (zero, f), (g, zero), (zero, g))], axis=1)
    resultant = np.fft.fft(np.linalg.det(sylvester)) / 16
    size = np.abs(resultant).max()
    assert np.abs(resultant[9:]).max() < 1e-10 * size
    x = np.roots(resultant[8::-1])
    there = [np.roots((each ** np.arange(3) @ tables[0])[::-1]) for each in x]
    y = [
        ys[np.argmin([abs(v ** np.arange(3) @ (each ** np.arange(3) @ tables[1])) for v in ys])]
        for each, ys in zip(x, there, strict=True)
    ]
    real = sum(abs(abs(each) - 1) < 1e-6 and abs(abs(v) - 1) < 1e-6 for each, v in zip(x, y, strict=True))
    return int(np.sum((np.abs(x) > 1e-9) & np.isfinite(x))), int(real)
