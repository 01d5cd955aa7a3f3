"""Modes of a rigid platform from conditions on its pose: as many as a search finds, and as the known ways list."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hrsynth.analysis.loci.tips import derive_tip_loci
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.condition_modes import build_posed_platforms, solve_posed
from hrsynth.analysis.modes.mode_search import search
from hrsynth.analysis.modes.modes import modes
from hrsynth.analysis.modes.tip_systems import solve_all
from hrsynth.analysis.pose_requests import observe
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.constraints.pattern import list_leg_ends
from hrsynth.geometry.vectors import compare_poses
from hrsynth.solving.platform.pose_bound import _Quotient, bound, compute_dimensions
from hrsynth.solving.platform.pose_conditions import (
    AtAngle,
    Coplanar,
    OnCylinder,
    OnMovingPlane,
    OnMovingRevolution,
    OnPlane,
    OnRevolution,
    OnTwoCircles,
)
from hrsynth.solving.platform.pose_forms import Poses, SquareForms
from strategies import spherical

SAME = 1e-6
"""Poses that differ by less are one (characteristic lengths, entries of the rotations)."""


def measured(word, legs, seed=0):
    """Some legs of a word watched, or its motors (no legs)."""
    setup = observe(build_mechanism(parse(word), seed), samples=4)
    if not legs:
        return MeasuredRobot.of(setup, real=True)
    seen = tuple(o for o in setup.segments if o.leg in legs)
    return MeasuredRobot.of(replace(setup, observed=seen))


def distance(one, other, length):
    """Between two lists of poses: the farthest of the first from the second."""
    return max((min((compare_poses(X, Y, length) for Y in other), default=np.inf) for X in one), default=0.0)


KINDS = [
    ("(Cr-Pz*-S)+(Rt*-Pl-S)+(S-Pl*-Rt)+2(Utn-Pl*-S)", "34", 16),  # a cone, a line, an angle
    ("(Ph*-Rz-Rz)+(Rz*!-Rz-Ph)+(Rz*!-Rz-Rz)", "123", 6),  # in a plane: a line of the platform, a line, a circle
    ("3(Ra-Ph*-Ra!-Ra)", "123", 8),  # three quadrics of revolution, no turns
    ("3(Ra*-Ra!-Ra-Ph)", "123", 8),  # three oblique cylinders
    ("3(Ro-Ro*!-Ro-Ro)", "123", 64),  # two branches a leg, eight turns about one point for each choice
    ("3(Ra*-Rb!-Rb-Ph-Ra)", "123", 1),  # two branches a leg, at one choice of which all fit
]
SLOW = [
    ("3(Ra*-Ra-Rb!-Rb-Rb)", "123", 64),  # sums of two circles
    ("3(Cr-Pz*-S)+2(Utn-Pl*-Unt)", "45", 8),  # lines and angles
    ("(Cr-Pz*-S)+(Pr*-Pz-S)+(S-Pl*-S)+2(Utn-Pl*-Unt)", "13", 24),  # axes in planes with their legs
    ("(Cr*-Pz-S)+(Pr*-Pz-S)+2(S-Pl*-Rt)+2(Utn-Pl*-S)", "13", 24),  # cones of the platform
    ("(Cr-Pz*-S)+2(Rt*-Pl-S)+(S-Pl*-S)+2(Utn-Pl*-S)", "45", 32),  # cones
    ("2(Pk*-2SSt)+(Rt*-Utn-S)", "12", 8),  # pairs of rods
    ("3(Rz*!-Rz-Ph)", "123", 2),
    ("(Pz*-Rt-S)+(Rt*-Pk-S)+(S-Rt*-Rt)", "", 12),  # a line, a circle, a circle of the platform that holds a ball
]
"""Words, watched legs (none: the motors) and how many modes there are, complex ones too."""


@pytest.mark.some(1, 4)
@pytest.mark.parametrize(
    ("word", "legs", "count"), [*KINDS, *(pytest.param(*each, marks=pytest.mark.slow) for each in SLOW)]
)
def test_what_random_starts_find_is_listed(word, legs, count):
    robot = measured(word, legs)
    at = robot.setup.configurations[1]
    made, found = solve_posed(robot, at)
    assert (found.complex, found.complete) == (count, True)
    (body,) = list_leg_ends(robot.setup.decomposition)
    listed = [made.bodies(mode.q)[body] for mode in found.modes]
    met = [mode.bodies[body] for mode in search(at, robot.observation_model, (body,)).modes]
    assert distance(met, listed, at.model.length) < SAME
    assert distance([at.pose(body)], listed, at.model.length) < SAME


@pytest.mark.some(5)
@pytest.mark.parametrize(
    ("word", "legs"),
    [
        ("3(Utn-Pl*-S)", "123"),
        ("3(Rz*-Rz-Rz)", "123"),
        ("(Rz*-Pl-Rz)+2(Rz*-Rz-Rz)", "123"),
        ("3(Rt*-Pl-S)", "123"),
        ("(Ph*-Rz-Rz)+2(Rz*-Rz-Rz)", "123"),
    ],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_known_ways_list_the_same(word, legs, seed):
    robot = measured(word, legs, seed)
    at = robot.setup.configurations[1]
    made, known = solve_all(
        derive_tip_loci(robot.setup.decomposition, robot.observation_model, robot.pattern, at), near=False
    )
    other, found = solve_posed(robot, at)
    assert known.complete
    assert found.complete
    one, two = ([each.bodies(mode.q) for mode in listed.modes] for each, listed in ((made, known), (other, found)))
    (body,) = two[0]
    one, two = ([each[body] for each in listed] for listed in (one, two))
    assert (known.complex, len(one)) == (found.complex, len(two))
    assert max(distance(one, two, at.model.length), distance(two, one, at.model.length)) < SAME


def test_each_pose_is_within_its_radius_of_one_that_fits_all_legs():
    robot = measured(*KINDS[0][:2])
    at = robot.setup.configurations[1]
    (system,) = build_posed_platforms(robot, at)
    made, found = solve_posed(robot, at)
    (body,) = list_leg_ends(robot.setup.decomposition)
    home = np.linalg.inv(at.pose(body))
    for mode in found.modes:
        moved = made.bodies(mode.q)[body] @ home
        R = moved[:3, :3]
        p = ((R @ system.middle.origin + moved[:3, 3]) - system.middle.origin) / system.middle.size
        for c in system.conditions:
            point, arrow = p + R @ c.b, R @ c.c
            reach = np.linalg.norm(np.hstack(c.slopes(point, arrow, np.asarray)))
            assert abs(c.value(point, arrow, np.asarray)) <= 4.0 * (1.0 + reach) * (mode.radius + 1e-12)


def random_conditions(rng, kinds):
    """Conditions that the goal meets, with random numbers."""
    found = []
    for kind in kinds:
        b, c, o, a = rng.normal(size=(4, 3))
        c, a = c / np.linalg.norm(c), a / np.linalg.norm(a)
        f = rng.normal(size=3)
        y = b - o
        if kind is OnPlane:
            found.append(OnPlane("1", b, c, a, float(a @ b)))
        elif kind is AtAngle:
            found.append(AtAngle("1", b, c, a, float(a @ c)))
        elif kind is OnRevolution:
            z = float(a @ y)
            f[0] = y @ y - z * z - f[1] * z - f[2] * z * z
            found.append(OnRevolution("1", b, c, o, a, f))
        elif kind is OnMovingRevolution:
            z = float(-y @ c)
            f[0] = y @ y - z * z - f[1] * z - f[2] * z * z
            found.append(OnMovingRevolution("1", b, c, o, f))
        elif kind is OnMovingPlane:
            found.append(OnMovingPlane("1", b, c, o, float(-y @ c)))
        elif kind is OnCylinder:
            across = y - c * float(a @ y) / float(a @ c)
            found.append(OnCylinder("1", b, c, o, a, np.array(np.linalg.norm(across)), c))
        elif kind is OnTwoCircles:
            first = rng.normal(size=3)
            first, second = (np.cross(n, v) for n, v in ((a, first), (c, first + rng.normal(size=3))))
            radii = [np.array(np.linalg.norm(spoke)) for spoke in (first, second)]
            found.append(OnTwoCircles("1", b, c, b - first - second, a, radii[0], c, radii[1]))
        else:
            t = np.cross(y, c)  # any vector in the plane of y and c
            found.append(Coplanar("1", b, c, o, y + 0.5 * c + 0.0 * t))
    return found


@pytest.mark.parametrize(
    "kind", [OnPlane, AtAngle, OnRevolution, OnMovingRevolution, OnMovingPlane, Coplanar, OnCylinder, OnTwoCircles]
)
def test_slopes_are_the_derivatives(kind):
    rng = np.random.default_rng(3)
    (condition,) = random_conditions(rng, [kind])
    assert abs(condition.value(condition.b, condition.c, np.asarray)) < 1e-12
    x, d, step = *rng.normal(size=(2, 3)), 1e-6
    along, turned = condition.slopes(x, d, np.asarray)
    for k, e in enumerate(step * np.eye(3)):
        by_x = condition.value(x + e, d, np.asarray) - condition.value(x - e, d, np.asarray)
        by_d = condition.value(x, d + e, np.asarray) - condition.value(x, d - e, np.asarray)
        assert np.allclose([by_x, by_d], [2 * step * along[k], 2 * step * turned[k]], atol=1e-8)


THREE = [OnPlane] * 3


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("kinds", "count"),
    [
        (THREE + [OnPlane] * 3, 8),
        (THREE + [AtAngle] * 3, 8),
        (THREE + [OnPlane, OnPlane, OnRevolution], 16),
        (THREE + [OnPlane, Coplanar, Coplanar], 32),
    ],
)
def test_ranks_give_the_product_of_degrees_of_general_conditions(kinds, count):
    forms = SquareForms.of(random_conditions(np.random.default_rng(1), kinds), Poses.spatial())
    assert forms.most == count == bound(forms)[0]


@pytest.mark.some(2)
@pytest.mark.parametrize(
    "kinds",
    [
        THREE + [OnPlane] * 3,
        THREE + [AtAngle] * 3,
        THREE + [AtAngle, OnPlane, OnRevolution],
        [OnPlane, OnPlane, AtAngle, AtAngle, OnRevolution, OnPlane],
    ],
)
def test_ranks_modulo_one_condition_are_those_modulo_all(kinds, monkeypatch):
    """On points of a quadric, and on any: also where the forms are of too low a degree to give the zeros."""
    forms = SquareForms.of(random_conditions(np.random.default_rng(3), kinds), Poses.spatial())
    for t in (forms.degree - 2, forms.degree):
        assert _Quotient.of(forms, t) is not None
        most = min(2, t // 2 - 1)
        found = compute_dimensions(forms, t, most)
        with monkeypatch.context() as without:
            without.setattr(_Quotient, "of", lambda *asked: None)
            assert compute_dimensions(forms, t, most) == found


@pytest.mark.slow
def test_three_planes_and_three_spheres_have_forty():
    conditions = random_conditions(np.random.default_rng(2), THREE + [OnRevolution] * 3)
    spheres = [replace(c, f=np.array([(c.b - c.o) @ (c.b - c.o), 0.0, -1.0])) for c in conditions[3:]]
    forms = SquareForms.of([*conditions[:3], *spheres], Poses.spatial())
    assert (forms.most, bound(forms)[0]) == (64, 40)


def test_legs_that_are_not_watched_are_not_forgotten():
    """Three legs that let the platform translate alone, of which the watched one leaves it a freedom: the others, which
    are not watched, take it."""
    setup = observe(build_mechanism(parse("2(Rt*-Pl-S)+3(Utn-Pl*-Unt)")), ["1"], samples=4)
    found = modes(setup)
    assert found.found.continuous_family is None
    assert found.found.complete
    assert (found.found.complex, len(found.modes)) == (2, 2)
    assert found.within == "poses with the rotation of this one"


@pytest.mark.some(1)
@pytest.mark.parametrize("seed", [1, 0, 2])
def test_a_body_that_turns_about_a_point_has_eight_modes(seed: int):
    """Three legs RRR whose axes meet in one point, driven at the base: an axis of the platform keeps an angle to each
    elbow's axis, three quadrics of the quaternion."""
    found = modes(spherical(np.random.default_rng(seed)), real=True)
    assert (found.found.complete, found.found.complex) == (True, 8)
    others = search(
        found.goal, MeasuredRobot.of(found.setup, real=True).observation_model, list_leg_ends(found.setup.decomposition)
    )
    for mode in others.modes:
        assert (
            min(
                max(np.abs(X - each.bodies[body]).max() for body, X in mode.bodies.items())
                for each in found.modes
                if each.bodies
            )
            < 1e-6
        )


@pytest.mark.slow
@pytest.mark.some(1)
@pytest.mark.parametrize("legs", [None, "1,3"])
def test_a_body_that_turns_about_a_point_has_one_mode_where_its_rods_are_watched(legs: str | None):
    """Each leg's last axis keeps one of two directions."""
    for seed in range(3):
        found = modes(spherical(np.random.default_rng(seed)), legs)
        assert (found.found.complete, found.found.complex, len(found.modes)) == (True, 1, 1)
    others = search(
        found.goal, MeasuredRobot.of(found.setup).observation_model, list_leg_ends(found.setup.decomposition)
    )
    assert len(others.modes) == 1
