"""Where the catalog is kept: a folder with a file of lines for each group, or one SQLite file for all."""

from __future__ import annotations

import contextlib
import errno
import gzip
import json
import sqlite3
import zlib
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Protocol, overload

from ..description.files import replacement
from ..errors import BadRequest, BuildStopped
from .fits import COLUMNS, TEXTS, RecordCondition, chains, conditions, may_fit, texts
from .journal import ENDING, Journal
from .jsonl import FORMAT, decoded, encoded, head_count, leading_word, record, require_version
from .words import VERSION

DATABASES = (".sqlite", ".sqlite3", ".db")
"""Endings of a store that is one SQLite file."""
LINES, PACKED = ".jsonl", ".jsonl.gz"
"""Endings of the files of a folder."""
READ_AT_ONCE = 500
"""Lines that are read from a SQLite file together."""
PACKED_ABOVE = 5_000
"""Records of a group above which its file is compressed."""
PUBLISHED = "published"
"""The shipped catalog of published robots."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
OLD_COLUMNS = ("group", "dof", "motion", "verdict", "base_motors", "fewest")
"""What older files can be asked for."""


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
        return sorted({file.name.partition(LINES)[0] for file in self.path.glob(f"*{LINES}*")
                       if file.name.endswith((LINES, PACKED))})

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> list[str]:
        fits = may_fit(asked)
        return [line for group in groups for line in decoded(self.content(group), str(self.file(group))) if fits(line)]

    def content(self, group: str) -> bytes:
        """The bytes of a group's lines; raises ``BadRequest`` where they cannot be read."""
        file = self.file(group)
        with _readable(file):
            content = file.read_bytes()
        try:
            return gzip.decompress(content) if file.name.endswith(PACKED) else content
        except (OSError, EOFError, zlib.error):
            raise BadRequest(f"{file}: truncated, or not compressed with gzip") from None

    def decides(self, asked: Mapping[str, Any]) -> bool:
        return all(value is None for value in asked.values())

    def count(self, group: str) -> int:
        return head_count(self.content(group).partition(b"\n")[0], str(self.file(group)))

    def write(self, group: str, lines: Iterable[str]) -> None:
        lines = list(lines)
        plain, packed = (self.path / f"{group}{ending}" for ending in (LINES, PACKED))
        large = len(lines) > PACKED_ABOVE
        file, other = (packed, plain) if large else (plain, packed)
        content = encoded(group, lines)
        with writable(file), replacement(file, sync=True) as draft:
            draft.write_bytes(gzip.compress(content, mtime=0) if large else content)
        other.unlink(missing_ok=True)

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        with writable(self.path):
            self.path.mkdir(exist_ok=True)
        return _opened(self.path / f"{group}{LINES}", f"{group}{LINES}", group, anew)

    def file(self, group: str) -> Path:
        packed = self.path / f"{group}{PACKED}"
        return packed if packed.exists() else self.path / f"{group}{LINES}"


