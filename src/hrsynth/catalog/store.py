"""Where the catalog is kept: a folder with a file of lines for each group, or one SQLite file for all."""

from __future__ import annotations

import contextlib
import errno
import gzip
import json
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Protocol, overload

import numpy as np

from ..budgets import LARGEST_CATALOG, LARGEST_RECORD, MOST_RECORDS
from ..description.files import open_regular, replacement
from ..errors import BadRequest, BuildStopped
from ..untrusted import gunzip
from .columns import Columns, ColumnWriter
from .fits import ASKED, conditions, may_fit
from .journal import ENDING, Journal
from .jsonl import FORMAT, decode_lines, encode_lines, head_count, leading_word, record, require_version
from .search import Whole
from .words import VERSION

DATABASES = (".sqlite", ".sqlite3", ".db")
"""Endings of a store that is one SQLite file."""
LINES, PACKED = ".jsonl", ".jsonl.gz"
"""Endings of the files of a folder."""
READ_AT_ONCE = 100
"""Lines that are read from a SQLite file together."""
PAGE = 16_384
"""Bytes of a page of a SQLite file: columns of some megabytes are read in few."""
PACKED_ABOVE = 5_000
"""Records of a group above which its file is compressed, where it may unpack to so much."""
PUBLISHED = "published"
"""The shipped catalog of published robots."""
ALL = "all"
"""This one and the shipped catalog of words."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


_PLAIN = re.compile(r"CREATE (TABLE|(\w+ )?INDEX)\b(?!.*\bAS\b)", re.IGNORECASE | re.DOTALL)
"""A table or an index whose columns are not computed, as a SQLite file has it."""


class Store(Protocol):
    """Lines of records by group; written whole or not at all."""

    path: Path

    def groups(self) -> list[str]:
        """The groups that are stored, by name."""

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> Sequence[str]:
        """The lines of groups, sorted by word in each, without some that do not fit what is asked for
        (:mod:`.fits`)."""

    def decides(self, asked: Mapping[str, Any]) -> bool:
        """Whether these are all lines that fit, and no others."""

    def count(self, group: str) -> int:
        """How many lines a group has."""

    def values(self, name: str) -> list[Any]:
        """The values of a field that records have, one of ``FIELDS``, each once, sorted."""

    def write(self, group: str, lines: Iterable[str]) -> None:
        """Replace a group."""

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        """The journal of a group's build, beside the store."""

    def file(self, group: str) -> Path:
        """The file that holds a group."""


class Folder:
    """A folder with ``GROUP.jsonl`` for each group, or ``GROUP.jsonl.gz`` for a large one."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def groups(self) -> list[str]:
        return sorted(
            {
                file.name.partition(LINES)[0]
                for file in self.path.glob(f"*{LINES}*")
                if file.name.endswith((LINES, PACKED))
            }
        )

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> list[str]:
        fits = may_fit(asked)
        every = (line for group in groups for line in decode_lines(self.content(group), str(self.file(group))))
        return [line for line in _limited(every, self.path) if fits(line)]

    def content(self, group: str) -> bytes:
        """The bytes of a group's lines; raises ``BadRequest`` where they cannot be read."""
        file = self.file(group)
        with _readable(file), open_regular(file) as stream:
            content = stream.read(LARGEST_CATALOG + 1)
        if len(content) > LARGEST_CATALOG:
            raise BadRequest(f"{file}: file too large", None, f"up to {LARGEST_CATALOG} bytes, or a SQLite file")
        if not file.name.endswith(PACKED):
            return content
        content = gunzip(content, file, LARGEST_CATALOG)
        if (count := content.count(b"\n")) > MOST_RECORDS:
            raise BadRequest(f"{file}: lines", count, f"up to {MOST_RECORDS}, or a file that is not compressed")
        return content

    def decides(self, asked: Mapping[str, Any]) -> bool:
        return all(value is None for value in asked.values())

    def count(self, group: str) -> int:
        return head_count(self.content(group).partition(b"\n")[0], str(self.file(group)))

    def values(self, name: str) -> list[Any]:
        return _values(self.lines(self.groups(), {}), name)

    def write(self, group: str, lines: Iterable[str]) -> None:
        lines = list(lines)
        plain, packed = (self.path / f"{group}{ending}" for ending in (LINES, PACKED))
        large = PACKED_ABOVE < len(lines) < MOST_RECORDS
        content = encode_lines(group, lines, checksum=not large)
        if len(content) > LARGEST_CATALOG:
            raise BadRequest(
                f"{self.path / group}: lines of {len(content)} bytes",
                None,
                f"up to {LARGEST_CATALOG}, or a SQLite file",
            )
        file, other = (packed, plain) if large else (plain, packed)
        with writable(file), replacement(file, sync=True) as draft:
            draft.write_bytes(gzip.compress(content, mtime=0) if large else content)
        other.unlink(missing_ok=True)

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        with writable(self.path):
            self.path.mkdir(exist_ok=True)
        return _open_journal(self.path / f"{group}{LINES}", f"{group}{LINES}", group, anew)

    def file(self, group: str) -> Path:
        packed = self.path / f"{group}{PACKED}"
        return packed if packed.exists() else self.path / f"{group}{LINES}"


