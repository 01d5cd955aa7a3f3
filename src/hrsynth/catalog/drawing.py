"""Drawing of a robot as text: the chain of each leg from base to platform, its motors and its observed link."""

from __future__ import annotations

import re

from ..errors import HrsynthError
from ..mechanism.legs import decompose
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.sensors import choose_default_segment
from .architecture_key import COMPOSITE, ArchitectureKey, LegKey, count_equal
from .geometry import build_mechanism

ENDS = {
    "": ("platform",),
    "point": ("platform, a point",),
    "bar": ("plate 1", "plate 2"),
    "slide": ("plate", "platform"),
}
"""On what the legs of each body end."""
BETWEEN = {
    "bar": "plate 1 and plate 2 are joined by a bar, the platform, and a parallel bar",
    "slide": "the plate slides on the platform",
}


def draw_architecture(word: ArchitectureKey) -> str:
    """Draw a line per kind of leg: ``*`` marks a motor, a double line the observed link."""
    watched = _locate_observed_links(word)
    groups: dict[tuple[int, LegKey], list[int]] = {}
    number = 0
    for body, legs in enumerate(word.bodies):
        for leg in legs:
            number += 1
            groups.setdefault((body, leg), []).append(number)
    heads = [_draw_head(numbers) for numbers in groups.values()]
    width = max(map(len, heads))
    lines = [
        f"{head:<{width}}  {_draw_chain(leg, watched.get(numbers[0]), ENDS[word.platform][body])}"
        for head, ((body, leg), numbers) in zip(heads, groups.items(), strict=True)
    ]
    seen = [f"sensors: {count_equal(word.seen)}"] if word.seen else []
    return "\n".join([*lines, *([BETWEEN[word.platform]] if word.platform in BETWEEN else []), *seen])


def _draw_head(numbers: list[int]) -> str:
    return f"leg{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"


def _draw_chain(leg: LegKey, watched: int | None, end: str) -> str:
    """The chain; ``watched`` is the joint inside or after which the observed link lies."""
    text, last = "base", len(leg.joints) - 1
    for i, joint in enumerate(leg.joints):
        text += f" {_choose_line(leg, i, watched)} {joint.letter}{joint.axes}{'*' * joint.motor}"
    return f"{text} {_choose_line(leg, last + 1, watched)} {end}"


def _choose_line(leg: LegKey, place: int, watched: int | None) -> str:
    """The link before a joint: double if observed, and on both sides of a composite with an observed rod."""
    if watched is None:
        return "──"
    inside = leg.joints[watched].letter in COMPOSITE
    return "══" if place == watched + 1 or (inside and place == watched) else "──"


def _locate_observed_links(word: ArchitectureKey) -> dict[int, int]:
    """The place of the observed link in each leg: the joint inside or after which it lies; nothing where the mechanism
    cannot be made, or something else is seen."""
    if word.seen:
        return {}
    try:
        decomposition = decompose(reduce_to_normal_form(build_mechanism(word)).mechanism)
        given = {seen.leg: seen.link for seen in decomposition.mechanism.observations if seen.is_segment_direction}
        links = [given.get(leg.label) or choose_default_segment(decomposition, leg).link for leg in decomposition.legs]
    except HrsynthError:
        return {}
    found = (re.fullmatch(r"(?:link|rod)_(\d+)_(\d+)a?", link) for link in links)
    return {int(match[1]): int(match[2]) - 1 for match in found if match}
