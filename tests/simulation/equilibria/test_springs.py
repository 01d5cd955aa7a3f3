"""Rests of a free platform on three watched rods that slide, as equilibria of springs: of random rods they are the
poses at which the slope of the error, written by hand, vanishes; boxes of a chart hold those that starts meet there,
and no other."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hrsynth.closed_forms.legs import OnCrank
from hrsynth.present.text.equilibria import _complete
from hrsynth.simulation.equilibria.equilibrium import CompletenessReport
from hrsynth.simulation.equilibria.exhaustive_search import SubdivisionResult, _same, cover
from hrsynth.simulation.equilibria.pose_error import NotEnclosed, PoseError
from hrsynth.simulation.equilibria.spring_error import SpringError, SpringSubdivision
from hrsynth.simulation.equilibria.subdivision import CriticalBox, forms_of
from simulation import scenes

LEGS, ROBOTS, STARTS = ("1", "3", "5"), 12, 1000


def of_robot():
    """The error of the Gough-Stewart platform with three legs watched."""
    return PoseError.of(scenes.setting("gough_stewart", LEGS), scenes.goal("gough_stewart"))


def random_error(seed):
    """That of three rods between random points, to a random goal."""
    rng, error = np.random.default_rng(seed), of_robot()
    limbs = [
        replace(limb, centre=rng.normal(size=3), tip=replace(limb.tip, turned=rng.normal(size=3)))
        for limb in error.subchains
    ]
    return replace(error, limbs=tuple(limbs), p=rng.normal(size=3), R=turned(rng.normal(size=3)))


def geometry(error):
    """Base points, points of the platform, desired directions (3, 3), by hand."""
    limbs = [error.subchains[each.limb] for each in error.seen]
    a, b = np.array([each.centre for each in limbs]), np.array([each.tip.turned for each in limbs])
    rods = error.p + b @ error.R.T - a
    return a, b, rods / np.linalg.norm(rods, axis=1)[:, None]


def slope(error, p, R):
    """The rates of E = ½ Σ (1 − c²) by the platform's velocity and its angular velocity, the cosines c, the forces."""
    a, b, wanted = geometry(error)
    arms = b @ R.T
    rods = p + arms - a
    size = np.linalg.norm(rods, axis=1)[:, None]
    u = rods / size
    c = np.sum(u * wanted, axis=1)[:, None]
    forces = c * (wanted - c * u) / size
    return -np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)]), c[:, 0], forces


def turned(w):
    """The rotation by a vector (3)."""
    angle = np.linalg.norm(w)
    if angle < 1e-300:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def met_by_hand(error, rng, starts, far=4.0):
    """Poses at which the slope vanishes, and no watched direction is at right angles to the desired one, that Newton's
    method meets from random poses."""
    found = []
    for _ in range(starts):
        p, R = rng.normal(size=3) * far, turned(2 * rng.normal(size=3))
        for _ in range(60):
            g = slope(error, p, R)[0]
            J = np.empty((6, 6))
            for k in range(6):
                step = 1e-6 * np.eye(6)[k]
                J[:, k] = (
                    slope(error, p + step[:3], turned(step[3:]) @ R)[0]
                    - slope(error, p - step[:3], turned(-step[3:]) @ R)[0]
                ) / 2e-6
            try:
                move = np.linalg.solve(J, -g)
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(move).all():
                break
            move *= min(1.0, 0.5 / max(float(np.abs(move).max()), 1e-300))
            p, R = p + move[:3], turned(move[3:]) @ R
            if np.abs(move).max() < 1e-11:
                g, c, _ = slope(error, p, R)
                if (
                    np.abs(g).max() < 1e-13
                    and np.abs(c).min() > 1e-3
                    and np.abs(p).max() < 30
                    and np.linalg.matrix_rank(J, tol=1e-6 * np.abs(J).max()) == 6
                ):
                    found.append((p, R))
                break
    kept = []
    for p, R in found:
        if all(np.abs(p - q).max() + np.abs(R - S).max() > 1e-6 for q, S in kept):
            kept.append((p, R))
    return kept


def coordinates(error, p, R):
    """The chart in which a pose's plane is, and its coordinates there, by hand."""
    a, b, _ = geometry(error)
    points = p + b @ R.T
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    m = normal / normal[np.abs(normal).argmax()]
    one = int(np.abs(m).argmax())
    d, n = float(m @ points[0]), m / np.linalg.norm(m)
    chart = next(
        each
        for each in SpringError.about(error).charts
        if each.one == one and each.distant == (abs(d) > 2) and each.side == np.sign(normal @ m)
    )
    c = slope(error, p, R)[1]
    t = c / np.linalg.norm(points - a, axis=1)
    alpha = np.arctan(t * d if chart.distant else t)
    # the axes of the plane: e_k turned by the shortest way from that of ``one`` to n
    axis = np.cross(np.eye(3)[one], n)
    size = np.linalg.norm(axis)
    turn = turned(axis * (np.arctan2(size, n[one]) / max(size, 1e-300)))
    side = (points[1] - points[0]) @ turn
    psi = np.arctan2(side[(one + 2) % 3], side[(one + 1) % 3])
    return chart, np.array([*np.delete(m, one), 1 / d if chart.distant else d, *alpha, psi])


