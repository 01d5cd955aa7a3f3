"""What is printed, at once; on a terminal in colour, so that names and verdicts stand out, unless NO_COLOR is set."""

from __future__ import annotations

import os
import re
import sys

VERDICTS = {
    "green": ("controllable", "regular", "same aspect", "goal", "passed"),
    "yellow": ("partially controllable", "nothing to control", "not decided", "undecided"),
    "red": ("uncontrollable", "separated", "FAILED", r"Type [123] singularity", "constraint singularity", "boundary",
            "local minimum", "antipodal", "lost from sight"),
}
"""Words that end a question well, not wholly, badly; they stand first in their row, or as a cell of a table."""
CODES = {"green": 32, "yellow": 33, "red": 31}
"""Of a terminal's colours."""
_TITLE = re.compile(r"^([a-zA-Z][^ ]*(?: [^ ]+){0,3})(  +)(?=\S)", re.MULTILINE)


def say(text: str, *, err: bool = False) -> None:
    """Print a text to standard output, or to standard error."""
    print(text, file=sys.stderr if err else sys.stdout, flush=True)


def wants_colour() -> bool:
    """Whether standard output takes colours, and the user does too (https://no-color.org)."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb" and sys.stdout.isatty()


def heading(text: str) -> str:
    """The title of a part of the help."""
    return f"\x1b[1m{text}\x1b[0m" if wants_colour() else text


def paint(text: str) -> str:
    """An answer with its rows' names dimmed and its verdicts in colour, where that is wanted."""
    if not wants_colour():
        return text
    for name, words in VERDICTS.items():
        shown = rf"(?:(?<=  )|(?<=: ))({'|'.join(words)})(?=[ ,]|$)"
        text = re.sub(shown, f"\x1b[{CODES[name]}m\\1\x1b[0m", text, flags=re.MULTILINE)
    return _TITLE.sub("\x1b[2m\\1\x1b[0m\\2", text)
