"""`hrsynth view`: a page whole or not at all, a record, refusals in one line."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

import pytest

import hrsynth
from hrsynth.cli import run_command


def ask(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = run_command(["view", *arguments])
    out, err = capfd.readouterr()
    return status, out, err


def assert_refused(answer: tuple[int, str, str], status: int, words: str) -> None:
    assert (answer[0], answer[1]) == (status, ""), answer
    assert answer[2].startswith("hrsynth: ")
    assert answer[2].count("\n") == 1
    assert words in answer[2]


def test_a_page_is_written_and_told(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    file = tmp_path / "out.html"
    status, out, err = ask(capfd, "rrrrr_m1", "--hidden", "--static", str(file))
    assert (status, err) == (0, "")
    assert "ΠR̲RR̲Π" in out
    assert f"The view is written to {file}.\n" in out
    assert file.read_text().startswith("<!DOCTYPE html>")
    assert list(tmp_path.iterdir()) == [file]


def test_the_record_says_what_is_shown(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    status, out, _ = ask(capfd, "rrrrr_m1", "--observe", "1,2", "--json")
    data = json.loads(out)
    assert (status, data["command"], data["robot"], data["file"]) == (0, "view", "rrrrr_m1", None)
    assert list(data["shown"]) == ["real"]
    assert [slider["name"] for slider in data["sliders"]] == ["x", "y"]
    assert all(len(slider["values"]) == len(slider["distances"]) for slider in data["sliders"])
    assert [mode["label"] for mode in data["modes"]] == ["2"]


@pytest.mark.parametrize("file", ["view.png", "view", "view.html.txt"])
def test_other_endings_are_refused(capfd: pytest.CaptureFixture[str], tmp_path: Path, file: str):
    assert_refused(ask(capfd, "rrrrr_m1", "--static", str(tmp_path / file)), 2, "unknown extension")
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_done_is_refused_in_one_line(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    pytest.importorskip("uvicorn")
    assert_refused(ask(capfd, "rrrrr_m1", "--static", str(tmp_path / "none" / "view.html")), 2, "no such folder")
    assert_refused(ask(capfd, "rrrrr_m1", "--observe", "7", "--no-open"), 2, "unknown leg or link")
    assert_refused(ask(capfd, "nobody", "--static", str(tmp_path / "view.html")), 2, "nobody")
    assert_refused(ask(capfd, "rrrrr_m1", "--port", "70000"), 2, "65535")
    assert not list(tmp_path.iterdir())


def test_a_port_that_is_taken_is_refused(capfd: pytest.CaptureFixture[str]):
    pytest.importorskip("uvicorn")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert_refused(ask(capfd, "rrrrr_m1", "--no-open", "--port", port), 2, "cannot serve the page")


@pytest.mark.slow
def test_the_page_is_told_what_the_command_line_says(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The processes that answer read the same robot, and what the page copies is what was typed."""
    pytest.importorskip("uvicorn")
    from hrsynth.present.studio import server

    told = []

    class Seen:
        address = "http://127.0.0.1:1/x/"

        def __init__(self, opening: server.StartupState, port: int) -> None:
            told.append((opening, port))

        def wait(self) -> None:
            raise KeyboardInterrupt

        def stop(self) -> None:
            told.append("stopped")

    monkeypatch.setattr(server, "StudioServer", Seen)
    file = str(tmp_path / "leg.xml")
    assert run_command(["convert", "3rrr_m1", file]) == 0
    capfd.readouterr()
    motors = ("shoulder_1", "shoulder_2", "shoulder_3")
    status, out, err = ask(
        capfd,
        file,
        "--platform",
        "platform",
        "--motors",
        ",".join(motors),
        "--as-written",
        "--observe",
        "1,dist_2",
        "--camera",
        "platform",
        "--no-open",
        "--port",
        "7",
        "--hidden",
    )
    assert (status, told[1:]) == (0, ["stopped"]), err
    assert out.endswith("The view is served at http://127.0.0.1:1/x/ (Ctrl-C ends it).\n")
    opening, port = told[0]
    assert port == 7
    assert opening.given == {"robot": file, "options": {"platform": "platform", "motors": motors, "as_written": True}}
    assert opening.first == {"watch": ["dist_1", "dist_2"], "camera": "platform", "hidden": True}
    assert json.loads(opening.message("t"))["panels"] is False


def test_without_what_serves_pages_the_extra_is_named_before_the_work(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.setattr(hrsynth, "view", pytest.fail)
    assert_refused(ask(capfd, "rrrrr_m1", "--no-open"), 3, 'pip install "hrsynth[studio]"')
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    file = tmp_path / "view.html"
    assert ask(capfd, "rrrrr_m1", "--static", str(file))[0] == 0
    assert file.is_file()
