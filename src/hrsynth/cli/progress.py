"""Progress on standard error: on a terminal a line that is updated after the first second, elsewhere a line after half
a minute, then at doubled intervals."""

from __future__ import annotations

import os
import shutil
import sys
import threading
import time
from collections import deque
from datetime import timedelta
from typing import Self

from ..progress import format_step
from .colour import print_text, replace_line

BUILD_SPEED_WINDOW_S = 600.0
"""Seconds over which the speed of a build is averaged."""
PROGRESS_LINE_INTERVAL_S = 30.0
"""Seconds before the first line without a terminal; later lines at doubled times."""
OFTEN, AGAIN = 0.1, 1.0
"""Shortest and longest time between two updates on a terminal (s)."""
PROGRESS_BAR_COLUMNS_COUNT = 40
"""Width of a bar (columns)."""


class Progress:
    """Progress line of a long command: its stage and number of steps, or with ``counted`` the finished part of a build
    and the time left."""

    def __init__(self, wait: float = 1.0, *, counted: bool = False) -> None:
        self._began = time.monotonic()
        self._start = self._began + wait
        self._counted = counted
        self._terminal = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        self._lock = threading.Lock()
        self._what = "working"
        self._done, self._total = 0, 0
        self._parts: dict[str, tuple[int, int]] = {}
        self._known = deque[tuple[float, int]]()
        self._written: float | None = None
        self._arm(max(0.0, wait) if self._terminal else PROGRESS_LINE_INTERVAL_S)

    def __enter__(self) -> Self:
        if self._terminal or not self._counted:
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._start = float("inf")
            if self._written is not None:
                self._write()
                replace_line("")
        self._timer.cancel()

    def tell(self, what: str) -> None:
        """Count one more step of a stage."""
        self._show(what, self._done + 1)

    def count(self, part: str, done: int, total: int) -> None:
        """Set the number of finished entries of a part."""
        self._parts[part] = done, total
        there, self._total = map(sum, zip(*self._parts.values(), strict=True))
        self._known.append((time.monotonic(), there))
        while self._known[-1][0] - self._known[0][0] > BUILD_SPEED_WINDOW_S:
            self._known.popleft()
        self._show(part, there)

    def _show(self, what: str, done: int) -> None:
        with self._lock:
            now = time.monotonic()
            self._what, self._done = what, done
            if self._terminal and now >= self._start and now - (self._written or self._began) >= OFTEN:
                self._write()

    def _arm(self, seconds: float) -> None:
        self._timer = threading.Timer(seconds, self._again)
        self._timer.daemon = True

    def _again(self) -> None:
        """Write the line, and schedule the next one."""
        with self._lock:
            if self._start == float("inf"):
                return
            passed = time.monotonic() - self._began
            if self._terminal:
                self._write()
            else:
                print_text(f"hrsynth: {format_step(self._what, self._done)}, {passed:.0f} s", err=True)
            self._arm(AGAIN if self._terminal else passed)
            self._timer.start()

    def _write(self) -> None:
        self._written = time.monotonic()
        replace_line(self._line(self._written)[: shutil.get_terminal_size().columns - 1])

    def _line(self, now: float) -> str:
        if not self._total:
            return f"{format_step(self._what, self._done)} {_format_clock(now - self._began)}"
        began, before = self._known[0]
        left = "-:--:--"
        if self._done > before:
            left = _format_clock((now - began) * (self._total - self._done) / (self._done - before))
        full = PROGRESS_BAR_COLUMNS_COUNT * self._done // self._total
        bar = "━" * full + "─" * (PROGRESS_BAR_COLUMNS_COUNT - full)
        return f"{self._what} {bar} {self._done}/{self._total} {left} left"


def _format_clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
