"""Published tables of symmetric parallel robots, read: leg chains, robots, their motors, what a synthesis found.

The format is told in docs/pages/audit.md. A table may lack columns at its end, and any cell may be empty: what is not
stated is None. What cannot be read is a :class:`~hrsynth.errors.Defect` with its file and line, and the rows that need
it are left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from ...errors import BadRequest, Defect

CHAIN = re.compile(r"S(\d)([PR]+)(\d+(?:V\d+)?)$")
ROBOT = re.compile(r"P(\d)([PR]+)(\d+(?:V\d+)?)G(\d+)P(\d+)$")
DRIVEN = re.compile(r"(.+)A(\d+)$")
GROUP = re.compile(r"(\d)T(\d)R")
ANGLE = re.compile(r"([+-]?)(?:(\d+(?:\.\d+)?)\*)?pi(?:/(\d+(?:\.\d+)?))?$")
NAME = re.compile(r"(?:alpha|beta|theta|[abdq])\d+$")
CELLS = ("beta", "b", "alpha", "a", "theta", "d", "offset")
"""The cells of a joint, after its type."""
ANGLES = ("alpha", "beta", "theta")
COUPLINGS = range(1, 11)
"""Numbers of the couplings, G and P, that are known."""
BASE_PAIRS, PLATFORM_PAIRS = range(5, 9), range(4, 7)
"""Those that put six legs in three pairs."""

Cell = float | str
"""A number, or the name of a free parameter or of the joint's own coordinate."""
Held = tuple[tuple[int, ...], ...]
"""The joints of each leg that are driven."""


@dataclass(frozen=True)
class PublishedJoint:
    """A joint of a chain: ``R`` or ``P``, and its cells (β, b, α, a, θ, d) in the modified form of Denavit and
    Hartenberg (W. Khalil, J. Kleinfinger, ICRA 1986): Rz(β) Tz(b) Rx(α) Tx(a) Rz(θ) Tz(d)."""

    kind: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class LegChain:
    """A leg: its joints from the base, and the turn of its end (XYZ Euler angles)."""

    name: str
    joints: tuple[PublishedJoint, ...]
    end: tuple[float, float, float]

    @property
    def kinds(self) -> str:
        """Its joints as R and P."""
        return "".join(joint.kind for joint in self.joints)

    @cached_property
    def angles(self) -> tuple[str, ...]:
        """Its free angles in the order of their names, which is that of the letters of a choice of motors."""
        return tuple(sorted({c for joint in self.joints for c in joint.cells
                             if isinstance(c, str) and c.startswith(ANGLES)}))


@dataclass(frozen=True)
class MotorChoice:
    """One choice of motors: which joints of each leg are driven, how much rank the platform is said to lose with them
    (None: not stated), for which values of the free angles, and where this is written."""

    number: int
    driven: Held
    loss: int | None
    angles: str
    file: str
    line: int


@dataclass(frozen=True)
class PublishedRobot:
    """A published robot: ``translations`` T ``rotations`` R, so many legs of a chain, coupled to base (G) and platform
    (P); ``working``: how many choices of motors are said to work (None: not stated)."""

    group: str
    name: str
    chain: LegChain
    legs: int
    base: int
    platform: int
    working: int | None
    status: int | None
    drives: tuple[MotorChoice, ...]
    file: str
    line: int

    @property
    def motion(self) -> tuple[int, int]:
        """Translations and rotations that its table says."""
        translations, rotations = self.group.split("T")
        return int(translations), int(rotations[:-1])

    @property
    def tried(self) -> tuple[int, ...]:
        """The joints, the same in each leg, that a choice of motors of these tables drives: the slides of a chain that
        has any, else the first four; never the last joint of a planar or shorter leg."""
        kinds = self.chain.kinds
        if len(kinds) <= 3:
            return tuple(range(len(kinds) - 1)) if len(kinds) == 3 else tuple(range(len(kinds)))
        slides = tuple(i for i, kind in enumerate(kinds) if kind == "P")
        return slides or tuple(range(min(4, len(kinds))))


