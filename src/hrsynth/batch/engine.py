"""A mechanism compiled for batches of poses: inverse kinematics, Mᵀ, singular values, error maxima, reach.

Only the working mode of the zero configuration is followed. Twists have coordinates: along
``PlatformCoordinates.translations`` in characteristic lengths, about its ``rotations`` in radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..closed_forms.legs import ClosedFormLeg
from ..errors import BadRequest, MissingExtra
from ..geometry.components import Components, build_tangents, cross, plus, scale, transform_vector, where
from ..geometry.vectors import Array, freeze_array
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import PlatformMotion
from ..mechanism.legs import LegDecomposition
from ..mechanism.observation import Observation
from ..mechanism.observations.direction import Direction
from ..results import Value
from ..tolerances import RANK_CUTOFF_FRACTION
from .error_bounds import ErrorBound, bound_errors, is_bound_compiled
from .iterative_leg import IterativeLeg, IterativeLegStates
from .leg_wrenches import LegForce, compute_free_twists, list_leg_forces
from .platform_coordinates import PlatformCoordinates, SlidingLink, collect_frames, find_sliding_links
from .program import POSE_CHUNK_COUNT, Program
from .recognition import recognise_leg

LARGEST_BATCH = 1 << 29
"""Largest result of one evaluation (bytes); larger ones are evaluated in parts (``Batch.sweep``)."""
NUMBA_POSES_MIN = 20_000
"""Poses of a batch from which compiled kernels are worth numba's start (half a second) in a run with many batches."""
NUMBA_COMPILE_POSES_MIN = 5_000_000
"""Poses from which compiling a robot's kernels with numba is faster."""

