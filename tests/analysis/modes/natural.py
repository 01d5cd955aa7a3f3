"""Assembly modes in natural coordinates, an independent path: of each link a point and the directions that its joints
use, from the joint graph alone, with no types of legs. Joints and held directions are linear in them, slides bilinear,
scalar products constant. What is linear is eliminated, again and again; the quadrics that remain are solved by a
homotopy of as many paths as their degrees allow. Nothing is proved: counts are compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import JointType
from hrsynth.mechanism.legs import Leg
from hrsynth.mechanism.observations.direction import Direction

RANK_TOL = 1e-9
"""Singular values, over the largest, that count as zero where something is eliminated."""
PATHS_MOST = 512
FARTHEST, ISOLATED = 1e6, 1e-10
"""Largest unknown of a solution (characteristic lengths), and the least singular value of its Jacobian over the
largest: what has less belongs to a family."""
SAME = 1e-6
"""Distance at which two poses are one, and size of a value that counts as zero."""


@dataclass
class Natural:
    """Unknowns x (n,), each with its value at the goal: images of points and directions are affine rows (3, n + 1)."""

    goal: list[float] = field(default_factory=list)
    linear: list[Array] = field(default_factory=list)
    quadrics: list[tuple[Array, Array, float]] = field(default_factory=list)
    """Sums of products of rows: pairs of rows (k, ·) and a constant."""

    def vector(self, value: Array) -> Array:
        """A vector of new unknowns with this value at the goal, as places of the unknowns (3,)."""
        places = np.arange(len(self.goal), len(self.goal) + 3)
        self.goal += value.tolist()
        return places


def rows_of(places: Array | None, value: Array, n: int) -> Array:
    """The affine rows (3, n + 1) of a vector of unknowns, or of one that does not move."""
    rows = np.zeros((3, n + 1))
    if places is None:
        rows[:, 0] = value
    else:
        rows[np.arange(3), places + 1] = 1.0
    return rows


class Robot:
    """A robot at its zero configuration, with held directions or motors, as equations in natural coordinates."""

    def __init__(self, setup: ObservedRobot, real: bool, hull: bool) -> None:
        robot = self.robot = setup.mechanism
        assert not robot.couplings
        idle = [leg for leg in setup.decomposition.legs if is_idle(setup, leg, real, hull)]
        self.joints = [joint for joint in robot.joints.values() if not any(joint.name in leg.joints for leg in idle)]
        self.links = [link for link in robot.links if not any(link in leg.links for leg in idle)]
        length = self.length = setup.all_samples.model.length
        point = {joint.name: joint.point / length for joint in self.joints}
        self.of_link = {link: link for link in self.links}  # links that have one rotation
        rigid = {JointType.PRISMATIC, JointType.FIXED} | ({JointType.REVOLUTE} if real else set())
        for joint in self.joints:
            if joint.type in rigid and (joint.type is not JointType.REVOLUTE or joint.is_actuated):
                one, other = (self.of_link[link] for link in joint.links)
                keep, gone = (other, one) if other == self.of_link[robot.base] else (one, other)
                self.of_link = {link: keep if group == gone else group for link, group in self.of_link.items()}
        self.fixed = self.of_link[robot.base]
        self.origin = {
            link: next(iter(point[joint.name] for joint in self.joints if link in joint.links), np.zeros(3))
            for link in self.links
        }
        self.held = []
        for seen in setup.observed if not real else ():
            assert isinstance(seen, Direction)
            self.held.append((seen.link, robot.links[seen.link].pose[:3, :3] @ seen.direction))
        used: dict[str, list[Array]] = {group: [] for group in self.of_link.values()}
        for link, direction in self.held:
            used[self.of_link[link]].append(direction)
        for joint in self.joints:
            for link in joint.links:
                used[self.of_link[link]].append(point[joint.name] - self.origin[link])
                used[self.of_link[link]] += joint.axes[:1] if joint.type is not JointType.UNIVERSAL else ()
        crosses = [
            (joint, k, self.of_link[link])
            for joint in self.joints
            if joint.type is JointType.UNIVERSAL
            for k, link in enumerate(joint.links)
        ]
        groups = [group for _, _, group in crosses]
        # a cross on a rod turns the rod about itself, which nothing else feels
        self.turning = {
            joint.name
            for joint, _, group in crosses
            if group != self.fixed and groups.count(group) == 1 and orthonormal(used[group]).shape[1] == 1
        }
        for joint, k, group in crosses:
            if joint.name not in self.turning:
                used[group].append(joint.axes[k])
        self.natural = Natural()
        self.basis = {group: orthonormal(vectors) for group, vectors in used.items()}
        self.places = {
            group: [self.natural.vector(column) for column in basis.T]
            for group, basis in self.basis.items()
            if group != self.fixed
        }
        self.at = {link: self.natural.vector(self.origin[link]) for link in self.links if link != robot.base}
        self.n = len(self.natural.goal)
        self.equations = list(self.list_equations(point, real))

    def turned(self, link: str, vector: Array) -> Array:
        """The rows of a direction of a link."""
        group = self.of_link[link]
        if group == self.fixed:
            return rows_of(None, vector, self.n)
        parts = self.basis[group].T @ vector
        return sum(
            part * rows_of(places, np.zeros(3), self.n) for part, places in zip(parts, self.places[group], strict=True)
        )

    def moved(self, link: str, point: Array) -> Array:
        """The rows of a point of a link."""
        if link == self.robot.base:
            return rows_of(None, point, self.n)
        return rows_of(self.at[link], self.origin[link], self.n) + self.turned(link, point - self.origin[link])

    def list_equations(self, point: dict[str, Array], real: bool) -> Iterator[Array]:
        """Symmetric matrices (n + 1, n + 1) of the equations (1, x) M (1, x) = 0."""
        one = np.eye(1, self.n + 1)
        for joint in self.joints:
            first, second = joint.links
            gap = self.moved(first, point[joint.name]) - self.moved(second, point[joint.name])
            held = real and joint.is_actuated
            slides = joint.type in (JointType.PRISMATIC, JointType.CYLINDRICAL)
            if joint.type is JointType.PLANAR:
                yield product(self.turned(first, joint.axis), gap)
            elif slides and not (held and joint.type is JointType.PRISMATIC):
                axis = self.turned(first, joint.axis)
                for i, j in ((0, 1), (1, 2), (2, 0)):
                    yield product(axis[[i]], gap[[j]]) - product(axis[[j]], gap[[i]])
            else:
                yield from (product(one, row[None]) for row in gap)
            if joint.name in self.turning:
                continue
            if joint.type is JointType.UNIVERSAL:
                a, b = joint.axes
                yield product(self.turned(first, a), self.turned(second, b)) - (a @ b) * product(one, one)
            elif joint.type in (JointType.REVOLUTE, JointType.CYLINDRICAL, JointType.PLANAR):
                same = self.turned(first, joint.axis) - self.turned(second, joint.axis)
                yield from (product(one, row[None]) for row in same)
        for link, direction in self.held:
            same = self.turned(link, direction) - rows_of(None, direction, self.n)
            yield from (product(one, row[None]) for row in same)
        for group, places in self.places.items():
            columns = [rows_of(each, np.zeros(3), self.n) for each in places]
            for i, a in enumerate(columns):
                for j, b in enumerate(columns[: i + 1]):
                    yield product(a, b) - float(i == j) * product(one, one)
            if len(columns) == 3:
                sign = np.sign(np.linalg.det(self.basis[group]))
                for k in range(3):
                    a, b, c = columns[k - 2], columns[k - 1], columns[k]
                    for i, j, r in ((1, 2, 0), (2, 0, 1), (0, 1, 2)):
                        cross = product(a[[i]], b[[j]]) - product(a[[j]], b[[i]])
                        yield cross - sign * product(one, c[[r]])
                for i in range(3):
                    for j in range(i + 1):
                        rows = [np.array([each[r] for each in columns]) for r in (i, j)]
                        yield product(*rows) - float(i == j) * product(one, one)

    def value_at(self, poses: dict[str, Array]) -> Array:
        """The unknowns where the links are displaced from zero by poses (4, 4), in characteristic lengths."""
        x = np.zeros(self.n)
        for group, places in self.places.items():
            for column, each in zip(self.basis[group].T, places, strict=True):
                x[each] = poses[group][:3, :3] @ column
        for link, each in self.at.items():
            x[each] = poses[link][:3, :3] @ self.origin[link] + poses[link][:3, 3]
        return x


def is_idle(setup: ObservedRobot, leg: Leg, real: bool, hull: bool) -> bool:
    """Whether a leg holds nothing: it has no measured value, and a dof for each of the platform, or what it takes from
    the platform is in the hull of the samples."""
    joints = [setup.mechanism.joints[name] for name in leg.joints]
    measured = any(joint.is_actuated for joint in joints) if real else leg.label in setup.labels
    return not measured and (hull or sum(joint.type.freedoms for joint in joints) >= 6)


def orthonormal(vectors: list[Array]) -> Array:
    """An orthonormal basis (3, d) of what vectors span."""
    U, s, _ = np.linalg.svd(np.array([*vectors, np.zeros(3)]).T)
    return U[:, : int(np.sum(s > SAME))]


def product(a: Array, b: Array) -> Array:
    """The symmetric matrix of the sum of products of the rows of a and b (k, n + 1)."""
    M = a.T @ b
    return (M + M.T) / 2


def eliminate(robot: Robot, hull: Array | None) -> tuple[Array, Array]:
    """The map T (n + 1, m + 1) from the unknowns that remain, and a basis of the quadrics in them."""
    T, M = np.eye(robot.n + 1), np.array(robot.equations)
    T[1:, 0] = robot.natural.goal
    if hull is not None:
        T = np.block([[np.ones((1, 1)), np.zeros((1, hull.shape[1]))], [T[1:, :1], hull]])
    while True:
        m = T.shape[1] - 1
        rows = np.array([T.T @ each @ T for each in M])
        upper = np.triu_indices(m + 1)
        table = (rows * (2 - np.eye(m + 1)))[:, upper[0], upper[1]]
        table = table[np.abs(table).max(axis=1) > RANK_TOL]
        if not len(table):
            return T, table
        _, s, Vt = np.linalg.svd(table, full_matrices=False)
        table = Vt[s > RANK_TOL * s[0]]
        square = upper[0] > 0
        U, s, _ = np.linalg.svd(table[:, square])
        rank = int(np.sum(s > 1e-7))
        found = (U[:, rank:].T @ table)[:, ~square]
        if not len(found):
            return T, table
        _, s, Vt = np.linalg.svd(found[:, 1:])
        keep = Vt[int(np.sum(s > RANK_TOL)) :].T
        T = T @ np.block([[np.ones((1, 1)), np.zeros((1, keep.shape[1]))], [np.zeros((m, 1)), keep]])
        if not keep.shape[1]:
            return T, np.zeros((0, 1))


def divide(J: Array, value: Array) -> Array:
    """Solutions of linear systems (k, n, n), of singular ones the shortest."""
    try:
        return np.linalg.solve(J, value[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(J) @ value[..., None])[..., 0]


def solve(table: Array, m: int, rng: np.random.Generator) -> Array:
    """The isolated solutions (k, m) of quadrics (N, terms), complex: m random sums of them by 2^m paths."""
    upper = np.triu_indices(m + 1)
    N = len(table)
    mixed = (rng.normal(size=(m, N)) + 1j * rng.normal(size=(m, N))) @ table
    Q = np.zeros((m, m + 1, m + 1), complex)
    Q[:, upper[0], upper[1]] = mixed / 2
    Q = Q + Q.transpose(0, 2, 1)
    G = np.zeros_like(Q)
    roots = np.exp(2j * np.pi * rng.uniform(size=m))
    for i in range(m):
        G[i, i + 1, i + 1], G[i, 0, 0] = 1.0, -(roots[i] ** 2)
    gamma = np.exp(2j * np.pi * rng.uniform())
    patch = rng.normal(size=m + 1) + 1j * rng.normal(size=m + 1)
    signs = np.array(np.meshgrid(*[[1, -1]] * m, indexing="ij")).reshape(m, -1).T
    z = np.column_stack([np.ones(len(signs)), signs * roots]).astype(complex)
    z /= (z @ patch)[:, None]

    def system(z: Array, s: Array) -> tuple[Array, Array, Array]:
        """The residual, its Jacobian, and its rate with s."""
        f, g = (np.einsum("kij,pj->pki", A, z) for A in (Q, gamma * G))
        H = s[:, None, None] * g + (1 - s)[:, None, None] * f
        value = np.column_stack([np.einsum("pki,pi->pk", H, z), z @ patch - 1])
        J = np.concatenate([2 * H, np.broadcast_to(patch, (len(z), 1, m + 1))], axis=1)
        rate = np.column_stack([np.einsum("pki,pi->pk", g - f, z), np.zeros(len(z))])
        return value, J, rate

    def newton(z: Array, s: Array, steps: int) -> tuple[Array, Array]:
        size = np.full(len(z), np.inf)
        for _ in range(steps):
            value, J, _ = system(z, s)
            step = divide(J, value)
            z, size = z - step, np.linalg.norm(step, axis=1) / np.linalg.norm(z, axis=1)
        return z, size

    s, h = np.ones(len(z)), np.full(len(z), 0.05)
    for _ in range(4000):
        on = (s > 0) & (h > 1e-9)
        if not on.any():
            break
        here, there = z[on], np.maximum(s[on] - h[on], 0.0)
        _, J, rate = system(here, s[on])
        guess = here - divide(J, rate) * (there - s[on])[:, None]
        new, size = newton(guess, there, 3)
        with np.errstate(invalid="ignore"):
            good = (size < 1e-8) & (np.linalg.norm(new - guess, axis=1) < 0.01 * np.linalg.norm(guess, axis=1))
        places = np.flatnonzero(on)
        z[places[good]], s[places[good]] = new[good], there[good]
        h[places] = np.where(good, np.minimum(1.5 * h[on], 0.05), h[on] / 2)
    with np.errstate(all="ignore"):
        y = z[:, 1:] / z[:, :1]
    y = y[np.all(np.isfinite(y), axis=1) & (np.abs(y).max(axis=1) < FARTHEST) & (s < 1e-6)]
    out = []
    for each in y:  # Gauss-Newton on all quadrics
        for _ in range(8):
            value, J = evaluate(table, each)
            each = each - np.linalg.lstsq(J, value, rcond=None)[0]
        value, J = evaluate(table, each)
        spectrum = np.linalg.svd(J, compute_uv=False)
        if np.abs(value).max() < 1e-10 * np.abs([1.0, *each]).max() ** 2 and spectrum[-1] > ISOLATED * spectrum[0]:
            out.append(each)
    return np.array(out).reshape(-1, m)


def evaluate(table: Array, y: Array) -> tuple[Array, Array]:
    """The quadrics at y, and their Jacobian."""
    m = len(y)
    upper, full = np.triu_indices(m + 1), np.concatenate([[1.0], y])
    A = np.zeros((len(table), m + 1, m + 1))
    A[:, upper[0], upper[1]] = table / 2
    A = A + A.transpose(0, 2, 1)
    rows = A @ full
    return rows @ full, 2 * rows[:, 1:]


def count_modes(setup: ObservedRobot, real: bool = False, hull: bool = False) -> tuple[int, int, int] | None:
    """The numbers of unknowns that remain, of complex and of real platform poses; None if there are too many paths."""
    robot, rng = Robot(setup, real, hull), np.random.default_rng(0)
    span = None
    if hull:
        length, rows = robot.length, []
        for sample in setup.all_samples.members:
            poses = {}
            for link in robot.links:
                X = sample.configuration.pose(link) @ np.linalg.inv(robot.robot.links[link].pose)
                X[:3, 3] /= length
                poses[link] = X
            rows.append(robot.value_at(poses) - robot.natural.goal)
        _, s, Vt = np.linalg.svd(np.array(rows), full_matrices=False)
        rank = int(np.sum(s > 1e-7 * s[0]))
        assert rank < len(rows)
        span = Vt[:rank].T
    T, table = eliminate(robot, span)
    m = T.shape[1] - 1
    if 2**m > PATHS_MOST or len(table) < m:
        return None
    y = solve(table, m, rng) if m else np.zeros((1, 0))
    platform = robot.robot.platform
    rows = [robot.moved(platform, robot.origin[platform])]
    rows += [robot.turned(platform, column) for column in robot.basis[robot.of_link[platform]].T]
    found: list[Array] = []
    for each in y:
        pose = np.concatenate(rows) @ (T @ np.concatenate([[1.0], each]))
        if all(np.abs(pose - other).max() > SAME * np.abs([1.0, *pose]).max() for other in found):
            found.append(pose)
    return m, len(found), sum(bool(np.abs(pose.imag).max() < SAME) for pose in found)
