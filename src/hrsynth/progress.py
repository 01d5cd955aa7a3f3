"""Progress through a context variable: :func:`report` emits a stage, :func:`on_progress` subscribes. An analysis that
nobody listens to shows itself on a terminal and in Jupyter; the logger ``hrsynth`` has each step at level DEBUG."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

SHOWN_AFTER_S, SHOWN_AGAIN_S = 2.0, 0.5
"""Seconds before an analysis in Python shows its progress, and between two updates."""
SHOWN_COLUMNS_COUNT = 78
"""Width of that line."""

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)
_part: ContextVar[str] = ContextVar("part", default="")


def report(stage: str, step: int | None = None, total: int | None = None) -> None:
    """Report one more step of a stage of the running analysis, as ``poses, 3 of 20`` if their total is known."""
    listener, text = _listener.get(), _part.get() + stage + ("" if total is None else f", {step} of {total}")
    if listener is not None:
        listener(text)
    if (logging := sys.modules.get("logging")) is not None:  # who listens has loaded it
        logging.getLogger("hrsynth").debug(text)


@contextmanager
def report_part(name: str) -> Iterator[None]:
    """Prefix stages reported within by the name of a part, as ``set 3 of 20: modes``."""
    token = _part.set(f"{_part.get()}{name}: ")
    try:
        yield
    finally:
        _part.reset(token)


def format_step(stage: str, step: int) -> str:
    """Return a stage with the number of its step, unless it has one itself."""
    return stage if re.search(r" of \d+$", stage) else f"{stage}, step {step}"


@contextmanager
def show_progress() -> Iterator[None]:
    """Show the stages reported within in one line on a terminal or in Jupyter, unless somebody listens already or
    ``HRSYNTH_PROGRESS=0``."""
    is_watched = sys.stderr.isatty() or "ipykernel" in sys.modules
    if _listener.get() is not None or not is_watched or os.environ.get("HRSYNTH_PROGRESS") == "0":
        yield
        return
    began = written = time.monotonic()
    steps, is_shown = 0, False

    def show(stage: str) -> None:
        nonlocal steps, written, is_shown
        steps, now = steps + 1, time.monotonic()
        if now - began > SHOWN_AFTER_S and now - written > SHOWN_AGAIN_S:
            written, is_shown = now, True
            line = f"{format_step(stage, steps)}, {now - began:.0f} s"[:SHOWN_COLUMNS_COUNT]
            print(f"\r{line:{SHOWN_COLUMNS_COUNT}}", end="", file=sys.stderr, flush=True)

    try:
        with on_progress(show):
            yield
    finally:
        if is_shown:
            print(f"\r{'':{SHOWN_COLUMNS_COUNT}}\r", end="", file=sys.stderr, flush=True)


@contextmanager
def on_progress(listener: Callable[[str], None]) -> Iterator[None]:
    """Call a function with the stage of each step of analyses in a ``with`` block.

    Parameters
    ----------
    listener : callable
        Function of one text, such as ``print``: the name of the stage, as ``poses, 3 of 20`` where it has an end.

    Returns
    -------
    context manager
        Restores the previous listener at its end.

    Notes
    -----
    The listener belongs to the context: other threads do not report to it. Without a listener an analysis of more than
    two seconds shows a line on a terminal and in Jupyter (not if the environment has ``HRSYNTH_PROGRESS=0``), and the
    logger ``hrsynth`` has every step at level ``DEBUG``.

    Examples
    --------
    >>> stages = []
    >>> with hrsynth.on_progress(stages.append):
    ...     found = hrsynth.observe("3rrr_m1", seed=7)
    >>> "sampling" in stages
    True
    """
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
