"""Building the catalog: entries missing in the journal are computed, then the group is written whole; and comparison of
a stored catalog with what would be built today.

The bytes depend on the keys and their entries alone: not on processes, order or interruptions.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from ..errors import BadRequest, BuildInterruption, HrsynthError
from .executors import Executor, Made, WorkInterruption, open_executor
from .journal import Journal
from .jsonl import format_line, parse_word, read_leading_word
from .store import Folder, Store, store

BUILD_CHUNK_MIN = 8
"""Least number of words that a worker is given at a time."""

Tell = Callable[[str, int, int], None]
"""Callback with a group, the number of its finished entries and of all: first for each group, then during its build."""


@dataclass(frozen=True)
class WordSource:
    """Groups of canonical words; ``entry`` gives the record of one, and can be sent to other processes.

    Words of the same ``sharing_key`` share most of their work, so they are made one after the other in one process.
    """

    groups: Mapping[str, Callable[[], Iterable[str]]]
    entry: Callable[[str], dict[str, Any]]
    sharing_key: Callable[[str], str] = str

    def choose(self, names: Sequence[str]) -> list[str]:
        """The groups of these names, all if there are none; raises ``BadRequest``."""
        for name in names:
            if name not in self.groups:
                raise BadRequest("unknown group", name, list(self.groups))
        return list(dict.fromkeys(names)) or list(self.groups)

    def words(self, group: str) -> list[str]:
        """The words of a group, sorted."""
        return sorted(set(self.groups[group]()))

    def chunks(self, words: Iterable[str], size: int) -> Iterator[list[str]]:
        """The words in parts of at least ``size`` (but for the last); those that share work stay together."""
        chunk: list[str] = []
        for _, alike in groupby(sorted((self.sharing_key(word), word) for word in words), key=lambda pair: pair[0]):
            chunk += [word for _, word in alike]
            if len(chunk) >= size:
                yield chunk
                chunk = []
        if chunk:
            yield chunk


def list_architectures() -> WordSource:
    """The catalog itself."""
    from .entry import build_entry
    from .groups import EVERY

    return WordSource(EVERY, build_entry, remove_motors)


def remove_motors(word: str) -> str:
    """The word without its motors: what a hidden robot is found from."""
    from .architecture_key import parse

    return str(parse(word).unmoved)


def make_records(entry: Callable[[str], dict[str, Any]], group: str, words: Iterable[str]) -> Made:
    """Compute the lines of keys; a refused entry gives the reason. Raises ``WorkInterruption`` for an internal
    error."""
    return [(word, format_line({**_build_entry(entry, word), "key": word, "group": group})) for word in words]


def _build_entry(entry: Callable[[str], dict[str, Any]], word: str) -> dict[str, Any]:
    try:
        return entry(word)
    except HrsynthError as error:
        return {"refused": "; ".join(error.lines())}
    except Exception as error:
        what = " ".join(f"{type(error).__name__}: {error}".split())
        raise WorkInterruption(f"{word}: internal error: {what}. Report it with the command") from error


@dataclass(frozen=True)
class Built:
    """Build of one group: the number of its keys, of entries computed now, and its file once complete."""

    group: str
    words: int
    now: int
    before: int
    file: Path | None

    def to_dict(self) -> dict[str, Any]:
        return {
            "group": self.group,
            "keys": self.words,
            "now": self.now,
            "before": self.before,
            "file": None if self.file is None else str(self.file),
        }


def build(
    target: str | Path,
    groups: Sequence[str] = (),
    *,
    source: WordSource | None = None,
    workers: int = 1,
    cluster: str | None = None,
    limit: int | None = None,
    anew: bool = False,
    tell: Tell | None = None,
) -> tuple[Built, ...]:
    """Build groups (default: all) into a folder, or a file that ends in ``.sqlite``.

    A group is written when it is complete. The journals are removed when all groups are, so an interrupted build
    continues where it stopped, unless ``anew``. With ``limit`` it stops after so many new records. ``workers``
    processes share the work, or the dask cluster at an address.

    Raises
    ------
    BadRequest
        For an unknown group, a target that cannot be written or is of another version, another build at work.
    BuildInterruption
        For a full disk, a worker or a cluster that died; what was built is kept.
    MissingExtra
        If joblib or dask is not installed.
    """
    source, tell = source or list_architectures(), tell or (lambda *_: None)
    kept, team, done = store(target), open_executor(workers, cluster), list[Built]()
    with ExitStack() as stack:
        journals = {group: stack.enter_context(kept.journal(group, anew=anew)) for group in source.choose(groups)}
        words = {group: source.words(group) for group in journals}
        for group, journal in journals.items():
            tell(group, sum(word in journal for word in words[group]), len(words[group]))
        for group, journal in journals.items():
            done.append(_group(kept, group, words[group], source, journal, team, limit, tell))
            limit = None if limit is None else limit - done[-1].now
        if all(built.file is not None for built in done):
            for journal in journals.values():
                journal.remove()
    return tuple(done)


def _group(
    kept: Store,
    group: str,
    words: Sequence[str],
    source: WordSource,
    journal: Journal,
    team: Executor,
    limit: int | None,
    tell: Tell,
) -> Built:
    wanted = [word for word in words if word not in journal]
    before, now = len(words) - len(wanted), 0
    for part in build_entries(team, source, group, wanted[:limit], str(journal.path)):
        journal.add(part)
        now += len(part)
        tell(group, before + now, len(words))
    complete = before + now == len(words)
    if complete:
        _write(kept, group, journal, words)
    return Built(group, len(words), now, before, kept.file(group) if complete else None)


def _write(kept: Store, group: str, journal: Journal, words: Sequence[str]) -> None:
    try:
        kept.write(group, journal.lines(words))
    except BuildInterruption as stopped:
        raise BuildInterruption(stopped.reason, str(journal.path)) from None


def build_entries(
    team: Executor, source: WordSource, group: str, words: Sequence[str], kept: str | None = None
) -> Iterator[Made]:
    """The records of words in parts, in any order; raises ``BuildInterruption`` where they cannot be made."""
    try:
        yield from team(partial(make_records, source.entry, group), source.chunks(words, BUILD_CHUNK_MIN))
    except WorkInterruption as stopped:
        raise BuildInterruption(str(stopped), kept) from stopped


def check(
    target: str | Path | Store,
    groups: Sequence[str] = (),
    *,
    source: WordSource | None = None,
    workers: int = 1,
    cluster: str | None = None,
    sample: int | None = None,
    seed: int = 0,
    tell: Tell | None = None,
) -> tuple[str, ...]:
    """Return the differences of a stored catalog from what ``build`` would write, one line each.

    All keys of the groups (default: all) are compared, and all entries or those of ``sample`` keys of each group, drawn
    with ``seed``.
    """
    source = source or list_architectures()
    kept = store(target) if isinstance(target, str | Path) else target
    team, chosen = open_executor(workers, cluster), source.choose(groups)
    return tuple(
        complaint
        for group in chosen
        for complaint in _list_stale_keys(kept, group, source, team, sample, seed, tell or (lambda *_: None))
    )


def _list_stale_keys(
    kept: Store, group: str, source: WordSource, team: Executor, sample: int | None, seed: int, tell: Tell
) -> Iterator[str]:
    try:
        lines = kept.lines([group], {})
        stored = {parse_word(line, str(kept.file(group))): line for line in lines}
    except BadRequest as error:
        yield f"{group}: {error}"
        return
    if not lines and not isinstance(kept, Folder):
        yield f"{group}: not in {kept.path}"
        return
    words = source.words(group)
    if isinstance(kept, Folder) and list(lines) != sorted(lines, key=read_leading_word):
        yield f"{group}: {kept.file(group)} is not sorted"
    yield from _describe_some(group, "missing", [word for word in words if word not in stored])
    yield from _describe_some(group, "no longer of the group", sorted(stored.keys() - set(words)))
    both = _draw_words([word for word in words if word in stored], sample, seed)
    differ: list[str] = []
    for part in _count_parts(build_entries(team, source, group, both), group, len(both), tell):
        differ += [word for word, line in part if line != stored[word]]
    yield from _describe_some(group, f"of {len(both)} compared with other records today", sorted(differ))


def _describe_some(group: str, what: str, words: Sequence[str]) -> Iterator[str]:
    """One line for the words of which something is wrong."""
    if words:
        yield f"{group}: {len(words)} {what}, the first {words[0]}"


def _draw_words(words: list[str], count: int | None, seed: int) -> list[str]:
    if count is None or count >= len(words):
        return words
    return random.Random(seed).sample(words, count)


def _count_parts(
    parts: Iterator[list[tuple[str, str]]], group: str, total: int, tell: Tell
) -> Iterator[list[tuple[str, str]]]:
    """Yield the parts and report them."""
    done = 0
    tell(group, done, total)
    for part in parts:
        yield part
        done += len(part)
        tell(group, done, total)
