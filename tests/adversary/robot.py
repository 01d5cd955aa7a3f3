"""A robot file read with the standard library alone, and its kinematics for many configurations at once.

A state holds the angles and slides of the tree's R and P joints (N, m) and the unit quaternions of its S joints
(N, s, 4); velocities are (N, n), n = m + 3 s. Everything works in double and in NumPy's long double.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True)
class TreeJoint:
    """A joint of the tree: the link before it, its frame there, its axis (R, P), its first velocity coordinate."""

    name: str
    kind: str
    before: str
    after: str
    R: Array
    p: Array
    axis: Array
    place: int = -1


@dataclass(frozen=True)
class Items:
    """Points and vectors fixed in links: link numbers (k,), local coordinates (k, 3), 1 for points, 0 for vectors."""

    links: NDArray[np.intp]
    local: Array
    point: Array


@dataclass(frozen=True)
class Rows:
    """Equations: item i − item j = 0 (three each), item i · item j = 0, (item j − item i) · item k = 0, and item i − a
    constant (three each, one constant a configuration or one for all)."""

    items: Items
    same: NDArray[np.intp]
    dots: NDArray[np.intp]
    offsets: NDArray[np.intp]
    fixed: NDArray[np.intp]
    values: Array
    """Constants (.., f, 3)."""


@dataclass
class State:
    """Configurations: ``theta`` (N, m), ``quats`` (N, s, 4)."""

    theta: Array
    quats: Array

    def __getitem__(self, which: object) -> State:
        return State(self.theta[which], self.quats[which])

    def __len__(self) -> int:
        return len(self.theta)


def joined(*states: State) -> State:
    """All configurations of several states."""
    return State(np.concatenate([s.theta for s in states]), np.concatenate([s.quats for s in states]))


def _normed(v: Array) -> Array:
    return v / np.sqrt(np.sum(v * v, axis=-1, keepdims=True))


def cross(a: Array, b: Array) -> Array:
    """a × b along the last axis (NumPy's own takes ten times as long for small arrays)."""
    a0, a1, a2, b0, b1, b2 = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], -1)


def _vector(element: ElementTree.Element | None, key: str, default: str, kind: type) -> Array:
    text = default if element is None else element.get(key, default)
    return np.array([kind(word) for word in text.split()])


def _rotation(rpy: Array) -> Array:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _frame(element: ElementTree.Element, kind: type) -> tuple[Array, Array]:
    origin = element.find("origin")
    return _rotation(_vector(origin, "rpy", "0 0 0", kind)), _vector(origin, "xyz", "0 0 0", kind)


