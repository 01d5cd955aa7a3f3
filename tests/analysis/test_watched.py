"""What is watched and why, sets of what is asked for, mobility as written, half turns in print."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hrsynth import check, derive, legs, select
from hrsynth.analysis.configuration_report import ConfigurationAnalysis
from hrsynth.analysis.measured import MeasuredRobot
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.description import load
from hrsynth.geometry.so3 import convert_vectors_to_rotations
from hrsynth.mechanism.legs import decompose
from hrsynth.mechanism.normal import reduce_to_normal_form
from hrsynth.mechanism.observations.direction import Direction
from hrsynth.mechanism.pose import Pose
from hrsynth.mechanism.sensors import list_default_segments
from oracle import Oracle

WHY = {
    "quattro": "the first of the parallel rods before the platform",
    "3rrr_m1": "the last segment before the platform",
    "gough_stewart": "the axis of the prismatic joint",
}


@pytest.mark.parametrize("name", WHY)
def test_the_watched_axis_is_told_with_its_reason(name: str):
    found = check(name)
    for seen, record in zip(found.setup.observed, found.to_dict()["observations"], strict=True):
        why = record["reason"]
        assert why.startswith(WHY[name])
        assert (record["leg"], record["link"]) == (seen.leg, seen.link)
        assert isinstance(seen, Direction)
        assert np.allclose(record["axis"], seen.direction)
        assert f"{seen.link} along (" in str(found)
        assert why in str(found)


def test_sets_of_links_that_are_asked_for():
    found = legs("delta", observe="arm_1,rod_2a")
    assert [each["reason"] for each in found.to_dict()["observations"]] == ["requested", WHY["quattro"]]
    assert [each.legs for each in found.sets] == [("1",), ("2",), ("1", "2")]
    single = [check("delta", observe=link).postures[0].hidden.rank for link in ("arm_1", "rod_2a")]
    assert [each.rank for each in found.sets[:2]] == single
    both = legs("delta", observe=["rod_1a", "arm_1"])
    assert [(each.legs, each.rank) for each in both.sets] == [(("1",), 3)]
    assert check("delta", observe=["rod_1a", "arm_1"]).postures[0].hidden.rank == 3
    assert len(legs("delta", observe="all").sets) == 7


def test_a_report_of_few_legs_still_knows_all_sets():
    assert len(legs(ObservedRobot.of("delta", "1,2")).sets) == 7


@pytest.mark.slow
def test_sets_for_a_displacement_are_those_asked_for():
    found = select("delta", observe="1,2", start="x=0.05", goal="x=-0.05", runs=0, examine=1)
    assert {each.legs for each in found.candidates} == {("1",), ("2",), ("1", "2")}


def test_mobility_is_that_of_the_normal_form_and_that_of_the_file(tmp_path):
    text = (
        '<robot name="arm"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>'
        + "".join(
            f'<joint name="{j}" type="continuous"><parent link="{p}"/><child link="{c}"/>'
            f'<origin xyz="{x} 0 0"/><axis xyz="{axis}"/></joint>'
            for j, p, c, x, axis in (
                ("p", "base", "a", 0, "0 0 1"),
                ("q", "a", "b", 0, "0 0 1"),
                ("r", "b", "c", 1, "0 1 0"),
            )
        )
        + "</robot>"
    )
    (tmp_path / "arm.urdf").write_text(text)
    found = check(load(tmp_path / "arm.urdf", platform="c"))
    oracle = Oracle(found.setup.robot)
    written = oracle.mobility(oracle.zero())
    assert (found.setup.mobility.total, found.as_written.total) == (2, written) == (2, 3)
    assert found.to_dict()["mobility"]["as_written"]["total"] == 3
    assert derive(found.setup).to_dict()["mobility"] == found.to_dict()["mobility"]
    assert "3 as the file is written, 2 in normal form" in str(found)


def test_the_table_of_legs_says_where_freedoms_are_lost():
    assert "unobserved (at mode:2)" in str(legs("3rrr_m1", at="mode:2"))
    assert "unobserved (at the zero configuration)" in str(legs("3rrr_m1"))


def test_half_a_turn_is_printed_as_a_positive_one():
    for angle in (-math.pi + 1e-9, math.pi - 1e-9):
        turned = np.eye(4)
        turned[:3, :3] = convert_vectors_to_rotations(np.array([0.0, 0.0, angle]))
        assert str(Pose.of(turned)) == "x=0,y=0,z=0,rpy=0/0/3.141593"
        motion = ObservedRobot.of("3rrr_m1").printing_like([Pose.parse("phi=10deg")]).motion
        assert str(motion.pose(turned @ motion.home)).endswith("phi=180deg")
    assert Pose.parse("phi=-180deg").phi == -math.pi


def test_the_format_of_poses_is_no_part_of_a_robot():
    """Equal setups print poses as they were typed, also from cached results."""
    robot = ObservedRobot.of("gough_stewart")
    other = robot.printing_like([Pose.parse("rpy=5deg/0/0")])
    assert robot is not other
    assert (robot, hash(robot)) == (other, hash(other))
    assert robot != ObservedRobot.of("gough_stewart", "1,2")
    turned = Pose.parse("x=0,y=0,rpy=0.1/0.2/0").rotation
    for text in ("rpy=0.1/0.2/0", "rpy=5.729578deg/11.459156deg/0") * 2:
        (report,) = check(robot, at=f"x=0,y=0,{text}").postures
        assert ("deg" in str(report.pose)) is ("deg" in text)
        assert np.allclose(report.pose.rotation, turned, atol=1e-6)
    for setup, is_in_degrees in ((robot, False), (other, True)) * 2:
        report = ConfigurationAnalysis.of(setup).classify(setup.all_samples.start)
        measured = MeasuredRobot.of(setup).setup
        assert ("deg" in str(report.pose)) is measured.form.degrees is is_in_degrees


def with_connectors(skew: float, short: float, seed: int) -> str:
    """A translating robot on three legs R-U-U, each U two hinges at a connector of length ``short``, its axes ``skew``
    off a right angle, in a turned base."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=4)
    arm, rod = rng.uniform(0.2, 0.3, 3), rng.uniform(0.3, 0.5, 3)
    legs = []
    for k in range(3):
        a = math.pi * k / 3
        cross = f"{math.cos(skew)} {math.sin(skew)} 0"
        legs.append(f"""<body quat="{math.cos(a)} 0 0 {math.sin(a)}"><body name="arm{k}" pos="0.2 0 0">
 <joint name="m{k}" axis="0 1 0"/><body name="c{k}" pos="{arm[0]} 0 {-arm[1]}"><joint name="u{k}" axis="0 1 0"/>
 <body name="rod{k}" pos="{short} 0 0"><joint name="v{k}" axis="{cross}"/>
 <body name="d{k}" pos="{-rod[0]} 0.02 {-rod[1]}"><joint name="w{k}" axis="{cross}"/>
 <body name="e{k}" pos="{short} 0 0"><joint name="x{k}" axis="0 1 0"/></body></body></body></body></body></body>""")
    welds = "".join(f'<weld body1="e{k}" body2="plate"/>' for k in range(3))
    motors = "".join(f'<motor joint="m{k}"/>' for k in range(3))
    return f"""<mujoco model="hinges"><compiler angle="radian"/><worldbody><body name="frame" quat="{q[0]} {q[1]} {q[2]}
 {q[3]}">{"".join(legs)}<body name="plate"><freejoint/></body></body></worldbody><equality>{welds}</equality>
 <actuator>{motors}</actuator></mujoco>"""


@pytest.mark.some(2)
@pytest.mark.parametrize(("skew", "short"), [(0.0, 0.0), (0.0, 1e-6), (0.3, 0.0), (0.3, 1e-6), (-0.5, 1e-7)])
def test_a_connector_of_no_length_is_never_watched(skew: float, short: float, tmp_path):
    (tmp_path / "robot.xml").write_text(with_connectors(skew, short, 5))
    robot = load(tmp_path / "robot.xml", platform="plate")
    for number, leg in enumerate(decompose(reduce_to_normal_form(robot).mechanism).legs):
        seen = list_default_segments(decompose(reduce_to_normal_form(robot).mechanism))[leg.label]
        assert isinstance(seen, Direction)
        assert seen.link == f"rod{number}"
        origins = [robot.links[link].pose for link in (f"rod{number}", f"e{number}")]
        along = origins[0][:3, :3].T @ (origins[1][:3, 3] - origins[0][:3, 3])
        assert np.allclose(seen.direction, along / np.linalg.norm(along), atol=1e-4)  # from U to U, as a camera sees it
