"""Sweeps to a file: the numbers of the grid in memory, the same bytes however often they were broken off, refusals."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hrsynth import accuracy, load
from hrsynth.analysis.accuracy import swept
from hrsynth.errors import BadRequest, BuildInterruption, NoReachablePose
from hrsynth.mechanism.pose import Grid

ASKED: dict[str, Any] = {"cone": "0.1deg", "grid": "x=-0.9:0.9:9,y=-0.9:0.9:7,z=-0.8:-0.6:3"}


class Killed(BaseException):
    """What nobody catches."""


def swept_to(path: Path, part: int, monkeypatch: pytest.MonkeyPatch, *, stop: int | None = None, **asked: Any) -> Any:
    """A sweep in parts of so many poses, killed after so many of them."""
    draft, done = swept._SweepDraft.add, []

    def add(self: Any, rows: Any, tally: Any) -> None:
        draft(self, rows, tally)
        done.append(tally)
        if len(done) == stop:
            raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(swept, "SWEEP_PART", part)
        patched.setattr(swept._SweepDraft, "add", add)
        return accuracy("quattro_rigid", "1,2,3", into=path, **{**ASKED, **asked}).swept


def broken_off(path: Path, monkeypatch: pytest.MonkeyPatch, stop: int = 3) -> tuple[Path, Path]:
    """The part and the journal of a sweep that was killed."""
    with pytest.raises(Killed):
        swept_to(path, 50, monkeypatch, stop=stop)
    return path.with_name(path.name + ".part"), path.with_name(path.name + ".journal")


def test_a_file_holds_the_grid_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, field = swept_to(tmp_path / "s.npy", 50, monkeypatch), accuracy("quattro_rigid", "1,2,3", **ASKED).field
    held = np.load(tmp_path / "s.npy", mmap_mode="r")
    assert held.shape == field.grid.shape
    assert 0 < found.tally.reached == field.reached.sum() < field.reached.size
    for name in ("position", "orientation"):
        errors = getattr(field, name)
        assert np.array_equal(held[name], errors, equal_nan=True)
        told = getattr(found.tally, name)
        bounded = errors[errors <= (0.1 * load("quattro_rigid").length if name == "position" else np.inf)]
        assert told.least == np.nanmin(errors)
        assert told.largest >= bounded.max()
    assert found.tally.gap == field.gap
    assert found.spots.count > 0
    assert [each.name for each in tmp_path.iterdir()] == ["s.npy"]


def test_a_sweep_goes_on_with_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = swept_to(tmp_path / "whole.npy", 50, monkeypatch)
    part, journal = broken_off(tmp_path / "s.npy", monkeypatch)
    with part.open("ab") as rows, journal.open("ab") as lines:  # rows that no line tells of, a line that was torn
        rows.write(b"torn")
        lines.write(b'{"done": 18')
    found = swept_to(tmp_path / "s.npy", 50, monkeypatch)
    assert (found.before, whole.before) == (150, 0)
    assert found.tally == whole.tally
    assert (tmp_path / "s.npy").read_bytes() == (tmp_path / "whole.npy").read_bytes()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["s.npy", "whole.npy"]


def test_a_damaged_line_of_the_journal_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A digit that changed on the disk: the part is made again; a first line without checksum is refused."""
    whole = swept_to(tmp_path / "whole.npy", 50, monkeypatch)
    _, journal = broken_off(tmp_path / "s.npy", monkeypatch)
    *lines, last = journal.read_text().splitlines(keepends=True)
    assert '"reached": ' in last
    damaged = re.sub(r'("reached": )(\d)', lambda found: f"{found[1]}{(int(found[2]) + 1) % 10}", last, count=1)
    journal.write_text("".join([*lines, damaged]))
    found = swept_to(tmp_path / "s.npy", 50, monkeypatch)
    assert (found.before, found.tally) == (100, whole.tally)
    assert (tmp_path / "s.npy").read_bytes() == (tmp_path / "whole.npy").read_bytes()
    broken_off(tmp_path / "t.npy", monkeypatch)
    journal = tmp_path / "t.npy.journal"
    journal.write_text(re.sub(r" [0-9a-f]{8}$", "", journal.read_text(), flags=re.MULTILINE))
    with pytest.raises(BadRequest, match="not the journal of a sweep"):
        swept_to(tmp_path / "t.npy", 50, monkeypatch)


