"""Poses and grids: what a user may write, what is refused in one line, and back from matrices."""

from __future__ import annotations

import json
from itertools import product
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import build_pose, convert_rpy_to_rotation
from hrsynth.mechanism.pose import Grid, Pose, parse_poses
from oracle import exponential

numbers = st.floats(-5, 5).map(lambda value: round(value, 4) + 0.0)
angles = st.floats(-3, 3).map(lambda value: round(value, 4) + 0.0)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("x=0.02,y=0.1,z=-0.7", Pose(0.02, 0.1, -0.7)),
        (" z = -.7 , x=2e-2", Pose(x=0.02, z=-0.7)),
        ("phi=10deg", Pose(phi=radians(10))),
        ("phi=-0.5", Pose(phi=-0.5)),
        ("x=1,rpy=0.1/0/-90deg", Pose(x=1, rpy=(0.1, 0.0, -pi / 2))),
        ("x=20mm,z=-700 mm", Pose(x=0.02, z=-0.7)),
    ],
)
def test_what_may_be_written(text: str, wanted: Pose) -> None:
    assert Pose.parse(text) == wanted


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x=0:1:3", "from:to:count is for grids"),
        ("", "name=value"),
        ("x", "name=value"),
        ("x=", "not a number"),
        ("w=1", "unknown part"),
        ("x=1,x=1", "twice"),
        ("x=abc", "not a number"),
        ("x=nan", "not finite"),
        ("y=inf", "not finite"),
        ("z=-inf", "not finite"),
        ("x=1deg", "not a number"),
        ("phi=1mm", "not a number"),
        ("phi=deg", "not a number"),
        ("phi=1e999", "not finite"),
        ("rpy=0/0", "rpy"),
        ("rpy=0/nan/0", "not finite"),
        ("rpy=0/0/0deg deg", "not a number"),
        ("phi=0,rpy=0/0/0", "both phi and rpy"),
        ("x=0:1:3", "not a number"),
        ("x=1,,y=2", "name=value"),
        ("X=1", "unknown part"),
        ("x=1e300", "too large"),
        ("z=-1e10", "too large"),
        ("phi=1e155", "too large"),
        ("rpy=0/1e300/0", "too large"),
    ],
)
def test_what_is_refused(text: str, what: str) -> None:
    with pytest.raises(BadRequest) as caught:
        Pose.parse(text)
    assert what in str(caught.value)
    assert len(caught.value.lines()) == 1
    assert caught.value.exit_status == 2


@given(
    st.builds(Pose, *[st.none() | numbers] * 3, phi=st.none() | angles), st.none() | st.tuples(angles, angles, angles)
)
def test_a_pose_reads_as_it_prints(given_pose: Pose, rpy: tuple[float, float, float] | None) -> None:
    wanted = given_pose if rpy is None else Pose(given_pose.x, given_pose.y, given_pose.z, rpy=rpy)
    if wanted.given:
        assert Pose.parse(str(wanted)) == wanted
    record = json.loads(json.dumps(wanted.to_dict()))
    assert [record[name] for name in "xyz"] == [wanted.x, wanted.y, wanted.z]
    assert record["rpy"] == (None if wanted.rpy is None else list(wanted.rpy))


@pytest.mark.parametrize(
    "vector", [*np.eye(3) * 0.3, *np.eye(3) * pi / 2, *-np.eye(3) * pi / 2, [1, 2, -0.5], [0, 0, 3]]
)
def test_back_from_a_matrix(vector: np.ndarray) -> None:
    R = exponential(np.asarray(vector, dtype=float))
    found = Pose.of(build_pose([0.1, -0.2, 0.3], R))
    assert (found.x, found.y, found.z) == (0.1, -0.2, 0.3)
    np.testing.assert_allclose(convert_rpy_to_rotation(*found.rpy), R, atol=1e-12)
    np.testing.assert_allclose(found.rotation, R, atol=1e-12)


def test_a_point_has_no_turn() -> None:
    R = exponential(np.array([0.0, 0.0, pi / 2]))
    found = Pose.of(build_pose([1, 2, 3], R), np.array([0.5, 0, 0]))
    assert found.rpy is None
    assert (found.x, found.y, found.z) == pytest.approx((1, 2.5, 3))


