"""What a long question is at: told by whatever works, heard by whoever follows, through no signature in between."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from inspect import signature
from typing import Any

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)


def tell(stage: str) -> None:
    """One more step of a stage of the question that is being answered."""
    listener = _listener.get()
    if listener is not None:
        listener(stage)


@contextmanager
def following(listener: Callable[[str], None]) -> Iterator[None]:
    """Tell a function each step of all that is asked within: ``with following(print): derive(robot)``."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def followed(question: Callable[..., Any]) -> Callable[..., Any]:
    """A question that also takes the listener itself, as ``progress``."""
    @wraps(question)
    def asked(*args: Any, progress: Callable[..., None] | None = None, **kwargs: Any) -> Any:
        if progress is None:
            return question(*args, **kwargs)
        listener = progress if signature(progress).parameters else lambda stage: progress()
        with following(listener):
            return question(*args, **kwargs)
    return asked
