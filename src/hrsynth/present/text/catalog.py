"""Entries of the catalog as text: a table of many, one in full, what a build did."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ...errors import BadRequest
from .tables import format_listing, format_table

HEADS = ("key", "robot", "dof", "motion", "hidden robot", "verdict", "rank", "smallest leg sets, or reason of refusal")
LEGEND = "* motor   ══ observed link"
CATALOG_ENTRIES_PRINTED_MAX = 100
"""Entries of a list that are printed."""
PROOFS = {"class": "no more by the degrees of their equations", "rank": "no more by ranks modulo a prime"}
"""Proofs of the bound on the number of modes other than a resultant."""

Record = Mapping[str, Any]


def format_entries(records: Sequence[Record], total: int, groups: Sequence[str] = ()) -> str:
    """Return a row per entry, of the first ones if there are many, then their number and the groups searched."""
    tables = [name for name in groups if name[:1].isdigit()]
    count = f"{len(records)} of {total} architectures" + "".join(
        f" {what} {', '.join(names)}"
        for what, names in (
            ("in the groups", [name for name in groups if name not in tables]),
            ("and of published robots", tables),
        )
        if names
    )
    if len(records) > CATALOG_ENTRIES_PRINTED_MAX:
        count += f", the first {CATALOG_ENTRIES_PRINTED_MAX} shown"
        count += " (--json lists all; --legs, --motion, --verdict … restrict the list)"
    return (
        f"{format_table([_format_row(record) for record in records[:CATALOG_ENTRIES_PRINTED_MAX]], HEADS)}\n\n{count}"
        if records
        else count
    )


def format_entry(record: Record, drawn: str, note: str = "", smallest: Sequence[Record] = ()) -> str:
    """Return one entry: its legs drawn, then its data, with the hidden robots of its ``smallest`` sets."""
    head = f"{record['key']}   {record.get('notation', '')}".rstrip()
    legs = [f"{drawn}\n{LEGEND}"] if drawn else []
    return "\n\n".join([head, *legs, format_listing(_list_all_facts(record, smallest)), *filter(None, [note])])


LISTED: Mapping[str, type] = {
    **dict.fromkeys(("notation", "motion", "verdict"), str),
    **dict.fromkeys(("dof", "rank", "fewest"), int),
}
"""Fields, with types, that every entry of a list has unless it was refused."""
TOLD: Mapping[str, type] = {**LISTED, "exact": bool, **dict.fromkeys(("mobility", "internal", "instances"), int)}
"""Fields, with types, of an entry that is shown in full."""


def describe_built(groups: Iterable[Mapping[str, Any]]) -> str:
    """Return a row per group that was built."""
    rows = [
        (*(str(each[name]) for name in ("group", "keys", "now", "before")), each["file"] or "not complete")
        for each in groups
    ]
    return format_table(rows, ("group", "keys", "computed now", "before", "file"))


def describe_site(done: Mapping[str, Any]) -> str:
    """Return the number of pages of a site, and its start page."""
    pages = f"{done['pages']:,} pages, {done['now']:,} written now"
    return f"{done['architectures']:,} architectures on {pages}: {done['index']}"


def require_whole(record: Record, needed: Mapping[str, type]) -> None:
    """Raise ``BadRequest`` for an entry of a file without fields that are shown."""
    wrong = [name for name, kind in needed.items() if not isinstance(record.get(name), kind)]
    if wrong and "refused" not in record:
        raise BadRequest(
            f"catalog entry {record['key'][:60]!r}: fields missing or of the wrong type: {', '.join(wrong)}",
            remedy="Build the file again with hrsynth catalog build.",
        )


def _format_row(record: Record) -> tuple[str, ...]:
    require_whole(record, LISTED)
    if "refused" in record:
        return (record["key"], record.get("notation", ""), "", "", "", "refused", "", str(record["refused"]))
    return (
        record["key"],
        record["notation"],
        str(record["dof"]),
        record["motion"],
        record.get("hidden", "none"),
        record["verdict"],
        f"{record['rank']} of {record['dof']}",
        ": ".join(filter(None, [str(record["fewest"]), _format_sets(record)])),
    )


def _format_sets(record: Record) -> str:
    return "  ".join("{" + ", ".join(legs) + "}" for legs in record.get("minimal", ()))


def _list_all_facts(record: Record, smallest: Sequence[Record]) -> list[tuple[str, str]]:
    found = [("group", str(record.get("group", ""))), *list_facts(record, smallest)]
    found += [("motors", describe_motors(record))] if "motors" in record else []
    return (
        [*found, ("motor choices", "  ".join(map(describe_motor_choice, record["choices"])))]
        if "choices" in record
        else found
    )


def list_facts(record: Record, smallest: Sequence[Record] = ()) -> Iterable[tuple[str, str]]:
    """Yield the data that do not depend on the motors, by name. ``smallest``: the smallest sets with their hidden
    robots."""
    require_whole(record, TOLD)
    if "refused" in record:
        yield "refused", str(record["refused"])
        return
    mobility = f"mobility {record['mobility']}, of which {record['internal']} internal"
    yield "dof", f"{record['dof']}, {record['motion']} ({mobility})"
    yield "hidden robot", str(record.get("hidden", "none"))
    yield "verdict", f"{record['verdict']} (rank {record['rank']} of {record['dof']})"
    if record["exact"]:
        yield "exact", "proved" if record["instances"] == 1 else f"{record['instances']} instances"
    else:
        yield "exact", "no: numerical ranks; the geometry is less generic than its incidences"
    if "confirmed" in record:
        yield "confirmed", f"at {record['confirmed']} closed configurations"
    if record.get("steps"):
        yield "rules", "; ".join(record["steps"])
    if record.get("unobserved"):
        yield "unobserved", "; ".join(record["unobserved"])
    told, what = ("fixed", "observations") if "sensors" in record else ("observed", "legs")
    if record.get("minimal"):
        yield f"{what} needed", _format_sets(record)
    if any(each["hidden"] != record.get("hidden") for each in smallest):
        yield (
            "hidden robots",
            "; ".join(
                f"{{{', '.join(each['legs'])}}}: {each['hidden'] or each['problem'] or 'none'}" for each in smallest
            ),
        )
    if record.get("condition"):
        yield "Type 2", str(record["condition"])
    if record.get("modes_bound") is not None:
        legs = f" with {what} {', '.join(record['modes_legs'])} {told}" if record.get("modes_legs") else ""
        proof = f", {PROOFS[record['modes_proof']]}" if record.get("modes_proof") in PROOFS else ""
        near = next((each["near_matches"] for each in smallest if each["legs"] == record.get("modes_legs")), None)
        yield (
            "modes",
            (
                f"{record['modes_seen']} real found of {record['modes_bound']} complex{legs}{proof}; "
                f"near modes {'not counted' if near is None else f'found: {near}'}"
            ),
        )
    elif record["rank"] < record["dof"]:
        yield "modes", f"a continuous family of dimension {record['dof'] - record['rank']} with all {what} {told}"
    if record.get("suggestion"):
        yield "suggestion", str(record["suggestion"])


def describe_motor_choice(each: Mapping[str, Any]) -> str:
    """Describe the actuated joints of each leg, and the number of dof that they determine."""
    driven = [",".join(map(str, joints)) or "none" for joints in each["joints"]]
    return f"joint {driven[0] if len(set(driven)) == 1 else ' | '.join(driven)} of each leg: {each['rank']}"


def describe_motors(record: Record) -> str:
    """Describe the motors of an architecture: number, place, and the number of dof that they determine."""
    base = "all on the base" if record["base_motors"] else "not all on the base"
    rank = f"; they determine {record['motor_rank']} of {record['dof']} dof" if "motor_rank" in record else ""
    return f"{record['motors']}, {base}{rank}"
