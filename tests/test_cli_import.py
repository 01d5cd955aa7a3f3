"""The guided reader: asked at a terminal or not, its answers are options, and the command it prints does the same."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import select
import shlex
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import numpy as np
import pytest

from description.samples import FOUR_BAR
from hrsynth.cli import run_command
from hrsynth.description import load, save

SECONDS = 60


def told_of(folder: Path) -> Path:
    """A four-bar as its spanning tree alone, with a frame on either side of the open joint."""
    text = FOUR_BAR[: FOUR_BAR.index("  <loop")] + "</robot>"
    frames = "".join(
        f'<link name="{link}_end"/><joint name="{link}_fix" type="fixed"><parent link="{link}"/>'
        f'<child link="{link}_end"/><origin xyz="{at}"/></joint>'
        for link, at in (("bar", "2 0 0"), ("rocker", "0 0 1"))
    )
    path = folder / "open.urdf"
    path.write_text(text.replace("</robot>", frames + "</robot>"))
    return path


def at_a_terminal() -> None:
    """What a terminal gives a process: control, and interrupts, even where its parent takes none."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def talk(folder: Path, arguments: list[str], answers: list[str]) -> tuple[int, str]:
    """What a person at a terminal sees who answers each question (^C interrupts, ^D ends the input)."""
    main, end = pty.openpty()
    run = subprocess.Popen(
        [sys.executable, "-m", "hrsynth", *arguments],
        stdin=end,
        stdout=end,
        stderr=end,
        cwd=folder,
        env={**os.environ, "TERM": "dumb", "BROWSER": "true"},
        start_new_session=True,
        preexec_fn=at_a_terminal,
    )
    os.close(end)
    shown, left, until = b"", list(answers), time.monotonic() + SECONDS
    keys = {"^C": b"\x03", "^D": b"\x04"}
    while time.monotonic() < until:
        if select.select([main], [], [], 0.3)[0]:
            try:
                shown += os.read(main, 65536)
            except OSError:
                break
        elif shown.endswith((b"]: ", b"picture: ")):
            answer = left.pop(0) if left else "^D"
            os.write(main, keys.get(answer, answer.encode() + b"\n"))
        elif run.poll() is not None:
            break
    status = run.wait(5)
    os.close(main)
    return status, shown.decode().replace("\r", "")


def repeated(shown: str, folder: Path) -> None:
    """Run the command that was printed."""
    words = shlex.split(shown.rpartition("dialog: ")[2].strip().splitlines()[0])
    assert words[0] == "hrsynth"
    subprocess.run(
        [sys.executable, "-m", *words], cwd=folder, check=True, capture_output=True, stdin=subprocess.DEVNULL
    )


@pytest.mark.slow
def test_a_dialog_closes_a_loop_and_its_command_writes_the_same_bytes(tmp_path: Path):
    told_of(tmp_path)
    answers = ["7", "frog", "bar_end:frog", "1", "", "99", "bar", "nobody", "a", "these", "yes"]
    status, shown = talk(tmp_path, ["import", "open.urdf", "-o", "closed.urdf"], answers)
    assert status == 0, shown
    assert "rocker_end:bar_end (0 mm)" in shown
    for said in ("numbers go from 1 to", "--close", "no such link", "unknown name"):
        assert said in shown
    assert "Traceback" not in shown
    robot = load(tmp_path / "closed.urdf")
    assert robot.platform == "bar"
    assert [name for name, joint in robot.joints.items() if joint.is_actuated] == ["a"]
    assert sum(not joint.in_tree for joint in robot.joints.values()) == 1
    written = (tmp_path / "closed.urdf").read_bytes()
    (tmp_path / "closed.urdf").unlink()
    repeated(shown, tmp_path)
    assert (tmp_path / "closed.urdf").read_bytes() == written


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("answers", "status"),
    [(["", "^C"], 130), (["", "^D"], 2), pytest.param(["", "", "", "", "no"], 0, marks=pytest.mark.slow)],
)
def test_giving_up_writes_nothing(answers: list[str], status: int, tmp_path: Path):
    save(load("3rps"), tmp_path / "robot.sdf")
    found, shown = talk(tmp_path, ["import", "robot.sdf", "-o", "out.urdf"], answers)
    assert found == status, shown
    assert "nothing written" in shown
    assert "Traceback" not in shown
    assert [path.name for path in tmp_path.iterdir()] == ["robot.sdf"]


