"""Colour on a terminal: names and verdicts stand out. None where the output is no terminal or NO_COLOR is set."""

from __future__ import annotations

import os
import re
import sys

import typer

VERDICTS = {
    "green": ("controllable", "regular", "same aspect", "goal", "passed"),
    "yellow": ("partially controllable", "not decided", "undecided"),
    "red": ("uncontrollable", "separated", "FAILED", r"Type [123] singularity", "constraint singularity", "boundary",
            "local minimum", "antipodal"),
}
"""Words that end a question well, not wholly, badly; they stand first in their row, or as a cell of a table."""
_TITLE = re.compile(r"^([a-zA-Z][^ ]*(?: [^ ]+){0,3})(  +)(?=\S)", re.MULTILINE)


def wanted() -> bool:
    """Whether standard output takes colours, and the user does too (https://no-color.org)."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb" and sys.stdout.isatty()


def heading(text: str) -> str:
    """The title of a part of the help."""
    return typer.style(text, bold=True) if wanted() else text


def painted(text: str) -> str:
    """An answer with its rows' names dimmed and its verdicts in colour, where that is wanted."""
    if not wanted():
        return text
    for name, words in VERDICTS.items():
        shown = rf"(?:(?<=  )|(?<=: ))({'|'.join(words)})(?=[ ,]|$)"
        text = re.sub(shown, typer.style(r"\1", fg=name), text, flags=re.MULTILINE)
    return _TITLE.sub(typer.style(r"\1", dim=True) + r"\2", text)
