"""Published robots as entries of the catalog: what the tables of others (README.md) name, with dimensions of
our own: random ones that close in the stated motion, the same in all legs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from hrsynth.catalog.build import WordSource
from hrsynth.catalog.entry import analyze_mechanism
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import Array, cross
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Mechanism

from .study import StudyCase
from .study import study as closed
from .tables import BASE_PAIRS, PLATFORM_PAIRS, Held, PublishedRobot, read


def published_words(folder: str | Path) -> WordSource:
    """The robots of a folder of tables, by their names, in the groups of the tables. Raises ``BadRequest``."""
    groups: dict[str, list[str]] = {}
    for robot in _robots(str(folder)).values():
        groups.setdefault(robot.group, []).append(robot.name)
    return WordSource(
        {name: partial(list, names) for name, names in sorted(groups.items())}, PublishedEntry(str(folder))
    )


@dataclass(frozen=True)
class PublishedEntry:
    """The record of a published robot, by its name."""

    folder: str

    def __call__(self, name: str) -> dict[str, Any]:
        """The verdict, exact where the architecture's geometry is recognised, and confirmed at closed configurations;
        ``choices`` are the listed choices of motors, each with its joints in each leg and how many freedoms they see;
        the motors of the record are those of the first that sees all."""
        robot = published_robot(self.folder, name)
        drawn = mechanism(robot)
        found = analyze_mechanism(drawn, partial(_sets, robot), proved=False)
        driven = _choices(robot)
        ranks = [found.motor_rank(_names(each)) for each in driven]
        best = ranks.index(found.facts["dof"]) if found.facts["dof"] in ranks else 0
        choices = [
            {"joints": [[j + 1 for j in leg] for leg in each], "rank": rank}
            for each, rank in zip(driven, ranks, strict=True)
        ]
        return {**found.record(drawn, _names(driven[best])), "choices": choices}


def _names(driven: Held) -> list[str]:
    return [f"joint_{i}_{j + 1}" for i, leg in enumerate(driven, 1) for j in leg]


@lru_cache(maxsize=1)
def _robots(folder: str) -> dict[str, PublishedRobot]:
    return {robot.name: robot for robot in read(folder).robots}


def published_robot(folder: str, name: str) -> PublishedRobot:
    """The robot of a folder of tables that is called so; raises ``BadRequest``."""
    robots = _robots(folder)
    if name not in robots:
        raise BadRequest("not a robot of these tables", name, f"{next(iter(robots))} …")
    return robots[name]


def mechanism(robot: PublishedRobot) -> Mechanism:
    """A published robot at a random closed configuration of its stated motion, the platform's frame at the point where
    the legs end. Raises ``BadRequest`` where none was found."""
    letters = next((drive.angles for drive in robot.drives), "")
    ((_, found),) = closed([StudyCase(robot, letters)], 0)
    if found.screws is None:
        raise BadRequest("no closed configuration that moves as stated", robot.name)
    b, (n, m) = Builder(robot.name), found.screws.shape[:2]
    b.link("base")
    b.link("platform")
    for i, leg in enumerate(found.screws, 1):
        centres = _centres(leg, robot.chain.kinds)
        before = "base"
        for j, (screw, kind) in enumerate(zip(leg, robot.chain.kinds, strict=True), 1):
            after = "platform" if j == m else f"link_{i}_{j}"
            if j < m:
                b.link(after, at=centres[j - 1])
            b.joint(
                f"joint_{i}_{j}",
                kind,
                before,
                after,
                centres[j - 1],
                axis=screw[3:] if kind == "R" else screw[:3],
                loop=j == m and i < n,
            )
            before = after
    return b.build(platform="platform")


def _centres(leg: Array, kinds: str) -> list[Array]:
    """The centres of a leg's joints: of a turning one the point of its axis nearest to the platform's, of a slide that
    of the turning joint before it, or else after it."""
    found: list[Array | None] = [
        cross(screw[3:], screw[:3]) if kind == "R" else None for screw, kind in zip(leg, kinds, strict=True)
    ]
    for j in [*range(1, len(found)), *range(len(found) - 2, -1, -1)]:
        near = found[j - 1] if j else None
        if found[j] is None:
            found[j] = near if near is not None else (found[j + 1] if j + 1 < len(found) else None)
    return [np.zeros(3) if each is None else each for each in found]


def _sets(robot: PublishedRobot, size: int) -> Iterator[tuple[int, ...]]:
    """Sets of so many legs, the first of each that turns into others where all legs are turned into the next: by one,
    in pairs by two."""
    step = 2 if robot.base in BASE_PAIRS or robot.platform in PLATFORM_PAIRS else 1
    known: set[tuple[int, ...]] = set()
    for places in combinations(range(robot.legs), size):
        if places not in known:
            known |= {tuple(sorted((i + by) % robot.legs for i in places)) for by in range(0, robot.legs, step)}
            yield places


def _choices(robot: PublishedRobot) -> Sequence[Held]:
    """The choices of motors that are listed, else those that are tried."""
    listed = [drive.driven for drive in robot.drives]
    return listed or [((joint,),) * robot.legs for joint in robot.tried]
