"""`hrsynth studio`: it tells where its page is, ends cleanly however it is ended, refuses in one line."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hrsynth.cli import run_command
from hrsynth.cli.options import SOURCE
from hrsynth.present.studio.request import OPTIONS
from patience import allow
from present.studio_client import alive, soon

pytest.importorskip("uvicorn")


@contextlib.contextmanager
def started(*arguments: str, folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The program, and the address that it tells."""
    program = [sys.executable, "-m", "hrsynth.cli", "studio", "--no-browser", *arguments]
    ends = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}  # ignored ones are inherited
    before = {number: signal.signal(number, handler) for number, handler in ends.items()}
    with subprocess.Popen(
        program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(folder)}
    ) as running:
        for number, handler in before.items():
            signal.signal(number, handler)
        assert running.stdout is not None
        told = re.fullmatch(
            r"The studio is served at (http://127\.0\.0\.1:\d+/\S+/) \(Ctrl-C ends it\)\.\n", running.stdout.readline()
        )
        assert told
        try:
            yield running, told[1]
        finally:
            running.kill()


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            if int(file.read_text().rpartition(")")[2].split()[1]) == process:
                found.append(int(file.parent.name))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_it_ends_cleanly_and_leaves_nothing(tmp_path: Path, number: signal.Signals):
    with started("3rrr_m1", folder=tmp_path) as (running, _):
        forks = children(running.pid)
        assert len(forks) == 1
        begin = time.monotonic()
        running.send_signal(number)
        out, err = running.communicate(timeout=20)
        assert time.monotonic() - begin < allow(8)
        assert (out, err) == ("", "")
        assert running.returncode == (-number if number is signal.SIGKILL else 0)
        assert soon(lambda: not alive(forks[0]))
        assert number is signal.SIGKILL or list(tmp_path.iterdir()) == []


def ask(capfd: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = run_command(["studio", "--no-browser", *arguments])
    return status, *capfd.readouterr()


@pytest.mark.parametrize("content", ["", "<robot"])
def test_a_file_that_is_no_robot_file_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str], content: str):
    file = tmp_path / "robot.urdf"
    file.write_text(content)
    status, out, err = ask(capfd, str(file))
    assert (status, out) == (2, "")
    assert re.fullmatch(r"hrsynth: .*robot\.urdf:\d: (empty file|malformed XML): .*\n", err)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nobody"], "neither a file nor a shipped robot"),
        (["nothing.urdf"], "no such file"),
        (["--port", "70000"], "65535"),
        (["--port", "-1"], "at least 0"),
        (["3rrr_m1", "another"], "another"),
        (["3rrr_m1", "--observe", "1,,2"], "empty name"),
        (["/dev/null"], "not a regular file"),
        (["quattro", "--platform", "nobody"], "nobody"),
        (["quattro", "--base", "nobody"], "nobody"),
        (["--platform", "rod_1a"], "without a file: got .*platform"),
        ([str(Path(__file__).parent), "--arg", "a:=1"], "without a file: got .*args"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(capfd, arguments: list[str], words: str):
    status, out, err = ask(capfd, *arguments)
    assert (status, out) == (2, "")
    assert re.fullmatch(rf"hrsynth: .*{words}.*\n", err)


def test_the_page_takes_each_override_of_the_command_line():
    assert {option.name for option in SOURCE} - {"robot"} == {*OPTIONS}


def test_a_port_that_is_taken_is_an_error_not_another_port(capfd: pytest.CaptureFixture[str]):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        begin = time.monotonic()
        assert ask(capfd, "--port", str(port)) == (
            2,
            "",
            f"hrsynth: cannot serve the page: Address already in use: got {port}, expected a free port, or 0 for any\n",
        )
        assert time.monotonic() - begin < allow(5)


def test_without_its_libraries_the_extra_is_named(capfd, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    status, out, err = ask(capfd, "3rrr_m1")
    assert (status, out) == (3, "")
    assert 'pip install "hrsynth[studio]"' in err
    assert err.count("\n") == 1
