"""Rests of two watched legs by the force that closes their loop: in a plane they are those of boxes over the pose; of
the Quattro no other is met on Lagrange's equations written by hand, and the kinds sum up to what the loop's shape asks
for. Of robots of random dimensions a list holds all that a thousand starts meet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.closed_forms.legs import OnCrank, OnRail
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.pose import parse_pose
from hrsynth.simulation.equilibria.equilibria import EquilibriumSearch
from hrsynth.simulation.equilibria.exhaustive_search import cover, reachable_box
from hrsynth.simulation.equilibria.joint_error import JointError
from hrsynth.simulation.equilibria.loop_error import LoopError, LoopSubdivision
from hrsynth.simulation.equilibria.pose_error import PoseError
from hrsynth.simulation.equilibria.subdivision import Subdivision
from simulation import scenes

STARTS = 1000


def subdivided(error, low, high, vanishing=False):
    """The zeros of boxes that all are settled."""
    low, high = error.box(low, high, 1.0)
    part = (
        LoopSubdivision(error, low, high)
        if isinstance(error, LoopError)
        else Subdivision(error, low, high, vanishing=vanishing)
    )
    part.run(1_000_000)
    zeros = part.zeros()
    assert not part.left
    assert not part.lost
    return zeros


def distinct(marks):
    """Which of places (n, k) are the first of their kind."""
    kept: list[int] = []
    for k, mark in enumerate(marks):
        if not np.any(np.abs(marks[kept] - mark).max(axis=1) < 1e-5):
            kept.append(k)
    return kept


def places(zeros, freedoms):
    """Positions and cosines and sines of angles, of critical boxes."""
    x = np.array([each.x for each in zeros])
    return np.concatenate([x[:, :freedoms], np.cos(x[:, freedoms:]), np.sin(x[:, freedoms:])], axis=1)


@pytest.mark.some(1)
@pytest.mark.parametrize("rail", [False, True])
def test_in_a_plane_they_are_the_rests_at_which_a_force_closes_the_loop(rail: bool) -> None:
    """Of a five-bar, and of one with a slider: where not every direction is along the desired one or at right angles
    to it, boxes over the pose and boxes over the force's direction list the same rests, of the same kinds."""
    error = PoseError.of(scenes.setting("rrrrr_m1"), scenes.goal("rrrrr_m1"))
    if rail:
        first = error.limbs[0]
        assert isinstance(first, OnCrank)
        tip = first.tip.value(error.p[None], error.R[None])
        end = first.solve(tip, first.mode)[1][0]
        slider = OnRail("slider", first.tip, 1.0, centre=end, axis=error.shifts @ [0.6, 0.8], rod=first.rod)
        mode = float(slider.modes(tip, end[None])[0])
        error = replace(error, limbs=(replace(slider, mode=mode), *error.limbs[1:]))
    low, high, bounded = reachable_box(error, 1.0)
    assert bounded
    over_pose = subdivided(JointError.of(error), low, high)
    wanted = LoopError.about(error).desired
    cosines = np.abs([[u @ w for u, w in zip(each.directions, wanted, strict=True)] for each in over_pose])
    forced = [
        each
        for each, c in zip(over_pose, cosines, strict=True)
        if np.minimum(c, np.sqrt(1 - np.minimum(c, 1.0) ** 2)).max() > 1e-6
    ]
    own = subdivided(LoopError.about(error), low, high)
    assert 4 < len(own) < len(over_pose)
    one, other = (places(each, 2) for each in (own, forced))
    assert len(distinct(one)) == len(own) == len(distinct(other))
    for each, mark in zip(own, one, strict=True):
        at = np.abs(other - mark).max(axis=1).argmin()
        assert np.abs(other[at] - mark).max() < 1e-7
        assert forced[at].falling == each.falling


ARM, ROD, BAR = 0.38, 0.825, 0.043
OUT = {
    "1": np.array([-1.0, -1.0, 0.0]),
    "2": np.array([1.0, -1.0, 0.0]),
    "3": np.array([1.0, 1.0, 0.0]),
    "4": np.array([-1.0, 1.0, 0.0]),
}
OUT = {leg: out / np.sqrt(2) for leg, out in OUT.items()}
PLATE = {leg: np.array([np.sign(out[0]) * 0.066, np.sign(out[1]) * 0.048, 0.0]) for leg, out in OUT.items()}
"""The Quattro as its file has it, in metres: where legs are, and their wrists on the plates at the ends of the bar."""


