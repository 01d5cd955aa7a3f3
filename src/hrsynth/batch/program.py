"""A program for many poses: formulas one after the other on named quantities, in NumPy or compiled by numba.

A name stands for components, each a place of a table (places, poses) or a constant. A formula becomes a kernel of
straight-line code; a loop repeats one at the poses where a flag, the last of its state, is positive. The sections after
the first run only at the poses where their flag is positive.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from ..equations.compiled_module import load_compiled_module, locate_module_file
from ..equations.tape import TAPE_LANES_COUNT, Store, Symbol, Tape
from ..geometry.components import Components
from ..geometry.vectors import Array
from .sections import Indices, Kernel, KernelLoop, Section, put, take_places

POSE_CHUNK_COUNT = 4096
"""Poses that are worked on together, so that their arrays stay in the cache."""
Formula = Callable[..., Mapping[str, Components]]
"""Function from the components of its inputs to those of its outputs, by name."""


@dataclass(eq=False)
class Program:
    """Traced program; the first ``inputs`` places are given at each pose."""

    inputs: int
    places: dict[str, list[Any]]
    count: int
    section: Section = field(default_factory=lambda: Section(None))
    """Section to which formulas are added."""
    sections: list[Section] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    tape: Tape | None = None
    """The formula that is being traced."""
    texts: dict[tuple[Any, ...], str] = field(default_factory=dict)
    """The module of each choice of outputs, until more is traced."""

    @classmethod
    def of(cls, **inputs: int) -> Program:
        """A program whose inputs have so many components each."""
        ends = np.cumsum([0, *inputs.values()]).tolist()
        places = {name: list(range(*span)) for name, span in zip(inputs, pairwise(ends), strict=True)}
        program = cls(ends[-1], places, ends[-1])
        program.sections.append(program.section)
        return program

    def number(self, values: Any) -> Any:
        """Components of a number or an array of the robot, for the formula that is being traced."""
        assert self.tape is not None
        return self.tape.number(float(values)) if np.ndim(values) == 0 else [self.number(each) for each in values]

    def apply(self, formula: Formula, *reads: str, state: Sequence[str] = ()) -> None:
        """Trace a formula: what it makes can be read from then on; ``state`` can be overwritten later."""
        kernel = self._trace(formula, reads, state)
        if kernel.stores:
            self.section.steps.append(kernel)

    def repeat(self, formula: Formula, limit: int, reads: Sequence[str], state: Sequence[str]) -> None:
        """Trace a formula that makes the next state from what it reads and the state."""
        step = self._trace(formula, (*reads, *state), state)
        places = [place for name in state for place in self.places[name]]
        self.section.steps.append(KernelLoop(step, places, self.places[state[-1]][0], limit))

    @contextmanager
    def where(self, flag: str) -> Iterator[None]:
        """A section for poses where a flag is positive, which runs after the first."""
        section = self.section
        self.section = Section(self.places[flag][0])
        self.sections.append(self.section)
        yield
        self.section = section

    def _trace(self, formula: Formula, reads: Sequence[str], state: Sequence[str]) -> Kernel:
        self.tape = tape = Tape(self.numbers)
        self.texts.clear()
        made = formula(
            *([tape.load(each) if isinstance(each, int) else each for each in self.places[name]] for name in reads)
        )
        stores: list[Store] = []
        for name, values in made.items():
            if name not in self.places:
                kept: list[Any] = []
                for value in values:
                    given = tape.place(value)
                    fresh = name in state or (given is None and isinstance(value, Symbol))
                    kept.append(self.count if fresh else value if given is None else given)
                    self.count += fresh
                self.places[name] = kept
            stores += [
                (place, value)
                for place, value in zip(self.places[name], values, strict=True)
                if isinstance(place, int) and tape.place(value) != place
            ]
        return Kernel(tape, stores)

    def run(self, inputs: Array, names: Sequence[str], *, compiled: bool = False) -> Array:
        """The components of some names (rows, n) for inputs (n, ...), whose first ``inputs`` numbers are read."""
        flat = inputs.reshape(len(inputs), math.prod(inputs.shape[1:])) if inputs.ndim > 2 else inputs
        outputs = self._outputs(names)
        found = np.empty((len(outputs), len(flat)))
        for row, place in zip(found, outputs, strict=True):
            if not isinstance(place, int):
                row[:] = place
        (self._run_lanes if compiled else self._run_rows)(flat, outputs, found)
        return found

    def is_compiled(self, names: Sequence[str]) -> bool:
        """Return True if numba has compiled the kernels of these names, in this run or in an earlier one."""
        file = locate_module_file(self.text(self._outputs(names)))
        return any(file.parent.glob(f"__pycache__/{file.stem}.sweep*.nbi"))

    def _outputs(self, names: Sequence[str]) -> list[Any]:
        return [place for name in names for place in self.places[name]]

    def _run_rows(self, flat: Array, outputs: Sequence[Any], found: Array) -> None:
        """In NumPy: the first section chunk by chunk, the others at their poses of all chunks together."""
        first, *others = self.sections
        mine = {place for section in others for place in section.places}
        passed = mine & (first.places | set(range(self.inputs)))
        here = [(row, place) for row, place in enumerate(outputs) if isinstance(place, int)]
        index, parts = [], []
        with np.errstate(all="ignore"):
            for start in range(0, len(flat), POSE_CHUNK_COUNT):
                given = flat[start : start + POSE_CHUNK_COUNT, : self.inputs].T
                table = np.empty((self.count, given.shape[1]))
                table[: self.inputs] = given
                for step in first.steps:
                    step.run(table, self.numbers)
                for row, place in here:
                    found[row, start : start + POSE_CHUNK_COUNT] = table[place]
                flags = [table[section.flag] > 0 for section in others]
                live: Indices = np.flatnonzero(np.any(flags, axis=0)) if flags else np.zeros(0, dtype=np.int64)
                if len(live):
                    index.append(start + live)
                    parts.append(take_places(table, passed, live))
            if not parts:
                return
            rest, poses = np.concatenate(parts, axis=1), np.concatenate(index)
            for section in others:
                live = np.flatnonzero(rest[section.flag] > 0)
                if len(live):
                    table = take_places(rest, section.places & passed, live)
                    for step in section.steps:
                        step.run(table, self.numbers)
                    put(rest, section.places, live, table)
                    for row, place in here:
                        if place in section.places:
                            found[row, poses[live]] = table[place]

    def _run_lanes(self, flat: Array, outputs: Sequence[Any], found: Array) -> None:
        """Compiled, parts of the poses by several threads."""
        from concurrent.futures import ThreadPoolExecutor

        sweep, numbers = _sweep_of(self.text(outputs)), np.array([*self.numbers, 0.0])
        with ThreadPoolExecutor(count_threads()) as pool:
            list(
                pool.map(
                    lambda start: sweep(flat, numbers, found, start, min(start + POSE_CHUNK_COUNT, len(flat))),
                    range(0, len(flat), POSE_CHUNK_COUNT),
                )
            )

    def text(self, outputs: Sequence[Any]) -> str:
        """The module that numba compiles: the same for all robots of one structure, whose numbers it is given."""
        key = tuple(outputs)
        if key not in self.texts:
            self.texts[key] = self._source(outputs)
        return self.texts[key]

    def _source(self, outputs: Sequence[Any]) -> str:
        kernels: list[str] = []
        body: list[str] = []
        for section in self.sections:
            if section.flag is not None:
                body.append(f"if some(m, {TAPE_LANES_COUNT * section.flag}):")
            for line in self._calls(section, kernels):
                body.append(line if section.flag is None else f"    {line}")
        scatter = [
            f"o[{row}, start + i] = m[{TAPE_LANES_COUNT * place} + i]"
            for row, place in enumerate(outputs)
            if isinstance(place, int)
        ]
        parts = [f"@compiled\ndef kernel_{number}(m, c):\n    {lines}\n" for number, lines in enumerate(kernels)]
        return _MODULE.format(
            kernels="\n\n".join(parts),
            size=TAPE_LANES_COUNT * self.count,
            lanes=TAPE_LANES_COUNT,
            inputs=self.inputs,
            body="\n        ".join(body),
            scatter="\n            ".join(scatter or ["pass"]),
        )

    def _calls(self, section: Section, kernels: list[str]) -> Iterator[str]:
        """The lines that run a section, whose kernels are added."""
        for step in section.steps:
            kernel, live = (step, None) if isinstance(step, Kernel) else (step.step, step.open)
            lines = "\n    ".join(kernel.tape.lanes(kernel.stores, live))
            if lines not in kernels:
                kernels.append(lines)
            name = f"kernel_{kernels.index(lines)}"
            if isinstance(step, Kernel):
                yield f"{name}(m, c)"
            else:
                yield from (
                    f"for _ in range({step.limit}):",
                    f"    if not some(m, {TAPE_LANES_COUNT * step.open}):",
                    "        break",
                    f"    {name}(m, c)",
                )


def count_threads() -> int:
    """Return the number of cores that the process may use, or the smaller one of NUMBA_NUM_THREADS."""
    from numba import config

    return int(vars(config)["NUMBA_NUM_THREADS"])


_MODULE = """from math import inf, nan, sqrt

import numpy as np
from numba import njit


def compiled(function):
    return njit(cache=True, nogil=True, error_model="numpy", fastmath={{"contract"}})(function)


@compiled
def some(m, start):
    found = 0.0
    for i in range({lanes}):
        found = max(found, m[start + i])
    return found > 0.0


{kernels}

@compiled
def sweep(x, c, o, first, end):
    m = np.zeros({size})
    for start in range(first, end, {lanes}):
        count = min({lanes}, end - start)
        for i in range({lanes}):
            for k in range({inputs}):
                m[{lanes} * k + i] = x[start + min(i, count - 1), k]
        {body}
        for i in range(count):
            {scatter}
"""


def _sweep_of(text: str) -> Callable[..., None]:
    """The sweep of a module's text."""
    sweep: Callable[..., None] = load_compiled_module(text).sweep
    return sweep
