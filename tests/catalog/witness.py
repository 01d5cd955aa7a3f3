"""What a record of the catalog says, asked of the oracle: mechanisms in maximal coordinates, by screws.

The engine only makes the mechanism of the word; configurations, ranks and assembly modes are the oracle's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, islice
from typing import Any

import numpy as np

from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.entry import choose_study_model
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.geometry.vectors import Array, normalise_vector
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.sensors import choose_default_segment
from oracle import GAP, RANK, NotAssembled, Oracle, Undecided, exponential, split_rank

STATES, STARTS, LONG = 6, 60, 40
"""Configurations at which ranks are taken; starts of the search for assembly modes; configurations of a long walk."""
APART = 1e-5
"""Poses that differ by less (entries of the matrix, lengths in characteristic lengths) are one."""


@dataclass(frozen=True)
class Witness:
    """The robot of a record that is not refused."""

    record: dict[str, Any]
    seed: int = 0

    @cached_property
    def oracle(self) -> Oracle:
        drawn = build_mechanism(choose_study_model(parse(self.record["key"])), self.record.get("attempt", 0))
        return Oracle(reduce_to_normal_form(drawn).mechanism)

    @cached_property
    def watched(self) -> dict[str, Direction]:
        """The observed direction of each leg: what the word marks, else its last segment."""
        decomposition = decompose(self.oracle.mechanism)
        marked = {each.leg: each for each in self.oracle.mechanism.observations if isinstance(each, Direction)}
        return {
            leg.label: marked.get(leg.label) or choose_default_segment(decomposition, leg) for leg in decomposition.legs
        }

    @cached_property
    def states(self) -> list[Array]:
        """Closed states along one walk of small steps from zero."""
        return list(islice(self.oracle.random_walk(np.random.default_rng(self.seed), STATES, 0.15), STATES))

    def seen(self, state: Array, legs: Sequence[str]) -> tuple[int, int, int]:
        """dof, how many of its turns are independent, and the freedoms that some legs see. Raises ``Undecided``."""
        relation = self.oracle.relation(
            state, [self.watched[leg] for leg in legs], point_only=parse(self.record["key"]).platform == "point"
        )
        rows, columns = len(relation) - 3 * len(legs), relation.shape[1]
        _, values, right = np.linalg.svd(np.vstack((relation[rows:], np.zeros((columns, columns)))))
        blind = right[_believed(values, columns) :].T
        dof, turns, hidden = map(_rank, (relation[:rows], relation[3:rows], relation[:rows] @ blind))
        return dof, turns, dof - hidden

    def complaints(self) -> Iterator[str]:
        """Where the ranks at the states are not what the record says."""
        record, every = self.record, list(self.watched)
        sets = [legs for size in range(1, record["fewest"] + 1) for legs in combinations(every, size)]
        for state in self.states:
            dof, turns, rank = self.seen(state, every)
            motion = "".join(f"{n}{letter}" for n, letter in ((dof - turns, "T"), (turns, "R")) if n)
            found = {"dof": dof, "mobility": self.oracle.mobility(state), "motion": motion, "rank": rank}
            yield from (f"{key} {found[key]}, told {record[key]}" for key in found if found[key] != record[key])
            enough = {legs for legs in sets if self.seen(state, legs)[2] == record["rank"]} if record["rank"] else set()
            if {self.kinds(legs) for legs in enough} != {self.kinds(legs) for legs in record["minimal"]}:
                yield f"legs {sorted(enough)} see all, told {record['minimal']}"

    def kinds(self, legs: Sequence[str]) -> tuple[str, ...]:
        """What the legs are: equal legs of one body can be exchanged."""
        kinds = [
            f"{body}{leg}"
            for body, some in enumerate(choose_study_model(parse(self.record["key"])).bodies)
            for leg in some
        ]
        return tuple(sorted(kinds[int(leg) - 1] for leg in legs))

    def weakest(self) -> float:
        """The smallest singular value, along a long walk, of what all legs see of the platform's unit freedoms."""
        walk = self.oracle.random_walk(np.random.default_rng(self.seed + 1), LONG, 0.2)
        return min(self._weakest(state) for state in islice(walk, LONG))

    def _weakest(self, state: Array) -> float:
        relation = self.oracle.relation(state, list(self.watched.values()))
        rows = len(relation) - 3 * len(self.watched)
        _, values, right = np.linalg.svd(relation[:rows], full_matrices=False)
        keep = values > RANK
        return float(np.linalg.svd(relation[rows:] @ (right[keep].T / values[keep]), compute_uv=False)[-1])

    def modes(self, state: Array) -> int:
        """Poses of the platform to which the robot closes from random starts, directions of ``modes_legs`` held;
        rods of a parallelogram stay parallel, and a platform that does not turn is not turned."""
        oracle, held = self.oracle, [self.watched[leg] for leg in self.record["modes_legs"]]
        u, rng, found = oracle.directions(state, held), np.random.default_rng(self.seed), [self._pose(state)]
        for _ in range(STARTS):
            there = state.copy()
            for link in oracle.moving:
                turn = exponential(rng.uniform(0, np.pi) * normalise_vector(rng.normal(size=3)))
                there[link, :3, :3] = turn @ there[link, :3, :3]
                there[link, :3, 3] += 0.5 * oracle.length * rng.normal(size=3)
            try:
                closed = oracle.close(there, directions=u, observations=held, iterations=150)
            except (NotAssembled, np.linalg.LinAlgError):
                continue
            pose = self._pose(closed)
            known = any(np.abs(pose - other).max() < APART for other in found)
            turned = "R" not in self.record["motion"] and np.abs(pose - found[0])[:3, :3].max() > APART
            if not known and not turned and self._uncrossed(closed):
                found.append(pose)
        return len(found)

    def _pose(self, state: Array) -> Array:
        pose = self.oracle.pose(state, self.oracle.mechanism.platform).copy()
        pose[:3, 3] /= self.oracle.length
        if parse(self.record["key"]).platform == "point":
            pose[:3, :3] = 0
        return pose

    def _uncrossed(self, state: Array) -> bool:
        """Whether the two rods of each pair are parallel."""
        oracle, joints = self.oracle, self.oracle.mechanism.joints
        for rod in (name for name in oracle.index if name.startswith("rod_") and name.endswith("a")):
            chords = []
            for name in (rod, f"{rod[:-1]}b"):
                upper, lower = (joints[name.replace("rod", end)].point for end in ("upper", "lower"))
                chords.append(
                    normalise_vector(
                        oracle.pose(state, name)[:3, :3] @ oracle.zero()[oracle.index[name], :3, :3].T @ (lower - upper)
                    )
                )
            if np.linalg.norm(chords[0] - chords[1]) > 1e-6:
                return False
        return True


def _rank(rows: Array) -> int:
    return _believed(np.linalg.svd(rows, compute_uv=False), min(rows.shape)) if rows.size else 0


def _believed(values: Array, size: int) -> int:
    rank, gap = split_rank(values, size)
    if gap < GAP:
        raise Undecided(gap)
    return rank
