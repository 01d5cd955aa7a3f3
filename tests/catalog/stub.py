"""A small catalog that is quick to build: words of letters, records with all that a query asks for.

python -m catalog.stub TARGET [WORKERS]      build it, slowly
"""

from __future__ import annotations

import hashlib
import os
import random
import re
import signal
import sys
import time
from importlib.util import find_spec
from itertools import combinations
from typing import Any

from hrsynth.catalog.build import WordSource, build
from hrsynth.errors import HrsynthError

DELAY = float(os.environ.get("STUB_DELAY", "0"))
VERDICTS = ("controllable", "partially controllable", "uncontrollable")
CHAINS = ("R*RR", "RR*R", "UP*S", "P*US", "R*-{2-SS}", "RRR")
REFUSED = "(c07*)"
ASKED: dict[str, tuple[Any, ...]] = {
    "legs": ("*R*", "3-R*", "*-R*R*-*", "?-?R*", "PUS", "*(Rz*", "*", 3),
    "dof": (3, 2, 9),
    "motion": ("3T", "2T1R"),
    "verdict": ("partially controllable", "controllable"),
    "sensor": ("3point", "3point'"),
    "group": ("mixed", "planar"),
    "base_motors": (True, False),
    "fewest": (2, 0),
    "modes": (2, 6),
    "text": ("takeover", "x", "rrr", "hexaglide", "lift 1", "(Rz", "the lines", ""),
}
"""What the shipped catalog is asked for by each name."""
QUESTIONS: tuple[dict[str, Any], ...] = (
    {},
    *({name: value} for name, every in ASKED.items() for value in every),
    *({name: ASKED[name][0], other: value} for name, other in combinations(ASKED, 2) for value in ASKED[other][:2]),
    {"legs": 3, "verdict": "controllable"},
    {"text": "x", "legs": "*-R*R*-*", "verdict": "partially controllable"},
    {"legs": ("3-R*", "*S"), "text": ("x", "rrr")},
    {"text": "rrr", "legs": "*P*", "base_motors": True},
)
"""What it is asked for: by each name alone, by two, and by more."""
WORKERS = 2 if find_spec("joblib") else 1
"""The extra with joblib may be missing."""


class Refused(HrsynthError):
    exit_status = 3


def words(letter: str, count: int) -> list[str]:
    """Words in pairs of kin, not in order."""
    every = [f"({letter}{i:02d}{mark})" for i in range(count) for mark in ("", "*")]
    return random.Random(letter).sample(every, len(every))


def kin(word: str) -> str:
    return word.replace("*", "")


def entry(word: str) -> dict[str, Any]:
    time.sleep(DELAY)
    if word == REFUSED:
        raise Refused(f"{word}: refused\non two lines")
    draw = random.Random(hashlib.sha256(word.encode()).digest())
    dof, legs = draw.randint(2, 6), draw.randint(2, 6)
    rank = draw.randint(0, dof)
    verdict = VERDICTS[0 if rank == dof else 2 if rank == 0 else 1]
    return {
        "key": word,
        "notation": f"{legs}-{draw.choice(CHAINS)}",
        "hidden": None if rank == 0 else "2-U*PS",
        "legs": legs,
        "dof": dof,
        "motion": f"{dof}T" if dof < 4 else f"3T{dof - 3}R",
        "mobility": dof,
        "internal": 0,
        "verdict": verdict,
        "rank": rank,
        "exact": True,
        "instances": 1 if rank == dof else 5,
        "base_motors": draw.random() < 0.5,
        "motors": legs,
        "fewest": min(rank, legs),
        "minimal": [["1"]],
        "unobserved": ["rotation"] if rank < dof else [],
        "condition": "the lines σ meet",
        "modes_bound": 2 * rank or None,
        "modes_seen": rank or None,
        "driven": draw.random() < 0.5,
    }


def without_checksum(text: str) -> str:
    """A group's file of an older version, which can be edited."""
    return re.sub(r',"crc32":"[0-9a-f]{8}"', "", text, count=1)


def died(word: str) -> dict[str, Any]:
    """A record whose process does not survive it."""
    if word == "(d04*)":
        os.kill(os.getpid(), signal.SIGKILL)
    return entry(word)


def broken(word: str) -> dict[str, Any]:
    """A defect."""
    return entry(word) if word != "(c05)" else {"key": word, "dof": [][0]}


def slowly(word: str) -> dict[str, Any]:
    time.sleep(0.1)
    return entry(word)


def source(sizes: tuple[int, ...] = (12, 9)) -> WordSource:
    """Groups ``c`` and ``d`` with so many pairs of words."""
    return WordSource({name: _Words(name, size) for name, size in zip("cd", sizes, strict=True)}, entry, kin)


class _Words:
    def __init__(self, letter: str, count: int) -> None:
        self.letter, self.count = letter, count

    def __call__(self) -> list[str]:
        return words(self.letter, self.count)


if __name__ == "__main__":
    build(sys.argv[1], source=source(), workers=int(sys.argv[2]) if len(sys.argv) > 2 else 1)
