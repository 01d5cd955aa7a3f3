"""A program on ``jax.numpy``: the operations of its tapes one by one, compiled by XLA for the device that jax has.

Everything runs at all poses; where a section's flag is not positive, or a loop has ended, what was there is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..geometry.vectors import Array
from .sections import Kernel, Section
from .tape import UFUNCS, Symbol

FEWEST, MOST = 1024, 1 << 20
"""Poses that are worked on together: powers of two in between, for each of which XLA compiles once."""
Table = dict[int, Any]
"""Values at each filled place, (n,)."""


def run(
    sections: tuple[Section, ...], numbers: Sequence[float], flat: Array, outputs: Sequence[Any], found: Array
) -> None:
    """Fill the rows of ``found`` (rows, n) for inputs ``flat`` (n, inputs), in double precision."""
    import jax

    kernel, constants = _compile(sections, tuple(outputs)), np.array([*numbers, 0.0])
    with jax.enable_x64(True):
        for start in range(0, len(flat), MOST):
            given = flat[start : start + MOST].T
            size = max(FEWEST, 1 << (given.shape[1] - 1).bit_length())
            padded = np.pad(given, ((0, 0), (0, size - given.shape[1])), mode="edge")
            found[:, start : start + MOST] = np.asarray(kernel(padded, constants))[:, : given.shape[1]]


@cache
def _compile(sections: tuple[Section, ...], outputs: tuple[Any, ...]) -> Callable[[Array, Array], Any]:
    import jax
    import jax.numpy as jnp

    def rows(given: Any, numbers: Any) -> Any:
        nothing = jnp.zeros(given.shape[1])
        table: Table = dict(enumerate(given))
        for section in sections:
            live: Any = None if section.flag is None else table[section.flag] > 0
            for step in section.steps:
                if isinstance(step, Kernel):
                    made = _store(step, table, numbers)
                else:
                    made = _repeat_step(step.step, step.state, step.open, step.limit, table, numbers, live)
                table |= {
                    place: value if live is None else jnp.where(live, value, table.get(place, nothing))
                    for place, value in made.items()
                }
        return jnp.stack(
            [table.get(each, nothing) if isinstance(each, int) else jnp.full_like(nothing, each) for each in outputs]
        )

    return jax.jit(rows)


def _repeat_step(
    step: Kernel, state: Sequence[int], flag: int, limit: int, table: Table, numbers: Any, live: Any
) -> Table:
    """The state after a step was repeated where its flag is positive."""
    import jax
    import jax.numpy as jnp

    def going(now: tuple[Any, Table]) -> Any:
        return (now[0] < limit) & jnp.any(now[1][flag] > 0)

    def again(now: tuple[Any, Table]) -> tuple[Any, Table]:
        made, here = _store(step, table | now[1], numbers), now[1][flag] > 0
        return now[0] + 1, {
            place: jnp.where(here, made[place], kept) if place in made else kept for place, kept in now[1].items()
        }

    first = {place: table[place] for place in state}
    if live is not None:
        first[flag] = jnp.where(live, first[flag], 0.0)
    found: Table = jax.lax.while_loop(going, again, (0, first))[1]
    return found


def _store(kernel: Kernel, table: Table, numbers: Any) -> Table:
    """Return the table with a kernel's results."""
    import jax.numpy as jnp

    values: dict[int, Any] = {}
    for number in sorted(kernel.tape.needed_operations(kernel.stores)):
        name, *given = kernel.tape.code[number]
        if name == "load":
            values[number] = table[given[0]]
        elif name == "number":
            values[number] = numbers[given[0]]
        else:
            inputs = [values[each] if isinstance(each, int) else each for each in given]
            operation: Any = jnp.where if name == "?" else getattr(jnp, UFUNCS[name])
            values[number] = operation(*inputs)
    made = [jnp.asarray(values[each.number] if isinstance(each, Symbol) else each, float) for _, each in kernel.stores]
    size = next(iter(table.values())).shape
    return {place: jnp.broadcast_to(each, size) for (place, _), each in zip(kernel.stores, made, strict=True)}