def normals(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors normal to an axis and to each other."""
    other = np.zeros(3, dtype=axis.dtype)
    other[int(np.argmin(np.abs(axis)))] = 1
    first = _normed(cross(axis, other))
    return first, cross(axis, first)


@dataclass(frozen=True)
class Robot:
    """A robot: its links (the base first), the joints of its tree in order, its closing rows, its motors' coordinates.

    ``motors`` holds velocity coordinates of driven tree joints, ``platform`` the platform's link, ``seen`` what the
    file says of observed directions: (leg, link, direction in the link's frame).
    """

    name: str
    links: tuple[str, ...]
    tree: tuple[TreeJoint, ...]
    loops: Rows
    motors: tuple[str, ...]
    platform: str
    seen: tuple[tuple[str, str, Array], ...]
    length: float
    kind: type
    coordinates: dict[str, int] = field(default_factory=dict)

    @classmethod
    def read(cls, path: str | Path, kind: type = np.float64) -> Robot:
        """The robot of a native file, its decimals rounded to ``kind``."""
        root = ElementTree.parse(path).getroot()
        tree = _tree(root, kind)
        children = {joint.after for joint in tree}
        names = [next(joint.before for joint in tree if joint.before not in children)]
        order: list[TreeJoint] = []
        pending = list(tree)
        while pending:
            ready = [joint for joint in pending if joint.before in names]
            if not ready:
                raise ValueError(f"{path}: links that hang on nothing")
            for joint in ready:
                order.append(joint)
                names.append(joint.after)
                pending.remove(joint)
        angles = [joint for joint in order if joint.kind in "RP"]
        rank = {joint.name: i for i, joint in enumerate(angles)}
        balls = [joint for joint in order if joint.kind == "S"]
        rank |= {joint.name: len(angles) + 3 * i for i, joint in enumerate(balls)}
        order = [replace(joint, place=rank.get(joint.name, -1)) for joint in order]
        number = {name: i for i, name in enumerate(names)}
        own = root.find("hrsynth")
        assert own is not None
        platform = own.find("platform")
        assert platform is not None
        seen = tuple(
            (e.get("leg", ""), e.get("link", ""), _normed(_vector(e, "axis", "1 0 0", kind)))
            for e in own.findall("observe")
        )
        motors = tuple(j.get("name", "") for t in root.findall("transmission") for j in t.findall("joint"))
        loops = _loops(root, number, kind)
        robot = cls(
            root.get("name", ""),
            tuple(names),
            tuple(order),
            loops,
            motors,
            platform.get("link", ""),
            seen,
            1.0,
            kind,
            rank,
        )
        p = robot.frames(robot.zero())[1][0]
        return replace(robot, length=float(np.mean(np.linalg.norm(np.asarray(p - p.mean(0), dtype=float), axis=1))))

    @cached_property
    def scalars(self) -> int:
        """Coordinates of R and P joints."""
        return sum(joint.kind in "RP" for joint in self.tree)

    @cached_property
    def balls(self) -> int:
        """S joints of the tree."""
        return sum(joint.kind == "S" for joint in self.tree)

    @cached_property
    def size(self) -> int:
        """Velocity coordinates."""
        return self.scalars + 3 * self.balls

    @cached_property
    def slides(self) -> NDArray[np.bool_]:
        """Which velocity coordinates are lengths, (n,)."""
        found = np.zeros(self.size, dtype=bool)
        for joint in self.tree:
            if joint.kind == "P":
                found[joint.place] = True
        return found

    @cached_property
    def centres(self) -> dict[str, list[Array]]:
        """The joints' centres on each link, in its frame."""
        found: dict[str, list[Array]] = {link: [] for link in self.links}
        for joint in self.tree:
            found[joint.before].append(joint.p)
            found[joint.after].append(np.zeros(3, dtype=self.kind))
        for link, place, point in zip(
            self.loops.items.links, self.loops.items.local, self.loops.items.point, strict=True
        ):
            if point:
                found[self.links[link]].append(place)
        return found

    @cached_property
    def point(self) -> Array | None:
        """The point of a platform that counts as a point (all its joints are coaxial R, or it hangs on one S)."""
        here = self.platform
        ends: list[tuple[str, Array, Array | None]] = []
        fixed = {joint.after: joint for joint in self.tree if joint.kind == "F"}
        R0, p0 = (each[0] for each in self.frames(self.zero())[:2])
        k = self.number(here)
        body = {here}
        while here in fixed:
            here = fixed[here].before
            body.add(here)
        for joint in self.tree:
            if joint.kind != "F" and (joint.before in body) != (joint.after in body):
                i = self.number(joint.before)
                ends.append((joint.kind, R0[i] @ joint.p + p0[i], R0[i] @ joint.R @ joint.axis))
        items = self.loops.items
        for i, j in self.loops.same:
            if items.point[i] and {self.links[items.links[i]], self.links[items.links[j]]} & body:
                at = R0[items.links[i]] @ items.local[i] + p0[items.links[i]]
                model = [
                    R0[items.links[a]] @ items.local[a]
                    for a, b in self.loops.same
                    if not items.point[a] and (items.links[a], items.links[b]) == (items.links[i], items.links[j])
                ]
                others = any(
                    {items.links[a], items.links[b]} == {items.links[i], items.links[j]} for a, b in self.loops.dots
                )
                ends.append(("R" if len(model) == 1 and not others else "?", at, model[0] if model else None))
        if any(kind != "R" or axis is None for kind, _, axis in ends) or len(ends) < 2 or len(self.loops.offsets):
            return None
        _, first, axis = ends[0]
        for _, at, other in ends[1:]:
            if np.linalg.norm(cross(axis, other)) > 1e-9 or np.linalg.norm(cross(at - first, axis)) > 1e-9:
                return None
        return np.asarray(R0[k].T @ (first - p0[k]))

    def number(self, link: str) -> int:
        """The number of a link."""
        return self.links.index(link)

    def zero(self, count: int = 1) -> State:
        """The zero configuration, ``count`` times."""
        quats = np.zeros((count, self.balls, 4), dtype=self.kind)
        quats[..., 0] = 1
        return State(np.zeros((count, self.scalars), dtype=self.kind), quats)

    def moved(self, at: State, step: Array) -> State:
        """The states after velocities (N, n) for a unit of time."""
        theta = at.theta + step[:, : self.scalars]
        half = step[:, self.scalars :].reshape(len(at), self.balls, 3) / 2
        angle = np.sqrt(np.sum(half * half, axis=-1, keepdims=True))
        sinc = np.where(angle > 1e-9, np.sin(angle) / np.where(angle > 1e-9, angle, 1), 1 - angle**2 / 6)
        w, v = np.cos(angle), half * sinc
        w0, v0 = at.quats[..., :1], at.quats[..., 1:]
        quats = np.concatenate([w0 * w - np.sum(v0 * v, -1, keepdims=True), w0 * v + w * v0 + cross(v0, v)], -1)
        return State(theta, _normed(quats) if self.balls else quats)

    def frames(self, at: State) -> tuple[Array, Array, Array]:
        """Rotations (N, links, 3, 3), origins (N, links, 3), screws (N, n, 6): (ω, velocity at the base's origin) of
        each coordinate."""
        count = len(at)
        R = np.zeros((count, len(self.links), 3, 3), dtype=self.kind)
        p = np.zeros((count, len(self.links), 3), dtype=self.kind)
        screws = np.zeros((count, self.size, 6), dtype=self.kind)
        R[:, 0] = np.eye(3)
        ball = 0
        for joint in self.tree:
            i, k = self._numbers[joint.before], self._numbers[joint.after]
            Ri = R[:, i] @ joint.R
            pi = R[:, i] @ joint.p + p[:, i]
            R[:, k], p[:, k] = Ri, pi
            if joint.kind == "R":
                R[:, k] = Ri @ _about(joint.axis, at.theta[:, joint.place])
                w = Ri @ joint.axis
                screws[:, joint.place, :3], screws[:, joint.place, 3:] = w, cross(pi, w)
            elif joint.kind == "P":
                a = Ri @ joint.axis
                screws[:, joint.place, 3:] = a
                p[:, k] = pi + a * at.theta[:, joint.place, None]
            elif joint.kind == "S":
                R[:, k] = Ri @ _turned(at.quats[:, ball])
                ball += 1
                for c in range(3):
                    w = R[:, k, :, c]
                    screws[:, joint.place + c, :3], screws[:, joint.place + c, 3:] = w, cross(pi, w)
        return R, p, screws

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.links)}

    @cached_property
    def carried(self) -> NDArray[np.bool_]:
        """Which coordinates move which link, (links, n)."""
        found = np.zeros((len(self.links), self.size), dtype=bool)
        for joint in self.tree:
            k = self._numbers[joint.after]
            found[k] = found[self._numbers[joint.before]]
            found[k, joint.place : joint.place + {"R": 1, "P": 1, "S": 3, "F": 0}[joint.kind]] = True
        return found

    def items(self, items: Items, frames: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """Points and vectors in base axes (N, k, 3) and their Jacobians (N, k, n, 3), in metres."""
        R, p, screws = frames
        arm = np.einsum("nkij,kj->nki", R[:, items.links], items.local) + items.point[:, None] * p[:, items.links]
        w, v = screws[:, None, :, :3], screws[:, None, :, 3:]
        J = cross(w, arm[:, :, None])
        J += items.point[:, None, None] * v
        J *= self.carried[items.links][None, :, :, None]
        return arm, J

    def rows(self, rows: Rows, frames: tuple[Array, Array, Array], jacobian: bool = True) -> tuple[Array, Array | None]:
        """Residuals (N, r) and their Jacobian (N, r, n); lengths in characteristic lengths."""
        x, J = self.items(rows.items, frames)
        scale = np.where(rows.items.point > 0, 1 / self.length, 1.0).astype(self.kind)[None, :, None]
        x = x * scale
        J = J * scale[..., None]
        count, n = len(x), self.size
        parts, slopes = [], []
        if len(rows.same):
            i, j = rows.same.T
            parts.append((x[:, i] - x[:, j]).reshape(count, -1))
            slopes.append(np.swapaxes(J[:, i] - J[:, j], 2, 3).reshape(count, -1, n))
        if len(rows.dots):
            i, j = rows.dots.T
            parts.append(np.sum(x[:, i] * x[:, j], -1))
            slopes.append(np.einsum("nkci,nki->nkc", J[:, i], x[:, j]) + np.einsum("nkci,nki->nkc", J[:, j], x[:, i]))
        if len(rows.offsets):
            i, j, k = rows.offsets.T
            gap = x[:, j] - x[:, i]
            parts.append(np.sum(gap * x[:, k], -1))
            slopes.append(
                np.einsum("nkci,nki->nkc", J[:, j] - J[:, i], x[:, k]) + np.einsum("nkci,nki->nkc", J[:, k], gap)
            )
        if len(rows.fixed):
            i = rows.fixed
            parts.append((x[:, i] - rows.values * scale[:, i]).reshape(count, -1))
            slopes.append(np.swapaxes(J[:, i], 2, 3).reshape(count, -1, n))
        if not parts:
            return np.zeros((count, 0), dtype=self.kind), np.zeros((count, 0, n), dtype=self.kind)
        return np.concatenate(parts, 1), np.concatenate(slopes, 1) if jacobian else None

    def held(self, fixed: Items, values: Array) -> Rows:
        """The closing rows, and points and vectors at given places ((f, 3), or (N, f, 3))."""
        old = self.loops
        items = Items(
            np.concatenate([old.items.links, fixed.links]),
            np.concatenate([old.items.local, fixed.local]),
            np.concatenate([old.items.point, fixed.point]),
        )
        return replace(old, items=items, fixed=np.arange(len(fixed.links)) + len(old.items.links), values=values)

    def coordinate(self, joint: str) -> list[int] | None:
        """The velocity coordinates of a tree joint (by the name of its transmission); None for a loop."""
        if joint in self.coordinates:
            return [self.coordinates[joint]]
        return None


def things(robot: Robot, given: list[tuple[str, Array, bool]]) -> Items:
    """Items from (link, local coordinates, is a point)."""
    return Items(
        np.array([robot.number(link) for link, _, _ in given], dtype=np.intp),
        np.array([v for _, v, _ in given], dtype=robot.kind).reshape(-1, 3),
        np.array([float(point) for _, _, point in given], dtype=robot.kind),
    )


def _about(axis: Array, angle: Array) -> Array:
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=axis.dtype)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3, dtype=axis.dtype) + s * K + (1 - c) * (K @ K)


