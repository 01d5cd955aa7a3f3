"""Tables of Markdown, and the pages that hold them between two marks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

END = "<!-- end -->"


def line(cells: Iterable[object]) -> str:
    """Return one row, bars in cells escaped."""
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


def table(heads: Sequence[object], rows: Iterable[Iterable[object]], words: int | None = None) -> str:
    """Return a table; columns after the first ``words`` (None: none) are numbers, flush right."""
    rules = ["---" if words is None or column < words else "---:" for column in range(len(heads))]
    return "".join(f"{line(cells)}\n" for cells in (heads, rules, *rows))


def block(text: str, start: str) -> str:
    """Return the text between the marks; raise ``ValueError`` if they are missing."""
    match = _between(start).search(text)
    if match is None:
        raise ValueError(f"no {start} … {END}")
    return match[2]


def replace_between(text: str, made: str, start: str) -> str:
    """Return the text with ``made`` between the marks."""
    block(text, start)
    return _between(start).sub(lambda match: match[1] + made + match[3], text)


def rewrite(file: str | Path, tables: Mapping[str, Callable[[], str]]) -> None:
    """Write those tables, by the marks before them, that a page contains."""
    text = Path(file).read_text(encoding="utf-8")
    for start, make in tables.items():
        text = replace_between(text, make(), start) if start in text else text
    Path(file).write_text(text, encoding="utf-8", newline="\n")


def _between(start: str) -> re.Pattern[str]:
    return re.compile(rf"({re.escape(start)}\n)(.*?)({re.escape(END)})", re.DOTALL)
