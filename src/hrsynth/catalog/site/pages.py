"""The page of a structure, with its derivation made again, and the robot files of its architectures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...analysis.derive import Derivation, derive
from ...analysis.pose_requests import observe
from ...description import native
from ...description.files import open_replacement
from ...errors import HrsynthError
from ...mechanism.model import Mechanism
from ...present.drawings.schematic import draw_robot_svg
from ...present.portrait import Portrait
from ...present.report.pages import PORTRAIT
from ...present.report.pages import describe_robot as derivation_parts
from ...present.text.catalog import describe_motors, list_facts
from ...present.view.view import find_plane_normal
from ..architecture_key import parse
from ..entry import VERDICT_SAMPLES_COUNT, choose_study_model, derive_smallest_sets
from ..executors import Made, WorkInterruption
from ..geometry import build_mechanism
from ..jsonl import Record
from ..known import find_alias
from .folder import FOLDERS
from .index import render
from .sentences import answer, describe_rules
from .structures import Structure, hash_name

PAGES, ROBOTS, DRAWINGS = FOLDERS
"""Folders of the pages, of the robot files and of the small drawings."""
SMALL = (104.0, 78.0)
"""Width and height of a small drawing (pixels)."""


def write_pages(folder: str, parts: Iterable[str]) -> Made:
    """Write the pages of packed structures, each after its robot files and whole; gives for each its word, and how its
    derivation differs from the record (empty: it does not). Raises ``WorkInterruption`` where the disk takes no
    more."""
    found: Made = []
    for part in parts:
        structure = Structure.unpack(part)
        studied = derive_study(structure.fact)
        try:
            _write(Path(folder), structure, studied)
        except OSError as error:
            raise WorkInterruption(f"{error.filename or folder}: {error.strerror}") from None
        found.append((structure.word, studied.differs))
    return found


def _write(folder: Path, structure: Structure, studied: Study) -> None:
    robots: dict[str, Mechanism] = {}
    for record in structure.records:
        try:
            robot = studied.real(record["key"])
            content = native.write(robot).encode()
        except HrsynthError:
            continue
        if "refused" not in record:
            (folder / ROBOTS / f"{hash_name(record['key'])}.urdf").write_bytes(content)
        robots[record["key"]] = robot
    shown = robots.get(structure.fact["key"])
    drawn = None if shown is None else _draw_portrait(shown, studied)
    if drawn is not None:
        (folder / DRAWINGS / f"{structure.name}.svg").write_text(drawn.svg(*SMALL), encoding="utf-8")
    with open_replacement(folder / PAGES / f"{structure.name}.html") as draft:
        draft.write_text(render_page(structure, studied, robots, drawn), encoding="utf-8")


def _draw_portrait(robot: Mechanism, studied: Study) -> Portrait:
    """Draw the robot in space, with its observed links and plane of motion if known."""
    if studied.derivation is None:
        return Portrait.draw(robot, [robot.platform], (), None)
    setup = studied.derivation.setup
    return Portrait.draw(
        robot,
        [link for link in setup.decomposition.platform if link in robot.links] or [robot.platform],
        _find_named_links(studied.observed, robot) or (),
        find_plane_normal(setup.motion),
    )


def render_page(structure: Structure, studied: Study, robots: dict[str, Mechanism], drawn: Portrait | None) -> str:
    """The page; ``robots`` are the mechanisms that are drawn, by word; ``drawn`` is the robot in space."""
    found, record = studied.derivation, structure.fact
    shown = robots.get(record["key"])
    known: dict[str, Any] = {"graphs": [], "things": "legs", "real": record.get("notation", ""), "found": None}
    if found is not None:
        known = derivation_parts(found)
    if shown is not None:
        known["graphs"][:1] = [draw_robot_svg(shown, observed=_find_named_links(studied.observed, shown))]
    return render(
        "page.html",
        **known
        | {
            "name": structure.word,
            "portrait": None if drawn is None else drawn.svg(*PORTRAIT),
            "answer": list(answer(record)),
            "pairs": [],
        },
        structure=structure,
        record=record,
        facts=list(list_facts(record, studied.smallest)),
        alias=find_alias(record["key"]),
        rules=list(describe_rules(record)),
        differs=studied.differs,
        variants=[
            _describe_variant(each, None if "refused" in each else robots.get(each["key"]))
            for each in structure.records
        ],
    )


def _find_named_links(links: Iterable[str] | None, robot: Mechanism) -> list[str] | None:
    """The observed links that the robot has by name."""
    return None if links is None else [link for link in links if link in robot.links]


def _list_actuated_joints(robot: Mechanism) -> list[str]:
    return [joint.name for joint in robot.joints.values() if joint.is_actuated]


def _describe_variant(record: Record, robot: Mechanism | None) -> dict[str, Any]:
    """Return the data of one architecture for a page: name, motors, file."""
    return {
        "name": hash_name(record["key"]),
        "key": record["key"],
        "notation": record.get("notation", ""),
        "motors": describe_motors(record) if "motors" in record else "",
        "joints": [] if robot is None else _list_actuated_joints(robot),
        "file": robot is not None,
    }


@dataclass(frozen=True, eq=False)
class Study:
    """Number of the dimensions, the derivation with these (or None), and its result or error if it differs from the
    entry."""

    attempt: int
    derivation: Derivation | None = None
    differs: str = ""
    smallest: Sequence[Record] = ()

    @property
    def observed(self) -> tuple[str, ...] | None:
        """The observed links; None where nothing is known of them."""
        return None if self.derivation is None else tuple(each.link for each in self.derivation.setup.observed)

    def real(self, word: str) -> Mechanism:
        """The robot of an architecture of this structure."""
        return build_mechanism(parse(word), self.attempt)


def derive_study(record: Record) -> Study:
    """Derive the hidden robot of a record in its dimensions; none where it is refused."""
    attempt = record.get("attempt", 0)
    if "refused" in record:
        return Study(attempt)
    try:
        drawn = build_mechanism(choose_study_model(parse(record["key"])), attempt)
        found = derive(observe(drawn, samples=VERDICT_SAMPLES_COUNT), unchecked=False)
    except HrsynthError as error:
        return Study(attempt, differs=str(error).splitlines()[0])
    return Study(attempt, found, _describe_difference(found, record), derive_smallest_sets(record, drawn))


def _describe_difference(found: Derivation, record: Record) -> str:
    """Return the result of a derivation if it differs from the entry."""
    hidden = found.hidden_architecture and found.hidden_architecture.ascii
    same = (hidden, found.verdict.verdict, found.verdict.rank) == (
        record.get("hidden"),
        record["verdict"],
        record["rank"],
    )
    return "" if same else f"{hidden or 'no hidden robot'}, {found.verdict.verdict}, rank {found.verdict.rank}"
