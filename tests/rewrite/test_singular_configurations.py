"""Where rewriting keeps the relation: docs/pages/theory.md, section 4, rule by rule, at special configurations.

A robot with random dimensions is derived at its zero configuration and brought into closed configurations that are
written in closed form: random ones, ones at which the controller loses a freedom, and one at which the condition of a
rule fails. The links of the lift and of the simplified robot are placed there by hand, and the oracle, which knows
neither rules nor joint coordinates, compares what the three robots can do: the relation of the platform's twist and the
observed rates, and the twists that are left where the motors are locked (of the real robot: the observed directions).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations, islice

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.geometry.vectors import (
    Array,
    build_pose,
    find_perpendicular,
    hat,
    invert_pose,
    normalise_vector,
    rotate_about_axis,
)
from hrsynth.kinematics.locked_twists import set_zero
from hrsynth.kinematics.pinocchio_model import PinocchioModel
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import JointType, Mechanism
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.rewrite.rule import AXES, LOOPS
from hrsynth.rewrite.rules import leg_removal, list_rules, pi_form
from hrsynth.rewrite.state import State, VirtualChain
from hrsynth.rewrite.strategy import RewriteTrace
from hrsynth.tolerances import RELATION_ANGLE_TOL
from kinematics.robots import walked
from oracle import GAP, Oracle, Undecided, same_relation, span, split_rank
from rewrite.test_rules import lifted, simplified
from strategies import deltas, pods, random_direction, random_normal

Poses = dict[str, Array]
"""The pose (4, 4) of each link."""
CLOSED = 1e-10
"""Largest residual of a configuration (characteristic lengths, cosines)."""
DIFFERENT = 1e-4
"""Angle (rad) between two spaces from which on they differ."""


class NoCase(Exception):
    """A robot without the configurations that are looked for: another one is drawn."""


# --- robots and their configurations, in closed form ----------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A robot, what is observed, configurations at which all conditions hold, and one at which a rule's fails."""

    robot: Mechanism
    observe: tuple[str, ...]
    holds: tuple[Poses, ...]
    fails: Poses


def turn(axis: Array, angle: float, point: Array) -> Array:
    """The displacement that turns by an angle about an axis through a point; shape (4, 4)."""
    R = rotate_about_axis(axis, angle)
    return build_pose(point - R @ point, R)


def carry(old: tuple[Array, Array, Array], new: tuple[Array, Array, Array]) -> Array:
    """The displacement that takes a point and two unit vectors with a constant angle to others; shape (4, 4)."""
    R = np.column_stack([*new[1:], np.cross(*new[1:])]) @ np.linalg.inv(np.column_stack([*old[1:], np.cross(*old[1:])]))
    return build_pose(new[0] - R @ old[0], R)


def swing(old: Array, new: Array, before: Array, after: Array) -> Array:
    """The displacement that takes a point to another and a direction by the shortest turn to another."""
    axis = np.cross(before, after)
    sine = float(np.linalg.norm(axis))
    R = rotate_about_axis(axis / sine, float(np.arctan2(sine, before @ after))) if sine > 1e-12 else np.eye(3)
    return build_pose(new - R @ old, R)


def displaced(robot: Mechanism, by: Mapping[str, Array]) -> Poses:
    return {name: by.get(name, np.eye(4)) @ link.pose for name, link in robot.links.items()}


def reached(
    rng: np.random.Generator, draw: Callable[[np.random.Generator], Poses | None], number: int = 1
) -> list[Poses]:
    """So many random configurations that close; raises ``NoCase`` where they are rare."""
    found = list(islice((at for _ in range(200) if (at := draw(rng)) is not None), number))
    if len(found) < number:
        raise NoCase
    return found


def crossing(
    rng: np.random.Generator,
    draw: Callable[[np.random.Generator], Array],
    at: Callable[[Array], Poses | None],
    value: Callable[[Array], float],
) -> Poses:
    """A configuration at which a value vanishes, between two of other signs; raises ``NoCase``."""
    known = [(x, value(x)) for x in (draw(rng) for _ in range(300)) if at(x) is not None]
    for (one, before), (other, after) in combinations(known, 2):
        if before * after < 0 and all(at(one + s * (other - one)) is not None for s in np.linspace(0, 1, 9)):
            way = other - one
            s = brentq(lambda s, one=one, way=way: value(one + s * way), 0, 1, xtol=1e-15, rtol=1e-15)
            return at(one + s * (other - one))  # type: ignore[return-value]
    raise NoCase