def arm(leg, q):
    """From the base's centre to the end of the arm, which turns down from straight outwards, (3, n)."""
    return (0.275 + ARM * np.cos(q)) * OUT[leg][:, None] - ARM * np.sin(q) * np.array([[0.0], [0.0], [1.0]])


def wrist(leg, phi):
    """From the middle of the bar to the wrist, (3, n)."""
    end = np.sign(OUT[leg][1]) * BAR
    return PLATE[leg][:, None] + end * np.array([-np.sin(phi), np.cos(phi), 0 * phi])


def reached(leg, tip):
    """Whether a leg reaches tips (3, n): its rod is longer than the shortest way to the arm's circle, and shorter than
    the longest."""
    away, aside = OUT[leg] @ tip - 0.275, np.cross(OUT[leg], [0.0, 0.0, 1.0]) @ tip
    far = np.hypot(away, tip[2])
    return ((far - ARM) ** 2 + aside**2 < ROD**2) & ((far + ARM) ** 2 + aside**2 > ROD**2)


def arms_at(leg, tip):
    """Both angles q at a tip (3)."""
    D = tip - 0.275 * OUT[leg]
    x, y, share = D @ OUT[leg], -D[2], (D @ D + ARM**2 - ROD**2) / (2 * ARM)
    turn = np.arccos(np.clip(share / np.hypot(x, y), -1.0, 1.0))
    return [np.arctan2(y, x) + sign * turn for sign in (1.0, -1.0)]


def gradient(y, legs, wanted):
    """The slope of Lagrange's function (14, n) by two arms, the bar's turn, two rods, and the multipliers of the loop
    and of the lengths of both."""
    q, rods, force, lengths = y[:3], (y[3:6], y[6:9]), y[9:12], y[12:]
    gap = wrist(legs[1], q[2]) - wrist(legs[0], q[2])
    quarter = np.pi / 2
    slope = [*np.zeros((9, 1)), *gap, *np.zeros((2, 1))]
    for k, (leg, u, sign) in enumerate(zip(legs, rods, (1.0, -1.0), strict=True)):
        f, rate = arm(leg, q[k]), arm(leg, q[k] + quarter) - 0.275 * OUT[leg][:, None]
        turn = wrist(leg, q[2] + quarter) - PLATE[leg][:, None]
        slope[k] = slope[k] + sign * (force * rate).sum(axis=0)
        slope[2] = slope[2] - sign * (force * turn).sum(axis=0)
        pull = -(wanted[k] @ u) * wanted[k][:, None] + sign * ROD * force + lengths[k] * u
        for i in range(3):
            slope[3 + 3 * k + i] = pull[i]
            slope[9 + i] = slope[9 + i] + sign * (f[i] + ROD * u[i])
        slope[12 + k] = ((u * u).sum(axis=0) - 1) / 2
    return np.array(slope)


def bent(formula, y):
    """The derivatives (n, k, k) of a formula of places (k, n), along imaginary steps."""
    found = []
    for k in range(len(y)):
        z = y.astype(complex)
        z[k] += 1e-20j
        found.append(formula(z).imag / 1e-20)
    return np.array(found).transpose(2, 1, 0)


def newton(formula, y, steps=60):
    """Zeros of a formula that damped steps meet from places (k, n)."""
    for _ in range(steps):
        f, J = formula(y), bent(formula, y)
        back = np.swapaxes(J, 1, 2)
        damping = 1e-14 + 1e-3 * np.minimum(1.0, (f**2).sum(axis=0))
        step = np.linalg.solve(back @ J + damping[:, None, None] * np.eye(len(y)), back @ f.T[..., None])[..., 0].T
        y = y - step / np.maximum(1.0, 2 * np.abs(step).max(axis=0))
    return y[:, np.abs(formula(y)).max(axis=0) < 1e-9]


