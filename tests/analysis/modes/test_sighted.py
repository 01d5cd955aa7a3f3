"""Modes for observations of any kind: as many as a Gröbner basis modulo a prime counts, and what searches find is
listed; a pose with the opposite value is none."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import hrsynth
from analysis.modes.counted import count
from analysis.modes.test_posed import distance
from analysis.modes.watched import free_body, watched, written
from analysis.test_sensors import arm
from hrsynth.analysis.loci.leg_conditions import OriginAndUnit
from hrsynth.analysis.loci.observation_loci import PlatformObservation, list_plane_conditions
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.modes.mode_search import search
from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import observe
from hrsynth.constraints.pattern import list_leg_ends
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.observations import list_kinds
from mechanism.test_kinds import far

PAGE = Path(__file__).parents[3] / "docs/pages/observations.md"
SAME = 1e-6
LISTED = [kind for kind in list_kinds().values() if kind.kind not in ("encoder", "image_circle")]
COUNTED = ("point", "line", "image_line", "distance", "depth", "position", "direction")


@cache
def table() -> dict[tuple[str, ...], tuple[int, int]]:
    """The rows of the page: kinds, and the modes by one camera and by one for each."""
    text = PAGE.read_text().split("<!-- counts -->")[1].split("<!-- end -->")[0]
    rows = re.findall(r"^\| (.*?) \| (\d+) \| (\d+) \|", text, re.MULTILINE)
    pairs = [([word.split() for word in words.split(", ")], int(one), int(each)) for words, one, each in rows]
    return {
        tuple(kind.strip("`") for number, kind in words for _ in range(int(number))): (one, each)
        for words, one, each in pairs
    }


OPEN = (("line", "distance", "distance"), True)
"""Whose modes are found, and not always proved to be all, as the page says."""
QUICK = [("point",) * 3, ("point", "point", "image_line"), ("point", "image_line", "image_line"), ("image_line",) * 3]


@pytest.mark.some(1)
@pytest.mark.parametrize("row", QUICK, ids=",".join)
def test_a_mixed_set_has_the_modes_that_the_page_tells(row: tuple[str, ...]) -> None:
    found = modes(watched(row, 7))
    assert (found.found.complex, found.found.complete) == (table()[row][0], True)
    assert count(row, 7) == table()[row][0]


@pytest.mark.slow
def test_a_free_body_without_a_proof_is_answered_too() -> None:
    row, cameras = OPEN
    found = modes(watched(row, 2, cameras))
    assert (len(found.modes), found.found.complete) == (2, False)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("cameras", [False, True])
def test_all_rows_of_the_page(seed: int, cameras: bool) -> None:
    assert len(table()) > 12
    for row, counts in table().items():
        found = modes(watched(row, seed, cameras))
        assert found.found.complex == counts[cameras], row
        assert found.found.complete or (row, cameras) == OPEN, row
        assert count(row, seed, cameras) == counts[cameras], row


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("kind", LISTED, ids=lambda kind: kind.kind)
def test_what_a_held_value_leaves_is_what_it_transmits(kind: type, back: bool) -> None:
    """The conditions on the pose have the wrenches' span as their rates, camera on the base or on the platform."""
    for seed in range(5):
        seen, X_c, X = far(np.random.default_rng(seed), kind)
        at = seen.sighting(X_c, X)  # type: ignore[attr-defined]
        wrenches = np.array(seen.wrenches(at), dtype=float)  # type: ignore[attr-defined]
        sight = PlatformObservation(seen, "l", seen.loci(at), back)  # type: ignore[attr-defined]
        for turned in (False, True):
            found = list_plane_conditions([sight], OriginAndUnit(np.zeros(3), 1.0), turned)
            assert max(abs(float(c.value(c.b, c.c, np.asarray))) for c in found) < 1e-9
            rates = np.array([c.rates for c in found])
            ranks = [np.linalg.matrix_rank(each, tol=1e-7) for each in (wrenches, rates, np.vstack([wrenches, rates]))]
            assert ranks == [seen.rank] * 3  # type: ignore[attr-defined]


