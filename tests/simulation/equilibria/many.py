"""Rests of a loop counted again, a thousand starts at once: legs of three kinds, written by hand, with NumPy alone.

A leg is a crank or none, then a rod or a slide: p + R h + k = A + turned(θ) c + s u. Unknown are the platform's point p
and turn R, of each leg θ or s, and its direction u; E = ½ Σ (1 − (u · w)²) of the watched legs, L = E + Σ μ · (what is
left of these equations). First and second derivatives are by hand, along p, ω × (R h), θ, s and δ × u. Nothing is
shared with what is under test but the places of the joints.

``python -m simulation.equilibria.many 1000 3rpr_m1 quattro:1,4`` (from ``tests/``) counts and compares.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.vectors import Array
from hrsynth.simulation.equilibria.equilibria import equilibria
from hrsynth.simulation.equilibria.equilibrium import Equilibria
from oracle import exponential
from simulation.scenes import GOALS

COUNTS = (
    ("3rpr_m1", None),
    ("rrrrr_m1", None),
    ("3rrr_m1", None),
    ("quattro", "1,4"),
    ("quattro", "2,3"),
    ("quattro", None),
    ("quattro_rigid", None),
    ("gough_stewart", "1,3,5"),
    ("3rps", None),
)
WHOLE = (("3rpr_m1", None), ("rrrrr_m1", None), ("3rrr_m1", None), ("quattro", "1,4"), ("quattro", "2,3"))
"""The robots and legs whose lists hold all ends that were seen."""
MEMBER, CONTINUUM, MODE = "member", "of a continuous family", "another operation mode"
NONE, OUTSIDE = "no equilibrium", "outside"
X, Y, Z = np.eye(3)
MOTIONS: dict[str, tuple[Array, Array]] = {
    "3rpr_m1": (np.array([X, Y]), Z[None]),
    "rrrrr_m1": (np.array([X, Y]), np.zeros((0, 3))),
    "3rrr_m1": (np.array([X, Y]), Z[None]),
    "quattro": (np.eye(3), Z[None]),
    "quattro_rigid": (np.eye(3), np.zeros((0, 3))),
    "gough_stewart": (np.eye(3), np.eye(3)),
    "3rps": (np.eye(3),) * 2,
}
"""How the platform of each robot moves: shifts and turns."""
FOUND, SAME, FLAT, FAR = 1e-9, 1e-4, 1e-5, 40.0


@dataclass
class Leg:
    """At zero, in characteristic lengths: A, c, s and u, h from the platform's point, k; the crank's ``axis`` (none: it
    slides), the one ``about`` which u turns (none: as it likes), its link and whether that is watched."""

    A: Array
    c: Array
    s: float
    u: Array
    h: Array
    k: Array
    axis: Array | None
    about: Array | None
    link: str
    tip: tuple[str, Array]
    watched: bool


@dataclass
class State:
    """Of n starts: p (n, 3), R (n, 3, 3), and of l legs θ, s (n, l), u (n, l, 3)."""

    p: Array
    R: Array
    turn: Array
    s: Array
    u: Array

    def some(self, which: Any) -> State:
        return State(*(each[which] for each in vars(self).values()))

    def put(self, which: Any, other: State) -> None:
        for name, each in vars(self).items():
            each[which] = getattr(other, name)

    def copy(self) -> State:
        return State(*(each.copy() for each in vars(self).values()))


@dataclass
class Counted:
    """How the starts of each method ended, which rests of the list they met, and the E of those that it has not."""

    starts: int
    ends: Counter[tuple[str, str]] = field(default_factory=Counter)
    met: set[int] = field(default_factory=set)
    outside: list[tuple[str, float, Array]] = field(default_factory=list)


def legs_of(setup: ObservedRobot, name: str) -> tuple[Array, list[Leg]]:
    """The platform's point at zero and the legs, from the places of joints and how they are called."""
    mechanism, length = setup.mechanism, setup.mechanism.length
    joints = {each: joint.point / length for each, joint in mechanism.joints.items()}
    origin = joints["end"] if name == "rrrrr_m1" else mechanism.links[mechanism.platform].pose[:3, 3] / length
    watched, found = {each.link for each in setup.observed}, []
    planar, strut = len(MOTIONS[name][0]) == 2, name in ("3rpr_m1", "gough_stewart", "3rps")
    count = {"rrrrr_m1": 2, "quattro": 4, "quattro_rigid": 4, "gough_stewart": 6}.get(name, 3)
    for number in "123456"[:count]:
        a = "a" if name.startswith("quattro") else ""
        kind = {"3rpr_m1": "prox_", "rrrrr_m1": "dist_", "3rrr_m1": "dist_"}.get(name, "cylinder_" if strut else "rod_")
        link = kind + number + a
        if name == "gough_stewart" and link not in watched:
            continue
        wrist = "end" if name == "rrrrr_m1" else f"wrist_{number}{a}"
        shoulder = joints["shoulder_" + number]
        elbow = shoulder if strut else joints[f"elbow_{number}{a}"]
        carried = joints["hinge_1" if number in "12" else "hinge_2"] if name == "quattro" else joints[wrist]
        axes = mechanism.joints["shoulder_" + number].axes
        rod = joints[wrist] - elbow
        body = mechanism.joints[wrist].links[1]
        found.append(
            Leg(
                shoulder,
                elbow - shoulder,
                float(np.linalg.norm(rod)),
                rod / np.linalg.norm(rod),
                carried - origin,
                joints[wrist] - carried,
                None if strut else np.asarray(axes[0]),
                Z if planar else np.asarray(axes[0]) if name == "3rps" else None,
                link,
                (body, joints[wrist]),
                link in watched,
            )
        )
    return origin, found


