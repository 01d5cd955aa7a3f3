"""Progress on standard error: nothing before a second has passed, nothing where that is no terminal."""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from types import TracebackType
from typing import Any, Self


class _Bar(ABC):
    """A bar that appears when a command takes long."""

    def __init__(self, wait: float = 1.0) -> None:
        self._start = time.monotonic() + wait
        self._bar: Any = None

    def __enter__(self) -> Self:
        return self

    def _show(self, what: str, done: int, total: int | None = None) -> None:
        if self._bar is None and time.monotonic() > self._start and sys.stderr.isatty():
            self._bar = self._made()
            self._bar.start()
            self._bar.add_task("", total=None, completed=done)
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=what, completed=done, total=total)

    @abstractmethod
    def _made(self) -> Any:
        """A bar of rich, which is imported here."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()


class Progress(_Bar):
    """What a command is at, and its steps, whose number nobody knows."""

    def __init__(self, wait: float = 1.0) -> None:
        super().__init__(wait)
        self._steps = 0

    def tell(self, what: str = "sets of legs") -> None:
        """One more step done."""
        self._steps += 1
        self._show(what, self._steps)

    def _made(self) -> Any:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        return Progress(TextColumn("{task.description}"), BarColumn(), TextColumn("step {task.completed:.0f}"),
                        TimeElapsedColumn(), console=Console(stderr=True), transient=True)


class Meter(_Bar):
    """A build, with the time left."""

    SPEED_OVER = 600.0
    """Seconds over which the speed is averaged: words differ much."""

    def __init__(self, wait: float = 1.0) -> None:
        super().__init__(wait)
        self._groups: dict[str, tuple[int, int]] = {}

    def tell(self, group: str, done: int, total: int) -> None:
        """So many records of a group are there."""
        self._groups[group] = done, total
        there, every = map(sum, zip(*self._groups.values(), strict=True))
        self._show(group, there, every)

    def _made(self) -> Any:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        return Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
                        TextColumn("left"), console=Console(stderr=True), transient=True,
                        speed_estimate_period=self.SPEED_OVER)
