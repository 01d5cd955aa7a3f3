"""Single loops of revolute joints that move although Kutzbach's formula says that they do not.

Given by Denavit and Hartenberg's parameters, each link from one joint's axis to the next: length a, twist α, offset d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrsynth.geometry.vectors import Array, rotation_about
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import Builder

X, Z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


@dataclass(frozen=True, eq=False)
class Linkage:
    """A closed chain of n revolute joints: lengths, twists and offsets of the links, each (n,)."""

    lengths: Array
    twists: Array
    offsets: Array

    def frames(self, angles: Array) -> list[Array]:
        """The frames (4, 4) of the joints' axes, one after another, the last that of the first joint again."""
        found = [np.eye(4)]
        for angle, a, twist, d in zip(angles, self.lengths, self.twists, self.offsets, strict=True):
            link = np.eye(4)
            link[:3, :3] = rotation_about(Z, angle) @ rotation_about(X, twist)
            link[:3, 3] = [a * np.cos(angle), a * np.sin(angle), d]
            found.append(found[-1] @ link)
        return found

    def closed(self, rng: np.random.Generator, starts: int, second: float | None = None) -> list[Array]:
        """Angles (n,) at which it is closed, one for each random start that ends there; with the ``second`` angle as
        given, where it is."""
        from scipy.optimize import least_squares

        def angles(x: Array) -> Array:
            return x if second is None else np.insert(x, 1, second)

        count = len(self.lengths) - (second is not None)
        ends = (least_squares(lambda x: (self.frames(angles(x))[-1] - np.eye(4))[:3].ravel(),
                              rng.uniform(-np.pi, np.pi, count), xtol=1e-15, ftol=1e-15, gtol=1e-15)
                for _ in range(starts))
        return [angles(end.x) for end in ends if np.abs(end.fun).max() < 1e-12]

    def regular(self, rng: np.random.Generator) -> Array:
        """Closed angles (n,) at which all joints but one are independent, away from special configurations."""
        while True:
            for found in self.closed(rng, 1):
                values = np.linalg.svd(self.axes(found), compute_uv=False)
                if values[len(self.lengths) - 2] > 0.05 and np.all(np.abs(np.sin(found)) > 0.1):
                    return found

    def moved(self, angles: Array, zero: Array) -> Array:
        """The displacement (4, 4) of the middle link since ``zero``, in the frame of the second axis there."""
        link = len(self.lengths) // 2 + 1
        now, then = (np.linalg.inv(frames[1]) @ frames[link] for frames in (self.frames(angles), self.frames(zero)))
        return now @ np.linalg.inv(then)

    def axes(self, angles: Array) -> Array:
        """The screws (6, n) of the joints: directions, and moments about the origin."""
        frames = self.frames(angles)[:-1]
        return np.array([[*X_axis[:3, 2], *np.cross(X_axis[:3, 3], X_axis[:3, 2])] for X_axis in frames]).T

    def mechanism(self, name: str, zero: Array, tilt: Array) -> Mechanism:
        """The linkage closed at ``zero`` (n,), its base turned by ``tilt`` (3, 3); the second joint is driven, the
        middle link is the platform."""
        frames, count = self.frames(zero), len(self.lengths)
        links = ["frame", *(f"link_{k}" for k in range(1, count))]
        b = Builder(name)
        for link, at in zip(links, frames, strict=False):
            b.link(link, at=tilt @ at[:3, 3])
        for k in range(count):
            b.joint(f"joint_{k + 1}", "R", links[k - 1], links[k], at=tilt @ frames[k][:3, 3],
                    axis=tilt @ frames[k][:3, 2], motor=k == 1, loop=k == 0)
        return b.build(platform=links[count // 2])


def _linkage(lengths: list[float], twists: list[float], offsets: list[float] | None = None) -> Linkage:
    return Linkage(np.array(lengths), np.array(twists), np.array(offsets or [0.0] * len(lengths)))


def bennett(rng: np.random.Generator) -> Linkage:
    """G. T. Bennett 1903: opposite links equal, sin α / a = sin β / b."""
    one, other, a = *rng.uniform(0.5, 1.4, 2), 1.0
    b = a * np.sin(other) / np.sin(one)
    return _linkage([a, b, a, b], [one, other, one, other])


def goldberg(rng: np.random.Generator) -> Linkage:
    """M. Goldberg 1943: two Bennett loops with one link in common, the links beside it in line."""
    alpha, beta, gamma = rng.uniform(0.4, 1.2, 3)
    a, b, c = np.sin([alpha, beta, gamma])
    return _linkage([b, a, c, b, a + c], [beta, alpha, gamma, beta, alpha + gamma])


def myard(rng: np.random.Generator) -> Linkage:
    """F. E. Myard 1931, symmetric to a plane: two Bennett loops with a right angle."""
    alpha, b = rng.uniform(0.5, 1.2), 1.0
    a = b * np.sin(alpha)
    return _linkage([a, b, 0.0, b, a], [alpha, np.pi / 2, np.pi - 2 * alpha, np.pi / 2, np.pi - alpha])


def sarrus(rng: np.random.Generator) -> Linkage:
    """P. T. Sarrus 1853: three parallel axes, and three other parallel ones."""
    one, two, three, four = rng.uniform(0.6, 1.2, 4)
    twist = rng.uniform(0.8, 1.5)
    return _linkage([one, two, 0.0, three, four, 0.0], [0.0, 0.0, twist, 0.0, 0.0, -twist],
                    [0.0, 0.0, 0.5, 0.0, 0.0, -0.5])


def line_symmetric(rng: np.random.Generator) -> Linkage:
    """R. Bricard 1897, symmetric to a line: opposite links are equal."""
    return _linkage([*rng.uniform(0.5, 1.2, 3)] * 2, [*rng.uniform(0.5, 1.4, 3)] * 2, [*rng.uniform(-0.3, 0.3, 3)] * 2)


def plane_symmetric(rng: np.random.Generator) -> Linkage:
    """R. Bricard 1897, symmetric to a plane through the first and the fourth axis."""
    a, b, c = rng.uniform(0.5, 1.2, 3)
    alpha, beta, gamma = rng.uniform(0.5, 1.4, 3)
    return _linkage([a, b, c, c, b, a], [alpha, beta, gamma, -gamma, -beta, -alpha])


def schatz(rng: np.random.Generator) -> Linkage:
    """P. Schatz 1929, the linkage of the Turbula mixer."""
    a, d = 1.0, float(rng.uniform(0.2, 0.6))
    right = np.pi / 2
    return _linkage([0.0, a, a, a, 0.0, np.sqrt(3.0) * a], [right, right, right, right, right, 0.0],
                    [d, 0.0, 0.0, 0.0, 0.0, -d])


LINKAGES = {"bennett": bennett, "goldberg": goldberg, "myard": myard, "sarrus": sarrus,
            "line-symmetric bricard": line_symmetric, "plane-symmetric bricard": plane_symmetric, "schatz": schatz}
