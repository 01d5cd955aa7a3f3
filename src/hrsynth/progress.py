"""Progress through a context variable: :func:`report` emits a stage, :func:`on_progress` subscribes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)
_part: ContextVar[str] = ContextVar("part", default="")


def report(stage: str) -> None:
    """Report one more step of a stage of the running analysis."""
    listener = _listener.get()
    if listener is not None:
        listener(_part.get() + stage)


@contextmanager
def report_part(name: str) -> Iterator[None]:
    """Prefix stages reported within by the name of a part, as ``set 3 of 20: modes``."""
    token = _part.set(f"{_part.get()}{name}: ")
    try:
        yield
    finally:
        _part.reset(token)


@contextmanager
def on_progress(listener: Callable[[str], None]) -> Iterator[None]:
    """Call a function with the stage of each step of analyses in a ``with`` block.

    Parameters
    ----------
    listener : callable
        Function of one text, the name of the stage, such as ``print``.

    Returns
    -------
    context manager
        Restores the previous listener at its end.

    Notes
    -----
    The listener belongs to the context: other threads do not report to it.

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