class Many:
    """E and the closures of a robot for many starts at once."""

    def __init__(self, found: Equilibria) -> None:
        setup = found.setup
        self.name, self.length = setup.mechanism.name, setup.mechanism.length
        self.shifts, self.turns = MOTIONS[self.name]
        self.origin, self.legs = legs_of(setup, self.name)
        self.zero = {each: link.pose for each, link in setup.mechanism.links.items()}
        self.wanted = np.array([self.moved(found.goal, leg.link)[:3, :3] @ leg.u for leg in self.legs])
        self.weight = np.array([1.0 * leg.watched for leg in self.legs])
        self.scale = 1.0

    def moved(self, at: Any, link: str) -> Array:
        """The displacement of a link from zero."""
        return np.asarray(at.pose(link) @ np.linalg.inv(self.zero[link]))

    def told(self, found: Any) -> Array:
        """What a rest is known by: the legs' tips and the watched directions."""
        parts = []
        for leg in self.legs:
            D = self.moved(found, leg.tip[0])
            parts.append(D[:3, :3] @ leg.tip[1] + D[:3, 3] / self.length)
        return np.concatenate(
            [*parts, *(self.moved(found, leg.link)[:3, :3] @ leg.u for leg in self.legs if leg.watched)]
        )

    def known(self, at: State) -> Array:
        """The same of states (n, …)."""
        parts = [at.p + at.R @ leg.h + leg.k for leg in self.legs]
        return np.concatenate([*parts, *(at.u[:, i] for i, leg in enumerate(self.legs) if leg.watched)], axis=1)

    def home(self, n: int) -> State:
        ones = np.ones((n, 1))
        return State(
            ones * self.origin,
            np.broadcast_to(np.eye(3), (n, 3, 3)).copy(),
            np.zeros((n, len(self.legs))),
            ones * [leg.s for leg in self.legs],
            ones[..., None] * [leg.u for leg in self.legs],
        )

    def crank(self, at: State, i: int) -> Array:
        """c turned by θ, (n, 3)."""
        leg = self.legs[i]
        return (
            np.broadcast_to(leg.c, at.p.shape)
            if leg.axis is None
            else (exponential(at.turn[:, i, None] * leg.axis) @ leg.c)
        )

    def basis(self, at: State) -> Array:
        """What the unknowns do to (p, ω, and of each leg θ, s, δ), (n, 6 + 5 l, N)."""
        n, size = len(at.p), 6 + 5 * len(self.legs)
        columns: list[Array] = []

        def column(place: int, part: Array) -> None:
            part = np.broadcast_to(part, (n, np.shape(part)[-1]))
            full = np.zeros((n, size))
            full[:, place : place + part.shape[1]] = part
            columns.append(full)

        for each in self.shifts:
            column(0, each)
        for each in self.turns:
            column(3, each)
        for i, leg in enumerate(self.legs):
            first = 6 + 5 * i
            column(first if leg.axis is not None else first + 1, np.ones(1))
            if leg.about is not None:
                column(first + 2, leg.about)
            else:
                other = np.eye(3)[np.argmin(np.abs(at.u[:, i]), axis=1)]
                one = np.cross(at.u[:, i], other)
                one /= np.linalg.norm(one, axis=1)[:, None]
                column(first + 2, one)
                column(first + 2, np.cross(at.u[:, i], one))
        return np.stack(columns, axis=-1)

    def closing(self, at: State) -> Array:
        """What is left of the legs' equations, (n, 3 l)."""
        return np.concatenate(
            [
                at.p + at.R @ leg.h + leg.k - leg.A - self.crank(at, i) - at.s[:, i, None] * at.u[:, i]
                for i, leg in enumerate(self.legs)
            ],
            axis=1,
        )

    def rates(self, at: State, B: Array) -> Array:
        """Their derivatives, (n, 3 l, N)."""
        J = np.zeros((len(at.p), 3 * len(self.legs), 6 + 5 * len(self.legs)))
        for i, leg in enumerate(self.legs):
            rows, first = slice(3 * i, 3 * i + 3), 6 + 5 * i
            J[:, rows, :3] = np.eye(3)
            J[:, rows, 3:6] = -hat(at.R @ leg.h)
            if leg.axis is not None:
                J[:, rows, first] = -np.cross(leg.axis, self.crank(at, i))
            J[:, rows, first + 1] = -at.u[:, i]
            J[:, rows, first + 2 : first + 5] = at.s[:, i, None, None] * hat(at.u[:, i])
        return J @ B

    def error(self, at: State) -> Array:
        """E, (n,)."""
        c = np.einsum("nla,la->nl", at.u, self.wanted)
        return 0.5 * ((1 - c**2) * self.weight).sum(axis=1)

    def slope(self, at: State, B: Array) -> Array:
        """∇E, (n, N): −c δ · (u × w)."""
        g = np.zeros(B.shape[:2])
        for i, w in enumerate(self.wanted):
            u = at.u[:, i]
            g[:, 8 + 5 * i : 11 + 5 * i] = -self.weight[i] * (u @ w)[:, None] * np.cross(u, w)
        return np.einsum("nrk,nr->nk", B, g)

    def hessian(self, at: State, mu: Array, B: Array) -> Array:
        """That of E + μ · closing, (n, N, N)."""
        H = np.zeros((len(at.p), B.shape[1], B.shape[1]))
        for i, (leg, w) in enumerate(zip(self.legs, self.wanted, strict=True)):
            u, m, first, arm = at.u[:, i], mu[:, 3 * i : 3 * i + 3], 6 + 5 * i, at.R @ leg.h
            here = slice(first + 2, first + 5)
            H[:, 3:6, 3:6] += bent(m, arm)
            if leg.axis is not None:
                c = self.crank(at, i)
                H[:, first, first] += np.einsum("na,na->n", m, c - (c @ leg.axis)[:, None] * leg.axis)
            c, across = (u @ w)[:, None, None], np.cross(u, w)
            H[:, here, here] -= self.weight[i] * (outer(across, across) + c * bent(np.broadcast_to(w, u.shape), u))
            H[:, here, here] -= at.s[:, i, None, None] * bent(m, u)
            mixed = -np.cross(u, m)
            H[:, first + 1, here] += mixed
            H[:, here, first + 1] += mixed
        return np.asarray(np.swapaxes(B, 1, 2) @ H @ B)

    def stepped(self, at: State, B: Array, x: Array) -> State:
        """States after a step x (n, N)."""
        raw = np.einsum("nrk,nk->nr", B, x)
        legs = raw[:, 6:].reshape(len(x), -1, 5)
        return State(
            at.p + raw[:, :3],
            exponential(raw[:, 3:6]) @ at.R,
            at.turn + legs[..., 0],
            at.s + legs[..., 1],
            np.einsum("nlab,nlb->nla", exponential(legs[..., 2:]), at.u),
        )

    def closed(self, at: State, steps: int = 6) -> State:
        """Gauss–Newton steps, each the shortest one."""
        for _ in range(steps):
            if np.abs(self.closing(at)).max() < 1e-12:
                break
            B = self.basis(at)
            J = self.rates(at, B)
            at = self.stepped(at, B, limited(-normal(J, self.closing(at)), 0.5))
        return at

    def starts(self, n: int, rng: np.random.Generator) -> State:
        """Closed states: half of them random walks from home, half where random ones close."""
        kept = self.home(n)
        half = n // 2
        for _ in range(12):
            B = self.basis(kept)
            there = self.closed(
                self.stepped(
                    kept,
                    B,
                    limited(along(self.rates(kept, B), rng.normal(size=(n, B.shape[2]))), rng.uniform(0.1, 0.5, n)),
                )
            )
            good = np.abs(self.closing(there)).max(axis=1) < 1e-9
            kept.put(good, there.some(good))
        tries = self.home(4 * n)
        B = self.basis(tries)
        tries = self.stepped(tries, B, rng.normal(size=(4 * n, B.shape[2])) * 1.5)
        tries = self.closed(tries, 40)
        good = np.flatnonzero(
            (np.abs(self.closing(tries)).max(axis=1) < 1e-9) & (np.abs(tries.p - self.origin).max(axis=1) < 4)
        )[:half]
        kept.put(slice(0, len(good)), tries.some(good))
        return kept

    def descend(self, at: State, steps: int = 200) -> State:
        """Gradient descent with the step lengths of Barzilai and Borwein, shortened until E does not rise."""
        at, length = at.copy(), np.ones(len(at.p))
        for _ in range(steps):
            B = self.basis(at)
            J = self.rates(at, B)
            g = along(J, self.slope(at, B))
            if np.linalg.norm(g, axis=1).max() < 1e-6:
                break
            step = limited(-length[:, None] * g, 0.25)
            there = self.closed(self.stepped(at, B, step), 4)
            good = (np.abs(self.closing(there)).max(axis=1) < 1e-9) & (self.error(there) <= self.error(at) + 1e-14)
            C = self.basis(there)
            turned = (
                np.einsum(
                    "nrk,nr->nk", B, np.einsum("nrk,nk->nr", C, along(self.rates(there, C), self.slope(there, C)))
                )
                - g
            )
            best = np.einsum("nk,nk->n", step, step) / np.maximum(np.abs(np.einsum("nk,nk->n", step, turned)), 1e-300)
            length = np.where(good, np.clip(best, 1e-3, 1e3), length / 4)
            at.put(good, there.some(good))
        return at

    def newton(self, at: State, steps: int = 60) -> tuple[State, Array, Array]:
        """Newton's method for ∇L = 0 along the motions of the loops: the states, what is left, and the curvatures."""
        at, left = at.copy(), np.full(len(at.p), np.inf)
        values = np.zeros((len(at.p), 1))
        going = np.ones(len(at.p), dtype=bool)
        for number in range(steps + 1):
            here = self.closed(at.some(going), 3)
            B = self.basis(here)
            J, g = self.rates(here, B), self.slope(here, B)
            U, sizes, V = np.linalg.svd(J)
            lost = sizes < 1e-7
            rank = int(np.median((~lost).sum(axis=1)))
            inverse = np.where(np.arange(sizes.shape[1]) < rank, 1 / np.maximum(sizes, 1e-9), 0)
            mu = -np.einsum(
                "nrk,nk->nr", U[..., : sizes.shape[1]], inverse * np.einsum("nki,ni->nk", V[:, : sizes.shape[1]], g)
            )
            T = np.swapaxes(V[:, rank:], 1, 2)
            slope = np.einsum("nkf,nk->nf", T, g)
            H = np.swapaxes(T, 1, 2) @ self.hessian(here, mu, B) @ T
            curved, W = np.linalg.eigh(np.where(np.isfinite(H), H, 0.0))
            if number == 0:
                values = np.zeros((len(at.p), curved.shape[1]))
            at.put(going, here)
            values[going] = curved
            left[going] = np.maximum(np.abs(self.closing(here)).max(axis=1), np.linalg.norm(slope, axis=1))
            best = np.where(np.abs(curved) > 1e-9, 1 / np.where(curved == 0, 1, curved), 0)
            x = np.einsum("nkf,nf->nk", T, np.einsum("nfi,ni->nf", W, best * np.einsum("nfi,nf->ni", W, slope)))
            there = self.stepped(here, B, limited(-x, 0.3))
            now = left[going] > 1e-11
            at.put(going, there.some(slice(None))) if number < steps else None
            back = np.flatnonzero(going)[~now]
            at.put(back, here.some(~now))
            going[back] = False
            if not going.any() or number == steps:
                break
        return at, left, values

    def other_mode(self, at: State) -> Array:
        """Where a platform held by three planes is turned by π about a level axis and one across them: q₀ = 0."""
        return (
            (np.trace(at.R, axis1=1, axis2=2) + 1 < 1e-6) & (self.name == "3rps") & (np.abs(at.R[:, 2, 2] - 1) > 1e-6)
        )


