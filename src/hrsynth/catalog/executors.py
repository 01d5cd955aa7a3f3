"""Executors of a build: this process, several on this machine, or a cluster. Parts return in any order."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import islice
from typing import Any

from ..errors import BadRequest, MissingExtra, WorkersLost
from ..processes import run_shared
from ..version import __version__

PARTS_PER_THREAD_COUNT = 3
"""Parts of a build waiting for each thread of a cluster."""

Made = list[tuple[str, str]]
"""Words with the lines of their records."""
Task = Callable[[list[str]], Made]
Executor = Callable[[Task, Iterable[list[str]]], Iterator[Made]]
"""Takes a task and the parts to do it on, gives what each part gave as soon as it is done."""

CLUSTER_TIMEOUT_S = 10.0
"""Seconds within which a cluster has to answer."""


class WorkInterruption(Exception):
    """A record that cannot be made, or those who make them are gone: why."""


def open_executor(workers: int = 1, cluster: str | None = None) -> Executor:
    """The executor of a number of processes, or of the cluster at an address; raises ``MissingExtra`` and
    ``BadRequest``."""
    if workers < 1:
        raise BadRequest("--workers", workers, "at least 1")
    if cluster is not None:
        if workers > 1:
            raise BadRequest("workers and a cluster", workers, "one of the two")
        _require("distributed", "a cluster")
        return lambda task, parts: _run_on_cluster(task, parts, cluster)
    if workers == 1:
        return _run_alone
    return lambda task, parts: _run_together(task, parts, workers)


def _require(package: str, what: str) -> None:
    from importlib.util import find_spec

    if find_spec(package) is None:
        raise MissingExtra(what, "cluster")


def _run_alone(task: Task, parts: Iterable[list[str]]) -> Iterator[Made]:
    for part in parts:
        for word in part:
            yield task([word])


def _run_together(task: Task, parts: Iterable[list[str]], workers: int) -> Iterator[Made]:
    try:
        yield from run_shared((partial(task, part) for part in parts), workers, ordered=False)
    except WorkersLost as lost:
        raise WorkInterruption(lost.reason) from None


def _run_on_cluster(task: Task, parts: Iterable[list[str]], address: str) -> Iterator[Made]:
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=CLUSTER_TIMEOUT_S, set_as_default=False)
    except (ValueError, TypeError) as error:
        raise BadRequest(f"--cluster {address}: {error}", remedy="Write it as tcp://host:8786.") from None
    except (OSError, ImportError):
        raise WorkInterruption(f"no cluster answers at {address} within {CLUSTER_TIMEOUT_S:g} s") from None
    try:
        yield from _serve_parts(client, task, iter(parts))
    finally:
        client.close(timeout=1)


def _serve_parts(client: Any, task: Task, parts: Iterator[list[str]]) -> Iterator[Made]:
    """Keeps some parts waiting on the cluster; a worker that is lost leaves its parts to the others."""
    from asyncio import CancelledError
    from concurrent.futures import CancelledError as FutureCancelled

    waiting: set[Any] = set()
    ahead = PARTS_PER_THREAD_COUNT * max(2, sum(client.nthreads().values()))
    try:
        while waiting := waiting | _submit(client, task, islice(parts, ahead - len(waiting))):
            done, waiting = _wait_for_parts(client, waiting)
            for future in done:
                yield _take_result(future)
    except (OSError, CancelledError, FutureCancelled):
        raise WorkInterruption("the cluster does not answer") from None


def _submit(client: Any, task: Task, parts: Iterable[list[str]]) -> set[Any]:
    if client.status != "running":
        raise WorkInterruption("the cluster does not answer")
    return {client.submit(_run_with_version, task, part, pure=False) for part in parts}


def _wait_for_parts(client: Any, waiting: set[Any]) -> tuple[set[Any], set[Any]]:
    """Parts that are done, at least one of them unless time has passed, and those that are not."""
    from distributed import wait

    try:
        with client.as_current():
            done, rest = wait(waiting, timeout=CLUSTER_TIMEOUT_S, return_when="FIRST_COMPLETED")
    except TimeoutError:
        _require_alive(client)
        return set(), waiting
    return done, rest


def _take_result(future: Any) -> Made:
    """Return the result of a part; other errors than ``WorkInterruption`` and lost connections are those of the
    workers."""
    from concurrent.futures import CancelledError

    from distributed.scheduler import KilledWorker

    if future.cancelled():
        raise WorkInterruption("the cluster does not answer")
    try:
        version, found = future.result()
    except (WorkInterruption, OSError, CancelledError):
        raise
    except KilledWorker:
        raise WorkInterruption("the cluster's workers died one after the other on the same words") from None
    except Exception as error:
        raise WorkInterruption(
            f"the cluster's workers need hrsynth {__version__}: {str(error).splitlines()[0]}"
        ) from None
    if version != __version__:
        raise WorkInterruption(f"a worker of the cluster has hrsynth {version}, not {__version__}")
    return list(found)


def _require_alive(client: Any) -> None:
    """Raise ``WorkInterruption`` where the cluster no longer answers, or has no workers left."""
    try:
        workers = client.nthreads()
    except (RuntimeError, ValueError):
        raise WorkInterruption("the cluster does not answer") from None
    if not workers:
        raise WorkInterruption("the cluster has no workers left")


def _run_with_version(task: Task, part: list[str]) -> tuple[str, Made]:
    """Run a part; return its result with the version."""
    return __version__, task(part)
