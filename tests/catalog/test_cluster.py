"""A dask cluster: the same bytes, whoever of it dies; where all of it dies, one line and nothing lost."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from catalog.stub import slowly, source
from catalog.test_build import TESTS, content, lines_in
from hrsynth.catalog.build import build
from hrsynth.catalog.executors import open_executor
from hrsynth.errors import BadRequest, BuildInterruption

pytest.importorskip("distributed")
SIZES = (24, 12)


def cluster(code: str) -> tuple[subprocess.Popen[str], str]:
    """A process that runs a cluster, and its address."""
    head = "import time; from distributed import LocalCluster\nif __name__ == '__main__':\n    cluster = LocalCluster("
    tail = "dashboard_address=None)\n    print(cluster.scheduler_address, flush=True)\n    time.sleep(300)\n"
    process = subprocess.Popen(
        [sys.executable, "-c", head + code + tail],
        stdout=subprocess.PIPE,
        text=True,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": str(TESTS)},
        start_new_session=True,
    )
    return process, process.stdout.readline().strip()


@pytest.fixture
def two_workers() -> Iterator[tuple[subprocess.Popen[str], str]]:
    process, address = cluster("n_workers=2, threads_per_worker=1, processes=True, ")
    yield process, address
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def meanwhile(folder: Path, act) -> threading.Thread:
    """Do something as soon as the build has written some records."""

    def watch() -> None:
        end = time.monotonic() + 60
        while lines_in(list(folder.glob("*.part"))) < 10 and time.monotonic() < end:
            time.sleep(0.01)
        act()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


def worker_processes(address: str) -> list[int]:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        return sorted(client.run(os.getpid).values())


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(two_workers, tmp_path: Path):
    _, address = two_workers
    workers = worker_processes(address)
    assert len(workers) == 2
    killer = meanwhile(tmp_path / "far", lambda: os.kill(workers[0], signal.SIGKILL))
    build(tmp_path / "far", source=replace(source(SIZES), entry=slowly), cluster=address)
    killer.join()
    assert workers[0] not in worker_processes(address)
    build(tmp_path / "near", source=source(SIZES))
    assert content(tmp_path / "far") == content(tmp_path / "near")


@pytest.mark.slow
def test_a_cluster_that_dies_stops_the_build_and_keeps_the_journal(two_workers, tmp_path: Path):
    process, address = two_workers
    killer = meanwhile(tmp_path / "far", lambda: os.killpg(process.pid, signal.SIGKILL))
    with pytest.raises(BuildInterruption, match=r"the cluster does not answer; finished work is kept in") as stopped:
        build(tmp_path / "far", source=replace(source(SIZES), entry=slowly), cluster=address)
    killer.join()
    assert len(stopped.value.lines()) == 1
    assert stopped.value.exit_status == 3
    kept = lines_in(list((tmp_path / "far").glob("*.part"))) - len(SIZES)
    assert kept > 5
    done = build(tmp_path / "far", source=source(SIZES))
    assert sum(each.before for each in done) == kept
    build(tmp_path / "near", source=source(SIZES))
    assert content(tmp_path / "far") == content(tmp_path / "near")


@pytest.mark.parametrize(
    ("address", "said", "status"),
    [
        ("tcp://127.0.0.1:1", "no cluster answers at tcp://127.0.0.1:1 within", 3),
        ("smoke://hill", "--cluster smoke://hill: ", 2),
        ("tcp://127.0.0.1:none", "--cluster tcp://127.0.0.1:none: ", 2),
    ],
)
def test_a_dead_or_wrong_address_is_one_line(
    address: str,
    said: str,
    status: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
):
    monkeypatch.setattr("hrsynth.catalog.executors.CLUSTER_TIMEOUT_S", 1.0)
    with pytest.raises((BuildInterruption, BadRequest), match=re.escape(said)) as stopped:
        build(tmp_path, source=source(), cluster=address)
    assert stopped.value.exit_status == status
    assert len(stopped.value.lines()) == 1
    assert capfd.readouterr().err == ""


def test_workers_or_a_cluster_but_some():
    for arguments in ((0, None), (2, "tcp://127.0.0.1:1")):
        with pytest.raises(BadRequest, match="workers"):
            open_executor(*arguments)