def test_a_lost_part_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part, _ = broken_off(tmp_path / "s.npy", monkeypatch)
    os.truncate(part, 500)
    assert swept_to(tmp_path / "s.npy", 50, monkeypatch).before == 0
    assert not np.isnan(np.load(tmp_path / "s.npy")["position"]).all()


@pytest.mark.parametrize("other", [{"cone": "0.2deg"}, {"grid": "x=-0.9:0.9:9,y=-0.9:0.9:7,z=-0.8:-0.5:3"}])
def test_another_question_does_not_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: dict[str, str]
) -> None:
    part, journal = broken_off(tmp_path / "s.npy", monkeypatch)
    before = part.read_bytes(), journal.read_bytes()
    with pytest.raises(BadRequest, match="journal of an interrupted sweep with other options"):
        swept_to(tmp_path / "s.npy", 50, monkeypatch, **other)
    assert (part.read_bytes(), journal.read_bytes()) == before


def test_one_sweep_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, grid = tmp_path / "s.npy", Grid.parse(ASKED["grid"])
    with swept._SweepDraft(target, grid, "", False), pytest.raises(BadRequest, match="another sweep writes this file"):
        swept_to(target, 50, monkeypatch)
    (tmp_path / "s.npy.journal").write_text("notes of mine\n")
    with pytest.raises(BadRequest, match="not the journal of a sweep"):
        swept_to(target, 50, monkeypatch)
    assert (tmp_path / "s.npy.journal").read_text() == "notes of mine\n"


def test_a_full_disk_is_told_and_nothing_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "s.npy"
    with monkeypatch.context() as patched:
        patched.setattr(swept.shutil, "disk_usage", lambda _: type("Usage", (), {"free": 1000}))
        with pytest.raises(BadRequest, match=r"size of the file in bytes: got [0-9]+, expected at most"):
            swept_to(target, 50, monkeypatch)
    broken_off(target, monkeypatch)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(swept.os, "fsync", full)
        with pytest.raises(BuildInterruption, match=r"the sweep stopped: .*No space left"):
            swept_to(target, 50, monkeypatch)
    assert swept_to(target, 50, monkeypatch).before == 150


@pytest.mark.parametrize(
    ("into", "asked", "word"),
    [
        ("s.txt", {}, r"expected \*\.npy"),
        ("nowhere/s.npy", {}, "no such folder"),
        ("s.npy", {"grid": None}, "only errors over a plane or grid"),
        ("s.npy", {"nonlinear": 4}, "cannot be combined with an array file"),
    ],
)
def test_refusals(tmp_path: Path, into: str, asked: dict[str, Any], word: str) -> None:
    with pytest.raises(BadRequest, match=word):
        accuracy("quattro_rigid", "1,2,3", into=tmp_path / into, **{**ASKED, **asked})
    assert not list(tmp_path.iterdir())


def test_poses_one_by_one_and_out_of_reach_leave_nothing(tmp_path: Path) -> None:
    with pytest.raises(BadRequest, match="one by one"):
        accuracy("3rps", cone="0.1deg", grid="z=0.4:0.5:4", into=tmp_path / "s.npy")
    with pytest.raises(NoReachablePose):
        accuracy("quattro_rigid", "1,2,3", cone="0.1deg", grid="x=5:6:3,z=-0.7", into=tmp_path / "s.npy")
    assert not list(tmp_path.iterdir())


def test_memory_is_that_of_a_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No array of a sweep has more rows than a part, where that has the poses of the check too."""
    largest = []
    inner = Grid.places_at

    def places_at(self: Grid, cells: Any) -> Any:
        largest.append(len(cells))
        return inner(self, cells)

    monkeypatch.setattr(Grid, "places_at", places_at)
    swept_to(tmp_path / "s.npy", 20, monkeypatch)
    assert max(largest) == 20