class Delta:
    """R-{2-SS} legs, sides parallel to the base axes; a configuration is the platform's displacement (3,)."""

    def __init__(self, rng: np.random.Generator, legs: int = 3) -> None:
        self.robot = deltas(["R"] * legs, ["2-SS"] * legs, rng, True)
        joints = self.robot.joints
        self.legs = range(1, legs + 1)
        self.hinge = {k: joints[f"motor_joint_{k}"] for k in self.legs}
        self.ends = {
            k: [(joints[f"elbow_{k}{x}"].point, joints[f"wrist_{k}{x}"].point) for x in "ab"] for k in self.legs
        }

    def arm(self, k: int) -> Array:
        """The radius of the circle of a rod's elbow at zero."""
        a, r = self.hinge[k].axis, self.ends[k][0][0] - self.hinge[k].point
        return np.asarray(r - (a @ r) * a)

    def rod(self, k: int, turned: float, p: Array) -> Array:
        """The rod's vector where an arm has turned and the platform is displaced."""
        (W, B), D = self.ends[k][0], turn(self.hinge[k].axis, turned, self.hinge[k].point)
        return np.asarray(B + p - D[:3, :3] @ W - D[:3, 3])

    def side(self, k: int) -> Array:
        return np.asarray(self.ends[k][1][0] - self.ends[k][0][0])

    def angle(self, k: int, p: Array) -> float | None:
        """The arm's turn, in the working mode of zero; None out of reach."""
        (W, B), (a, r) = self.ends[k][0], (self.hinge[k].axis, self.arm(k))
        z, s = B + p - (W - r), np.cross(a, r)
        C = (z @ z + r @ r - (B - W) @ (B - W)) / 2
        size, phase = float(np.hypot(z @ r, z @ s)), float(np.arctan2(z @ s, z @ r))
        if abs(C) > 0.999 * size:
            return None
        sign = -np.sign((B - W) @ s)  # of the angle beyond the phase
        return phase + float(sign * np.arccos(C / size))

    def at(self, p: Array, known: Mapping[int, float] | None = None) -> Poses | None:
        by = {"platform": build_pose(p)}
        for k in self.legs:
            angle = (known or {}).get(k) if k in (known or {}) else self.angle(k, p)
            if angle is None:
                return None
            by[f"arm_{k}"] = D = turn(self.hinge[k].axis, angle, self.hinge[k].point)
            for x, (W, B) in zip("ab", self.ends[k], strict=True):
                new = D[:3, :3] @ W + D[:3, 3]
                by[f"rod_{k}{x}"] = swing(W, new, normalise_vector(B - W), normalise_vector(B + p - new))
        return displaced(self.robot, by)

    def drawn(self, rng: np.random.Generator) -> Array:
        return rng.uniform(-0.6, 0.6, 3)

    def random(self, rng: np.random.Generator) -> Poses | None:
        return self.at(self.drawn(rng) / 3)

    def along(
        self, rng: np.random.Generator, angles: Mapping[int, float], direction: Callable[[], Array]
    ) -> Poses | None:
        """The first of some legs at these angles, its rod along a direction."""
        k = next(iter(angles))
        W, B = self.ends[k][0]
        D = turn(self.hinge[k].axis, angles[k], self.hinge[k].point)
        p = D[:3, :3] @ W + D[:3, 3] + np.linalg.norm(B - W) * direction() - B
        return self.at(p, {k: angles[k]})

    def flat(self, rng: np.random.Generator) -> Poses | None:
        """Leg 1's arm a quarter turn from zero."""
        W, B = self.ends[1][0]
        return self.along(
            rng,
            {1: rng.choice([-1, 1]) * np.pi / 2},
            lambda: normalise_vector(normalise_vector(B - W) + rng.normal(size=3)),
        )

    def stretched(self, rng: np.random.Generator) -> Poses | None:
        """The rod of leg 3 in the plane of its arm and base axis."""
        a, angle, side = self.hinge[3].axis, rng.uniform(-1.5, 1.5), rng.uniform(0, 2 * np.pi)
        r = rotate_about_axis(a, angle) @ normalise_vector(self.arm(3))
        return self.along(rng, {3: angle}, lambda: np.cos(side) * r + np.sin(side) * a)

    def lost(self, rng: np.random.Generator) -> Poses | None:
        """Legs 1 and 2 with parallel tangents: a translation is lost, whatever the third does."""
        n = np.cross(self.hinge[1].axis, self.hinge[2].axis)
        angles = {}
        for k in (1, 2):
            a, r = self.hinge[k].axis, self.arm(k)
            wanted = np.cross(n, a)
            angles[k] = float(np.arctan2(np.cross(r, wanted) @ a, r @ wanted))
            if abs(angles[k]) > np.pi / 2:
                angles[k] -= np.sign(angles[k]) * np.pi
        (c, x), (d, y) = ((self.rod(k, angles[k], np.zeros(3)), self.ends[k][0]) for k in (1, 2))
        # p with |p + c| and |p + d| the rods' lengths
        l1, l2 = ((e[1] - e[0]) @ (e[1] - e[0]) for e in (x, y))
        w = d - c
        along = (l2 - l1 - w @ w) / (2 * np.linalg.norm(w))
        if along**2 > l1:
            return None
        start = find_perpendicular(normalise_vector(w))
        v = along * normalise_vector(w) + np.sqrt(l1 - along**2) * (
            rotate_about_axis(normalise_vector(w), rng.uniform(0, 2 * np.pi)) @ start
        )
        return self.at(v - c, angles)

    def direction(self, k: int, p: Array) -> Array | None:
        """u of a leg; None out of reach."""
        angle = self.angle(k, p)
        return None if angle is None else normalise_vector(self.rod(k, angle, p))

    def couples(self, p: Array) -> float:
        """det of the couples that the three pairs of rods transmit: zero where the platform can turn."""
        u = {k: self.direction(k, p) for k in self.legs}
        return float(np.linalg.det([normalise_vector(np.cross(self.side(k), u[k])) for k in self.legs]))

    def released(self, rng: np.random.Generator) -> Poses | None:
        """Legs 1 and 2, their ends changed, no longer keep the platform from turning, leg 3 does: the couples of their
        rods, along side × u, and the moments of the U at their ends, along u less its part along their outer axes, are
        normal to the axis of the turn. So the axis says what u is."""
        hidden = simplified(ObservedRobot.of(self.robot, ("1", "2"), samples=3)).state
        outer = {chain.leg: hidden.mechanism.joints[chain.actuator].axes[0] for chain in hidden.chains}

        def ends(x: Array) -> Array:
            """Where legs 1 and 2 have the platform with arms at x[:2], if it is to turn about x[2:]."""
            found = []
            for k in (1, 2):
                W, B = self.ends[k][0]
                D, o = turn(self.hinge[k].axis, x[k - 1], self.hinge[k].point), outer[str(k)]
                u = np.cross(np.cross(x[2:], self.side(k)), x[2:] - (x[2:] @ o) * o)
                found.append(
                    D[:3, :3] @ W + D[:3, 3] + np.linalg.norm(B - W) * np.sign(u @ (B - W)) * normalise_vector(u) - B
                )
            return np.array(found)

        for _ in range(10):
            start = np.r_[rng.uniform(-1, 1, 2), random_direction(rng)]
            x = least_squares(
                lambda x: ends(x)[0] - ends(x)[1], start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60
            ).x
            one, other = ends(x)
            if np.linalg.norm(one - other) < 1e-14 and (at := self.at(one, {1: x[0], 2: x[1]})) is not None:
                return at
        raise NoCase