class Database:
    """One SQLite file with the same lines, indexes on what is asked for most, the names by which legs are found and the
    text of each record. Files of older versions have fewer of these."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def groups(self) -> list[str]:
        with self._read() as file:
            return _groups(file)

    def lines(self, groups: Sequence[str], asked: Mapping[str, Any]) -> Sequence[str]:
        with _asked(self.path):
            file = self._open()
            new = _is_new(file)
            told = _told_by_rows(asked, new)
            met, values = [str(each.row) for each in told], [value for each in told for value in each.values]
            if not new:
                met.append(f'+"group" IN ({", ".join("?" * len(groups))})')
                return [line for line, in file.execute(
                    f'SELECT line FROM records WHERE {" AND ".join(met)} ORDER BY "group", word', [*values, *groups])]
            # rows are sorted by group: those of a group stand beside each other
            ranges = [_rows(file, group) for group in groups]
            if not told:
                return StoredLines(self.path, file, sorted(number for each in ranges for number in each))
            # one text of all numbers is read faster than a row for each
            numbers, = file.execute(f"SELECT json_group_array(rowid) FROM records WHERE {' AND '.join(met)}", values
                                    ).fetchone()
            found = sorted(json.loads(numbers))
            return StoredLines(self.path, file, [
                number for each in sorted(ranges, key=lambda each: each.start)
                for number in found[bisect_left(found, each.start) : bisect_left(found, each.stop)]])

    def decides(self, asked: Mapping[str, Any]) -> bool:
        with self._read() as file:
            return len(_told_by_rows(asked, _is_new(file))) == len(conditions(asked))

    def count(self, group: str) -> int:
        with self._read() as file:
            return int(file.execute('SELECT count(*) FROM records WHERE "group" = ?', (group,)).fetchone()[0])

    def write(self, group: str, lines: Iterable[str]) -> None:
        kept = {} if not self.path.exists() else {
            name: self.lines([name], {}) for name in self.groups() if name != group}
        with writable(self.path), replacement(self.path, sync=True) as draft:
            draft.unlink(missing_ok=True)
            try:
                _write_tables(draft, {**kept, group: lines})
            except sqlite3.Error as error:
                raise BuildStopped(f"{self.path}: {error}") from None

    def journal(self, group: str, *, anew: bool = False) -> Journal:
        if self.path.exists():
            self.groups()
        return _opened(self.path, f"{self.path.name}.{group}", group, anew)

    def file(self, group: str) -> Path:
        return self.path

    @contextlib.contextmanager
    def _read(self) -> Iterator[sqlite3.Connection]:
        """The file to read; raises ``BadRequest`` for something else, or another version."""
        with _asked(self.path), contextlib.closing(self._open()) as file:
            yield file

    def _open(self) -> sqlite3.Connection:
        with _readable(self.path):
            self.path.open("rb").close()
        file = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro", uri=True, check_same_thread=False)
        require_version(file.execute("SELECT format, catalog FROM versions").fetchone() or (None, None), str(self.path))
        return file


class StoredLines(Sequence[str]):
    """Lines of a SQLite file, by the numbers of their rows; they are read, some at a time, when they are looked at."""

    def __init__(self, path: Path, file: sqlite3.Connection, numbers: Sequence[int]) -> None:
        self._path, self._file, self._numbers, self._read = path, file, numbers, dict[int, list[str]]()

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
            wanted = self._numbers[part * READ_AT_ONCE : (part + 1) * READ_AT_ONCE]
            with _asked(self._path):
                found = dict(self._file.execute("SELECT rowid, line FROM lines WHERE rowid IN "
                                                "(SELECT value FROM json_each(?))", (json.dumps(wanted),)))
            if not all(isinstance(found.get(number), str) for number in wanted):
                raise BadRequest(f"{self._path}: not a catalog file: rows without a line")
            self._read[part] = [found[number] for number in wanted]
        return self._read[part][offset]


def _is_new(file: sqlite3.Connection) -> bool:
    """Whether texts stand in a table of their own; the lines of older files stand in the rows."""
    return file.execute("SELECT 1 FROM sqlite_master WHERE name = 'texts'").fetchone() is not None


def _groups(file: sqlite3.Connection) -> list[str]:
    """The groups that are stored, by name."""
    return [name for name, in file.execute(
        'WITH RECURSIVE known(name) AS (SELECT min("group") FROM records UNION ALL SELECT (SELECT min("group") '
        'FROM records WHERE "group" > name) FROM known WHERE name IS NOT NULL) '
        'SELECT name FROM known WHERE name IS NOT NULL')]


def _rows(file: sqlite3.Connection, group: str) -> range:
    """The numbers of a group's rows."""
    first, last = (file.execute(f'SELECT rowid FROM records WHERE "group" = ? ORDER BY word {way} LIMIT 1',
                                (group,)).fetchone() for way in ("ASC", "DESC"))
    return range(first[0], last[0] + 1) if first else range(0)


