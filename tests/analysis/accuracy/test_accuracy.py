"""The error maxima: against a closed form, against Pinocchio's relation and a search, against true errors; requests."""

from __future__ import annotations

import math
import re
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from matplotlib.figure import Figure

from hrsynth.analysis.accuracy.accuracy import Accuracy, accuracy, errors_at, sees_all
from hrsynth.analysis.accuracy.error_map import Mapper
from hrsynth.analysis.accuracy.measurement_bounds import MeasurementBounds, half_angles
from hrsynth.analysis.accuracy.nonlinear_check import true_errors
from hrsynth.analysis.accuracy.pose_errors import _descend, _width, error_axes, largest_by_ascent, reading
from hrsynth.analysis.accuracy.singular_search import singular_poses
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.batch.pose_continuation import sweep
from hrsynth.description import load
from hrsynth.errors import BadRequest, HrsynthError, NoReachablePose, PoseNotReached
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism.pose import Grid
from hrsynth.present.maps import _error_entries, _locus
from hrsynth.present.plots import MapPlane
from hrsynth.present.show import text
from hrsynth.present.text import runs
from kinematics.robots import ROBOTS
from strategies import parallel_robots

CONE = math.radians(0.1)
ANGLES = np.array([-3, -1, 1, 3]) * math.pi / 4
"""θ_i of the Quattro, IROS IV-A."""
BASE, PLATE, PROXIMAL, DISTAL = 0.296, 0.102, 0.380, 0.825


def inverse_interaction(P: Array, legs: list[int]) -> Array:
    """M^{T+} (n, 3, 3 k) of the rigid Quattro at positions (n, 3) by MMT (B.5), (B.12) and (B.14), b_i with a minus."""
    blocks = []
    for leg in legs:
        x_i = np.array([math.cos(ANGLES[leg]), math.sin(ANGLES[leg]), 0.0])
        AC = P + (PLATE - BASE) * x_i
        x, z = AC @ x_i, AC[:, 2]
        alpha, beta = -2 * PROXIMAL * x, -2 * PROXIMAL * z
        gamma = np.sum(AC**2, axis=1) + PROXIMAL**2 - DISTAL**2
        root = np.sqrt(alpha**2 + beta**2 - gamma**2)
        q = np.stack([2 * np.arctan2(-beta + sign * root, gamma - alpha) for sign in (1, -1)])
        q = np.where(np.cos(q[0]) > np.cos(q[1]), q[0], q[1])
        level, up = x_i, np.array([0.0, 0.0, 1.0])
        u = (AC - PROXIMAL * (np.cos(q)[:, None] * level + np.sin(q)[:, None] * up)) / DISTAL
        v = -np.sin(q)[:, None] * level + np.cos(q)[:, None] * up
        slip = np.einsum("ni,nj->nij", v, u) / np.sum(u * v, axis=1)[:, None, None]
        blocks.append((np.eye(3) - slip) / DISTAL)
    return np.linalg.pinv(np.concatenate(blocks, axis=1))


def largest(J: Array, cones: Array) -> Array:
    """max over unit w of Σ ψ_i ‖J_iᵀ w‖ for J (n, 3, 3 k), by ascent from many starts."""
    A = J.reshape(len(J), 3, len(cones), 3).transpose(2, 0, 1, 3) * cones[:, None, None, None]
    squares = A @ A.transpose(0, 1, 3, 2)
    starts = np.array([w for w in np.ndindex(3, 3, 3) if w > (1, 1, 1)], dtype=float) - 1
    best, value = np.zeros((len(J), 3)), np.zeros(len(J))

    def climbed(w: Array, steps: int) -> tuple[Array, Array]:
        for _ in range(steps):
            pulls = np.einsum("knij,nj->kni", squares, w)
            sizes = np.sqrt(np.maximum(np.einsum("kni,ni->kn", pulls, w), 1e-300))
            w = np.sum(pulls / sizes[..., None], axis=0)
            w /= np.linalg.norm(w, axis=1, keepdims=True)
        return w, np.sqrt(np.maximum(np.einsum("knij,ni,nj->kn", squares, w, w), 0.0)).sum(axis=0)

    for start in starts:
        w, found = climbed(np.tile(start / np.linalg.norm(start), (len(J), 1)), 8)
        best, value = np.where((found > value)[:, None], w, best), np.maximum(found, value)
    return climbed(best, 250)[1]


@cache
def rigid(legs: str) -> Accuracy:
    return accuracy(load("quattro_rigid"), legs, cone=CONE, grid="x=-0.3:0.3:100,y=-0.29:0.31:100,z=-0.75")


