"""Formulas of a tape over boxes: traced once, evaluated on affine forms of thousands of boxes at once.

What depends on the robot's numbers alone is computed once, in balls; each number holds all that it was rounded from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..geometry.affine import AffineForms, stack
from ..results import Value
from ..tolerances import CHAIN_ROUNDING, HIDDEN_ROBOT_RESIDUAL_TOL
from .box_machine import MachineCode, Term, is_numba_worthwhile
from .tape import Symbol, Tape


def trace_formula(
    formula: Callable[..., Sequence[Any]], inputs: int, off: float = HIDDEN_ROBOT_RESIDUAL_TOL
) -> BoxFormula:
    """A formula from ``inputs`` numbers and from what makes components of the robot's numbers, each of which may be
    ``off`` by so much, as code for boxes."""
    tape = Tape([])

    def number(value: Any) -> Any:
        if np.ndim(value):
            return [number(each) for each in value]
        return tape.number(0.0 if abs(value) < CHAIN_ROUNDING else float(value))

    return BoxFormula.of(tape, formula([tape.load(i) for i in range(inputs)], number), off)


@dataclass(frozen=True, eq=False, repr=False)
class BoxFormula(Value):
    """Straight-line code on affine forms: steps (result, operation, arguments), an argument being the number of an
    earlier result or a number; which results are needed no more after each; and what is given out."""

    steps: Sequence[tuple[int, str, Sequence[int | Term]]]
    done: Sequence[Sequence[int]]
    outputs: Sequence[int | Term]

    @classmethod
    def of(cls, tape: Tape, outputs: Sequence[Any], off: float = HIDDEN_ROBOT_RESIDUAL_TOL) -> BoxFormula:
        """The code of some of a tape's symbols; the robot's numbers may be ``off`` by so much."""
        from flint import arb

        used = tape.needed_operations(list(enumerate(outputs)))
        known: dict[int, Any] = {}
        fixed = tape.are_constant()
        steps: list[tuple[int, str, Sequence[int | Term]]] = []

        def term(each: Any) -> int | Term:
            if isinstance(each, int):
                return _convert_to_term(known[each]) if fixed[each] else each
            return _convert_to_term(arb(each))

        for i in sorted(used):
            name, *arguments = tape.code[i]
            if name == "number":
                known[i] = arb(tape.numbers[arguments[0]], off)
            elif fixed[i]:
                known[i] = _apply_to_balls(name, [known[a] if isinstance(a, int) else arb(a) for a in arguments])
            else:
                steps.append((i, name, arguments if name == "load" else [term(a) for a in arguments]))
        given = [term(each.number if isinstance(each, Symbol) else float(each)) for each in outputs]
        kept = {each for each in given if isinstance(each, int)}
        last = {
            a: k
            for k, (_, name, arguments) in enumerate(steps)
            if name != "load"
            for a in arguments
            if isinstance(a, int)
        }
        done: list[list[int]] = [[] for _ in steps]
        for a, k in last.items():
            if a not in kept:
                done[k].append(a)
        return cls(steps, done, given)

    @cached_property
    def machine(self) -> MachineCode:
        """Formula translated for the machine that numba compiles."""
        return MachineCode.of(self.steps, self.done, self.outputs)

    def together(self, inputs: Sequence[AffineForms]) -> AffineForms:
        """Return the outputs (boxes, outputs) for inputs of shape (boxes,); NaN where a formula has a pole in a box."""
        return (
            self.machine.run(inputs)
            if is_numba_worthwhile(len(self.steps), len(inputs[0].r))
            else stack(self._rows(inputs))
        )

    def at(self, inputs: Sequence[AffineForms]) -> list[AffineForms]:
        """Return the outputs one after the other."""
        if not is_numba_worthwhile(len(self.steps), len(inputs[0].r)):
            return self._rows(inputs)
        found = self.machine.run(inputs)
        return [found[..., k] for k in range(len(self.outputs))]

    def _rows(self, inputs: Sequence[AffineForms]) -> list[AffineForms]:
        """In NumPy, each operation on all boxes."""
        found: dict[int, AffineForms] = {}
        pairs: dict[int, tuple[AffineForms, AffineForms]] = {}
        with np.errstate(all="ignore"):
            for (i, name, arguments), done in zip(self.steps, self.done, strict=True):
                if name == "load":
                    found[i] = inputs[arguments[0]]  # type: ignore[index]
                elif name in ("sin", "cos"):
                    of = arguments[0]
                    assert isinstance(of, int)
                    if of not in pairs:
                        pairs[of] = found[of].sines()
                    found[i] = pairs[of][name == "cos"]
                else:
                    found[i] = _apply_to_forms(name, [found[a] if isinstance(a, int) else a for a in arguments])
                for each in done:
                    del found[each]
        nothing = inputs[0].scaled(0.0, 0.0)
        return [found[each] if isinstance(each, int) else nothing.shifted(*each) for each in self.outputs]


def _convert_to_term(ball: Any) -> Term:
    """A ball as a float and how far it may be off."""
    if not ball.is_finite():
        return np.nan, np.inf
    middle = float(ball.mid())
    return middle, float(np.nextafter(float((ball - middle).abs_upper()), np.inf)) if not ball.is_exact() else 0.0


def _apply_to_balls(name: str, a: Sequence[Any]) -> Any:
    """An operation on balls."""
    match name:
        case "+":
            return a[0] + a[1]
        case "-":
            return a[0] - a[1]
        case "*":
            return a[0] * a[1]
        case "/":
            return a[0] / a[1]
        case "sqrt":
            return a[0].sqrt()
    raise ValueError(name)


def _apply_to_forms(name: str, a: Sequence[AffineForms | Term]) -> AffineForms:
    """An operation on forms, or on a form and a number."""
    one, other = a[0], a[-1]
    if isinstance(one, AffineForms) and isinstance(other, AffineForms):
        match name:
            case "+":
                return one + other
            case "-":
                return one - other
            case "*":
                return one * other
            case "sqrt":
                return one.sqrt()
    elif isinstance(one, AffineForms) and not isinstance(other, AffineForms):
        match name:
            case "+":
                return one.shifted(*other)
            case "-":
                return one.shifted(-other[0], other[1])
            case "*":
                return one.scaled(*other)
    elif isinstance(other, AffineForms) and not isinstance(one, AffineForms):
        match name:
            case "+":
                return other.shifted(*one)
            case "-":
                return (-other).shifted(*one)
            case "*":
                return other.scaled(*one)
            case "/":
                return other.inverse().scaled(*one)
    raise ValueError(name)
