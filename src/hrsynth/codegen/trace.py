"""The formulas of a branch as straight-line code: the loops' equations, the platform, the observed directions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..equations.joint_equations import LoopSystem, rotate
from ..equations.loop_parts import LoopEquation, LoopPart, evaluate_equations
from ..equations.tape import Symbol, Tape
from ..geometry.affine import compute_cross_forms
from ..mechanism.observations.direction import Direction
from ..results import Value
from .formulas import cut, cut_coordinate, list_equation_rows, place_frame
from .sums import gather_sums

Place = tuple[int, ...]
VALUES = ("R", "p", "u", "O")
"""Arrays of which every place is filled; the others are zero before."""


@dataclass(frozen=True, eq=False, repr=False)
class TracedFunction(Value):
    """Straight-line code of q and x: statements (name, expression), and what goes where: (array, place, value)."""

    statements: tuple[tuple[str, str], ...]
    stores: tuple[tuple[str, Place, str], ...]

    @classmethod
    def of(
        cls, tape: Tape, names: Sequence[str], stores: Iterable[tuple[str, Place, Any]], gathered: bool = False
    ) -> TracedFunction:
        """Keep the operations that some symbols of a tape need; derivatives that are constantly zero are not stored.
        With sums ``gathered`` or not."""
        single = [
            (array, place, np.ravel(value)[0] if isinstance(value, np.ndarray) else value)
            for array, place, value in stores
        ]
        if gathered:
            tape, values = gather_sums(tape, [value for _, _, value in single])
            single = [(array, place, value) for (array, place, _), value in zip(single, values, strict=True)]
        kept = [
            (array, place, value)
            for array, place, value in single
            if array in VALUES or isinstance(value, Symbol) or float(value) != 0.0
        ]
        return cls(
            tuple(tape.statements([(0, value) for _, _, value in kept], names)),
            tuple(
                (array, place, f"t{value.number}" if isinstance(value, Symbol) else repr(float(value)))
                for array, place, value in kept
            ),
        )


@dataclass(frozen=True, eq=False, repr=False)
class FormulaTracer(Value):
    """The coordinates of a mechanism's tree as inputs: ``motors`` are q, ``passive`` x, by their places among all; the
    others are held at 0."""

    system: LoopSystem
    motors: tuple[int, ...]
    passive: tuple[int, ...]

    @property
    def places(self) -> Mapping[int, int]:
        """Index of each coordinate among those of q, then x."""
        return {i: k for k, i in enumerate((*self.motors, *self.passive))}

    @property
    def names(self) -> list[str]:
        """Names of the coordinates in the code."""
        return [f"q[{k}]" for k in range(len(self.motors))] + [f"x[{k}]" for k in range(len(self.passive))]

    def values(self, tape: Tape) -> list[Any]:
        """All coordinates as symbols, None for those held."""
        places = self.places
        return [
            np.array([tape.load(places[i])], dtype=object) if i in places else None
            for i in range(len(self.system.coordinates))
        ]

    def loops(
        self, which: Sequence[int], unknowns: Sequence[int], driven: Sequence[int]
    ) -> tuple[TracedFunction, TracedFunction]:
        """G with J, its derivatives by ``unknowns``; K, those by ``driven`` coordinates; of some equations."""
        tape = Tape([])
        found = list_equation_rows(self.system, self.values(tape))
        stores: list[tuple[str, Place, Any]] = [("G", (i,), found[row][0]) for i, row in enumerate(which)]
        slopes: list[list[tuple[str, Place, Any]]] = []
        for array, columns in (("J", unknowns), ("K", driven)):
            where = {each: k for k, each in enumerate(columns)}
            slopes.append(
                [
                    (array, (i, where[k]), slope)
                    for i, row in enumerate(which)
                    for k, slope in found[row][1].items()
                    if k in where
                ]
            )
        return (TracedFunction.of(tape, self.names, stores + slopes[0]), TracedFunction.of(tape, self.names, slopes[1]))

    def equations(
        self, part: LoopPart, which: Sequence[LoopEquation], unknowns: Sequence[int]
    ) -> tuple[TracedFunction, TracedFunction]:
        """G, some equations of a part, and J, their derivatives by ``unknowns``."""
        tape = Tape([])
        values, slopes = evaluate_equations(part.system, which, self.values(tape))
        where = {i: k for k, i in enumerate(unknowns)}
        rates = [
            ("J", (row, where[i]), rate) for row, slope in enumerate(slopes) for i, rate in slope.items() if i in where
        ]
        stores = [("G", (row,), value) for row, value in enumerate(values)]
        return (TracedFunction.of(tape, self.names, stores, True), TracedFunction.of(tape, self.names, rates, True))

    def closure(self, which: Sequence[int]) -> TracedFunction:
        """E, what is left of some equations."""
        tape = Tape([])
        found = list_equation_rows(self.system, self.values(tape))
        return TracedFunction.of(tape, self.names, [("E", (i,), found[row][0]) for i, row in enumerate(which)])

    def platform(self) -> TracedFunction:
        """Rotation R (3, 3) and position p (3,) of the platform's frame."""
        tape = Tape([])
        R, p, _ = place_frame(self.system, self.values(tape), self.system.mechanism.platform)
        return TracedFunction.of(
            tape,
            self.names,
            [*(("R", divmod(i, 3), each) for i, each in enumerate(R.ravel())), *_place_components("p", 0, p)],
        )

    def cut(self) -> tuple[list[str], TracedFunction, TracedFunction]:
        """The names of the cut joints' coordinates; O, their values; C, their derivatives by the coordinates of q, then
        x."""
        tape, places, names = Tape([]), self.places, cut(self.system)
        values = self.values(tape)
        found = [cut_coordinate(self.system, values, loop, which) for _, loop, which in names]
        return (
            [name for name, _, _ in names],
            TracedFunction.of(tape, self.names, [("O", (k,), value) for k, (value, _) in enumerate(found)]),
            TracedFunction.of(
                tape,
                self.names,
                [("C", (k, places[i]), slope) for k, (_, slopes) in enumerate(found) for i, slope in slopes.items()],
            ),
        )

    def rates(self, observed: Sequence[Direction]) -> TracedFunction:
        """V (6, n), the velocity of the platform's frame, and W (3 k, n), those of the observed directions u (3 k,), by
        the coordinates of q, then x."""
        tape, places, mechanism = Tape([]), self.places, self.system.mechanism
        values = self.values(tape)
        twists = place_frame(self.system, values, mechanism.platform)[2]
        stores = [
            store
            for k, twist in twists.items()
            for i in (0, 1)
            for store in _place_components("V", 3 * i, twist[i], places[k])
        ]
        for number, observation in enumerate(observed):
            R, _, twists = place_frame(self.system, values, observation.link)
            u = rotate(R, observation.direction)
            stores += _place_components("u", 3 * number, u)
            stores += [
                store
                for k, (_, w) in twists.items()
                for store in _place_components("W", 3 * number, compute_cross_forms(w, u), places[k])
            ]
        return TracedFunction.of(tape, self.names, stores)


def _place_components(array: str, first: int, vector: Any, *column: int) -> list[tuple[str, Place, Any]]:
    """Return the stores of a vector's components: to places from ``first`` on."""
    return [(array, (first + i, *column), each) for i, each in enumerate(np.ravel(vector))]
