"""Stores of the catalog: a folder with a file of lines per group, or one SQLite file for all."""

from __future__ import annotations

import contextlib
import errno
import gzip
import re
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from ..description.files import open_regular, open_replacement
from ..errors import BadRequest, BuildInterruption
from ..untrusted import unpack_gzip
from .architecture_key import ARCHITECTURE_KEY_VERSION
from .conditions import RecordQuestion, fill, list_matching_lines
from .journal import ENDING, Journal
from .jsonl import (
    CATALOG_LINE_CHARACTERS_MAX,
    FLAGS,
    REBUILD,
    decode_lines,
    encode_lines,
    parse_record,
    read_head_count,
    read_leading_word,
    require_version,
)

CATALOG_ENTRIES_MAX = 1_000_000
"""Largest number of lines of a compressed catalog file."""
CATALOG_MAX_BYTES = 100_000_000
"""Largest unpacked size of the lines of a catalog (bytes)."""

DATABASES = (".sqlite", ".sqlite3", ".db")
"""Extensions of a SQLite store."""
LINES, PACKED = ".jsonl", ".jsonl.gz"
"""Extensions of the files of a folder."""
SQLITE_TABLES_VERSION = 3
"""Version of the tables of a SQLite file."""
UNCOMPRESSED_ENTRIES_MAX = 5_000
"""Records of a group above which its file is compressed, where it may unpack to so much."""
PUBLISHED = "published"
"""The shipped catalog of published robots."""
ALL = "all"
"""This one and the shipped catalog of words."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


_PLAIN = re.compile(r"CREATE (TABLE|(\w+ )?INDEX)\b(?!.*\bAS\b)", re.IGNORECASE | re.DOTALL)
"""A table or an index whose columns are not computed, as a SQLite file has it."""


class Folder:
    """A folder with ``GROUP.jsonl`` for each group, or ``GROUP.jsonl.gz`` for a large one: lines of records by group,
    written whole or not at all."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def groups(self) -> list[str]:
        """The groups that are stored, by name."""
        names = (file.name for file in self.path.glob(f"*{LINES}*") if file.name.endswith((LINES, PACKED)))
        return sorted({name.partition(LINES)[0] for name in names})

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> list[str]:
        """Return the lines of groups that fit criteria (:mod:`.conditions`), sorted by key in each."""
        found, size = list[str](), 0
        for group in groups:
            content = self.content(group)
            size += len(content)
            _require_small(size, self.path)
            found += decode_lines(content, str(self.file(group)))
        return [found[i] for i in list_matching_lines(found, asked, partial(parse_record, file=str(self.path)))]

    def content(self, group: str) -> bytes:
        """The bytes of a group's lines; raises ``BadRequest`` where they cannot be read."""
        file, content = self._bytes(group, CATALOG_MAX_BYTES + 1)
        if len(content) > CATALOG_MAX_BYTES:
            raise BadRequest(f"{file}: more than {CATALOG_MAX_BYTES} bytes", remedy="Build a .sqlite file.")
        if not file.name.endswith(PACKED):
            return content
        content = unpack_gzip(content, file, CATALOG_MAX_BYTES)
        if (count := content.count(b"\n")) > CATALOG_ENTRIES_MAX:
            raise BadRequest(f"{file}: lines", count, f"at most {CATALOG_ENTRIES_MAX}", remedy="Build a .sqlite file.")
        return content

    def _bytes(self, group: str, most: int) -> tuple[Path, bytes]:
        """A group's file, and so many of its bytes at most."""
        file = self.file(group)
        with _require_readable(file), open_regular(file) as stream:
            return file, stream.read(most)

    def count(self, group: str) -> int:
        """Return the number of lines of a group."""
        file, content = self._bytes(group, CATALOG_LINE_CHARACTERS_MAX)
        if file.name.endswith(PACKED):
            with contextlib.suppress(zlib.error):
                content = zlib.decompressobj(wbits=31).decompress(content, CATALOG_LINE_CHARACTERS_MAX)
        return read_head_count(content.partition(b"\n")[0], str(file))

    def values(self, name: str) -> list[Any]:
        """The values of a field that records have, one of ``FIELDS``, each once, sorted."""
        records = (parse_record(line, str(self.path)) for line in self.lines(self.groups(), {}))
        return sorted({value for each in records if (value := each.get(name)) is not None})

    def write(self, group: str, lines: Iterable[str]) -> None:
        """Replace a group."""
        lines = list(lines)
        plain, packed = (self.path / f"{group}{ending}" for ending in (LINES, PACKED))
        large = UNCOMPRESSED_ENTRIES_MAX < len(lines) < CATALOG_ENTRIES_MAX
        content = encode_lines(group, lines, checksum=not large)
        if len(content) > CATALOG_MAX_BYTES:
            text = f"{self.path / group}: {len(content)} bytes, more than {CATALOG_MAX_BYTES}"
            raise BadRequest(text, remedy="Build a .sqlite file.")
        file, other = (packed, plain) if large else (plain, packed)
        with require_writable(file), open_replacement(file, sync=True) as draft:
            draft.write_bytes(gzip.compress(content, mtime=0) if large else content)
        other.unlink(missing_ok=True)

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        """The journal of a group's build, beside the store."""
        with require_writable(self.path):
            self.path.mkdir(exist_ok=True)
        return _open_journal(self.path / f"{group}{LINES}", f"{group}{LINES}", group, anew)

    def file(self, group: str) -> Path:
        """The file that holds a group."""
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
    """SQLite file with the same lines, and tables for criteria (:mod:`.conditions`); same methods as a folder."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def groups(self) -> list[str]:
        found = self._column("SELECT name FROM groups ORDER BY name")
        if not all(isinstance(name, str) for name in found):
            raise BadRequest(f"{self.path}: not a catalog file: a group without a name", remedy=REBUILD)
        return found

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> Sequence[str]:
        question = RecordQuestion.of(("group", tuple(groups)), *asked.items())
        with _refuse_sqlite_errors(self.path):
            file = self._open()
            counted = "sum(count), (SELECT max(record) FROM records), (SELECT max(record) FROM lines)"
            if len(set(file.execute(f"SELECT {counted} FROM groups").fetchone())) > 1:
                text = f"{self.path}: not a catalog file: entries and lines differ in number"
                raise BadRequest(text, remedy=REBUILD)
            return StoredLines(self.path, file, question.rows(file))

    def count(self, group: str) -> int:
        return sum(self._column("SELECT count FROM groups WHERE name = ?", group))

    def values(self, name: str) -> list[Any]:
        found = self._column(
            f'SELECT DISTINCT records."{name}" FROM records WHERE records."{name}" IS NOT NULL ORDER BY 1'
        )
        return list(map(bool, found)) if name in FLAGS else found

    def write(self, group: str, lines: Iterable[str]) -> None:
        others = [name for name in self.groups() if name != group] if self.path.exists() else []
        with require_writable(self.path), open_replacement(self.path, sync=True) as draft:
            try:
                write_tables(draft, {**{name: self.lines([name], {}) for name in others}, group: lines})
            except sqlite3.Error as error:
                raise BuildInterruption(f"{self.path}: {error}") from None

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        if self.path.exists():
            self.groups()
        return _open_journal(self.path, f"{self.path.name}.{group}", group, anew)

    def file(self, group: str) -> Path:
        return self.path

    def _column(self, asked: str, *values: object) -> list[Any]:
        """Return the values of one column; raises ``BadRequest`` for another file or version."""
        with _refuse_sqlite_errors(self.path), contextlib.closing(self._open()) as file:
            return [value for (value,) in file.execute(asked, values)]

    def _open(self) -> sqlite3.Connection:
        """The file to read, where it holds no more than tables: views and triggers are programs."""
        with _require_readable(self.path), open_regular(self.path) as stream:
            head = stream.read(20)
        if b"\2" in head[18:]:
            raise BadRequest(f"{self.path}: not a catalog file: it has a write-ahead log", remedy=REBUILD)
        file = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True, check_same_thread=False)
        file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, CATALOG_LINE_CHARACTERS_MAX)
        file.execute("PRAGMA trusted_schema = OFF")
        for name, made in file.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"):
            if not _PLAIN.match(str(made)):
                raise BadRequest(f"{self.path}: not a catalog file", name, "plain tables", remedy=REBUILD)
        found = file.execute("SELECT format, catalog FROM versions").fetchone() or (None, None)
        require_version(found, str(self.path), SQLITE_TABLES_VERSION)
        return file


Store = Folder | Database


class StoredLines(Sequence[str]):
    """Lines of a SQLite file, by the numbers of their rows; each is read when it is looked at."""

    def __init__(self, path: Path, file: sqlite3.Connection, rows: Sequence[int]) -> None:
        self._path, self._file, self._rows, self._read = path, file, rows, dict[int, str]()
        self._size = 0

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        row = self._rows[place]
        if row not in self._read:
            with _refuse_sqlite_errors(self._path):
                (line,) = self._file.execute("SELECT line FROM lines WHERE record = ?", (row,)).fetchone() or (None,)
            if not isinstance(line, str):
                raise BadRequest(f"{self._path}: not a catalog file: rows without a line", remedy=REBUILD)
            self._size += len(line)
            _require_small(self._size, self._path)
            self._read[row] = line
        return self._read[row]


def _require_small(size: int, file: Path) -> None:
    """Raise ``BadRequest`` for lines that are larger together than may be read."""
    if size > CATALOG_MAX_BYTES:
        raise BadRequest(f"{file}: lines of more than {CATALOG_MAX_BYTES} bytes", remedy="Restrict the search.")


def store(path: str | Path) -> Store:
    """Return the store of a name: a SQLite file by its extension, else a folder; ``published`` or ``all`` of the
    package, unless there is such a folder."""
    path = Path(path)
    if path == Path(ALL) and not path.exists():
        return ShippedCatalogs(locate_shipped_folder().path)
    if path == Path(PUBLISHED) and not path.exists():
        return Folder(locate_shipped_folder().path / PUBLISHED)
    return Database(path) if path.suffix in DATABASES else Folder(path)


def locate_shipped_folder() -> Folder:
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
def _refuse_sqlite_errors(file: Path) -> Iterator[None]:
    """Raise ``BadRequest`` for an error of SQLite."""
    try:
        yield
    except sqlite3.Error as error:
        raise BadRequest(f"{file}: not a catalog file: {error}", remedy=REBUILD) from None


@contextlib.contextmanager
def _require_readable(file: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BadRequest(f"{file}: cannot be read: {error.strerror}", remedy="Check the path.") from None


@contextlib.contextmanager
def require_writable(file: Path, what: str = "catalog") -> Iterator[None]:
    """A disk that is full stops a build, anything else is a bad request."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise BuildInterruption(f"{file}: {error.strerror}") from None
        raise BadRequest(f"{file}: cannot write the {what}: {error.strerror}", remedy="Choose another path.") from None


def write_tables(path: Path, groups: Mapping[str, Iterable[str]]) -> None:
    """Write a new file: the same bytes for the same lines."""
    lines = [line for _, group in sorted(groups.items()) for line in sorted(group, key=read_leading_word)]
    with contextlib.closing(sqlite3.connect(path)) as file:
        file.execute("PRAGMA journal_mode = OFF")
        file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, CATALOG_LINE_CHARACTERS_MAX)
        file.execute("CREATE TABLE versions (format INTEGER, catalog INTEGER)")
        file.execute("INSERT INTO versions VALUES (?, ?)", (SQLITE_TABLES_VERSION, ARCHITECTURE_KEY_VERSION))
        fill(file, lines)
        file.execute("CREATE TABLE groups (name, count)")
        file.execute('INSERT INTO groups SELECT "group", count(*) FROM records GROUP BY 1')
        file.execute("CREATE TABLE lines (record INTEGER PRIMARY KEY, line TEXT)")
        file.executemany("INSERT INTO lines (line) VALUES (?)", zip(lines, strict=True))
        file.commit()