@pytest.mark.some(1)
@pytest.mark.parametrize("legs", ["1,2", "1,3", "2,4"])
def test_a_map_is_the_closed_form(legs: str) -> None:
    field = rigid(legs).field
    assert field is not None
    assert field.reached.sum() == 10_000
    x, y = np.meshgrid(*(values for _, values in field.grid.axes), indexing="ij")
    P = np.stack([x.ravel(), y.ravel(), np.full(x.size, -0.75)], axis=1)
    J = inverse_interaction(P, [int(leg) - 1 for leg in legs.split(",")])
    expected = largest(J, np.full(2, CONE))
    assert np.max(np.abs(field.position.ravel() - expected) / expected) < 1e-9
    assert not field.orientation.any()
    assert field.spots is not None
    assert field.spots.count == 10
    assert field.spots.difference < 1e-8


def check_extents(setup: ObservedRobot, cones: Array) -> None:
    """The extremes are attained by the directions that are told, and no random errors in the cones do worse."""
    for at in setup.configurations[:2]:
        errors = errors_at(setup, MeasurementBounds(cones), at)
        rates, twists = reading(at, setup.samples.observation_model)
        inverse = np.linalg.pinv(rates, rcond=1e-7)
        rng = np.random.default_rng(1)
        tries = rng.normal(size=(400, len(cones), 3))
        tries *= cones[:, None] / np.linalg.norm(tries, axis=2, keepdims=True)
        for extent, part in ((errors.position, twists[:3]), (errors.orientation, twists[3:])):
            J = part @ inverse
            if extent.errors is None or extent.direction is None:
                continue
            assert np.all(np.linalg.norm(extent.errors, axis=1) <= cones * (1 + 1e-12))
            reached = float(np.linalg.norm(J @ extent.errors.ravel()))
            assert extent.largest * (1 - extent.gap) <= reached * (1 + 1e-7)
            assert reached <= extent.largest * (1 + 1e-7)
            sizes = np.linalg.norm(J @ tries.reshape(400, -1).T, axis=0)
            assert sizes.max() <= extent.largest * (1 + 1e-9)
            assert extent.least_direction is not None
            blocks = J.reshape(3, -1, 3).transpose(1, 2, 0)
            least = cones @ np.linalg.norm(blocks @ extent.least_direction, axis=1)
            assert least == pytest.approx(extent.least, rel=1e-9)
            span = np.linalg.svd(J)[0][:, : np.linalg.matrix_rank(J, tol=1e-9 * np.linalg.norm(J))]
            views = span @ rng.normal(size=(span.shape[1], 300))
            views /= np.linalg.norm(views, axis=0)
            widths = np.einsum("k,kn->n", cones, np.linalg.norm(blocks @ views, axis=1))
            assert extent.least <= widths.min() * (1 + 1e-9)
            assert widths.max() <= extent.largest * (1 + 1e-9)


@pytest.mark.some(3)
@pytest.mark.parametrize("robot", ROBOTS)
def test_extremes_are_attained_and_not_exceeded(robot: str) -> None:
    setup = ObservedRobot.of(load(robot), samples=3)
    cones = CONE * (1 + np.arange(len(setup.observed)) / 3)
    check_extents(setup, cones)


@pytest.mark.parametrize("cones", ["0.1deg", "1=0.1deg,2=0.2deg,3=0.1deg,4=0.3deg,5=0.1deg,6=0.1deg"])
def test_a_bound_that_may_be_too_large_is_told_to_be_one(cones: str) -> None:
    """Of six cones the text says how far each number may be above what the errors that are told attain."""
    found = accuracy("gough_stewart", cone=cones)
    lines = runs.accuracy(found).splitlines()
    rates, twists = reading(found.setup.all_samples.start, found.setup.samples.observation_model)
    J = twists @ np.linalg.pinv(rates, rcond=1e-7)
    for word, extent, rows in (
        ("position", found.poses[0].position, J[:3]),
        ("orientation", found.poses[0].orientation, J[3:]),
    ):
        assert extent.errors is not None
        over = extent.largest / float(np.linalg.norm(rows @ extent.errors.ravel())) - 1
        k = next(k for k, line in enumerate(lines) if line.startswith(word))
        told = re.search(r"an upper bound, at most (\S+) % too large", lines[k + 1])
        assert (told is not None) == (extent.gap > 1e-6)
        assert over <= (float(told[1]) / 100 if told else 1e-6) * (1 + 1e-9)


@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(parallel_robots())
@pytest.mark.slow
def test_extremes_of_random_robots(robot) -> None:
    try:
        setup = ObservedRobot.of(robot, samples=3)
    except HrsynthError:
        assume(False)
    check_extents(setup, np.full(len(setup.observed), CONE))


