"""Machine for straight-line code on affine forms, compiled once by numba for all formulas.

A form has one row for its centre, one for each symbol and one for its radius, of a few boxes side by side. Radii are
computed by the functions of :mod:`..geometry.affine`, whose text is compiled too: the numbers are those of its arrays
to the last bit.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import affine
from ..geometry.affine import (
    EXACT_SINE_ANGLE_MAX_RAD,
    AffineForms,
    bound_inverse,
    bound_line,
    bound_product,
    bound_root,
    bound_scaled,
    bound_sine,
    reduce_sines,
    round_radius,
    spread,
)
from ..geometry.vectors import Array
from ..results import Value
from .compiled_module import load_compiled_module
from .tape import TAPE_LANES_COUNT

BOX_STEPS_IN_NUMPY, BOXES_A_CALL = 40_000_000, 600
"""Operations on boxes done in NumPy before numba is started, and boxes that take as long as one call."""

Places = NDArray[np.int64]
Term = tuple[float, float]
"""A number, and how far it may be off."""
CODES = "LOAD", "ADD", "SUBTRACT", "MULTIPLY", "SCALE", "COPY", "SHIFT", "NEGATE", "INVERT", "ROOT", "SINES", "CONSTANT"
LOAD, ADD, SUBTRACT, MULTIPLY, SCALE, COPY, SHIFT, NEGATE, INVERT, ROOT, SINES, CONSTANT = range(12)
_NAMES = {"+": ADD, "-": SUBTRACT, "*": MULTIPLY, "sqrt": ROOT}
_NUMBERS = "AFFINE_ROUNDING", "HALF_PI", "EXACT_SINE_ANGLE_MAX_RAD", "SINE_SERIES", "COSINE_SERIES"
_FUNCTIONS = (
    round_radius,
    spread,
    bound_product,
    bound_scaled,
    bound_inverse,
    bound_root,
    bound_line,
    bound_sine,
    reduce_sines,
)
_TEXT = """from __future__ import annotations

from math import inf, nan

import numpy as np
from numba import njit

compiled = njit(cache=True, nogil=True, error_model="numpy")
{numbers}
TAPE_LANES_COUNT = {lanes}
{codes} = range({count})