def depths(points: Array, C: Array, starts: int = 2000) -> list[Array]:
    """All positive distances (3,) of points from a camera with the same angles between the rays: Newton's method on
    the cosine laws from random starts."""
    arms = points - C
    rays = arms / np.linalg.norm(arms, axis=1)[:, None]
    one, other = np.array([0, 1, 2]), np.array([1, 2, 0])
    cosines, squares = np.sum(rays[one] * rays[other], axis=1), np.sum((points[one] - points[other]) ** 2, axis=1)
    x = np.random.default_rng(0).uniform(0.0, 3.0, (starts, 3))
    for _ in range(80):
        u, v = x[:, one], x[:, other]
        J = np.zeros((starts, 3, 3))
        J[:, [0, 1, 2], one], J[:, [0, 1, 2], other] = 2 * (u - v * cosines), 2 * (v - u * cosines)
        step = np.einsum("nij,nj->ni", np.linalg.pinv(J), u * u + v * v - 2 * u * v * cosines - squares)
        x = x - step
    found = list[Array]()
    for each in x[(np.abs(step).max(axis=1) < 1e-12) & (x.min(axis=1) > 0)]:
        if all(np.abs(each - y).max() > 1e-6 for y in found):
            found.append(each)
    return found


def three_points(at: Array, seed: int) -> AssemblyModes:
    """Modes of a free body with points (3, 3) in its frame, by a camera at the base's origin."""
    sensor = [f"point:platform@{written(b)}" for b in at]
    return modes(observe(free_body(np.random.default_rng(seed)), camera="eye=base@0,0,0", sensor=sensor, samples=4))


@pytest.mark.some(1, 10)
@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 40))])
def test_three_points_have_eight_modes_of_which_at_most_four_are_in_front(seed: int) -> None:
    """In pairs, mirrored at the camera's centre; those in front are the solutions of the cosine laws."""
    rng = np.random.default_rng(100 + seed)
    at = np.round(
        rng.uniform(-0.5, 0.5, (3, 3))
        if seed
        else 0.7 * np.array([[1, 0, 0], [-0.5, 0.86, 0.02], [-0.52, -0.87, -0.01]]),
        6,
    )
    found = three_points(at, seed)
    points = [found.goal.pose("platform") @ [*b, 1.0] for b in at]
    assert (found.found.complex, found.found.complete) == (8, True)
    mirrored = [mode for mode in found.antipodal if len(mode.opposite) == 3]
    assert 1 <= len(found.modes) == len(mirrored) == len(depths(np.array(points)[:, :3], np.zeros(3))) <= 4
    assert all(mode.behind == mode.opposite == () for mode in found.modes)
    assert all(mode.behind == mode.opposite for mode in found.antipodal)


def test_all_four_can_be_in_front() -> None:
    """A camera nearly above the middle of a nearly regular triangle."""
    builder = np.random.default_rng(0)
    body = free_body(builder)
    X = body.links["platform"].pose
    corners = [(0.5 * np.cos(t), 0.5 * np.sin(t), 1.1 + 0.01 * np.sin(5 * t)) for t in (0.1, 2.2, 4.3)]
    sensor = ["point:platform@" + written(X[:3, :3].T @ (np.array(b) - X[:3, 3])) for b in corners]
    found = modes(observe(body, camera="eye=base@0.01,0.02,0", sensor=sensor, samples=4))
    assert (found.found.complex, len(found.modes), len(found.antipodal)) == (8, 4, 4)


@pytest.mark.slow
def test_four_points_leave_one_mode() -> None:
    found = modes(watched(("point",) * 4, 3))
    assert (len(found.modes), len(found.antipodal), found.found.complete) == (1, 0, True)
    assert found.modes[0].goal


