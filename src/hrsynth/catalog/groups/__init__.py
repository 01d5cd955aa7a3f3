"""The groups of the catalog: what is enumerated, each group in a module of its own.

A group is a law over words, so that a word alone says where it belongs; what :data:`GROUPS` lists of it is finite.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from ..words import Word
from . import deltas, planar, pods, spatial

GROUPS: Mapping[str, Callable[[], Iterable[Word]]] = {
    "planar": planar.words, "pods": pods.words, "deltas": deltas.words, "spatial": spatial.words}
"""The words of each group, in no order, some of them twice."""


def group(word: Word) -> str:
    """The group to which a word belongs: the first whose law it obeys."""
    if planar.belongs(word):
        return "planar"
    return next((name for name, law in (("pods", pods.belongs), ("deltas", deltas.belongs)) if law(word)), "spatial")


def words(name: str) -> list[str]:
    """All canonical words that are listed in a group, sorted, each once; the words of other groups are left out."""
    return sorted({str(word) for word in GROUPS[name]() if group(word) == name})
