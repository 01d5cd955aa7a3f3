"""Platforms that a leg of R and P carries, and single loops of R and P, as the checker's kind ``chain``.

All is given at the goal: there each unknown is zero, and a loop of whatever rational axes closes. Of a loop the last
two joints have no unknowns: with h₁, h₂ their axes the others have to be, but for a factor, in the span of 1, h₁, h₂
and h₂ h₁, which four *normals* annul (M. L. Husty, M. Pfurner and H.-P. Schröcker, Mech. Mach. Theory 42, 2007).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import gcd, prod
from typing import Any

import numpy as np

from ..analysis.modes.carrying_leg_modes import enclose_zeros, measure_joint_distances, proposals
from ..analysis.modes.carrying_leg_system import CarriedCondition, CarriedPlatform, Turn, permanent
from ..analysis.modes.conditions import AtAngle, OnPlane, OnRevolution
from ..analysis.modes.quadrics import UNIT
from ..analysis.modes.single_loop import SingleLoop, dual_product
from ..geometry.vectors import Array
from ..solving.newton import SAME_ZERO_DISTANCE_TOL, approach_zeros, collect_zeros
from .closures import write_numbers
from .refining import Polynomial
from .verify_certificate import KINDS, CertificateRejection, cross, dot, integral, rational, slope

PLATFORM = [["0", "0", "0"], ["1", "0", "0"], ["0", "1", "0"]]
"""Three points of the platform at the goal (sizes)."""
DEPENDENT_LOOP_JOINTS_COUNT = 2
"""Joints of a loop without unknowns."""
NORMAL_DENOMINATOR_COUNT = 1024
"""How finely normals are turned to be at right angles."""
STARTS, SETS, ITERATIONS = 64, 20, 60
"""Random starts at once, how often, and Newton's steps from them."""
ZERO_TO_GOAL_OFFSET_RAD = 0.6
"""Rotation of the zero position of each next joint of a leg from the goal (rad)."""

Starts = list[tuple[list[complex], bool | None]]


@dataclass(frozen=True, eq=False)
class ToldChain:
    """A system without boxes and bound; about where its solutions are, and whether they are real (None: no poses, the
    tangent of half an angle is ±i); for the real ones the number of the list's mode there, None where it is none."""

    record: dict[str, Any]
    starts: Starts
    modes: list[int | None]
    home: Array
    """Coordinates (n,) of the list's own that the record is relative to."""

    @classmethod
    def of(cls, record: dict[str, Any], starts: Starts, found: Sequence[Array], home: Array) -> ToldChain:
        """With the list's modes by their coordinates (rad, sizes)."""
        slides = np.array([kind == "P" for kind, *_ in record["joints"][: record["unknowns"]]])
        places = [np.where(slides, np.real(start), 2.0 * np.arctan(np.real(start))) for start, real in starts if real]

        def is_at(x: Array, q: Array) -> bool:
            return bool(measure_joint_distances(slides, x[: len(q)], q) < SAME_ZERO_DISTANCE_TOL)

        modes = [next((k for k, x in enumerate(found) if is_at(x, q)), None) for q in places]
        return cls(record, starts, modes, home)


def chains(system: CarriedPlatform, found: Sequence[Array]) -> Iterator[ToldChain]:
    """The ways to write a system with modes at these coordinates."""
    if not isinstance(system, SingleLoop):
        yield _carried_chain(system, found)
        return
    joints, m = [_joint(each, np.eye(3), np.zeros(3)) for each in system.freedoms_], len(system.freedoms_)
    back = [[kind, [str(-Fraction(c)) for c in a], o] for kind, a, o in joints[::-1]]
    n = max(1, m - DEPENDENT_LOOP_JOINTS_COUNT)
    for way, ends, q in ((joints, system.before, found), (back, m - system.before, [x[::-1] for x in found])):
        if 0 < ends <= n:
            record = _record(way, n, ends) | {"normals": _normals(way[n:])}
            yield ToldChain.of(record, _solve_loop(record), q, system.home)


