"""Loci over planes of poses: values as at each pose, unreached cells empty, bad planes refused."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from analysis.singularity.found import found
from analysis.singularity.test_figures import centre
from hrsynth.analysis.accuracy.accuracy import accuracy
from hrsynth.analysis.check import check
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.singularity.locus import COARSE_GRID_SIDE_COUNT, LOCUS_SIDES, Locus, choose_plane_grid
from hrsynth.analysis.singularity.locus import compute_locus as drawn
from hrsynth.analysis.singularity.rank_curve import PlaneOfPoses
from hrsynth.batch.pose_continuation import sweep, track_to_pose
from hrsynth.description import load
from hrsynth.errors import BadRequest, NoReachablePose
from hrsynth.geometry.vectors import normalise_vector
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.platform_motion import PlatformMotion
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.builder import build
from hrsynth.mechanism.pose import Pose
from hrsynth.present import palette
from hrsynth.present.maps import _draw_boundary, _draw_locus_curve, draw_locus_map
from hrsynth.present.plots import MapPlane

STEPS = 15


@cache
def planar() -> Locus:
    return drawn(load("3rrr_m1"), steps=STEPS)


def posed(x: float, y: float) -> ClosedConfiguration:
    samples = found("3rrr_m1").setup.samples
    configurations = [samples.start, *(member.configuration for member in samples.members)]
    motion = PlatformMotion.of(configurations, samples.observation_model)
    return track_to_pose(samples.start, samples.observation_model, Pose(x=x, y=y, phi=0.0), motion)


def lines(at: ClosedConfiguration, begin: str, end: str) -> float:
    """The determinant of three lines through the tips along begin-end (characteristic lengths), for a normal +z."""
    tips = [centre(at, f"wrist_{i}")[:2] / at.model.length for i in "123"]
    along = [normalise_vector(centre(at, f"{end}_{i}") - centre(at, f"{begin}_{i}"))[:2] for i in "123"]
    return float(np.linalg.det([[*d, tip[0] * d[1] - tip[1] * d[0]] for d, tip in zip(along, tips, strict=True)]))


def test_values_are_those_of_the_geometry_at_each_pose() -> None:
    """Hidden: lines along the cranks; real (motors at the base): lines along the links next to the platform."""
    locus = planar()
    (_, xs), (_, ys) = locus.grid.axes
    cells = [(i, j) for i in range(4, 11, 3) for j in range(5, 11, 2)]
    for i, j in cells:
        at = posed(xs[i], ys[j])
        np.testing.assert_allclose(at.pose("platform")[:2, 3], [xs[i], ys[j]], atol=1e-8)
        assert abs(locus.hidden.value[i, j]) == pytest.approx(abs(lines(at, "shoulder", "elbow")), abs=1e-6)
        assert abs(locus.real.value[i, j]) == pytest.approx(abs(lines(at, "elbow", "wrist")), abs=1e-6)


def test_hidden_and_real_locus_differ() -> None:
    locus = planar()
    assert locus.hidden.signed
    assert locus.real.signed
    for field in (locus.hidden, locus.real):
        assert np.nanmin(field.value) < 0 < np.nanmax(field.value)
    products = np.sign(locus.hidden.value * locus.real.value)
    assert np.any(products > 0)
    assert np.any(products < 0)


def test_what_is_not_reached_is_empty() -> None:
    locus = planar()
    assert locus.grid.names == ("x", "y")
    assert locus.grid.shape == (STEPS, STEPS) == locus.hidden.value.shape
    empty = np.isnan(locus.hidden.type2)
    assert 0 < np.sum(~empty) == locus.reached < STEPS**2
    assert empty[0, 0]
    assert empty[-1, -1]
    for field in (locus.hidden, locus.real):
        for table in (field.value, field.type2, field.type1):
            np.testing.assert_array_equal(np.isnan(table), empty)
        assert np.nanmin(field.type2) >= 0
    record = locus.to_dict()
    assert record["hidden"]["type2"][0][0] is None
    assert record["axes"].keys() == {"x", "y"}
    assert sum(value is not None for row in record["real"]["expression"] for value in row) == locus.reached


def test_the_picture_shows_the_loci() -> None:
    import matplotlib.image
    from matplotlib.colors import to_rgb

    data = draw_locus_map(found("3rrr_m1"), planar())
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    pixels = matplotlib.image.imread(io.BytesIO(data))[..., :3]
    assert min(pixels.shape[:2]) > 300
    for colour in (palette.get_colour("actuator"), palette.PAGE["ink"]):
        assert np.sum(np.all(np.abs(pixels - to_rgb(colour)) < 0.06, axis=2)) > 100


def test_the_edge_of_the_map_is_no_limit_of_reach() -> None:
    """Of a part of the plane that is all reached nothing is marked."""
    from matplotlib.figure import Figure

    locus = planar()
    some = slice(6, 9)
    part = replace(
        locus,
        real=None,
        grid=replace(locus.grid, axes=tuple((n, v[some]) for n, v in locus.grid.axes)),
        hidden=replace(
            locus.hidden,
            value=locus.hidden.value[some, some],
            type2=locus.hidden.type2[some, some],
            type1=locus.hidden.type1[some, some],
        ),
    )
    assert part.reached == 9
    for each, marked in ((part, False), (locus, True)):
        plane = MapPlane.of(each.grid.axes, found("3rrr_m1").setup.motion, 0.4, 1.6)
        assert bool(_draw_boundary(Figure().subplots(), plane, each)) == marked


@pytest.mark.parametrize(
    ("locus", "words"),
    [
        (lambda: drawn(load("linear_delta"), steps=5), "hidden robot: Type 2 (never where examined)"),
        (planar, "hidden robot: Type 2"),
    ],
)
def test_what_is_not_met_on_the_grid_is_not_called_never(locus: Callable[[], Locus], words: str) -> None:
    """*Never* where the rails are not parallel at all, whatever is drawn; else of a part without the curve that none
    was found."""
    from matplotlib.figure import Figure

    def told(each: Locus) -> str:
        plane = MapPlane.of(each.grid.axes, found("3rrr_m1").setup.motion, 0.4, 1.6)
        return _draw_locus_curve(Figure().subplots(), plane, each.hidden, "hidden robot").get_label()

    whole = locus()
    assert told(whole) == words
    value = np.where(whole.hidden.value > 0, whole.hidden.value, np.nan)
    part = replace(whole, hidden=replace(whole.hidden, value=value))
    assert told(part) == (words if whole.hidden.never else f"{words} (none found)")


@pytest.mark.slow
def test_isolated_singular_poses_are_spots_of_a_plane() -> None:
    locus = drawn(load("quattro_rigid"), plane="y=0", steps=9)
    assert locus.grid.names == ("x", "z")
    assert not locus.hidden.signed
    assert np.min(np.abs(locus.hidden.spots[:, 0])) < 1e-7
    assert len(locus.hidden.curve) == 0


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("robot", "legs", "real", "plane"),
    [
        ("3rrr_m1", None, False, "phi=0"),
        ("3rpr_m1", None, True, "phi=10deg"),
        ("gough_stewart", "1,2,3", False, None),
        ("3rrr_m1", None, False, "phi=15deg"),
    ],
)
def test_where_the_smallest_value_passes_through_zero_the_expression_does(
    robot: str, legs: str | None, real: bool, plane: str | None
) -> None:
    """The curve knows the relation alone: its crossings of edges are the expression's, and in nine of ten
    cells in which that changes its sign, or beside them, there is one."""
    setup = ObservedRobot.of(robot, legs)
    measured = MeasuredRobot.of(setup, real)
    located = drawn(setup, plane=plane, steps=STEPS)
    start, motion, observation_model = setup.all_samples.start, setup.motion, measured.observation_model
    configurations = sweep(start, setup.samples.observation_model, located.grid, motion, setup.placer)
    pieces = PlaneOfPoses(observation_model, motion, located.grid).curve(configurations)
    assert len(pieces) > 2
    values = (located.real if real else located.hidden).value
    assert (located.real if real else located.hidden).signed
    size = np.nanmax(np.abs(values))
    (_, x), (_, y) = located.grid.axes
    reached = {place: at for place, at in zip(product(x, y), configurations, strict=True) if at is not None}
    for piece in pieces:
        for end in piece:
            near = min(reached, key=lambda place: np.linalg.norm(np.subtract(place, end)))
            at = track_to_pose(reached[near], setup.samples.observation_model, located.grid.pose(end.tolist()), motion)
            assert abs(measured.condition.evaluate(measured.pattern.values_at([at]))[0]) < 0.03 * size
    cell = np.array([x[1] - x[0], y[1] - y[0]])
    changes = [
        (i, j)
        for i, j in np.ndindex(STEPS - 1, STEPS - 1)
        if np.isfinite(values[i : i + 2, j : j + 2]).all()
        and np.min(values[i : i + 2, j : j + 2]) < 0 < np.max(values[i : i + 2, j : j + 2])
    ]
    middles = pieces.mean(axis=1)
    missed = [(i, j) for i, j in changes if np.abs((middles - [x[i], y[j]]) / cell - 0.5).max(axis=1).min() > 1]
    assert len(changes) > 2
    assert len(missed) <= 0.1 * len(changes)


@pytest.mark.slow
@pytest.mark.some(4)
@pytest.mark.parametrize("degrees", range(5, 360, 50))
def test_thin_tips_are_within_the_window(degrees: int) -> None:
    """A disc with a needle of 20 degrees, whatever its direction; and the window is no more than a step wider."""
    setup = ObservedRobot.of("3rrr_m1")
    motion, length = setup.motion, setup.all_samples.start.model.length
    towards = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    centre = motion.position(setup.all_samples.start.pose(motion.link))[:2]
    end, radius = centre + 1.9 * length * towards, 0.4 * length

    def inside(places: np.ndarray) -> np.ndarray:
        back = end - places
        along, across = back @ towards, back @ [-towards[1], towards[0]]
        needle = (along >= 0) & (along <= 1.9 * length) & (np.abs(across) <= along * np.tan(np.radians(10)))
        return needle | (np.linalg.norm(places - centre, axis=1) <= radius)

    grid = choose_plane_grid(
        setup.all_samples.start,
        setup.all_samples.observation_model,
        motion,
        Pose(phi=0.0),
        5,
        lambda _, cells: inside(cells.places()),
    )
    step = 2 * LOCUS_SIDES[0] * length / (COARSE_GRID_SIDE_COUNT - 1)
    corners = np.stack([end, centre + radius, centre - radius])
    window = np.array([[values[0], values[-1]] for _, values in grid.axes]).T
    assert (window[0] <= corners.min(axis=0)).all()
    assert (window[1] >= corners.max(axis=0)).all()
    assert np.abs(window - [corners.min(axis=0), corners.max(axis=0)]).max() <= 1.25 * step


@pytest.mark.some(1, 1)
@pytest.mark.parametrize(("robot", "plane"), [("3rrr_m1", "phi=0"), ("prrrp_m1", None), ("rrrrr_m1", None)])
def test_nothing_that_is_reached_touches_the_window(robot: str, plane: str | None) -> None:
    reached = np.isfinite(drawn(load(robot), plane=plane, steps=21).hidden.type2)
    assert reached.any()
    assert not any(edge.any() for edge in (reached[0], reached[-1], reached[:, 0], reached[:, -1]))


def test_a_plane_that_is_not_reached() -> None:
    with pytest.raises(NoReachablePose) as caught:
        drawn(load("delta"), plane="z=5", steps=5)
    assert caught.value.exit_status == 3
    assert "no pose of the plane z=5 is reached" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_point_on_a_circle_and_the_turn_are_a_plane() -> None:
    """The frame of a five-bar's distal link at the elbow: x and y depend on each other."""
    robot = load("rrrrr_m1")
    elbow, frame = robot.joints["elbow_1"].point, robot.links["dist_1"].pose.copy()
    frame[:3, 3] = elbow
    moved = robot.changed(links=[replace(robot.links["dist_1"], pose=frame)])
    motion = ObservedRobot.of(moved).motion
    assert (motion.translations.shape[1], motion.shifts, motion.dof) == (2, 1, 2)
    locus = drawn(moved, steps=9)
    assert locus.grid.names == ("x", "phi")
    assert np.isfinite(locus.hidden.type2).mean() > 0.3


