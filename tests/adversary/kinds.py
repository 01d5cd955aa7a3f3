"""Kinds of random robots, one generator each, with special geometry on purpose and near misses of it.

A generator takes random numbers and gives a robot in base coordinates, special in ways that its tags name.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from adversary.drafts import Array, Made, across, parallel_rods, turn, unit

Rng = np.random.Generator
Z = np.array([0.0, 0.0, 1.0])
KINDS: dict[str, Callable[[Rng], Made]] = {}


def kind(make: Callable[[Rng], Made]) -> Callable[[Rng], Made]:
    """Enter a generator in the table."""
    KINDS[make.__name__] = make
    return make


def miss(rng: Rng, made: Made, name: str, chance: float = 0.25) -> float | None:
    """None: no special relation; 0: it holds; else by how much (1e-3 … 1e-12) it is missed."""
    if rng.random() > chance:
        return None
    if rng.random() < 0.6:
        made.tags.add(name)
        return 0.0
    power = int(rng.integers(3, 13))
    made.tags.add(f"{name} 1e-{power}")
    return 10.0**-power


def aside(rng: Rng, size: float | None, at: Array, special: Array) -> Array:
    """``at`` itself (None), ``special``, or nearly so."""
    return at if size is None else special + size * unit(rng.normal(size=3))


def ring(rng: Rng, count: int, radius: float, height: float, rough: float = 0.1) -> Array:
    """Points (count, 3) about a circle."""
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.25, 0.25, count)) / count + rng.uniform(0, 6.28)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], 1)
    return points + rough * radius * rng.normal(size=points.shape)


def tangents(points: Array) -> Array:
    """Horizontal unit vectors normal to the radii of points (k, 3)."""
    return np.array([unit(np.cross(Z, p * [1, 1, 0] + 1e-9)) for p in points])


def feet_and_tips(rng: Rng, made: Made, count: int, up: float = 0.4) -> tuple[Array, Array]:
    """Feet and tips of legs: coplanar, in one line, similar, or with shared balls at times."""
    A, B = ring(rng, count, 0.35, 0.0), ring(rng, count, 0.18, 0.0) + made.at
    if (size := miss(rng, made, "coplanar", 0.3)) is not None:
        A[:, 2] = size * rng.normal(size=count)
        B[:, 2] = made.at[2] + size * rng.normal(size=count)
    if (size := miss(rng, made, "similar", 0.12)) is not None:
        B = made.at + 0.5 * A @ turn(Z, rng.uniform(0, 1)).T + size * rng.normal(size=A.shape)
    if count > 3 and (size := miss(rng, made, "shared ball", 0.3)) is not None:
        for _ in range(int(rng.integers(1, count // 2 + 1))):
            i, j = rng.choice(count, 2, replace=False)
            B[i] = aside(rng, size, B[i], B[j])
    if count > 3 and (size := miss(rng, made, "shared foot", 0.12)) is not None:
        i, j = rng.choice(count, 2, replace=False)
        A[i] = aside(rng, size, A[i], A[j])
    if count >= 3 and (size := miss(rng, made, "parallel legs", 0.15)) is not None:
        for i in range(1, int(rng.integers(2, count + 1))):
            A[i] = B[i] - (B[0] - A[0]) * rng.uniform(0.8, 1.2) + size * rng.normal(size=3)
    return A, B


def telescopic(made: Made, i: int, A: Array, B: Array, first: Array, base: str, end: str) -> None:
    """A leg i with an actuated P between a U, R or S at A and an S or U at B."""
    second = np.cross(first, B - A)
    axes = {"U": (first, second), "R": (first,), "S": ()}[base]
    made.joint(f"foot_{i}", base, "base", f"cylinder_{i}", A, *axes)
    made.joint(f"slide_{i}", "P", f"cylinder_{i}", f"rod_{i}", (A + B) / 2, B - A, motor=True)
    made.joint(f"tip_{i}", end, f"rod_{i}", "platform", B, *((second, first) if end == "U" else ()))


def tilted(rng: Rng, made: Made) -> Made:
    """The robot moved to another place, turned as anything."""
    if rng.random() < 0.6:
        made.moved(turn(rng.normal(size=3), rng.uniform(0, 3)), 0.1 * rng.normal(size=3))
        made.tags.add("tilted")
    return made


def above(rng: Rng, name: str) -> Made:
    """A robot in the making whose platform stands over the base."""
    return Made(name, np.array([*0.05 * rng.normal(size=2), rng.uniform(0.3, 0.6)]))


@kind
def pods(rng: Rng) -> Made:
    """Three to six legs UPS, RPS, SPS at random, balls shared."""
    count = int(rng.integers(3, 7))
    made = above(rng, f"pod of {count}")
    A, B = feet_and_tips(rng, made, count)
    restrained = 6 - count if count < 6 else 0
    for i, (a, b) in enumerate(zip(A, B, strict=True)):
        # R at a foot takes one freedom each: at most as many as leave three
        low = "R" if i < min(restrained, 3) and rng.random() < 0.5 else "S" if rng.random() < 0.3 else "U"
        telescopic(made, i + 1, a, b, across(b - a, rng), low, "S")
    return tilted(rng, made)


@kind
def offset_u(rng: Rng) -> Made:
    """Hexapods and tripods with feet of two R that do not meet."""
    count = int(rng.choice([3, 3, 6]))
    made = above(rng, f"{count}-RRPS, offset")
    A, B = feet_and_tips(rng, made, count)
    size = rng.choice([0.0, 1e-9, 1e-6, 1e-3, 0.05], p=[0.1, 0.1, 0.1, 0.1, 0.6])
    for i, (a, b) in enumerate(zip(A, B, strict=True), 1):
        first = across(b - a, rng)
        second = unit(np.cross(first, b - a) + (0.0 if rng.random() < 0.5 else 0.4) * (b - a))
        c = a + size * unit(np.cross(first, second))
        made.joint(f"foot_{i}", "R", "base", f"knuckle_{i}", a, first)
        made.joint(f"knee_{i}", "R", f"knuckle_{i}", f"cylinder_{i}", c, second)
        made.joint(f"slide_{i}", "P", f"cylinder_{i}", f"rod_{i}", (c + b) / 2, b - c, motor=True)
        made.joint(f"tip_{i}", "S", f"rod_{i}", "platform", b)
    made.tags.add(f"offset {size:g}")
    return tilted(rng, made)


def planar_leg(
    made: Made,
    i: int,
    letters: str,
    A: Array,
    B: Array,
    rng: Rng,
    rail: Array | None = None,
    end: str = "platform",
    motor: int = 0,
) -> None:
    """A leg of three joints R and P in the plane z = 0."""
    C = (A + B) / 2 + 0.6 * np.linalg.norm(B - A) * np.cross(Z, unit(B - A)) * rng.choice([-1, 1]) * rng.uniform(0.4, 1)
    places = {
        "RRR": (A, C, B),
        "PRR": (A, A, B),
        "RPR": (A, (A + B) / 2, B),
        "RRP": (A, C, B),
        "PRP": (A, A, B),
        "RPP": (A, A, B),
        "PPR": (A, A, B),
    }[letters]
    links = ["base", f"a_{i}", f"b_{i}", end]
    for n, (letter, at) in enumerate(zip(letters, places, strict=True)):
        slide = unit(B - A) if letters == "RPR" else unit([*rng.normal(size=2), 0.0])
        if letters[0] == "P" and n == 0 and rail is not None:
            slide = rail
        made.joint(f"j{i}{n + 1}", letter, links[n], links[n + 1], at, Z if letter == "R" else slide, motor=n == motor)


@kind
def planar(rng: Rng) -> Made:
    """Three legs RRR, RPR, PRR, alike or mixed, on a plane of any tilt."""
    made = Made("planar", np.array([*0.05 * rng.normal(size=2), 0.0]))
    flat = np.array([1.0, 1.0, 0.0])
    A, B = ring(rng, 3, 0.4, 0.0) * flat, (ring(rng, 3, 0.15, 0.0) + made.at) * flat
    if (size := miss(rng, made, "similar")) is not None:
        B = made.at + 0.4 * A @ turn(Z, rng.uniform(0, 2)).T + size * rng.normal(size=A.shape) * flat
    if (size := miss(rng, made, "tips in a line", 0.15)) is not None:
        B[2] = (B[0] + B[1]) * 0.45 + (0.1 * made.at) + size * rng.normal(size=3) * flat
    if (size := miss(rng, made, "shared tip", 0.15)) is not None:
        B[1] = B[0] + size * rng.normal(size=3) * flat
    one = str(rng.choice(["RRR", "RPR", "PRR"]))
    size = miss(rng, made, "parallel rails", 0.3)
    rail = unit([*rng.normal(size=2), 0.0])
    for i in range(3):
        letters = one if rng.random() < 0.7 else str(rng.choice(["RRR", "RPR", "PRR", "RRP"]))
        own = None if size is None else unit(rail + size * rng.normal(size=3) * flat)
        planar_leg(made, i + 1, letters, A[i], B[i], rng, own, motor=0 if letters != "RPR" else int(rng.integers(2)))
    return tilted(rng, made)


@kind
def fivebars(rng: Rng) -> Made:
    """Two legs whose ends meet in one R: RRRRR, RPRPR, PRRRP, equal and parallel at times."""
    made = Made("five-bar", np.array([*0.05 * rng.normal(size=2), 0.0]))
    A = np.array([[-0.25, -0.3, 0], [0.25, -0.3, 0]]) + 0.05 * rng.normal(size=(2, 3)) * [1, 1, 0]
    size = miss(rng, made, "parallel rails", 0.3)
    rail = unit([*rng.normal(size=2), 0.0])
    for i in range(2):
        letters = str(rng.choice(["RRR", "RPR", "PRR"]))
        own = None if size is None else unit(rail + size * rng.normal(size=3) * [1, 1, 0])
        planar_leg(made, i + 1, letters, A[i], made.at, rng, own)
    return tilted(rng, made)


def delta_leg(
    made: Made,
    i: int,
    A: Array,
    C: Array,
    B: Array,
    drive: str,
    axis: Array,
    side: Array,
    end: str,
    ends: tuple[str, str] = ("S", "S"),
) -> None:
    """A leg with a driven R or P at A and two rods from C to B."""
    made.joint(f"drive_{i}", drive, "base", f"arm_{i}", A, axis, motor=True)
    parallel_rods(made, f"rod_{i}", f"arm_{i}", end, C, B, side, ends)


@kind
def deltas(rng: Rng) -> Made:
    """Two to four driven arms or carriages with {2-SS} or {2-US}, sides along the axis or not quite."""
    count = int(rng.choice([2, 3, 3, 4]))
    made = Made(f"delta of {count}", np.array([*0.05 * rng.normal(size=2), -rng.uniform(0.5, 0.8)]))
    A, B = ring(rng, count, 0.3, 0.0, 0.03), ring(rng, count, 0.1, 0.0, 0.03) + made.at
    T = tangents(A)
    parallel = miss(rng, made, "parallel rails", 0.25)
    common = unit(rng.normal(size=3))
    for i in range(count):
        drive = str(rng.choice(["R", "P"])) if parallel is None else "P"
        C = A[i] + 0.25 * unit(A[i] * [1, 1, 0] + 0.3 * Z) + 0.05 * rng.normal(size=3)
        axis = T[i] if drive == "R" else unit(0.5 * A[i] - 0.3 * Z)
        if parallel is not None:
            axis = unit(common + parallel * rng.normal(size=3))
        side = 0.05 * T[i]
        delta_leg(
            made, i + 1, A[i], C, B[i], drive, axis, side, "platform", ("S", "S") if rng.random() < 0.7 else ("U", "S")
        )
    return tilted(rng, made)


@kind
def quattros(rng: Rng) -> Made:
    """Four arms with {2-SS} on two plates: joined by a parallelogram (a bar) or by a slide."""
    made = Made("quattro", np.array([*0.02 * rng.normal(size=2), -rng.uniform(0.5, 0.8)]))
    angle = np.pi / 4 + np.pi / 2 * np.arange(4)
    A = 0.28 * np.stack([np.cos(angle), np.sin(angle), np.zeros(4)], 1) + 0.01 * rng.normal(size=(4, 3))
    T = tangents(A)
    along = 0.1 * unit([*rng.normal(size=2), 0.0])
    offset = 0.08 * unit(np.cross(Z, along) + 0.3 * along)
    bar = rng.random() < 0.7
    plates = [0, 0, 1, 1] if rng.random() < 0.5 else [0, 1, 0, 1]
    ends = ("left", "right") if bar else ("left", "platform")
    for i in range(4):
        C = A[i] + 0.25 * unit(A[i] * [1, 1, 0])
        B = made.at + (2 * plates[i] - 1) * (along if bar else 0 * along) + 0.08 * unit(A[i] * [1, 1, 0])
        B = B + 0.01 * rng.normal(size=3)
        delta_leg(made, i + 1, A[i], C, B, "R", T[i], 0.05 * T[i], ends[plates[i]])
        if i == 0 and bar:
            made.joint("hinge_1", "R", "left", "platform", made.at - along, Z)
            made.joint("hinge_2", "R", "platform", "right", made.at + along, Z)
            made.joint("twin_1", "R", "left", "twin", made.at - along + offset, Z)
            made.joint("twin_2", "R", "twin", "right", made.at + along + offset, Z)
            made.pairs.append(("platform", "twin"))
        elif i == 0:
            made.joint("slide", "P", "left", "platform", made.at, unit([*rng.normal(size=2), 0.0]))
    return tilted(rng, made)


@kind
def tripods(rng: Rng) -> Made:
    """3-RRS, 3-PRS, 3-RPS: tangential or skew axes, in one plane or not: several operation modes."""
    made = above(rng, "tripod")
    A, B = ring(rng, 3, 0.35, 0.0, 0.02), ring(rng, 3, 0.18, 0.0, 0.02) + made.at
    size = miss(rng, made, "equilateral", 0.4)
    if size is not None:
        angle = 2 * np.pi / 3 * np.arange(3)
        circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
        made.at = made.at * [0, 0, 1]
        A = 0.35 * circle + size * rng.normal(size=(3, 3))
        B = made.at + 0.2 * circle + size * rng.normal(size=(3, 3))
    skew = rng.random() < 0.3
    letters = str(rng.choice(["RR", "PR", "RP"]))
    rails = miss(rng, made, "parallel rails", 0.3)
    T = tangents(A)
    for i in range(3):
        first = unit(T[i] + (0.5 * rng.normal(size=3) if skew else 0))
        second = unit(T[i] + (0.5 * rng.normal(size=3) if skew else 0))
        C = (A[i] + B[i]) / 2 + 0.15 * unit(np.cross(first, B[i] - A[i])) * rng.choice([-1, 1])
        if letters == "RR":
            made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i], first, motor=True)
            made.joint(f"knee_{i}", "R", f"arm_{i}", f"rod_{i}", C, second)
        elif letters == "PR":
            rail = unit([*-A[i][:2], 0.3]) if rails is None else unit(Z + rails * rng.normal(size=3))
            made.joint(f"foot_{i}", "P", "base", f"arm_{i}", A[i], rail, motor=True)
            made.joint(f"knee_{i}", "R", f"arm_{i}", f"rod_{i}", A[i], second)
        else:
            made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i], first)
            made.joint(f"knee_{i}", "P", f"arm_{i}", f"rod_{i}", (A[i] + B[i]) / 2, B[i] - A[i], motor=True)
        made.joint(f"ball_{i}", "S", f"rod_{i}", "platform", B[i])
    made.tags.add(f"{letters}S{' skew' if skew else ''}")
    return tilted(rng, made)


@kind
def upus(rng: Rng) -> Made:
    """3-UPU and 4-UPU: outer axes parallel, meeting in a point, or skew; several operation modes that meet."""
    made = above(rng, "upu")
    count = int(rng.choice([3, 3, 3, 4]))
    equal = rng.random() < 0.4
    A, B = ring(rng, count, 0.35, 0.0, 0.0 if equal else 0.05), ring(rng, count, 0.15, 0.0, 0.0) + made.at
    T = tangents(A)
    how = str(rng.choice(["parallel", "meet", "general"], p=[0.6, 0.25, 0.15]))
    meet = made.at + [0.02, -0.03, 0.5]
    for i in range(count):
        a, b = A[i], B[i]
        skew = unit(T[i] + 0.3 * rng.normal(size=3))
        outer = T[i] if how == "parallel" else unit(meet - a) if how == "meet" else skew
        last = unit(meet - b) if how == "meet" else outer
        inner = unit(np.cross(outer, b - a)) if how != "meet" else unit(np.cross(unit(meet - a), unit(meet - b)))
        made.joint(f"foot_{i}", "U", "base", f"cylinder_{i}", a, outer, inner)
        made.joint(f"slide_{i}", "P", f"cylinder_{i}", f"rod_{i}", (a + b) / 2, b - a, motor=True)
        made.joint(f"tip_{i}", "U", f"rod_{i}", "platform", b, inner, last)
    made.tags.add(how)
    return tilted(rng, made)


@kind
def schoenflies(rng: Rng) -> Made:
    """4-RUU and 4-PUU with parallel outer axes (3T1R, constraint singularities) and 3-RUU, 3-PUU (3T)."""
    count = int(rng.choice([3, 4, 4]))
    made = above(rng, f"{count}-RUU")
    A, B = ring(rng, count, 0.35, 0.0, 0.05), ring(rng, count, 0.12, 0.0, 0.1) + made.at
    T = tangents(A)
    along = [Z] * count if count == 4 else list(T)
    drive = str(rng.choice(["R", "R", "P"]))
    for i in range(count):
        C = (A[i] + B[i]) / 2 + 0.2 * unit(A[i] * [1, 1, 0]) + 0.03 * rng.normal(size=3)
        inner = across(along[i], rng)
        axis = along[i] if drive == "R" else (Z if rng.random() < 0.3 else unit(rng.normal(size=3)))
        made.joint(f"drive_{i}", drive, "base", f"arm_{i}", A[i], axis, motor=True)
        made.joint(f"elbow_{i}", "U", f"arm_{i}", f"rod_{i}", C, along[i], inner)
        made.joint(f"wrist_{i}", "U", f"rod_{i}", "platform", B[i], inner, along[i])
    return tilted(rng, made)


@kind
def four_bars(rng: Rng) -> Made:
    """Planar or tripod robots one or all of whose legs are driven through a four-bar."""
    planar_one = rng.random() < 0.6
    made = (
        Made("four-bar, planar", np.array([*0.05 * rng.normal(size=2), 0.0]))
        if planar_one
        else above(rng, "four-bar, tripod")
    )
    A, B = ring(rng, 3, 0.4, 0.0, 0.02), ring(rng, 3, 0.15, 0.0, 0.02) + made.at
    if planar_one:
        A[:, 2] = B[:, 2] = 0
    T = np.array([Z] * 3) if planar_one else tangents(A)
    driven = int(rng.integers(1, 4))
    square = miss(rng, made, "parallelogram", 0.25)
    for i in range(3):
        n = T[i]
        towards = unit(np.cross(n, np.cross(B[i] - A[i], n)))
        C = A[i] + 0.5 * (B[i] - A[i]) + 0.15 * np.cross(n, towards)
        if i < driven:
            M = A[i] + 0.12 * np.cross(n, towards) - 0.05 * towards
            D = M + 0.08 * turn(n, rng.uniform(0, 6)) @ towards
            E = A[i] + 0.4 * (C - A[i]) + 0.03 * np.cross(n, towards)
            if square is not None:
                made.turned.append(("base", f"coupler_{i}"))
                D = M + (E - A[i]) + square * np.cross(n, rng.normal(size=3))
            made.joint(f"crank_{i}", "R", "base", f"crank_{i}", M, n, motor=True)
            made.joint(f"pin_{i}", "R", f"crank_{i}", f"coupler_{i}", D, n)
            made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i], n)
            made.joint(f"eye_{i}", "R", f"coupler_{i}", f"arm_{i}", E, n)
        else:
            made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i], n, motor=True)
        made.joint(f"knee_{i}", "R", f"arm_{i}", f"rod_{i}", C, n)
        made.joint(f"end_{i}", "R" if planar_one else "S", f"rod_{i}", "platform", B[i], *((n,) if planar_one else ()))
        made.observed.append((str(i + 1), f"rod_{i}", unit(B[i] - C)))
    return tilted(rng, made)


@kind
def rods(rng: Rng) -> Made:
    """Six rods US from arms or carriages: Hexa, Hexaglide, with parallel rails, pairs and shared balls."""
    made = Made("rods", np.array([*0.03 * rng.normal(size=2), -rng.uniform(0.45, 0.7)]))
    A, B = ring(rng, 6, 0.35, 0.0, 0.05), ring(rng, 6, 0.15, 0.0, 0.05) + made.at
    if (size := miss(rng, made, "shared ball", 0.25)) is not None:
        for i in range(0, 6, 2):
            B[i + 1] = B[i] + size * rng.normal(size=3)
    drive = str(rng.choice(["R", "P"]))
    rails = miss(rng, made, "parallel rails", 0.35)
    pairs = miss(rng, made, "pairs of axes", 0.25)
    T = tangents(A)
    common = unit(rng.normal(size=3))
    for i in range(6):
        axis = unit(T[i] + 0.2 * rng.normal(size=3))
        if rails is not None:
            axis = unit(common + rails * rng.normal(size=3))
        elif pairs is not None and i % 2:
            axis = unit(T[i - 1] + pairs * rng.normal(size=3))
        C = A[i] + (0.2 * unit(np.cross(axis, Z)) if drive == "R" else 0)
        first = across(axis, rng) if rng.random() < 0.5 else axis
        made.joint(f"drive_{i}", drive, "base", f"arm_{i}", A[i], axis, motor=True)
        made.joint(f"elbow_{i}", "U", f"arm_{i}", f"rod_{i}", C, first, np.cross(first, B[i] - C))
        made.joint(f"ball_{i}", "S", f"rod_{i}", "platform", B[i])
    return tilted(rng, made)


@kind
def slides(rng: Rng) -> Made:
    """PRRP, RPPR-like loops and legs that stand at a dead point: folded or stretched at zero."""
    made = Made("dead points", np.array([*0.05 * rng.normal(size=2), 0.0]))
    flat = np.array([1.0, 1.0, 0.0])
    A, B = ring(rng, 3, 0.4, 0.0) * flat, (ring(rng, 3, 0.15, 0.0) + made.at) * flat
    size = miss(rng, made, "dead point", 0.7)
    for i in range(3):
        away = unit(np.cross(Z, B[i] - A[i]))
        bend = 0.15 if i or size is None else size
        C = A[i] + 0.55 * (B[i] - A[i]) + bend * away
        made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i], Z, motor=True)
        made.joint(f"knee_{i}", "R", f"arm_{i}", f"rod_{i}", C, Z)
        made.joint(f"end_{i}", "R", f"rod_{i}", "platform", B[i], Z)
    return tilted(rng, made)


@kind
def translational(rng: Rng) -> Made:
    """Three legs of four or five R and P whose R have one or two directions: translations, at times by a hair."""
    made = above(rng, "translational")
    A, B = ring(rng, 3, 0.35, 0.0, 0.1), ring(rng, 3, 0.15, 0.0, 0.1) + made.at
    chain = str(rng.choice(["aaPa", "abba", "abPba", "aabb", "aaPbb", "Paaa", "Pabba", "aabba", "PaPa"]))
    tangential = rng.random() < 0.5
    T = tangents(A)
    size = miss(rng, made, "not quite parallel", 0.15)
    for i in range(3):
        axes = {"a": T[i] if tangential else unit(rng.normal(size=3)), "b": unit(rng.normal(size=3))}
        steps = len(chain)
        before = "base"
        for n, letter in enumerate(chain):
            at = A[i] + (B[i] - A[i]) * n / (steps - 1) + (0.12 * rng.normal(size=3) if 0 < n < steps - 1 else 0)
            after = "platform" if n == steps - 1 else f"link_{i}_{n}"
            axis = axes.get(letter, rng.normal(size=3))
            if size and n == 1:
                axis = unit(axis + size * rng.normal(size=3))
            made.joint(f"j_{i}_{n}", "P" if letter == "P" else "R", before, after, at, axis, motor=n == 0)
            before = after
    made.tags.add(chain)
    return tilted(rng, made)


@kind
def spherical(rng: Rng) -> Made:
    """Three legs RRR or UPU-like about a common centre, which some axes miss by a hair."""
    made = above(rng, "spherical")
    centre = made.at + [0.02, 0.01, -0.1]
    A, B = ring(rng, 3, 0.35, 0.0, 0.1), ring(rng, 3, 0.2, 0.1, 0.1) + made.at
    size = miss(rng, made, "axis misses the centre", 0.3)
    for i in range(3):
        C = (A[i] + B[i]) / 2 + 0.2 * rng.normal(size=3)
        off = np.zeros(3) if not size or i else size * unit(rng.normal(size=3))
        made.joint(f"foot_{i}", "R", "base", f"arm_{i}", A[i] + off, centre - A[i], motor=True)
        made.joint(f"knee_{i}", "R", f"arm_{i}", f"rod_{i}", C, centre - C)
        made.joint(f"end_{i}", "R", f"rod_{i}", "platform", B[i], centre - B[i])
        made.observed.append((str(i + 1), f"rod_{i}", unit(B[i] - C)))
    return tilted(rng, made)
