"""A standing adversary: random robots, and for each answer of the engine a brute-force search that shares no code.

``python -m adversary.run --count 300 --seed 0 --workers 2 --log robots.jsonl`` (from ``tests/``): a line of the log a
robot, so that a run that was broken off goes on (with the same code); a table at the end; exit status 1 where something
is wrong.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from adversary import words
from adversary.case import WRONG, Case
from adversary.claims.table import CLAIMS
from adversary.kinds import KINDS

WORDS = {f"{group} words": group for group in words.GROUPS}
ALL = (*KINDS, *WORDS)


def made(kind: str, seed: int, folder: Path) -> Case:
    """The robot of a kind and a seed, its file in a folder."""
    rng = np.random.default_rng([seed, ALL.index(kind)])
    path = folder / f"{kind.replace(' ', '_')}_{seed}.urdf"
    if kind in WORDS:
        words.write(WORDS[kind], rng, path)
        case = Case(kind, seed, path, rng)
        case.bars = words.bars(case.robot.links)
        return case
    robot = KINDS[kind](rng)
    path.write_text(robot.text(rng if rng.random() < 0.3 else None), encoding="utf-8")
    return Case(kind, seed, path, rng, robot.pairs, robot.turned)


def attacked(kind: str, seed: int, folder: Path | None = None, only: Sequence[str] = ()) -> dict[str, Any]:
    """All that is found of one robot: the log's record. ``only`` names the checks that are made, each then for sure."""
    start = time.process_time()
    with tempfile.TemporaryDirectory() as scratch:
        case = made(kind, seed, folder or Path(scratch))
        spent = {}
        for name, (check, share) in CLAIMS.items():
            chance = case.rng.random()
            if (name not in only) if only else chance >= share:
                continue
            case.rng = np.random.default_rng([seed, ALL.index(kind), list(CLAIMS).index(name)])
            begin = time.process_time()
            check(case)
            spent[name] = round(time.process_time() - begin, 3)
    return {
        "kind": kind,
        "seed": seed,
        "seconds": round(time.process_time() - start, 3),
        "spent": spent,
        "said": [[s.claim, s.outcome, s.detail] for s in case.found],
    }


def code() -> str:
    """What tells one state of the engine and of its adversary from another."""
    import hrsynth

    found = hashlib.sha256()
    for path in sorted([*Path(hrsynth.__file__).parent.rglob("*.py"), *Path(__file__).parent.rglob("*.py")]):
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


def _task(task: tuple[str, int]) -> dict[str, Any]:
    try:
        return attacked(*task)
    except Exception as error:  # a defect of the adversary itself: told, not hidden
        import traceback

        return {
            "kind": task[0],
            "seed": task[1],
            "seconds": 0.0,
            "spent": {},
            "said": [["adversary", WRONG, f"{type(error).__name__}: {error} {traceback.format_exc()[-600:]}"]],
        }


def table(records: Iterable[dict[str, Any]]) -> str:
    """Robots and claims by kind: of each claim how often it was checked and right, and in brackets what was unclear."""
    records = list(records)
    claims = list(dict.fromkeys(said[0] for record in records for said in record["said"]))
    lines = [" | ".join(["kind", "robots", "s", *claims])]
    for kind in [*ALL, "all"]:
        own = [record for record in records if kind in (record["kind"], "all")]
        if not own:
            continue
        counts = Counter((claim, outcome) for record in own for claim, outcome, _ in record["said"])
        cells = [
            f"{counts[claim, 'held']}"
            + (f" ({counts[claim, 'unclear']})" if counts[claim, "unclear"] else "")
            + (f" WRONG {counts[claim, WRONG]}" if counts[claim, WRONG] else "")
            for claim in claims
        ]
        lines.append(" | ".join([kind, str(len(own)), f"{np.mean([r['seconds'] for r in own]):.2f}", *cells]))
    refused = Counter(
        f"{claim}: {detail}" for record in records for claim, outcome, detail in record["said"] if outcome == "refused"
    )
    lines += ["", "refused, by reason:", *(f"{count:6d}  {reason}" for reason, count in refused.most_common(40))]
    spent = Counter[str]()
    for record in records:
        spent.update(record["spent"])
    lines += [
        "",
        "seconds a robot: "
        + ", ".join(f"{name} {value / max(1, len(records)):.3f}" for name, value in spent.most_common()),
    ]
    return "\n".join(lines)


def wrong(records: Iterable[dict[str, Any]]) -> list[str]:
    """What is wrong, a line each."""
    return [
        f"{record['kind']} {record['seed']}: {claim}: {detail}"
        for record in records
        for claim, outcome, detail in record["said"]
        if outcome == WRONG
    ]


def tasks(count: int, seed: int, kinds: Sequence[str] = ALL) -> list[tuple[str, int]]:
    """So many robots, the kinds in turn."""
    return [(kinds[i % len(kinds)], seed + i // len(kinds)) for i in range(count)]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", default=",".join(ALL))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--log", type=Path, default=None)
    given = parser.parse_args(arguments)
    chosen = given.kinds.split(",")
    if unknown := set(chosen) - set(ALL):
        parser.error(f"unknown kinds {', '.join(sorted(unknown))}: expected {', '.join(ALL)}")
    wanted = tasks(given.count, given.seed, chosen)
    done, now = {}, code()
    if given.log is not None and given.log.exists():
        for line in given.log.read_text(encoding="utf-8").splitlines():
            if line.endswith("}"):
                record = json.loads(line)
                if record["code"] == now:
                    done[record["kind"], record["seed"]] = record
    rest = [task for task in wanted if task not in done]
    with ProcessPoolExecutor(given.workers) as pool:
        for record in pool.map(_task, rest, chunksize=4):
            done[record["kind"], record["seed"]] = record = {**record, "code": now}
            if given.log is not None:
                with given.log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
            for line in wrong([record]):
                print("WRONG", line, flush=True)
    records = [done[task] for task in wanted]
    print(table(records))
    return 1 if wrong(records) else 0


if __name__ == "__main__":
    sys.exit(main())
