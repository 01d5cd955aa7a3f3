"""The page of a structure and the robot files of its architectures."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

from ...description import native
from ...description.files import replacement
from ...errors import HrsynthError
from ...mechanism.model import Mechanism
from ...present.drawings.schematic import robot_svg
from ...present.text.catalog import facts, motors
from ...rewrite.strategy import Step
from ..jsonl import Record
from ..source import Made, Stopped
from .folder import FOLDERS
from .render import rendered
from .structures import Structure, named
from .study import Study, study

PAGES, ROBOTS = FOLDERS
"""Folders of the pages and of the robot files."""


def written(folder: str, parts: Iterable[str]) -> Made:
    """Write the pages of packed structures, each after its robot files and whole; gives for each its word, and how its
    derivation differs from the record (empty: it does not). Raises ``Stopped`` where the disk takes no more."""
    found: Made = []
    for part in parts:
        structure = Structure.unpacked(part)
        studied = study(structure.fact)
        try:
            _write(Path(folder), structure, studied)
        except OSError as error:
            raise Stopped(f"{error.filename or folder}: {error.strerror}") from None
        found.append((structure.word, studied.differs))
    return found


def _write(folder: Path, structure: Structure, studied: Study) -> None:
    robots: dict[str, Mechanism] = {}
    for record in structure.records:
        try:
            robot = studied.real(record["word"])
            content = native.write(robot).encode()
        except HrsynthError:
            continue
        (folder / ROBOTS / f"{named(record['word'])}.urdf").write_bytes(content)
        robots[record["word"]] = robot
    with replacement(folder / PAGES / f"{structure.name}.html") as draft:
        draft.write_text(page(structure, studied, robots), encoding="utf-8")


def page(structure: Structure, studied: Study, robots: dict[str, Mechanism]) -> str:
    """The page; ``robots`` are the mechanisms that have a file, by word."""
    derivation = studied.derivation
    hidden = None if derivation is None else derivation.hidden
    shown = robots.get(structure.fact["word"])
    real = None if shown is None else robot_svg(shown, observed=_known(studied.observed, shown), title="Real robot")
    return rendered(
        "page.html", structure=structure, fact=structure.fact, facts=list(facts(structure.fact)),
        differs=studied.differs, real=real,
        hidden=None if hidden is None else robot_svg(hidden, virtual=_driven(hidden), title="Hidden robot"),
        blind=derivation is not None and hidden is None,
        steps=[] if derivation is None else trace(derivation.steps),
        variants=[_variant(record, robots.get(record["word"])) for record in structure.records])


def _known(links: Iterable[str] | None, robot: Mechanism) -> list[str] | None:
    """The observed links that the robot has by name."""
    return None if links is None else [link for link in links if link in robot.links]


def _driven(robot: Mechanism) -> list[str]:
    return [joint.name for joint in robot.joints.values() if joint.actuated]


def trace(steps: Iterable[Step]) -> list[dict[str, Any]]:
    """Steps in order; those in a row that differ by their leg alone are one, with the largest of their angles (rad)."""
    found = []
    for (rule, accepted, reason), part in groupby(steps, key=lambda step: (step.rule, step.accepted, step.reason)):
        alike = list(part)
        angles = [step.largest_angle for step in alike if step.largest_angle is not None]
        found.append({"rule": rule, "legs": ", ".join(step.leg or "all" for step in alike), "accepted": accepted,
                      "reason": reason, "angle": f"{max(angles):.1e}" if angles else ""})
    return found


def _variant(record: Record, robot: Mechanism | None) -> dict[str, Any]:
    """What a page says of one architecture: its name, its motors, its file."""
    return {"name": named(record["word"]), "word": record["word"], "notation": record.get("notation", ""),
            "motors": motors(record) if "motors" in record else "",
            "joints": [] if robot is None else _driven(robot), "file": robot is not None}