def test_a_plane_whose_poses_depend_on_each_other_says_so() -> None:
    with pytest.raises(NoReachablePose, match="parts of this pose depend on each other"):
        drawn(load("3rps"), plane="phi=0.1", steps=5)


@pytest.mark.parametrize(
    ("robot", "plane", "words"),
    [
        ("delta", "phi=0.1", "cannot change phi"),
        ("delta", "x=0,y=0", "must be free, here z"),
        ("3rrr_m1", "x=0,y=0", "must be free, here phi"),
        ("delta", "z=abc", "z is not a number"),
        ("hexaglide", None, "has no singularity locus"),
        ("3prp", None, "has no singularity locus"),
        ("3ppr_m1", None, "has no singularity locus"),
    ],
)
def test_planes_that_are_none(robot: str, plane: str | None, words: str) -> None:
    with pytest.raises(BadRequest, match=words):
        drawn(load(robot), plane=plane, steps=5)


def wrist() -> Mechanism:
    """Three legs of three R each, all axes through one point, neighbouring ones at right angles."""
    made, axes = build("wrist"), 0.1 * np.eye(3)
    made.link("base")
    made.link("mount")
    for leg in "123":
        first, middle, last = np.roll(axes, 1 - int(leg), axis=0)
        made.link(f"crank_{leg}")
        made.link(f"arc_{leg}")
        made.joint(f"motor_{leg}", "R", "base", f"crank_{leg}", at=first, axis=first, motor=True)
        made.joint(f"elbow_{leg}", "R", f"crank_{leg}", f"arc_{leg}", at=middle, axis=middle)
        made.joint(f"end_{leg}", "R", f"arc_{leg}", "mount", at=last, axis=last, loop=leg != "1")
        made.observe(leg, f"arc_{leg}", middle)
    return made.build(platform="mount")


