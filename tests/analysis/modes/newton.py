"""An independent path to the same modes: Newton's method on the pose itself, from many random complex starts.

Unknowns are the pose (cosine and sine, a quaternion, a position), not the curves' parameters; nothing is eliminated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hrsynth.geometry.loci import Circle, Curve, Line
from hrsynth.solving.platform.constrained_platform import System
from hrsynth.solving.platform.rigid import Planar, Spatial
from hrsynth.solving.platform.translating import ArticulatedPlatform, TranslatingPlatform

Batch = Any
"""A complex array whose first axis counts the starts."""


def on_curve(curve: Curve, tip: Batch, plane: Any = None) -> list[Batch]:
    """Polynomials that vanish where ``tip`` (starts, 3) is on the curve; with a normal ``plane``, within it."""
    v = tip - curve.centre
    if isinstance(curve, Line):
        across = np.linalg.svd(curve.direction[None])[2][1:]
        normals = across if plane is None else [np.cross(plane, curve.direction)]
        return [v @ n for n in normals]
    if isinstance(curve, Circle):
        sphere = (v * v).sum(axis=1) - curve.radius**2
        return [sphere] if plane is not None else [v @ curve.axis, sphere]
    return [v[:, k] for k in range(3)]


def unknowns(system: System) -> int:
    """How many numbers a pose is given by here."""
    return {Planar: 4, Spatial: 7, TranslatingPlatform: 3, ArticulatedPlatform: 5}[type(system)]


def equations(system: System, v: Batch) -> Batch:
    """All equations of a system at poses ``v`` (starts, unknowns); shape (starts, equations)."""
    rows: list[Batch] = []
    if isinstance(system, Planar):
        X = system.X_plane
        c, s = v[:, 2:3], v[:, 3:4]
        for curve, b in zip(system.curves, system.tips, strict=True):
            flat = v[:, :2] + np.hstack([c * b[0] - s * b[1], s * b[0] + c * b[1]])
            rows += on_curve(curve, X[:3, 3] + flat @ X[:3, :2].T, X[:3, 2])
        rows.append((c * c + s * s)[:, 0] - 1)
    elif isinstance(system, Spatial):
        w, u = v[:, 3:4], v[:, 4:]
        for curve, b in zip(system.curves, system.tips, strict=True):
            turned = (w * w - (u * u).sum(axis=1, keepdims=True)) * b + 2 * (u @ b)[:, None] * u
            rows += on_curve(curve, v[:, :3] + turned + 2 * w * np.cross(u, b))
        rows.append((v[:, 3:] ** 2).sum(axis=1) - 1)
    elif isinstance(system, ArticulatedPlatform):
        slide = system.slide
        moved = (
            v[:, :3]
            + slide.centre
            + slide.radius * (v[:, 3:4] * slide.start + v[:, 4:] * np.cross(slide.axis, slide.start))
        )
        for curve, b, body in zip(system.curves, system.tips, system.bodies, strict=True):
            rows += on_curve(curve, (moved if body else v[:, :3]) + b)
        rows.append((v[:, 3:] ** 2).sum(axis=1) - 1)
    else:
        assert isinstance(system, TranslatingPlatform)
        for curve, b in zip(system.curves, system.tips, strict=True):
            rows += on_curve(curve, v + b)
    return np.stack(rows, axis=1)


def solutions(system: System, starts: int, rng: np.random.Generator, real: bool = False, rounds: int = 60) -> Batch:
    """Distinct solutions found from random starts, a pose once (q and −q are one); shape (found, unknowns)."""
    size = system.size
    n = unknowns(system)
    centre = np.mean([curve.centre for curve in system.curves], axis=0)
    v = rng.normal(size=(starts, n)) + (0 if real else 1j * rng.normal(size=(starts, n)))
    v = v.astype(complex)
    lengths = 2 if isinstance(system, Planar) else 3
    v[:, :lengths] *= 1.5 * size
    if not isinstance(system, Planar):
        v[:, :3] += centre
    else:
        v[:, :2] += (centre - system.X_plane[:3, 3]) @ system.X_plane[:3, :2]
    moving = np.arange(starts)  # those whose last step was no rounding
    for _ in range(rounds):
        x = v[moving]
        F = equations(system, x)
        J = np.stack([(equations(system, x + h) - equations(system, x - h)) / 2e-6 for h in 1e-6 * np.eye(n)], axis=2)
        step = np.einsum("bij,bj->bi", np.linalg.pinv(J), F)
        step *= np.minimum(1.0, 2.0 * size / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        v[moving] = x - step
        moving = moving[np.abs(step).max(axis=1) > 1e-13 * min(1.0, size)]
        if not len(moving):
            break
    good = (np.abs(equations(system, v)).max(axis=1) < 1e-9 * size) & (np.abs(v).max(axis=1) < 1e4)
    found: list[Batch] = []
    for each in v[good]:
        twins = [each, np.r_[each[:3], -each[3:]]] if isinstance(system, Spatial) else [each]
        if not any(np.abs(model - other).max() < 1e-5 for model in twins for other in found):
            found.append(each)
    return np.array(found).reshape(-1, n)


def real_ones(found: Batch) -> Batch:
    """Those of the solutions that are real."""
    return found[np.abs(found.imag).max(axis=1, initial=0.0) < 1e-7].real


def pose_of(system: System, v: Any) -> Any:
    """The platform's pose (4, 4) of real unknowns."""
    X = np.eye(4)
    if isinstance(system, Planar):
        X[:2, :2], X[:2, 3] = [[v[2], -v[3]], [v[3], v[2]]], v[:2]
        return system.X_plane @ X
    X[:3, 3] = v[:3]
    if isinstance(system, Spatial):
        w, u = v[3], v[4:]
        X[:3, :3] = (w * w - u @ u) * np.eye(3) + 2 * np.outer(u, u) + 2 * w * np.cross(np.eye(3), u)
    return X
