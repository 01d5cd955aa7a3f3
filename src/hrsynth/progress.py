"""What a long question is at: told by whatever works, heard by whoever follows, through no signature in between."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)
_part: ContextVar[str] = ContextVar("part", default="")


def report(stage: str) -> None:
    """Report one more step of a stage of the question that is being answered."""
    listener = _listener.get()
    if listener is not None:
        listener(_part.get() + stage)


@contextmanager
def part(name: str) -> Iterator[None]:
    """Report each stage within as one of a part of the question, as ``set 3 of 20: modes``."""
    token = _part.set(f"{_part.get()}{name}: ")
    try:
        yield
    finally:
        _part.reset(token)


@contextmanager
def on_progress(listener: Callable[[str], None]) -> Iterator[None]:
    """Report each step of all that is asked within to a function: ``with following(print): derive(robot)``.

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
