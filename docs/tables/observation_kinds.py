"""The table of all kinds of observations, on the page docs/pages/observations.md."""

from __future__ import annotations

import numpy as np

from hrsynth.geometry.vectors import freeze_array, normalise_vector
from hrsynth.mechanism.cameras import ViewGeometry
from hrsynth.mechanism.notation import Letter, Word
from hrsynth.mechanism.observations import list_kinds

from .markdown import table as markdown

START = "<!-- generated: kinds -->"
AT = ViewGeometry(np.zeros(3), np.array([0, 0, 1.0]), np.array([0.3, 0.2, 1.0]), normalise_vector((1, 2, 0.5)))
"""Geometry of an example: the notation of chains does not depend on it."""


def table() -> str:
    """Return the Markdown table of all kinds, by their own descriptions."""
    rows = []
    for word, kind in list_kinds().items():
        needs = ", ".join(f"`{name.rstrip('?')}`{' (optional)' * name.endswith('?')}" for name in kind.needs)
        rows.append(
            (
                f"`{word}`",
                kind.words,
                needs,
                kind.rank,
                chain_word(word),
                kind.locked,  # type: ignore[attr-defined]
                kind.feature_error,
            )
        )
    return markdown(
        ("kind", "measured", "attributes", "numbers", "virtual chain", "fixed, it transmits", "error in a servo loop"),
        rows,
    )


def chain_word(word: str) -> str:
    """Return the notation of a kind's virtual chain, its motors underlined."""
    kind = list_kinds()[word]
    if "joint" in kind.needs:
        return "the real joint, actuated"
    if "at" in kind.needs:
        axis = freeze_array((0, 0, 1)) if "axis" in kind.needs else None
        seen = kind("", "", axis=axis, radius=0.1 if "radius" in kind.needs else None)  # type: ignore[call-arg]
    else:
        seen = kind("", "", direction=freeze_array((0, 0, 1)))  # type: ignore[call-arg]
    return str(Word(tuple(Letter(joint.letter, joint.actuated) for joint in seen.chain(AT))))  # type: ignore[attr-defined]
