"""Whether a stored catalog is what would be built today: its words, its bytes, and its records, all or some."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import BadRequest
from .build import Tell, made_by
from .executors import Crew, crew
from .jsonl import encoded, word_of
from .source import Source, architectures
from .store import Folder, Store, store


def check(target: str | Path | Store, groups: Sequence[str] = (), *, source: Source | None = None, workers: int = 1,
          cluster: str | None = None, sample: int | None = None, seed: int = 0, tell: Tell | None = None
          ) -> tuple[str, ...]:
    """What is stale in a stored catalog, a line each; nothing if it is what ``build`` would write.

    The words of the groups (default: all) are compared one by one, and the records of all of them or of ``sample``
    words of each group, drawn with ``seed``.
    """
    source = source or architectures()
    kept = store(target) if isinstance(target, str | Path) else target
    team, chosen = crew(workers, cluster), source.chosen(groups)
    return tuple(complaint for group in chosen
                 for complaint in _group(kept, group, source, team, sample, seed, tell or (lambda *_: None)))


def _group(kept: Store, group: str, source: Source, team: Crew, sample: int | None, seed: int, tell: Tell
           ) -> Iterator[str]:
    try:
        lines = kept.lines(group, {})
        stored = {word_of(line): line for line in lines}
    except BadRequest as error:
        yield f"{group}: {error}"
        return
    if not lines and not isinstance(kept, Folder):
        yield f"{group}: not in {kept.path}"
        return
    words = source.words(group)
    if isinstance(kept, Folder) and kept.file(group).read_bytes() != encoded(group, lines):
        yield f"{group}: {kept.file(group)} is not sorted"
    yield from _some(group, "missing", [word for word in words if word not in stored])
    yield from _some(group, "no longer of the group", sorted(stored.keys() - set(words)))
    both = _drawn([word for word in words if word in stored], sample, seed)
    differ: list[str] = []
    for part in _counted(made_by(team, source, group, both), group, len(both), tell):
        differ += [word for word, line in part if line != stored[word]]
    yield from _some(group, f"of {len(both)} compared with other records today", sorted(differ))


def _some(group: str, what: str, words: Sequence[str]) -> Iterator[str]:
    """One line for the words of which something is wrong."""
    if words:
        yield f"{group}: {len(words)} {what}, the first {words[0]}"


def _drawn(words: list[str], count: int | None, seed: int) -> list[str]:
    if count is None or count >= len(words):
        return words
    return random.Random(seed).sample(words, count)


def _counted(parts: Iterator[list[tuple[str, str]]], group: str, total: int, tell: Tell
             ) -> Iterator[list[tuple[str, str]]]:
    """The parts, told as they pass."""
    done = 0
    tell(group, done, total)
    for part in parts:
        yield part
        done += len(part)
        tell(group, done, total)
