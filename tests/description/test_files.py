"""Robot files on disk: found by path or by name, refused when they are none, written whole or not at all."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from description.samples import FOUR_BAR, with_rods
from hrsynth import description
from hrsynth.description import files
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.mechanism.model import Mechanism
from patience import allow


def refused(path: str | Path) -> str:
    with pytest.raises(BadRobotFile) as caught:
        description.load(path)
    (line,) = caught.value.lines()
    assert line.startswith(str(path))
    return line


def test_what_is_saved_is_loaded(tmp_path: Path):
    robot = with_rods()
    path = tmp_path / "robot.urdf"
    description.save(robot, path)
    assert description.load(path).differences(robot) == []
    assert description.load(str(path)).file == str(path)
    assert list(tmp_path.iterdir()) == [path]
    path.chmod(0o640)
    description.save(description.load(path), path)
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_file_beside_is_found_by_its_bare_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Path("linkage").write_text(FOUR_BAR)
    assert description.load("linkage").name == "four_bar"


def test_junk_of_200_megabytes_is_refused_without_reading(tmp_path: Path):
    path = tmp_path / "junk.urdf"
    with open(path, "wb") as stream:
        stream.truncate(200_000_000)
    start = time.perf_counter()
    assert "file too large: got 200000000 bytes" in refused(path)
    assert time.perf_counter() - start < allow(0.2)


def test_what_is_no_file_is_refused(tmp_path: Path):
    assert "a folder with no robot file" in refused(tmp_path)
    assert "no such file" in refused(tmp_path / "missing.urdf")
    assert "cannot be read" in refused(tmp_path / ("x" * 5000 + ".urdf"))
    assert "cannot be read" in refused("a\0b.urdf")
    (tmp_path / "empty.urdf").touch()
    assert "empty file" in refused(tmp_path / "empty.urdf")
    os.mkfifo(tmp_path / "pipe.urdf")
    assert "not a regular file" in refused(tmp_path / "pipe.urdf")


def test_an_unknown_name_gets_close_matches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    robots = {name: tmp_path / f"{name}.urdf" for name in ("scissors", "linkage", "pendulum")}
    monkeypatch.setattr(description, "list_robots", lambda: robots)
    with pytest.raises(BadRequest) as caught:
        description.load("linkge")
    assert caught.value.lines() == [
        "neither a file nor a shipped robot: got 'linkge', expected a file or one of `hrsynth robots`, such as linkage"
    ]
    with pytest.raises(BadRequest, match="such as scissors, linkage, pendulum"):
        description.load("zzz")
    robots["linkage"].write_text(FOUR_BAR)
    assert description.load("linkage").name == "four_bar"


def test_the_shipped_robots_are_sorted_files():
    robots = description.list_robots()
    assert list(robots) == sorted(robots)
    assert all(path.is_file() and path.stem == name for name, path in robots.items())


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path: Path):
    robot = with_rods()
    for path in (tmp_path, tmp_path / "none" / "robot.urdf", tmp_path / ("x" * 300 + ".urdf"), "a\0b"):
        with pytest.raises(BadRequest) as caught:
            description.save(robot, path)
        assert len(caught.value.lines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "robot.urdf"
    path.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(BadRequest, match="No space left on device"):
        description.save(with_rods(), path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_to_a_file_stays_a_link(tmp_path: Path):
    real, link = tmp_path / "real.urdf", tmp_path / "link.urdf"
    real.write_text(FOUR_BAR)
    link.symlink_to(real)
    robot: Mechanism = with_rods()
    description.save(robot, link)
    assert link.is_symlink()
    assert description.load(real).name == "rods"


def test_a_planted_link_is_never_written_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Whoever guesses the name under which a file is drafted, or kept between two runs, gains nothing."""
    victim = tmp_path / "victim"
    victim.write_text("precious")
    monkeypatch.setattr("secrets.token_hex", lambda size: "0" * 2 * size)
    planted = tmp_path / f".robot.urdf.{'0' * 8}.tmp"
    planted.symlink_to(victim)
    with pytest.raises(BadRequest) as caught:
        description.save(with_rods(), tmp_path / "robot.urdf")
    assert len(caught.value.lines()) == 1
    monkeypatch.undo()
    for name in (f".robot.urdf.{os.getpid()}.tmp", "robot.urdf.part"):
        (tmp_path / name).symlink_to(victim)
    description.save(with_rods(), tmp_path / "robot.urdf")
    with pytest.raises(OSError, match="symbolic link"):
        files.open_kept(tmp_path / "robot.urdf.part")
    assert victim.read_text() == "precious"
    assert planted.is_symlink()


@pytest.mark.parametrize("mask", [0o022, 0o077])
def test_a_new_file_has_the_permissions_that_the_user_set(tmp_path: Path, mask: int):
    before = os.umask(mask)
    try:
        description.save(with_rods(), tmp_path / "robot.urdf")
    finally:
        os.umask(before)
    assert (tmp_path / "robot.urdf").stat().st_mode & 0o777 == 0o666 & ~mask


@pytest.mark.parametrize(("content", "hides"), [(b"\x7fELF\xff", False), (b"", False), (b" <robot name='x'/>", True)])
def test_only_a_robot_file_hides_a_shipped_robot_of_its_name(
    content: bytes, hides: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "quattro").write_bytes(content)
    monkeypatch.chdir(tmp_path)
    assert (description.find_robot_file("quattro") == Path("quattro")) is hides
    assert hides or description.load("quattro").name == "quattro"
    assert description.find_robot_file("./quattro") == Path("quattro")
