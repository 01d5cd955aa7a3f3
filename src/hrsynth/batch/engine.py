"""A mechanism compiled for batches: inverse kinematics, Mᵀ, singular values, error maxima, reach (theory.md 10).

Only the working mode of the zero configuration is followed. Twists have coordinates: along ``Stage.shifts`` in
characteristic lengths, about ``Stage.spins`` in radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike

from ..budgets import LARGEST_BATCH
from ..errors import BadRequest
from ..geometry.vectors import Array, frozen
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import PlatformMotion
from ..mechanism.legs import LegDecomposition
from ..mechanism.observation import Direction, Observation
from ..tolerances import RANK_CUTOFF
from .chain import Chain, Ends
from .cones import tangents
from .limb import Limb, recognised
from .plain import Flags, Poses, block, within
from .spread import Spread, freedom, spreads
from .stage import Stage, frames_at

CHUNK = 4096
"""Poses that are worked on together: their arrays stay in the cache, and what is not kept is freed."""
COMPILED_FROM = 20_000
"""Poses from which numba's start (about half a second) is worth its while."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a batch says of n poses with k legs watched; NaN where a pose is not reached.

    ``matrix`` is Mᵀ (n, 3 k, d): the rates of the directions for the twists of ``twists`` ((6, d) or (n, 6, d), m and
    rad). ``position`` (m) and ``orientation`` (rad) are the error maxima, None where no cones are given.
    """

    reached: Flags
    directions: Array
    matrix: Array
    twists: Array
    position: Spread | None
    orientation: Spread | None
    normals: tuple[Array | None, ...]
    """For each watched leg whose direction only turns about a fixed axis: that axis."""

    @cached_property
    def singular_values(self) -> Array:
        """The singular values of Mᵀ, descending, (n, min(3 k, d))."""
        found = np.full((len(self.matrix), min(self.matrix.shape[1:])), np.nan)
        found[self.reached] = np.linalg.svd(self.matrix[self.reached], compute_uv=False)
        return found

    @cached_property
    def determinant(self) -> Array | None:
        """The determinant (n,) of the directions' independent rates, None where they are not as many as freedoms; its
        sign changes where a path crosses a Type 2 singularity."""
        u, M = self.directions, self.matrix.reshape(len(self.matrix), len(self.normals), 3, -1)
        rows = []
        for i, normal in enumerate(self.normals):
            bases = [np.cross(normal, u[:, i]).T] if normal is not None else tangents(u[:, i].T)
            rows += [np.einsum("rn,nrd->nd", basis, M[:, i]) for basis in bases]
        square = np.stack(rows, axis=1)
        return np.linalg.det(square) if square.shape[1] == square.shape[2] else None


@dataclass(frozen=True, eq=False)
class Batch:
    """A compiled mechanism: each leg a subproblem or a chain, None where it hangs on a link that does not go with the
    platform's pose; ``chains`` are those by which the platform's freedoms follow from its pose."""

    stage: Stage
    home: Array
    """The platform's pose at the zero configuration, (4, 4)."""
    legs: Mapping[str, Limb | Chain | None]
    chains: Mapping[str, Chain]
    normals: Mapping[str, Array | None]
    length: float

    @classmethod
    def of(cls, anatomy: LegDecomposition, observations: Sequence[Observation], motion: PlatformMotion,
           configurations: Sequence[ClosedConfiguration]) -> Batch | None:
        """Compile a mechanism with one direction a leg; None where something else is observed, or not from the base,
        or a wrist cannot make every turn.

        ``configurations`` are closed ones, the zero configuration first: what is recognised must hold at all of them.
        """
        mechanism = anatomy.mechanism
        seen = {o.leg: o for o in observations if isinstance(o, Direction) and o.seen_from is None}
        if (mechanism.couplings or mechanism.wrists or mechanism.reference != mechanism.base
                or len(seen) < len(observations) or set(seen) != set(anatomy.labels)):
            return None
        frames = frames_at(configurations)
        stage = Stage.of(motion, frames, tuple(dict.fromkeys((*anatomy.platform, mechanism.platform))),
                         mechanism.length)
        legs: dict[str, Limb | Chain | None] = {}
        chains: dict[str, Chain] = {}
        for leg in anatomy.legs:
            found: Limb | Chain | None = recognised(anatomy, leg, seen[leg.label], stage, frames)
            placed = anatomy.point is not None or leg.attach in stage.bodies
            if placed and (found is None or not stage.constant):
                chains[leg.label] = Chain.of(mechanism, leg, seen[leg.label], anatomy.point)
            legs[leg.label] = found or chains.get(leg.label)
        normals = {o.leg: _axis_of(frames[o.link][:, :3, :3] @ o.direction) for o in seen.values()}
        return cls(stage, frozen(motion.home), legs, chains, normals, mechanism.length)

    @property
    def complete(self) -> bool:
        """Whether every leg is compiled: then ``reached`` says whether the robot reaches a pose."""
        return all(leg is not None for leg in self.legs.values())

    def evaluate(self, X: ArrayLike, legs: Sequence[str] | str | None = None, cones: ArrayLike | None = None, *,
                 compiled: bool | None = None) -> Evaluation:
        """Everything at platform poses X (n, 4, 4) with ``legs`` watched (default: all), ``cones`` their half-angles
        (rad; one, or one a leg).

        X are poses that the platform can take as far as its own freedoms go; that is not checked. A pose that is not
        finite is not reached. ``compiled`` asks for numba, or forbids it (default: where it is installed, from many
        poses on). Raises ``BadRequest`` for legs that are not compiled, poses of another shape, cones that are none,
        and results that are too large.
        """
        X = np.asarray(X, dtype=float)
        if X.ndim != 3 or X.shape[1:] != (4, 4):
            raise BadRequest("poses of a batch: shape", X.shape, "(n, 4, 4)")
        watched = self._watched(legs)
        half = None if cones is None else _half_angles(cones, len(watched))
        need = 8 * len(X) * (3 * len(watched) * (self.stage.dof + 1) + 5)
        if need > LARGEST_BATCH:
            raise BadRequest("the result of a batch takes too much memory (bytes)", need,
                             f"at most {LARGEST_BATCH}; sweep goes through any number of poses in parts")
        if self._quick(len(X), compiled):
            return self._compiled(X, watched, half)
        return self._plain(X, watched, half)

    def reached(self, X: Array) -> Flags:
        """Where known subproblems alone reach the poses X (n, 4, 4); what else ``evaluate`` says is left out."""
        found = [self._reached(X[start : start + CHUNK]) for start in range(0, len(X), CHUNK)]
        return np.concatenate(found) if found else np.zeros(0, dtype=bool)

    def _reached(self, X: Array) -> Flags:
        poses = Poses.of(*self.stage.place(X))
        there = np.ones(len(X), dtype=bool)
        for leg in self.legs.values():
            if isinstance(leg, Limb):
                there &= within(leg, poses)
        return there

    def sweep(self, parts: Iterable[Array], legs: Sequence[str] | str | None = None, cones: ArrayLike | None = None
              ) -> Iterator[Evaluation]:
        """The evaluations of parts of a sweep, (n, 4, 4) each, one after the other: memory is that of one part."""
        return (self.evaluate(X, legs, cones) for X in parts)

    def _watched(self, legs: Sequence[str] | str | None) -> list[str]:
        names = list(self.legs) if legs is None else legs.split(",") if isinstance(legs, str) else list(legs)
        known = [name for name, leg in self.legs.items() if leg is not None]
        for name in names:
            if name not in known:
                raise BadRequest("a leg of the batch", name, known)
            if names.count(name) > 1:
                raise BadRequest("a leg is watched twice", name, known)
        if not names:
            raise BadRequest("nothing is observed", "no leg", known)
        return names

    @cached_property
    def _span(self) -> Array:
        """The stage's twists (m, rad) for its coordinates, (6, D)."""
        return self.stage.twists * np.repeat([self.length, 1.0], 3)[:, None]

    def _quick(self, n: int, compiled: bool | None) -> bool:
        """Whether numba does n poses: it takes known subproblems alone."""
        known = self.stage.constant and all(isinstance(leg, Limb) for leg in self.legs.values() if leg is not None)
        if compiled is None:
            return known and n >= COMPILED_FROM and find_spec("numba") is not None
        if compiled and find_spec("numba") is None:
            raise BadRequest("numba is not installed", True, "compiled=False, or the extra fast")
        if compiled and not known:
            raise BadRequest("a batch whose legs are solved by iteration is not compiled", True, "compiled=False")
        return compiled

    def _compiled(self, X: Array, watched: Sequence[str], cones: Array | None) -> Evaluation:
        from concurrent.futures import ThreadPoolExecutor

        from .compiled import THREADS, swept

        limbs = {name: leg for name, leg in self.legs.items() if isinstance(leg, Limb)}
        n, k, d = len(X), len(watched), self._span.shape[1]
        names = list(limbs)
        reached, clear = np.empty(n, dtype=bool), np.ones(n, dtype=bool)
        U, M, found = np.empty((n, k, 3)), np.empty((n, 3 * k, d)), np.empty((n, 4))
        half = np.zeros(0) if cones is None else np.ascontiguousarray(cones)
        only = [freedom(part[:, :, None]) for part in (self._span[:3], self._span[3:])]
        single = np.array([2 if each is None else int(each.any()) for each in only])
        robot = (np.array([int(limb.kind) for limb in limbs.values()]),
                 np.array([limb.row() for limb in limbs.values()]),
                 np.array([names.index(name) for name in watched]), self._span)
        cone = (np.array(self.stage.point), half,
                np.array([np.zeros(3) if each is None else each for each in only]), single)
        X = np.ascontiguousarray(X)

        def part(start: int) -> None:
            here = slice(start, start + CHUNK)
            swept(*robot, X[here], *cone, *(each[here] for each in (reached, clear, U, M, found)))

        with ThreadPoolExecutor(THREADS) as pool:
            list(pool.map(part, range(0, n, CHUNK)))
        position = orientation = None
        if cones is not None:
            if not clear.all():
                lost = spreads(np.ascontiguousarray(M[~clear].transpose(1, 2, 0)), self._span, cones)
                found[~clear] = np.stack([each for spread in lost for each in (spread.largest, spread.lower)], axis=1)
            position, orientation = Spread(found[:, 0], found[:, 1]), Spread(found[:, 2], found[:, 3])
        return Evaluation(reached, U, M, self._span, position, orientation, tuple(self.normals[x] for x in watched))

    def _plain(self, X: Array, watched: Sequence[str], cones: Array | None) -> Evaluation:
        """In NumPy, part by part; what all poses have in one shape is filled in where it stays."""
        n, k = len(X), len(watched)
        u, M = np.empty((k, 3, n)), np.empty((k, 3, self._span.shape[1], n))
        parts = [self._part(X[start : start + CHUNK], watched, cones, u[..., start : start + CHUNK],
                            M[..., start : start + CHUNK]) for start in range(0, max(n, 1), CHUNK)]
        whole = {"directions": u.transpose(2, 0, 1)}
        if self.stage.constant:
            whole["matrix"] = M.reshape(3 * k, M.shape[2], n).transpose(2, 0, 1)
        return _joined(parts, whole)

    def _part(self, X: Array, watched: Sequence[str], cones: Array | None, u: Array, M: Array) -> Evaluation:
        """The directions u (k, 3, n) and M (k, 3, D, n) are filled in."""
        finite: Flags = np.asarray(np.isfinite(X[:, :3]).all(axis=(1, 2)))
        if not finite.all():
            X = np.where(finite[:, None, None], X, self.home)
        poses = Poses.of(*self.stage.place(X))
        ends = {name: self._led(chain, X) for name, chain in self.chains.items()}
        reached = finite
        for name, leg in self.legs.items():
            places = [i for i, other in enumerate(watched) if other == name]
            if isinstance(leg, Limb):
                for i in places:
                    there = block(leg, self._span, poses, u[i], M[i])
                reached &= there if places else within(leg, poses)
            elif leg is not None:
                found, rows, there = ends[name].rows()
                u[places], M[places] = found, rows
                reached &= there
        twists, rows = self._span, M.reshape(3 * len(watched), *M.shape[2:])
        if not self.stage.constant:
            feasible, there = self._feasible(list(ends.values()))
            reached &= there
            rows, twists = np.einsum("rcn,ncd->rdn", rows, feasible), twists @ feasible
        position, orientation = (None, None) if cones is None else _where(reached, rows, twists, cones)
        if not reached.all():
            u[..., ~reached], rows[..., ~reached] = np.nan, np.nan
        return Evaluation(reached, u.transpose(2, 0, 1), rows.transpose(2, 0, 1), twists, position, orientation,
                          tuple(self.normals[name] for name in watched))

    def _led(self, chain: Chain, X: Array) -> Ends:
        return chain.led_from_zero(self.stage, self.home, X, self._span)

    def _feasible(self, ends: Sequence[Ends]) -> tuple[Array, Flags]:
        """An orthonormal basis (n, D, d) of the coordinates of the twists that all legs allow, and where it has the
        generic dimension."""
        rows = np.concatenate([each.wrenches() for each in ends], axis=1)
        _, s, right = np.linalg.svd(rows, full_matrices=False)
        kept = rows.shape[2] - self.stage.dof
        clear = s[:, kept - 1] > RANK_CUTOFF
        if kept < s.shape[1]:
            clear &= s[:, kept] <= RANK_CUTOFF
        basis = right[:, kept:].transpose(0, 2, 1)
        turned = np.linalg.det(right[:, kept:] @ self._reference) < 0
        basis[turned, :, -1] *= -1
        return basis, clear

    @cached_property
    def _reference(self) -> Array:
        """The twists at home: which way round every other basis is."""
        ends = [self._led(chain, self.home[None]) for chain in self.chains.values()]
        rows = np.concatenate([each.wrenches() for each in ends], axis=1)[0]
        return np.linalg.svd(rows)[2][rows.shape[1] - self.stage.dof :].T