def _told_by_rows(asked: Mapping[str, Any], new: bool) -> list[RecordCondition]:
    """The conditions that the rows of a file decide, of an older one those that its columns do."""
    return [each for name, each in conditions(asked).items() if each.row and (new or name in OLD_COLUMNS)]


def store(path: str | Path) -> Store:
    """The store of this name: a SQLite file by its ending, else a folder; ``published`` of the package, where there is
    no such folder."""
    path = Path(path)
    if path == Path(PUBLISHED) and not path.exists():
        return Folder(shipped().path / PUBLISHED)
    return Database(path) if path.suffix in DATABASES else Folder(path)


def shipped() -> Folder:
    """The catalog that comes with the package."""
    packaged = Path(str(resources.files("hrsynth").joinpath("catalog", "shipped")))
    return Folder(packaged if packaged.is_dir() else Path(__file__).parents[3] / "catalog")


def _opened(file: Path, name: str, group: str, anew: bool) -> Journal:
    """The journal beside a file; drafts that a killed build left there go."""
    journal = Journal(file.with_name(name + ENDING), group, anew=anew)
    for draft in file.parent.glob(f".{file.name}.*.tmp"):
        draft.unlink(missing_ok=True)
    return journal


@contextlib.contextmanager
def _asked(file: Path) -> Iterator[None]:
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
        columns = ", ".join(f"{name} {kind}" for name, kind in COLUMNS.items())
        numbers = ", ".join(f"text_{field} INTEGER" for field in TEXTS)
        file.execute('CREATE TABLE versions (format INTEGER, catalog INTEGER)')
        # what is asked for most stands first in a row
        file.execute(f'CREATE TABLE records ({numbers}, chains INTEGER, {columns}, "group" TEXT, word TEXT, bare TEXT, '
                     'PRIMARY KEY ("group", word))')
        file.execute("INSERT INTO versions VALUES (?, ?)", (FORMAT, VERSION))
        file.execute("CREATE TABLE lines (record INTEGER PRIMARY KEY, line TEXT)")
        file.execute("CREATE TABLE texts (field TEXT, id INTEGER, text TEXT, PRIMARY KEY (field, id)) WITHOUT ROWID")
        file.execute("CREATE TABLE names (id INTEGER PRIMARY KEY, text TEXT)")
        file.execute("CREATE TABLE called (name INTEGER, chains INTEGER, PRIMARY KEY (name, chains)) WITHOUT ROWID")
        marks = ", ".join("?" * (len(COLUMNS) + len(TEXTS) + 4))
        kept, notations, number = {field: dict[str, int]() for field in TEXTS}, dict[str, int](), 0
        for group, lines in sorted(groups.items()):
            for line in sorted(lines, key=leading_word):
                found, number = record(line), number + 1
                file.execute(f"INSERT INTO records VALUES ({marks})", (
                    *(kept[field].setdefault(text, len(kept[field])) for field, text in texts(found).items()),
                    notations.setdefault(str(found.get("notation", "")), len(notations)),
                    *(found.get(name) for name in COLUMNS), group, found["word"], found["word"].replace("*", "")))
                file.execute("INSERT INTO lines VALUES (?, ?)", (number, line))
        for field, known in kept.items():
            file.executemany("INSERT INTO texts VALUES (?, ?, ?)", ((field, i, text) for text, i in known.items()))
        names = dict[str, int]()
        file.executemany("INSERT INTO called VALUES (?, ?)", (
            (names.setdefault(name, len(names)), i) for notation, i in notations.items()
            for name in sorted(chains({"notation": notation}))))
        file.executemany("INSERT INTO names VALUES (?, ?)", ((i, text) for text, i in names.items()))
        for name in ("word", *COLUMNS):
            file.execute(f"CREATE INDEX records_{name} ON records ({name})")
        file.commit()
