"""`accuracy` on the command line: JSON, pictures, tables, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hrsynth.cli import run_command

QUATTRO = ("accuracy", "quattro", "--observe", "1,4", "--cone", "0.1deg")


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = run_command(list(arguments))
    out, err = capsys.readouterr()
    return status, out, err


def test_json_of_a_plane_is_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = told(capsys, *QUATTRO, "--plane", "z=-0.7", "--steps", "9", "--json")
    data = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert status == 0
    assert (data["robot"], data["command"], len(data["x"]), len(data["y"])) == ("quattro", "accuracy", 9, 9)
    for name in ("position_mm", "orientation_deg", "reached"):
        assert [len(row) for row in data[name]] == [9] * 9
    cells = list(
        zip(
            *([value for row in data[name] for value in row] for name in ("reached", "position_mm", "orientation_deg")),
            strict=True,
        )
    )
    for reached, *values in cells:
        assert all((value is not None and value > 0) is reached for value in values)
    assert {reached for reached, *_ in cells} == {True, False}
    assert data["checked"]["poses"] > 0


@pytest.mark.slow
def test_files_and_text(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for grid, name in (
        (("--plane", "z=-0.7", "--steps", "15"), "map.png"),
        (("--grid", "x=-0.9:0.9:5,y=0,z=-0.7"), "line.png"),
        (("--grid", "x=-0.3:0.3:4,y=-0.3:0.3:4,z=-0.8:-0.6:2"), "box.png"),
        (("--grid", "x=-0.9:0.9:5,y=0,z=-0.7"), "line.csv"),
    ):
        status, out, err = told(capsys, *QUATTRO, *grid, "-o", str(tmp_path / name))
        assert (status, err) == (0, "")
        assert "against Pinocchio" in out
        assert name in out
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    lines = (tmp_path / "line.csv").read_text().splitlines()
    assert lines[0] == "x,position_mm,orientation_deg"
    assert [line.endswith(",,") for line in lines[1:]] == [True, False, False, False, True]


@pytest.mark.some(4)
@pytest.mark.parametrize(
    ("arguments", "status", "word"),
    [
        (("--cone", "90deg"), 2, "less than 90deg"),
        (("--cone", "0"), 2, "more than 0"),
        (("--cone", "1e-300deg"), 2, "at least 1e-15"),
        (("--at", "x=5"), 3, "is not reached"),
        (("--plane", "z=5"), 3, "no pose of the plane"),
        (("--grid", "x=0:1:4000,y=0:1:4000,z=-0.7"), 2, "at most 10000000"),
        (("--grid", "x=0:1:1,z=-0.7"), 2, "a count of 2 to"),
        (("-o", "map.png"), 2, "--plane or --grid"),
        (("--plane", "z=-0.7", "-o", "map.txt"), 2, "unknown extension"),
        (("-o", "map.npy"), 2, "--plane or --grid"),
        (("--grid", "x=0:1:100000,y=0:1:100000,z=0:1:2", "-o", "map.npy"), 2, "at most 10000000000"),
        (("--grid", "x=5:6:3,z=-0.7", "-o", "map.npy"), 3, "none of 3 is"),
        (("--plane", "z=-0.7", "-o", "/nowhere/map.png"), 2, "nowhere"),
    ],
)
def test_refusals_are_one_line(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], status: int, word: str
) -> None:
    found, out, err = told(capsys, *QUATTRO, *arguments)
    assert (found, out) == (status, "")
    (line,) = err.splitlines()
    assert line.startswith("hrsynth: ")
    assert word in line


@pytest.mark.parametrize(("legs", "word"), [("1", "do not determine"), ("7", "unknown leg or link")])
def test_legs_that_cannot_be_watched_are_refused_in_one_line(
    capsys: pytest.CaptureFixture[str], legs: str, word: str
) -> None:
    found, out, err = told(capsys, *(legs if each == "1,4" else each for each in QUATTRO))
    assert (found, out) == (2, "")
    (line,) = err.splitlines()
    assert word in line


@pytest.mark.slow
def test_a_planar_robot_has_the_plane_in_which_it_moves(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    robot = ("accuracy", "rrrrr_m1", "--cone", "0.1deg", "--steps", "9")
    status, out, _ = told(capsys, *robot, "--plane", "z=0", "-o", str(tmp_path / "map.png"))
    assert (status, "9 x × 9 y" in out) == (0, True)
    status, _, err = told(capsys, *robot, "--plane", "z=0.1")
    assert (status, "cannot change z" in err) == (2, True)


def test_an_angle_without_a_unit_is_told_in_degrees(capsys: pytest.CaptureFixture[str]) -> None:
    for cone, words in (
        ("0.1", ["--cone 0.1: taken as radians, 5.73 degrees"]),
        ("0.1deg", []),
        ("1=0.1deg,4=0.002", ["--cone 4=0.002: taken as radians, 0.115 degrees"]),
    ):
        status, _, err = told(capsys, "accuracy", "quattro", "--observe", "1,4", "--cone", cone, "--json")
        assert status == 0
        found = [line.removeprefix("hrsynth: ") for line in err.splitlines() if "taken as radians" in line]
        assert [line.partition(" (")[0] for line in found] == words
