"""Parts of a program: kernels, straight-line code on the places of a table, loops of them, and sections that run where
a flag is positive; each run in NumPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..equations.tape import UFUNCS, Store, Tape
from ..geometry.vectors import Array
from ..results import Value

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class Kernel(Value):
    """Straight-line code and what it stores."""

    tape: Tape
    stores: list[Store]

    @cached_property
    def places(self) -> set[int]:
        """The places that it reads or fills."""
        return {code[1] for code in self.tape.code if code[0] == "load"} | {place for place, _ in self.stores}

    @cached_property
    def _on_rows(self) -> tuple[Callable[..., None], int]:
        lines, count = self.tape.rows(self.stores)
        space = {name: getattr(np, name) for name in (*UFUNCS.values(), "copyto", "nan", "inf")} | {"abs": abs}
        exec("\n    ".join(["def run(m, c, r):", *(lines or ["pass"])]), space)
        return space["run"], count

    def run(self, table: Array, numbers: Sequence[float]) -> None:
        """Run at all poses of a table."""
        run, count = self._on_rows
        run(table, numbers, np.empty((count, table.shape[1])))


@dataclass(frozen=True, eq=False, repr=False)
class KernelLoop(Value):
    """``step`` is repeated, at most ``limit`` times, at the poses where the place ``open`` is positive."""

    step: Kernel
    state: list[int]
    open: int
    limit: int

    @property
    def places(self) -> set[int]:
        """The places that it reads or fills."""
        return self.step.places

    def run(self, table: Array, numbers: Sequence[float]) -> None:
        """Run at the poses of a table; those that are still open are brought together whenever some have ended."""
        index: Indices = np.arange(table.shape[1])
        here = table
        for _ in range(self.limit):
            live = np.flatnonzero(here[self.open] > 0)
            if len(live) == 0:
                break
            if len(live) < here.shape[1]:
                put(table, self.state, index, here)
                index, here = index[live], take_places(here, self.step.places, live)
            self.step.run(here, numbers)
        put(table, self.state, index, here)


def take_places(table: Array, places: set[int], index: Indices) -> Array:
    """Some places of a table at some poses; the others are left open."""
    found = np.empty((len(table), len(index)))
    for place in places:
        np.take(table[place], index, out=found[place])
    return found


def put(table: Array, places: Sequence[int] | set[int], index: Indices, part: Array) -> None:
    """The other way round."""
    if part is not table:
        for place in places:
            table[place, index] = part[place]


@dataclass(frozen=True, eq=False, repr=False)
class Section(Value):
    """Steps that run where the place ``flag`` is positive (None: everywhere)."""

    flag: int | None
    steps: list[Kernel | KernelLoop] = field(default_factory=list)

    @property
    def places(self) -> set[int]:
        """The places that it reads or fills."""
        found = {place for step in self.steps for place in step.places}
        return found if self.flag is None else found | {self.flag}