def delta(rng: np.random.Generator, observe: tuple[str, ...], kind: str) -> Case:
    own = Delta(rng)
    fails = crossing(rng, own.drawn, own.at, own.couples) if kind == "couples" else reached(rng, getattr(own, kind))[0]
    return Case(own.robot, observe, (*reached(rng, own.random, 3), *reached(rng, own.lost)), fails)


def plane(v: Array) -> Array:
    return np.append(v, 0.0)


def bend(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def between(one: Array, other: Array) -> float:
    return float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))


class Planar:
    """Three legs in the plane z = 0, RRR, or of which the first is ΠRR or ΠPR; a configuration is the platform's
    (x, y, angle), relative to zero."""

    def __init__(self, rng: np.random.Generator, first: str = "RRR") -> None:
        start = rng.uniform(0, 2 * np.pi, 2)
        angles = 2 * np.pi * np.arange(3) / 3 + rng.uniform(-0.3, 0.3, (2, 3))
        self.words = (first, "RRR", "RRR")
        self.foot = [rng.uniform(0.9, 1.1) * bend(start[0] + x)[:, 0] for x in angles[0]]
        self.tip = [rng.uniform(0.25, 0.4) * bend(start[0] + x)[:, 0] for x in angles[1]]
        self.crank, self.rod = [], []
        for foot, tip in zip(self.foot, self.tip, strict=True):
            middle = (foot + tip) / 2 + rng.choice([-1, 1]) * rng.uniform(0.3, 0.5) * bend(np.pi / 2) @ (tip - foot)
            self.crank.append(middle - foot)
            self.rod.append(tip - middle)
        self.beside = rng.uniform(0.2, 0.4) * bend(rng.uniform(0, 2 * np.pi))[:, 0]
        builder, z = Builder(f"planar_{first}"), (0, 0, 1)
        builder.link("base")
        builder.link("platform")
        for k, word in enumerate(self.words):
            C, A, B = self.foot[k], self.foot[k] + self.crank[k], self.tip[k]
            n, before = str(k + 1), f"crank_{k + 1}"
            builder.link(before, plane(C))
            builder.joint(f"base_{n}", "R", "base", before, plane(C), axis=z, motor=True)
            if word[0] == "Π":
                builder.link("coupler", plane(A))
                builder.link("second", plane(C + self.beside))
                builder.joint("coupling", "R", before, "coupler", plane(A), axis=z)
                builder.joint("base_second", "R", "base", "second", plane(C + self.beside), axis=z)
                builder.joint("coupling_second", "R", "second", "coupler", plane(A + self.beside), axis=z, loop=True)
                before = "coupler"
            builder.link(f"rod_{n}", plane(A))
            builder.joint(
                f"elbow_{n}", word[1], before, f"rod_{n}", plane(A), axis=z if word[1] == "R" else plane(self.rod[k])
            )
            builder.joint(f"wrist_{n}", "R", f"rod_{n}", "platform", plane(B), axis=z, loop=k > 0)
            builder.observe(n, f"rod_{n}", plane(self.rod[k]))
        self.robot = builder.build(platform="platform")

    def drawn(self, rng: np.random.Generator) -> Array:
        return rng.uniform(-0.4, 0.4, 3)

    def random(self, rng: np.random.Generator) -> Poses | None:
        return self.at(self.drawn(rng) / 2)

    def leg(self, k: int, x: Array) -> tuple[Array, Array] | None:
        """Crank and rod, in the working mode of zero; None out of reach."""
        w = x[:2] + bend(x[2]) @ self.tip[k] - self.foot[k]
        c, d = self.crank[k], self.rod[k]
        if self.words[k][1] == "P":
            u = d / np.linalg.norm(d)
            square = (w @ u) ** 2 - w @ w + c @ c
            if square < 1e-3:
                return None
            s = w @ u - np.sign(c @ u) * np.sqrt(square)
            return w - s * u, s * u
        size = float(np.linalg.norm(w))
        along = (size**2 + c @ c - d @ d) / (2 * size)
        square = c @ c - along**2
        if square < 1e-3:
            return None
        found = along * w / size + np.sign(c[1] * d[0] - c[0] * d[1]) * np.sqrt(square) * bend(np.pi / 2) @ w / size
        return found, w - found

    def at(self, x: Array, known: Mapping[int, tuple[Array, Array]] | None = None) -> Poses | None:
        by = {"platform": build_pose(plane(x[:2]), rotate_about_axis(np.array([0, 0, 1.0]), x[2]))}
        for k in range(3):
            legs = (known or {}).get(k) or self.leg(k, x)
            if legs is None:
                return None
            (c, d), n, z = legs, k + 1, np.array([0, 0, 1.0])
            by[f"crank_{n}"] = turn(z, between(self.crank[k], c), plane(self.foot[k]))
            shift = build_pose(plane(c - self.crank[k]))
            if self.words[k][0] == "Π":
                by["coupler"] = shift
                by["second"] = turn(z, between(self.crank[k], c), plane(self.foot[k] + self.beside))
            if self.words[k][1] == "P":
                by[f"rod_{n}"] = shift @ build_pose(plane(d - self.rod[k]))
            else:
                by[f"rod_{n}"] = shift @ turn(z, between(self.rod[k], d), plane(self.foot[k] + self.crank[k]))
        return displaced(self.robot, by)

    def along(self, rng: np.random.Generator, k: int, c: Array, d: Array) -> Poses | None:
        """Leg k with this crank and rod."""
        angle = rng.uniform(-0.5, 0.5)
        return self.at(np.append(self.foot[k] + c + d - bend(angle) @ self.tip[k], angle), {k: (c, d)})

    def rod_of(self, rng: np.random.Generator, k: int) -> Array:
        return (
            self.rod[k] * rng.uniform(0.8, 1.2) if self.words[k][1] == "P" else bend(rng.uniform(-1, 1)) @ self.rod[k]
        )

    def flat(self, rng: np.random.Generator) -> Poses | None:
        """Leg 1's crank a quarter turn from zero."""
        return self.along(rng, 0, bend(rng.choice([-1, 1]) * np.pi / 2) @ self.crank[0], self.rod_of(rng, 0))

    def flat_loop(self, rng: np.random.Generator) -> Poses | None:
        """Leg 1's own parallelogram flat."""
        c = rng.choice([-1, 1]) * np.linalg.norm(self.crank[0]) * normalise_vector(self.beside)
        return self.along(rng, 0, c, self.rod_of(rng, 0))

    def stretched(self, rng: np.random.Generator) -> Poses | None:
        """Leg 3 stretched."""
        c = bend(rng.uniform(-1, 1)) @ self.crank[2]
        return self.along(rng, 2, c, normalise_vector(c) * np.linalg.norm(self.rod[2]))

    def normals(self, x: Array) -> float:
        """det of the lines through the tips along the cranks: zero where they meet in a point."""
        rows = []
        for k in range(3):
            leg = self.leg(k, x)
            assert leg is not None
            c, B = leg[0], bend(x[2]) @ self.tip[k] + x[:2]
            rows.append([*c, B[0] * c[1] - B[1] * c[0]])
        return float(np.linalg.det(rows))