Flags = NDArray[np.bool_]
ROWS = ("reached", "u", "M")
"""Outputs of the program of closed forms at each pose."""


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Value):
    """Values at n poses of a batch with k observed legs; NaN where a pose is not reached.

    ``interaction_matrix`` is Mᵀ (n, 3 k, d): the rates of the directions for the twists of ``twists`` ((6, d) or (n, 6,
    d), m and rad; zero for the rates of slides, which are in characteristic lengths). ``position`` (m) and
    ``orientation`` (rad) are the error maxima, None without cones.
    """

    reached: Flags
    directions: Array
    interaction_matrix: Array
    twists: Array
    position: ErrorBound | None
    orientation: ErrorBound | None
    normals: tuple[Array | None, ...]
    """Axis of each observed leg whose direction only rotates about a fixed axis."""

    @cached_property
    def singular_values(self) -> Array:
        """The singular values of Mᵀ, descending, (n, min(3 k, d))."""
        M = self.interaction_matrix
        found = np.full((len(M), min(M.shape[1:])), np.nan)
        found[self.reached] = np.linalg.svd(M[self.reached], compute_uv=False)
        return found

    @cached_property
    def determinant(self) -> Array | None:
        """Determinant (n,) of the directions' independent rates, None if their number is not the platform dof; its sign
        changes where a path crosses a Type 2 singularity."""
        u, M = self.directions, self.interaction_matrix.reshape(len(self.reached), len(self.normals), 3, -1)
        rows = []
        for i, normal in enumerate(self.normals):
            bases = [np.cross(normal, u[:, i]).T] if normal is not None else build_tangents(u[:, i].T)
            rows += [np.einsum("rn,nrd->nd", np.array(basis), M[:, i]) for basis in bases]
        square = np.stack(rows, axis=1)
        return np.linalg.det(square) if square.shape[1] == square.shape[2] else None


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Value):
    """Compiled mechanism: closed forms of its ``legs``, None for one that is solved by iteration or hangs on a link
    whose motion is no function of the platform's pose; ``iterative`` are those that are solved, from which the platform
    dof follow if no closed form gives them."""

    coordinates: PlatformCoordinates
    home: Array
    """The platform's pose at the zero configuration, (4, 4)."""
    legs: Mapping[str, ClosedFormLeg | None]
    iterative: Mapping[str, IterativeLeg]
    holds: Sequence[LegForce]
    """Wrenches of the legs in closed form, if the platform has other twists at each pose."""
    normals: Mapping[str, Array | None]
    length: float
    sliding: Mapping[str, tuple[SlidingLink, ClosedFormLeg]]
    """Legs on links that slide on the platform: such a link, and the closed form as if it went with the platform."""
    programs: dict[tuple[tuple[str, ...], bool], Program] = field(default_factory=dict, repr=False)
    """Traced programs, by the observed legs, and by whether slides are given."""

    @classmethod
    def of(
        cls,
        decomposition: LegDecomposition,
        observations: Sequence[Observation],
        motion: PlatformMotion,
        configurations: Sequence[ClosedConfiguration],
    ) -> Batch | None:
        """Compile a mechanism with one direction per leg; None if something else is observed, or not from the base, or
        a tilt limit excludes some rotations.

        ``configurations`` are closed ones, the zero configuration first: what is recognised must hold at all of them.
        """
        mechanism = decomposition.mechanism
        seen = {o.leg: o for o in observations if isinstance(o, Direction) and o.seen_from is None}
        if (
            mechanism.couplings
            or mechanism.tilt_limits
            or mechanism.reference != mechanism.base
            or len(seen) < len(observations)
            or set(seen) != set(decomposition.labels)
        ):
            return None
        frames = collect_frames(configurations)
        names = tuple(dict.fromkeys((*decomposition.platform, mechanism.platform)))
        coordinates = PlatformCoordinates.of(motion, frames, names, mechanism.length)
        legs: dict[str, ClosedFormLeg | None] = {}
        iterative: dict[str, IterativeLeg] = {}
        for leg in decomposition.legs:
            legs[leg.label] = recognise_leg(decomposition, leg, seen[leg.label], coordinates, frames)
            placed = decomposition.point is not None or leg.platform_link in coordinates.links
            if placed and (legs[leg.label] is None or not coordinates.has_constant_twists):
                iterative[leg.label] = IterativeLeg.of(mechanism, leg, seen[leg.label], decomposition.point)
        holds = _list_leg_forces(decomposition, coordinates, iterative, frames)
        if holds:
            iterative = {label: leg for label, leg in iterative.items() if legs[label] is None}
        normals = {o.leg: _find_rotation_axis(frames[o.link][:, :3, :3] @ o.direction) for o in seen.values()}
        sliding: dict[str, tuple[SlidingLink, ClosedFormLeg]] = {}
        if coordinates.has_constant_twists and not iterative:
            slid = find_sliding_links(coordinates, frames, names, mechanism)
            for leg in decomposition.legs:
                if legs[leg.label] is None and leg.platform_link in slid:
                    link, far = slid[leg.platform_link]
                    there = {**frames, mechanism.platform: link.moved(frames[mechanism.platform], far)}
                    placed_so = replace(coordinates, links={leg.platform_link: link.body})
                    form = recognise_leg(decomposition, leg, seen[leg.label], placed_so, there)
                    if form is not None:
                        sliding[leg.label] = link, form
        return cls(coordinates, freeze_array(motion.home), legs, iterative, holds, normals, mechanism.length, sliding)

    @property
    def slides(self) -> tuple[str, ...]:
        """The P joints by which links slide on the platform, whose coordinates ``evaluate`` can be given."""
        return tuple(dict.fromkeys(link.joint for link, _ in self.sliding.values()))

    @property
    def is_complete(self) -> bool:
        """Return True if every leg is compiled: then ``reached`` holds for the whole robot."""
        return len(self.known) == len(self.legs)

    @property
    def known(self) -> tuple[str, ...]:
        """The legs that are compiled."""
        return tuple(name for name, leg in self.legs.items() if leg is not None or name in self.iterative)

    @property
    def is_closed_form(self) -> bool:
        """Return True if one program of closed forms gives everything."""
        return self.coordinates.has_constant_twists and not self.iterative

    def evaluate(
        self,
        X: ArrayLike,
        legs: Sequence[str] | str | None = None,
        cones: ArrayLike | None = None,
        *,
        slides: ArrayLike | None = None,
        compiled: bool | None = None,
    ) -> Evaluation:
        """Evaluate the batch at platform poses.

        Parameters
        ----------
        X
            Poses (n, 4, 4) in the base frame (m). They must agree with the platform dof, which is not checked. A pose
            that is not finite is not reached.
        legs
            Observed legs (default: all).
        cones
            Half-angles of their cones (rad; one, or one per leg).
        slides
            Coordinates (n, m) of the P joints :attr:`has_translation` (m), by which links slide on the platform: then
            the legs on these can be observed as well, and Mᵀ has one more column for each.
        compiled
            True for numba, False for NumPy (default: numba if its kernels are compiled and worth starting).

        Returns
        -------
        Evaluation
            Values at the n poses.

        Raises
        ------
        BadRequest
            A leg that is not compiled, poses of another shape, half-angles not between 0 and a right angle, or a
            result that is too large.
        """
        X = np.asarray(X, dtype=float)
        if X.ndim != 3 or X.shape[1:] != (4, 4):
            raise BadRequest("poses of a batch: wrong shape", X.shape, "(n, 4, 4)")
        s = self._slid(slides, len(X))
        slid = s is not None
        watched = self._watched(legs, slid)
        half = None if cones is None else _expand_half_angles(cones, len(watched))
        twists = self._twists(slid)
        need = 8 * len(X) * (3 * len(watched) * (self.coordinates.dof + slid * len(self.slides) + 1) + 5)
        if need > LARGEST_BATCH:
            raise BadRequest(
                "the result of a batch takes too much memory (bytes)",
                need,
                f"at most {LARGEST_BATCH}",
                remedy="Evaluate the poses in parts with sweep.",
            )
        k, n = len(watched), len(X)
        quick = self.may_use_numba(n, watched, half, slid=slid) if compiled is None else compiled
        if compiled:
            self._require_compilable()
        given = X if s is None else np.hstack([X[:, :3].reshape(n, 12), s])
        rows = self._program(watched, slid).run(given, ROWS, compiled=quick)
        reached, u = rows[0] > 0, rows[1 : 1 + 3 * k].reshape(k, 3, n)
        M = rows[1 + 3 * k :].reshape(3 * k, twists.shape[1], n)
        if not self.is_closed_form:
            M, twists = self._iterate(X, watched, reached, u, M)
        position, orientation = (None, None) if half is None else bound_errors(M, twists, half, reached, compiled=quick)
        if not reached.all():
            u[..., ~reached], M[..., ~reached] = np.nan, np.nan
        return Evaluation(
            reached,
            u.transpose(2, 0, 1),
            M.transpose(2, 0, 1),
            twists,
            position,
            orientation,
            tuple(self.normals[name] for name in watched),
        )

    def rows_at(self, X: Array, watched: Sequence[str]) -> tuple[Array, Array, Array]:
        """Return the closed forms' reach margins of all legs (n, legs), 1 for a leg that always reaches; the directions
        (n, k, 3) of the ``watched`` ones and their rates (n, k, 3, d) for the twists of ``span``."""
        program, n = self._program(watched), len(X)
        rows = program.run(X, (*(f"margin_{name}" for name in self.legs), *ROWS[1:]))
        ends = np.cumsum([len(self.legs), 3 * len(watched)])
        margins, u, M = np.split(rows, ends)
        k, d = len(watched), self.span.shape[1]
        return margins.T, u.T.reshape(n, k, 3), M.T.reshape(n, k, 3, d)

    def reaches(self, X: Array) -> Flags:
        """Return True where closed forms alone reach the poses X (n, 4, 4); cheaper than ``evaluate``."""
        return np.asarray(self._program(()).run(X, ROWS[:1])[0] > 0)

    def sweep(
        self, parts: Iterable[Array], legs: Sequence[str] | str | None = None, cones: ArrayLike | None = None
    ) -> Iterator[Evaluation]:
        """The evaluations of parts of a sweep, (n, 4, 4) each, one after the other: memory is that of one part."""
        return (self.evaluate(X, legs, cones) for X in parts)

    def _slid(self, slides: ArrayLike | None, n: int) -> Array | None:
        if slides is None:
            return None
        s = np.asarray(slides, dtype=float)
        if not self.slides or s.shape != (n, len(self.slides)):
            raise BadRequest(
                "coordinates of slides of a batch: wrong shape",
                s.shape,
                f"({n}, {len(self.slides)})" if self.slides else None,
                remedy="" if self.slides else "Omit them: nothing slides on the platform.",
            )
        return s

    def _twists(self, slid: bool) -> Array:
        """Return the platform's twists for the columns of Mᵀ (m, rad): zero where a link slides on it."""
        return np.hstack([self.span, np.zeros((6, len(self.slides)))]) if slid else self.span

    def _watched(self, legs: Sequence[str] | str | None, slid: bool = False) -> list[str]:
        names = list(self.legs) if legs is None else legs.split(",") if isinstance(legs, str) else list(legs)
        known = [name for name in self.legs if name in self.known or (slid and name in self.sliding)]
        for name in names:
            if name not in known:
                raise BadRequest("unknown leg of the batch", name, known)
            if names.count(name) > 1:
                raise BadRequest("leg observed twice", name, remedy="Name each leg once.")
        if not names:
            raise BadRequest("nothing is observed: got no leg", expected=known)
        return names

    @cached_property
    def span(self) -> Array:
        """The coordinates' twists (m, rad), (6, D)."""
        return _compute_span(self.coordinates, self.length)

    def may_use_numba(
        self, n: int, legs: Sequence[str], cones: Array | None, enough: int = NUMBA_POSES_MIN, *, slid: bool = False
    ) -> bool:
        """Return True if numba computes n poses by default: its kernels are compiled and the poses are ``enough``, or
        they are so many that compiling pays."""
        if not self.is_closed_form or n < enough or find_spec("numba") is None:
            return False
        return n >= NUMBA_COMPILE_POSES_MIN or (
            self._program(legs, slid).is_compiled(ROWS)
            and (cones is None or is_bound_compiled(len(legs), self._twists(slid), cones))
        )

    def _require_compilable(self) -> None:
        """Raise ``MissingExtra`` where numba is not there, ``BadRequest`` where this batch is not for it."""
        if find_spec("numba") is None:
            raise MissingExtra("compiled=True", "fast")
        if not self.is_closed_form:
            raise BadRequest(
                "a batch with iterated legs, or with platform twists that change with the pose, is not compiled",
                remedy="Use compiled=False.",
            )

    def _program(self, watched: Sequence[str], slid: bool = False) -> Program:
        """Return the program of the closed forms at a pose X, with the displacement ``slid`` of links that slide on the
        platform: ``reached``, the directions ``u`` and rows ``M`` of the observed legs; zero for those that are solved
        by iteration."""
        key = tuple(watched), slid
        if key not in self.programs:
            self.programs[key] = self._trace(*key)
        return self.programs[key]

    def _trace(self, watched: tuple[str, ...], slid: bool) -> Program:
        twists, slides = self._twists(slid), self.slides if slid else ()
        program, d = Program.of(X=12, **{f"slide_{name}": 1 for name in slides}), twists.shape[1]

        def pose(X: Components, *slid_by: Components) -> dict[str, Components]:
            """p and R; a sum of numbers that are not all finite is not its own double's half."""
            R, whole = [X[i] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)], sum(X) + sum(each for (each,) in slid_by)
            p = plus([X[3], X[7], X[11]], transform_vector(R, program.number(self.coordinates.point)))
            return {"p": p, "R": R, "finite": [where(abs(whole - whole) <= 0.0, 1.0, 0.0)]}

        def leg_rows(
            p: Components, R: Components, *s: Components, name: str, leg: ClosedFormLeg, link: SlidingLink | None = None
        ) -> dict[str, Components]:
            moves = program.number(twists)
            if link is not None:  # its point is p + s R a: it moves by v + ω × s R a + ṡ R a
                way = (
                    transform_vector(R, program.number(link.along))
                    if self.coordinates.rotations.size
                    else (program.number(self.home[:3, :3] @ link.along))
                )
                shift = scale(s[0][0], way)
                p = plus(p, shift)
                for j in range(d - len(slides)):
                    for i, each in enumerate(cross([moves[3 + i][j] for i in range(3)], shift)):
                        moves[i][j] = moves[i][j] + each
                for i, each in enumerate(scale(program.number(self.length), way)):
                    moves[i][d - len(slides) + slides.index(link.joint)] = each
            columns = [([row[j] for row in moves[:3]], [row[j] for row in moves[3:]]) for j in range(d)]
            margin, u, rates = leg.rates(p, R, columns, program.number)
            found: dict[str, Components] = {f"margin_{name}": [margin]}
            M = [rate[i] for i in range(3) for rate in rates]
            return found | ({f"u_{name}": u, f"M_{name}": M} if name in watched else {})

        def reached(finite: Components, *margins: Components) -> dict[str, Components]:
            there = finite[0]
            for (margin,) in margins:
                there = where(margin > 0.0, there, 0.0) if not isinstance(margin, float) else there
            return {ROWS[0]: [there]}

        program.apply(pose, "X", *(f"slide_{name}" for name in slides))
        margins = []
        for name, leg in self.legs.items():
            if leg is not None:
                program.apply(partial(leg_rows, name=name, leg=leg), "p", "R")
                margins.append(f"margin_{name}")
            elif slid and name in self.sliding:
                link, form = self.sliding[name]
                program.apply(partial(leg_rows, name=name, leg=form, link=link), "p", "R", f"slide_{link.joint}")
                margins.append(f"margin_{name}")
        program.apply(reached, "finite", *margins)
        for name, size in zip(ROWS[1:], (3, 3 * d), strict=True):
            program.places[name] = [
                place for leg in watched for place in program.places.get(f"{name}_{leg}", [0.0] * size)
            ]
        return program

    def _iterate(self, X: Array, watched: Sequence[str], reached: Flags, u: Array, M: Array) -> tuple[Array, Array]:
        """Fill in the rows of legs that are solved by iteration, and ``reached``; Mᵀ (3 k, d, n) and its twists, which
        the legs decide where they are not the same at all poses."""
        n, constant = len(X), self.coordinates.has_constant_twists
        basis = np.empty((n, self.span.shape[1], self.coordinates.dof))
        X = np.where(reached[:, None, None], X, self.home)
        for start in range(0, n, POSE_CHUNK_COUNT):
            here = slice(start, start + POSE_CHUNK_COUNT)
            states = {name: self._follow(leg, X[here]) for name, leg in self.iterative.items()}
            for name in states:
                if self.legs[name] is None:
                    found, rows, there = states[name].rows()
                    reached[here] &= there
                    if name in watched:
                        place = list(watched).index(name)
                        u[place, :, here], M[3 * place : 3 * place + 3, :, here] = found, rows
            if self.holds:
                across, there = self._held_basis(X[here])
                basis[here], found = across.transpose(2, 0, 1), M[:, :, here].copy()
                M[:, : self.coordinates.dof, here] = sum(
                    row[:, None] * column for row, column in zip(found.swapaxes(0, 1), across, strict=True)
                )
                reached[here] &= there
            elif not constant:
                basis[here], there = self._feasible(list(states.values()))
                reached[here] &= there
        if constant:
            return M, self.span
        if self.holds:
            return M[:, : self.coordinates.dof], self.span @ basis
        return np.einsum("rcn,ncd->rdn", M, basis), self.span @ basis

    def _held_basis(self, X: Array) -> tuple[Array, Flags]:
        """An orthonormal basis (D, d, n) of the coordinates of the twists that the legs' forces allow, and where these
        are independent."""
        p, R = self.coordinates.place(X)
        basis, least = compute_free_twists(np.array([hold.rows(p, R, self.span) for hold in self.holds]))
        return basis, least > RANK_CUTOFF_FRACTION

    def _follow(self, leg: IterativeLeg, X: Array) -> IterativeLegStates:
        return leg.follow_from_zero(self.coordinates, self.home, X, self.span)

    def _feasible(self, states: Sequence[IterativeLegStates]) -> tuple[Array, Flags]:
        """An orthonormal basis (n, D, d) of the coordinates of the twists that all legs allow, and where it has the
        generic dimension."""
        rows = np.concatenate([each.wrenches() for each in states], axis=1)
        _, s, right = np.linalg.svd(rows, full_matrices=False)
        kept = rows.shape[2] - self.coordinates.dof
        clear = s[:, kept - 1] > RANK_CUTOFF_FRACTION
        if kept < s.shape[1]:
            clear &= s[:, kept] <= RANK_CUTOFF_FRACTION
        basis = right[:, kept:].transpose(0, 2, 1)
        turned = np.linalg.det(right[:, kept:] @ self._reference) < 0
        basis[turned, :, -1] *= -1
        return basis, clear

    @cached_property
    def _reference(self) -> Array:
        """Twists at the zero configuration, by which the signs of all other bases are chosen."""
        states = [self._follow(leg, self.home[None]) for leg in self.iterative.values()]
        rows = np.concatenate([each.wrenches() for each in states], axis=1)[0]
        return np.linalg.svd(rows)[2][rows.shape[1] - self.coordinates.dof :].T