@pytest.mark.some(1)
@pytest.mark.parametrize("robot", ["quattro", "3rrr_m1", "gough_stewart", "orthoglide", "delta"])
def test_samples_approach_the_linear_maxima_as_cones_shrink(robot: str) -> None:
    setup = ObservedRobot.of(load(robot), samples=3)
    observation_model, start = setup.samples.observation_model, setup.all_samples.start
    away = []
    for cone in (2e-3, 1e-3):
        cones = np.full(len(setup.observed), cone)
        errors = errors_at(setup, MeasurementBounds(cones), start)
        true = true_errors(start, observation_model, setup.motion, MeasurementBounds(cones), errors, 8)
        assert true.missed == 0
        away.append(abs(true.position - errors.position.largest) / errors.position.largest)
    assert away[1] < 0.02
    assert away[1] < 0.75 * away[0] or away[1] < 1e-4


@pytest.mark.slow
def test_near_a_singularity_samples_do_not_follow_the_linear_law() -> None:
    found = accuracy(load("quattro"), "1,4", cone="0.5deg", at=["x=-0.17,y=0,z=-0.7,phi=0"], nonlinear=12)
    (true,), (linear,) = found.sampled, found.poses
    assert true is not None
    assert true.missed or true.position < 0.5 * linear.position.largest


def test_cones_of_their_own_scale_their_legs() -> None:
    robot = load("quattro_rigid")
    one, two, both = (
        accuracy(robot, "1,3", cone=cones).poses[0].position.largest
        for cones in (f"{CONE}", f"{2 * CONE}", f"1={CONE},3={2 * CONE}")
    )
    assert two == pytest.approx(2 * one, rel=1e-12)
    assert one < both < two


def test_a_grid_by_the_batch_is_that_by_pinocchio() -> None:
    setup = ObservedRobot.of(load("quattro"), "1,3,4")
    mapper = Mapper(setup, MeasurementBounds(np.full(3, CONE)))
    grid = Grid.parse("x=-0.2:0.2:4,phi=-10deg:20deg:3,y=0.05,z=-0.7")
    quick, slow = mapper.over(grid, 0), mapper._one_by_one(grid)
    assert quick.position.ravel() == pytest.approx(slow.position, rel=1e-8)
    assert quick.orientation.ravel() == pytest.approx(slow.orientation, rel=1e-8)
    assert quick.smallest.ravel() == pytest.approx(slow.smallest(), rel=1e-8)


def test_a_grid_in_parts_is_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = "x=-0.9:0.9:23,y=-0.9:0.9:23,z=-0.7"
    found = []
    for part in (10_000, 50):
        monkeypatch.setattr("hrsynth.analysis.accuracy.error_map.PART", part)
        found.append(accuracy(load("quattro_rigid"), "1,2,3", cone=0.002, grid=grid).field)
    whole, parts = found
    assert 0 < whole.reached.sum() < whole.reached.size
    for name in ("reached", "position", "smallest"):
        assert np.array_equal(getattr(whole, name), getattr(parts, name), equal_nan=True), name


def test_a_plane_of_a_robot_whose_legs_are_iterated() -> None:
    field = accuracy(load("3rps"), cone=CONE, grid="z=0.4:0.5:4").field
    assert field is not None
    assert field.spots is None
    assert field.reached.all()
    assert (field.position > 0).all()


@pytest.mark.some(1, 1)
@pytest.mark.parametrize(
    ("name", "grid"), [("3rps", "x=0:0.004:2,y=0"), ("gough_stewart", "x=0:0.004:2,y=0,z=0.3,rpy=0/0/0")]
)
def test_a_grid_says_that_its_bounds_may_be_too_large(name: str, grid: str) -> None:
    """Found one by one or by the batch: what an ascent attains is below each error of the grid, by its gap at most."""
    found = accuracy(name, cone=CONE, grid=grid)
    field = found.field
    assert field is not None
    assert (field.spots is None) == (name == "3rps")
    assert field.gap > 1e-3
    assert "three cones or more: upper bounds, nowhere more than" in runs.accuracy(found)
    starts = sweep(
        found.setup.all_samples.start, found.setup.all_samples.observation_model, field.grid, found.setup.motion
    )
    for k, at in enumerate(starts):
        met = largest_by_ascent(at, found.setup.samples.observation_model, found.bounds)
        for mine, theirs in zip((field.position.flat[k], field.orientation.flat[k]), met, strict=True):
            assert mine / (1 + field.gap) * (1 - 1e-6) <= theirs <= mine * (1 + 1e-6)


