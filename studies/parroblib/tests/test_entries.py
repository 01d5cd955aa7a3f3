"""Published robots as entries: against what the screws of their legs say, which is computed without the engine."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import pytest

from hrsynth.cli import run_command
from parroblib import says
from parroblib.__main__ import main
from parroblib.entries import _sets, published_words
from parroblib.study import StudyCase, study
from parroblib.tables import read
from parroblib.tests.small_tables import write


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("published") / "tables")


@pytest.mark.slow
def test_entries_say_what_the_screws_of_the_legs_say(tables: Path):
    source = published_words(tables)
    for robot in read(tables).robots:
        entry = source.entry(robot.name)
        ((_, found),) = study([StudyCase(robot, robot.drives[0].angles)], 0)
        assert found.watched is not None
        assert found.motion is not None
        assert (entry["rank"], entry["fewest"]) == (found.watched.seen, found.watched.fewest)
        assert entry["dof"] == sum(found.motion)
        assert entry["motion"].startswith(f"{found.motion[0]}T")
        assert [each["rank"] for each in entry["choices"]] == [
            entry["dof"] - found.motors[drive.driven].left for drive in robot.drives
        ]
        assert entry["driven"] == any(each["rank"] == entry["dof"] for each in entry["choices"])


def test_sets_are_all_but_for_turns_of_the_robot(tables: Path):
    """Orbits of subsets by Burnside's lemma: under turns by one leg or, where legs are in pairs, by two."""
    for robot in read(tables).robots:
        n, step = robot.legs, 2 if robot.base in range(5, 9) or robot.platform in range(4, 7) else 1
        turns = range(0, n, step)
        for size in range(1, n + 1):
            fixed = [
                sum({(i + by) % n for i in each} == set(each) for each in combinations(range(n), size)) for by in turns
            ]
            assert len(list(_sets(robot, size))) == sum(fixed) / len(turns)


def test_the_tables_of_the_page_are_those_of_the_catalog() -> None:
    assert says.PAGE.read_text(encoding="utf-8") == says.page(), "the page is stale: make readme"


@pytest.mark.slow
def test_the_command_line(tables: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    kept, robot = tmp_path / "published.sqlite", tmp_path / "robot.urdf"
    assert main(["build", str(tables), "2T1R", "-o", str(kept)]) == 0
    assert main(["build", str(tables), "2T1R", "-o", str(kept), "--check"]) == 0
    capsys.readouterr()
    assert run_command(["catalog", "list", "--catalog", str(kept), "--verdict", "controllable", "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["entries"]
    assert (entry["key"], entry["hidden"], entry["group"]) == ("P3RRR1G1P1", "3-PiR*R", "2T1R")
    assert run_command(["catalog", "show", "P3RRR1G1P1", "--catalog", str(kept)]) == 0
    out = capsys.readouterr().out
    assert "motor choices  joint 1 of each leg: 3" in out
    assert "observed link" not in out
    assert main(["robot", str(tables), "P3RRR1G1P1", "-o", str(robot)]) == 0
    assert run_command(["derive", str(robot), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "controllable"
    for arguments, said in (
        (["robot", str(tables), "P9", "-o", str(robot)], "not a robot of these tables"),
        (["build", str(tmp_path), "-o", str(kept)], "no table of robots"),
        (["build", str(tables), "planar", "-o", str(kept)], "unknown group"),
    ):
        assert main(arguments) == 2
        assert said in (err := capsys.readouterr().err)
        assert err.count("\n") == 1
    for command, said in (
        (["show", "P3RRR1G1P1", "--catalog", str(kept), "-o", str(robot)], "parroblib robot"),
        (["site", "--catalog", str(kept), "-o", str(tmp_path / "site")], "no pages for published robots"),
    ):
        assert run_command(["catalog", *command]) == 2
        assert said in (err := capsys.readouterr().err)
        assert err.count("\n") == 1
