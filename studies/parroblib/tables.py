"""Published tables of symmetric parallel robots, read: leg chains, robots, their motors, what a synthesis found.

The format is described in README.md. A table may lack columns at its end, and figures that it states may be empty:
what is not stated is None. What cannot be read, contradicts itself or occurs twice is a
:class:`~hrsynth.errors.Defect` with its file and line, and the rows that need it are left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from hrsynth.errors import BadRequest, Defect, shorten_text

from .limits import LARGEST_CELL

CHAIN = re.compile(r"S(\d)([PR]+)(\d{1,9}(?:V\d{1,9})?)$", re.ASCII)
ROBOT = re.compile(r"P([1-9])([PR]+)(\d{1,9}(?:V\d{1,9})?)G(\d{1,9})P(\d{1,9})$", re.ASCII)
DRIVEN = re.compile(r"(.+)A(\d{1,9})$", re.ASCII)
GROUP = re.compile(r"(?<!\d)(?!0T0R)([0-3])T([0-3])R(?![\dA-Za-z])", re.ASCII)
WHOLE = re.compile(r"\d{1,9}", re.ASCII)
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$", re.ASCII)
ANGLE = re.compile(r"([+-]?)(?:(\d+(?:\.\d+)?)\*)?pi(?:/(\d+(?:\.\d+)?))?$", re.ASCII)
NAME = re.compile(r"(?:alpha|beta|theta|[abdq])\d{1,9}$", re.ASCII)
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
        return tuple(
            sorted({c for joint in self.joints for c in joint.cells if isinstance(c, str) and c.startswith(ANGLES)})
        )


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
        raise BadRequest("no folder of tables", str(folder), "a folder with chains/ and robots/ (README.md)")
    lists = sorted((root / "robots").glob("sym_*_list.csv"))
    if not lists:
        raise BadRequest("no table of robots", str(root / "robots"), "sym_3T0R_list.csv and the like")
    found = PublishedTables()
    once = _Once(found.defects)
    chains = {chain.name: chain for path in sorted((root / "chains").glob("*.csv")) for chain in _chains(path, once)}
    drives = _drives(root / "robots" / "actuation.csv", once)
    working = {
        key: value for path in sorted((root / "synthesis").glob("*.csv")) for key, value in _synthesis(path, once)
    }
    for path in lists:
        found.robots += _robots(path, chains, drives, working, found, once)
    for (group, robot), choices in drives.items():
        if once.has(group) and not once.has(group, robot):
            found.defects += [
                Defect(
                    each.file,
                    each.line,
                    "a choice of motors of a robot that its group does not list",
                    f"{robot}A{each.number}",
                )
                for each in choices
            ]
    found.robots.sort(key=lambda robot: (robot.group, robot.name))
    return found


class _Once:
    """Where each thing is told first; telling it again is a defect."""

    def __init__(self, defects: list[Defect]) -> None:
        self.defects = defects
        self._where: dict[tuple[object, ...], str] = {}

    def has(self, *key: object) -> bool:
        return key in self._where

    def new(self, path: Path, line: int, name: str, *key: object) -> bool:
        """Whether what a row says was not said before."""
        if key in self._where:
            self.defects.append(Defect(str(path), line, f"repeated: first in {self._where[key]}", cell_text(name)))
            return False
        self._where[key] = f"{path.name}:{line}"
        return True

    def whole(self, group: str) -> None:
        """The list of a group was read without a defect."""
        self._where[(group,)] = group


def cell_text(text: str) -> str:
    """A cell as a message shows it: on one line, not too long."""
    return shorten_text(text if text.isprintable() else ascii(text), 60)


def _rows(
    path: Path, heads: int, defects: list[Defect], named: re.Pattern[str] | None = None, *, bare: bool = False
) -> Iterator[tuple[int, list[str]]]:
    """The filled rows of a table after its heads, with their lines; a head that is ``named`` as a row is none. There is
    a row, if the table may not be ``bare``."""
    try:
        content = path.read_bytes()
    except OSError as error:
        defects.append(Defect(str(path), None, f"cannot be read: {error.strerror}"))
        return
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        defects.append(Defect(str(path), None, "cannot be read: not UTF-8"))
        return
    filled = False
    lines = content.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    for number, line in enumerate(lines, 1):
        try:
            cells = [each.strip().strip('"') for each in line.decode("utf-8").split(";")]
        except UnicodeDecodeError:
            filled = True
            defects.append(Defect(str(path), number, "not UTF-8", cell_text(line.decode("utf-8", "backslashreplace"))))
            continue
        if number <= heads:
            if named is not None and named.match(cells[0]):
                defects.append(Defect(str(path), number, "a row where a head line should be", cell_text(cells[0])))
        elif any(cells):
            filled = True
            yield number, cells
    if not filled and not bare:
        defects.append(Defect(str(path), None, "no rows"))


def _chains(path: Path, once: _Once) -> Iterator[LegChain]:
    for line, row in _rows(path, 2, once.defects, CHAIN):
        match = CHAIN.match(row[0])
        if match is None or int(match[1]) != len(match[2]):
            once.defects.append(
                Defect(str(path), line, "not the name of a chain", cell_text(row[0]), "S4PRRR1, S6RRPRRR12V2")
            )
            continue
        try:
            found = _chain(row, match[2])
        except ValueError as error:
            once.defects.append(Defect(str(path), line, str(error), cell_text(row[0])))
            continue
        if once.new(path, line, row[0], "chain", row[0]):
            yield found


def _chain(row: list[str], kinds: str) -> LegChain:
    joints = []
    for i, kind in enumerate(kinds):
        cells = row[1 + 8 * i : 9 + 8 * i]
        if len(cells) < 7 or cells[0] != kind:
            raise ValueError(f"joint {i + 1} is not a whole {kind} joint")
        values = [cell(each) for each in cells[1:7]]
        own = CELLS.index("theta" if kind == "R" else "d")
        if values[own] != f"q{i + 1}":
            raise ValueError(f"joint {i + 1}: {CELLS[own]} of {kind} is not coordinate q{i + 1}")
        for k, value in enumerate(values):
            angle = CELLS[k].startswith(ANGLES)
            if k != own and isinstance(value, str) and (value.startswith("q") or value.startswith(ANGLES) != angle):
                raise ValueError(f"joint {i + 1}: {value} is no {'angle' if angle else 'length'}, but in {CELLS[k]}")
        joints.append(PublishedJoint(kind, tuple(values)))
    end = row[1 + 8 * len(kinds) : 4 + 8 * len(kinds)]
    turns = [cell(each) if each else 0.0 for each in [*end, "", "", ""][:3]]
    if any(isinstance(each, str) for each in turns):
        raise ValueError("the turn of the end is not a number")
    return LegChain(row[0], tuple(joints), (float(turns[0]), float(turns[1]), float(turns[2])))


def cell(text: str) -> Cell:
    """A number, a multiple of π, or a name; raises ``ValueError``."""
    if NAME.match(text):
        return text
    if (match := ANGLE.match(text)) is not None and float(match[3] or 1):
        value = float(match[2] or 1) * math.pi / float(match[3] or 1)
        value = -value if match[1] == "-" else value
    else:
        value = float(text) if NUMBER.match(text) else math.nan
    if math.isnan(value):
        raise ValueError(f"a cell is neither a number, a multiple of pi nor a name: {cell_text(text) or 'empty'}")
    if abs(value) > LARGEST_CELL or 0 < abs(value) < 1 / LARGEST_CELL:
        raise ValueError(
            f"a cell is larger than {LARGEST_CELL:g}, or nearer to zero than its inverse: {cell_text(text)}"
        )
    return value


def _whole(text: str) -> int | None:
    """A whole number; None where nothing is stated. Raises ``ValueError``."""
    if text and not WHOLE.fullmatch(text):
        raise ValueError(text)
    return int(text) if text else None


def _drives(path: Path, once: _Once) -> dict[tuple[str, str], list[MotorChoice]]:
    """The choices of motors by group and robot."""
    found: dict[tuple[str, str], list[MotorChoice]] = {}
    if not path.exists():
        return found
    for line, row in _rows(path, 0, once.defects, bare=True):
        group, name = GROUP.search(row[0]), DRIVEN.match(row[1] if len(row) > 1 else "")
        robot = ROBOT.match(name[1]) if name else None
        if group is None or name is None or robot is None:
            once.defects.append(
                Defect(str(path), line, "no choice of motors", cell_text(";".join(row[:2])), "sym_3T0R;P3PRRR1G1P1A1")
            )
            continue
        legs, joints = int(robot[1]), len(robot[2])
        cells, rest = row[2 : 2 + legs * joints], row[2 + legs * joints :]
        if len(cells) < legs * joints or any(each not in ("0", "1") for each in cells):
            what = f"not {legs} × {joints} joints that are driven (1) or not (0)"
            once.defects.append(Defect(str(path), line, what, cell_text(row[1])))
            continue
        try:
            loss = _whole(rest[0]) if rest else None
        except ValueError:
            once.defects.append(Defect(str(path), line, "the loss of rank is not a whole number", cell_text(rest[0])))
            continue
        driven = tuple(tuple(j for j in range(joints) if cells[i * joints + j] == "1") for i in range(legs))
        if once.new(path, line, row[1], "choice", group[0], name[1], int(name[2])):
            found.setdefault((group[0], name[1]), []).append(
                MotorChoice(int(name[2]), driven, loss, rest[1] if len(rest) > 1 else "", str(path), line)
            )
    return found


Combination = tuple[str, str, int, int, int]
"""Group, chain, legs, G and P."""


def _synthesis(path: Path, once: _Once) -> Iterator[tuple[Combination, tuple[int | None, int | None]]]:
    """Each combination that was tried, with its status and number of working choices."""
    group = GROUP.match(path.name)
    if group is None:
        once.defects.append(Defect(str(path), None, "the name gives no group", cell_text(path.name), "3T0R.csv"))
        return
    for line, row in _rows(path, 1, once.defects, CHAIN, bare=True):
        try:
            legs, base, platform, status, count = map(_whole, [*row[1:6], *[""] * 5][:5])
        except ValueError as error:
            once.defects.append(Defect(str(path), line, "not a whole number", cell_text(str(error))))
            continue
        if not CHAIN.match(row[0]) or legs is None or base is None or platform is None:
            once.defects.append(
                Defect(str(path), line, "not a combination of a chain, legs, G and P", cell_text(";".join(row[:4])))
            )
            continue
        key = group[0], row[0], legs, base, platform
        if once.new(path, line, ";".join(row[:4]), "tried", *key):
            yield key, (status, count)


def _robots(
    path: Path,
    chains: dict[str, LegChain],
    drives: dict[tuple[str, str], list[MotorChoice]],
    working: dict[Combination, tuple[int | None, int | None]],
    found: PublishedTables,
    once: _Once,
) -> Iterator[PublishedRobot]:
    group = GROUP.search(path.name)
    if group is None:
        found.defects.append(
            Defect(str(path), None, "the name gives no group", cell_text(path.name), "sym_3T0R_list.csv")
        )
        return
    before = len(found.defects)
    for line, row in _rows(path, 1, found.defects, ROBOT):
        match = ROBOT.match(row[0])
        if match is None:
            found.defects.append(Defect(str(path), line, "not the name of a robot", cell_text(row[0]), "P3PRRR1G2P2"))
            continue
        if not once.new(path, line, row[0], group[0], row[0]):
            continue
        name = f"S{len(match[2])}{match[2]}{match[3]}"
        if any(row[1:2]) and row[1] != name:
            found.defects.append(
                Defect(str(path), line, f"the chain of {row[0]} is not that of its name", cell_text(row[1]), name)
            )
            continue
        if name not in chains:
            found.no_chain.append((group[0], row[0], name))
            continue
        base, platform = int(match[4]), int(match[5])
        if not {base, platform} <= {*COUPLINGS} or (
            int(match[1]) != 6 and (base in BASE_PAIRS or platform in PLATFORM_PAIRS)
        ):
            found.defects.append(
                Defect(
                    str(path),
                    line,
                    "unknown couplings",
                    f"G{base}P{platform}",
                    "1 to 10, pairs (G5 to G8, P4 to P6) of six legs",
                )
            )
            continue
        status, count = working.get((group[0], name, int(match[1]), base, platform), (None, None))
        yield PublishedRobot(
            group[0],
            row[0],
            chains[name],
            int(match[1]),
            base,
            platform,
            count,
            status,
            tuple(drives.get((group[0], row[0]), ())),
            str(path),
            line,
        )
    if len(found.defects) == before:
        once.whole(group[0])