@pytest.mark.slow
def test_the_questions_come_again_where_the_answers_do_not_fit(tmp_path: Path):
    told_of(tmp_path)
    answers = [
        "bar_end:crank:fixed",
        "",
        "bar",
        "a",
        "rocker_end:bar_end",
        "",
        "bar",
        "a",
        "frog",
        "crank",
        "again",
        "1",
        "",
        "bar",
        "a",
        "crank",
        "yes",
    ]
    status, shown = talk(tmp_path, ["import", "open.urdf", "-o", "closed.urdf"], answers)
    assert status == 0, shown
    assert "--observe crank" in shown
    assert shown.count("Base: base") >= 2
    assert [each.link for each in load(tmp_path / "closed.urdf").observations] == ["crank"]


@pytest.mark.parametrize("ending", [".xml", ".sdf", ".yaml", pytest.param(".usda", marks=pytest.mark.slow)])
def test_without_a_terminal_guesses_are_taken_and_told(ending: str, tmp_path: Path, capsys, monkeypatch):
    if ending == ".usda":
        pytest.importorskip("pxr")
    monkeypatch.chdir(tmp_path)
    save(load("3rps"), f"robot{ending}")
    if ending == ".xml":
        text = Path("robot.xml").read_text()
        Path("robot.xml").write_text("\n".join(line for line in text.splitlines() if "hrsynth_platform" not in line))
    assert run_command(["import", f"robot{ending}", "-o", "out.urdf"]) == 0
    out, err = capsys.readouterr()
    assert ("assumption: the platform" in err) is (ending == ".xml")
    written = Path("out.urdf").read_bytes()
    assert run_command(shlex.split(out.rpartition("dialog: ")[2])[1:]) == 0
    assert Path("out.urdf").read_bytes() == written
    robot, back = load("3rps"), load("out.urdf")
    assert (back.base, back.platform) == (robot.base, robot.platform)
    assert np.allclose(back.links[back.platform].pose, robot.links[robot.platform].pose, atol=1e-9)


def test_a_robot_without_motors_is_told(tmp_path: Path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told_of(tmp_path)
    for motors, told in (("", True), ("a", False)):
        asked = [
            "import",
            "open.urdf",
            "--close",
            "bar_end:rocker_end:revolute/0,0,1",
            "--platform",
            "bar",
            "--yes",
            "-o",
            "out.urdf",
            *["--motors", motors] * bool(motors),
        ]
        assert run_command(asked) == 0
        assert ("no joint is actuated" in capsys.readouterr().err) is told
        assert run_command([*asked, "--json"]) == 0
        assert any("no joint is actuated" in note for note in json.loads(capsys.readouterr().out)["notes"]) is told


def test_its_record_holds_the_command(tmp_path: Path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = told_of(tmp_path)
    asked = [
        "import",
        path.name,
        "--close",
        "bar_end:rocker_end:revolute/0,0,1",
        "--platform",
        "bar",
        "--motors",
        "a",
        "--observe",
        "crank",
        "-o",
        "out.urdf",
    ]
    assert run_command([*asked, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["base"], found["platform"]["link"], found["motors"]) == ("base", "bar", ["a"])
    assert "crank" in found["observed"].values()
    assert sorted(shlex.split(found["repeat"])) == sorted(["hrsynth", *asked, "--yes"])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["import", "3rps", "-o", "out.xml"], ".urdf"),
        (["import", "nobody", "-o", "out.urdf"], "neither a file"),
        (["import", "3rps", "-o", "away/out.urdf"], "no such folder"),
        (["import", "open.urdf", "-o", "open.urdf"], "it is the input file"),
        (["import", "open.urdf", "-o", "out.urdf"], "--platform"),
        (["import", "open.urdf", "--platform", "x", "-o", "out.urdf"], "no such platform"),
        (["import", "3rps"], "--output"),
    ],
)
def test_what_is_refused_is_one_line_and_writes_nothing(
    asked: list[str], said: str, tmp_path: Path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    told_of(tmp_path)
    assert run_command(asked) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") <= 2
    assert [path.name for path in tmp_path.iterdir()] == ["open.urdf"]