def _where(reached: Flags, rows: Array, twists: Array, cones: Array) -> tuple[Spread, Spread]:
    """The error maxima at the poses that are reached, NaN at the others."""
    if reached.all():
        return spreads(rows, twists, cones)
    found = spreads(rows[..., reached], twists if twists.ndim == 2 else twists[reached], cones)
    columns = np.full((4, len(reached)), np.nan)
    columns[:, reached] = [each for spread in found for each in (spread.largest, spread.lower)]
    return Spread(*columns[:2]), Spread(*columns[2:])


def _half_angles(cones: ArrayLike, k: int) -> Array:
    """Half-angles (k,) of the cones of k legs (rad)."""
    half = np.asarray(cones, dtype=float)
    if half.shape not in ((), (k,)):
        raise BadRequest("half-angles of cones: how many", half.size, f"one, or {k}")
    for value in half.ravel():
        if not 0 < value < np.pi / 2:
            raise BadRequest("half-angle of a cone (rad)", float(value), "more than 0, less than a right angle")
    return np.broadcast_to(half, (k,))


def _axis_of(u: Array) -> Array | None:
    """The axis about which directions (m, 3) turn, where they keep their angle to it (a plane or a cone)."""
    _, s, right = np.linalg.svd(u - u[0])
    return right[2] if s[1] > RANK_CUTOFF > s[2] else None


def _joined(parts: Sequence[Evaluation], whole: Mapping[str, Array]) -> Evaluation:
    """One evaluation of all poses; ``whole`` holds what is there in one piece."""
    if len(parts) == 1:
        return parts[0]

    def column(name: str) -> object:
        values = [getattr(part, name) for part in parts]
        if name in whole:
            return whole[name]
        if name == "normals" or values[0] is None or (name == "twists" and values[0].ndim == 2):
            return values[0]
        if isinstance(values[0], Spread):
            return Spread(*(np.concatenate([getattr(v, f.name) for v in values]) for f in fields(Spread)))
        return np.concatenate(values)

    return Evaluation(**{f.name: column(f.name) for f in fields(Evaluation)})  # type: ignore[arg-type]
