"""Near modes: poses that a camera cannot tell from the goal are counted, however many digits a file has."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import hrsynth
from description.foreign.rounded import exported, of_hinges
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.analysis.modes.near_modes import descend, parse_measurement_bound
from hrsynth.analysis.observed import ObservedRobot
from hrsynth.analysis.pose_requests import solve_configurations
from hrsynth.description import list_robots, load
from hrsynth.errors import BadRequest, UnsupportedLocus
from hrsynth.geometry.vectors import build_pose, measure_angle, normalise_vector, rotate_about_axis
from hrsynth.kinematics.configuration import ClosedConfiguration, measure
from hrsynth.kinematics.tasks import FixedValuesTask
from hrsynth.mechanism import Mechanism
from hrsynth.mechanism.pose import Pose
from hrsynth.present.report.answer import answer
from hrsynth.present.report.parts import Parts, RefusedPart
from hrsynth.present.studio.asks.answer import describe_remaining_error

TILT = build_pose((0.123, -0.377, 0.219), rotate_about_axis(normalise_vector([1.0, 2.0, 0.5]), 0.7))


def tilted(robot: Mechanism) -> Mechanism:
    """The same robot, its base turned so that no number of it has few digits."""
    links = {
        name: replace(link, pose=link.pose if name == robot.base else TILT @ link.pose)
        for name, link in robot.links.items()
    }
    joints = {
        name: replace(
            joint,
            point=TILT[:3, :3] @ joint.point + TILT[:3, 3],
            axes=tuple(TILT[:3, :3] @ axis for axis in joint.axes),
        )
        for name, joint in robot.joints.items()
    }
    return replace(robot, links=links, joints=joints)


def rounded(robot: Mechanism, path: Path, digits: int) -> Mechanism:
    """The robot, tilted, as it is read from a file of so many significant digits."""
    return load(exported(tilted(robot), path, digits, significant=True), platform=robot.platform)


def how_many(found: AssemblyModes) -> int | None:
    """How many poses look the same; None where they fill a continuum."""
    return None if found.found.continuous_family is not None else len(found.modes) + len(found.near_modes)


@cache
def of_cad(folder: Path) -> Mechanism:
    """A Delta as CAD exports it: six digits, each ball three R, loops closed by frames."""
    return rounded(of_hinges(load("delta")), folder / "delta.sdf", 6)


@pytest.fixture(scope="module")
def cad(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    return of_cad(tmp_path_factory.mktemp("cad"))


@pytest.mark.some(6, 60)
@pytest.mark.parametrize("digits", [6, 9, 7, 5])
@pytest.mark.parametrize(
    "name", ["delta", "quattro", "3ruu", *(each for each in list_robots() if each not in ("delta", "quattro", "3ruu"))]
)
def test_a_rounded_robot_has_as_many_poses_that_look_the_same(name: str, digits: int, tmp_path: Path):
    robot = load(name)
    assert how_many(hrsynth.modes(rounded(robot, tmp_path / "robot.sdf", digits))) == how_many(hrsynth.modes(robot))


def test_what_is_told_of_a_near_mode_is_so(cad: Mechanism):
    found = hrsynth.modes(cad)
    (near,) = found.near_modes
    at = near.configuration
    seen = [
        measure(each.model, each.q, found.setup.mechanism.base, found.setup.observed)[2] for each in (found.goal, at)
    ]
    angles = [measure_angle(one, other) for one, other in zip(*seen, strict=True)]
    assert 0 < near.angle < np.radians(1e-3)
    assert max(angles) == pytest.approx(near.angle, rel=1e-3, abs=1e-8)
    apart = at.pose("platform")[:3, 3] - found.goal.pose("platform")[:3, 3]
    assert np.linalg.norm(apart) == pytest.approx(near.distance) == pytest.approx(0.239, abs=1e-3)
    assert near.stable
    assert np.linalg.norm(at.model.residual(at.q)) < 1e-10


def test_the_bound_is_that_of_the_measurement(cad: Mechanism):
    (near,) = hrsynth.modes(cad).near_modes
    assert hrsynth.modes(cad, cone=0).near_modes == hrsynth.modes(cad, cone="0deg").near_modes == ()
    assert hrsynth.modes(cad, cone=0.9 * near.angle).near_modes == ()
    assert len(hrsynth.modes(cad, cone=1.1 * near.angle).near_modes) == 1
    for wrong in ("-1deg", "far", 2.0, -0.1):
        with pytest.raises(BadRequest):
            parse_measurement_bound(wrong)


def test_every_answer_counts_it(cad: Mechanism):
    derived = hrsynth.derive(cad)
    found, left = derived.modes(), RefusedPart("not asked")
    words = "2 poses look the same: the goal and one that differs by "
    assert words in found.headline()
    assert words in str(found)
    assert found.to_dict()["near_modes"][0]["stable"] is True
    assert "one other pose, 24 cm away" in describe_remaining_error(found.setup)[1]
    assert any(words in each for each in answer(derived, Parts(left, left, found, left)))


@pytest.mark.slow
def test_a_search_finds_what_a_list_proposes(cad: Mechanism, monkeypatch: pytest.MonkeyPatch):
    (listed,) = hrsynth.modes(cad).near_modes

    def refuse(*_: object) -> None:
        raise UnsupportedLocus("delta", "no list is to be made")

    monkeypatch.setattr("hrsynth.analysis.modes.modes._list_by_system", refuse)
    hrsynth.clear_cache()
    (met,) = hrsynth.modes(cad).near_modes
    assert met.stable
    assert met.angle == pytest.approx(listed.angle, rel=1e-4)
    assert met.distance == pytest.approx(listed.distance, rel=1e-6)
    hrsynth.clear_cache()


@pytest.mark.slow
def test_a_run_of_the_loop_ends_at_a_near_mode(cad: Mechanism):
    found = hrsynth.modes(cad)
    (near,) = found.near_modes
    beside = replace(near.pose, x=near.pose.x + 0.01, z=near.pose.z - 0.01)
    run = hrsynth.servo(cad, start=beside.without(["rpy"]), goal=found.pose.without(["rpy"]))
    assert run.outcome != "goal"
    assert "near mode 1 of the goal" in run.run_outcome.reason
    assert np.linalg.norm([run.pose.x - near.pose.x, run.pose.y - near.pose.y, run.pose.z - near.pose.z]) < 1e-4


def test_a_stationary_difference_is_a_near_mode_only_where_it_is_least():
    """Of a Delta on its axis: beside its two modes, at both, and exactly between them, where the difference is
    stationary too, greatest along the axis."""
    setup = ObservedRobot.of("delta")
    goal, observation_model = setup.all_samples.start, setup.samples.observation_model
    held = FixedValuesTask.at(goal.model, goal.q, observation_model.reference, observation_model.observations)
    low, high = (mode.pose.z for mode in hrsynth.modes(setup).modes)

    def at(z: float) -> ClosedConfiguration:
        return solve_configurations(setup, [Pose(x=0.0, y=0.0, z=z)])[0]

    top = minimize_scalar(
        lambda z: -np.linalg.norm(held.error_and_jacobian(goal.model, at(z).q)[0]),
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-8},
    ).x
    for z, least in ((low + 0.02, True), (top, False), (high - 0.02, True)):
        found = descend(at(z), observation_model, held, np.radians(0.1))
        assert found is not None
        assert (found.isolated, found.family, found.angle < 1e-9) == (least, False, least)


@pytest.mark.parametrize("name", ["prrrp_parallel", "prrrp_parallel_point"])
def test_poses_that_fill_a_curve_are_a_family_and_attract_to_no_pose(name: str):
    """Along parallel slides the directions stay the same; across them they do not."""
    setup = ObservedRobot.of(name)
    goal, observation_model = setup.all_samples.start, setup.samples.observation_model
    held = FixedValuesTask.at(goal.model, goal.q, observation_model.reference, observation_model.observations)
    home = setup.motion.position(goal.pose(setup.motion.link))
    for x, y in ((0.0, 0.0), (0.0, 0.05), (0.02, 0.05)):
        beside = solve_configurations(setup, [Pose(x=home[0] + x, y=home[1] + y)])[0]
        found = descend(beside, observation_model, held, 1e-6)
        assert found is not None
        assert (found.isolated, found.family) == (False, True)
        assert found.angle < 1e-9
        there = setup.motion.position(found.configuration.pose(setup.motion.link))
        assert there[0] == pytest.approx(home[0], abs=1e-6)