def _record(joints: list[Any], n: int, ends: int) -> dict[str, Any]:
    return {
        "kind": "chain",
        "joints": joints,
        "unknowns": n,
        "ends": [[ends]],
        "normals": [],
        "tips": [*PLATFORM],
        "reaches": [],
    }


def _carried_chain(system: CarriedPlatform, found: Sequence[Array]) -> ToldChain:
    """Sort the conditions of the square part first. Angles are relative to a configuration where no joint is at the
    goal, so that a half turn from there, as observed directions allow, is not an infinite tangent."""
    n, told, slides = len(system.freedoms_), [*system.square], np.array([each.slides for each in system.freedoms_])
    told += [each for each in system.told if each not in told and _carriers(each)]
    off = np.where(slides, 0.0, ZERO_TO_GOAL_OFFSET_RAD * np.arange(1, n + 1))
    record = _record(
        [_joint(each, *system.transform(off, k)) for k, each in enumerate(system.freedoms_)], n, system.carrying
    )
    for each in told:
        tip, reach, arrow = _displaced_tip(each, *system.transform(off, each.joints))
        record["tips"].append(tip)
        record["reaches"].append(reach)
        record["ends"].append([min(_carriers(each)), max(_carriers(each)) + 1, arrow])
    turn, starts = np.exp(-1j * off), Starts()
    for box in enclose_zeros(system, proposals(system, system.most(system.square))):
        c, s, t = box.middle[:n], box.middle[n : 2 * n], box.middle[2 * n :]
        c, s = c * turn.real - s * turn.imag, s * turn.real + c * turn.imag
        starts.append((np.where(slides, t, s / (1.0 + c)).tolist(), box.real))
    return ToldChain.of(record, starts, [x - off for x in found], off)


def _carriers(told: CarriedCondition) -> list[int]:
    """Return the joints on which a condition depends."""
    return [k for k in range(told.joints) if k not in told.idle]


def _joint(turn: Turn, R: Array, p: Array) -> list[Any]:
    """A turn or a slide, displaced, its axis of length one, and a point."""
    return ["P" if turn.slides else "R", write_numbers(_unit(R @ turn.axis)), write_numbers(_near(p + R @ turn.point))]


def _near(v: Array) -> list[Fraction]:
    return [Fraction(round(float(x) * UNIT), UNIT) for x in v]


def _unit(v: Array) -> list[Fraction]:
    """A rational vector of length exactly one near a unit vector, by its image in a plane from its opposite."""
    k = int(np.argmax(np.abs(v)))
    sign = 1 if v[k] > 0 else -1
    image = _near(np.delete(v, k) / (1.0 + abs(v[k])))
    w = sum((x * x for x in image), Fraction(1))
    found = [2 * x / w for x in image]
    found.insert(k, sign * (2 - w) / w)
    return found


def _displaced_tip(each: CarriedCondition, R: Array, p: Array) -> tuple[Any, Any, int]:
    """A tip, or an arrow, displaced, and the plane or sphere on which it is."""
    c = each.condition
    b = write_numbers(_near(p + R @ c.b))
    if isinstance(c, OnPlane):
        return b, {"plane": write_numbers([_near(c.h * c.n / (c.n @ c.n)), _near(c.n)])}, 0
    if isinstance(c, AtAngle):
        return write_numbers(_near(R @ c.c)), {"plane": write_numbers([_near(c.h * c.a), _near(c.a)])}, 1
    if isinstance(c, OnRevolution) and float(c.f[2]) == -1.0 and float(c.f[1]) == 0.0:
        return b, {"sphere": write_numbers([_near(c.o), _near(c.f[:1])])}, 0
    raise CertificateRejection(f"legs have conditions that the checker does not know: {type(c).__name__}")


