"""The templates, filled in, and the index: what it knows of each architecture, by column, as a script that a page loads
without a server."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...characters import name_steering
from ...present import palette
from ...present.report.pages import load_environment
from ...version import __version__
from ..known import find_alias, order
from .folder import FOLDERS
from .structures import Structure, hash_name

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

TEXTS = ("group", "motion", "verdict", "notation", "hidden", "condition", "suggestion", "refused")
"""Fields with few values: each value once, and which of them a record has."""
LISTS = ("steps", "unobserved")
"""The same of fields that are lists, joined."""
NUMBERS = ("legs", "dof", "rank", "fewest")
EXPLAINED = {
    "hidden robot": "The mechanism that a controller moves when a camera observes only the directions of the legs.",
    "dof": "Independent motions of the platform: 2T1R are two translations and one rotation. Mobility counts the "
    "motions of all links; internal ones do not move the platform.",
    "verdict": "Controllable: the observed directions show all motions of the platform. Partially controllable: some. "
    "Uncontrollable: none.",
    "exact": "Whether the verdict is proved in exact arithmetic for the architecture, or holds at random dimensions.",
    "legs needed": "The smallest sets of legs with the rank of all legs.",
    "hidden robots": "The hidden robot of each of these sets alone, derived in the dimensions of the robot file.",
    "Type 2": "Where the platform gains a motion that the observed directions do not show.",
    "modes": "Number of platform poses with the same observed directions.",
    "suggestion": "Further measurements that show all motions.",
    "unobserved": "Motions of the platform that the observed directions do not show.",
    "confirmed": "Number of closed configurations at which the rank was computed as well.",
    "rules": "Steps from the robot to its hidden robot, with their legs.",
}
"""Explanations of the labels of a page."""
SCRIPTS = ("site.css", "index.js", "page.js")


def write(folder: Path, structures: Iterable[Structure]) -> None:
    """Write the index, its data, the scripts and the style; raises ``OSError``."""
    assets = resources.files("hrsynth.catalog.site").joinpath("assets")
    for name in SCRIPTS:
        own = palette.format_css() if name.endswith(".css") else ""
        (folder / name).write_text(own + assets.joinpath(name).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "report.css").write_text(render("style.css.j2"), encoding="utf-8")
    every = list(structures)
    drawn = [int((folder / FOLDERS[2] / f"{each.name}.svg").exists()) for each in every]
    held = {**build_columns(every), "drawn": drawn}
    (folder / "data.js").write_text(f"const CATALOG = {_format_compact(held)};\n", encoding="utf-8")
    (folder / "index.html").write_text(render("index.html", version=__version__), encoding="utf-8")


def build_columns(structures: Iterable[Structure]) -> dict[str, Any]:
    """All records as columns of equal length; null, or -1 in columns of places, is what a record does not have."""
    structures = list(structures)
    rows = [(place, record) for place, each in enumerate(structures) for record in each.records]
    found: dict[str, Any] = {"pages": [each.name for each in structures], "page": [place for place, _ in rows]}
    records = [record for _, record in rows]
    found["key"] = [record["key"] for record in records]
    found["name"] = [hash_name(record["key"]) for record in records]
    found["order"] = _rank_keys([(*order(record), record["key"]) for record in records])
    found["alias"] = _encode_values([find_alias(record["key"]) for record in records])
    for field in NUMBERS:
        found[field] = [record.get(field) for record in records]
    found["base"] = [None if "base_motors" not in record else int(record["base_motors"]) for record in records]
    for field in TEXTS:
        found[field] = _encode_values([record.get(field) for record in records])
    for field in LISTS:
        found[field] = _encode_values(["; ".join(record.get(field) or ()) or None for record in records])
    return found


def _rank_keys(keys: list[tuple[Any, ...]]) -> list[int]:
    """The place of each key among all."""
    found = [0] * len(keys)
    for rank, i in enumerate(sorted(range(len(keys)), key=keys.__getitem__)):
        found[i] = rank
    return found


def _encode_values(values: list[str | None]) -> dict[str, Any]:
    """Each value once, sorted, and for each record the place of its own."""
    known = sorted({value for value in values if value is not None})
    place: dict[str | None, int] = {value: i for i, value in enumerate(known)}
    return {"values": known, "at": [place.get(value, -1) for value in values]}


def _format_compact(data: object) -> str:
    return name_steering(json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False))


def render(template: str, **values: Any) -> str:
    """The text of a template with these values."""
    return name_steering(_load_environment().get_template(template).render(values))


def format_notation(text: str) -> Markup:
    """An architecture with lines under its motors, as HTML."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"(.)\*", r"<u>\1</u>", str(escape(text.replace("Pi", "Π")))))


@cache
def _load_environment() -> Environment:
    made: Environment = load_environment("hrsynth.catalog.site")
    made.filters.update(notation=format_notation, named=hash_name)
    made.globals.update(explained=EXPLAINED)
    return made
