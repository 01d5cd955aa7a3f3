"""Work that several processes share; they end with the process that shares it out, however that ends. What needs more
of the operating system than Python has everywhere."""

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

PARENT_WATCH = 0.5
"""Seconds within which a worker notices that its parent has ended."""
T = TypeVar("T")


def require_posix(what: str, *modules: str) -> None:
    """Raise ``NeedsPosix`` where one of the modules is missing."""
    for module in modules:
        try:
            import_module(module)
        except ImportError:
            raise NeedsPosix(what, module) from None


def run_shared(works: Iterable[Callable[[], T]], jobs: int, *, ordered: bool = True) -> Generator[T, None, None]:
    """What each piece of work gives, by ``jobs`` processes, with 1 in this one: in order, or as it comes. The rest is
    given up where the generator is closed. Raises ``WorkersLost``, and what a piece of work raises: with several
    processes as soon as it does.
    """
    if jobs <= 1:
        yield from (work() for work in works)
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import BrokenProcessPool, TerminatedWorkerError

    # nothing is passed through shared memory, which would be left there
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
    """Make this process end with its parent, which alone answers Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_WATCH)
    os._exit(1)
