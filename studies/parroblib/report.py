"""What an audit of published tables found, as text: a table of the groups, the kinds of disagreement, some of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hrsynth.present.text.tables import format_listing, format_table

HEADS = ("group", "robots", "moves so", "further", "not found", "losses", "agree", "in stated", "counts", "agree")
SHOWN = 5
"""Disagreements of each kind that are shown; JSON has all."""


def describe_audit(record: Mapping[str, Any]) -> str:
    """The groups, what each column means, the kinds of disagreement with what settles them, the first of each kind."""
    parts = [format_table([_group(each) for each in record["groups"]], HEADS), _legend(record)]
    sights = [
        (group["group"], each["verdict"], str(each["fewest"]), f"{each['number']:,}")
        for group in record["groups"]
        for each in group["watching"]
    ]
    if sights:
        parts.append(format_table(sights, ("group", "observing all legs", "fewest legs with the same rank", "robots")))
    kinds = list(_kinds(record["groups"]))
    if kinds:
        used = {settled for _, _, settled, _ in kinds}
        parts += [
            format_table(kinds, ("group", "kind of disagreement", "settled", "number")),
            format_listing(
                [(kind, record["kinds"][kind]) for kind in record["kinds"] if any(each[1] == kind for each in kinds)]
            ),
            format_listing([(name, words) for name, words in record["settlements"].items() if name in used]),
            format_table(list(_first(record["disagreements"])), ("robot", "kind", "table", "computed", "settled")),
        ]
    count = len(record["defects"])
    parts += (
        [
            f"left out: {count} line{'s' * (count != 1)} of the tables, {'the first: ' * (count != 1)}"
            f"{record['defects'][0]}"
        ]
        if count
        else []
    )
    return "\n\n".join(
        [
            *parts,
            f"{record['compared']} of {record['rows']} rows compared, {record['agree']} agree in "
            f"everything that is stated",
        ]
    )


def _group(each: Mapping[str, Any]) -> tuple[str, ...]:
    losses = each["choices"] - each["choices_not_stated"] - each["choices_not_compared"]
    return (
        each["group"],
        *(
            f"{value:,}"
            for value in (
                each["robots"],
                each["moves_as_stated"],
                each["moves_further"],
                each["not_found"],
                losses,
                each["choices_agree"],
                each["choices_agree_in_stated"],
                each["counts"],
                each["counts_agree"],
            )
        ),
    )


def _legend(record: Mapping[str, Any]) -> str:
    rows = [
        ("moves so", "robots whose platform has the stated dof and no others; further: more of them"),
        (
            "losses",
            "choices of motors with a stated loss of rank; agree: it is the platform's; in stated: it is "
            "that of the stated motion",
        ),
        ("counts", "robots with a stated number of working choices"),
    ]
    lost = len(record["without_chain"])
    return format_listing(
        [*rows, *([("no chain", f"{lost:,} more robots, whose leg chain is in no table")] if lost else [])]
    )


def _kinds(groups: Iterable[Mapping[str, Any]]) -> Iterable[tuple[str, str, str, str]]:
    for group in groups:
        for each in group["kinds"]:
            yield group["group"], each["kind"], each["settled"], f"{each['number']:,}"


def _first(found: Sequence[Mapping[str, str]]) -> Iterable[tuple[str, ...]]:
    seen: dict[str, int] = {}
    for each in found:
        seen[each["kind"]] = seen.get(each["kind"], 0) + 1
        if seen[each["kind"]] <= SHOWN:
            yield tuple(each[name] for name in ("robot", "kind", "theirs", "ours", "settled"))
