"""Building the catalog: what the journal does not have yet is made by a crew, then a group is written whole.

The bytes depend on the words and their records alone: not on who made them, in what order, or how often the build was
killed on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import BuildStopped
from .executors import Crew, crew
from .journal import Journal
from .source import Made, Source, Stopped, architectures, made
from .store import Store, store

CHUNK = 8
"""Least number of words that a worker is given at a time."""

Tell = Callable[[str, int, int], None]
"""Is told a group, how many of its records are there, and of how many: first of all groups, then of the one at work."""


@dataclass(frozen=True)
class Built:
    """What a build did for one group: its words, those made now, and its file if it is complete."""

    group: str
    words: int
    now: int
    before: int
    file: Path | None

    def to_dict(self) -> dict[str, Any]:
        return {"group": self.group, "words": self.words, "now": self.now, "before": self.before,
                "file": None if self.file is None else str(self.file)}


def build(target: str | Path, groups: Sequence[str] = (), *, source: Source | None = None, workers: int = 1,
          cluster: str | None = None, limit: int | None = None, anew: bool = False, tell: Tell | None = None
          ) -> tuple[Built, ...]:
    """Build groups (default: all) into a folder, or a file that ends in ``.sqlite``.

    A group is written when it is complete. The journals go when all groups are, so that a build which was broken off
    goes on where it was, unless ``anew``. With ``limit`` it breaks off by itself after so many new records. ``workers``
    processes share the work, or the dask cluster at an address.

    Raises
    ------
    BadRequest
        For an unknown group, a target that cannot be written or is of another version, another build at work.
    BuildStopped
        For a full disk, a worker or a cluster that died; what was built is kept.
    MissingExtra
        Where joblib or dask is not installed.
    """
    source, tell = source or architectures(), tell or (lambda *_: None)
    kept, team, done = store(target), crew(workers, cluster), list[Built]()
    with ExitStack() as stack:
        journals = {group: stack.enter_context(kept.journal(group, anew=anew)) for group in source.chosen(groups)}
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


def _group(kept: Store, group: str, words: Sequence[str], source: Source, journal: Journal, team: Crew,
           limit: int | None, tell: Tell) -> Built:
    wanted = [word for word in words if word not in journal]
    before, now = len(words) - len(wanted), 0
    for part in made_by(team, source, group, wanted[:limit], str(journal.path)):
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
    except BuildStopped as stopped:
        raise BuildStopped(stopped.reason, str(journal.path)) from None


def made_by(team: Crew, source: Source, group: str, words: Sequence[str], kept: str | None = None
            ) -> Iterator[Made]:
    """The records of words in parts, in any order; raises ``BuildStopped`` where they cannot be made."""
    try:
        yield from team(partial(made, source.entry, group), source.chunks(words, CHUNK))
    except Stopped as stopped:
        raise BuildStopped(str(stopped), kept) from stopped