def planar(rng: np.random.Generator, observe: tuple[str, ...], kind: str, first: str = "RRR") -> Case:
    own = Planar(rng, first)
    holds, fails = reached(rng, own.random, 3), reached(rng, getattr(own, kind))[0]
    if first != "ΠPR" and len(observe) == 3:
        holds.append(crossing(rng, own.drawn, own.at, own.normals))
    return Case(own.robot, observe, tuple(holds), fails)


class Pod:
    """UPS or SPS legs; a configuration is the platform's displacement as (shift, rotation vector), (6,)."""

    def __init__(self, rng: np.random.Generator, word: str) -> None:
        self.robot = pods([word] * 6, rng, True)
        joints = self.robot.joints
        self.word, self.legs = word, range(1, 7)
        self.foot = {k: joints[f"foot_{k}"] for k in self.legs}
        self.tip = {k: joints[f"tip_{k}"].point for k in self.legs}

    def drawn(self, rng: np.random.Generator) -> Array:
        return rng.uniform(-0.4, 0.4, 6)

    def random(self, rng: np.random.Generator) -> Poses | None:
        return self.at(self.drawn(rng))

    def moved(self, x: Array) -> Array:
        angle = float(np.linalg.norm(x[3:]))
        return turn(x[3:] / angle, angle, self.robot.links["platform"].pose[:3, 3]) @ build_pose(x[:3])

    def at(self, x: Array, spun: Mapping[int, float] | None = None) -> Poses | None:
        by = {"platform": self.moved(x)}
        for k in self.legs:
            A, B = self.foot[k].point, self.tip[k]
            new = by["platform"][:3, :3] @ B + by["platform"][:3, 3]
            before, u = normalise_vector(B - A), normalise_vector(new - A)
            if self.word[0] == "S":
                by[f"lower_{k}"] = swing(A, A, before, u)
            else:
                first, inner = self.foot[k].axes
                if spun and k in spun:  # u is along the first axis: the U turns about it freely
                    second = rotate_about_axis(first, spun[k]) @ find_perpendicular(first)
                else:
                    second = normalise_vector(np.cross(first, u)) * np.sign(np.cross(first, before) @ inner)
                by[f"lower_{k}"] = carry((A, inner, before), (A, second, u))
            D = by[f"lower_{k}"]
            by[f"upper_{k}"] = build_pose(new - (D[:3, :3] @ B + D[:3, 3])) @ D
        return displaced(self.robot, by)

    def pointing(self, rng: np.random.Generator, k: int, direction: Array) -> Array:
        """A pose at which leg k is along a direction."""
        x = self.drawn(rng)
        now = self.moved(x)[:3, :3] @ self.tip[k] + self.moved(x)[:3, 3]
        R = self.moved(x)[:3, :3]
        wanted = self.foot[k].point + rng.uniform(0.8, 1.5) * direction
        return np.r_[x[:3] + R.T @ (wanted - now), x[3:]]

    def planes(self, x: Array) -> float:
        """The determinant of the speeds of tips 1 to 3 along their legs."""
        D = self.moved(x)
        B = [D[:3, :3] @ self.tip[k] + D[:3, 3] for k in (1, 2, 3)]
        u = [normalise_vector(B[k - 1] - self.foot[k].point) for k in (1, 2, 3)]
        b = [B[(i + 1) % 3] - B[i] for i in range(3)]
        return float(np.prod([u[i] @ b[i] for i in range(3)]) - np.prod([u[(i + 1) % 3] @ b[i] for i in range(3)]))


