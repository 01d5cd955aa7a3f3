"""The table of benchmarks: each line a ratio against another's way, measured in the same run.

    python benchmarks/table.py [benchmarks/README.md [MARK ...]]

Times are the least processor time of several turns, ours and theirs in turn, on one core, after imports and after numba
has compiled. Both sides compute the same thing, which is checked. Without a file the
tables are printed; with MARKs only those tables are made.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

from generated import generated
from measure import Row
from others import catalog, derivations, jacobians, modes, platforms
from sweeps import exact_maxima, growth, matrices, other_twists
from tracked import HEADER, tracked

from tables.markdown import rewrite, table


def main(arguments: Sequence[str]) -> None:
    tables = {start: make for start, make in TABLES.items() if start in arguments[1:] or not arguments[1:]}
    if arguments:
        rewrite(arguments[0], tables)
    else:
        print(*(make() for make in tables.values()), sep="\n")


def lines() -> Iterator[Row]:
    yield from exact_maxima()
    yield from matrices()
    yield from other_twists()
    yield from modes()
    yield from platforms()
    yield from jacobians()
    yield from generated()
    yield derivations()
    yield from catalog()
    yield from growth()


TABLES = {
    "<!-- generated: benchmarks -->": lambda: table(("what", "ours", "theirs", "theirs / ours"), lines(), 3),
    "<!-- generated: tracked -->": lambda: table(HEADER, tracked(), 3),
}

if __name__ == "__main__":
    main(sys.argv[1:])
