"""What is printed, at once, without characters that steer a terminal but our own; on a terminal in colour, so that
names and verdicts stand out, unless NO_COLOR is set."""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Callable

from ..characters import escape_steering

VERDICTS = {
    "green": ("controllable", "regular", "same aspect", "goal", "passed"),
    "yellow": ("partially controllable", "nothing to control", "not decided", "undecided"),
    "red": (
        "uncontrollable",
        "separated",
        "FAILED",
        r"Type [123] singularity",
        "constraint singularity",
        "limit reached",
        "local minimum",
        "antipodal",
        "out of view",
    ),
}
"""Words that end a question well, not wholly, badly; they stand first in their row, or as a cell of a table."""
CODES = {"green": 32, "yellow": 33, "red": 31}
"""Of a terminal's colours."""
_PART = re.compile(r"^([A-Z][^:\n]*)(?=:$)", re.MULTILINE)
_TITLE = re.compile(r"^([a-zA-Z][^ ]*(?: [^ ]+){0,3})(  +)(?=\S)", re.MULTILINE)


def say(text: str, *, err: bool = False, paint: Callable[[str], str] = str) -> None:
    """Print a text to standard output, painted, or to standard error: if that takes nothing, nothing is said there."""
    if not err:
        print(paint(escape_steering(text)), flush=True)
        return
    try:
        print(escape_steering(text), file=sys.stderr, flush=True)
    except OSError:
        close(sys.stderr)


def overwrite(text: str) -> None:
    """Write the line of standard error from its beginning, clear the rest, and go back: what is written next takes its
    place."""
    with contextlib.suppress(OSError, ValueError):
        print(f"\r{escape_steering(text)}\x1b[K", end="\r", file=sys.stderr, flush=True)


def close(stream: object) -> None:
    """Let a stream that takes nothing more lead nowhere, so that no later write, or that at exit, fails."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # type: ignore[attr-defined]


def wants_colour() -> bool:
    """Whether standard output takes colours, and the user does too (https://no-color.org)."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb" and sys.stdout.isatty()


def paint_help(text: str) -> str:
    """A help with the titles of its parts in bold, where colours are wanted."""
    return _PART.sub("\x1b[1m\\1\x1b[0m", text) if wants_colour() else text


def paint(text: str) -> str:
    """An answer with its rows' names dimmed and its verdicts in colour, where that is wanted."""
    if not wants_colour():
        return text
    for name, words in VERDICTS.items():
        shown = rf"(?:(?<=  )|(?<=: ))({'|'.join(words)})(?=[ ,]|$)"
        text = re.sub(shown, f"\x1b[{CODES[name]}m\\1\x1b[0m", text, flags=re.MULTILINE)
    return _TITLE.sub("\x1b[2m\\1\x1b[0m\\2", text)