@pytest.mark.some(1, 2)
@pytest.mark.parametrize("seed", range(ROBOTS))
def test_at_each_rest_the_springs_balance(seed: int) -> None:
    """Of random rods: at each pose that is met by hand all equations vanish, and they tell the same pose."""
    error, rng, met = random_error(seed), np.random.default_rng(seed), []
    while len(met) < 2:
        met += met_by_hand(error, rng, 20)
    for p, R in met:
        chart, y = coordinates(error, p, R)
        forms = forms_of(y[None], 0 * y[None])
        left = np.concatenate([chart.closing.together(forms).v[0, 0], chart.left.together(forms).v[0, 0]])
        assert np.abs(left).max() < 1e-7 * max(1.0, float(np.abs(p).max())) ** 2
        sub = SpringSubdivision(chart, *chart.box(y, y, 1.0))
        ((over, told, _),) = sub.over_pose(y[None])
        q, turn = over.pose(told.together(forms).v[0])
        assert np.abs(turn[0] - R).max() < 1e-6
        assert np.abs(q[0] - p).max() < 1e-6 * max(1.0, float(np.abs(p).max()))


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("seed", range(ROBOTS))
def test_where_the_springs_balance_the_error_has_no_slope(seed: int) -> None:
    """Of random rods: where the equations vanish, but where a direction is at right angles to the desired one or a rod
    has no length, so does the slope written by hand."""
    error, rng, count = random_error(seed), np.random.default_rng(seed), 0
    chart = SpringError.about(error).charts[seed]
    low, high = chart.box(np.zeros(3), np.zeros(3), 1.0)
    y = rng.uniform(low, high, (3 * STARTS, 7))
    for _ in range(30):
        forms = forms_of(y, 0 * y)
        F = np.concatenate([chart.closing.together(forms).v[0], chart.left.together(forms).v[0]], axis=1)
        J = chart.bends.together(forms).v[0].reshape(len(y), -1, 7)
        good = np.isfinite(J).all(axis=(1, 2)) & np.isfinite(F).all(axis=1)
        y, F, J = y[good], F[good], J[good]
        move = (np.linalg.pinv(J) @ -F[..., None])[..., 0]
        y = y + move * np.minimum(1.0, 0.5 / np.maximum(np.abs(move).max(axis=1), 1e-300))[:, None]
    y = y[
        (np.abs(F).max(axis=1) < 1e-10)
        & (np.abs(np.cos(y[:, 3:6])).min(axis=1) > 1e-3)
        & ((np.abs(y[:, 2]) > 1e-2) | (not chart.distant))
    ]
    for over, told, own in SpringSubdivision(chart, low, high).over_pose(y):
        for p, R in zip(*over.pose(told.together(forms_of(y[own], 0 * y[own])).v[0]), strict=True):
            g, c, _ = slope(error, p, R)
            if np.abs(c).min() > 1e-3:
                count += 1
                assert np.abs(g).max() < 1e-7
    assert count > 1


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_boxes_of_a_chart_hold_what_is_met_there_and_no_more(side: float) -> None:
    """Of the Gough-Stewart platform with three legs watched: in the planes far above or below the base, boxes are left
    open nowhere, and prove the poses that Newton's method meets, and no other."""
    error = of_robot()
    chart = next(
        each for each in SpringError.about(error).charts if each.one == 2 and each.distant and each.side == side
    )
    part = SpringSubdivision(chart, *chart.box(np.zeros(3), np.zeros(3), 1.0))
    part.run(8_000_000)
    own = [(each.p / error.length, each.R) for each in part.zeros()]
    assert not part.left
    assert not part.lost
    met = []
    for p, R in met_by_hand(error, np.random.default_rng(3), STARTS):
        at, _ = coordinates(error, p, R)
        if (at.one, at.distant, at.side) == (2, True, side):
            met.append((p, R))
    assert own

    def held(pose, poses):
        far = max(1.0, float(np.abs(pose[0]).max()))
        return any(np.abs(pose[0] - p).max() < 1e-5 * far and np.abs(pose[1] - R).max() < 1e-5 for p, R in poses)

    assert all(held(each, own) for each in met)
    for p, R in own:
        assert np.abs(slope(error, p, R)[0]).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("rod", "rests", "boxes"), [(0.5, 1, 0), (0.2, 0, 0), (0.3, 0, 1)])
