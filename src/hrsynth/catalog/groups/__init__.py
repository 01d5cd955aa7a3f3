"""Groups of the catalog, each enumerated in its own module.

A group is a law over keys, so that a key alone determines its group; :data:`GROUPS` lists finitely many of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from ..architecture_key import SENSORS, ArchitectureKey
from . import deltas, mixed, planar, pods, schoenflies, sensors, spatial

_LISTED: Mapping[str, Callable[[], Iterable[ArchitectureKey]]] = {
    "planar": planar.words,
    "pods": pods.words,
    "deltas": deltas.words,
    "mixed": mixed.words,
    "schoenflies": schoenflies.words,
    "spatial": spatial.words,
}
"""What each module lists, in no order, some of it twice or of another group."""


def group(word: ArchitectureKey) -> str:
    """The group to which a word belongs: the first whose law it obeys."""
    if word.seen:
        return SENSORS
    laws = {"planar": planar, "pods": pods, "schoenflies": schoenflies, "deltas": deltas, "mixed": mixed}
    return next((name for name, module in laws.items() if module.belongs(word)), "spatial")


def words(name: str) -> list[str]:
    """All canonical words that are listed in a group, sorted, each once."""
    if name == SENSORS:
        return sorted({str(word) for word in sensors.words()})
    return sorted({str(word) for word in _LISTED[name]() if group(word) == name})


GROUPS: Mapping[str, Callable[[], list[str]]] = {name: partial(words, name) for name in _LISTED}
"""Keys of each group that observes legs."""
EVERY: Mapping[str, Callable[[], list[str]]] = {**GROUPS, SENSORS: partial(words, SENSORS)}
"""Keys of each group."""