def hat(v: Array) -> Array:
    """v ×, (n, 3, 3)."""
    return np.cross(v[:, None, :], np.eye(3)).swapaxes(1, 2)


def outer(a: Array, b: Array) -> Array:
    return a[:, :, None] * b[:, None, :]


def bent(m: Array, r: Array) -> Array:
    """The Hessian of ½ m · (ω × (ω × r)) by ω."""
    return (outer(m, r) + outer(r, m)) / 2 - np.einsum("na,na->n", m, r)[:, None, None] * np.eye(3)


def normal(J: Array, r: Array) -> Array:
    """The shortest x with J x = r."""
    gram = J @ np.swapaxes(J, 1, 2) + 1e-13 * np.eye(J.shape[1])
    return np.einsum("nrk,nr->nk", J, np.linalg.solve(gram, r[..., None])[..., 0])


def along(J: Array, v: Array) -> Array:
    """v without what opens the loops."""
    for _ in range(2):
        v = v - normal(J, np.einsum("nrk,nk->nr", J, v))
    return v


def limited(x: Array, longest: Any) -> Array:
    """Steps (n, N), none of whose changes is longer."""
    size = np.abs(x).max(axis=1)
    return np.asarray(x * np.minimum(1.0, longest / np.maximum(size, 1e-300))[:, None])


