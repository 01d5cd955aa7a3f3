"""Work shared among processes, which end with their parent; checks of the operating system."""

from __future__ import annotations

import os
import signal
import time
import warnings
from collections.abc import Callable, Generator, Iterable
from importlib import import_module
from threading import Thread
from typing import TypeVar

from .errors import NeedsPosix, WorkersLost

PARENT_CHECK_INTERVAL_S = 0.5
"""Interval at which a worker checks that its parent is alive (s)."""
T = TypeVar("T")


def require_posix(what: str, *modules: str) -> None:
    """Raise ``NeedsPosix`` if one of the modules is missing."""
    for module in modules:
        try:
            import_module(module)
        except ImportError:
            raise NeedsPosix(what, module) from None


def run_shared(works: Iterable[Callable[[], T]], jobs: int, *, ordered: bool = True) -> Generator[T, None, None]:
    """Yield the result of each piece of work, in order or as it is ready, from ``jobs`` processes (1: this one).

    Closing the generator cancels the remaining work. Raises ``WorkersLost``, and the errors of the work: with several
    processes immediately.
    """
    if jobs <= 1:
        yield from (work() for work in works)
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import BrokenProcessPool, TerminatedWorkerError

    # no shared memory, which a killed process would leave behind
    pool = Parallel(
        n_jobs=jobs,
        batch_size=1,
        pre_dispatch=2 * jobs,
        max_nbytes=None,
        return_as="generator" if ordered else "generator_unordered",
        initializer=_end_with_parent,
        initargs=(os.getpid(),),
    )
    done = pool(delayed(work)() for work in works)
    try:
        yield from done
    except TerminatedWorkerError:
        raise WorkersLost("a worker process died") from None
    except BrokenProcessPool as error:
        raise WorkersLost(f"the worker processes cannot be used: {str(error).splitlines()[0]}") from None
    finally:
        with warnings.catch_warnings(action="ignore"):
            done.close()


def _end_with_parent(parent: int) -> None:
    """End this process with its parent, which alone handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_stop_with_parent, args=(parent,), daemon=True).start()


def _stop_with_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_INTERVAL_S)
    os._exit(1)
