"""Which of the poses at which the watched legs look the same a path without Type 2 singularity joins."""

from __future__ import annotations

from typing import Any

from ....analysis.aspects.aspects import AspectTable, aspects
from ...text.poses import aspect_groups, pair_words
from ..commands import lines_at
from ..request import Request


def answer(request: Request) -> dict[str, Any]:
    """The modes by their numbers, those together that lie in one aspect, and what shows it of which two; ``aspect`` is
    the number of each mode's where every verdict is certified, else null."""
    setup = request.seeing()
    here = request.here(request.mover())
    found = aspects(setup, at=here.real)
    known = len(set(found.count)) == 1 and all(pair.certified for pair in found.pairs)
    return {
        "groups": [list(group) for group in found.groups],
        "aspect": [
            next((i for i, group in enumerate(found.groups, 1) if known and number in group), None)
            for number in range(1, len(found.places) + 1)
        ],
        "words": words(found),
        "pairs": [
            f"modes {one} and {other}: {pair_words(pair)}" for pair in found.pairs for one, other in [pair.numbers]
        ],
        **lines_at(request, "aspects", setup, here.real),
    }


def words(found: AspectTable) -> str:
    """How many aspects hold them."""
    if not found.groups:
        return "no aspect: there is no mode at which the robot was found assembled"
    return f"aspects of the hidden robot: {found.aspects_met} ({aspect_groups(found)})"