def pod(rng: np.random.Generator, kind: str) -> Case:
    own = Pod(rng, "SPS" if kind == "pole" else "UPS")
    holds = [*reached(rng, own.random, 3), crossing(rng, own.drawn, own.at, own.planes)]
    observe = ("1", "2", "3")
    if kind == "pole":  # leg 1 along e₁, which only the lift says
        setup = ObservedRobot.of(own.robot, observe, samples=3)
        chain = lifted(setup).chains[0]
        e = lifted(setup).mechanism.joints[chain.actuator].axis
        fails = own.at(own.pointing(rng, 1, e * np.sign(e @ chain.direction)))
    else:  # the removed leg 4 along the first axis of its U
        e = own.foot[4].axes[0]
        fails = own.at(
            own.pointing(rng, 4, e * np.sign(e @ (own.tip[4] - own.foot[4].point))), {4: rng.uniform(0, 2 * np.pi)}
        )
    assert fails is not None
    return Case(own.robot, observe, tuple(holds), fails)


def upu(rng: np.random.Generator) -> Case:
    """Three UPU legs, built where u of leg 1 lies in the plane of the axes of its U, and moved away from there."""
    builder = Builder("upu")
    builder.link("base")
    builder.link("platform", (0, 0, 1))
    for k in (1, 2, 3):
        angle = 2 * np.pi * k / 3 + rng.uniform(-0.3, 0.3)
        A, B = (r * np.array([np.cos(angle), np.sin(angle), 0]) + [0, 0, h] for r, h in ((1, 0), (0.6, 1)))
        u = normalise_vector(B - A)
        inner, above = rng.normal(size=3), rng.normal(size=3)
        inner = normalise_vector(inner)
        first = normalise_vector(u - (u @ inner) * inner) if k == 1 else random_normal(rng, inner)
        builder.link(f"lower_{k}", A)
        builder.link(f"upper_{k}", B)
        builder.joint(f"foot_{k}", "U", "base", f"lower_{k}", A, axis=first, axis2=inner)
        builder.joint(f"slide_{k}", "P", f"lower_{k}", f"upper_{k}", A, axis=u, motor=True)
        builder.joint(
            f"tip_{k}",
            "U",
            f"upper_{k}",
            "platform",
            B,
            axis=normalise_vector(above),
            axis2=random_normal(rng, normalise_vector(above)),
            loop=k > 1,
        )
        builder.observe(str(k), f"upper_{k}", u)
    special = builder.build(platform="platform")
    model = PinocchioModel(special)
    robot = set_zero(walked(model, int(rng.integers(1 << 30)), 3, 0.15))
    holds = []
    for seed in range(3):
        at = walked(PinocchioModel(robot), seed, 3, 0.1)
        holds.append({name: at.pose(name) for name in robot.links})
    return Case(robot, ("1",), tuple(holds), {name: link.pose for name, link in special.links.items()})


