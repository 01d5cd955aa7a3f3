"""Grids of joints and motors: each cell is where the straight line from zero leads, and what cannot be is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import hrsynth
from hrsynth.analysis.configuration_report import ConfigurationReport
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest, PoseReachFailure
from hrsynth.mechanism import JointType
from kinematics.robots import ROBOTS


def spans_of(name: str, count: int = 2) -> list[tuple[str, float]]:
    """The first motors of a robot, each with how far its cells are from zero."""
    robot = hrsynth.load(name)
    motors = [joint for joint in robot.joints.values() if joint.is_actuated][:count]
    return [(joint.name, 0.05 if joint.type is JointType.PRISMATIC else 0.1) for joint in motors]


def numbers_of(posture: ConfigurationReport) -> dict[str, float]:
    """The distances from singularities; infinite ones left out."""
    return {name: value for name, value in posture.distances.to_dict().items() if value is not None}


@pytest.mark.some(4)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_cell_is_where_the_line_of_its_motors_leads(name: str) -> None:
    """Whatever the other cells are."""
    spans = spans_of(name)
    ranges = ",".join(f"{joint}={-span}:{span}:3" for joint, span in spans)
    found = hrsynth.check(name, grid=f"motors:{ranges}").grid
    assert found is not None
    cells = list(np.ndindex(found.grid.shape))
    assert len(found.postures) == len(cells) == 3 ** len(spans)
    for cell, here in zip(cells, found.postures, strict=True):
        wanted = {joint: span * (i - 1) for (joint, span), i in zip(spans, cell, strict=True)}
        try:
            (alone,) = hrsynth.check(name, at={"motors": wanted}).postures
        except PoseReachFailure:
            assert here is None
            continue
        assert here is not None
        assert str(here.pose) == str(alone.pose)
        assert numbers_of(here) == pytest.approx(numbers_of(alone), rel=1e-4, abs=1e-7)
        told = {joint: value for joint, value in here.coordinates.motors.items() if joint in wanted}
        assert told == pytest.approx(wanted, abs=1e-7)


def test_errors_over_motors_are_those_at_the_poses() -> None:
    (first, a), (second, b) = spans_of("delta")
    found = hrsynth.accuracy("delta", cone="0.1deg", grid=f"motors:{first}={-a}:{a}:3,{second}={-b}:{b}:2").field
    assert found is not None
    for cell in np.ndindex(found.grid.shape):
        values = {first: a * (cell[0] - 1), second: b * (2 * cell[1] - 1)}
        (alone,) = hrsynth.accuracy("delta", cone="0.1deg", at={"motors": values}).poses
        assert found.position[cell] == pytest.approx(alone.position.largest, rel=1e-6)
    assert not found.orientation.any()


def test_turns_of_a_grid_are_the_poses_with_these_angles() -> None:
    found = hrsynth.check("gough_stewart", grid="roll=-10deg:10deg:3,yaw=0:5deg:2,x=0,y=0").grid
    assert found is not None
    wanted = [f"x=0,y=0,rpy={roll}deg/0/{yaw}deg" for roll in (-10, 0, 10) for yaw in (0, 5)]
    alone = hrsynth.check("gough_stewart", at=wanted).postures
    for here, there in zip(found.postures, alone, strict=True):
        assert here is not None
        assert numbers_of(here) == pytest.approx(numbers_of(there), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("robot", "grid", "what"),
    [
        ("delta", "motors:nobody=0:1:3", "unknown among its motors"),
        ("delta", "motors:shoulder_1=0:1mm:3", "radians or deg"),
        ("linear_delta", "motors:guide_1=0:1deg:3", "metres or mm"),
        ("delta", "motors:shoulder_1=0:1:3,shoulder_2=0/1", "one number"),
    ],
)
def test_what_no_joint_can_have_is_refused(robot: str, grid: str, what: str) -> None:
    with pytest.raises(BadRequest, match=what):
        hrsynth.check(robot, grid=grid)


def test_files_of_a_grid_of_motors(tmp_path, capsys) -> None:
    """The table has a column for each motor, JSON the values under their kind, the picture is whole."""
    grid = "motors:shoulder_1=-0.2:0.2:3,shoulder_2=-0.1:0.1:2"
    for file in ("map.csv", "map.png"):
        assert run_command(["check", "delta", "--grid", grid, "-o", str(tmp_path / file)]) == 0
    head, *rows = (tmp_path / "map.csv").read_text().splitlines()
    assert head.startswith("shoulder_1,shoulder_2,state,")
    assert len(rows) == 6
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert run_command(["check", "delta", "--grid", grid, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["grid"]
    assert told["axes"] == ["shoulder_1", "shoulder_2"]
    assert told["motors"]["shoulder_2"] == [-0.1, 0.1]
    assert run_command(["accuracy", "delta", "--cone", "0.1deg", "--grid", grid, "-o", str(tmp_path / "map.npy")]) == 2
    assert run_command(["basins", "3rrr_m1", "--goal", "x=0,y=0,phi=0", "--grid", "motors:shoulder_1=0:1:3"]) == 2
