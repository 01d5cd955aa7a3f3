"""The columns of a SQLite file. What is asked of records is asked once of each value that they have, and of many texts
at once."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..budgets import LARGEST_RECORD
from ..errors import BadRequest
from .fits import FIELDS, TEXTS, chains, texts
from .jsonl import Record
from .search import WIDTHS, Flags, Texts, Whole, narrow_type

NOTATION, CHAIN, WORD, BARE, FOLDED = "notation as written", "chain", "word", "bare word", "folded word"
"""Columns beside those of fields and texts: notations; the names of legs, each with the number of its notation; words,
also without the marks of motors, and casefolded."""
PARTS = ("letters", "ends", "numbers")
"""Of a column: its texts, each once, and the number of that of each row; a word is that of its row."""


class Columns:
    """The columns of a file that is open. Only the rows ``among`` all have to be told, others may be told or not.
    Raises ``BadRequest`` where a column cannot be read."""

    def __init__(self, path: Path, file: sqlite3.Connection, among: Flags) -> None:
        self._path, self._file, self._among, self._rows = path, file, among, len(among)

    def having(self, name: str, test: Callable[[Any], bool]) -> Flags:
        """The rows of records that have a field whose value meets a test."""
        every = self._as_list(name)
        return np.array([any(map(test, each)) for each in every], bool)[self._numbers(name, len(every))]

    def holding(self, text: str) -> Flags:
        """The rows of records in which a casefolded text occurs in some field, or in a name under which the robot is
        known."""
        found = np.zeros(self._rows, bool)
        for name in TEXTS:
            fit = self._texts(name).holding(text)
            if fit.any():
                found |= fit[self._numbers(name, len(fit))]
        return self._or_words(found, FOLDED, lambda words: words.holding(text))

    def match(self, pattern: str) -> Flags:
        """The rows of records whose word, notation, or chain of some leg fits a pattern."""
        fit = np.zeros(len(self._texts(NOTATION)), bool)
        chain = self._texts(CHAIN).matching(pattern)
        fit[self._numbers(CHAIN, len(fit), len(chain))[chain]] = True
        found = self._or_words(fit[self._numbers(NOTATION, len(fit))], BARE, lambda words: words.matching(pattern))
        # without any ? a word that fits does so without its marks
        return self._or_words(found, WORD, lambda words: words.matching(pattern)) if "?" in pattern else found

    def values(self, name: str) -> list[Any]:
        """The values of a field that records have, each once, sorted."""
        try:
            return sorted(value for each in self._as_list(name) for value in each if value is not None)
        except TypeError:
            raise self._unreadable(name) from None

    def _as_list(self, name: str) -> list[list[Any]]:
        """Each value that a field has, in a list; an empty one for records without the field."""
        try:
            texts = self._texts(name)
            if len(texts.letters) > LARGEST_RECORD:
                raise ValueError
            return [list(json.loads(each)) for each in texts]
        except (ValueError, TypeError, RecursionError):
            raise self._unreadable(name) from None

    def _or_words(self, found: Flags, name: str, test: Callable[[Texts], Flags]) -> Flags:
        """The rows that are found already, or whose word, as a column has it, meets a test."""
        rest = np.flatnonzero(self._among & ~found)
        if len(rest):
            words = self._texts(name)
            if len(words) != self._rows:
                raise self._unreadable(name)
            found[rest] = test(words.at(rest))
        return found

    def _texts(self, name: str) -> Texts:
        """The texts of a column."""
        letters, ends = self._part(name, "letters"), self._part(name, "ends").astype(np.int64)
        found = Texts.ending(letters, ends)
        if (ends[-1] if len(ends) else 0) != len(letters) or (found.starts > ends).any():
            raise self._unreadable(name)
        return found

    def _numbers(self, name: str, kinds: int, count: int | None = None) -> Whole:
        """The numbers of the texts of all rows, below ``kinds``."""
        found = self._part(name, "numbers")
        if len(found) != (self._rows if count is None else count) or (found >= kinds).any():
            raise self._unreadable(name)
        return found

    def _part(self, name: str, part: str) -> Whole:
        """Numbers of a column: of letters, where texts end, which text a row has."""
        row = self._file.execute(f"SELECT rowid, {part}_width FROM columns WHERE name = ?", (name,)).fetchone()
        if row is None or row[1] not in WIDTHS:
            raise self._unreadable(name)
        with self._file.blobopen("columns", part, row[0], readonly=True) as content:
            return np.frombuffer(content.read()[: len(content) // row[1] * row[1]], f"<u{row[1]}")

    def _unreadable(self, name: str) -> BadRequest:
        return BadRequest(f"{self._path}: no file of the catalog: column {name!r} cannot be read")


class ColumnWriter:
    """Makes the columns of records that are told one after the other."""

    def __init__(self) -> None:
        self._kept = {name: dict[str, int]() for name in (*FIELDS, *TEXTS, NOTATION)}
        self._numbers = {name: list[int]() for name in self._kept}
        self._words = list[str]()

    def add(self, record: Record) -> None:
        """The next row."""
        self._words.append(record["word"])
        values = {name: _value(record, name) for name in FIELDS}
        for name, text in (values | {NOTATION: str(record.get("notation", ""))} | texts(record)).items():
            known = self._kept[name]
            self._numbers[name].append(known.setdefault(text, len(known)))

    def write(self, file: sqlite3.Connection) -> None:
        """The columns in a table of their own: the same bytes for the same records."""
        parts = ", ".join(f"{part}_width INTEGER, {part} BLOB" for part in PARTS)
        file.execute(f"CREATE TABLE columns (name TEXT PRIMARY KEY, {parts})")
        for name, known in self._kept.items():
            _write(file, name, known, self._numbers[name])
        owned = [
            (chain, i)
            for i, notation in enumerate(self._kept[NOTATION])
            for chain in sorted(chains({"notation": notation}))
        ]
        _write(file, CHAIN, (chain for chain, _ in owned), [i for _, i in owned])
        bare = (word.replace("*", "") for word in self._words)
        for name, words in ((WORD, self._words), (BARE, bare), (FOLDED, map(str.casefold, self._words))):
            _write(file, name, words, ())


def _value(record: Record, name: str) -> str:
    """The value of a field in a list, or an empty one."""
    if name not in record:
        return "[]"
    value = record[name]
    return f'["{value}"]' if isinstance(value, str) and value.isalnum() and value.isascii() else json.dumps([value])


def _write(file: sqlite3.Connection, name: str, every: Iterable[str], numbers: Sequence[int]) -> None:
    """A column: texts, and the numbers of those of all rows."""
    found = Texts.of(every)
    parts = (narrow_type(each) for each in (found.letters, found.ends, np.array(numbers, np.int64)))
    file.execute(
        f"INSERT INTO columns VALUES (?{', ?' * 2 * len(PARTS)})",
        (name, *(value for part in parts for value in (part.itemsize, part.tobytes()))),
    )
