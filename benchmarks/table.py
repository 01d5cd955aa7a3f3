"""The table of benchmarks: each line a ratio against another's way, measured in the same run.

    python benchmarks/table.py [benchmarks/README.md]

Times are the least processor time of several turns, ours and theirs in turn, on one core, after imports and after numba
has compiled. Both sides compute the same thing, which is checked. Without a file the table is printed.
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

from tables.markdown import replace_between, table

START = "<!-- generated: benchmarks -->"


def main(arguments: Sequence[str]) -> None:
    made = table(("what", "ours", "theirs", "theirs / ours"), lines(), 3)
    if not arguments:
        print(made)
        return
    file = Path(arguments[0])
    made = replace_between(file.read_text(encoding="utf-8"), made, START)
    file.write_text(made, encoding="utf-8", newline="\n")


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


if __name__ == "__main__":
    main(sys.argv[1:])