# --- the lift and the simplified robot at a configuration of the real one --------------------------------------------


def stand(state: State, real: Mechanism, at: Poses) -> Array:
    """The state of a rewritten mechanism (reference: the base) where the real robot's links are at these poses: T
    follows A, virtual joints point along u, cranks turn with the arm."""
    mechanism, found = state.mechanism, dict(at)
    moved = {name: at[name] @ invert_pose(link.pose) for name, link in real.links.items()}
    for chain in state.chains:
        D, joint = moved[chain.link], mechanism.joints[chain.actuator]
        A, u = D[:3, :3] @ chain.anchor + D[:3, 3], D[:3, :3] @ chain.direction
        shift = A - chain.anchor
        if chain.carrier not in at:
            found[chain.carrier] = build_pose(shift) @ mechanism.links[chain.carrier].pose
        gone = np.zeros(3)
        for name, link in zip(chain.sliders, chain.slider_links, strict=False):
            axis = mechanism.joints[name].axis
            gone = gone + (axis @ shift) * axis
            found[link] = build_pose(gone) @ mechanism.links[link].pose
        if chain.bearing or chain.spins:
            turned = carry((chain.anchor, joint.axis, chain.direction), (A, joint.axis, u))
            if joint.type is JointType.UNIVERSAL:
                first, second = joint.axes
                side = np.cross(first, chain.direction)
                now = np.cross(first, u)
                now = now if np.linalg.norm(now) > 1e-9 else D[:3, :3] @ side - (first @ D[:3, :3] @ side) * first
                sign = np.sign(side @ second)
                turned = carry((chain.anchor, second, chain.direction), (A, sign * normalise_vector(now), u))
            place_spinning(state, found, chain, turned)
    for name, body in mechanism.links.items():
        if name not in found:  # a crank: it turns as the arm to which T's anchor belongs
            chain = next(each for each in state.chains if each.leg == state.owners[name])
            arm = next(j for j in real.joints.values() if j.successor == chain.before)
            base = next(j for j in mechanism.joints_of(name) if mechanism.reference in j.links)
            R = moved[str(chain.before)][:3, :3]
            assert np.allclose(R @ arm.axis, arm.axis)
            found[name] = build_pose(base.point - R @ base.point, R) @ body.pose
    return np.array([found[name] for name in mechanism.links])


def place_spinning(state: State, found: Poses, chain: VirtualChain, turned: Array) -> None:
    """W, or the observed link itself with what slides along it and the rods beside it, turned about u as U̲ says."""
    mechanism, own = state.mechanism, state.real.leg(chain.leg).links
    if chain.bearing:
        found[chain.bearing] = turned @ mechanism.links[chain.bearing].pose
        return
    spin = turned @ mechanism.links[chain.link].pose @ invert_pose(found[chain.link])
    for joint in mechanism.joints.values():
        rod = joint.successor
        if joint.type is JointType.PRISMATIC and chain.link in joint.links:
            found[joint.other(chain.link)] = spin @ found[joint.other(chain.link)]
        elif joint.predecessor == chain.carrier and rod in own and rod != chain.link:
            at = found[rod] @ invert_pose(mechanism.links[rod].pose)
            point, R = at[:3, :3] @ joint.point + at[:3, 3], spin[:3, :3]
            found[rod] = build_pose(point - R @ point, R) @ found[rod]
    found[chain.link] = spin @ found[chain.link]