@dataclass
class PublishedTables:
    """What a folder of tables says: its robots, sorted by group and name, and what could not be read or is missing."""

    robots: list[PublishedRobot] = field(default_factory=list)
    defects: list[Defect] = field(default_factory=list)
    no_chain: list[tuple[str, str, str]] = field(default_factory=list)
    """(group, robot, chain) of robots whose chain no table has."""


def read(folder: str | Path) -> PublishedTables:
    """The tables of a folder; raises ``BadRequest`` where it holds none."""
    root = Path(folder)
    if not root.is_dir():
        raise BadRequest("no folder of tables", str(folder), "a folder with chains/ and robots/ (docs/pages/audit.md)")
    lists = sorted((root / "robots").glob("sym_*_list.csv"))
    if not lists:
        raise BadRequest("no table of robots", str(root / "robots"), "sym_3T0R_list.csv and the like")
    found = PublishedTables()
    chains = {chain.name: chain for path in sorted((root / "chains").glob("*.csv"))
              for chain in _chains(path, found.defects)}
    drives = _drives(root / "robots" / "actuation.csv", found.defects)
    working = {key: value for path in sorted((root / "synthesis").glob("*.csv"))
               for key, value in _synthesis(path, found.defects)}
    for path in lists:
        found.robots += _robots(path, chains, drives, working, found)
    found.robots.sort(key=lambda robot: (robot.group, robot.name))
    return found


