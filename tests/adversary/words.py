"""Words of the catalog with dimensions of their own: the file is the engine's, everything after it is not."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

GROUPS = ("planar", "pods", "deltas", "spatial")


@cache
def listed(group: str) -> tuple[str, ...]:
    """The words of a group that the stored catalog does not refuse."""
    from hrsynth.catalog import load

    stored = load(Path(__file__).resolve().parents[2] / "catalog", group=group)
    return tuple(record["key"] for record in stored if "refused" not in record)


def write(group: str, rng: np.random.Generator, path: Path) -> str:
    """A random word of a group with random dimensions, written as a file; the word and the number of its draw."""
    import hrsynth
    from hrsynth.catalog.architecture_key import parse
    from hrsynth.catalog.geometry import build_mechanism

    word, attempt = str(rng.choice(listed(group))), int(rng.integers(1, 10_000))
    hrsynth.save(build_mechanism(parse(word), attempt), path)
    return f"{word} {attempt}"


def bars(links: tuple[str, ...]) -> list[tuple[str, str]]:
    """The pairs of equal rods of a word's robot, by their names, and the two bars of its platform."""
    found = [(name, f"{name[:-1]}b") for name in links if name.startswith("rod_") and name.endswith("a")]
    return found + ([("platform", "twin")] if "twin" in links else [])