@dataclass(frozen=True)
class Seen:
    """What a robot can do at a configuration: ρ, the part of it with what drives the robot at rest, and in how many
    ways what drives it moves while t and u̇ rest."""

    relation: Array
    lost: Array
    loose: int = 0


def null(matrix: Array) -> Array:
    """An orthonormal basis of the kernel (columns, nullity); raises ``Undecided``."""
    _, values, right = np.linalg.svd(np.vstack([matrix, np.zeros((matrix.shape[1],) * 2)]))
    rank, gap = split_rank(values, matrix.shape[1])
    if gap < GAP:
        raise Undecided(gap)
    return np.asarray(right[rank:].T)


def seen(robot: Mechanism, state: Array, setup: ObservedRobot, chains: State | None = None) -> Seen:
    """Of the real robot, which its directions drive (``chains`` None), or of one that its virtual motors drive."""
    oracle, observation_model, length = Oracle(robot), setup.samples.observation_model, setup.samples.model.length
    assert oracle.error(state) < CLOSED
    kernel, gap = oracle.kernel(state)
    if gap < GAP:
        raise Undecided(gap)
    kernel = kernel / np.linalg.norm(kernel, axis=0)
    t = oracle.twist(kernel, observation_model.platform)
    rates = [
        -hat(oracle.pose(state, o.link)[:3, :3] @ o.direction) @ oracle.twist(kernel, o.link)[3:]
        if o.link in robot.links
        else np.zeros((3, kernel.shape[1]))
        for o in observation_model.observations
        if isinstance(o, Direction)
    ]
    rows = np.vstack([t[:3] / length, t[3:], *rates])
    drives = [robot.joints[name] for name in sorted(chains.actuators)] if chains else []
    moved = np.vstack(
        rates
        if chains is None
        else [oracle.twist(kernel, j.successor)[3:] - oracle.twist(kernel, j.predecessor)[3:] for j in drives]
    )
    return Seen(span(rows), span(rows @ null(moved)), span(moved @ null(rows)).shape[1])


def apart(one: Seen, other: Seen) -> float:
    """The larger angle between two spaces of two robots; a right angle where one's drive is loose."""
    loose = 0.0 if one.loose == other.loose else np.pi / 2
    return max(same_relation(one.relation, other.relation), same_relation(one.lost, other.lost), loose)


# --- the conditions ---------------------------------------------------------------------------------------------------


def full_loops(setup: ObservedRobot, hidden: State, at: Poses) -> bool:
    """Whether the real robot has the mobility that it has at its samples."""
    real = setup.mechanism
    return Oracle(real).mobility(np.array([at[n] for n in real.links])) == setup.mobility.total


def out_of_plane(setup: ObservedRobot, hidden: State, at: Poses) -> bool:
    """Whether no u lies in the plane of the axes of its U̲, or along that of its R̲."""
    state = dict(zip(hidden.mechanism.links, stand(hidden, setup.mechanism, at), strict=True))
    for chain in hidden.chains:
        joint, real = hidden.mechanism.joints[chain.actuator], setup.mechanism.links[chain.link]
        u = at[chain.link][:3, :3] @ real.pose[:3, :3].T @ chain.direction
        axes = [joint.axes[0]]
        for axis in joint.axes[1:]:
            own = hidden.mechanism.links[joint.successor].pose
            axes.append(state[joint.successor][:3, :3] @ own[:3, :3].T @ axis)
        if np.linalg.svd(np.array([*axes, u]))[1][-1] < 1e-6:
            return False
    return True


def not_flat(setup: ObservedRobot, hidden: State, at: Poses) -> bool:
    """Whether in each new parallelogram the cranks are not along the line of their feet."""
    mechanism = hidden.mechanism
    state = dict(zip(mechanism.links, stand(hidden, setup.mechanism, at), strict=True))
    for chain in hidden.chains:
        feet, crank = [], np.zeros(3)
        for joint in mechanism.joints_of(chain.carrier):
            link = joint.other(chain.carrier)
            for base in mechanism.joints_of(link):
                if mechanism.base in base.links and base.type is JointType.REVOLUTE and link != chain.link:
                    D = state[link] @ invert_pose(mechanism.links[link].pose)
                    radius = joint.point - base.point
                    crank = D[:3, :3] @ (radius - (radius @ base.axis) * base.axis)
                    feet.append(base.point - (base.point @ base.axis) * base.axis)
        if (
            len(feet) == 2
            and np.linalg.norm(np.cross(normalise_vector(feet[1] - feet[0]), normalise_vector(crank))) < 1e-6
        ):
            return False
    return True