def _rows(path: Path, heads: int, defects: list[Defect]) -> Iterator[tuple[int, list[str]]]:
    """The filled rows of a table after its heads, with their lines."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        defects.append(Defect(str(path), None, f"cannot be read: {getattr(error, 'strerror', None) or 'not UTF-8'}"))
        return
    for number, line in enumerate(text.splitlines(), 1):
        cells = [cell.strip().strip('"') for cell in line.split(";")]
        if number > heads and any(cells):
            yield number, cells


def _chains(path: Path, defects: list[Defect]) -> Iterator[LegChain]:
    for line, row in _rows(path, 2, defects):
        match = CHAIN.match(row[0])
        if match is None or int(match[1]) != len(match[2]):
            defects.append(Defect(str(path), line, "not the name of a chain", row[0], "S4PRRR1, S6RRPRRR12V2"))
            continue
        try:
            yield _chain(row, match[2])
        except ValueError as error:
            defects.append(Defect(str(path), line, str(error), row[0]))


def _chain(row: list[str], kinds: str) -> LegChain:
    joints = []
    for i, kind in enumerate(kinds):
        cells = row[1 + 8 * i: 9 + 8 * i]
        if len(cells) < 7 or cells[0] != kind:
            raise ValueError(f"joint {i + 1} is not a whole {kind} joint")
        values = [cell(each) for each in cells[1:7]]
        own = CELLS.index("theta" if kind == "R" else "d")
        if not (isinstance(values[own], str) and str(values[own]).startswith("q")):
            raise ValueError(f"joint {i + 1}: {CELLS[own]} of {kind} is not coordinate q{i + 1}")
        joints.append(PublishedJoint(kind, tuple(values)))
    end = row[1 + 8 * len(kinds): 4 + 8 * len(kinds)]
    turns = [cell(each) if each else 0.0 for each in [*end, "", "", ""][:3]]
    if any(isinstance(each, str) for each in turns):
        raise ValueError("the turn of the end is not a number")
    return LegChain(row[0], tuple(joints), (float(turns[0]), float(turns[1]), float(turns[2])))


def cell(text: str) -> Cell:
    """A number, a multiple of π, or a name; raises ``ValueError``."""
    match = ANGLE.match(text)
    if match is not None:
        value = float(match[2] or 1) * math.pi / float(match[3] or 1)
        return -value if match[1] == "-" else value
    if NAME.match(text):
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"a cell is neither a number, a multiple of pi nor a name: {text or 'empty'}")
    return value


def _drives(path: Path, defects: list[Defect]) -> dict[tuple[str, str], list[MotorChoice]]:
    """The choices of motors by group and robot."""
    found: dict[tuple[str, str], list[MotorChoice]] = {}
    if not path.is_file():
        return found
    for line, row in _rows(path, 0, defects):
        group, name = GROUP.search(row[0]), DRIVEN.match(row[1] if len(row) > 1 else "")
        robot = ROBOT.match(name[1]) if name else None
        if group is None or name is None or robot is None:
            defects.append(Defect(str(path), line, "no choice of motors", ";".join(row[:2]), "sym_3T0R;P3PRRR1G1P1A1"))
            continue
        legs, joints = int(robot[1]), len(robot[2])
        cells, rest = row[2: 2 + legs * joints], row[2 + legs * joints:]
        if len(cells) < legs * joints or any(each not in ("0", "1", "") for each in cells):
            what = f"not {legs} × {joints} joints that are driven (1) or not (0)"
            defects.append(Defect(str(path), line, what, row[1]))
            continue
        loss = rest[0] if rest else ""
        if loss and not loss.isdigit():
            defects.append(Defect(str(path), line, "the loss of rank is not a whole number", loss))
            continue
        driven = tuple(tuple(j for j in range(joints) if cells[i * joints + j] == "1") for i in range(legs))
        found.setdefault((group[0], name[1]), []).append(
            MotorChoice(int(name[2]), driven, int(loss) if loss else None, rest[1] if len(rest) > 1 else "", str(path),
                        line))
    return found


def _synthesis(path: Path, defects: list[Defect]) -> Iterator[tuple[tuple[str, str, int, int], tuple[int | None, ...]]]:
    """(group, chain, G, P) of each combination that was tried, with its status and number of working choices."""
    group = GROUP.match(path.name)
    if group is None:
        return
    for line, row in _rows(path, 1, defects):
        numbers = [int(each) if each.isdigit() else None for each in [*row[2:6], "", "", "", ""][:4]]
        if not CHAIN.match(row[0]) or numbers[0] is None or numbers[1] is None:
            defects.append(Defect(str(path), line, "not a combination of a chain, G and P", ";".join(row[:4])))
            continue
        yield (group[0], row[0], numbers[0], numbers[1]), (numbers[2], numbers[3])


def _robots(path: Path, chains: dict[str, LegChain], drives: dict[tuple[str, str], list[MotorChoice]],
            working: dict[tuple[str, str, int, int], tuple[int | None, ...]], found: PublishedTables
            ) -> Iterator[PublishedRobot]:
    group = GROUP.search(path.name)
    if group is None:
        found.defects.append(Defect(str(path), None, "the name gives no group", path.name, "sym_3T0R_list.csv"))
        return
    for line, row in _rows(path, 1, found.defects):
        match = ROBOT.match(row[0])
        if match is None:
            found.defects.append(Defect(str(path), line, "not the name of a robot", row[0], "P3PRRR1G2P2"))
            continue
        name = f"S{len(match[2])}{match[2]}{match[3]}"
        if name not in chains:
            found.no_chain.append((group[0], row[0], name))
            continue
        base, platform = int(match[4]), int(match[5])
        if not {base, platform} <= {*COUPLINGS} or (
                int(match[1]) != 6 and (base in BASE_PAIRS or platform in PLATFORM_PAIRS)):
            found.defects.append(Defect(str(path), line, "unknown couplings", f"G{base}P{platform}",
                                        "1 to 10, pairs (G5 to G8, P4 to P6) of six legs"))
            continue
        status, count = working.get((group[0], name, base, platform), (None, None))
        yield PublishedRobot(group[0], row[0], chains[name], int(match[1]), base, platform, count, status,
                    tuple(drives.get((group[0], row[0]), ())), str(path), line)
