"""An oracle for the tests: mechanisms in maximal coordinates, by screws, with NumPy alone.

A state holds the pose X_BL of every link, shape (links, 4, 4), in the order of ``mechanism.links``; the base stays
where it is. A velocity stacks the twists (linear at the link frame's origin, angular; base axes; m/s and rad/s) of all
links but the base, shape (6 (links - 1),). Joints have no coordinates here: a joint is the set of wrenches that it
transmits. Nothing is shared with the engine under test but the description of the mechanism.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hrsynth.geometry.vectors import Array, build_pose, cross, find_perpendicular, hat, invert_pose
from hrsynth.mechanism.model import Joint, JointType, Mechanism
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations.direction import Direction

CLOSED = 1e-11
"""Largest residual of a closed state (lengths in characteristic lengths, angles in radians)."""
RANK = 1e-8
"""Singular values below this part of the largest one (of 1 at least) count as zero."""
GAP = 1e3
"""Smallest ratio (last kept / first dropped singular value) at which a rank is believed."""


class NotAssembled(Exception):
    """No state near the start satisfies all constraints: the residual that is left."""

    def __init__(self, residual: float) -> None:
        self.residual = residual
        super().__init__(f"residual {residual:.3g}")


class Undecided(Exception):
    """A rank whose gap is too small to be believed."""

    def __init__(self, gap: float) -> None:
        self.gap = gap
        super().__init__(f"gap {gap:.3g}")


def split_rank(singular_values: Array, size: int) -> tuple[int, float]:
    """Rank and gap of a dimensionless matrix with ``size`` columns from its singular values, largest first."""
    values = np.zeros(size)
    values[: len(singular_values)] = singular_values[:size]
    largest = max(values[0], 1.0) if size else 1.0
    rank = int(np.sum(values > RANK * largest))
    floor = np.finfo(float).eps * largest
    kept = values[rank - 1] if rank else 1.0
    dropped = values[rank] if rank < size else 0.0
    return rank, float(kept / max(dropped, floor))


def span(columns: Array) -> Array:
    """An orthonormal basis of the column space, shape (n, rank). Raises :class:`Undecided`."""
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    rank, gap = split_rank(values, columns.shape[1])
    if gap < GAP:
        raise Undecided(gap)
    return np.asarray(left[:, :rank])


def same_relation(A: Array, B: Array) -> float:
    """The largest principal angle (rad) between two subspaces with orthonormal columns; pi/2 if dimensions differ."""
    if A.shape != B.shape:
        return float(np.pi / 2)
    if not A.shape[1]:
        return 0.0
    sine = float(np.linalg.norm(B - A @ (A.T @ B), 2))
    return float(np.arcsin(min(1.0, sine)))


def exponential(rotation_vectors: Array) -> Array:
    """Rodrigues: the rotations by ``|v|`` about vectors v (..., 3); shape (..., 3, 3)."""
    angles = np.sqrt((rotation_vectors**2).sum(-1))[..., None]
    K = hat(rotation_vectors / np.maximum(angles, 1e-300))
    angles = angles[..., None]
    return np.asarray(np.eye(3) + np.sin(angles) * K + (1 - np.cos(angles)) * (K @ K))


def logarithm(R: Array) -> Array:
    """The rotation vector of a rotation by less than pi; shape (3,)."""
    vee: Array = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(vee)), (float(np.trace(R)) - 1) / 2
    return vee if sine < 1e-12 else vee * (float(np.arctan2(sine, cosine)) / sine)


def triad(axis: Array) -> Array:
    """A rotation whose third column is the unit vector ``axis``; shape (3, 3)."""
    first = find_perpendicular(axis)
    return np.column_stack((first, np.cross(axis, first), axis))


@dataclass
class Rows:
    """Constraints between pairs of links (i, j); every vector is fixed in one link and given in that link's frame.

    A force n (in i) at the point p keeps n . (p_j - p_i) = 0; a moment along beta x alpha keeps alpha (in i) . beta (in
    j) = c. Both are exact wherever they are evaluated, closed or not. ``upright`` lists pairs alpha, beta whose product
    must be positive: the equations alone do not distinguish an axis from its opposite.
    """

    forces: list[tuple[int, int, Array, Array, Array]] = field(default_factory=list)
    moments: list[tuple[int, int, Array, Array, float]] = field(default_factory=list)
    upright: list[tuple[int, int, Array, Array]] = field(default_factory=list)

    def __add__(self, other: Rows) -> Rows:
        return Rows(self.forces + other.forces, self.moments + other.moments, self.upright + other.upright)

    def __len__(self) -> int:
        return len(self.forces) + len(self.moments)

    def tie(
        self, i: int, j: int, X_i: Array, X_j: Array, forces: Iterable[int], pairs: Sequence[tuple[int, int]]
    ) -> None:
        """Tie the frame X_j of link j to the frame X_i of link i.

        ``forces`` numbers the axes of X_i along which the origins stay level, ``pairs`` the axes of X_i and X_j that
        stay perpendicular; the axes named second stay upright.
        """
        self.forces += [(i, j, X_i[:3, k], X_i[:3, 3], X_j[:3, 3]) for k in forces]
        self.moments += [(i, j, X_i[:3, a], X_j[:3, b], 0.0) for a, b in pairs]
        self.upright += [(i, j, X_i[:3, b], X_j[:3, b]) for b in sorted({b for _, b in pairs})]

    def evaluate(self, state: Array) -> tuple[Array, Array]:
        """Residual (rows,) and its exact derivative by the twists of all links, (rows, links, 6); forces come first."""
        count, split = len(self), len(self.forces)
        residual, J = np.zeros(count), np.zeros((count, len(state), 6))
        R, o = state[:, :3, :3], state[:, :3, 3]

        def turned(links: NDArray[np.int64], vectors: Array) -> Array:
            return np.asarray(np.einsum("kab,kb->ka", R[links], vectors))

        if self.forces:
            i, j, normals, at_i, at_j = self._packed_forces
            n, p_i, p_j = turned(i, normals), o[i] + turned(i, at_i), o[j] + turned(j, at_j)
            residual[:split] = np.einsum("ka,ka->k", n, p_j - p_i)
            rows = np.arange(split)
            J[rows, i] = -np.hstack((n, cross(p_j - o[i], n)))
            J[rows, j] = np.hstack((n, cross(p_j - o[j], n)))
        if self.moments:
            i, j, alphas, betas, levels = self._packed_moments
            alpha, beta = turned(i, alphas), turned(j, betas)
            residual[split:] = np.einsum("ka,ka->k", alpha, beta) - levels
            rows = np.arange(split, count)
            across = cross(beta, alpha)
            J[rows, i, 3:], J[rows, j, 3:] = -across, across
        return residual, J

    @cached_property
    def _packed_forces(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array]:
        i, j, normals, at_i, at_j = map(np.array, zip(*self.forces, strict=True))
        return i, j, normals, at_i, at_j

    @cached_property
    def _packed_moments(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array]:
        i, j, alphas, betas, levels = map(np.array, zip(*self.moments, strict=True))
        return i, j, alphas, betas, levels

    def stands(self, state: Array) -> bool:
        """Whether no axis points the wrong way."""
        R = state[:, :3, :3]
        return all(float((R[i] @ alpha) @ (R[j] @ beta)) > 0 for i, j, alpha, beta in self.upright)


ALL, FLAT, SQUARE = (0, 1, 2), (0, 1), ((0, 2), (1, 2), (0, 1))
RECIPROCAL: Mapping[JointType, tuple[tuple[int, ...], tuple[tuple[int, int], ...]]] = {
    JointType.REVOLUTE: (ALL, SQUARE[:2]),
    JointType.PRISMATIC: (FLAT, SQUARE),
    JointType.CYLINDRICAL: (FLAT, SQUARE[:2]),
    JointType.PLANAR: ((2,), SQUARE[:2]),
    JointType.SPHERICAL: (ALL, ()),
    JointType.UNIVERSAL: (ALL, ()),
    JointType.FIXED: (ALL, SQUARE),
    JointType.FREE: ((), ()),
}
"""What a joint's wrenches are at its centre, axis 2 along its own: the forces normal to its translations, and the
moments normal to its rotations (a universal joint adds its one moment, along e1 x e2)."""


def rows_of(joint: Joint, i: int, j: int, X_i: Array, X_j: Array) -> Rows:
    """The wrenches reciprocal to the twists of a joint between the links i and j, which have these poses at zero."""
    rows = Rows()
    frame = build_pose(joint.point, triad(joint.axis) if joint.axes else np.eye(3))
    rows.tie(i, j, invert_pose(X_i) @ frame, invert_pose(X_j) @ frame, *RECIPROCAL[joint.type])
    if joint.type is JointType.UNIVERSAL:
        first, second = joint.axes
        rows.moments.append((i, j, X_i[:3, :3].T @ first, X_j[:3, :3].T @ second, float(first @ second)))
    return rows


class Oracle:
    """Closure, mobility and relation of one mechanism, independently of the engine.

    Lengths are divided by ``length``, the mechanism's characteristic length, wherever they meet angles.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        if mechanism.couplings:
            raise ValueError("gears are not modelled")
        self.mechanism = mechanism
        self.length = mechanism.length
        self.index = {name: number for number, name in enumerate(mechanism.links)}
        self.moving = [number for name, number in self.index.items() if name != mechanism.base]
        self._zero = np.array([link.pose for link in mechanism.links.values()])
        self._zero.setflags(write=False)
        self.rows = Rows()
        for joint in mechanism.joints.values():
            i, j = (self.index[link] for link in joint.links)
            self.rows += rows_of(joint, i, j, self._zero[i], self._zero[j])

    def zero(self) -> Array:
        """The zero configuration."""
        return self._zero.copy()

    def pose(self, state: Array, link: str) -> Array:
        """X_BL of one link; shape (4, 4)."""
        return np.asarray(state[self.index[link]])

    def twist(self, velocity: Array, link: str) -> Array:
        """The twist of one link: its six rows of a velocity, or of several side by side; the base's is zero."""
        number = self.index[link]
        if number not in self.moving:
            return np.zeros((6, *velocity.shape[1:]))
        start = 6 * self.moving.index(number)
        return np.asarray(velocity[start : start + 6])

    def residual(self, state: Array) -> Array:
        """All constraints (metres and cosines, forces first); zero where the state is closed."""
        return self.rows.evaluate(state)[0]

    def jacobian(self, state: Array) -> Array:
        """The derivative of :meth:`compute_closure_residual` by the velocity; shape (rows, 6 (links - 1)); each row is
        a wrench."""
        J = self.rows.evaluate(state)[1]
        return J[:, self.moving].reshape(len(J), 6 * len(self.moving))

    def error(self, state: Array) -> float:
        """The largest residual, lengths in characteristic lengths; infinite where an axis points the wrong way."""
        scaled, _ = self._scaled(self.rows, state)
        return float(np.max(np.abs(scaled), initial=0.0)) if self.rows.stands(state) else float("inf")

    @cached_property
    def _units(self) -> Array:
        """SI velocity for each dimensionless velocity (v / length, omega)."""
        return np.tile([self.length] * 3 + [1.0] * 3, len(self.moving))

    def _scaled(self, rows: Rows, state: Array) -> tuple[Array, Array]:
        """Residual and Jacobian without dimensions."""
        residual, J = rows.evaluate(state)
        scale = np.ones(len(rows))
        scale[: len(rows.forces)] /= self.length
        units = self._units
        return scale * residual, scale[:, None] * J[:, self.moving].reshape(len(rows), len(units)) * units

    def kernel(self, state: Array) -> tuple[Array, float]:
        """T_qC: a basis of the velocities that keep all constraints, one a column, and the rank's gap.

        The basis is orthonormal once linear velocities are divided by ``length``.
        """
        _, J = self._scaled(self.rows, state)
        columns = J.shape[1]
        _, values, right = np.linalg.svd(np.vstack((J, np.zeros((max(0, columns - len(J)), columns)))))
        rank, gap = split_rank(values, columns)
        return self._units[:, None] * right[rank:].T, gap

    def mobility(self, state: Array) -> int:
        """dim T_qC, internal motions included. Raises :class:`Undecided`."""
        return int(self._believed(state).shape[1])

    def _believed(self, state: Array) -> Array:
        basis, gap = self.kernel(state)
        if gap < GAP:
            raise Undecided(gap)
        return basis

    def _observed(self, observations: Sequence[Observation] | None) -> list[tuple[int, Array]]:
        observations = self.mechanism.observations if observations is None else observations
        found = []
        for each in observations:
            if not isinstance(each, Direction):
                raise TypeError(f"only directions are modelled, not {each!r}")
            found.append((self.index[each.link], np.asarray(each.direction)))
        return found

    def directions(self, state: Array, observations: Sequence[Observation] | None = None) -> Array:
        """The observed unit vectors u in the reference link's frame; shape (k, 3)."""
        R_c = self.pose(state, self.mechanism.reference)[:3, :3]
        found = [R_c.T @ state[link, :3, :3] @ d for link, d in self._observed(observations)]
        return np.array(found).reshape(-1, 3)

    def relation(
        self,
        state: Array,
        observations: Sequence[Observation] | None = None,
        unit_length: float | None = None,
        point_only: bool = False,
    ) -> Array:
        """An orthonormal basis of rho(q): the pairs (t, u_dot) of all velocities; shape (6 + 3 k, dim).

        t is the platform frame's twist (v / unit_length, omega) in base axes, or v / unit_length alone (3 rows) with
        ``point_only``; u_dot follows in the reference link's axes, three rows an observation. ``unit_length`` is the
        mechanism's characteristic length by default. Raises :class:`Undecided`.
        """
        velocities = self._believed(state)
        L = self.length if unit_length is None else unit_length
        t = self.twist(velocities, self.mechanism.platform)
        blocks = [t[:3] / L] if point_only else [t[:3] / L, t[3:]]
        camera = self.mechanism.reference
        R_c = self.pose(state, camera)[:3, :3]
        names = list(self.index)
        for link, d in self._observed(observations):
            omega = self.twist(velocities, names[link])[3:] - self.twist(velocities, camera)[3:]
            blocks.append(-R_c.T @ hat(state[link, :3, :3] @ d) @ omega)
        return span(np.vstack(blocks))

    def moved(self, state: Array, velocity: Array) -> Array:
        """Every link turned and shifted by its own twist for a unit of time; not closed."""
        result, twists = state.copy(), velocity.reshape(-1, 6)
        result[self.moving, :3, :3] = exponential(twists[:, 3:]) @ state[self.moving, :3, :3]
        result[self.moving, :3, 3] += twists[:, :3]
        return result

    def _size(self, velocity: Array) -> float:
        """The largest twist of a link, without dimension."""
        return float(np.max(np.linalg.norm((velocity / self._units).reshape(-1, 6), axis=1), initial=0.0))

    def _settle(self, rows: Rows, state: Array, iterations: int) -> tuple[Array, float]:
        """Levenberg-Marquardt, damped by the residual (constraints may be redundant): the state and what is left.

        Gives up where seven steps on end bring next to nothing.
        """
        r, J = self._scaled(rows, state)
        units, damping, slow = self._units, 1.0, 0
        for _ in range(iterations):
            left = float(np.linalg.norm(r))
            if left < 1e-14 or slow > 6:
                break
            shift = max(damping * left**2, 1e-12)
            velocity = -units * np.linalg.solve(J.T @ J + shift * np.eye(len(units)), J.T @ r)
            velocity /= max(1.0, self._size(velocity) / 0.5)
            trial = self.moved(state, velocity)
            trial_r, trial_J = self._scaled(rows, trial)
            now = float(np.linalg.norm(trial_r))
            slow = slow + 1 if now > 0.99 * left else 0
            if now < left:
                state, r, J, damping = trial, trial_r, trial_J, max(damping / 4, 1e-3)
            elif left < 1e-13:
                break
            else:
                damping *= 10
        return state, float(np.max(np.abs(r), initial=0.0))

    def _aims(self, pins: Mapping[str, Array], aims: Iterable[tuple[int, Array, Array]]) -> Rows:
        rows, base, camera = Rows(), self.index[self.mechanism.base], self.index[self.mechanism.reference]
        for name, target in pins.items():
            if np.shape(target) == (3,):
                rows.tie(base, self.index[name], build_pose(target), np.eye(4), ALL, ())
            else:
                rows.tie(base, self.index[name], target, np.eye(4), ALL, SQUARE)
        for link, d, u in aims:
            rows.tie(camera, link, build_pose(rotation=triad(u)), build_pose(rotation=triad(d)), (), SQUARE[:2])
        return rows

    def close(
        self,
        state: Array,
        pins: Mapping[str, Array] | None = None,
        directions: Sequence[Array] | Array | None = None,
        observations: Sequence[Observation] | None = None,
        iterations: int = 60,
    ) -> Array:
        """The closed state near ``state``: Gauss-Newton steps, each the shortest one, damped far from the solution.

        ``pins`` maps links to the pose (4, 4), or the position (3,) of the frame, that they must have; ``directions``
        are the values that the observations (the mechanism's own by default) must have. Raises :class:`NotAssembled`.
        """
        aims = (
            []
            if directions is None
            else [
                (link, d, np.asarray(u)) for (link, d), u in zip(self._observed(observations), directions, strict=True)
            ]
        )
        rows = self.rows + self._aims(pins or {}, aims)
        closed, left = self._settle(rows, state, iterations)
        if left > CLOSED or not rows.stands(closed):
            raise NotAssembled(left)
        return closed

    def step(self, state: Array, velocity: Array) -> Array:
        """Follow a velocity of the kernel for a unit of time, then close. Raises :class:`NotAssembled`."""
        return self.close(self.moved(state, velocity))

    def random_walk(self, rng: np.random.Generator, n: int, size: float = 0.3) -> Iterator[Array]:
        """``n`` closed states, one after another along one path of small steps from zero.

        Between two of them no link moves by more than ``size`` (characteristic lengths or radians); a step is tried
        again, shorter, where closing it would lead away from it, and where the mobility rises. Raises
        :class:`NotAssembled` where no step succeeds.
        """
        state, heading = self.zero(), np.zeros(len(self._units))
        freedoms = self.mobility(state)
        for _ in range(n):
            gone, tries = 0.0, 0
            stride = min(size, 0.1)
            while gone < size - 1e-9:
                stride = min(stride, size - gone)
                heading = self._heading(rng, state, heading)
                velocity = stride * heading
                try:
                    there = self.step(state, velocity)
                    smooth = self._size(self._difference(there, self.moved(state, velocity))) < 0.5 * stride
                    now = self.mobility(there)
                except (NotAssembled, Undecided):
                    smooth, now = False, freedoms
                if smooth and now <= freedoms:
                    state, freedoms, gone, stride = there, now, gone + stride, min(2 * stride, 0.1)
                    continue
                tries, stride, heading = tries + 1, stride / 2, np.zeros_like(heading)
                if tries > 40:
                    raise NotAssembled(float("inf"))
                stride = max(stride, 1e-3)
            yield state

    def _heading(self, rng: np.random.Generator, state: Array, before: Array) -> Array:
        """A random velocity of size 1 that keeps some of the heading before it, and moves the platform if it can."""
        units = self._units
        K = self._believed(state) / units[:, None]
        T = self.twist(K, self.mechanism.platform)
        drawn = K @ rng.normal(size=K.shape[1])
        led = K @ (np.linalg.pinv(T, rcond=1e-3) @ rng.normal(size=6))
        kept = K @ (K.T @ (before / units))
        total = np.zeros(len(units))
        for part, weight in ((drawn, 0.5), (led, 0.5), (kept, 2.0)):
            norm = self._size(units * part)
            if norm > 1e-9:
                total += weight * part / norm
        return units * total / max(self._size(units * total), 1e-9)

    def _difference(self, there: Array, here: Array) -> Array:
        """The velocity that leads from one state to the other in a unit of time."""
        parts = [
            np.concatenate((there[k, :3, 3] - here[k, :3, 3], logarithm(there[k, :3, :3] @ here[k, :3, :3].T)))
            for k in self.moving
        ]
        return np.concatenate(parts) if parts else np.zeros(0)

    def assemble(
        self,
        platform: Array,
        directions: Sequence[Array] | Array,
        start: Array | None = None,
        observations: Sequence[Observation] | None = None,
    ) -> Array:
        """The closed state with this platform pose (4, 4), or position (3,), and these observed directions.

        Sought from ``start`` (zero by default), first straight away, then led there in ever smaller steps. The start
        should be near: along a path, hand over the last answer. Raises :class:`NotAssembled`.
        """
        state = self.zero() if start is None else start
        observed, name = self._observed(observations), self.mechanism.platform
        targets = [np.asarray(u, dtype=float) for u in directions]
        from_u, from_X = self.directions(state, observations), self.pose(state, name)
        left = NotAssembled(float("inf"))
        for parts in (1, 4, 16):
            there = state
            try:
                for part in range(1, parts):
                    s = part / parts
                    aims = [
                        (link, d, _between(a, b, s)) for (link, d), a, b in zip(observed, from_u, targets, strict=True)
                    ]
                    rows = self.rows + self._aims({name: _pose_between(from_X, platform, s)}, aims)
                    there, _ = self._settle(rows, there, 15)
                return self.close(there, {name: platform}, targets, observations)
            except NotAssembled as error:
                left = error
        raise left


def _between(a: Array, b: Array, s: float) -> Array:
    """The unit vector on the arc from a to b."""
    c = (1 - s) * a + s * b
    norm = float(np.linalg.norm(c))
    return b if norm < 1e-6 else c / norm


def _pose_between(a: Array, b: Array, s: float) -> Array:
    """The pose (or position) on the way from the pose a to the pose (or position) b."""
    if np.shape(b) == (3,):
        return (1 - s) * a[:3, 3] + s * b
    turn = exponential(s * logarithm(b[:3, :3] @ a[:3, :3].T))
    return build_pose((1 - s) * a[:3, 3] + s * b[:3, 3], turn @ a[:3, :3])
