"""The audit: all robots of a folder of tables, or some, compared one batch after the other."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrsynth.errors import BadRequest, Defect

from .compare import CLASSES, SETTLED, compare_robot
from .limits import BATCH
from .study import Studied, StudyCase, study
from .tables import PublishedRobot, PublishedTables, read

Tell = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class TableAudit:
    """PublishedTables compared: a record of each robot, defects of the tables, and robots whose chain is in no
    table."""

    folder: str
    rows: int
    records: tuple[dict[str, Any], ...]
    defects: tuple[Defect, ...]
    no_chain: tuple[tuple[str, str, str], ...]

    @property
    def disagreements(self) -> list[dict[str, str]]:
        """All of them, in the order of the tables."""
        return [each for record in self.records for each in record["disagreements"]]

    @property
    def groups(self) -> list[dict[str, Any]]:
        """Of each group what was compared, with how many agreements, and the kinds of disagreement by what settled
        them."""
        names = sorted({record["group"] for record in self.records} | {group for group, *_ in self.no_chain})
        return [self._group(name) for name in names]

    def _group(self, name: str) -> dict[str, Any]:
        records = [record for record in self.records if record["group"] == name]
        choices = [choice for record in records for choice in record["choices"]]
        stated = [c for c in choices if c["theirs"] is not None and c["ours"] is not None]
        counts = [record["working"] for record in records]
        both = [c for c in counts if c["theirs"] is not None and c["stated"] is not None]
        kinds = Counter((each["kind"], each["settled"]) for record in records for each in record["disagreements"])
        return {
            "group": name,
            "robots": len(records),
            "without_chain": sum(group == name for group, *_ in self.no_chain),
            "moves_as_stated": sum(r["moves"] and r["motion"] == name for r in records),
            "moves_further": sum(r["moves"] and r["motion"] != name for r in records),
            "not_found": sum(not r["moves"] for r in records),
            "choices": len(choices),
            "choices_agree": sum(c["theirs"] == c["ours"] for c in stated),
            "choices_agree_in_stated": sum(c["theirs"] == c["stated"] for c in stated),
            "choices_not_stated": sum(c["theirs"] is None for c in choices),
            "choices_not_compared": sum(c["theirs"] is not None and c["ours"] is None for c in choices),
            "counts": len(both),
            "counts_agree": sum(c["theirs"] == c["stated"] for c in both),
            "watching": self._watching(records),
            "kinds": [
                {"kind": kind, "settled": settled, "number": number}
                for (kind, settled), number in sorted(kinds.items())
            ],
        }

    @staticmethod
    def _watching(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """How many robots are controllable (watching all legs shows all freedoms), partially, or not, by the least
        number of legs that show as much as all."""
        seen = [
            (sight["seen"], sight["dof"], sight["fewest"])
            for record in records
            for sight in [record["watching"]]
            if sight is not None
        ]
        words = Counter(
            ("controllable" if s == dof else "partially controllable" if s else "uncontrollable", fewest)
            for s, dof, fewest in seen
        )
        return [{"verdict": verdict, "fewest": fewest, "number": n} for (verdict, fewest), n in sorted(words.items())]

    def to_dict(self) -> dict[str, Any]:
        agree = sum(not record["disagreements"] for record in self.records)
        return {
            "folder": self.folder,
            "rows": self.rows,
            "compared": len(self.records),
            "agree": agree,
            "groups": self.groups,
            "kinds": CLASSES,
            "settlements": SETTLED,
            "disagreements": self.disagreements,
            "defects": [str(each) for each in self.defects],
            "without_chain": [{"group": g, "robot": r, "chain": c} for g, r, c in self.no_chain],
        }


def audit(
    folder: str | Path,
    *,
    only: str | None = None,
    sample: int | None = None,
    seed: int = 0,
    kept: str | Path | None = None,
    tell: Tell | None = None,
) -> TableAudit:
    """Compare published tables with what is computed here.

    ``only`` one group, ``sample`` robots of each, drawn with ``seed``; records are ``kept`` in a file, a line each,
    from which the same study continues.

    Raises
    ------
    BadRequest
        For a folder without tables, a group that they do not have, a file of another study.
    """
    tables = read(folder)
    groups = sorted({robot.group for robot in tables.robots} | {group for group, *_ in tables.no_chain})
    if only is not None and only not in groups:
        raise BadRequest("no group of these tables", only, groups)
    robots = list(_draw_robots(tables, [only] if only else groups, sample, seed))
    lost = [each for each in tables.no_chain if only in (None, each[0])]
    head = {"audit": str(folder), "only": only, "sample": sample, "seed": seed, "robots": len(robots)}
    with _Kept(kept, head) as done:
        for k in range(0, len(robots), BATCH):
            chunk = robots[k : k + BATCH]
            if any(_key(robot) not in done.records for robot in chunk):
                done.add(list(_chunk(chunk, seed)))
            if tell is not None:
                tell(chunk[-1].group, min(k + BATCH, len(robots)), len(robots))
        records = tuple(done.records[_key(robot)] for robot in robots)
    rows = len(robots) + (len(lost) if sample is None else 0)
    return TableAudit(str(folder), rows, records, tuple(tables.defects), tuple(lost))


def _draw_robots(
    tables: PublishedTables, groups: Sequence[str], sample: int | None, seed: int
) -> Iterator[PublishedRobot]:
    for group in groups:
        robots = [robot for robot in tables.robots if robot.group == group]
        if sample is not None and sample < len(robots):
            robots = sorted(random.Random(f"{seed} {group}").sample(robots, sample), key=lambda robot: robot.name)
        yield from sorted(robots, key=lambda robot: (robot.legs, len(robot.chain.joints), robot.name))


def _chunk(robots: Sequence[PublishedRobot], seed: int) -> Iterator[tuple[str, dict[str, Any]]]:
    cases = [
        StudyCase(robot, letters)
        for robot in robots
        for letters in dict.fromkeys([drive.angles for drive in robot.drives] or [""])
    ]
    studied: dict[str, list[tuple[str, Studied]]] = {}
    for case, found in study(cases, seed):
        studied.setdefault(_key(case.robot), []).append((case.letters, found))
    for robot in robots:
        yield _key(robot), compare_robot(robot, studied[_key(robot)], seed)


def _key(robot: PublishedRobot) -> str:
    return f"{robot.group} {robot.name}"


class _Kept:
    """Records, in a file too if there is to be one: what is in it need not be computed again."""

    def __init__(self, path: str | Path | None, head: dict[str, Any]) -> None:
        self.records: dict[str, dict[str, Any]] = {}
        self._file = None
        if path is None:
            return
        first = json.dumps(head)
        try:
            lines = Path(path).read_text().splitlines(keepends=True) if Path(path).exists() else []
            if lines and lines[0].strip() != first:
                raise BadRequest("records of another study", str(path), "a new file")
            whole = [line for line in lines[1:] if line.endswith("\n")]
            for line in whole:
                record = json.loads(line)
                self.records[f"{record['group']} {record['robot']}"] = record
            self._file = Path(path).open("w")  # noqa: SIM115 (closed in __exit__)
            self._file.write("".join([first + "\n", *whole]))
        except OSError as error:
            raise BadRequest(f"no file for the records: {error.strerror}", str(path)) from None
        except (ValueError, KeyError, TypeError, RecursionError):
            raise BadRequest("no records of an audit", str(path), "a new file") from None

    def __enter__(self) -> _Kept:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def add(self, made: Iterable[tuple[str, dict[str, Any]]]) -> None:
        """Keep records; returns when they are written."""
        new = [(key, record) for key, record in made if key not in self.records]
        self.records.update(new)
        if self._file is not None:
            self._file.write("".join(json.dumps(record) + "\n" for _, record in new))
            self._file.flush()