GOUGH = ("point:platform@0.1,0,0", "point:platform@-0.1,0.1,0", "point:platform@0,0.1,0.1")
BASE = ("point:base@0.1,0,0", "point:base@-0.1,0.1,0", "point:base@0,0.1,0.1")
ROBOTS = {
    "seen from the base": lambda: observe("gough_stewart", camera="eye=base@0.3,0.1,0", sensor=GOUGH),
    "camera on the platform": lambda: observe("gough_stewart", camera="eye=platform@0.3,0.1,0", sensor=BASE),
    "cameras on both": lambda: observe(
        "gough_stewart",
        camera=["eye=base@0.3,0.1,0", "hand=platform@0.03,0.01,-0.1"],
        sensor=["eye=" + GOUGH[0], "hand=" + BASE[0], "eye=" + GOUGH[1]],
    ),
    "beside legs": lambda: observe("gough_stewart", "1,3", camera="eye=base@0.3,0.1,0", sensor=GOUGH[:1]),
    "beside legs, from the platform": lambda: observe(
        "gough_stewart", "1,3", camera="eye=platform@0.3,0.1,0", sensor=BASE[:1]
    ),
    "an arm": lambda: observe(arm(), camera="eye=platform@0.02,0.01,0.1", sensor=BASE),
    "translations": lambda: observe(
        "delta", camera="eye=platform@0.1,0.1,0.2", sensor=["point:base@0.1,0.3,0", "distance:base@0.3,0,0.2"]
    ),
    "a plane": lambda: observe(
        "3rrr_m1", camera="eye=platform@0.1,0.05,-0.3", sensor=["point:base@0.1,0.3,0", "distance:base@0.3,0,0.2"]
    ),
}
QUICKLY = ("a plane",)


@pytest.mark.some(1, 2)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICKLY else pytest.mark.slow) for name in ROBOTS]
)
def test_what_random_starts_of_the_whole_robot_find_is_listed(name: str) -> None:
    setup: ObservedRobot = ROBOTS[name]()
    found = modes(setup, at=setup.configurations[0])
    assert found.found.complete
    bodies = list_leg_ends(setup.decomposition)
    met = [mode.bodies[bodies[0]] for mode in search(found.goal, setup.samples.observation_model, bodies).modes]
    if found.within == "poses with the rotation of this one":  # others are not looked for, and a search meets them
        met = [X for X in met if np.abs(X[:3, :3] - found.goal.pose(bodies[0])[:3, :3]).max() < SAME]
    listed = [mode.bodies[bodies[0]] for mode in found.modes if mode.bodies is not None]
    assert distance(met, listed, found.goal.model.length) < SAME
    for mode in found.modes:
        if mode.configuration is not None:
            values = [
                o.value(
                    mode.configuration.pose(o.seen_from or setup.mechanism.reference), mode.configuration.pose(o.link)
                )
                for o in setup.observed
            ]
            held = [
                o.value(found.goal.pose(o.seen_from or setup.mechanism.reference), found.goal.pose(o.link))
                for o in setup.observed
            ]
            assert max(np.abs(a - b).max() for a, b in zip(values, held, strict=True)) < SAME


def test_a_leg_that_restricts_turns_counts_too() -> None:
    """A 3-RPS moves with three freedoms; its legs' planes are conditions beside what is seen."""
    setup = observe(
        "3rps", camera="eye=base@0.3,0.1,0", sensor=["point:platform@0.1,0,0", "distance:platform@-0.1,0.1,0"]
    )
    found = modes(setup, at=setup.configurations[0])
    assert (found.found.complex, found.found.complete) == (16, True)


def test_behind_the_camera_is_told_where_it_has_a_name() -> None:
    """A camera that looks the other way sees the same rays, none of them in front."""
    for turn, behind in (("", ()), ("/180deg,0,0", ("point_1", "point_2", "point_3"))):
        found = modes("gough_stewart", camera=f"eye=base@0.3,0.1,0{turn}", sensor=GOUGH)
        assert found.modes[0].behind == behind
        assert found.to_dict()["modes"][0]["behind"] == list(behind)
        block = hrsynth.text(found).split("mode 2")[0]
        assert ("in front of the camera" in block) == (not behind)
    assert modes("gough_stewart", sensor=GOUGH).modes[0].behind is None