def goal_directions(legs):
    """The directions of two rods at the goal, which is in the mode of the zero configuration, elbows outwards."""
    X = scenes.goal("quattro").pose("platform")
    phi = np.array([np.arctan2(X[1, 0], X[0, 0])])
    tips = [X[:3, 3] + wrist(leg, phi)[:, 0] for leg in legs]
    return [
        (tip - arm(leg, np.array([min(arms_at(leg, tip), key=abs)]))[:, 0]) / ROD
        for leg, tip in zip(legs, tips, strict=True)
    ]


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(("legs", "count"), [("14", 48), ("23", 44)])
def test_no_other_rest_is_met_by_hand(legs: str, count: int) -> None:
    """Lagrange's equations of the Quattro, written by hand, vanish at each rest of the list, and Newton's method on
    them meets no other that all legs reach, but where no force closes the loop."""
    found = cover(scenes.setting("quattro", tuple(legs)), scenes.goal("quattro"))
    assert found.is_complete
    wanted = goal_directions(legs)

    def slope(y):
        return gradient(y, legs, wanted)

    forced = [each for each in found.found if each.error[0] > 0]
    assert (len(forced), len(found.found)) == (count, count + 3)
    places = []
    for each in forced:
        turn = np.array([np.arctan2(each.R[1, 0], each.R[0, 0])])
        ends = [each.p + wrist(leg, turn)[:, 0] for leg in legs]
        q = [
            min(
                arms_at(leg, tip),
                key=lambda q, leg=leg, tip=tip, u=u: np.abs(tip - arm(leg, np.array([q]))[:, 0] - ROD * u).max(),
            )
            for leg, tip, u in zip(legs, ends, each.directions, strict=True)
        ]
        y = np.concatenate([q, turn, *each.directions, np.zeros(5)])[:, None]
        # the slope is linear in multipliers
        still, J = slope(y)[:, 0], bent(slope, y)[0]
        y[9:, 0] = np.linalg.lstsq(J[:9, 9:], -still[:9], rcond=None)[0]
        assert np.abs(slope(y)).max() < 1e-6
        places.append(np.concatenate([each.p, *each.directions, np.cos(turn), np.sin(turn)]))
    rng = np.random.default_rng(5)
    y = np.concatenate([rng.uniform(-np.pi, np.pi, (3, STARTS)), rng.normal(size=(11, STARTS))])
    y[3:9] /= np.repeat([np.linalg.norm(y[3:6], axis=0), np.linalg.norm(y[6:9], axis=0)], 3, axis=0)
    y = newton(slope, y)
    p = arm(legs[0], y[0]) + ROD * y[3:6] - wrist(legs[0], y[2])
    y, p = (
        each[
            :,
            np.all([reached(leg, p + wrist(leg, y[2])) for leg in OUT if leg not in legs], axis=0)
            & (np.linalg.norm(y[9:12], axis=0) > 1e-6),
        ]
        for each in (y, p)
    )
    met = np.concatenate([p, y[3:9], np.cos(y[2:3]), np.sin(y[2:3])]).T
    away = np.abs(met[:, None] - np.array(places)).max(axis=2)
    assert away.min(axis=1).max() < 1e-6
    assert len(set(away.argmin(axis=1))) > 0.8 * count


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    ("name", "at", "legs", "count", "square"),
    [
        ("delta", "x=0.061,y=-0.0337,z=-0.63", "12", 30, 3),
        ("quattro_rigid", scenes.GOALS["quattro_rigid"], "14", 28, 3),
    ],
)
def test_a_platform_that_translates_rests_also_across_one_direction(
    name: str, at: str, legs: str, count: int, square: int
) -> None:
    """Boxes and the search over all joints list the same rests while the other legs are not stretched, those among them
    at which one direction is along the desired one and the other at right angles."""
    setup = scenes.setting(name, tuple(legs))
    (goal,) = solve_configurations(setup, [parse_pose(at)])
    found = EquilibriumSearch.of(setup, goal).answer(0, complete=True)
    assert found.complete
    assert found.subdivision is not None
    assert (
        found.subdivision.orthogonal_directions,
        found.subdivision.only_proved,
        found.subdivision.only_found,
    ) == (2, (), 0)
    inside = [each for each in found.points if not each.boundary and len(each.orthogonal_legs) < 2]
    assert len(inside) == len(found.subdivision.result.found) == count
    across = [each for each in inside if each.orthogonal_legs]
    assert len(across) == square
    assert all(abs(each.error - 1) < 1e-9 for each in across)