def _compute_span(coordinates: PlatformCoordinates, length: float) -> Array:
    return coordinates.twists * np.repeat([length, 1.0], 3)[:, None]


def _list_leg_forces(
    decomposition: LegDecomposition,
    coordinates: PlatformCoordinates,
    legs: Mapping[str, IterativeLeg],
    frames: Mapping[str, Array],
) -> tuple[LegForce, ...]:
    """Return the legs' wrenches on the platform, if they are known in closed form and determine its twists; else
    nothing."""
    if coordinates.has_constant_twists or decomposition.point is not None or set(legs) != set(decomposition.labels):
        return ()
    span = _compute_span(coordinates, decomposition.mechanism.length)
    p, R = coordinates.place(frames[decomposition.mechanism.platform])
    found: list[LegForce] = []
    for leg in decomposition.legs:
        chain = legs[leg.label]
        state = chain.system.read(frames.__getitem__)
        states = IterativeLegStates(chain, coordinates, state, np.zeros(len(state)), R, span)
        holds = list_leg_forces(decomposition.mechanism, leg, coordinates, states, p)
        if holds is None:
            return ()
        found += holds
    return tuple(found) if len(found) == span.shape[1] - coordinates.dof else ()


def _expand_half_angles(cones: ArrayLike, k: int) -> Array:
    """Half-angles (k,) of the cones of k legs (rad)."""
    half = np.asarray(cones, dtype=float)
    if half.shape not in ((), (k,)):
        raise BadRequest("number of half-angles of cones", half.size, f"one, or {k}")
    for value in half.ravel():
        if not 0 < value < np.pi / 2:
            raise BadRequest("half-angle of a cone (rad)", float(value), "more than 0 and less than pi/2")
    return np.broadcast_to(half, (k,))


def _find_rotation_axis(u: Array) -> Array | None:
    """The axis about which directions (m, 3) turn, where they keep their angle to it (a plane or a cone)."""
    _, s, right = np.linalg.svd(u - u[0])
    return right[2] if s[1] > RANK_CUTOFF_FRACTION > s[2] else None
