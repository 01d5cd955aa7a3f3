"""Processes that share work: none outlives the command, however that ends, and nothing stays in shared memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from hrsynth.errors import WorkersLost
from hrsynth.processes import run_shared

COMMANDS = {
    "basins": ["basins", "rrrrr_m1", "--goal", "x=0.02,y=0.24", "--grid", "x=-0.2:0.2:45,y=0.1:0.3:45", "--jobs", "2"],
    "equilibria": ["equilibria", "3rrr_m1", "--complete", "--jobs", "2"],
    "build": ["catalog", "build", "planar", "-o", "built", "--workers", "2"],
    "site": ["catalog", "site", "--group", "planar", "-o", "site", "--workers", "2"],
}
CLI = """
import sys
import hrsynth.solving.exhaust as boxes
from hrsynth.cli import run_command
boxes.SERIAL_BOXES_COUNT, boxes.BOXES_A_PART = 1, 1000
sys.exit(run_command(sys.argv[1:]))
"""
MAP = "import hrsynth; hrsynth.map_robots('check', ['quattro'], poses=['z=-0.7'] * 20_000, jobs=2)"
END = 15.0
"""Seconds within which all processes have ended, one that was still starting too; left alone they wait for minutes."""
SHARED_MEMORY = Path("/dev/shm")


def processes(mark: str) -> dict[int, str]:
    """The running processes that inherited a mark in their environment, and how they were called."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if (
                mark.encode() in (folder / "environ").read_bytes().split(b"\0")
                and (folder / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
            ):
                found[int(folder.name)] = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:  # it ended meanwhile
            continue
    return found


def waited_for(condition, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return bool(condition())


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")
@pytest.mark.some(0, 5)
@pytest.mark.parametrize("name", [*COMMANDS, "map"])
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL, signal.SIGINT], ids=lambda how: how.name)
def test_no_process_outlives_the_command(how: signal.Signals, name: str, tmp_path: Path):
    mark = f"HRSYNTH_TESTED={name} {how.name} {time.monotonic()}"
    before = set(SHARED_MEMORY.iterdir()) if SHARED_MEMORY.is_dir() else set()
    environment = dict([*os.environ.items(), tuple(mark.split("=", 1))])
    command = subprocess.Popen(
        [sys.executable, "-c", *([MAP] if name == "map" else [CLI, *COMMANDS[name]])],
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        assert waited_for(lambda: sum("LokyProcess" in each for each in processes(mark).values()) >= 2, 60)
        time.sleep(1.0)  # they are at work
        assert command.poll() is None
        command.send_signal(how)
        command.wait(2.0 if how == signal.SIGINT else END)
        assert waited_for(lambda: not processes(mark), END), processes(mark)
        left = set(SHARED_MEMORY.iterdir()) - before if SHARED_MEMORY.is_dir() else set()
        assert not [each for each in left if str(command.pid) in each.name]
    finally:
        for pid in processes(mark):
            os.kill(pid, signal.SIGKILL)
        command.wait()


@pytest.mark.slow
def test_a_worker_that_dies_is_one_line():
    die = partial(signal.raise_signal, signal.SIGKILL)  # of a module that each worker can import
    with pytest.raises(WorkersLost, match="a worker process died") as lost:
        list(run_shared([die, die], 2))
    assert (lost.value.exit_status, len(lost.value.lines())) == (3, 1)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_what_work_gives_comes_in_order_and_what_it_raises_is_raised(jobs: int):
    assert list(run_shared((partial(divmod, 12, k) for k in (1, 5, 7)), jobs)) == [(12, 0), (2, 2), (1, 5)]
    with pytest.raises(ZeroDivisionError):
        list(run_shared((partial(divmod, 12, k) for k in (1, 0, 7)), jobs))
