"""What the page says of the file is enough for another checker: its own equations, Newton's method, places of links."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import mpmath
import pytest

import hrsynth
from hrsynth.certificates.verify_certificate import KINDS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "pages" / "certificate_files.md"
CAMERA = {
    "camera": "eye=base@0.3,0.1,0",
    "sensor": ["point:platform@0.1,0,0", "point:platform@-0.1,0.1,0", "point:platform@0,0.1,0.1"],
}
ASKED: dict[str, tuple[str, str | None, dict[str, Any]]] = {
    "quattro": ("quattro", "1,4", {}),
    "delta": ("delta", "1,2", {}),
    "orthoglide": ("orthoglide", "1,2", {}),
    "3upu": ("3upu", "1,2", {}),
    "3rps": ("3rps", None, {}),
    "gough_stewart": ("gough_stewart", "1,3,5", {}),
    "three points": ("gough_stewart", None, CAMERA),
}


@cache
def record(name: str) -> dict[str, Any]:
    robot, observe, more = ASKED[name]
    return json.loads(json.dumps(hrsynth.certificate(hrsynth.modes(robot, observe, **more))))  # type: ignore[no-any-return]


def number(x: Any) -> Any:
    """Texts as numbers; lists of them."""
    if isinstance(x, list):
        return [number(each) for each in x]
    return mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator


def dot(u: Sequence[Any], v: Sequence[Any]) -> Any:
    return sum(a * b for a, b in zip(u, v, strict=True))


def minus(u: Sequence[Any], v: Sequence[Any]) -> list[Any]:
    return [a - b for a, b in zip(u, v, strict=True)]


def cross(u: Sequence[Any], v: Sequence[Any]) -> list[Any]:
    return [u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1))]


def on_curve(reach: dict[str, Any], t: Any) -> list[Any]:
    """A point of a point, line or circle."""
    ((kind, values),) = reach.items()
    c, *rest = number(values)
    along = [] if kind == "point" else [t] if kind == "line" else [(1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)]
    return [x + sum(s * v[k] for s, v in zip(along, rest, strict=True)) for k, x in enumerate(c)]


def misses(reach: dict[str, Any], x: Sequence[Any]) -> list[Any]:
    """What vanishes where a point is on a curve or surface."""
    ((kind, values),) = reach.items()
    c, *rest = number(values)
    off = minus(x, c)
    match kind:
        case "point":
            return off
        case "line":
            return cross(rest[0], off)
        case "plane":
            return [dot(rest[0], off)]
        case "sphere":
            return [dot(off, off) - rest[0][0]]
    return [dot(cross(*rest), off), dot(off, off) - dot(rest[0], rest[0])]


def read(system: dict[str, Any], x: Sequence[Any]) -> tuple[list[Any], list[list[Any]]]:
    """What vanishes at a solution of the square part, and where the first tips are."""
    tips, reaches, kind = number(system["tips"]), system["reaches"], system["kind"]
    if kind == "spatial":
        unknowns = iter(x)
        at = [on_curve(each, None if "point" in each else next(unknowns)) for each in reaches[:3]]
        return [
            dot(minus(at[i], at[j]), minus(at[i], at[j])) - dot(minus(tips[i], tips[j]), minus(tips[i], tips[j]))
            for i, j in combinations(range(3), 2)
        ], at
    if kind == "shifting":
        slid = on_curve(system["slide"], x[3]) if "slide" in system else [0, 0, 0]
        at = [
            [a + b + c * body for a, b, c in zip(x[:3], tip, slid, strict=True)]
            for tip, body in zip(tips, system["bodies"], strict=True)
        ]
        return [v for each, p in list(zip(reaches, at, strict=True))[: system["square"]] for v in misses(each, p)], at
    raise AssertionError(kind)


def solution(system: dict[str, Any], start: Sequence[Any]) -> list[Any]:
    """Newton's method, least squares, with derivatives by differences."""
    x, step = list(start), mpmath.mpf(10) ** -30
    for _ in range(6):
        F = read(system, x)[0]
        J = mpmath.matrix(len(F), len(x))
        for k in range(len(x)):
            ahead = read(system, [v + step * (i == k) for i, v in enumerate(x)])[0]
            for i, (new, old) in enumerate(zip(ahead, F, strict=True)):
                J[i, k] = (new - old) / step
        x = [a - b for a, b in zip(x, mpmath.lu_solve(J.H * J, J.H * mpmath.matrix(F)), strict=True)]
    return x