@pytest.mark.parametrize(
    ("robot", "grid"),
    [
        (lambda: load("3rrr_m1"), "motors:shoulder_1=-0.3:0.3:3,shoulder_2=-0.5:0.3:3"),
        (lambda: load("3rrr_m1"), "joints:elbow_1=-0.2:0.2:3,shoulder_2=-0.2:0.2:3,shoulder_3=0.1"),
        (wrist, "roll=-0.6:0.6:3,pitch=-0.6:0.6:3"),
        pytest.param(wrist, "motors:motor_1=-0.5:0.5:4,motor_3=-0.5:0.5:4", marks=pytest.mark.slow),
    ],
)
def test_a_locus_over_motors_joints_and_turns_has_the_values_of_a_check(
    robot: Callable[[], Mechanism], grid: str
) -> None:
    locus, checked = drawn(robot(), grid=grid), check(robot(), grid=grid).grid
    assert checked is not None
    expected = np.array([np.nan if each is None else each for each in checked.values("type2")]).reshape(
        locus.grid.shape
    )
    assert np.isfinite(expected).any()
    np.testing.assert_allclose(locus.hidden.type2, expected, atol=1e-9)
    record, there = locus.to_dict(), checked.to_dict()
    kind = grid.partition(":")[0]
    assert record["axes"] == (
        {kind: there[kind]} if kind in there else {name: there[name] for name in locus.grid.names}
    )