def test_a_certificate_of_what_is_seen_is_accepted() -> None:
    found = modes("gough_stewart", camera="eye=platform@0.3,0.1,0", sensor=BASE)
    record = hrsynth.certificate(found)
    assert record["real"] == len(found.modes) + len(found.antipodal)
    assert hrsynth.verify(record)
    sensor = [*GOUGH[:2], "image_line:platform@0,0.1,0.1/1,0,0"]
    record = hrsynth.certificate(modes("gough_stewart", camera="eye=base@0.3,0.1,0", sensor=sensor))
    assert record["claim"] == "solutions"
    assert hrsynth.verify(record)


def refined(goal: Array, there: Array, C: Array) -> Array:
    """Where exactly the points are that are ``there`` (3, 3) at a mode and at ``goal`` at the pose itself, in the frame
    of the camera with its centre at C: on their rays, as far from each other, to 40 digits."""
    with mpmath.workdps(50):
        rays = [mpmath.matrix(list(map(mpmath.mpf, b))) - mpmath.matrix(list(map(mpmath.mpf, C))) for b in goal]
        pairs, points = [(0, 1), (1, 2), (2, 0)], [mpmath.matrix(list(map(mpmath.mpf, b))) for b in goal]

        def off(*x: Any) -> list[Any]:
            return [
                sum((x[i] * rays[i][k] - x[j] * rays[j][k]) ** 2 - (points[i][k] - points[j][k]) ** 2 for k in range(3))
                for i, j in pairs
            ]

        start = [float((there[k] - C) @ (goal[k] - C) / ((goal[k] - C) @ (goal[k] - C))) for k in range(3)]
        x = mpmath.findroot(off, start, tol=1e-80, maxsteps=60)
        return C + np.array([[float(x[i] * rays[i][k]) for k in range(3)] for i in range(3)])


@pytest.mark.parametrize("back", [False, True])
def test_the_exact_pose_is_within_the_radius(back: bool) -> None:
    """The places of the three points at each mode, by the cosine laws to 40 digits, are as near as the radius says."""
    camera, sensor = ("eye=platform@0.3,0.1,0", BASE) if back else ("eye=base@0.3,0.1,0", GOUGH)
    found = modes("gough_stewart", camera=camera, sensor=sensor)
    points = np.array([[float(x) for x in text.split("@")[1].split(",")] for text in sensor])
    C, X = np.array([0.3, 0.1, 0.0]), found.goal.pose("platform")
    assert len(found.modes) > 1
    for mode in (*found.modes, *found.antipodal):
        assert mode.bodies is not None

        def seen(Y: Array) -> Array:
            return (points - Y[:3, 3]) @ Y[:3, :3] if back else points @ Y[:3, :3].T + Y[:3, 3]

        there = seen(mode.bodies["platform"])
        exact = refined(seen(X), there, C)
        most = mode.shift + mode.turn * float(np.abs(points).max() * 2 + np.abs(there).max() * 2)
        assert mode.proved
        assert 0 < most < 1e-7
        assert np.linalg.norm(exact - there, axis=1).max() < most


def test_encoders_of_legs_are_held_with_the_legs() -> None:
    """What is asked by a name of its own is a leg's all the same; so is a point of a link that is platform and leg."""
    joint = next(joint.name for joint in hrsynth.load("3rrr_m1").joints.values() if joint.is_actuated)
    found = modes("3rrr_m1", sensor=[f"encoder:{joint}", "distance:platform@0.1,0.3,0", "distance:platform@0.3,0,0"])
    assert (found.found.complex, found.found.complete) == (4, True)  # circles about one centre: two shapes, two turns
    other = modes("rrrrr_m1", camera="eye=base@0.3,0.1,0.5", sensor="point:dist_1@0.1,0,0")
    assert (other.found.complete, len(other.modes)) == (True, 2)
    found = search(
        other.goal, MeasuredRobot.of(other.setup).observation_model, list_leg_ends(other.setup.decomposition)
    )
    assert len(found.modes) == 2


def test_motors_are_held_or_what_is_seen() -> None:
    with pytest.raises(BadRequest):
        modes("gough_stewart", sensor=GOUGH, real=True)