@pytest.mark.some(3)
@pytest.mark.parametrize("name", ASKED)
def test_another_checker_finds_the_solutions_in_their_boxes(name: str):
    with mpmath.workdps(60):
        found = record(name)
        for system in found["systems"]:
            middles = []
            for box in system["boxes"]:
                m = [mpmath.mpc(*number(each)) for each in box["middle"]]
                x, r = solution(system, m), number(box["radius"])
                assert all(max(abs((a - b).real), abs((a - b).imag)) <= r for a, b in zip(x, m, strict=True))
                assert max(map(abs, read(system, x)[0])) < 1e-40
                middles.append(x)
                if "pose" in box:
                    P, within = number(box["pose"]), number(box["within"]) * (1 + mpmath.mpf(10) ** -9)
                    bodies = system.get("bodies", [0] * len(system["tips"]))
                    for b, place, body in zip(number(system["tips"]), read(system, x)[1], bodies, strict=False):
                        there = [dot(row[:3], b) + row[3] for row in P]
                        assert body or max(abs(u - v) for u, v in zip(there, place, strict=True)) <= within
                    for reach, b in list(
                        zip(system["reaches"], number(system["tips"]), strict=False)
                        if system["kind"] == "spatial"
                        else ()
                    ):
                        off = misses(reach, [dot(row[:3], b) + row[3] for row in P])
                        assert max(map(abs, off)) < 1e-8
                if "links" in box:
                    closes(found["assembly"], box["links"])
            assert all(max(abs(a - b) for a, b in zip(x, y, strict=True)) > 1e-9 for x, y in combinations(middles, 2))
        boxes = [box for system in found["systems"] for box in system["boxes"]]
        assert found["real"] == sum("pose" in box for box in boxes)
        assert found["complex"] == sum("misses" not in box for box in boxes)


def closes(assembly: dict[str, Any], links: dict[str, Any]) -> None:
    """The joints' points and axes are one on both links, but for what slides or turns; what is held is as told."""
    for kind, one, other, point, *axes in assembly["joints"]:
        D, E = number(links[one]), number(links[other])
        off = minus([dot(row, number(point)) for row in D], [dot(row, number(point)) for row in E])
        u, v = ([[dot(row, number(axis)) for row in X] for axis in axes] for X in (D, E))
        if kind == "P":
            off = cross(off, u[0])
        assert max(map(abs, off)) < 1e-9
        if kind in "RP":
            assert max(map(abs, minus(u[0], v[0]))) < 1e-9
    for one, other, vector, seen in assembly["held"]:
        D, E, x = number(links[one]), number(links[other]), number(vector)
        there = [dot(row, x) - x[3] * base[3] for row, base in zip(D, E, strict=True)]
        assert (
            max(map(abs, minus([dot(column, there) for column in list(zip(*E, strict=True))[:3]], number(seen)))) < 1e-9
        )


def keys(each: Any) -> Iterator[str]:
    """All names in a record but those of links."""
    if isinstance(each, dict):
        for key, value in each.items():
            yield key
            yield from keys({}) if key in ("links", "at") and isinstance(value, dict) else keys(value)
    elif isinstance(each, list):
        for value in each:
            yield from keys(value)


def test_the_page_names_all_that_is_in_a_file():
    page = PAGE.read_text(encoding="utf-8")
    section = page[page.index("## What is in the file") :]
    words = {word for code in re.findall(r"`([^`]*)`", section.replace("\n", " ")) for word in re.findall(r"\w+", code)}
    needed = {key for name in ("quattro", "3rps") for key in keys(record(name))}
    needed |= {key for _, names in KINDS.values() for key in names.split()} | {"misses", "far"}
    needed |= set(keys(json.loads(json.dumps(hrsynth.certificate(hrsynth.derive("rrrrr_m1")))))) - {"A", "X", "Y"}
    assert needed - words == set()