@pytest.mark.long
@pytest.mark.parametrize("legs", ["14", "23"])
def test_kinds_sum_to_the_euler_number_of_the_loop(legs: str) -> None:
    """The loop of two legs alone is a circle of rods over each choice of arms and turn, or a sphere where the rods are
    parallel: its Euler number is twice the number of these places. E is flat on curves, which count nothing, and has
    its maxima on the surface on which both directions are at right angles to the desired ones: the kinds of the other
    rests sum to the difference. The surface's own Euler number is told by the critical points of another function."""
    whole = PoseError.of(scenes.setting("quattro", tuple(legs)), scenes.goal("quattro"))
    alone = replace(
        whole,
        limbs=tuple(whole.limbs[each.limb] for each in whole.seen),
        seen=tuple(replace(each, limb=k) for k, each in enumerate(whole.seen)),
    )
    low, high, _ = reachable_box(alone, 1.0)
    forced = subdivided(LoopError.about(alone), low, high)
    zeros = [each for each in subdivided(JointError.of(alone), low, high, vanishing=True) if each.error[0] == 0]
    zeros = [zeros[k] for k in distinct(places(zeros, 3))]
    kinds = sum((-1) ** each.falling for each in (*forced, *zeros))
    frames = [np.linalg.svd(u[None])[2][1:, :, None] * ROD for u in goal_directions(legs)]

    def gap(x):
        """Between both wrists, by the arms' angles and the bar's turn, and by the angles of rods at right angles."""
        one, two = ((arm(leg, x[k]) - wrist(leg, x[2])) for k, leg in enumerate(legs))
        if len(x) > 3:
            one, two = (
                each + np.cos(z) * frame[0] + np.sin(z) * frame[1]
                for each, z, frame in zip((one, two), x[3:], frames, strict=True)
            )
        return one - two

    rng = np.random.default_rng(7)
    weights, shifts = rng.normal(size=(5, 1)), rng.uniform(0, 6, (5, 1))

    def slope(y):
        """Of Σ a cos(x − b) on the surface; its rates are those of sines."""
        x, mu = y[:5], y[5:]
        rates = [gap(x + np.pi / 2 * each[:, None]) - gap(x - np.pi / 2 * each[:, None]) for each in np.eye(5)]
        return np.array([*(-weights * np.sin(x - shifts) + [(mu * each).sum(axis=0) / 2 for each in rates]), *gap(x)])

    y = np.concatenate([rng.uniform(-np.pi, np.pi, (5, 3 * STARTS)), 5 * rng.normal(size=(3, 3 * STARTS))])
    y = newton(slope, y, 80)
    y = y[:, distinct(np.concatenate([np.cos(y[:5]), np.sin(y[:5])]).T)]
    surface = -np.sign(np.linalg.det(bent(slope, y))).sum()
    x = newton(gap, rng.uniform(-np.pi, np.pi, (3, 1000)))
    parallel = len(distinct(np.concatenate([np.cos(x), np.sin(x)]).T))
    assert np.linalg.norm(gap(rng.uniform(-np.pi, np.pi, (3, 10_000))), axis=0).max() < 1.8 * ROD
    assert kinds == 2 * parallel - surface


CRANK, RAIL, SLIDE = ("R", "R"), ("P", "R"), ("R", "P")


def unit(v):
    return v / np.linalg.norm(v)


def spoke(z):
    return np.array([np.cos(z), np.sin(z)])