def spanned(setup: ObservedRobot, hidden: State, at: Poses) -> bool:
    """Whether each removed leg, by itself, allows the platform all that the rest allows it."""
    real, length = setup.mechanism, setup.samples.model.length
    rest = Oracle(hidden.mechanism)
    state = stand(hidden, real, at)
    allowed = rest.twist(rest.kernel(state)[0], real.platform)
    for label in hidden.removed:
        leg = setup.decomposition.leg(label)
        part = Mechanism.of(
            "leg",
            [real.links[n] for n in real.links if n in {*leg.links, real.base, leg.platform_link}],
            [real.joints[n] for n in leg.joints],
            base=real.base,
            platform=leg.platform_link,
        )
        alone = Oracle(part)
        own = alone.twist(alone.kernel(np.array([at[n] for n in part.links]))[0], leg.platform_link)
        scale = np.repeat([1 / length, 1.0], 3)[:, None]
        one, other = span(scale * own), span(scale * allowed)
        if np.linalg.norm(other - one @ (one.T @ other)) > RELATION_ANGLE_TOL:
            return False
    return True


CONDITIONS = {
    LOOPS: full_loops,
    AXES: out_of_plane,
    pi_form.RULE.keeps[0]: not_flat,
    leg_removal.RULE.keeps[0]: spanned,
}
"""Each condition in words, and whether it holds for a hidden robot where the real one's links are at some poses."""


# --- the law ---------------------------------------------------------------------------------------------------------

ALL = ("1", "2", "3")
KINDS: dict[str, tuple[str, Callable[[np.random.Generator], Case]]] = {
    "parallelogram flat, Delta": ("pi form", partial(delta, observe=ALL, kind="flat")),
    "parallelogram flat, 3-RRR": ("pi form", partial(planar, observe=ALL, kind="flat")),
    "removed leg stretched, Delta": ("leg removal", partial(delta, observe=ALL[:2], kind="stretched")),
    "removed leg stretched, 3-RRR": ("leg removal", partial(planar, observe=ALL[:2], kind="stretched")),
    "removed leg along the first axis of its U": ("leg removal", partial(pod, kind="removed")),
    "the rest lets the platform turn": ("leg removal", partial(delta, observe=ALL[:2], kind="released")),
    "platform can turn": ("end change", partial(delta, observe=ALL[:2], kind="couples")),
    "own parallelogram flat, ΠRR": ("centre locus", partial(planar, observe=ALL, kind="flat_loop", first="ΠRR")),
    "own parallelogram flat, ΠPR": ("direction locus", partial(planar, observe=ALL, kind="flat_loop", first="ΠPR")),
    "u in the plane of K's axes": ("prismatic merge", upu),
    "u along e₁": ("lift", partial(pod, kind="pole")),
}
"""What fails, the rule whose condition that is, and robots with such a configuration."""


MEMBERS = [(kind, seed) for seed in range(19) for kind in KINDS][:200]


def derived_case(kind: str, seed: int) -> tuple[Case, ObservedRobot, RewriteTrace]:
    """The first random robot of a kind that has the configurations, and for which the rule is accepted."""
    rng, (rule, make) = np.random.default_rng(seed), KINDS[kind]
    for _ in range(200):
        try:
            case = make(rng)
        except NoCase:
            continue
        setup = ObservedRobot.of(case.robot, case.observe, samples=3)
        found = simplified(setup)
        if any(step.rule == rule and step.accepted for step in found.steps):
            return case, setup, found
    raise AssertionError("no robot of this kind")


@pytest.mark.some(4, 22)
@pytest.mark.parametrize(("kind", "seed"), MEMBERS)
def test_the_relation_is_kept_where_the_conditions_hold(kind: str, seed: int) -> None:
    """The lift is the real robot at each configuration but where u is along e₁, the simplified robot where all that
    its rules ask for holds; where a rule's condition fails, it differs."""
    case, setup, found = derived_case(kind, seed)
    real, lift, hidden = setup.mechanism, lifted(setup), found.state
    asked = {each for step in found.steps if step.accepted for each in step.keeps}

    def at(poses: Poses) -> list[float]:
        """How far lift and simplified robot are from the real one."""
        ours = seen(real, np.array([poses[name] for name in real.links]), setup)
        return [apart(ours, seen(other.mechanism, stand(other, real, poses), setup, other)) for other in (lift, hidden)]

    for poses in case.holds:
        assert all(CONDITIONS[each](setup, hidden, poses) for each in asked)
        assert max(at(poses)) < RELATION_ANGLE_TOL
    (rule,) = (each for each in list_rules() if each.name == KINDS[kind][0])
    assert not all(CONDITIONS[each](setup, hidden, case.fails) for each in rule.keeps)
    one, other = at(case.fails)
    assert (one > DIFFERENT) if rule.name == "lift" else (one < RELATION_ANGLE_TOL)
    assert other > DIFFERENT
