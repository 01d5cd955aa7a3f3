"""Columns of text, and rows of names with their values."""

from __future__ import annotations

from collections.abc import Sequence


def width(text: str) -> int:
    """Columns that ``text`` takes (combining low lines take none)."""
    return sum(1 for character in text if character != "\u0332")


def table(rows: Sequence[Sequence[str]], heads: Sequence[str]) -> str:
    """Columns set apart by two spaces, a rule under the heads; the last column is not padded."""
    everything = [list(heads), *map(list, rows)]
    columns = [max(width(row[i]) for row in everything) for i in range(len(heads))]

    def line(row: Sequence[str]) -> str:
        cells = [cell + " " * (columns[i] - width(cell)) for i, cell in enumerate(row)]
        return "  ".join(cells).rstrip()

    return "\n".join([line(heads), "  ".join("-" * size for size in columns), *map(line, rows)])


def listing(rows: Sequence[tuple[str, str]]) -> str:
    """A line a row, the values under each other; a name is left out where it is the same as before."""
    head = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{head}}  {value}".rstrip() for name, value in rows)