@dataclass
class DrawnLeg:
    """A leg in a plane to the origin, m: its foot, its crank's length or its rail's direction, its rod or how far that
    slides aside, and its rod's direction at zero."""

    kind: tuple[str, str]
    foot: Array
    own: Array
    rod: float
    u: Array

    @classmethod
    def draw(cls, rng: np.random.Generator) -> DrawnLeg:
        """One of random kind and dimensions."""
        (foot, end), u = rng.uniform(-0.8, 0.8, (2, 2)), unit(rng.normal(size=2))
        kind = (CRANK, RAIL, SLIDE)[rng.integers(3)]
        if kind == SLIDE:
            u = u if rng.integers(2) else unit(-foot)
            return cls(kind, foot, u, float(np.linalg.det([u, -foot])), u)
        foot, own = (end, u) if kind == RAIL else (foot, np.linalg.norm(end - foot))
        return cls(kind, foot, own, float(np.linalg.norm(end)), unit(-end))

    def build(self, b: Builder, name: str) -> None:
        """Add its first two joints."""
        links = ["base", f"near_{name}", f"far_{name}"]
        places = self.foot, 0.0 * self.u if self.kind == SLIDE else -self.rod * self.u
        for k, (letter, at) in enumerate(zip(self.kind, places, strict=True)):
            axis = (0, 0, 1) if letter == "R" else (*self.own, 0)
            b.link(links[k + 1])
            b.joint(f"{letter}{k}_{name}", letter, links[k], links[k + 1], (*at, 0), axis=axis, motor=k == 0)

    def end(self, z: Array, phi: Array) -> tuple[Array, Array, Array]:
        """Its end (2, n), and the rates by its first joint and by its rod's angle."""
        foot, u, across = self.foot[:, None], spoke(phi), spoke(phi + np.pi / 2)
        if self.kind == SLIDE:
            return foot + z * u + self.rod * across, u, z * across - self.rod * u
        if self.kind == RAIL:
            return foot + np.outer(self.own, z) + self.rod * u, self.own[:, None] + 0 * u, self.rod * across
        return foot + self.own * spoke(z) + self.rod * u, self.own * spoke(z + np.pi / 2), self.rod * across


def balance(y: Array, legs: list[DrawnLeg]) -> Array:
    """The slope (10, n) of Lagrange's function by the end of both legs, and by each leg's joint, its rod's angle and
    the multipliers of its closure."""
    whole, found = 0 * y[:2], list[Array]()
    for leg, (z, phi, *pull) in zip(legs, y[2:].reshape(2, 4, -1), strict=True):
        mu, (end, by_z, by_phi) = np.array(pull), leg.end(z, phi)
        whole = whole - mu
        error = -(leg.u @ spoke(phi)) * (leg.u @ spoke(phi + np.pi / 2))
        found += [(mu * by_z).sum(axis=0), (mu * by_phi).sum(axis=0) + error, *(end - y[:2])]
    return np.array([*whole, *found])


@pytest.mark.some(1, 3)
@pytest.mark.parametrize("seed", range(1, 21))
def test_random_starts_meet_no_other_rest_of_random_robots(seed: int) -> None:
    """Two legs in a plane, of random kinds and dimensions, share their end: Newton's method on Lagrange's equations,
    written by hand, meets from a thousand starts the listed rests and no other."""
    rng, b = np.random.default_rng(seed), Builder("drawn")
    b.link("base")
    legs = [DrawnLeg.draw(rng) for _ in "12"]
    for k, leg in enumerate(legs):
        leg.build(b, str(k))
    b.joint("end", "R", "far_0", "far_1", axis=(0, 0, 1), loop=True)
    setup = ObservedRobot.of(b.build(platform="far_0"))
    found = cover(setup, setup.all_samples.start)
    assert found.is_complete
    assert found.error is not None
    listed = np.array([[*each.p[:2], *each.directions[:, :2].ravel()] for each in found.found])
    y = newton(lambda y: balance(y, legs), 1.5 * rng.normal(size=(10, STARTS)))
    if found.box is not None:
        x = found.error.shifts[:2].T @ (y[:2] / found.error.length - found.error.p[:2, None])
        low, high = (each[:2, None] for each in found.box)
        y = y[:, np.all((low < x) & (x < high), axis=0)]
    lines = [o for o in setup.observed if isinstance(o, Direction)]
    senses = [np.sign(o.direction[:2] @ leg.u) for o, leg in zip(lines, legs, strict=True)]
    met = np.concatenate([y[:2], *(s * spoke(phi) for s, phi in zip(senses, y[3::4], strict=True))]).T
    away = np.abs(met[:, None] - listed).max(axis=2) / np.maximum(1.0, np.abs(met[:, :2]).max(axis=1))[:, None]
    assert away.min(axis=1).max() < 1e-5
    assert len(set(away.argmin(axis=1))) > 0.8 * len(listed)
