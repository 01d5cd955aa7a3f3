"""Progress on standard error: a bar on a terminal once a second has passed; elsewhere a line now and then once half a
minute has."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from ..characters import escape_steering
from .colour import say

SPEED_OVER = 600.0
"""Seconds over which the speed of a build is averaged: words differ much."""
SILENT = 30.0
"""Seconds after which a line is written where there is no terminal; each time as long again as all before."""


class Progress:
    """A bar that appears when a command takes long, whether or not that tells anything: what it is at and its steps,
    whose number nobody knows, or (``counted``) the parts of a build that are there of all, with the time left."""

    def __init__(self, wait: float = 1.0, *, counted: bool = False) -> None:
        self._began = time.monotonic()
        self._start = self._began + wait
        self._counted = counted
        self._timer = self._arm(max(0.0, wait), self._begin) if sys.stderr.isatty() else self._arm(SILENT, self._line)
        self._lock = threading.Lock()
        self._what = "working"
        self._bar: Any = None
        self._steps = 0
        self._parts: dict[str, tuple[int, int]] = {}

    def __enter__(self) -> Self:
        if not self._counted:
            self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._start = float("inf")
            if self._bar is not None:
                self._bar.stop()
        self._timer.cancel()

    def tell(self, what: str) -> None:
        """One more step done."""
        self._steps += 1
        self._show(what, self._steps)

    def count(self, part: str, done: int, total: int) -> None:
        """So many of a part's records are there."""
        self._parts[part] = done, total
        there, every = map(sum, zip(*self._parts.values(), strict=True))
        self._show(part, there, every)

    def _show(self, what: str, done: int, total: int | None = None) -> None:
        self._what = escape_steering(what)
        if self._bar is None and self._counted:
            self._begin()
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=self._what, completed=done, total=total)

    def _begin(self) -> None:
        """Show the bar, once its time has come."""
        with self._lock:
            if self._bar is None and time.monotonic() >= self._start and sys.stderr.isatty():
                bar = self._make_bar()
                bar.add_task(self._what, total=None, completed=self._steps)
                bar.start()
                self._bar = bar

    @staticmethod
    def _arm(seconds: float, then: Callable[[], None]) -> threading.Timer:
        timer = threading.Timer(seconds, then)
        timer.daemon = True
        return timer

    def _line(self) -> None:
        """Write what it is at, and when it is to be written again."""
        with self._lock:
            if self._start == float("inf"):
                return
            passed = time.monotonic() - self._began
            say(f"hrsynth: {self._what}, step {self._steps}, {passed:.0f} s", err=True)
            self._timer = self._arm(passed, self._line)
            self._timer.start()

    def _make_bar(self) -> Any:
        """A bar of rich, which is imported here."""
        from rich import progress
        from rich.console import Console

        columns = (
            [progress.MofNCompleteColumn(), progress.TimeRemainingColumn(), progress.TextColumn("left")]
            if (self._counted)
            else [progress.TextColumn("step {task.completed:.0f}"), progress.TimeElapsedColumn()]
        )
        what = progress.TextColumn("{task.description}", markup=False)
        return progress.Progress(
            what,
            progress.BarColumn(),
            *columns,
            console=Console(stderr=True),
            transient=True,
            speed_estimate_period=SPEED_OVER,
        )
