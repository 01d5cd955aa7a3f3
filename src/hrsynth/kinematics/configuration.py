"""Closed configurations: a type that exists only if its loops are closed; measured values at one.

They are found by :func:`.tasks.solve`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from ..errors import LoopClosureFailure
from ..geometry.ranks import Rank, Spectrum, compute_matrix_spectra, compute_matrix_spectrum
from ..geometry.vectors import Array, freeze_array
from ..mechanism.observation import Observation
from ..results import Value
from ..tolerances import CLOSURE_RESIDUAL_TOL
from .pinocchio_model import PinocchioModel

LOOP_SINGULAR_VALUE_MIN = 1e-5
"""Smallest scale of the loop Jacobian's singular values (characteristic lengths, radians)."""


@dataclass(frozen=True, eq=False, repr=False)
class ClosedConfiguration(Value):
    """Configuration of a model whose loops are closed to ``tolerances.CLOSURE_RESIDUAL_TOL``; ``q`` is read-only."""

    model: PinocchioModel
    q: Array
    residual: float
    line: str | None = None
    """Whether the straight line of the joint coordinates that led here from zero is proved to; None without one."""

    @classmethod
    def of(cls, model: PinocchioModel, q: Array, tolerance: float = CLOSURE_RESIDUAL_TOL) -> ClosedConfiguration:
        """Return ``q`` as a closed configuration; raises ``LoopClosureFailure`` with the loop of the largest
        residual."""
        q = freeze_array(q)
        residual = float(np.linalg.norm(model.residual(q)))
        if not residual <= tolerance:
            raise LoopClosureFailure(model.mechanism.name, residual, tolerance, model.worst_loop(q)[0])
        return cls(model, q, residual)

    @classmethod
    def several(
        cls, model: PinocchioModel, places: Sequence[Array], tolerance: float = CLOSURE_RESIDUAL_TOL
    ) -> list[ClosedConfiguration]:
        """Return :meth:`of` of several, their constraints decomposed together."""
        found = [cls.of(model, q, tolerance) for q in places]
        for at, loops in zip(
            found, compute_matrix_spectra([model.jacobian(at.q) for at in found], LOOP_SINGULAR_VALUE_MIN), strict=True
        ):
            at.__dict__["loops"] = loops
        return found

    def pose(self, link: str) -> Array:
        """X_BL (4, 4), metres."""
        return self.model.pose(self.q, link)

    def velocity(self, link: str) -> Array:
        """V (6, nv) of a link's frame, see :meth:`PinocchioModel.velocity`."""
        return self.model.velocity(self.q, link)

    @cached_property
    def loops(self) -> Spectrum:
        """Decomposition of the constraints' Jacobian."""
        return compute_matrix_spectrum(self.model.jacobian(self.q), LOOP_SINGULAR_VALUE_MIN)

    def kernel(self) -> tuple[Array, Rank]:
        """A basis of T_qC, shape (nv, mobility), and the constraints' rank."""
        return self.loops.kernel, self.loops.rank

    @property
    def strengths(self) -> Array:
        """The singular values of the constraints that count, descending, (rank,)."""
        return self.loops.values


def measure(
    model: PinocchioModel, q: Array, reference: str, observations: Sequence[Observation], links: Sequence[str] = ()
) -> tuple[Array, Array, list[Array], list[Array]]:
    """Return poses (k, 4, 4) and velocities (k, 6, nv) of ``links``; the value (size,) and the rates (size, nv) of each
    observation, from ``reference`` if it names no link of its own, lengths in characteristic lengths. All are
    read-only: repeated calls at one configuration return the same arrays."""
    asked = reference, tuple(observations), tuple(links)
    last = model.measured
    if last is not None and last[1] is q and last[0] == asked:
        return last[2]
    names, whole, groups = _group_links(*asked)
    X, V = model.frames(q, names, whole)
    metric = V
    if not all(group.kind.turns_only for group in groups):
        metric = V.copy()
        metric[:, :3] *= model.length
    X.setflags(write=False)
    V.setflags(write=False)
    values: list[Array] = [np.zeros(0)] * len(observations)
    rates: list[Array] = [np.zeros((0, model.nv))] * len(observations)
    for group in groups:
        kind, view, at = group.kind, group.view, group.at
        found, moving = kind.together(group.observations, X[view], X[at], metric[view], metric[at])
        if group.powers is not None:
            unit = model.length**group.powers
            found, moving = found / unit, moving / unit[:, None]
        found.setflags(write=False)
        moving.setflags(write=False)
        for number, i in enumerate(group.members):
            rows = slice(number * kind.size, (number + 1) * kind.size)
            values[i], rates[i] = found[rows], moving[rows]
    model.measured = asked, q, (X[: len(links)], V[: len(links)], values, rates)
    return model.measured[2]


