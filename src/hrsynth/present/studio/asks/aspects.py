"""Aspects of the assembly modes: modes that a path without Type 2 singularity joins."""

from __future__ import annotations

from typing import Any

from ....analysis.aspects.aspects import AspectTable, aspects
from ...text.poses import format_aspect_groups, pair_words
from ..commands import format_commands_at
from ..request import Request


def answer(request: Request) -> dict[str, Any]:
    """Return the modes by number, grouped by aspect, and the verdict on each pair; ``aspect`` is the number of each
    mode's aspect if every verdict is proved, else null."""
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
        "words": describe_aspects(found),
        "pairs": [
            f"modes {one} and {other}: {pair_words(pair)}" for pair in found.pairs for one, other in [pair.numbers]
        ],
        **format_commands_at(request, "aspects", setup, here.real),
    }


def describe_aspects(found: AspectTable) -> str:
    """Describe the aspects of the modes."""
    if not found.groups:
        return "no aspect: the robot was not found assembled at any mode"
    return f"aspects of the hidden robot: {found.aspects_met} ({format_aspect_groups(found)})"