def test_a_locus_over_motors_is_drawn() -> None:
    locus = drawn(load("3rrr_m1"), grid="motors:shoulder_1=-0.5:0.1:5,shoulder_2=-0.5:0.2:5")
    assert np.nanmin(locus.hidden.value) < 0 < np.nanmax(locus.hidden.value)
    assert draw_locus_map(found("3rrr_m1"), locus) != draw_locus_map(found("3rrr_m1"), planar())


@pytest.mark.slow
def test_the_curve_over_motors_is_singular() -> None:
    """Points of the curve that is drawn over motors are poses where the rank is lost, by a check of the same motors."""
    field = accuracy(load("3rrr_m1"), cone="0.1deg", grid="motors:shoulder_1=-0.5:0.1:9,shoulder_2=-0.5:0.2:9").field
    assert field is not None
    assert field.curve is not None
    assert len(field.curve)
    places = field.curve.reshape(-1, 2)[::5]
    at = [{"motors": dict(zip(("shoulder_1", "shoulder_2"), place.tolist(), strict=True))} for place in places]
    values = [each.distances.type2 for each in check(load("3rrr_m1"), at=at).postures]
    assert max(values) < 0.1 * np.nanmedian(field.smallest)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"grid": "x=-0.1:0.1:5"}, "number of ranges of a locus"),
        ({"grid": "x=-0.1:0.1:5,y=0:0.1:5", "plane": "phi=0"}, "--plane and --grid"),
    ],
)
def test_a_grid_of_a_locus_has_two_ranges_and_no_plane(asked: dict[str, str], message: str) -> None:
    with pytest.raises(BadRequest, match=message):
        drawn(load("3rrr_m1"), **asked)
