"""All assembly modes of a platform whose tips are confined to curves (theory 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...mechanism.vectors import Array, frozen
from ...tolerances import NEARLY_DOUBLE, VANISHES
from .near import dimension, stationary
from .roots import Root, Roots, nearly_double, solve_square
from .squares import Square
from .systems import System


@dataclass(frozen=True, eq=False)
class Mode:
    """A pose with the directions that are held.

    ``parameters`` of the curves that were solved for (m, rad), each within ``radius`` (sizes, rad); ``legs`` the places
    of the curves in the square part; ``residual`` the largest distance of a tip from its curve (sizes); ``q`` the
    system's own coordinates; ``pose`` (4, 4) the platform's frame in the base frame. A size is that of the mechanism.
    """

    parameters: tuple[float, ...]
    radius: float
    residual: float
    pose: Array
    q: Array
    legs: tuple[int, ...] = ()
    multiplicity: int = 1

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return {"parameters": list(self.parameters), "radius": self.radius, "residual": self.residual,
                "pose": self.pose.tolist(), "multiplicity": self.multiplicity}


@dataclass(frozen=True, eq=False)
class Modes:
    """All modes: ``complex`` solutions counted with multiplicity, the real ones as ``modes``, and in words the proof.

    Where more is observed than needed, ``complex`` counts only the modes. ``complete`` holds only if every complex
    solution is isolated and every real one enclosed. ``near`` are poses that match almost (none unless more is observed
    than needed); ``degenerate`` says what is special about the input: a continuum, of dimension ``continuum``, a
    singular pose, tips on one line.
    """

    complex: int
    modes: tuple[Mode, ...]
    complete: bool
    proof: str
    near: tuple[Mode, ...] = ()
    degenerate: str | None = None
    continuum: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """The record of the command line, without the command's own fields."""
        return {"complex": self.complex, "complete": self.complete, "proof": self.proof,
                "modes": [each.to_dict() for each in self.modes], "near": [each.to_dict() for each in self.near],
                "degenerate": self.degenerate, "continuum": self.continuum}


def solve(system: System) -> Modes:
    """All modes of a system: the solutions of its first square part that is not degenerate at which all tips fit.

    Where more is observed than needed, a pose is a mode if its residual is at most ``VANISHES``; ``near`` are the poses
    with a residual up to ``NEAR_MODE`` where the sum of squares is stationary, found from every square part.
    """
    if system.missing:
        return _continuum(f"too few legs: a continuum of dimension {system.missing}", system.missing)
    square = None
    for square in system.squares():
        roots = solve_square(square)
        if not roots.continuum:
            return _judged(system, square, roots)
    if square is None:
        return Modes(0, (), False, "nothing proved", degenerate="no choice of legs decides the pose: tips on one line, "
                     "in one point, or at rest")
    size = dimension(system, list(system.squares()))
    if size is None:
        return _continuum("the equations depend on each other, but no real pose was found", None)
    return _continuum(f"the curves coincide or slide along each other: a continuum of dimension {size}", size)


def _continuum(text: str, size: int | None) -> Modes:
    return Modes(0, (), False, "a continuum is not counted", degenerate=text, continuum=size)


def _judged(system: System, square: Square, roots: Roots) -> Modes:
    """The modes among the solutions of a square part."""
    found = [_mode(system, square, root) for root in roots.real]
    if square.whole:
        return Modes(roots.complex, tuple(found), roots.complete, _proof(roots), degenerate=_special(roots))
    modes = tuple(mode for mode in found if mode.residual <= VANISHES)
    starts = [mode.q for mode in found]
    for other in system.squares():
        if other.legs != square.legs:
            starts += [_mode(system, other, root).q for root in solve_square(other).real]
    near = tuple(_nearly(system, q) for q in stationary(system, starts, [mode.q for mode in modes]))
    proof = f"{_proof(roots)}; of these, {len(modes)} put the other tips on their curves, to {VANISHES:g} of the size"
    return Modes(len(modes), modes, roots.complete, proof, near, _special(roots))


def _mode(system: System, square: Square, root: Root) -> Mode:
    parameters = tuple(float(each.mid()) for each in root.parameters)
    q = square.place(parameters)
    return Mode(parameters, root.radius, residual(system, q), frozen(system.pose(q)), frozen(q), square.legs,
                root.multiplicity)


def _nearly(system: System, q: Array) -> Mode:
    return Mode((), np.inf, residual(system, q), frozen(system.pose(q)), frozen(q))


def residual(system: System, q: Array) -> float:
    """The largest distance of a tip from its curve, in sizes of the mechanism."""
    return float(np.linalg.norm(system.misses(q), axis=1).max()) / system.size


def _proof(roots: Roots) -> str:
    text = f"exact resultant of degree {roots.degree}"
    if roots.extraneous:
        text += f" ({roots.extraneous} more roots at infinity divided out)"
    text += f", {roots.complex} roots isolated"
    if roots.real:
        thin = sum(root.unique and not root.thick for root in roots.real)
        double = sum(root.real and not root.unique for root in roots.real)
        almost = sum(not root.real for root in roots.real)
        text += f", {len(roots.real) - almost} real, each enclosed with existence and uniqueness proved"
        text += f" ({thin} for the rounded geometry only)" if thin else ""
        text += f" ({double} not: multiple)" if double else ""
        text += f", {almost} pairs so close that rounding decides whether they are real" if almost else ""
    else:
        text += ", none real"
    return text


def _special(roots: Roots) -> str | None:
    if not nearly_double(roots):
        return None
    if any(root.multiplicity > 1 for root in roots.real):
        return "a double solution: a singular pose"
    return (f"two solutions only {roots.closest:.1e} apart (allowed for distinct poses: {NEARLY_DOUBLE:g}): "
            "a singular pose, to rounding")
