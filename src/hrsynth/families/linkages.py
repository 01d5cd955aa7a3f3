"""Single loops of revolute joints that move although Kutzbach's formula predicts that they do not.

Given by Denavit and Hartenberg's parameters, each link from one joint's axis to the next: length a (m), twist α (rad),
offset d (m). The default dimensions are free choices. The mobility 1 of each is a theorem of its discoverer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import Array
from ..mechanism.builder import Builder
from ..mechanism.model import Mechanism
from ..tolerances import CLOSURE_SOLVER_TOL, RANK_CUTOFF_FRACTION

LEAST_SQUARES_DECREASE_TOL = 1e-5
"""Relative decrease of a sum of squares below which least squares far from a zero stop."""
LINKAGE_STARTS_COUNT = 200
"""Random starts from which a linkage is closed."""

RIGHT = math.pi / 2


@dataclass(frozen=True, eq=False)
class Linkage:
    """A closed chain of n revolute joints: lengths, twists and offsets of the links, each (n,)."""

    lengths: Array
    twists: Array
    offsets: Array

    @classmethod
    def of(cls, lengths: Sequence[float], twists: Sequence[float], offsets: Sequence[float] | None = None) -> Linkage:
        """From plain numbers; without offsets where none are given."""
        return cls(np.array(lengths), np.array(twists), np.array(offsets or [0.0] * len(lengths)))

    def frames(self, angles: Array) -> list[Array]:
        """The frames (4, 4) of the joints' axes, one after another, the last that of the first joint again."""
        sin, up = np.sin(angles), np.sin(self.twists)
        cos, level = 1 - (1 - np.cos(angles)), 1 - (1 - np.cos(self.twists))  # as Rodrigues' formula rounds them
        links = np.zeros((len(angles), 4, 4))  # Rot(z, θ) Trans(a, 0, d) Rot(x, α)
        links[:, 0] = np.stack([cos, -sin * level, sin * up, self.lengths * np.cos(angles)], axis=1)
        links[:, 1] = np.stack([sin, cos * level, -cos * up, self.lengths * sin], axis=1)
        links[:, 2, 1], links[:, 2, 2], links[:, 2, 3], links[:, 3, 3] = up, level, self.offsets, 1.0
        return list(accumulate(links, np.matmul, initial=np.eye(4)))

    def axes(self, angles: Array) -> Array:
        """The screws (6, n) of the joints: directions, and moments about the origin."""
        frames = self.frames(angles)[:-1]
        return np.array([[*at[:3, 2], *np.cross(at[:3, 3], at[:3, 2])] for at in frames]).T

    def close(self, start: Array, second: float | None = None) -> Array | None:
        """The angles (n,) at which it is closed to which the least squares of the closure lead from a start (n,), with
        the ``second`` angle held where it is given; None where they lead to none."""
        from scipy.optimize import least_squares

        def angles(x: Array) -> Array:
            return x if second is None else np.insert(x, 1, second)

        end = least_squares(
            lambda x: (self.frames(angles(x))[-1] - np.eye(4))[:3].ravel(),
            start if second is None else np.delete(start, 1),
            xtol=1e-15,
            ftol=LEAST_SQUARES_DECREASE_TOL,
            gtol=1e-15,
        )
        return angles(end.x) if np.abs(end.fun).max() < CLOSURE_SOLVER_TOL else None

    def regular(self, rng: np.random.Generator) -> Array:
        """Closed angles (n,) at which it can move, in one way, away from special configurations: the first that are
        well away, otherwise, of dimensions that keep some joint near to 0 or π, the farthest of a stated number.

        Raises ``BadRequest`` where none of them closes so.
        """
        count = len(self.lengths)
        best, most = None, 0.0
        spans = np.hypot(self.lengths, self.offsets)
        for _ in range(
            LINKAGE_STARTS_COUNT if 2 * spans.max() <= spans.sum() else 0
        ):  # no link is longer than the others
            start = rng.uniform(-math.pi, math.pi, count)
            found = self.close(start, start[1])  # the second angle held: the same closure on every machine
            if found is None:
                continue
            found = np.remainder(found + math.pi, 2 * math.pi) - math.pi
            *_, weakest, lost = np.linalg.svd(self.axes(found), compute_uv=False)
            away = min(weakest / (0.05 * self.lengths.max()), np.abs(np.sin(found)).min() / 0.1)
            if lost < RANK_CUTOFF_FRACTION and away > most:
                best, most = found, away
                if away > 1:
                    break
        if best is None:
            raise BadRequest("dimensions of a linkage", self.lengths.tolist(), "such as close, and move in one way")
        return best

    def mechanism(self, name: str, zero: Array | None = None, tilt: Array | None = None) -> Mechanism:
        """The linkage closed at ``zero`` (n,), by default at regular angles that are always the same, its base turned
        by ``tilt`` (3, 3); the second joint is driven, the middle link is the platform."""
        angles = self.regular(np.random.default_rng(0)) if zero is None else zero
        turn = np.eye(3) if tilt is None else tilt
        frames, count = self.frames(angles), len(self.lengths)
        links = ["frame", *(f"link_{k}" for k in range(1, count))]
        b = Builder(name)
        for link, at in zip(links, frames, strict=False):
            b.link(link, at=turn @ at[:3, 3])
        for k in range(count):
            b.joint(
                f"joint_{k + 1}",
                "R",
                links[k - 1],
                links[k],
                at=turn @ frames[k][:3, 3],
                axis=turn @ frames[k][:3, 2],
                motor=k == 1,
                loop=k == 0,
            )
        return b.build(platform=links[count // 2])


def bennett(alpha: float = 0.6, beta: float = 1.1, a: float = 0.2) -> Linkage:
    """G. T. Bennett 1903: opposite links are equal, sin α / a = sin β / b."""
    b = a * math.sin(beta) / math.sin(alpha)
    return Linkage.of([a, b, a, b], [alpha, beta, alpha, beta])


def goldberg(alpha: float = 0.6, beta: float = 1.1, gamma: float = 0.8, size: float = 0.3) -> Linkage:
    """M. Goldberg 1943: two Bennett loops with one link in common, the links beside it in line."""
    a, b, c = (size * math.sin(twist) for twist in (alpha, beta, gamma))
    return Linkage.of([b, a, c, b, a + c], [beta, alpha, gamma, beta, alpha + gamma])


def myard(alpha: float = 0.8, b: float = 0.3) -> Linkage:
    """F. E. Myard 1931, symmetric to a plane: two Bennett loops with a right angle."""
    a = b * math.sin(alpha)
    return Linkage.of([a, b, 0.0, b, a], [alpha, RIGHT, math.pi - 2 * alpha, RIGHT, math.pi - alpha])


def sarrus(lengths: Sequence[float] = (0.2, 0.25, 0.3, 0.22), twist: float = 1.2, offset: float = 0.15) -> Linkage:
    """P. T. Sarrus 1853: three parallel axes, and three other parallel ones; four lengths."""
    one, two, three, four = lengths
    return Linkage.of(
        [one, two, 0.0, three, four, 0.0], [0.0, 0.0, twist, 0.0, 0.0, -twist], [0.0, 0.0, offset, 0.0, 0.0, -offset]
    )


def line_symmetric(
    lengths: Sequence[float] = (0.2, 0.3, 0.25),
    twists: Sequence[float] = (0.7, 1.1, 0.9),
    offsets: Sequence[float] = (0.05, -0.04, 0.02),
) -> Linkage:
    """R. Bricard 1897, symmetric to a line: opposite links are equal; three of each."""
    return Linkage.of([*lengths] * 2, [*twists] * 2, [*offsets] * 2)


def plane_symmetric(lengths: Sequence[float] = (0.2, 0.3, 0.25), twists: Sequence[float] = (0.7, 1.1, 0.9)) -> Linkage:
    """R. Bricard 1897, symmetric to a plane through the first and the fourth axis; three lengths and twists."""
    (a, b, c), (alpha, beta, gamma) = lengths, twists
    return Linkage.of([a, b, c, c, b, a], [alpha, beta, gamma, -gamma, -beta, -alpha])


def schatz(a: float = 0.2, offset: float = 0.08) -> Linkage:
    """P. Schatz 1929, the linkage of the Turbula mixer."""
    return Linkage.of(
        [0.0, a, a, a, 0.0, math.sqrt(3.0) * a],
        [RIGHT, RIGHT, RIGHT, RIGHT, RIGHT, 0.0],
        [offset, 0.0, 0.0, 0.0, 0.0, -offset],
    )


LINKAGES: dict[str, Callable[..., Linkage]] = {
    "bennett": bennett,
    "goldberg": goldberg,
    "myard": myard,
    "sarrus": sarrus,
    "line_symmetric_bricard": line_symmetric,
    "plane_symmetric_bricard": plane_symmetric,
    "schatz": schatz,
}
"""The linkages by name, each with default dimensions."""
