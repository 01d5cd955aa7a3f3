"""Formulas with sums gathered: those on forms with bounds cost by their operations, and lose what cancels in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..equations.tape import Symbol, Tape

Sum = dict[int, float]
"""Factors of symbols, by their numbers, and the constant at CONSTANT."""
CONSTANT = -1
SUM_SYMBOLS_MAX = 4
"""Terms of a sum that is written out wherever it is used."""

TERMS_MAX = 8
"""Terms of one ``linear``: compilers need gigabytes for thirty."""


def gather_sums(tape: Tape, stored: Sequence[Any]) -> tuple[Tape, list[Any]]:
    """Return the operations that some values of a tape need, and these values, with sums, differences and multiples as
    ``linear(constant, symbol, factor, …)``.

    Factors 1 - cos t are multiplied out: R + (1 - cos t) R K, where R K = -R, becomes cos t R.
    """
    gathered, sums = Tape([]), dict[int, Sum]()
    needed = sorted(tape.needed_operations([(0, value) for value in stored]))
    used = Counter(earlier for number in needed for earlier in tape.arguments(tape.code[number]))

    def write(x: Sum, sign: float = 1.0) -> Any:
        """A sum, or its negative, as a symbol or a constant."""
        constant = sign * x.get(CONSTANT, 0.0)
        terms = [part for k in sorted({*x} - {CONSTANT}) for part in (Symbol(gathered, k), sign * x[k])]
        while len(terms) > 2 * TERMS_MAX:
            terms = [gathered.make("linear", 0.0, *terms[: 2 * TERMS_MAX]), 1.0, *terms[2 * TERMS_MAX :]]
        if not terms:
            return constant
        return terms[0] if (constant, *terms[1:]) == (0.0, 1.0) else gathered.make("linear", constant, *terms)

    def split(x: Sum) -> tuple[Symbol, float]:
        """A symbol, and its factor in a sum of nothing else: the same symbol for a sum and its negative."""
        if len(x) == 1:
            return next((Symbol(gathered, k), factor) for k, factor in x.items())
        sign = float(np.copysign(1.0, x[max(x)]))
        return write(x, sign), sign

    for number in needed:
        name, *given = tape.code[number]
        if name == "load":
            sums[number] = {gathered.load(*given).number: 1.0}
            continue
        x, *rest = (sums[each] if isinstance(each, int) else {CONSTANT: each} for each in given)
        if name in ("+", "-"):
            value = add(x, rest[0], 1.0, 1.0 if name == "+" else -1.0)
        elif name == "*":
            a, b = (each.get(CONSTANT, 0.0) if len(each) <= 2 else 0.0 for each in (x, *rest))
            x, y = ({k: c for k, c in each.items() if k != CONSTANT or len(each) > 2} for each in (x, *rest))
            value = add(add(x, y, b, a), {CONSTANT: a * b})
            if x and y:
                (left, factor), (right, scale) = sorted(map(split, (x, y)), key=lambda term: term[0].number)
                value = add(value, {gathered.make("*", left, right).number: factor * scale})
        else:
            value = {gathered.make(name, write(x)).number: 1.0}
        if len(value) > SUM_SYMBOLS_MAX and used[number] > 1:
            symbol, factor = split(value)
            value = {symbol.number: factor}
        sums[number] = value
    return gathered, [write(sums[value.number]) if isinstance(value, Symbol) else value for value in stored]


def add(x: Sum, y: Sum, a: float = 1.0, b: float = 1.0) -> Sum:
    """Return a x + b y."""
    total = {k: a * x.get(k, 0.0) + b * y.get(k, 0.0) for k in (*x, *y)}
    return {k: factor for k, factor in total.items() if factor != 0.0}
