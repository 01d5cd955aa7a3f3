"""Formulas of a tracker: blocks of loop equations that are solved, and proved, one after another.

Coordinates are in radians and characteristic lengths. A block that turns a rod to where its loop closes has more
equations than unknowns, three of points for two turns: as the distance of the rod's ends is right where the blocks
before it are closed, the equations combined by a left inverse of their derivatives have no other zero nearby.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..equations.joint_equations import LoopSystem
from ..equations.loop_parts import LoopEquation, LoopPart, evaluate_equations
from ..equations.tape import Tape
from ..results import Value
from .branch_cells import TubedBranch, TubePart
from .trace import FormulaTracer, TracedFunction

Limit = tuple[float, ...]
"""Whether it is a motor, whether whole turns do not count; its place in q or x; lower and upper (m, rad)."""


@dataclass(frozen=True, eq=False, repr=False)
class TrackedBlock(Value):
    """Places of a block's unknowns in x; G, J of its equations, and their ``count``."""

    unknowns: tuple[int, ...]
    count: int
    values: TracedFunction
    slopes: TracedFunction


@dataclass(frozen=True, eq=False, repr=False)
class TrackedPart(Value):
    """A part: the places of its motors in q, and its blocks in order."""

    motors: tuple[int, ...]
    blocks: tuple[TrackedBlock, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Tracker(Value):
    """The loops in characteristic lengths and radians, the parts, and E, what is left of equations that follow from
    those that are solved."""

    system: LoopSystem
    parts: tuple[TrackedPart, ...]
    checked: TracedFunction
    checked_count: int

    @classmethod
    def of(cls, system: LoopSystem, parts: Sequence[LoopPart]) -> Tracker:
        """The formulas of a system's parts."""
        unknowns = tuple(sorted(i for part in parts for i in part.unknowns))
        tracer = FormulaTracer(system, system.driven, unknowns)
        left = [(part, equation) for part in parts for equation in part.left_out]
        return cls(
            system,
            tuple(
                TrackedPart(
                    tuple(system.driven.index(i) for i in part.driven),
                    tuple(
                        TrackedBlock(
                            tuple(unknowns.index(i) for i in block.unknowns),
                            len(block.closing),
                            *tracer.equations(part, block.closing, block.unknowns),
                        )
                        for block in part.blocks
                    ),
                )
                for part in parts
            ),
            trace_remainders(tracer, left),
            len(left),
        )

    def limits(self, branch: TubedBranch, cut: Sequence[str]) -> list[Limit]:
        """The limits of the file: of motors, and of passive coordinates with those of ``cut`` joints."""
        names, filed, joints = branch.system.names, self.system.mechanism.filed, self.system.mechanism.joints
        places = [(1, k, names[i]) for k, i in enumerate(branch.motors)]
        places += [(0, k, name) for k, name in enumerate([*(names[i] for i in branch.passive), *cut])]
        return [
            (
                motor,
                int(name in cut and not joints[name].type.has_translation),
                place,
                *(float(np.clip(end, -1e300, 1e300)) for end in filed[name]),
            )
            for motor, place, name in places
            if name in filed
        ]


def trace_remainders(tracer: FormulaTracer, equations: Sequence[tuple[LoopPart, LoopEquation]]) -> TracedFunction:
    """Return E, what is left of some equations."""
    tape, stores = Tape([]), list[tuple[str, tuple[int, ...], object]]()
    for k, (part, equation) in enumerate(equations):
        stores.append(("E", (k,), evaluate_equations(part.system, [equation], tracer.values(tape))[0][0]))
    return TracedFunction.of(tape, tracer.names, stores, True)


def convert_to_branch(system: LoopSystem, parts: Sequence[LoopPart]) -> TubedBranch:
    """Return the loops in metres as other generated code takes them, without cells."""
    edge = np.full(len(system.driven), np.inf)
    return TubedBranch(
        system.metric,
        system.driven,
        -edge,
        edge,
        tuple(TubePart(part.driven, part.unknowns, (), ()) for part in parts),
        None,
    )