def measure_together(
    model: PinocchioModel,
    places: Sequence[Array],
    reference: str,
    observations: Sequence[Observation],
    links: Sequence[str] = (),
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """At several configurations the loops' residuals (n, rows) and Jacobians (n, rows, nv), and what :func:`measure`
    gives there: (n, k, 4, 4), (n, k, 6, nv), all values (n, size) and rates (n, size, nv)."""
    names, whole, groups = _group_links(reference, tuple(observations), tuple(links))
    errors, loops, X, V = model.states(places, names, whole)
    metric = V
    if not all(group.kind.turns_only for group in groups):
        metric = V.copy()
        metric[..., :3, :] *= model.length
    size = sum(o.size for o in observations)
    values, rates = np.empty((len(places), size)), np.empty((len(places), size, model.nv))
    for group in groups:
        kind, view, at = group.kind, group.view, group.at
        found, moving = kind.batched(group.observations, X[:, view], X[:, at], metric[:, view], metric[:, at])
        if group.powers is not None:
            unit = model.length**group.powers
            found, moving = found / unit, moving / unit[:, None]
        values[:, group.rows], rates[:, group.rows] = found, moving
    return errors, loops, X[:, : len(links)], V[:, : len(links)], values, rates


@dataclass(frozen=True, eq=False)
class _AlikeObservations:
    """Observations of one kind, from one link: their indices among all, the indices of the links."""

    kind: type[Observation]
    view: int
    members: list[int]
    observations: tuple[Observation, ...]
    at: NDArray[np.intp]
    rows: list[int] | slice
    """Their rows among those of all."""
    powers: Array | None
    """Of length, one for each row; None where all are zero."""


@lru_cache(maxsize=512)
def _group_links(
    reference: str, observations: tuple[Observation, ...], links: tuple[str, ...]
) -> tuple[tuple[str, ...], int, list[_AlikeObservations]]:
    """All links that matter, ``links`` first, how many of them whose points' velocities matter too, and the
    observations that are evaluated together."""
    seen = [o.seen_from or reference for o in observations]
    sliding = [name for o, view in zip(observations, seen, strict=True) if not o.turns_only for name in (view, o.link)]
    first = (*links, *dict.fromkeys(name for name in sliding if name not in links))
    names = (*first, *dict.fromkeys(name for name in (*seen, *(o.link for o in observations)) if name not in first))
    place = {name: i for i, name in enumerate(names)}
    starts = list(accumulate((o.size for o in observations), initial=0))
    groups = []
    for kind, view in dict.fromkeys((type(o), name) for o, name in zip(observations, seen, strict=True)):
        members = [i for i, o in enumerate(observations) if (type(o), seen[i]) == (kind, view)]
        chosen = tuple(observations[i] for i in members)
        powers = np.tile(np.broadcast_to(kind.dimension, kind.size), len(members)) if np.any(kind.dimension) else None
        at = np.array([place[o.link] for o in chosen])
        rows = [row for i in members for row in range(starts[i], starts[i] + kind.size)]
        groups.append(_AlikeObservations(kind, place[view], members, chosen, at, _run(rows), powers))
    return names, len(first), groups


def _run(rows: list[int]) -> list[int] | slice:
    """Return the same rows, as a slice if they are consecutive."""
    return slice(rows[0], rows[-1] + 1) if rows == list(range(rows[0], rows[-1] + 1)) else rows
