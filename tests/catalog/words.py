"""Random words with dimensions of their own: does every leg set get the same verdict for every seed of the samples?

    python -m catalog.words COUNT [--dimensions 2] [--seeds 3] [--workers 2] [--output words.jsonl] [--first 0]

Half of the words are listed ones, half have legs of several listed ones. One line of the output is one robot: what each
seed answers, the ranks of all leg sets or the class of the refusal. A run that is started again on its output goes on.
Exit status 1 where seeds disagree or samples are a mixture of operation modes.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from hrsynth.analysis.observed import GENERIC_SAMPLES_COUNT, ObservedRobot
from hrsynth.catalog.architecture_key import ArchitectureKey, parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.catalog.groups import GROUPS
from hrsynth.errors import HrsynthError
from hrsynth.kinematics.branch_tests import Signature

OWN = 1000
"""Numbers of dimensions from here on are used by nothing else."""


@cache
def listed(group: str) -> list[str]:
    """The words of a group without their motors, each once: motors change no verdict."""
    return sorted({str(parse(text).unmoved) for text in GROUPS[group]()})


def word(number: int) -> str:
    """The random word of this number, always the same."""
    rng = random.Random(number)
    texts = listed(rng.choice(sorted(GROUPS)))
    one = parse(rng.choice(texts))
    if number % 2 == 0 or one.platform:
        return str(one)
    legs = [leg for _ in range(3) for other in [parse(rng.choice(texts))] if not other.platform for leg in other.legs]
    count = rng.randint(2, 4)
    return str(ArchitectureKey.of([rng.choice([*one.legs, *legs]) for _ in range(count)]))


def ranks(setup: ObservedRobot) -> list[int]:
    """What each set of legs sees for certain at some sample; a sample near a singularity may leave it open."""
    signatures = [Signature.of(member.relation) for member in setup.all_samples.members]
    return [max(low for low, _ in answers) for answers in zip(*(each.seen for each in signatures), strict=True)]


def answer(text: str, dimensions: int, seed: int, samples: int) -> str:
    """The ranks of all leg sets for one seed, or how the robot is refused."""
    try:
        setup = ObservedRobot.of(build_mechanism(parse(text), dimensions), samples=samples, seed=seed)
    except HrsynthError as error:
        return f"{type(error).__name__}: {getattr(error, 'what', '')[:60]}"
    counts = f"{setup.dof} {setup.mobility.total} {setup.all_samples.signature.motion}"
    return f"{counts} {' '.join(map(str, ranks(setup)))}"


def robot(task: tuple[str, int, int, int]) -> dict[str, Any]:
    """One line: a word with one choice of dimensions, at all seeds."""
    text, dimensions, seeds, samples = task
    start, answers = time.process_time(), list[str]()
    for seed in range(seeds):
        answers.append(answer(text, dimensions, seed, samples))
        if answers[-1].startswith("BadRequest") or answers[-1].startswith("BadMechanism"):
            answers *= seeds
            break
    return {
        "key": text,
        "dimensions": dimensions,
        "answers": answers[:seeds],
        "seconds": round(time.process_time() - start, 2),
    }


def tasks(asked: argparse.Namespace, known: set[tuple[str, int]]) -> Iterator[tuple[str, int, int, int]]:
    """What is left to do."""
    for number in range(asked.first, asked.first + asked.count):
        text = word(number)
        for dimensions in range(OWN, OWN + asked.dimensions):
            if (text, dimensions) not in known:
                known.add((text, dimensions))
                yield text, dimensions, asked.seeds, asked.samples


def defect(row: dict[str, Any]) -> str | None:
    """What is wrong with a line."""
    answers = row["answers"]
    if any("configurations reached differ" in each for each in answers):
        return "mixture refused"
    return "seeds differ" if len(set(answers)) > 1 else None


def summary(rows: list[dict[str, Any]]) -> str:
    """Counts, and the lines that are wrong."""
    kinds = Counter(
        defect(row) or ("refused: " + row["answers"][0] if ": " in row["answers"][0] else "same verdicts")
        for row in rows
    )
    lines = [
        f"{len(rows)} robots of {len({row['key'] for row in rows})} words, "
        f"{sum(row['seconds'] for row in rows):.0f} s of processor time"
    ]
    lines += [f"  {count:6d}  {kind}" for kind, count in kinds.most_common()]
    lines += [
        f"{defect(row)}: {row['key']} dimensions {row['dimensions']}: {Counter(row['answers']).most_common()}"
        for row in rows
        if defect(row)
    ]
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Run, go on, sum up."""
    parser = argparse.ArgumentParser(prog="python -m catalog.words", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("count", type=int)
    parser.add_argument("--dimensions", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=GENERIC_SAMPLES_COUNT)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--output", type=Path, default=Path("words.jsonl"))
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args(arguments)
    text = asked.output.read_text(encoding="utf-8") if asked.output.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    left = tasks(asked, {(row["key"], row["dimensions"]) for row in rows})
    with asked.output.open("a", encoding="utf-8") as file, multiprocessing.Pool(asked.workers) as pool:
        for row in pool.imap_unordered(robot, left, chunksize=4):
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    print(summary(rows))
    return int(any(map(defect, rows)))


if __name__ == "__main__":
    sys.exit(main())