def test_singular_poses_of_a_plane_are_singular() -> None:
    found = accuracy(load("quattro_rigid"), "1,3", cone=CONE, plane="z=-0.7", steps=61)
    assert found.field is not None
    spots = singular_poses(found.field)
    assert len(spots) > 10
    x, y = map(float, spots[len(spots) // 2])
    near = accuracy(load("quattro_rigid"), "1,3", cone=CONE, at=[f"x={x!r},y={y!r},z=-0.7"])
    assert near.poses[0].position.largest > 1.0


@pytest.mark.slow
def test_the_curve_of_a_plane_that_is_swept_is_where_the_cranks_are_parallel() -> None:
    """A five-bar is found pose by pose; its cranks of 0.16 m end on two circles about the pose, of 0.2 m."""
    found = accuracy(load("rrrrr_m1"), cone=CONE, grid="x=-0.15:0.15:21,y=-0.25:0.05:21")
    assert found.field is not None
    assert found.field.determinant is None
    curve = found.field.curve
    assert curve is not None
    assert len(curve) > 10
    for place in curve.reshape(-1, 2):
        cranks = []
        for shoulder in ([-0.1, 0], [0.1, 0]):
            line = place - shoulder
            length = np.linalg.norm(line)
            along = (0.16**2 - 0.2**2 + length**2) / (2 * length)
            aside = np.sqrt(0.16**2 - along**2) * np.array([-line[1], line[0]]) / length
            cranks.append([(along * line / length + side * aside) / 0.16 for side in (1, -1)])
        assert min(abs(a[0] * b[1] - a[1] * b[0]) for a in cranks[0] for b in cranks[1]) < 0.03
    assert "Type 2 singularities of the hidden robot" in legend(found)


def test_a_box_without_a_determinant_says_that_nothing_is_drawn() -> None:
    found = accuracy(load("quattro_rigid"), cone=CONE, grid="x=-0.3:0.3:5,y=-0.3:0.3:5,z=-0.8:-0.6:3")
    assert "Type 2 singularities are not drawn" in legend(found)


@pytest.mark.parametrize(
    ("robot", "grid"),
    [
        ("quattro", "x=0.1:0.2:2,z=-0.7"),
        ("gough_stewart", "x=0.03:0.04:2,phi=10deg"),
        ("gough_stewart", "y=0.03:0.04:2,rpy=5deg/0/0"),
        ("3rrr_m1", "x=0.05:0.06:2,phi=0.1:0.2:2"),
        ("prrrp_m1", "x=0.01:0.02:2"),
    ],
)
def test_the_pose_that_a_grid_holds_is_told_whole(robot: str, grid: str) -> None:
    """Asked at what varies and what is told to be held, the error is that of the grid's first pose."""
    found = accuracy(load(robot), cone=CONE, grid=grid)
    assert found.field is not None
    told = re.search(r"^fixed +(.*)$", text(found), re.MULTILINE)
    assert told is not None
    if robot == "prrrp_m1":
        assert told[1] == "nothing; free, chosen nearest to the zero configuration: y, phi"
        return
    assert {"x", "y", "z"} <= {each.split("=")[0] for each in f"{grid},{told[1]}".split(",")}
    first = ",".join(f"{name}={float(values[0])!r}" for name, values in found.field.grid.axes)
    (alone,) = accuracy(load(robot), cone=CONE, at=f"{first},{told[1]}").poses
    assert alone.position.largest == pytest.approx(float(found.field.position.ravel()[0]), rel=1e-5)


def legend(found: Accuracy) -> list[str]:
    """The words of the legend of a map of errors."""
    assert found.field is not None
    plane = MapPlane.of(found.field.grid.axes, found.setup.motion, 0.4, 1.6)
    drawn = found.field.grid.ndim == 2 and _locus(found.field, [Figure().subplots()], plane)
    return [each.get_label() for each in _error_entries(found.field, drawn)]


@pytest.mark.parametrize(
    ("legs", "cones", "options", "word"),
    [
        ("1", "0.1deg", {}, "infinite"),
        ("1,4", "0", {}, "half-angle"),
        ("1,4", "90deg", {}, "half-angle"),
        ("1,4", "-1deg", {}, "half-angle"),
        ("1,4", True, {}, "half-angle"),
        ("1,4", "wide", {}, "not a number"),
        ("1,4", "nan", {}, "half-angle"),
        ("1,4", "1=0.1deg", {}, "leg 4 has no cone"),
        ("1,4", "1=0.1deg,2=0.1deg", {}, "that is not observed"),
        ("1,4", "1=0.1deg,1=0.1deg", {}, "twice"),
        ("1,4", "0.1deg,0.2deg", {}, "not leg=angle"),
        ("1,9", "0.1deg", {}, "no leg or link"),
        ("1,4", "0.1deg", {"plane": "z=-0.7", "grid": "x=0:1:2"}, "both"),
        ("1,4", "0.1deg", {"steps": 5}, "poses a side"),
        ("1,4", "0.1deg", {"nonlinear": -1}, "nonlinear"),
        ("1,4", "0.1deg", {"plane": "w=1"}, "unknown part"),
    ],
)
def test_bad_requests(legs: str, cones: str | bool, options: dict, word: str) -> None:
    with pytest.raises(BadRequest) as caught:
        accuracy(load("quattro"), legs, cone=cones, **options)
    assert word in str(caught.value)
    assert len(caught.value.lines()) == 1


@pytest.mark.slow
def test_poses_and_planes_out_of_reach() -> None:
    with pytest.raises(PoseNotReached):
        accuracy(load("quattro"), "1,4", cone=CONE, at=["x=3"])
    with pytest.raises(NoReachablePose):
        accuracy(load("quattro"), "1,4", cone=CONE, plane="z=3")
    with pytest.raises(NoReachablePose):
        accuracy(load("quattro"), "1,4", cone=CONE, grid="x=3:4:3,y=0,z=-0.7")


def test_cones_by_link_and_by_leg() -> None:
    setup = ObservedRobot.of(load("quattro"), "1,4", samples=2)
    sees_all(setup)
    link = setup.observed[0].link
    assert half_angles({link: 0.1, "4": 0.2}, setup.observed).tolist() == [0.1, 0.2]


def test_the_least_error_is_the_least_of_many_directions() -> None:
    """Narrow valleys, and blocks that (nearly) vanish in a direction, where the width has a corner."""
    rng = np.random.default_rng(0)
    for _ in range(40):
        k, d = int(rng.integers(1, 6)), int(rng.integers(2, 4))
        blocks = (
            rng.normal(size=(k, 3, d))
            @ np.diag(10.0 ** rng.uniform(-3, 0, d))
            @ np.linalg.qr(rng.normal(size=(d, d)))[0]
        )
        U, s, Vt = np.linalg.svd(blocks, full_matrices=False)
        s[:, -1] *= rng.choice([0, 1e-3, 1], size=k)
        blocks = U * s[:, None] @ Vt
        views = rng.normal(size=(d, 20_000))
        views /= np.linalg.norm(views, axis=0)
        assert _width(blocks, _descend(blocks)[:, None])[0] <= _width(blocks, views).min() * (1 + 1e-6)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["quattro", "3rrr_m1", "3rps", "prrrp_parallel", "gough_stewart"])
def test_what_an_ascent_attains_lies_between_the_two_bounds(name: str):
    setup = ObservedRobot.of(name)
    cones = np.full(len(setup.observed), 1e-3)
    for at in (setup.all_samples.start, *setup.configurations[:4]):
        found = largest_by_ascent(at, setup.samples.observation_model, MeasurementBounds(cones))
        bounds = errors_at(setup, MeasurementBounds(cones), at)
        for bound, met in zip((bounds.position, bounds.orientation), found, strict=True):
            assert np.isinf(met) == np.isinf(bound.largest)
            if np.isfinite(met):
                assert (1 - bound.gap) * bound.largest * (1 - 1e-6) <= met <= bound.largest * (1 + 1e-9) + 1e-15
        axes = error_axes(at, setup.samples.observation_model, MeasurementBounds(cones))
        assert (axes is None) == np.isinf(found[0])
        if axes is not None:
            assert np.linalg.norm(axes[0]) == pytest.approx(found[0], rel=1e-9)
            products = axes @ axes.T
            assert products == pytest.approx(np.diag(np.diag(products)), abs=1e-9 * products[0, 0])


def test_a_grid_says_that_parts_of_its_poses_depend_on_each_other() -> None:
    """Roll and pitch of a 3-RPS decide its yaw (Huang); three coordinates of its point that are too far do not depend,
    nor do two of a five-bar's."""
    with pytest.raises(
        NoReachablePose, match="3 freedoms, and at zero and at a random configuration parts of these poses"
    ):
        accuracy(load("3rps"), cone=CONE, grid="z=0.3:0.4:3,rpy=0.1/0.05/0")
    for robot, grid in (("3rps", "x=5:6:3,y=5,z=0.9"), ("rrrrr_m1", "x=50:60:3,y=50")):
        with pytest.raises(NoReachablePose) as refused:
            accuracy(load(robot), cone=CONE, grid=grid)
        assert "depend" not in str(refused.value)
