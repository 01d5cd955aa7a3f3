"""How much of each shipped robot's box of motors `hrsynth branch` proves, and in what time: the table of
docs/pages/branch.md.

    python benchmarks/branches.py [CELLS] > table.md
"""

from __future__ import annotations

import sys
import time

import hrsynth
from hrsynth.errors import HrsynthError


def row(name: str, effort: int) -> str:
    """One line of the table."""
    start = time.process_time()
    try:
        found = hrsynth.branch(name, effort=effort)
    except HrsynthError as error:
        return f"| {name} | | | | | {error} |"
    seconds = time.process_time() - start
    parts = found.parts
    reach = ", ".join(f"{low:.2g} to {high:.2g}" for part in parts for low, high in zip(*part.proved, strict=True))
    ends = sorted({joint for part in parts for each in part.toggles for joint in each.joints})
    share = min(parts, key=lambda part: part.share).percent if parts else "100"
    return (f"| {name} | {found.box} | {share} | {reach} | {sum(len(part.cells) for part in parts)} | "
            f"{seconds:.0f} | {', '.join(ends[:4])}{', …' if len(ends) > 4 else ''} |")


if __name__ == "__main__":
    print("| robot | box | % of it | proved box (m, rad) | cells | s | toggles found: joints |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for each in sys.argv[2:] or hrsynth.shipped():
        print(row(each, int(sys.argv[1]) if len(sys.argv) > 1 else 1000), flush=True)