class ShippedCatalogs(Folder):
    """All that comes with the package: the groups of words, and beside them those of the published robots."""

    def groups(self) -> list[str]:
        return [*super().groups(), *self._published.groups()]

    def file(self, group: str) -> Path:
        own = super().file(group)
        return own if own.exists() else self._published.file(group)

    @property
    def _published(self) -> Folder:
        return Folder(self.path / PUBLISHED)


class Database:
    """One SQLite file with the same lines, and columns that tell which of them fit (:mod:`.columns`). Those of older
    versions are read as a folder is."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def groups(self) -> list[str]:
        with self._read() as file:
            asked = "name FROM groups" if _is_new(file) else 'DISTINCT "group" FROM records'
            found = [name for (name,) in file.execute(f"SELECT {asked} ORDER BY 1")]
            if not all(isinstance(name, str) for name in found):
                raise BadRequest(f"{self.path}: not a catalog file: a group without a name")
            return found

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> Sequence[str]:
        with _refusing_sqlite_errors(self.path):
            file = self._open()
            if not _is_new(file):
                fits = may_fit(asked)
                every = (line for group in sorted(groups) for line in _old_lines(file, group))
                return [line for line in _limited(every, self.path) if fits(line)]
            counts = self._counts(file)
            found = np.concatenate(
                [np.full(count, name in groups) for name, count in counts.items()] or [np.zeros(0, bool)]
            )
            columns, told = Columns(self.path, file, found), conditions(asked)
            for name in ASKED:  # patterns and texts last, of rows that are still there
                if name in told and (rows := told[name].rows) and found.any():
                    found &= rows(columns)
            return StoredLines(self.path, file, np.flatnonzero(found))

    def decides(self, asked: Mapping[str, Any]) -> bool:
        with self._read() as file:
            return all(each.rows and _is_new(file) for each in conditions(asked).values())

    def count(self, group: str) -> int:
        with self._read() as file:
            if _is_new(file):
                return self._counts(file).get(group, 0)
            return int(file.execute('SELECT count(*) FROM records WHERE "group" = ?', (group,)).fetchone()[0])

    def values(self, name: str) -> list[Any]:
        with self._read() as file:
            if _is_new(file):
                return Columns(self.path, file, np.zeros(0, bool)).values(name)
        return _values(self.lines(self.groups(), {}), name)

    def write(self, group: str, lines: Iterable[str]) -> None:
        kept = (
            {} if not self.path.exists() else {name: self.lines([name], {}) for name in self.groups() if name != group}
        )
        with writable(self.path), replacement(self.path, sync=True) as draft:
            try:
                _write_tables(draft, {**kept, group: lines})
            except sqlite3.Error as error:
                raise BuildStopped(f"{self.path}: {error}") from None

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        if self.path.exists():
            self.groups()
        return _open_journal(self.path, f"{self.path.name}.{group}", group, anew)

    def file(self, group: str) -> Path:
        return self.path

    def _counts(self, file: sqlite3.Connection) -> dict[str, int]:
        """How many lines each group has; raises ``BadRequest`` where there are not as many, numbered from 0."""
        counts = dict(file.execute("SELECT name, count FROM groups ORDER BY name"))
        count, first, last = file.execute(
            "SELECT count(*), ifnull(min(record), 0), ifnull(max(record), -1) FROM lines"
        ).fetchone()
        if not all(type(each) is int and each > 0 for each in counts.values()) or (
            sum(counts.values()),
            0,
            last + 1,
        ) != (count, first, count):
            raise BadRequest(f"{self.path}: not a catalog file: its groups and its lines differ in number")
        return counts

    @contextlib.contextmanager
    def _read(self) -> Iterator[sqlite3.Connection]:
        """The file to read; raises ``BadRequest`` for something else, or another version."""
        with _refusing_sqlite_errors(self.path), contextlib.closing(self._open()) as file:
            yield file

    def _open(self) -> sqlite3.Connection:
        """The file to read, where it holds no more than tables: views and triggers are programs."""
        with _readable(self.path), open_regular(self.path) as stream:
            head = stream.read(20)
        if b"\2" in head[18:]:
            raise BadRequest(f"{self.path}: not a catalog file: it has a write-ahead log")
        file = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True, check_same_thread=False)
        file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_RECORD)
        file.execute("PRAGMA trusted_schema = OFF")
        for name, made in file.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"):
            if not _PLAIN.match(str(made)):
                raise BadRequest(f"{self.path}: not a catalog file: it holds", name, "plain tables")
        require_version(file.execute("SELECT format, catalog FROM versions").fetchone() or (None, None), str(self.path))
        return file


class StoredLines(Sequence[str]):
    """Lines of a SQLite file, by the numbers of their rows; they are read, some at a time, when they are looked at."""

    def __init__(self, path: Path, file: sqlite3.Connection, numbers: Whole) -> None:
        self._path, self._file, self._numbers, self._read = path, file, numbers, dict[int, list[str]]()
        self._size = 0

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, place: int) -> str: ...

    @overload
    def __getitem__(self, place: slice) -> Sequence[str]: ...

    def __getitem__(self, place: int | slice) -> str | Sequence[str]:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        part, offset = divmod(range(len(self))[place], READ_AT_ONCE)
        if part not in self._read:
            wanted = self._numbers[part * READ_AT_ONCE : (part + 1) * READ_AT_ONCE].tolist()
            with _refusing_sqlite_errors(self._path):
                found = dict(
                    self._file.execute(
                        "SELECT record, line FROM lines WHERE record IN (SELECT value FROM json_each(?))",
                        (json.dumps(wanted),),
                    )
                )
            if not all(isinstance(found.get(number), str) for number in wanted):
                raise BadRequest(f"{self._path}: not a catalog file: rows without a line")
            self._read[part] = list(_limited((found[number] for number in wanted), self._path, self._size))
            self._size += sum(map(len, self._read[part]))
        return self._read[part][offset]


def _limited(lines: Iterable[str], file: Path, size: int = 0) -> Iterator[str]:
    """Lines; raises ``BadRequest`` where they are larger, with what was read before, than may be read."""
    for line in lines:
        size += len(line)
        if size > LARGEST_CATALOG:
            raise BadRequest(f"{file}: lines of more than {LARGEST_CATALOG} bytes", None, "a smaller catalog")
        yield line


def _is_new(file: sqlite3.Connection) -> bool:
    """Whether there are columns; files of older versions have only lines that can be used."""
    return file.execute("SELECT 1 FROM sqlite_master WHERE name = 'columns'").fetchone() is not None


def _old_lines(file: sqlite3.Connection, group: str) -> Iterator[str]:
    """The lines of a group in a file of an older version: in the table of records, or in one of their own."""
    apart = file.execute("SELECT 1 FROM sqlite_master WHERE name = 'lines'").fetchone()
    where = "records JOIN lines ON record = records.rowid" if apart else "records"
    return (
        line
        for (line,) in file.execute(
            f"""SELECT ifnull(CAST(line AS TEXT), '') FROM {where} WHERE "group" = ? ORDER BY word""", (group,)
        )
    )


def _values(lines: Iterable[str], name: str) -> list[Any]:
    """The values of a field in lines, each once, sorted."""
    return sorted({value for each in lines if (value := record(each).get(name)) is not None})


def store(path: str | Path) -> Store:
    """The store of this name: a SQLite file by its ending, else a folder; ``published`` or ``all`` of the package,
    where there is no such folder."""
    path = Path(path)
    if path == Path(ALL) and not path.exists():
        return ShippedCatalogs(shipped_folder().path)
    if path == Path(PUBLISHED) and not path.exists():
        return Folder(shipped_folder().path / PUBLISHED)
    return Database(path) if path.suffix in DATABASES else Folder(path)


def shipped_folder() -> Folder:
    """The catalog that comes with the package."""
    packaged = Path(str(resources.files("hrsynth").joinpath("catalog", "shipped")))
    return Folder(packaged if packaged.is_dir() else Path(__file__).parents[3] / "catalog")


def _open_journal(file: Path, name: str, group: str, anew: bool) -> Journal:
    """The journal beside a file; drafts that a killed build left there go."""
    journal = Journal(file.with_name(name + ENDING), group, anew=anew)
    for draft in file.parent.glob(f".{file.name}.*.tmp"):
        draft.unlink(missing_ok=True)
    return journal


@contextlib.contextmanager
def _refusing_sqlite_errors(file: Path) -> Iterator[None]:
    """What SQLite complains of is a bad request."""
    try:
        yield
    except sqlite3.Error as error:
        raise BadRequest(f"{file}: not a catalog file: {error}") from None


@contextlib.contextmanager
def _readable(file: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BadRequest(f"cannot read the catalog: {error.strerror}", str(file)) from None


@contextlib.contextmanager
def writable(file: Path, what: str = "catalog") -> Iterator[None]:
    """A disk that is full stops a build, anything else is a bad request."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise BuildStopped(f"{file}: {error.strerror}") from None
        raise BadRequest(f"cannot write the {what}: {error.strerror}", str(file)) from None


def _write_tables(path: Path, groups: Mapping[str, Iterable[str]]) -> None:
    """Write a new file: the same bytes for the same lines."""
    with contextlib.closing(sqlite3.connect(path)) as file:
        file.execute("PRAGMA journal_mode = OFF")
        file.execute(f"PRAGMA page_size = {PAGE}")
        file.execute("CREATE TABLE versions (format INTEGER, catalog INTEGER)")
        file.execute("INSERT INTO versions VALUES (?, ?)", (FORMAT, VERSION))
        file.execute("CREATE TABLE groups (name TEXT PRIMARY KEY, count INTEGER) WITHOUT ROWID")
        file.execute("CREATE TABLE lines (record INTEGER PRIMARY KEY, line TEXT)")
        columns, number = ColumnWriter(), 0
        for group, lines in sorted(groups.items()):
            first = number
            for line in sorted(lines, key=leading_word):
                columns.add(record(line))
                file.execute("INSERT INTO lines VALUES (?, ?)", (number, line))
                number += 1
            if number > first:
                file.execute("INSERT INTO groups VALUES (?, ?)", (group, number - first))
        columns.write(file)
        file.commit()
