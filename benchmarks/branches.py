"""How large a box of motors `hrsynth branch` proves whole for each shipped robot, and in what time: the table of
docs/pages/prove_a_branch.md.

    python benchmarks/branches.py [SECONDS [ROBOT...]] > table.md

Boxes of all motors alike, ± h rad or metres, each some two times the one before, until one is not proved whole with a
hundred cells or takes longer than SECONDS of one processor.
"""

from __future__ import annotations

import signal
import sys
import time

import hrsynth
from hrsynth.analysis.branch.answer import BranchProof
from hrsynth.errors import HrsynthError

SIZES = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 3.141592653589793]
CELLS = 100


class TooLong(Exception):
    """The time is spent."""


def proved(name: str, half: float) -> BranchProof | None:
    """The branch in a box, None where it is not proved in all of it."""
    robot = hrsynth.load(name)
    limits = robot.limited
    box = {}
    for joint in robot.joints.values():
        if joint.is_actuated:
            low, high = limits.get(joint.name, (-half, half))
            box[joint.name] = max(low, -half), min(high, half)
    found = hrsynth.branch(name, box, max_cells=CELLS)
    return found if all(part.volume_fraction == 1.0 for part in found.parts) else None


def row(name: str, seconds: int) -> str:
    """One line of the table."""

    def stop(*_: object) -> None:
        raise TooLong

    signal.signal(signal.SIGVTALRM, stop)
    best: tuple[float, BranchProof, float] | None = None
    ends = "cells"
    for half in SIZES:
        start = time.process_time()
        signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
        try:
            found = proved(name, half)
        except TooLong:
            ends = "time"
            break
        except HrsynthError as error:
            return f"| {name} | refused: {error} | | | |"
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        if found is None:
            break
        best = half, found, time.process_time() - start
    if best is None:
        return f"| {name} | none ({ends}) | | | |"
    half, found, spent = best
    back = (
        "all of it"
        if found.injective_box is not None
        and (found.injective_box[0] == found.proved[0]).all()
        and (found.injective_box[1] == found.proved[1]).all()
        else "a part"
        if found.injective_box is not None
        else "undecided"
    )
    return f"| {name} | ± {half:.2g} | {sum(len(part.cells) for part in found.parts)} | {back} | {spent:.1f} |"


if __name__ == "__main__":
    print("| robot | proved box (m, rad) | cells | way back | s |")
    print("| --- | --- | --- | --- | --- |")
    for each in sys.argv[2:] or hrsynth.list_robots():
        print(row(each, int(sys.argv[1]) if len(sys.argv) > 1 else 30), flush=True)
