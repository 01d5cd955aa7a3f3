"""Legs, platforms and segments are found by structure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import strategies
from hrsynth.description import list_robots, load, save
from hrsynth.errors import BadMechanism, BadRequest, BadRobotFile
from hrsynth.mechanism import Direction, Mechanism
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.legs import LegDecomposition, decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.sensors import choose_default_segment, observe_segment
from oracle import Oracle


def anatomy(name: str) -> LegDecomposition:
    return decompose(reduce_to_normal_form(load(name)).mechanism)


@pytest.mark.parametrize(
    ("name", "platform"),
    [
        ("quattro", {"platform", "plate_12", "plate_34", "side_bar"}),
        ("i4l", {"platform", "plate_12"}),
        ("quattro_rigid", {"platform"}),
        ("gough_stewart", {"platform"}),
        ("rrrrr_m1", {"dist_1"}),
    ],
)
def test_articulated_platforms_are_found(name: str, platform: set[str]) -> None:
    assert set(anatomy(name).platform) == platform


@pytest.mark.parametrize("name", list_robots())
def test_legs_share_no_link_and_end_on_the_platform(name: str) -> None:
    found = anatomy(name)
    links = [link for leg in found.legs for link in leg.links]
    assert len(links) == len(set(links))
    assert not set(links) & {found.mechanism.base, *found.platform}
    assert all(leg.platform_link in found.platform for leg in found.legs)
    assert set(links) | {found.mechanism.base, *found.platform} == set(found.mechanism.links)


@pytest.mark.parametrize("name", list_robots())
def test_default_segments_have_a_direction_from_base_to_platform(name: str) -> None:
    found = anatomy(name)
    for leg in found.legs:
        observation = choose_default_segment(found, leg)
        assert observation.leg == leg.label
        assert np.isclose(np.linalg.norm(observation.direction), 1.0)
        assert found.leg_of(observation.link) == leg


def test_the_default_segment_is_the_rod_or_the_sliding_axis() -> None:
    robot = anatomy("gough_stewart")
    direction = choose_default_segment(robot, robot.legs[0])
    slide = robot.mechanism.joints["slide_1"]
    u = robot.mechanism.links[direction.link].pose[:3, :3] @ direction.direction
    assert np.allclose(np.cross(u, slide.axis), 0)
    assert u[2] > 0
    robot = anatomy("delta")
    first = choose_default_segment(robot, robot.legs[0])
    rod = robot.mechanism.joints_of(first.link)
    along = rod[1].point - rod[0].point
    u = robot.mechanism.links[first.link].pose[:3, :3] @ first.direction
    assert first.link == "rod_1a"
    assert np.allclose(u, along / np.linalg.norm(along))


def test_only_the_end_joint_makes_a_point_of_a_platform() -> None:
    assert anatomy("prrrp_parallel_point").point is not None
    assert anatomy("prrrp_parallel").point is None
    assert anatomy("3rrr_m1").point is None


@pytest.mark.parametrize("motor", [False, True])
def test_a_ball_without_a_motor_makes_a_point_of_a_platform(motor: bool) -> None:
    b = Builder("wrist")
    b.link("base")
    b.link("slide")
    b.link("hand", at=(0, 0, 1))
    b.joint("guide", "P", "base", "slide", at=(0, 0, 0), axis=(0, 0, 1), motor=True)
    b.joint("ball", "S", "slide", "hand", at=(0.2, 0, 1), motor=motor)
    robot = b.build(platform="hand")
    assert (decompose(robot).point is None) == motor
    assert decompose(replace(robot, turns=True)).point is None


@pytest.mark.parametrize("ending", ["urdf", "sdf", "xml", "usda"])
def test_that_a_platform_turns_is_written_and_read(tmp_path: Path, ending: str) -> None:
    if ending == "usda":
        pytest.importorskip("pxr")
    robot, path = load("prrrp_parallel_point"), tmp_path / f"robot.{ending}"
    for turns in (None, True, False):
        save(replace(robot, turns=turns), path)
        assert load(path).turns is turns


def test_a_point_platform_with_its_frame_elsewhere_is_the_same_point() -> None:
    robot = reduce_to_normal_form(load("prrrp_parallel_point")).mechanism
    frame = robot.links["platform"].pose.copy()
    frame[:3, 3] += (0.1, 0.05, 0.02)
    moved = robot.changed(links=[replace(robot.links["platform"], pose=frame)])
    assert np.allclose(decompose(moved).point, (-0.1, -0.05, 0.0))


@pytest.mark.parametrize("name", ["delta", "quattro", "3rrr_m1", "rrrrr_m1"])
def test_names_do_not_matter(name: str) -> None:
    robot = load(name)
    other = strategies.renamed(robot, np.random.default_rng(3))
    assert decompose(reduce_to_normal_form(other).mechanism).architecture() == anatomy(name).architecture()


def watched(*observations: tuple[str, str]) -> Mechanism:
    robot = load("3rrr_m1")
    return replace(robot, observations=tuple(Direction(leg, link, np.array([1.0, 0, 0])) for leg, link in observations))


@pytest.mark.parametrize(
    ("observations", "what"),
    [
        ([("1", "base")], "not in a leg"),
        ([("1", "platform")], "not in a leg"),
        ([("1", "dist_1"), ("1", "dist_2")], "links of two legs"),
        ([("1", "dist_1"), ("2", "prox_1")], "its label"),
    ],
)
def test_labels_that_contradict_the_legs_are_refused(observations: list, what: str) -> None:
    with pytest.raises(BadRobotFile, match=what):
        decompose(watched(*observations))


def test_labels_of_the_file_are_kept() -> None:
    found = decompose(watched(("left", "dist_2")))
    assert found.leg("left").links == ("prox_2", "dist_2")
    assert set(found.labels) == {"1", "left", "3"}
    with pytest.raises(BadRequest, match="unknown leg"):
        found.leg("2")


def test_a_segment_without_length_and_a_link_outside_the_legs_are_refused() -> None:
    b = Builder("short")
    b.link("base")
    for i in range(3):
        b.link(f"rod_{i}", at=(i, i * i, 0))
        b.joint(f"foot_{i}", "S", "base", f"rod_{i}", at=(i, i * i, 0))
    b.link("plate")
    for i in range(3):
        b.joint(f"tip_{i}", "S", f"rod_{i}", "plate", at=(i, i * i, 0 if i == 0 else 1), loop=i > 0)
    found = decompose(b.build("plate"))
    with pytest.raises(BadRequest, match="length of the observed segment"):
        choose_default_segment(found, found.legs[0])
    with pytest.raises(BadRequest, match="link not in a leg"):
        observe_segment(found, "plate")


def test_a_platform_that_no_leg_reaches_is_refused() -> None:
    b = Builder("loose")
    b.link("base")
    b.link("crank")
    b.link("rod", at=(1, 0, 0))
    b.link("plate", at=(9, 0, 0))
    b.joint("a", "R", "base", "crank", axis=(0, 0, 1))
    b.joint("b", "R", "crank", "rod", at=(1, 0, 0), axis=(0, 0, 1))
    b.joint("c", "R", "rod", "base", at=(1, 1, 0), axis=(0, 0, 1), loop=True)
    with pytest.raises(BadMechanism, match="no leg connects"):
        decompose(b.build("plate"))


def test_a_tool_on_one_revolute_keeps_its_turn() -> None:
    from hrsynth.analysis.derive import derive

    robot = load("3rrr_m1")
    b = Builder("tool")
    b.link("base")
    b.link("tool", at=(0, 0, 0.1))
    b.joint("wrist", "R", "base", "tool", at=(0, 0, 0.1), axis=(1, 0, 1))
    tool = b.build("tool")
    wrist = tool.joints["wrist"].relinked("base", "platform")
    with_tool = robot.changed(links=[tool.links["tool"]], joints=[wrist], platform="tool")
    found = derive(with_tool)
    assert (found.dof, found.mobility.total, found.mobility.internal) == (4, 4, 0)
    assert found.verdict.verdict == "partially controllable"
    assert [freedom.name for freedom in found.verdict.unobserved] == ["rotation about the axis of wrist"]


def bars_below_rods(watch: str) -> Mechanism:
    """A plate on three rods (R below, S above), each on the tip of a five-bar of the base, in three planes; one link of
    each leg is watched."""
    b = Builder("bars_below_rods")
    b.link("base")
    b.link("plate", at=(0, 0, 1.2))
    for i, angle in enumerate((0.1, 2.2, 4.0)):
        radial, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        points = [
            0.8 * radial + x * across + np.array([0, 0, z])
            for x, z in ((-0.3, 0), (-0.45, 0.3), (0, 0.6), (0.5, 0.35), (0.3, 0))
        ]
        links = ["base", *(f"{part}_{i}" for part in ("left", "tip", "upper", "right"))]
        for link, at in zip(links[1:], points, strict=False):
            b.link(link, at=at)
        for k, at in enumerate(points):
            b.joint(f"bar_{i}_{k}", "R", links[k], links[(k + 1) % 5], at=at, axis=radial, motor=k == 0, loop=k == 4)
        start, end = points[2] + 0.05 * radial, 0.3 * radial + np.array([0, 0, 1.2])
        b.link(f"rod_{i}", at=start)
        b.joint(f"foot_{i}", "R", f"tip_{i}", f"rod_{i}", at=start, axis=across)
        b.joint(f"ball_{i}", "S", f"rod_{i}", "plate", at=end, loop=i > 0)
        along = points[2] - points[1] if watch == "tip" else end - start if watch == "rod" else points[1] - points[0]
        b.observe(str(i + 1), f"{watch}_{i}", along)
    return b.build("plate")


def test_what_is_watched_is_in_a_leg_and_not_in_the_platform() -> None:
    from hrsynth.analysis.derive import derive

    articulated = decompose(bars_below_rods("left"))
    assert len(articulated.legs) == 6
    assert set(articulated.platform) == {"plate", *(f"{part}_{i}" for i in range(3) for part in ("tip", "rod"))}
    for watch in ("rod", "tip"):
        robot = bars_below_rods(watch)
        found = decompose(robot)
        assert found.platform == ("plate",)
        assert [set(leg.links) for leg in found.legs] == [
            {f"{part}_{i}" for part in ("left", "tip", "upper", "right", "rod")} for i in range(3)
        ]
        oracle = Oracle(robot)
        basis = oracle.relation(next(oracle.random_walk(np.random.default_rng(2), 1)))
        _, sizes, right = np.linalg.svd(basis[6:])
        unseen = basis[:6] @ right[int((sizes > 1e-8).sum()) :].T
        lost = int((np.linalg.svd(unseen, compute_uv=False) > 1e-8).sum())
        verdict = derive(robot).verdict
        assert (verdict.dof, len(verdict.unobserved)) == (6, lost)
