"""Putting a joint graph together: tree joints moved until every other joint's two frames meet.

Damped Gauss-Newton on the coordinates of the tree joints that lie in loops. Directions in which the loops hardly
resist (redundant constraints, disturbed by rounded numbers) are not followed. Lengths in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.vectors import Array, inverse, pose
from ...mechanism.model import JointType, Mechanism
from ...tolerances import FAINT, NEWTON_REACH, NOISE, RANK_CUTOFF, SOLVED
from ..draft import Edge, End
from .graph import Gear, spanning_tree
from .motion import displacement, kind_of, moved, opening, screws, zero

STRIDE = 0.4
"""Largest change of a coordinate in one step."""
EFFORT = 100_000
"""Joints visited (and their like) after which solving is given up: some seconds."""
State = dict[str, Array]


@dataclass(frozen=True)
class Freedom:
    """Freedoms that the loops leave to the joints in them, with the gap of the rank and its weakest value."""

    value: int
    gap: float
    weakest: float


class Assembly:
    """Tree, loops and gears of a joint graph; states map tree joints to their values."""

    def __init__(self, base: str, edges: Sequence[Edge], gears: Sequence[Gear] = ()) -> None:
        self.base = base
        tree = spanning_tree(base, edges)
        self.length = _spread(base, tree)
        self.tree = [(_scaled(edge, self.length), parent, child) for edge, parent, child in tree]
        used = {edge.name for edge, _, _ in tree}
        self._parent = {child: (edge, parent) for edge, parent, child in self.tree}
        reached = {base, *self._parent}
        self.loops = [_scaled(edge, self.length) for edge in edges
                      if edge.name not in used and reached.issuperset(edge.links)]
        self._depth = {base: 0}
        for _, parent, child in self.tree:
            self._depth[child] = self._depth[parent] + 1
        units = {edge.name: self.length if edge.type is JointType.PRISMATIC else 1.0 for edge in edges}
        self.gears = [replace(g, ratio=g.ratio * units[g.driver] / units[g.driven], offset=g.offset / units[g.driven])
                      for g in gears if g.driver in used and g.driven in used]
        ways = [(self._way(loop.links[0]), self._way(loop.links[1])) for loop in self.loops]
        geared = {name for gear in self.gears for name in (gear.driver, gear.driven)}
        active = {name for one, two in ways for name in one ^ two} | geared
        self.active = [edge for edge, _, _ in self.tree if edge.name in active]
        self._column: dict[str, int] = {}
        self.size = 0
        for edge in self.active:
            self._column[edge.name] = self.size
            self.size += kind_of(edge).freedoms
        self._ways = ways
        self._effort = len(self.tree) + len(self.loops) + self.size**2 // 50
        self._spent = 0

    def _way(self, link: str) -> frozenset[str]:
        names = set()
        while link != self.base:
            edge, link = self._parent[link]
            names.add(edge.name)
        return frozenset(names)

    def zero(self) -> State:
        """All tree joints at zero."""
        return {edge.name: zero(edge) for edge, _, _ in self.tree}

    def poses(self, state: State) -> dict[str, Array]:
        """The pose (4, 4) of every link in the base frame, lengths in characteristic lengths."""
        X = {self.base: np.eye(4)}
        for edge, parent, child in self.tree:
            D = displacement(edge, state[edge.name])
            if edge.links[0] == parent:
                X[child] = X[parent] @ edge.ends[0].X @ D @ inverse(edge.ends[1].X)
            else:
                X[child] = X[parent] @ edge.ends[1].X @ inverse(D) @ inverse(edge.ends[0].X)
        return X

    def placed(self, state: State) -> dict[str, Array]:
        """The poses in metres."""
        return {link: _stretched(X, self.length) for link, X in self.poses(state).items()}

    def system(self, state: State) -> tuple[Array, Array]:
        """What is open in all loops and gears (rows,), and its derivative by the active coordinates (rows, size)."""
        self._spent += self._effort
        X = self.poses(state)
        twists = np.zeros((6, self.size))
        for edge in self.active:
            start = self._column[edge.name]
            ends = [X[link] @ end.X for link, end in zip(edge.links, edge.ends, strict=True)]
            for k, screw in enumerate(screws(edge, *ends)):
                twists[:, start + k] = screw
        errors, rows = [np.zeros(0)], [np.zeros((0, self.size))]
        for loop, (before, after) in zip(self.loops, self._ways, strict=True):
            X_P, X_S = (X[link] @ end.X for link, end in zip(loop.links, loop.ends, strict=True))
            error, by_twist = opening(loop, X_P, X_S)
            relative = np.zeros((6, self.size))
            for link, sign, own in ((loop.links[1], 1.0, after - before), (loop.links[0], -1.0, before - after)):
                while link != self.base:
                    edge, parent = self._parent[link]
                    if edge.name in own:
                        columns = slice(self._column[edge.name], self._column[edge.name] + kind_of(edge).freedoms)
                        relative[:, columns] = (sign if edge.links[0] == parent else -sign) * twists[:, columns]
                    link = parent
            errors.append(error)
            rows.append(by_twist @ relative)
        for gear in self.gears:
            row = np.zeros((1, self.size))
            row[0, self._column[gear.driven]] += 1.0
            row[0, self._column[gear.driver]] -= gear.ratio
            errors.append(state[gear.driven][:1] - gear.ratio * state[gear.driver][:1] - gear.offset)
            rows.append(row)
        return np.concatenate(errors), np.vstack(rows)

    def stepped(self, state: State, step: Array) -> State:
        """The state that a step in the active coordinates leads to."""
        X, after = self.poses(state), dict(state)
        for edge in self.active:
            start = self._column[edge.name]
            R = (X[edge.links[0]] @ edge.ends[0].X)[:3, :3]
            after[edge.name] = moved(edge, state[edge.name], step[start : start + kind_of(edge).freedoms], R)
        return after

    def closed(self, state: State, iterations: int = 60) -> tuple[State, float]:
        """The closed state that is reached from ``state``, and what is left open."""
        error, J = self.system(state)
        size, factor = float(np.linalg.norm(error)), 1.0
        for _ in range(iterations):
            if size <= SOLVED or factor > 1e6 or not self.size or self._spent > EFFORT:
                break
            step = self._step(error, J, size, factor)
            trial = self.stepped(state, step)
            trial_error, trial_J = self.system(trial)
            trial_size = float(np.linalg.norm(trial_error))
            if trial_size < size:
                gain = size - trial_size
                state, error, J, size = trial, trial_error, trial_J, trial_size
                factor = max(0.1 * factor, 1e-3)
                if gain < 1e-6 * size and size < NOISE:
                    break
            else:
                factor *= 10.0
        return self._polished(state, error, J, size) if SOLVED < size < NOISE else (state, size)

    def _polished(self, state: State, error: Array, J: Array, size: float) -> tuple[State, float]:
        """Plain Newton steps, faint directions too, as long as they are short for the residual that they remove."""
        start = (state, size)
        for _ in range(10):
            step: Array = np.asarray(-np.linalg.lstsq(J, error, rcond=RANK_CUTOFF)[0], dtype=float)
            if np.max(np.abs(step), initial=0.0) > NEWTON_REACH * size:
                return start
            state = self.stepped(state, step)
            error, J = self.system(state)
            size = float(np.linalg.norm(error))
            if size <= SOLVED:
                return state, size
        return start

    def _step(self, error: Array, J: Array, size: float, factor: float) -> Array:
        U, values, Vt = np.linalg.svd(J, full_matrices=False)
        if size < NOISE and factor <= 1.0:
            kept = values > FAINT * values[0]
            step = -(Vt[kept].T @ ((U.T @ error)[kept] / values[kept]))
        else:
            step = -(Vt.T @ (values / (values**2 + factor * max(size**2, 1e-12)) * (U.T @ error)))
        largest = float(np.max(np.abs(step), initial=0.0))
        return np.asarray(step * min(1.0, STRIDE / largest) if largest > 0 else step)

    def freedom(self, state: State, cutoff: float = RANK_CUTOFF) -> Freedom:
        """The freedoms of the joints in loops at a state."""
        if not self.size:
            return Freedom(0, 1 / RANK_CUTOFF, 1.0)
        values = np.linalg.svd(self.system(state)[1], compute_uv=False)
        largest = max(float(values[0]) if len(values) else 0.0, np.finfo(float).tiny)
        kept = int(np.sum(values > cutoff * largest))
        dropped = float(values[kept]) if kept < len(values) else 0.0
        last = float(values[kept - 1]) if kept else largest
        return Freedom(self.size - kept, last / max(dropped, np.finfo(float).eps * largest), last / largest)

    def kernel(self, state: State) -> Array:
        """A basis (size, freedoms) of the velocities that keep the loops closed."""
        _, values, Vt = np.linalg.svd(self.system(state)[1], full_matrices=True)
        return np.asarray(Vt[int(np.sum(values > RANK_CUTOFF * max(values, default=1.0))):].T)

    def worst(self, state: State) -> tuple[str, float]:
        """The loop that is open most, and by how much."""
        X = self.poses(state)
        found = [(float(np.linalg.norm(opening(loop, *(X[link] @ end.X for link, end in
                                                       zip(loop.links, loop.ends, strict=True)))[0])), loop.name)
                 for loop in self.loops]
        found += [(abs(float(state[gear.driven][0] - gear.ratio * state[gear.driver][0] - gear.offset)), gear.name)
                  for gear in self.gears]
        miss, name = max(found, default=(0.0, "none"))
        return name, miss


def assembly_of(mechanism: Mechanism) -> Assembly:
    """The assembly of a mechanism's own joints: closed at zero."""
    edges = []
    for joint in mechanism.joints.values():
        one, two = (End(link, inverse(mechanism.links[link].pose) @ pose(joint.point)) for link in joint.links)
        edges.append(Edge(joint.name, joint.type, (one, two), joint.axes, in_tree=joint.in_tree))
    carrier = {joint.successor: joint.name for joint in mechanism.joints.values() if joint.in_tree}
    gears = [Gear(each.name, carrier[each.predecessor], carrier[each.successor], each.ratio)
             for each in mechanism.couplings]
    return Assembly(mechanism.base, edges, gears)


def _scaled(edge: Edge, length: float) -> Edge:
    one, two = (End(end.link, _stretched(end.X, 1 / length), end.line) for end in edge.ends)
    return replace(edge, ends=(one, two))


def _stretched(X: Array, factor: float) -> Array:
    scaled = X.copy()
    scaled[:3, 3] *= factor
    return scaled


def _spread(base: str, tree: Sequence[tuple[Edge, str, str]]) -> float:
    """The characteristic length (m): mean distance of the joints' centres from their centroid, all at zero."""
    X = {base: np.eye(4)}
    points = []
    for edge, parent, child in tree:
        near, far = edge.ends if edge.links[0] == parent else edge.ends[::-1]
        X_J = X[parent] @ near.X
        X[child] = X_J @ inverse(far.X)
        points.append(X_J[:3, 3])
    if not points:
        return 1.0
    spread = float(np.mean(np.linalg.norm(np.array(points) - np.mean(points, axis=0), axis=1)))
    return spread if spread > 1e-9 else 1.0