def _turned(q: Array) -> Array:
    w, x, y, z = q.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def _tree(root: ElementTree.Element, kind: type) -> list[TreeJoint]:
    """The tree joints; three R named N__1, N__2, N__3 at one point are a ball."""
    kinds = {"revolute": "R", "continuous": "R", "prismatic": "P", "fixed": "F"}
    found: dict[str, TreeJoint] = {}
    for e in root.findall("joint"):
        parent, child = e.find("parent"), e.find("child")
        assert parent is not None
        assert child is not None
        axis = _normed(_vector(e.find("axis"), "xyz", "1 0 0", kind))
        found[e.get("name", "")] = TreeJoint(
            e.get("name", ""),
            kinds[e.get("type", "")],
            parent.get("link", ""),
            child.get("link", ""),
            *_frame(e, kind),
            axis,
        )
    for name in [name for name in found if name.endswith("__3")]:
        parts = [found.get(f"{name[:-3]}__{i}") for i in (1, 2, 3)]
        if all(part is not None and part.kind == "R" for part in parts):
            first, last = found.pop(f"{name[:-3]}__1"), found.pop(name)
            found.pop(f"{name[:-3]}__2")
            # only as the writer writes it: axes x, y, z of the first frame, so that the zero turn is the identity
            found[name] = replace(last, name=name[:-3], kind="S", before=first.before, R=first.R, p=first.p)
    return list(found.values())