def test_rests_that_a_leg_does_not_reach_are_left_out(rod: float, rests: int, boxes: int) -> None:
    """The goal of the Gough-Stewart platform, a leg that is not watched being a crank with a rod, which lies within its
    reach, beyond it, or stretched; that is left open."""
    error = of_robot()
    idle = next(i for i in range(len(error.subchains)) if i not in {each.limb for each in error.seen})
    tip = error.subchains[idle].tip
    place = error.p + error.R @ tip.turned
    crank = OnCrank("", tip, centre=place - [0.5, 0.0, 0.0], axis=np.array([0.0, 0.0, 1.0]), radius=0.2, rod=rod)
    limbs = [crank if i == idle else limb for i, limb in enumerate(error.subchains)]
    chart, y = coordinates(replace(error, limbs=tuple(limbs)), error.p, error.R)
    part = SpringSubdivision(chart, y - 0.001, y + 0.0012)
    part.run(1000)
    assert not part.left
    assert (len(part.zeros()), len(part.left)) == (rests, boxes)


@pytest.mark.slow
def test_rests_half_a_turn_apart_are_two() -> None:
    """Two balls lie on an axis through the platform's point, the third rod meets it at right angles: half a turn about
    it from the goal is another mode, with the same point and the same directions but for signs."""
    error, boxes = random_error(3), list[CriticalBox]()
    limbs, R = list(error.subchains), error.R
    for each, arm in zip(error.seen, ([0.3, 0.0, 0.0], [-0.4, 0.0, 0.0], [0.1, 0.5, 0.0]), strict=True):
        limb = limbs[each.limb]
        limbs[each.limb] = replace(
            limb,
            tip=replace(limb.tip, turned=np.array(arm)),
            centre=error.p + R @ [0.1, 1.3, 0.0] if arm[1] else limb.centre,
        )
    error = replace(error, limbs=tuple(limbs))
    for turn in (np.eye(3), np.diag([1.0, -1.0, -1.0])):
        chart, y = coordinates(error, error.p, R @ turn)
        part = SpringSubdivision(chart, y - 2e-4, y + 2.3e-4)
        part.run(60_000)
        boxes += part.zeros()
        assert not part.left
    assert len(boxes) == 2
    assert [[_same(one, other, SpringError.about(error)) for one in boxes] for other in boxes] == [
        [True, False],
        [False, True],
    ]


def test_words_except_legs_without_a_length() -> None:
    """Where rests are those of springs, legs that are not watched may be telescopic ones."""
    told = CompletenessReport(SubdivisionResult((), (), 0.0, 10, True, loop=SpringError.about(of_robot())), (), 0, None)
    found: Any = SimpleNamespace(cover=told, setting=scenes.setting("gough_stewart", ("1", "3", "5")))
    assert "leg 2 or 4 or 6 is stretched or has length zero, or an observed direction is" in _complete(found)[0]


def test_a_zero_may_be_another_than_that_of_a_box() -> None:
    """No rest is proved where the zero of a box may lie farther away than the one that is proved to exist."""
    error = of_robot()
    chart, y = coordinates(error, error.p, error.R)
    part = SpringSubdivision(chart, y - 1, y + 1)
    assert part._exist(y[None], np.full((1, 7), 1e-9)).all()
    assert not part._exist(y[None], np.full((1, 7), 1e-4)).any()


def test_other_watched_legs_are_refused() -> None:
    """Four rods that slide, or three whose desired directions lie in a plane."""
    at = scenes.goal("gough_stewart")
    with pytest.raises(NotEnclosed, match="not three rods"):
        SpringError.about(PoseError.of(scenes.setting("gough_stewart", ("1", "2", "3", "5")), at))
    error = of_robot()
    first = error.subchains[error.seen[0].limb]
    same = [
        replace(limb, centre=first.centre, tip=first.tip) if i == error.seen[1].limb else limb
        for i, limb in enumerate(error.subchains)
    ]
    with pytest.raises(NotEnclosed, match="plane"):
        SpringError.about(replace(error, limbs=tuple(same)))


@pytest.mark.long
def test_no_other_rest_is_met_by_hand() -> None:
    """All charts: boxes prove all rests of the Gough-Stewart platform with three legs watched, but where a direction is
    at right angles to the desired one; Newton's method meets no other."""
    error = of_robot()
    found = cover(scenes.setting("gough_stewart", LEGS), scenes.goal("gough_stewart"), budget=80_000_000)
    assert found.complete
    assert not found.locked
    for p, R in met_by_hand(error, np.random.default_rng(4), STARTS):
        far = max(1.0, float(np.abs(p).max()))
        assert any(
            np.abs(each.p / error.length - p).max() < 1e-5 * far and np.abs(each.R - R).max() < 1e-5
            for each in found.found
        )