def test_a_grid_runs_its_last_axis_fastest() -> None:
    grid = Grid.parse("x=-0.3:0.3:3,z=-0.7,phi=0deg:90deg:2")
    assert grid.names == ("x", "phi")
    assert grid.shape == (3, 2)
    assert [(p.x, p.phi) for p in grid.poses()] == [
        (pytest.approx(x), pytest.approx(phi)) for x, phi in product((-0.3, 0, 0.3), (0, pi / 2))
    ]
    assert {(p.y, p.z, p.rpy) for p in grid.poses()} == {(None, -0.7, None)}


def test_two_numbers_are_a_position_in_a_plane() -> None:
    assert parse_poses([0.1, 0.2]) == [Pose(0.1, 0.2)]
    assert parse_poses([[0.1, 0.2], [0.3, 0.4, 0.5]]) == [Pose(0.1, 0.2), Pose(0.3, 0.4, 0.5)]


@given(st.permutations(["roll", "pitch", "yaw"]), angles, angles, angles)
def test_the_turns_of_a_grid_are_those_of_rpy(names: list[str], low: float, high: float, held: float) -> None:
    if abs(high - low) < 1e-3:
        high = low + 1
    grid = Grid.parse(f"{names[0]}={low!r}:{high!r}:3,{names[1]}={held!r},x=5mm")
    for value, pose in zip(np.linspace(low, high, 3), grid.poses(), strict=True):
        turns = {names[0]: value, names[1]: held, names[2]: 0.0}
        assert pose.rpy == pytest.approx([turns[name] for name in ("roll", "pitch", "yaw")])
        assert pose.x == 0.005
    assert Grid.parse(str(grid)).poses()[-1].rpy == pytest.approx(grid.poses()[-1].rpy, abs=1e-5)


def test_a_grid_of_joints_requests_each_cell() -> None:
    grid = Grid.parse("motors:a=-10deg:10deg:3,c=0.2,b=0:20mm:2")
    assert (grid.joints, grid.shape, str(Grid.parse(str(grid)))) == ("motors", (3, 2), str(grid))
    asked = [each.given for each in grid.requests_at(np.ndindex(grid.shape))]
    assert asked[1] == {"a": (pytest.approx(-pi / 18),), "b": (0.02,), "c": (0.2,)}
    assert asked[2]["a"] == (pytest.approx(0.0),)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x=0,y=1", "number of ranges"),
        ("x=0:1:1", "count of 2"),
        ("x=0:1", "from:to:count"),
        ("x=0:1:2.5", "count"),
        ("x=0:0:3", "no extent"),
        ("x=0:inf:3", "not finite"),
        ("x=0:1:3,x=0", "twice"),
        ("rpy=0/0/0:1/0/0:3", "range of rpy"),
        ("x=0:1:2,y=0:1:2,z=0:1:2,phi=0:1:2", "number of ranges"),
        ("x=0:1:1000,y=0:1:1000", "number of poses"),
        ("phi=0:1:3,rpy=0/0/0", "both phi and rpy"),
        ("x=0:1:-3", "count"),
        ("v=0:1:3", "unknown part"),
        ("roll=0:1:3,phi=0", "phi and roll"),
        ("roll=0:1:3,rpy=0/0/0", "rpy and roll"),
        ("roll=0,phi=0:1:3", "phi and roll"),
        ("motors:a=0", "number of ranges"),
        ("motors:a=0:1e9:3", "below 100"),
        ("motors:", "motors:NAME="),
        ("motors:0:1:3", "name=value"),
        ("joints:a=0:1:3,a=1", "twice"),
        ("joints:a=0:b:3", "not a number"),
    ],
)
def test_what_is_refused_of_a_grid(text: str, what: str) -> None:
    with pytest.raises(BadRequest) as caught:
        Grid.parse(text)
    assert what in str(caught.value)


@pytest.mark.parametrize("given", [b"x=1", bytearray(b"x=1"), [b"x=1"]])
def test_bytes_are_no_pose(given: object) -> None:
    """Their numbers are letters."""
    with pytest.raises(BadRequest, match="a pose"):
        parse_poses(given)
