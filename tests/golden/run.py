"""``python -m golden.run make`` writes what every command answers, ``… compare`` tells what has changed since.

From ``tests/``. ``--only TEXT``: cases whose names hold it; ``--workers N``. What was changed on purpose (names of JSON
fields, words, what was added) stands in ``renamed.toml``. The exit status of ``compare`` is 1 where anything differs.
Files of others are read where they are; cases that only one side has are listed. ``--numbers`` compares numbers, truth
values and their count alone, in JSON and in text, whatever the words and the names of fields are.
"""

from __future__ import annotations

import argparse
import gzip
import json
import multiprocessing
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from golden.answers import Case, asked, cases
from golden.differences import GREY, differences, inlined, numbers_differ, of_pictures, renamed, without

KEPT = Path(__file__).parent / "answers.jsonl.gz"
NAMES = Path(__file__).parent / "renamed.toml"


def answers(chosen: Iterable[Case], workers: int) -> Iterator[tuple[str, Any]]:
    """The answers to cases, in order, by processes that last for few cases each."""
    chosen = list(chosen)
    with multiprocessing.get_context("spawn").Pool(workers, maxtasksperchild=40) as pool:
        for place, found in enumerate(pool.imap(asked, chosen), 1):
            if sys.stderr.isatty() or place % 100 == 0:
                print(f"{place} of {len(chosen)}: {found[0]}", file=sys.stderr)
            yield found


def changes(old: Any, new: Any, meant: dict[str, Any]) -> list[str]:
    """What differs in two answers to one case, but for what was ``meant``."""
    added = meant["added"]["fields"], meant["added"]["lines"]
    old, new = without(renamed(old, meant["fields"], meant["words"]), *added), without(new, *added)
    for each in (old, new):
        if isinstance(each.get("json"), dict) and "$defs" in each["json"]:
            each["json"] = inlined(each["json"], each["json"]["$defs"])
    before, after = old.pop("pixels", None), new.pop("pixels", None)
    found = list(differences(old, new))
    if (before is None) != (after is None):
        found.append("a picture on one side only")
    elif before is not None and (off := of_pictures(before, after)) > GREY:
        found.append(f"pixels differ by {off:.1f} of 255 on average")
    return found


def main() -> int:
    """Make the golden files, or compare with them."""
    parser = argparse.ArgumentParser(prog="golden", description=__doc__)
    parser.add_argument("what", choices=("make", "compare"))
    parser.add_argument("--only", default="")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--numbers", action="store_true")
    given = parser.parse_args()
    chosen = [case for case in cases() if given.only in case.key]
    known: dict[str, Any] = {}
    if KEPT.exists():
        with gzip.open(KEPT, "rt") as lines:
            known = dict(map(json.loads, lines))
    if given.what == "make":
        known |= answers(chosen, given.workers)
        kept = (json.dumps(each, sort_keys=True) + "\n" for each in known.items())
        KEPT.write_bytes(gzip.compress("".join(kept).encode(), mtime=0))
        print(f"{len(known)} answers, {KEPT.stat().st_size / 1e3:.0f} kB")
        return 0
    meant = tomllib.loads(NAMES.read_text())
    for old, now in meant["commands"].items():
        known = {re.sub(rf": {old}(?= |$)", f": {now}", key): value for key, value in known.items()}
    new = [case.key for case in chosen if case.key not in known]
    differ = 0
    for key, found in answers((case for case in chosen if case.key in known), given.workers):
        now = json.loads(json.dumps(found))
        if (
            told := list(numbers_differ(known[key], without(now, *meant["added"].values())))
            if given.numbers
            else changes(known[key], now, meant)
        ):
            differ += 1
            print(f"{key}\n  " + "\n  ".join(told[:5]) + (f"\n  … {len(told) - 5} more" if len(told) > 5 else ""))
    print(f"{len(chosen) - len(new)} answers compared, {differ} differ; {len(new)} new")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
