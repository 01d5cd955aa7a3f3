"""The formulas of a branch as straight-line code: the loops' equations, the platform, the observed directions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..batch.tape import Symbol, Tape
from ..geometry.components import cross
from ..mechanism.observation import Direction
from ..results import Value
from .formulas import LoopFormulas

Place = tuple[int, ...]
VALUES = ("R", "p", "u", "O")
"""Arrays of which every place is filled; the others are zero before."""


@dataclass(frozen=True, eq=False, repr=False)
class TracedFunction(Value):
    """Straight-line code of q and x: statements (name, expression), and what goes where: (array, place, value)."""

    statements: tuple[tuple[str, str], ...]
    stores: tuple[tuple[str, Place, str], ...]

    @classmethod
    def of(cls, tape: Tape, names: Sequence[str], stores: Iterable[tuple[str, Place, Any]]) -> TracedFunction:
        """What some symbols of a tape need; derivatives that are constantly zero are not stored."""
        kept = [(array, place, value) for array, place, value in stores
                if array in VALUES or isinstance(value, Symbol) or float(value) != 0.0]
        return cls(tuple(tape.statements([(0, value) for _, _, value in kept], names)),
                   tuple((array, place, f"t{value.number}" if isinstance(value, Symbol) else repr(float(value)))
                         for array, place, value in kept))


@dataclass(frozen=True, eq=False, repr=False)
class FormulaTracer(Value):
    """The coordinates of a mechanism's tree as inputs: ``motors`` are q, ``passive`` x, by their places among all; the
    others are held at 0."""

    equations: LoopFormulas
    motors: tuple[int, ...]
    passive: tuple[int, ...]

    @property
    def places(self) -> Mapping[int, int]:
        """Where each coordinate stands among those of q, then x."""
        return {i: k for k, i in enumerate((*self.motors, *self.passive))}

    @property
    def names(self) -> list[str]:
        """What the code calls them."""
        return [f"q[{k}]" for k in range(len(self.motors))] + [f"x[{k}]" for k in range(len(self.passive))]

    def _values(self, tape: Tape) -> list[Any]:
        places = self.places
        return [tape.load(places[i]) if i in places else 0.0 for i in range(len(self.equations.coordinates))]

    def loops(self, rows: Sequence[int], unknowns: Sequence[int], driven: Sequence[int]
              ) -> tuple[TracedFunction, TracedFunction]:
        """G with J, its derivatives by ``unknowns``; K, those by ``driven`` coordinates; of some rows."""
        tape = Tape([])
        found = self.equations.rows(self._values(tape))
        stores: list[tuple[str, Place, Any]] = [("G", (i,), found[row][0]) for i, row in enumerate(rows)]
        slopes: list[list[tuple[str, Place, Any]]] = []
        for array, columns in (("J", unknowns), ("K", driven)):
            where = {each: k for k, each in enumerate(columns)}
            slopes.append([(array, (i, where[k]), slope) for i, row in enumerate(rows)
                           for k, slope in found[row][1].items() if k in where])
        return (TracedFunction.of(tape, self.names, stores + slopes[0]), TracedFunction.of(tape, self.names, slopes[1]))

    def closure(self, rows: Sequence[int]) -> TracedFunction:
        """E, what is left of some rows."""
        tape = Tape([])
        found = self.equations.rows(self._values(tape))
        return TracedFunction.of(tape, self.names, [("E", (i,), found[row][0]) for i, row in enumerate(rows)])

    def platform(self) -> TracedFunction:
        """Rotation R (3, 3) and position p (3,) of the platform's frame."""
        tape = Tape([])
        at = self.equations.moved(self._values(tape))
        R, p = self.equations.pose(at, self.equations.mechanism.platform)
        return TracedFunction.of(tape, self.names, [*(("R", divmod(i, 3), each) for i, each in enumerate(R)),
                                                    *(("p", (i,), each) for i, each in enumerate(p))])

    def cut(self) -> tuple[list[str], TracedFunction, TracedFunction]:
        """The names of the cut joints' coordinates; O, their values; C, their derivatives by the coordinates of q, then
        x."""
        tape, places = Tape([]), self.places
        at = self.equations.moved(self._values(tape))
        names = self.equations.cut()
        rows = [self.equations.cut_coordinate(at, joint, which) for _, joint, which in names]
        return ([name for name, _, _ in names],
                TracedFunction.of(tape, self.names, [("O", (k,), value) for k, (value, _) in enumerate(rows)]),
                TracedFunction.of(tape, self.names, [("C", (k, places[i]), slope) for k, (_, slopes) in enumerate(rows)
                                                     for i, slope in slopes.items() if i in places]))

    def rates(self, observed: Sequence[Direction]) -> TracedFunction:
        """V (6, n), the velocity of the platform's frame, and W (3 k, n), those of the observed directions u (3 k,), by
        the coordinates of q, then x."""
        tape, places, mechanism = Tape([]), self.places, self.equations.mechanism
        at = self.equations.moved(self._values(tape))
        p = self.equations.pose(at, mechanism.platform)[1]
        twists = self.equations.velocity(at, self.equations.body[mechanism.platform], p)
        stores: list[tuple[str, Place, Any]] = [("V", (i, places[k]), each) for k, (v, w) in twists.items()
                                                if k in places for i, each in enumerate((*v, *w))]
        for number, observation in enumerate(observed):
            carrier = self.equations.body[observation.link]
            d = mechanism.links[observation.link].pose[:3, :3] @ observation.direction
            u = at.bodies[carrier].direction(d)
            stores += [("u", (3 * number + i,), each) for i, each in enumerate(u)]
            stores += [("W", (3 * number + i, places[k]), each)
                       for k, (_, w) in self.equations.velocity(at, carrier, p).items() if k in places
                       for i, each in enumerate(cross(w, u))]
        return TracedFunction.of(tape, self.names, stores)
