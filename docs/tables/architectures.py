"""The catalog as tables, and as rules that need no computation, on the page docs/pages/architectures.md."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from hrsynth.analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from hrsynth.catalog.architecture_key import ArchitectureKey, LegKey, parse
from hrsynth.catalog.groups.spatial import is_translational_leg
from hrsynth.catalog.query import Catalog

from .markdown import replace_between, table

PAGE = Path(__file__).resolve().parents[1] / "pages" / "architectures.md"
VERDICTS = (CONTROLLABLE, PARTIAL, BLIND)
INFINITY, RAIL, GENERAL = "line at infinity", "line across the rails", "line in general position"
Record = Mapping[str, Any]


def mark(leg: LegKey) -> int:
    """Return the index of the joint before the observed link of a leg."""
    if leg.observed is not None:
        return leg.observed
    slides = [i for i in range(1, len(leg.joints) - 1) if leg.joints[i].letter == "P"]
    last = len(leg.joints) - (1 if leg.joints[-1].letter in ("Pi", "2SS", "2US") else 2)
    before = slides[0] - 1 if slides else last
    while slides and before + 2 < len(leg.joints) and leg.joints[before + 1].letter == "P":
        before += 1
    return before


def centres(leg: LegKey, end: int = 0) -> str | None:
    """Return the locus of the platform's instantaneous centre for a fixed direction of a planar leg; None if it is the
    plane. ``end``: number of joints at the platform that are omitted."""
    last, joints = mark(leg), leg.joints[: len(leg.joints) - end]
    turning = [
        i for i, joint in enumerate(joints[: last + 1]) if joint.letter == "R" or (joint.letter == "Pi" and i == last)
    ]
    if not turning:
        return None
    others = [joint for i, joint in enumerate(joints) if i not in turning]
    # k joints that rotate the link leave k - 1 dof: two R translate the next links, an R and a Pi also rotate them
    turned = sum(joint.letter == "R" for joint in others) + (joints[last].letter == "Pi" and len(turning) > 1)
    if len(others) + len(turning) - 1 - turned == 2:
        return INFINITY
    return RAIL if [(joint.letter, joint.axes) for joint in others if joint.letter != "R"] == [("P", "x")] else GENERAL


def planar_rank(word: ArchitectureKey) -> int:
    """Return the rank of the legs of a planar robot: of their lines of centres; of a point: of its free directions.
    Parallel rails are all along x."""
    point = word.platform == "point"
    found = Counter(centres(leg, 1 if point else 0) for leg in word.legs)
    if point:
        return min(2, (found[RAIL] > 0) + found[GENERAL])
    return min(3, min(2, (found[INFINITY] > 0) + found[RAIL]) + found[GENERAL])


def delta_controllable(word: ArchitectureKey, dof: int) -> bool:
    """Return True if deltas of these legs are controllable: rails not all parallel, and enough legs."""
    first = {leg.unmoved.joints[0] for leg in word.legs}
    parallel = len({joint.axes for joint in first}) == 1 and all(
        joint.letter == "P" and joint.axes in ("x", "y", "z") for joint in first
    )
    return not parallel and 2 * len(word.legs) >= dof


def translating(word: ArchitectureKey) -> bool:
    """Return True if all legs of a key translate (:func:`hrsynth.catalog.groups.spatial.is_translating`)."""
    joints = [joint for leg in word.legs for joint in leg.joints]
    return all(joint.letter in "RP" and joint.axes in "abhjk" for joint in joints) and all(
        is_translational_leg(leg.chain) for leg in word.legs
    )


def split(leg: LegKey, place: int) -> int:
    """Count the directions of R of which some, but not all, come before an index in a leg."""
    axes = [joint.axes if joint.letter == "R" else "" for joint in leg.joints]
    return sum(0 < axes[:place].count(axis) < axes.count(axis) for axis in set(axes) - {""})


def translation_rank(word: ArchitectureKey) -> int:
    """Return the rank of legs that translate: the directions of R on both sides of each observed link, at most three.
    P joints of the catalog are normal to z: legs with two of constant direction observe z, and so does a leg with one
    that gives two numbers, the two components normal to it."""
    seen, along, known = 0, 0, False
    for leg in word.legs:
        numbers = split(leg, mark(leg) + 1)
        steady = [i for i, joint in enumerate(leg.joints) if joint.letter == "P" and not split(leg, i)]
        if len(steady) == 2:
            along = max(along, numbers)
        else:
            seen += numbers
            known |= len(steady) == 1 and numbers == 2
    return min(3, seen + (0 if known else along))


def studied(catalog: Catalog) -> list[Record]:
    """Return the records that have a verdict."""
    return [each for each in catalog if not each.get("refused")]


def motions(catalog: Catalog) -> str:
    """Tabulate the verdicts by kind of motion."""
    by: dict[str, Counter[str]] = {}
    for each in studied(catalog):
        by.setdefault(each["motion"], Counter())[each["verdict"]] += 1
    rows = [
        (motion, f"{sum(found.values()):,}", *(f"{found[v]:,}" for v in VERDICTS), share(found))
        for motion, found in sorted(by.items(), key=lambda item: -sum(item[1].values()))
    ]
    return table(("motion", "architectures", *VERDICTS, "controllable (%)"), rows, 1)


def numbers(record: Record) -> int:
    """Return the least number of observed legs: a direction is two numbers, in a plane one."""
    return int(record["dof"]) if record["group"] == "planar" else math.ceil(record["dof"] / 2)


def fewest(catalog: Catalog) -> str:
    """Tabulate controllable architectures by the number of legs above the bound of ``numbers``."""
    by: dict[tuple[str, str, int], Counter[int]] = {}
    for each in studied(catalog):
        if each["verdict"] == CONTROLLABLE:
            least = numbers(each)
            by.setdefault((each["motion"], each["group"], least), Counter())[each["fewest"] - least] += 1
    rows = [
        (motion, group, least, *(f"{found[k]:,}" if found[k] else "–" for k in range(4)))
        for (motion, group, least), found in sorted(by.items())
    ]
    return table(("motion", "group", "bound", "as the bound", "one more", "two more", "three more"), rows, 1)


def chains(catalog: Catalog) -> str:
    """Tabulate the verdicts of robots with equal legs, by the letters of the leg."""
    by: dict[tuple[str, str], Counter[str]] = {}
    for each in studied(catalog):
        word = parse(each["key"])
        letters = {"".join(joint.letter for joint in leg.joints) for leg in word.legs}
        if len(letters) == 1:
            by.setdefault((each["group"], *letters), Counter())[each["verdict"]] += 1
    rows = [
        (group, f"`{chain}`", *(f"{found[v]:,}" if found[v] else "–" for v in VERDICTS), share(found))
        for (group, chain), found in sorted(by.items())
    ]
    return table(("group", "legs", *VERDICTS, "controllable (%)"), rows, 1)


def suggestions(catalog: Catalog) -> str:
    """Tabulate the number of additional observations that the others need."""
    found: Counter[str] = Counter()
    for each in studied(catalog):
        if each["verdict"] != CONTROLLABLE:
            text = each["suggestion"]
            known = not text.startswith(("none", "not all"))
            found[str(text.count(" and ") + 1) if known else "none of up to four was found"] += 1
    return table(("additional observations", "architectures"), [(key, f"{n:,}") for key, n in sorted(found.items())], 1)


def rules(catalog: Catalog) -> str:
    """Tabulate the number of records that agree with each rule."""

    def agree(records: Iterable[bool]) -> str:
        truth = list(records)
        return f"{sum(truth):,} of {len(truth):,}"

    every = studied(catalog)
    rows = [
        (
            "planar: rank of the lines of instantaneous centres",
            agree(planar_rank(parse(each["key"])) == each["rank"] for each in every if each["group"] == "planar"),
        ),
        (
            "deltas: P not all parallel, at least dof/2 legs",
            agree(
                delta_controllable(parse(each["key"]), each["dof"]) == (each["verdict"] == CONTROLLABLE)
                for each in every
                if each["group"] == "deltas"
            ),
        ),
        (
            "translating legs: directions of R on both sides of the observed link",
            agree(
                translation_rank(word) == each["rank"]
                for each in every
                if each["group"] in ("mixed", "spatial")
                if translating(word := parse(each["key"]))
            ),
        ),
        (
            "all: at least dof/2 legs, in a plane dof",
            agree(each["fewest"] >= numbers(each) for each in every if each["verdict"] == CONTROLLABLE),
        ),
    ]
    return table(("rule", "agree"), rows, 1)


TABLES = {"motions": motions, "fewest": fewest, "chains": chains, "suggestions": suggestions, "rules": rules}


def start(name: str) -> str:
    """Return the mark before a table."""
    return f"<!-- generated: {name} -->"


def written(text: str, catalog: Catalog, tables: Mapping[str, Callable[[Catalog], str]] = TABLES) -> str:
    """Return a page with its tables."""
    for name, made in tables.items():
        text = replace_between(text, made(catalog), start(name))
    return text


def share(found: Counter[str]) -> str:
    """Return the percentage of controllable ones."""
    return f"{100 * found[CONTROLLABLE] / sum(found.values()):.0f}"