{functions}
"""


class Work:
    """Operations on boxes that this process has done in NumPy."""

    done = 0


def is_numba_worthwhile(steps: int, boxes: int) -> bool:
    """Return True if numba is installed, and worth its start: after enough work in NumPy, where each step costs as much
    as some hundred boxes before the first. Sums of one box have another order there."""
    Work.done += steps * (boxes + BOXES_A_CALL)
    return Work.done > BOX_STEPS_IN_NUMPY and boxes > 1 and _has_numba()


@lru_cache(maxsize=1)
def _has_numba() -> bool:
    """Return True if numba is installed."""
    return find_spec("numba") is not None


@dataclass(frozen=True, eq=False, repr=False)
class MachineCode(Value):
    """Instructions (operation, place of the result, two arguments, input that is turned), the ``numbers`` that they
    name with their doubts, how many ``places`` there are, and those of the ``outputs``."""

    instructions: Places
    numbers: Array
    places: int
    outputs: Places

    @classmethod
    def of(
        cls,
        steps: Sequence[tuple[int, str, Sequence[int | Term]]],
        done: Sequence[Sequence[int]],
        outputs: Sequence[int | Term],
    ) -> MachineCode:
        """Translate the steps of a formula; ``done`` are the results no longer needed after each."""
        numbers: list[Term] = []
        code: list[tuple[int, ...]] = []
        at: dict[Any, int] = {}
        free: list[int] = []
        count = 0

        def fresh(name: Any) -> int:
            nonlocal count
            if free:
                at[name] = free.pop()
            else:
                at[name], count = count, count + 1
            return at[name]

        def number(term: Term) -> int:
            numbers.append(term)
            return len(numbers) - 1

        given: dict[int, int] = {}
        last = {of[0]: k for k, (_, name, of) in enumerate(steps) if name in ("sin", "cos")}
        for k, ((i, name, arguments), gone) in enumerate(zip(steps, done, strict=True)):
            a, b = arguments[0], arguments[-1]
            if name == "load":
                assert isinstance(a, int)
                code.append((LOAD, fresh(i), 0, 0, a))
                given[i] = a
            elif name in ("sin", "cos"):
                assert isinstance(a, int)
                if ("sin", a) not in at:
                    code.append((SINES, fresh(("sin", a)), at[a], fresh(("cos", a)), given.get(a, -1)))
                code.append((COPY, fresh(i), at[name, a], 0, 0))
                if last[a] == k:
                    free += [at.pop((each, a)) for each in ("sin", "cos")]
            elif not isinstance(a, tuple) and not isinstance(b, tuple):
                code.append((_NAMES[name], fresh(i), at[a], at[b], 0))
            else:
                one, term, first = (b, a, True) if isinstance(a, tuple) else (a, b, False)
                assert isinstance(term, tuple)
                source = at[one]
                if name == "/" or (name == "-" and first):
                    code.append((INVERT if name == "/" else NEGATE, fresh(i), source, 0, 0))
                    source = at[i]
                elif name == "-":
                    term = -term[0], term[1]
                code.append(
                    (
                        SCALE if name in "*/" else SHIFT,
                        at[i] if source == at.get(i) else fresh(i),
                        source,
                        number(term),
                        0,
                    )
                )
            free += [at.pop(each) for each in gone]
        found = []
        for each in outputs:
            if isinstance(each, tuple):
                code.append((CONSTANT, fresh(each), 0, number(each), 0))
            found.append(at[each])
        return cls(
            np.array(code, dtype=np.int64).reshape(-1, 5),
            np.array(numbers, dtype=float).reshape(-1, 2),
            count,
            np.array(found, dtype=np.int64),
        )

    def run(self, inputs: Sequence[AffineForms]) -> AffineForms:
        """All that is given out, (boxes, outputs), for inputs of shape (boxes,)."""
        c, S = len(inputs[0].r), len(inputs[0].v)
        given = np.empty((len(inputs), S + 1, c))
        for row, each in zip(given, inputs, strict=True):
            row[:S], row[S] = each.v, each.r
        bends = np.array([0 if each.bend is None else each.bend for each in inputs], dtype=np.int64)
        found = np.empty((S + 1, c, len(self.outputs)))
        _compile_machine()(self.instructions, self.numbers, self.places, self.outputs, given, bends, found)
        return AffineForms(found[:S], found[S])


def run_instructions(
    code: Places, numbers: Array, places: int, outputs: Places, given: Array, bends: Places, found: Array
) -> None:
    """Run instructions on forms ``given`` (inputs, symbols + 2, boxes), whose angles' bends have the symbols ``bends``
    (0 for none), to what is ``found`` (symbols + 2, boxes, outputs)."""
    rows, boxes = given.shape[1] - 1, given.shape[2]
    m = np.zeros((places, rows + 1, TAPE_LANES_COUNT))
    total, slopes_a, slopes_b, both, shared = (
        np.zeros(TAPE_LANES_COUNT),
        np.zeros(TAPE_LANES_COUNT),
        np.zeros(TAPE_LANES_COUNT),
        np.zeros(TAPE_LANES_COUNT),
        np.zeros(TAPE_LANES_COUNT),
    )
    for start in range(0, boxes, TAPE_LANES_COUNT):
        count = min(TAPE_LANES_COUNT, boxes - start)
        for step in range(code.shape[0]):
            name, number = code[step, 0], code[step, 3]
            to, a, b = m[code[step, 1]], m[code[step, 2]], m[min(number, places - 1)]
            if name == LOAD:
                for s in range(rows + 1):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = given[code[step, 4], s, start + min(i, count - 1)]
            elif name == ADD:
                for i in range(TAPE_LANES_COUNT):
                    total[i] = 0.0
                for s in range(rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i] + b[s, i]
                        total[i] += abs(to[s, i])
                for i in range(TAPE_LANES_COUNT):
                    to[rows, i] = round_radius(a[rows, i] + b[rows, i], total[i])
            elif name == SUBTRACT:
                for i in range(TAPE_LANES_COUNT):
                    total[i] = 0.0
                for s in range(rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i] - b[s, i]
                        total[i] += abs(to[s, i])
                for i in range(TAPE_LANES_COUNT):
                    to[rows, i] = round_radius(a[rows, i] + b[rows, i], total[i])
            elif name == MULTIPLY:
                for i in range(TAPE_LANES_COUNT):
                    slopes_a[i] = slopes_b[i] = both[i] = shared[i] = 0.0
                for s in range(1, rows):
                    for i in range(TAPE_LANES_COUNT):
                        x, y = a[s, i], b[s, i]
                        slopes_a[i] += abs(x)
                        slopes_b[i] += abs(y)
                        both[i] += x * y
                        shared[i] += abs(x * y)
                        to[s, i] = x * b[0, i] + y * a[0, i]
                for i in range(TAPE_LANES_COUNT):
                    to[0, i] = a[0, i] * b[0, i] + 0.5 * both[i]
                    to[rows, i] = bound_product(
                        a[0, i], slopes_a[i], a[rows, i], b[0, i], slopes_b[i], b[rows, i], shared[i]
                    )
            elif name == SCALE:
                factor, doubt = numbers[number, 0], numbers[number, 1]
                sum_sizes(a, 0, rows, total)
                for s in range(rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i] * factor
                for i in range(TAPE_LANES_COUNT):
                    to[rows, i] = bound_scaled(total[i], a[rows, i], factor, doubt)
            elif name in (COPY, SHIFT):
                for s in range(rows + 1):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i]
                if name == SHIFT:
                    for i in range(TAPE_LANES_COUNT):
                        to[0, i] += numbers[number, 0]
                        to[rows, i] = round_radius(to[rows, i] + numbers[number, 1], abs(to[0, i]))
            elif name == NEGATE:
                for s in range(rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = -a[s, i]
                for i in range(TAPE_LANES_COUNT):
                    to[rows, i] = a[rows, i]
            elif name in (INVERT, ROOT):
                sum_sizes(a, 1, rows, total)
                for i in range(TAPE_LANES_COUNT):
                    width = spread(total[i], a[rows, i])
                    line = bound_inverse(a[0, i], width) if name == INVERT else bound_root(a[0, i], width)
                    slopes_a[i], slopes_b[i], both[i], shared[i] = line
                for s in range(rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i] * slopes_a[i]
                for i in range(TAPE_LANES_COUNT):
                    to[0, i] += slopes_b[i]
                sum_sizes(to, 0, rows, total)
                for i in range(TAPE_LANES_COUNT):
                    to[rows, i] = bound_line(a[rows, i], slopes_a[i], both[i], shared[i], total[i])
            elif name == SINES:
                bend = bends[code[step, 4]] if code[step, 4] >= 0 else 0
                sum_sizes(a, 1, rows, total)
                for i in range(TAPE_LANES_COUNT):
                    sine, cosine = reduce_sines(a[0, i])
                    slopes_a[i] = sine if abs(a[0, i]) <= EXACT_SINE_ANGLE_MAX_RAD else nan
                    slopes_b[i] = cosine if abs(a[0, i]) <= EXACT_SINE_ANGLE_MAX_RAD else nan
                for s in range(1, rows):
                    for i in range(TAPE_LANES_COUNT):
                        to[s, i] = a[s, i] * slopes_b[i]
                        b[s, i] = a[s, i] * -slopes_a[i]
                for i in range(TAPE_LANES_COUNT):
                    r, width = a[rows, i], spread(total[i], a[rows, i])
                    to[0, i], along, to[rows, i] = bound_sine(slopes_a[i], slopes_b[i], r, width, bend > 0)
                    b[0, i], aside, b[rows, i] = bound_sine(slopes_b[i], -slopes_a[i], r, width, bend > 0)
                    if bend > 0:
                        to[bend, i] += along
                        b[bend, i] += aside
            else:
                to[:] = 0.0
                for i in range(TAPE_LANES_COUNT):
                    to[0, i] = numbers[number, 0]
                    to[rows, i] = round_radius(numbers[number, 1], abs(to[0, i]))
        for s in range(rows + 1):
            for i in range(count):
                for k in range(outputs.shape[0]):
                    found[s, start + i, k] = m[outputs[k], s, i]


def sum_sizes(form: Array, first: int, rows: int, total: Array) -> None:
    """The sum of the sizes of a form's rows from the ``first`` on."""
    for i in range(TAPE_LANES_COUNT):
        total[i] = 0.0
    for s in range(first, rows):
        for i in range(TAPE_LANES_COUNT):
            total[i] += abs(form[s, i])


@lru_cache(maxsize=1)
def _compile_machine() -> Callable[..., None]:
    """The machine, compiled once for all formulas and kept between runs."""
    return load_compiled_module(
        _TEXT.format(
            numbers="\n".join(f"{name} = {vars(affine)[name]!r}" for name in _NUMBERS),
            lanes=TAPE_LANES_COUNT,
            codes=", ".join(CODES),
            count=len(CODES),
            functions="\n\n".join(
                f"@compiled\n{inspect.getsource(each)}" for each in (*_FUNCTIONS, sum_sizes, run_instructions)
            ),
        ),
    ).run_instructions
