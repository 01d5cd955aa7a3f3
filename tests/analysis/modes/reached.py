"""Whole robots whose tips, with their directions held, are confined to curves that are given: bounds reached by robots.

A leg RRR whose rod keeps its direction carries its tip on a circle with the crank's radius; a leg UPS on a line.
"""

from __future__ import annotations

import numpy as np

from analysis.modes.draws import Draw
from hrsynth.geometry.loci import Circle, Line
from hrsynth.geometry.vectors import Array, find_perpendicular, normalise_vector
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.solving.platform.solve import solve

Rng = np.random.Generator


def three_rrr(drawn: Draw, rng: Rng) -> Mechanism:
    """3-RRR: cranks of the circles' radii, rods of random lengths and directions."""
    n = drawn.system.X_plane[:3, 2]
    b = Builder("three_circles")
    b.link("base")
    b.link("platform", at=drawn.goal[:3, 3])
    for leg, (circle, tip) in enumerate(zip(drawn.system.curves, drawn.system.tips, strict=True), 1):
        assert isinstance(circle, Circle)
        B = drawn.goal[:3, 3] + drawn.goal[:3, :2] @ tip
        rod = rng.uniform(0.5, 1.5) * normalise_vector(np.cross(n, rng.normal(size=3)))
        A, E = circle.centre - rod, B - rod
        b.link(f"crank_{leg}", at=A)
        b.link(f"rod_{leg}", at=E)
        for name, ends, at in (
            ("shoulder", ("base", f"crank_{leg}"), A),
            ("elbow", (f"crank_{leg}", f"rod_{leg}"), E),
            ("wrist", (f"rod_{leg}", "platform"), B),
        ):
            b.joint(
                f"{name}_{leg}", "R", *ends, at=at, axis=n, motor=name == "shoulder", loop=name == "wrist" and leg > 1
            )
        b.observe(str(leg), f"rod_{leg}", rod)
    return b.build(platform="platform")


def six_ups(drawn: Draw, rng: Rng) -> Mechanism:
    """6-UPS: legs 1 to 3 slide along the lines, the others stand anywhere."""
    tips = np.array([*drawn.system.tips, *rng.normal(scale=0.6, size=(3, 3))])
    at = drawn.goal[:3, 3] + tips @ drawn.goal[:3, :3].T
    slides = [curve.direction for curve in drawn.system.curves if isinstance(curve, Line)]
    slides += [normalise_vector(v) for v in rng.normal(size=(3, 3))]
    b = Builder("three_lines")
    b.link("base")
    b.link("platform", at=drawn.goal[:3, 3])
    for leg, (B, d) in enumerate(zip(at, slides, strict=True), 1):
        A = B - rng.uniform(0.8, 1.6) * d
        first = find_perpendicular(d)
        b.link(f"lower_{leg}", at=A)
        b.link(f"upper_{leg}", at=B)
        b.joint(f"foot_{leg}", "U", "base", f"lower_{leg}", at=A, axis=first, axis2=np.cross(d, first))
        b.joint(f"slide_{leg}", "P", f"lower_{leg}", f"upper_{leg}", at=(A + B) / 2, axis=d, motor=True)
        b.joint(f"tip_{leg}", "S", f"upper_{leg}", "platform", at=B, loop=leg > 1)
        b.observe(str(leg), f"upper_{leg}", d)
    return b.build(platform="platform")


def two_plates(drawn: Draw, rng: Rng) -> Mechanism:
    """4-R-{2-SS} with a platform of two plates on a parallelogram: leg 1 of plate 1 and leg 2 of plate 2 follow the
    circles, legs 3 and 4 hold the plates' orientation."""
    system, p = drawn.system, drawn.goal[:3, 3]
    slide = system.slide
    turn = next(mode.q[3] for mode in solve(system).modes if np.abs(mode.q[:3] - p).max() < 1e-6)
    origins = [p, p + slide.at(turn)]
    tips = [origin + tip for origin, tip in zip(origins, system.tips, strict=True)]
    bar = origins[1] - p - slide.centre
    hinge = origins[0] + slide.centre
    side = 0.5 * normalise_vector(np.cross(slide.axis, bar)) + 0.2 * bar
    b = Builder("two_circles")
    b.link("base")
    legs: list[tuple[int, Array, Array, Array]] = [
        (k, curve.axis, B, curve.centre) for k, (curve, B) in enumerate(zip(system.curves, tips, strict=True))
    ]
    for k in (0, 1):
        axis = normalise_vector(rng.normal(size=3))
        B = origins[k] + rng.normal(scale=0.4, size=3)
        legs.append((k, axis, B, B - rng.uniform(0.5, 1.0) * normalise_vector(np.cross(axis, rng.normal(size=3)))))
    for leg, (k, axis, B, centre) in enumerate(legs, 1):
        _leg(b, rng, leg, f"plate_{k + 1}", axis, B, centre)
    for name, at in (("plate_1", origins[0]), ("platform", hinge), ("plate_2", origins[1]), ("side", hinge + side)):
        b.link(name, at=at)
    for name, ends, at, loop in (
        ("hinge_1", ("plate_1", "platform"), hinge, False),
        ("hinge_2", ("platform", "plate_2"), hinge + bar, False),
        ("side_1", ("plate_1", "side"), hinge + side, False),
        ("side_2", ("side", "plate_2"), hinge + side + bar, True),
    ):
        b.joint(name, "R", *ends, at=at, axis=slide.axis, loop=loop)
    return b.build(platform="platform")


def _leg(b: Builder, rng: Rng, leg: int, plate: str, axis: Array, B: Array, centre: Array) -> None:
    """An arm about ``axis``, and two rods whose balls lie apart along it."""
    rod = rng.uniform(0.8, 1.6) * normalise_vector(rng.normal(size=3))
    side = 0.1 * axis
    A, E = centre - rod, B - rod
    b.link(f"arm_{leg}", at=A)
    b.joint(f"shoulder_{leg}", "R", "base", f"arm_{leg}", at=A, axis=axis, motor=True)
    for letter, offset in (("a", side), ("b", -side)):
        b.link(f"rod_{leg}{letter}", at=E + offset)
        b.joint(f"elbow_{leg}{letter}", "S", f"arm_{leg}", f"rod_{leg}{letter}", at=E + offset)
        b.joint(
            f"wrist_{leg}{letter}",
            "S",
            f"rod_{leg}{letter}",
            plate,
            at=B + offset,
            loop=not (letter == "a" and leg == 1),
        )
    b.observe(str(leg), f"rod_{leg}a", rod)
