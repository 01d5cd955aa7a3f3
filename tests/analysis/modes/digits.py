"""An independent path in sixty digits: a file's own decimals, its joints and loops, closed by Newton's method.

Nothing of the engine but the configurations to start from; files of the shipped dialect without ``rpy``.
"""

from __future__ import annotations

import xml.etree.ElementTree as Xml
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from scipy.optimize import least_squares

from hrsynth.geometry.vectors import Array, build_pose, rotate_about_axis

BITS = 220
STEP = 1e-25


class File:
    """A robot file as written: tree joints (name, parent, child, origin, axis, kind), and loops."""

    def __init__(self, path: str) -> None:
        root = Xml.parse(path).getroot()
        self.joints = [
            (
                j.get("name"),
                link(j, "parent"),
                link(j, "child"),
                numbers(j, "origin"),
                numbers(j, "axis"),
                j.get("type"),
            )
            for j in root.findall("joint")
        ]
        children = {child for _, _, child, *_ in self.joints}
        self.base = next(each.get("name") for each in root.findall("link") if each.get("name") not in children)
        self.loops = [
            (
                loop.get("type"),
                link(loop, "predecessor"),
                numbers(loop.find("predecessor"), "origin"),
                link(loop, "successor"),
                numbers(loop.find("successor"), "origin"),
                [numbers(loop, name) for name in ("axis", "axis2")],
            )
            for loop in root.findall("loop")
        ]
        self.joints = self._outward()
        self.moving = [j[0] for j in self.joints if j[5] != "fixed"]

    def _outward(self) -> list[Any]:
        found, known = [], {self.base}
        while len(found) < len(self.joints):
            found += [j for j in self.joints if j[1] in known and j not in found]
            known |= {j[2] for j in found}
        return found

    def poses(self, q: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
        """Rotation and position of each link, as arb matrices."""
        found = {self.base: (arb_mat(np.eye(3).tolist()), arb_mat(3, 1))}
        for name, parent, child, origin, axis, kind in self.joints:
            R, p = found[parent]
            p = p + R * column(origin)
            if kind == "prismatic":
                p = p + R * column(axis) * q[name]
            elif kind != "fixed":
                R = R * turned(axis, q[name])
            found[child] = R, p
        return found

    def start(self, known: Mapping[str, Array], rng: np.random.Generator) -> dict[str, float]:
        """Coordinates at which the links have the poses ``known`` (4, 4), from the base outward."""
        at, q, waiting = {self.base: np.eye(4)}, dict[str, float](), dict[str, list[Any]]()
        for joint in self.joints:
            before = [*waiting.get(joint[1], []), joint]
            if joint[2] not in known and any(other[1] == joint[2] for other in self.joints):
                waiting[joint[2]] = before
                continue
            target, base = known.get(joint[2]), at[before[0][1]]
            names = [j[0] for j in before if j[5] != "fixed"]

            def miss(v: Array, before=before, target=target, base=base, names=names) -> Array:
                return (self._along(before, dict(zip(names, v, strict=True)), base) - target)[:3].ravel()

            tries = (
                (
                    least_squares(miss, rng.uniform(-3, 3, len(names)), xtol=1e-15, ftol=1e-15, gtol=1e-15)
                    for _ in range(60)
                )
                if names and target is not None
                else ()
            )
            best = next((t.x for t in tries if np.abs(t.fun).max() < 1e-7), np.zeros(len(names)))
            q |= dict(zip(names, map(float, best), strict=True))
            at[joint[2]] = self._along(before, q, base)
        return q

    def _along(self, joints: Sequence[Any], q: Mapping[str, float], X: Array) -> Array:
        for name, _, _, origin, axis, kind in joints:
            a = np.array([float(c) for c in axis])
            X = X @ build_pose([float(c) for c in origin])
            if kind == "prismatic":
                X = X @ build_pose(a * q[name])
            elif kind != "fixed":
                X = X @ build_pose((0, 0, 0), rotate_about_axis(a, q[name]))
        return X

    def closes(self, q: Mapping[str, Any]) -> list[Any]:
        """What the loops miss."""
        at, rows = self.poses(q), list[Any]()
        for kind, one, x, other, y, axes in self.loops:
            (R, p), (S, t) = at[one], at[other]
            rows += (p + R * column(x) - t - S * column(y)).entries()
            if kind == "revolute" or kind == "prismatic":
                a, b = (R * column(axes[0])).entries(), (S * column(axes[0])).entries()
                rows += [a[i] * b[j] - a[j] * b[i] for i, j in ((0, 1), (1, 2), (2, 0))]
            if kind == "prismatic":
                raise NotImplementedError
            if kind == "universal":
                rows += [dot((R * column(axes[0])).entries(), (S * column(axes[1])).entries()) - dot(*axes)]
        return rows

    def solved(self, q: Mapping[str, float], extra) -> tuple[dict[str, Any], float]:
        """Newton's method on the loops and ``extra`` rows of the links' poses: coordinates and the residual left."""

        def rows(at: Mapping[str, Any]) -> list[Any]:
            return [*self.closes(at), *extra(self.poses(at))]

        with ctx.workprec(BITS):
            at: dict[str, Any] = {name: arb(q[name]) for name in self.moving}
            F, columns = rows(at), []
            for name in self.moving:
                ahead = rows(at | {name: at[name] + arb(STEP)})
                columns.append([float((b - a) / arb(STEP)) for a, b in zip(F, ahead, strict=True)])
            back = np.linalg.pinv(np.array(columns).T, rcond=1e-9)
            for _ in range(40):
                size = max(float(abs(f)) for f in F)
                scaled = np.array([float(f.mid() / arb(size)) for f in F]) if size else np.zeros(len(F))
                step = back @ scaled
                if size == 0 or np.abs(step).max() * size < 1e-45:
                    break
                at = {
                    name: (at[name] - arb(float(s)) * arb(size)).mid()
                    for name, s in zip(self.moving, step, strict=True)
                }
                F = rows(at)
            return at, max(float(abs(f)) for f in F)


def link(element: Xml.Element, name: str) -> str:
    return str(element.find(name).get("link"))


def numbers(element: Xml.Element, name: str) -> list[arb]:
    found = element.find(name)
    assert found is None or found.get("rpy") is None
    default = "1 0 0" if name == "axis" else "0 0 0"
    return numbers_of(default if found is None else found.get("xyz", default))


def numbers_of(text: str) -> list[arb]:
    with ctx.workprec(BITS):
        return [arb(each) for each in text.split()]


def column(v: Sequence[Any]) -> arb_mat:
    return arb_mat([[c] for c in v])


def dot(a: Sequence[Any], b: Sequence[Any]) -> arb:
    return sum((x * y for x, y in zip(a, b, strict=True)), arb(0))


def turned(axis: Sequence[Any], angle: arb) -> arb_mat:
    """Rodrigues' formula, the axis made a unit vector."""
    size = dot(axis, axis).sqrt()
    x, y, z = (c / size for c in axis)
    K = arb_mat([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return arb_mat(np.eye(3).tolist()) + K * angle.sin() + K * K * (1 - angle.cos())