def _loops(root: ElementTree.Element, number: dict[str, int], kind: type) -> Rows:
    links: list[int] = []
    local: list[Array] = []
    point: list[float] = []
    same: list[tuple[int, int]] = []
    dots: list[tuple[int, int]] = []
    offsets: list[tuple[int, int, int]] = []

    def item(link: int, v: Array, is_point: bool) -> int:
        links.append(link)
        local.append(v)
        point.append(float(is_point))
        return len(links) - 1

    for e in root.findall("loop"):
        ends = []
        for tag in ("predecessor", "successor"):
            end = e.find(tag)
            assert end is not None
            ends.append((number[end.get("link", "")], *_frame(end, kind)))
        (i, Ri, pi), (j, Rj, pj) = ends
        axis = _normed(_vector(e.find("axis"), "xyz", "1 0 0", kind))
        first, second = normals(axis)
        a, b = item(i, pi, True), item(j, pj, True)

        def pair(v: Array, i: int = i, j: int = j, Ri: Array = Ri, Rj: Array = Rj) -> tuple[int, int]:
            return item(i, Ri @ v, False), item(j, Rj @ v, False)

        kind_of = e.get("type", "")
        if kind_of in ("spherical", "revolute", "continuous", "universal", "fixed"):
            same.append((a, b))
        if kind_of in ("revolute", "continuous", "prismatic", "cylindrical", "planar", "fixed"):
            same.append(pair(axis))
        if kind_of in ("prismatic", "fixed"):
            same.append(pair(first))
        if kind_of in ("prismatic", "cylindrical"):
            offsets += [(a, b, item(i, Ri @ v, False)) for v in (first, second)]
        if kind_of == "planar":
            offsets.append((a, b, item(i, Ri @ axis, False)))
        if kind_of == "universal":
            other = _normed(_vector(e.find("axis2"), "xyz", "0 1 0", kind))
            dots.append((item(i, Ri @ axis, False), item(j, Rj @ other, False)))
    items = Items(
        np.array(links, dtype=np.intp), np.array(local, dtype=kind).reshape(-1, 3), np.array(point, dtype=kind)
    )
    return Rows(
        items,
        np.array(same, dtype=np.intp).reshape(-1, 2),
        np.array(dots, dtype=np.intp).reshape(-1, 2),
        np.array(offsets, dtype=np.intp).reshape(-1, 3),
        np.zeros(0, dtype=np.intp),
        np.zeros((0, 3), dtype=kind),
    )