def _normals(joints: Sequence[Any]) -> list[Any]:
    """Whole vectors, about at right angles, that span what annuls all that some joints together can be, conjugated."""
    from flint import fmpz_mat

    units = [_dual(each) for each in joints]
    rows = []
    for chosen in product((0, 1), repeat=len(units)):
        total = np.array([Fraction(k == 0) for k in range(8)])
        for unit in (u for u, use in zip(units, chosen, strict=True) if use):
            total = dual_product(total, unit)
        common = prod({c.denominator for c in total})
        rows.append([int(c * common * (1 if k in (0, 4) else -1)) for k, c in enumerate(total)])
    kernel, size = fmpz_mat(rows).nullspace()
    vectors = [[int(kernel[i, k]) for i in range(8)] for k in range(int(size))]
    short = fmpz_mat([[c // gcd(*v) for c in v] for v in vectors]).lll()
    found = list[list[int]]()
    for row in short.table():
        v = [int(c) for c in row]
        for u in found:  # nearly at right angles to those before
            by = Fraction(round(NORMAL_DENOMINATOR_COUNT * dot(u, v) / dot(u, u)), NORMAL_DENOMINATOR_COUNT)
            v = [
                NORMAL_DENOMINATOR_COUNT * a - int(NORMAL_DENOMINATOR_COUNT * by) * b for a, b in zip(v, u, strict=True)
            ]
        found.append([c // gcd(*v) for c in v])
    return [[str(c) for c in v] for v in found]


def _dual(joint: Any) -> Array:
    """h of a joint."""
    kind, (a, o) = joint[0], rational(joint[1:])
    zero = [Fraction(0)] * 3
    first, second = (a, cross(o, a)) if kind == "R" else (zero, [c / 2 for c in a])
    return np.array([Fraction(0), *first, Fraction(0), *second])


def _solve_loop(record: dict[str, Any]) -> Starts:
    """About where all solutions of a loop's equations are, by Newton's method from random complex starts, as many as
    the degrees allow (a permanent)."""
    equations = [integral(p) for p in KINDS["chain"][0](record, rational(record["tips"]))[0]]
    n, rng = len(equations), np.random.default_rng(0)
    most = permanent(np.array([[max(e[k] for e in p) for k in range(n)] for p in equations]))
    values, slopes = [_float(p) for p in equations], [[_float(slope(p, k), p) for k in range(n)] for p in equations]

    def evaluate(x: Array) -> tuple[Array, Array]:
        J = [np.stack([f(x) for f in row], axis=-1) for row in slopes]
        return np.stack([f(x) for f in values], axis=-1), np.stack(J, axis=-2)

    def draw() -> Array:
        x = rng.normal(size=(STARTS, n)) + 1j * rng.normal(size=(STARTS, n))
        x[0] = 0.0
        return x

    ends = (approach_zeros(evaluate, draw(), steps=ITERATIONS, longest=1.0) for _ in range(SETS))
    found = collect_zeros(ends, most)
    turns = [kind == "R" for kind, *_ in record["joints"][:n]]
    is_far = np.abs(found * found + 1.0)[:, turns].min(axis=1, initial=1.0) < SAME_ZERO_DISTANCE_TOL
    is_real_ = np.abs(found.imag).max(axis=1) < SAME_ZERO_DISTANCE_TOL
    return [(z.tolist(), None if far else bool(real)) for z, far, real in zip(found, is_far, is_real_, strict=True)]


def _float(p: Polynomial, whole: Polynomial | None = None) -> Any:
    """A polynomial of arrays (k, n), its coefficients over the largest of the ``whole``."""
    most, e = max(map(abs, (whole or p).values())), np.array([*p], dtype=int)
    c = np.array([float(Fraction(v) / most) for v in p.values()])
    return lambda x: np.prod(x[:, None, :] ** e.reshape(-1, x.shape[1]), axis=2) @ c
