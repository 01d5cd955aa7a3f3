"""Printing without control characters of others; on a terminal in colour, unless NO_COLOR is set."""

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
"""Verdicts by colour: good, partial, bad; first words of a row, or cells of a table."""
CODES = {"green": 32, "yellow": 33, "red": 31}
"""Codes of terminal colours."""
_PART = re.compile(r"^([A-Z][^:\n]*)(?=:$)", re.MULTILINE)
_TITLE = re.compile(r"^([a-zA-Z][^ ]*(?: [^ ]+){0,3})(  +)(?=\S)", re.MULTILINE)


def print_text(text: str, *, err: bool = False, paint: Callable[[str], str] = str) -> None:
    """Print a text to standard output, painted, or to standard error, which may be closed."""
    if not err:
        print(paint(escape_steering(text)), flush=True)
        return
    try:
        print(escape_steering(text), file=sys.stderr, flush=True)
    except OSError:
        close(sys.stderr)


def replace_line(text: str) -> None:
    """Overwrite the current line of standard error, and return to its start."""
    with contextlib.suppress(OSError, ValueError):
        print(f"\r{escape_steering(text)}\x1b[K", end="\r", file=sys.stderr, flush=True)


def close(stream: object) -> None:
    """Redirect a closed stream to the null device, so that no later write fails."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # type: ignore[attr-defined]


def may_use_colour() -> bool:
    """Return True if standard output and the user accept colours (https://no-color.org)."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb" and sys.stdout.isatty()


def paint_help(text: str) -> str:
    """Print the titles of a help in bold, if colours are wanted."""
    return _PART.sub("\x1b[1m\\1\x1b[0m", text) if may_use_colour() else text


def paint(text: str) -> str:
    """Paint a result: dim names of rows and coloured verdicts, if colours are wanted."""
    if not may_use_colour():
        return text
    for name, words in VERDICTS.items():
        shown = rf"(?:(?<=  )|(?<=: ))({'|'.join(words)})(?=[ ,]|$)"
        text = re.sub(shown, f"\x1b[{CODES[name]}m\\1\x1b[0m", text, flags=re.MULTILINE)
    return _TITLE.sub("\x1b[2m\\1\x1b[0m\\2", text)
