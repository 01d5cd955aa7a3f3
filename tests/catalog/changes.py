"""Which records of the catalog differ between two commits, and why: the page docs/pages/catalog-changes.md.

    python -m catalog.changes 981f083 fc10c32 -o ../docs/pages/catalog-changes.md
    python -m catalog.changes 981f083 fc10c32 --check 20

From ``tests/``. ``--check`` draws so many records of each reason and asks the oracle about them; the exit status is 1
where it says otherwise.
"""

from __future__ import annotations

import argparse
import gzip
import json
import random
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from catalog.witness import Witness
from hrsynth.catalog.groups import GROUPS
from hrsynth.present.markdown import replace_between, table

START = "<!-- generated: changes -->"
ROOT = Path(__file__).resolve().parents[2]
CLEAR = 1e-3
"""A smallest singular value above is no singularity."""
Record = Mapping[str, Any]

MODE, REFUSED, AGAIN, LISTED, SEEN, HIDDEN, NEVER, DRAWN = REASONS = (
    "another operation mode",
    "refused",
    "refused as before",
    "modes that were not listed",
    "other modes seen",
    "another hidden robot",
    "another condition",
    "another choice of dimensions",
)
FIELDS = {
    MODE: ("motion", "minimal"),
    AGAIN: ("refused",),
    LISTED: ("modes_bound",),
    SEEN: ("modes_seen",),
    HIDDEN: ("hidden",),
    NEVER: ("condition",),
    DRAWN: ("attempt",),
}
"""A record belongs to the first reason of which a field changed."""
WHY = {
    MODE: "Samples had crossed a constraint singularity, or came from two modes. Every step follows the branch of the "
    "zero configuration now; kind of motion, legs needed, hidden robot and cure are those of that branch.",
    REFUSED: "The verdict at samples is the same. The exact one rests on relations between centres of different legs "
    "that are seen at samples and not derived from the file, so that it is not called proved.",
    AGAIN: "Another reason is given: samples beyond a singular zero configuration are no longer taken.",
    LISTED: "No equations were known for what some leg asks of the platform: an end on a cone, a point of the base "
    "that is held in the platform's frame, a U-P-U leg that is not watched, rods of a platform that turns. Its "
    "joints give conditions on the pose now.",
    SEEN: "The most real modes at five configurations, which are others now. The bound is the same.",
    HIDDEN: "Rules were chosen at other samples. The verdict is the same.",
    NEVER: "The condition named axes and tangents that must be parallel, which constant axes forbid: it is never met.",
    DRAWN: "Of three choices of dimensions the first that can be studied counts. Walks to samples arrive at the first "
    "now; of two words they no longer do.",
}
SHOWN = (
    "verdict",
    "refused",
    "motion",
    "minimal",
    "hidden",
    "cure",
    "motor_rank",
    "condition",
    "modes",
    "attempt",
    "steps",
)
"""Fields in the order in which they are told; the others follow from them."""


def catalog(commit: str) -> dict[str, Record]:
    """The records of a commit, by word."""
    found = {}
    for group in sorted(GROUPS):
        for ending in ("jsonl", "jsonl.gz"):
            shown = subprocess.run(["git", "show", f"{commit}:catalog/{group}.{ending}"], cwd=ROOT, capture_output=True)
            if shown.returncode == 0:
                text = gzip.decompress(shown.stdout) if ending == "jsonl.gz" else shown.stdout
                found.update({record["word"]: record for record in map(json.loads, text.splitlines()[1:])})
    return found


def reason(before: Record, now: Record) -> str:
    """Why a record changed. Raises ``StopIteration`` where none of the reasons fits."""
    if "refused" in now and "refused" not in before:
        return REFUSED
    return next(name for name, keys in FIELDS.items() if any(before.get(key) != now.get(key) for key in keys))


def told(before: Record, now: Record) -> str:
    """What changed, field by field: before → now."""
    pairs = {key: (_text(before, key), _text(now, key)) for key in SHOWN}
    if "refused" in now:
        pairs = {key: pairs[key] for key in ("verdict", "refused")}
    return "; ".join(f"{key.replace('_', ' ')}: {a} → {b}" for key, (a, b) in pairs.items() if a != b)


