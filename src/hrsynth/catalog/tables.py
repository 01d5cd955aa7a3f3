"""The SQLite file: a table of versions, and a table of lines with the columns that are asked for most."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import BadRequest
from .jsonl import FORMAT, record, require_version, word_of
from .words import VERSION

COLUMNS = {"legs": "INTEGER", "dof": "INTEGER", "motion": "TEXT", "verdict": "TEXT", "base_motors": "INTEGER",
           "fewest": "INTEGER"}
"""Fields of a record that have a column and an index."""


def write(path: Path, groups: Mapping[str, Iterable[str]]) -> None:
    """Write a new file: the same bytes for the same lines."""
    with contextlib.closing(sqlite3.connect(path)) as file:
        file.execute("PRAGMA journal_mode = OFF")
        columns = ", ".join(f"{name} {kind}" for name, kind in COLUMNS.items())
        file.execute('CREATE TABLE versions (format INTEGER, catalog INTEGER)')
        file.execute(f'CREATE TABLE records ("group" TEXT, word TEXT, {columns}, line TEXT, '
                     'PRIMARY KEY ("group", word)) WITHOUT ROWID')
        file.execute("INSERT INTO versions VALUES (?, ?)", (FORMAT, VERSION))
        marks = ", ".join("?" * (len(COLUMNS) + 3))
        for group, lines in sorted(groups.items()):
            rows = (_row(group, line) for line in sorted(lines, key=word_of))
            file.executemany(f"INSERT INTO records VALUES ({marks})", rows)
        for name in ("word", *COLUMNS):
            file.execute(f"CREATE INDEX records_{name} ON records ({name})")
        file.commit()


@contextlib.contextmanager
def opened(path: Path) -> Iterator[sqlite3.Connection]:
    """The file to read; raises ``BadRequest`` for something else, or another version."""
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as file:
            version = file.execute("SELECT format, catalog FROM versions").fetchone()
            require_version(version, str(path))
            yield file
    except sqlite3.Error as error:
        raise BadRequest(f"{path}: no file of the catalog: {error}") from None


def groups(file: sqlite3.Connection) -> list[str]:
    """The groups in a file, by name."""
    return [name for name, in file.execute('SELECT DISTINCT "group" FROM records ORDER BY 1')]


def lines(file: sqlite3.Connection, group: str, exactly: Mapping[str, Any]) -> list[str]:
    """The lines of a group by word, those with given values in the columns."""
    asked = {name: value for name, value in exactly.items() if name in COLUMNS}
    where = " AND ".join(['"group" = ?', *(f"{name} = ?" for name in asked)])
    rows = file.execute(f"SELECT line FROM records WHERE {where} ORDER BY word", (group, *asked.values()))
    return [text for text, in rows]


def _row(group: str, line: str) -> tuple[Any, ...]:
    found = record(line)
    return (group, found["word"], *(found.get(name) for name in COLUMNS), line)
