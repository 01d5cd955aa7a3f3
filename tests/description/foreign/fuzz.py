"""Mutations of valid files of all dialects: each is read or refused, never anything else. Run as a program for many.

python tests/description/foreign/fuzz.py --count 100000 --seed 0
"""

from __future__ import annotations

import argparse
import copy
import importlib.util
import random
import re
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from lxml import etree

sys.path[:0] = [str(Path(__file__).resolve().parents[2])]  # run as a program, this folder alone is on the path

from description.foreign.examples import EXTENDED, FILES  # noqa: E402
from hrsynth.description import build_spanning_mechanism, list_robots, load, native, save  # noqa: E402
from hrsynth.errors import HrsynthError  # noqa: E402
from hrsynth.mechanism import Mechanism  # noqa: E402

SECONDS = 5
USD_SHARE = 0.01
"""Of the mutations, those of a USD file: each is opened in a process of its own, as long as a hundred others."""
WORDS = [
    "0",
    "-1",
    "1e-300",
    "1e8",
    "1e9",
    "nan",
    "inf",
    "-",
    "",
    "world",
    "base",
    "bar",
    "crank",
    "rocker",
    "true",
    "fixed",
    "ball",
    "universal",
    "revolute2",
    "screw",
    "gearbox",
    "prismatic",
    "hinge",
    "free",
    "slide",
    "0 0 0",
    "1 2 3 4",
    "__model__",
    "robot.xml",
    "../x",
    "d",
    "a",
    "3d",
    "[",
    "]",
    "'",
    '"',
    "<",
    "&",
    "\0",
    "é",
    "__cut",
    "a__1",
]
_NUMBER = re.compile(r"-?\d+\.?\d*(e-?\d+)?")
_VALUE = re.compile(r"\"[^\"]*\"|>[^<>]+<")


class Hang(BaseException):
    """A file that takes too long."""


def originals() -> list[dict[str, str]]:
    """The files that are mutated: the examples and some shipped robots."""
    robots = [{"robot.urdf": path.read_text()} for name, path in list_robots().items() if name in ("3rrr_m1", "3rps")]
    return [*FILES.values(), *EXTENDED.values(), *robots]


def stages() -> list[dict[str, str]]:
    """USD files that are mutated; none where USD cannot be read."""
    if importlib.util.find_spec("pxr") is None:
        return []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.usda"
        found = []
        for name in ("3rrr_m1", "3rps"):
            save(load(name), path)
            found.append({path.name: path.read_text()})
    return found


def mutated(text: str, rng: random.Random) -> str:
    """A text with one to four damages: of characters, numbers, values or whole elements."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        kind = rng.randrange(8)
        at = rng.randrange(len(text) + 1)
        if kind == 0:
            text = text[:at] + rng.choice(WORDS) + text[at + rng.randrange(8) :]
        elif kind == 1:
            length = rng.randrange(1, 200)
            start = rng.randrange(len(text) + 1)
            text = text[:at] + text[start : start + length] + text[at:]
        elif kind == 2:
            text = text[:at] + text[at + rng.randrange(1, 200) :]
        elif kind in (3, 4):
            found = list((_NUMBER if kind == 3 else _VALUE).finditer(text))
            if found:
                match = rng.choice(found)
                word = rng.choice(WORDS) if rng.random() < 0.5 else repr(rng.gauss(0, 1) * 10 ** rng.randrange(-8, 3))
                word = word if kind == 3 else match[0][0] + word + match[0][-1]
                text = text[: match.start()] + word + text[match.end() :]
        else:
            text = _elements(text, rng, kind)
    return text


def _elements(text: str, rng: random.Random, kind: int) -> str:
    """Remove, copy or move an element, or give it another's attributes."""
    try:
        root = etree.fromstring(text.encode())
    except (etree.XMLSyntaxError, ValueError):
        return text
    every = [each for each in root.iter() if isinstance(each.tag, str)][1:]
    if not every:
        return text
    one, two = rng.choice(every), rng.choice(every)
    if kind == 5:
        one.getparent().remove(one)
    elif kind == 6:
        two.getparent().append(copy.deepcopy(one))
    else:
        for key, value in two.attrib.items():
            if rng.random() < 0.5:
                one.set(key, value)
    return etree.tostring(root, encoding="unicode")


def check_valid(robot: Mechanism) -> None:
    """A mechanism that was read stands: finite, assembled, connected, and the same in our own dialect."""
    for link in robot.links.values():
        assert np.all(np.isfinite(link.pose))
        assert np.allclose(link.pose[:3, :3] @ link.pose[:3, :3].T, np.eye(3), atol=1e-8)
    scale = max(
        float(np.max(np.abs(each)))
        for each in (*(link.pose for link in robot.links.values()), *(joint.point for joint in robot.joints.values()))
    )
    again = native.parse(native.write(robot))
    assert again.differences(build_spanning_mechanism(robot), 1e-6 + 1e-11 * scale) == []


def outcomes(count: int, seed: int) -> Iterator[tuple[str, dict[str, str], str]]:
    """Outcome, the files and the message of each mutation; anything that is no answer is raised with its files."""
    rng, base, usd = random.Random(seed), originals(), stages()

    def stop(number: int, frame: object) -> None:
        raise Hang

    signal.signal(signal.SIGVTALRM, stop)
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(count):
            files = dict(rng.choice(usd if usd and rng.random() < USD_SHARE else base))
            name = rng.choice(list(files))
            files[name] = mutated(files[name], rng)
            path = Path(folder) / next(iter(files))
            for each in Path(folder).iterdir():
                each.unlink()
            for each, text in files.items():
                (Path(folder) / each).write_bytes(text.encode("utf-8", "surrogatepass"))
            signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
            try:
                robot = load(path)
                check_valid(robot)
                outcome = "0", files, ""
            except HrsynthError as error:
                single = all("\n" not in line for line in error.lines())
                outcome = str(error.exit_status) if single else "several lines", files, str(error)
            except BaseException as error:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0)
                outcome = f"{type(error).__name__}: {error}", files, ""
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
            yield outcome


def main() -> int:
    """Run many mutations; print what came of them, and the files of the first ones that broke something."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    broken = 0
    for number, (outcome, files, _) in enumerate(outcomes(options.count, options.seed), 1):
        counts[outcome if outcome in "023" else "broken"] += 1
        if outcome not in ("0", "2", "3"):
            broken += 1
            if broken <= 20:
                print(f"mutation {number}: {outcome[:300]}")
                for name, text in files.items():
                    print(f"--- {name}\n{text}")
        if number % 5000 == 0:
            print(number, dict(counts), file=sys.stderr)
    print(options.count, "mutations:", ", ".join(f"{key}: {value}" for key, value in sorted(counts.items())))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