def counted(found: Equilibria, starts: int, seed: int = 1) -> Counted:
    """So many starts, each led by gradient descent and by Newton's method, and what of their ends is in the list."""
    scene, rng, result = Many(found), np.random.default_rng(seed), Counted(starts)
    members = np.array([scene.told(each.configuration) for each in found.points])
    at_once = scene.starts(starts, rng)
    for method, began in (("descent", scene.descend(at_once)), ("newton", at_once)):
        at, left, curved = scene.newton(began)
        known, E, other = scene.known(at), scene.error(at), scene.other_mode(at)
        for k in range(starts):
            apart = np.abs(members - known[k]).max(axis=1)
            alike = [abs(0.5 * each.error**2 - E[k]) < 1e-6 for each in found.families]
            if apart.min() < SAME:
                end = MEMBER
                result.met.add(int(apart.argmin()))
            elif left[k] > FOUND or np.abs(at.p[k] - scene.origin).max() > FAR:
                end = NONE
            elif np.abs(curved[k]).min() < FLAT and any(alike):
                end = CONTINUUM
            elif other[k]:
                end = MODE
            else:
                end = OUTSIDE
                result.outside.append((method, float(E[k]), curved[k]))
            result.ends[method, end] += 1
    return result


def listed(name: str, legs: str | None) -> Equilibria:
    """The list that is counted again: all rests with the directions at the robot's goal."""
    return equilibria(name, legs, goal=GOALS[name])


def main() -> None:
    """Print the table."""
    asked = [(*each.split(":"), None)[:2] for each in sys.argv[2:]] or COUNTS
    for name, legs in asked:
        began = time.process_time()
        found = listed(name, legs)
        between = time.process_time()
        result = counted(found, int(sys.argv[1]))
        ends = {
            each: [result.ends[method, each] for method in ("descent", "newton")]
            for each in (MEMBER, CONTINUUM, MODE, NONE, OUTSIDE)
        }
        print(
            f"{name} {legs or 'all'}: {len(found.points)} ({len(found.stable)}), continua {len(found.families)}, "
            f"met {len(result.met)}, {ends}, {between - began:.1f} s, {time.process_time() - between:.1f} s",
            flush=True,
        )
        for method, E, curved in sorted(result.outside, key=lambda each: each[:2])[:12]:
            print("   ", method, f"E = {E:.8g}", np.array2string(curved, precision=3))


if __name__ == "__main__":
    main()
