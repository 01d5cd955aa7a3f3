"""Sentences on an entry: its plain result, further measurements, the rules applied."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ...present.text.sentences import describe_locus, describe_observation, describe_smallest_sets
from ...present.text.tables import list_words, name_all
from ..jsonl import Record

RULES = {
    "motors off": "The motors are set free: the controller moves what the camera measures, not the motors.",
    "lift": "A virtual chain that constrains nothing is added to {legs}; its actuated U joint measures the observed "
    "direction.",
    "centre locus": "In {legs} the point that carries this U joint moves on a surface or a curve, or is fixed, so that "
    "fewer virtual sliders carry it.",
    "direction locus": "In {legs} the observed direction rotates about one axis or not at all, so that one actuated R "
    "joint or none measures it.",
    "joint substitution": "In {legs} the virtual actuator replaces the real joint before the observed segment.",
    "rod transfer": "In {legs} the rod parallel to the observed one moves with it.",
    "end change": "In {legs} the last S joint becomes a U joint.",
    "pi form": "In {legs} a planar parallelogram (Π) carries the actuator, for it moves on a circle.",
    "prismatic merge": "In {legs} the virtual actuator replaces the real joint on the base.",
    "leg removal": "Without {legs} the platform and the observed legs move as before: removed.",
    "keep": "Without {legs} the platform would move differently: kept, without a measurement.",
}
"""Sentence of each rule; ``{legs}`` are its legs."""
CONFIRMED = ", confirmed at {confirmed} closed configurations"
_STEP = re.compile(r"(?P<rule>.*?)(?: (?P<legs>[0-9,]+))?")
_PART = re.compile(r"(?P<kind>direction|line|encoder) (?P<name>\w+)")
_PLACE = re.compile(r"(?:link|rod|joint)_(?P<leg>\d+)_(?P<joint>\d+)[ab]?")
_KINDS = {
    "direction": "the direction of {}",
    "line": "the direction and the position of {}",
    "encoder": "the encoder of {}",
}


def describe_rules(record: Record) -> Iterator[str]:
    """A sentence for each step of the derivation."""
    for step in record.get("steps", ()):
        found = _STEP.fullmatch(step)
        rule, legs = (step, None) if found is None else (found["rule"], found["legs"])
        yield RULES[rule].format(legs=_name_legs(legs)) if rule in RULES else f"{step[:1].upper()}{step[1:]}."


def answer(record: Record) -> Iterator[str]:
    """The plain answer, of an architecture that was not refused."""
    if "refused" in record:
        return
    if "sensors" not in record:
        labels = [str(k + 1) for k in range(record["legs"])]
        yield describe_observation(
            labels, "legs", record["rank"], record["dof"], " or ".join(record.get("unobserved", ()))
        )
    if record.get("minimal"):
        yield describe_smallest_sets(
            record["minimal"], "observations" if "sensors" in record else "legs", record["rank"], record["dof"]
        )
    if record.get("condition"):
        yield describe_locus(record["condition"])
    proof = f"Exact in {record['instances']} instances"
    if record["instances"] == 1:
        proof = "Proved in exact arithmetic; loop-invariant incidences hold except with a probability below 1e-9"
    yield f"{proof}{CONFIRMED.format(**record) if 'confirmed' in record else ''}."
    yield from filter(None, [describe_suggestion(record)])


def describe_suggestion(record: Record) -> str | None:
    """Return a sentence on further measurements, None if none is needed."""
    said = record.get("suggestion")
    if not said:
        return None
    if said.startswith("none of"):
        return "No set of up to four further measurements shows all dof."
    parts = [_KINDS[each["kind"]].format(_describe_place(each["name"])) for each in _PART.finditer(said)]
    measured = list_words(parts)
    if said.startswith("not all by"):
        return f"Measure {measured} as well: this shows more, but not all dof."
    return f"Measure {measured} as well: this shows all {record['dof']} dof."


def _name_legs(labels: str | None) -> str:
    return "all legs" if labels is None else name_all("leg", labels.split(","))


def _describe_place(name: str) -> str:
    found = _PLACE.fullmatch(name)
    if found is None:
        return name
    what = {
        "j": f"joint {found['joint']}",
        "l": f"the link after joint {found['joint']}",
        "r": f"the rod at joint {found['joint']}",
    }[name[0]]
    return f"{what} of leg {found['leg']} ({name})"
