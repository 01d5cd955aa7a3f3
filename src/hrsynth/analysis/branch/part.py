"""The parts of a robot's loops that have no unknown in common, each with its own unknowns and square blocks of
equations that are solved one after another; closing a part in floating point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import MotorsNotEnough
from ...geometry.ranks import spectrum
from ...geometry.vectors import Array, perpendicular
from ...results import Value
from ...tolerances import NAMED, RANK_CUTOFF, SOLVED
from .loops import GearEquation, JointLoop, LoopRow, LoopSystem, residuals

DISTANCE = LoopRow("distance")
NEWTON_STEPS = 30
"""Steps in which a part is closed at most."""


@dataclass(frozen=True, eq=False, repr=False)
class LoopEquation(Value):
    """An equation of a part: a row of a loop, or a gear (``row`` is None); ``swings``: one of the equations that turn
    a joint which was left out to the place where the loop closes."""

    of: JointLoop | GearEquation
    row: LoopRow | None = None
    swings: bool = False

    def names(self, system: LoopSystem) -> tuple[int, ...]:
        """The coordinates that it has to do with."""
        if isinstance(self.of, GearEquation):
            return self.of.first, self.of.second
        if self.row is not DISTANCE:
            return self.of.coordinates
        assert self.of.swung is not None
        second = self.of.chains[1]
        return (*self.of.chains[0], *second[: self.of.swung], *second[self.of.swung + self.of.swings :])


@dataclass(frozen=True)
class LoopBlock:
    """Unknowns (places among all coordinates) and as many equations, solved when the blocks before it are."""

    unknowns: tuple[int, ...]
    equations: tuple[LoopEquation, ...]
    loop: JointLoop | None = None
    """The loop that is closed by turning one joint, of a block that does this."""


@dataclass(frozen=True, eq=False, repr=False)
class LoopPart(Value):
    """A part of the loops: the coordinates that drive it, its unknowns, its blocks in order, and the equations that
    were left out."""

    system: LoopSystem
    driven: tuple[int, ...]
    unknowns: tuple[int, ...]
    blocks: tuple[LoopBlock, ...]
    loops: tuple[JointLoop, ...]
    gears: tuple[GearEquation, ...]
    left_out: tuple[LoopEquation, ...] = ()
    proved_redundant: bool = True

    @cached_property
    def place(self) -> dict[int, int]:
        """Where an unknown stands in this part."""
        return {i: k for k, i in enumerate(self.unknowns)}

    def values(self, q: Array, x: Array) -> Array:
        """All coordinates (N,), held ones zero, for those that drive this part (n,) and its unknowns (p,)."""
        found = np.zeros(len(self.system.coordinates))
        found[list(self.driven)], found[list(self.unknowns)] = q, x
        return found

    def closure(self, q: Array, x: Array) -> tuple[Array, Array, Array]:
        """All equations of its loops (m,), and their derivatives by the unknowns (m, p) and by what drives it (m,
        n)."""
        values = self.values(q, x)
        errors, rates = whole(self.system, self.loops, self.gears, values)
        return errors, rates[:, list(self.unknowns)], rates[:, list(self.driven)]

    def closed(self, q: Array, x: Array) -> Array | None:
        """The unknowns (p,) near ``x`` at which the loops are closed, by Newton's method; None where it does not
        end."""
        for _ in range(NEWTON_STEPS):
            errors, A, _ = self.closure(q, x)
            if not len(errors) or np.linalg.norm(errors) < SOLVED:
                return x
            step = np.linalg.lstsq(A, errors, rcond=RANK_CUTOFF)[0]
            x = x - step * min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
            if not np.all(np.isfinite(x)):
                return None
        return x if np.linalg.norm(self.closure(q, x)[0]) < 100 * SOLVED else None

    def slopes(self, q: Array, x: Array) -> Array:
        """dx/dq (p, n) at a closed configuration."""
        _, A, B = self.closure(q, x)
        return np.asarray(-np.linalg.lstsq(A, B, rcond=RANK_CUTOFF)[0])

    def followed(self, q: Array, x: Array, goal: Array, step: float = 0.1) -> Array | None:
        """The unknowns (p,) at ``goal`` (n,), reached by short steps from a closed configuration; None where a step is
        corrected by more than it was long."""
        count = max(1, int(np.ceil(np.abs(goal - q).max(initial=0.0) / step)))
        for k in range(count):
            here, there = q + (goal - q) * k / count, q + (goal - q) * (k + 1) / count
            ahead = x + self.slopes(here, x) @ (there - here)
            found = self.closed(there, ahead)
            if found is None or np.abs(found - ahead).max(initial=0.0) > step + np.abs(ahead - x).max(initial=0.0):
                return None
            x = found
        return x


def whole(system: LoopSystem, loops: Sequence[JointLoop], gears: Sequence[GearEquation], values: Array
          ) -> tuple[Array, Array]:
    """All equations of loops and gears (m,) and their derivatives by all coordinates (m, N)."""
    errors: list[float] = []
    rates: list[Array] = []
    for loop in loops:
        found, slopes = residuals(system, loop, values, loop.rows, False)
        errors += found
        for slope in slopes:
            row = np.zeros(len(values))
            row[list(slope)] = list(slope.values())
            rates.append(row)
    for gear in gears:
        errors.append(values[gear.second] - gear.ratio * values[gear.first])
        row = np.zeros(len(values))
        row[gear.second] += 1.0
        row[gear.first] -= gear.ratio
        rates.append(row)
    return np.array(errors), np.array(rates).reshape(len(errors), len(values))


def parts_of(system: LoopSystem) -> tuple[tuple[LoopPart, ...], tuple[int, ...]]:
    """The parts of a system, and the coordinates that are held: those that turn nothing but themselves (idle).

    Raises ``MotorsNotEnough`` where the platform can move while all that is driven rests.
    """
    held = _idle(system)
    unknowns = [i for i, each in enumerate(system.coordinates) if not each.driven and i not in held]
    groups = _groups(system, unknowns)
    return tuple(_part(system, group) for group in groups), tuple(sorted(held))


def _idle(system: LoopSystem) -> set[int]:
    """Coordinates to hold, one for each motion at zero that leaves the platform and what is driven at rest: of each
    the one that takes the largest part in it."""
    held: set[int] = set()
    zero = np.zeros(len(system.coordinates))
    _, rates = whole(system, system.loops, system.gears, zero)
    looped = {i for loop in system.loops for i in loop.coordinates}
    looped |= {i for gear in system.gears for i in (gear.first, gear.second)}
    # a ball on a rod spins about it
    for loop in system.loops:
        if loop.swings == 3 and loop.swung is not None:
            own = loop.chains[1][loop.swung : loop.swung + 3]
            rod = loop.point - system.coordinates[own[0]].point
            held.add(max(own, key=lambda i: abs(float(system.coordinates[i].axis @ rod))))
    free = [i for i, each in enumerate(system.coordinates) if not each.driven and i not in held and i in looped]
    way = set(system.way(system.body[system.mechanism.platform]))
    loose = [system.coordinates[i].name for i in sorted(way) if i not in looped and not system.coordinates[i].driven]
    if loose:
        raise MotorsNotEnough(system.mechanism.name, loose)
    held |= {i for i, each in enumerate(system.coordinates) if not each.driven and i not in looped}
    while free:
        kernel = spectrum(rates[:, free]).kernel
        if not kernel.shape[1]:
            break
        moved = [_platform_moves(system, free, vector) for vector in kernel.T]
        weights = np.abs(kernel).max(axis=1)
        if any(moved):
            names = [system.coordinates[i].name for i, w in zip(free, weights, strict=True) if w > NAMED]
            raise MotorsNotEnough(system.mechanism.name, names)
        i = free[int(np.argmax(weights))]
        held.add(i)
        free.remove(i)
    return held


def _platform_moves(system: LoopSystem, free: Sequence[int], rates: Array) -> bool:
    """Whether the platform moves at zero with rates of some coordinates."""
    by = dict(zip(free, rates, strict=True))
    spin, velocity = np.zeros(3), np.zeros(3)
    for i in system.way(system.body[system.mechanism.platform]):
        each, rate = system.coordinates[i], by.get(i, 0.0)
        if each.slides:
            velocity = velocity + rate * each.axis
        else:
            spin = spin + rate * each.axis
            velocity = velocity + rate * np.cross(each.point, each.axis)
    return float(np.linalg.norm([*spin, *velocity])) > NAMED


def _groups(system: LoopSystem, unknowns: Sequence[int]) -> list[tuple[list[int], list[JointLoop], list[GearEquation]]]:
    """Unknowns that equations connect, with those loops and gears."""
    home = {i: {i} for i in unknowns}
    every: list[JointLoop | GearEquation] = [*system.loops, *system.gears]
    for each in every:
        own = each.coordinates if isinstance(each, JointLoop) else (each.first, each.second)
        members = [home[i] for i in own if i in home]
        joined = set().union(*members)
        for i in joined:
            home[i] = joined
    found, seen = [], set()
    for i in unknowns:
        if i in seen:
            continue
        seen |= home[i]
        loops = [loop for loop in system.loops if home[i].intersection(loop.coordinates)]
        gears = [gear for gear in system.gears if home[i].intersection((gear.first, gear.second))]
        found.append((sorted(home[i]), loops, gears))
    return found


def _part(system: LoopSystem, group: tuple[list[int], list[JointLoop], list[GearEquation]]) -> LoopPart:
    """The blocks of a group of unknowns: those that close rods by turning them come last."""
    from scipy.linalg import qr

    unknowns, loops, gears = group
    asked = {i for loop in loops for i in loop.coordinates} | {i for gear in gears for i in (gear.first, gear.second)}
    driven = tuple(i for i in system.driven if i in asked)
    swung: dict[int, tuple[int, ...]] = {}
    candidates: list[LoopEquation] = []
    for place, loop in enumerate(loops):
        if loop.swung is not None:
            own = loop.chains[1][loop.swung : loop.swung + loop.swings]
            swung[place] = tuple(i for i in own if i in unknowns)
            candidates.append(LoopEquation(loop, DISTANCE))
        else:
            candidates += [LoopEquation(loop, row) for row in loop.rows]
    candidates += [LoopEquation(gear) for gear in gears]
    last = {i for own in swung.values() for i in own}
    main = [i for i in unknowns if i not in last]
    zero = np.zeros(len(system.coordinates))
    rates = np.array([_slope(system, each, zero) for each in candidates]).reshape(len(candidates), len(zero))[:, main]
    # independent equations at zero, the firmest first
    order = qr(rates.T, mode="r", pivoting=True)[1][: len(main)] if main else []
    chosen = [candidates[k] for k in sorted(order)]
    left_out = tuple(each for k, each in enumerate(candidates) if k not in order)
    blocks = [*_triangular(system, main, chosen),
              *(LoopBlock(own, (), loops[place]) for place, own in swung.items())]
    return LoopPart(system, driven, tuple(unknowns), tuple(blocks), tuple(loops), tuple(gears), left_out)


def _slope(system: LoopSystem, equation: LoopEquation, values: Array) -> Array:
    """The derivatives (N,) of an equation."""
    row = np.zeros(len(values))
    if isinstance(equation.of, GearEquation):
        row[equation.of.second], row[equation.of.first] = 1.0, -equation.of.ratio
        return row
    assert equation.row is not None
    (slope,) = residuals(system, equation.of, values, [equation.row], False)[1]
    row[list(slope)] = list(slope.values())
    return row


def _triangular(system: LoopSystem, unknowns: Sequence[int], equations: Sequence[LoopEquation]) -> list[LoopBlock]:
    """The blocks of a square system that can be solved one after another: a matching of equations and unknowns, then
    the strong components of who needs whom (Dulmage and Mendelsohn)."""
    import networkx as nx

    if not unknowns:
        return []
    pairs: nx.Graph = nx.Graph()
    rows = [("row", k) for k in range(len(equations))]
    pairs.add_nodes_from(rows)
    pairs.add_nodes_from(unknowns)
    needs = [set(each.names(system)).intersection(unknowns) for each in equations]
    pairs.add_edges_from((row, i) for row, own in zip(rows, needs, strict=True) for i in own)
    match = nx.bipartite.hopcroft_karp_matching(pairs, rows)
    if any(row not in match for row in rows):
        return [LoopBlock(tuple(unknowns), tuple(equations))]
    graph: nx.DiGraph = nx.DiGraph()
    graph.add_nodes_from(range(len(rows)))
    solver = {match[row]: k for k, row in enumerate(rows)}
    graph.add_edges_from((solver[i], k) for k, own in enumerate(needs) for i in own if solver[i] != k)
    merged = nx.condensation(graph)
    found = []
    for node in nx.lexicographical_topological_sort(merged):
        members = sorted(merged.nodes[node]["members"])
        found.append(LoopBlock(tuple(sorted(match[rows[k]] for k in members)), tuple(equations[k] for k in members)))
    return found


def tangents(direction: Array) -> tuple[LoopRow, LoopRow]:
    """The two equations that turn a rod into a direction (3,), beside its length."""
    e = perpendicular(direction)
    return LoopRow("point", e), LoopRow("point", np.cross(direction / np.linalg.norm(direction), e))