def _text(record: Record, key: str) -> str:
    if key == "modes":
        return "{modes_seen} of {modes_bound}".format(**record) if "modes_bound" in record else "none"
    if key == "minimal":
        return " or ".join("{" + ", ".join(legs) + "}" for legs in record.get(key, [])) or "none"
    if key == "steps":
        return ", ".join(record.get(key, [])) if "hidden" not in record else ""
    return str(record.get(key, 0 if key == "attempt" else "none"))


def page(before: Mapping[str, Record], now: Mapping[str, Record]) -> str:
    """The table of the reasons, and for each what changed and in which words."""
    kinds = defaultdict[str, list[str]](list)
    for word, record in sorted(now.items()):
        if record != before[word]:
            kinds[reason(before[word], record)].append(word)
    counts = {name: Counter(now[word]["group"] for word in kinds[name]) for name in REASONS}
    heads = ("reason", *sorted(GROUPS), "all")
    rows = [
        [name, *(str(counts[name][group] or "–") for group in sorted(GROUPS)), str(counts[name].total())]
        for name in REASONS
    ]
    rows += [
        [
            "all",
            *(str(sum(each[group] for each in counts.values())) for group in sorted(GROUPS)),
            str(sum(map(len, kinds.values()))),
        ]
    ]
    return table(heads, rows, 1) + "".join(
        f"\n## {name[0].upper()}{name[1:]}\n\n{WHY[name]}\n\n{''.join(_lines(kinds[name], before, now))}"
        for name in REASONS
    )


def _lines(words: list[str], before: Mapping[str, Record], now: Mapping[str, Record]) -> Iterator[str]:
    """The words, those with the same change together."""
    alike = defaultdict[str, list[str]](list)
    for word in words:
        alike[told(before[word], now[word])].append(word)
    for text, some in alike.items():
        yield f"- {text}\n\n    {', '.join(f'`{word}`' for word in some)}\n\n"


def complaints(name: str, before: Record, now: Record) -> Iterator[str]:
    """What the oracle says otherwise of a record that changed for a reason."""
    record = before if name == REFUSED else now
    if "refused" in record:
        return
    witness = Witness(dict(record))
    yield from witness.complaints()
    if name == MODE and not list(Witness(dict(before)).complaints()):
        yield "the record before agrees as well"
    if "modes_bound" in record and (found := max(map(witness.modes, witness.states[:2]))) > record["modes_bound"]:
        yield f"{found} modes of {record['modes_bound']}"
    if record.get("condition", "").startswith("never") and (least := witness.weakest()) < CLEAR:
        yield f"never: a singular value of {least}"


def check(before: Mapping[str, Record], now: Mapping[str, Record], count: int, seed: int) -> int:
    """Ask the oracle about some records of each reason; how many it contradicts."""
    wrong = 0
    for name in REASONS:
        words = [word for word in sorted(now) if now[word] != before[word] and reason(before[word], now[word]) == name]
        drawn = random.Random(seed).sample(words, min(count, len(words)))
        found = {word: list(complaints(name, before[word], now[word])) for word in drawn}
        found = {word: each for word, each in found.items() if each}
        print(f"{name}: {len(drawn)} of {len(words)} drawn, {len(found)} contradicted", flush=True)
        for word, each in found.items():
            print(f"  {word}: {'; '.join(sorted(set(each)))}", flush=True)
        wrong += len(found)
    return wrong


def main() -> None:
    """Write the page, or ask the oracle."""
    parser = argparse.ArgumentParser(prog="python -m catalog.changes", description=__doc__)
    parser.add_argument("before")
    parser.add_argument("now")
    parser.add_argument("-o", dest="page", type=Path)
    parser.add_argument("--check", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    before, now = catalog(asked.before), catalog(asked.now)
    if asked.page is not None:
        text = asked.page.read_text(encoding="utf-8")
        asked.page.write_text(replace_between(text, page(before, now), START), encoding="utf-8", newline="\n")
    sys.exit(bool(check(before, now, asked.check, asked.seed)))


if __name__ == "__main__":
    main()
