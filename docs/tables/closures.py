"""The tables of loop closures, on the page docs/pages/closures.md: which program reads which, and what is written."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hrsynth import lint, load, save
from hrsynth.description.formats import list_writable_formats
from hrsynth.description.formats.extensions import DRAKE
from hrsynth.description.formats.urdf.conventions import CONVENTIONS
from hrsynth.linting.rules.readers import ASKED, CONSTRUCTS, PROGRAMS, READ, REFUSED, SILENT, TOLD

from .markdown import table as markdown

START, WRITTEN_START = "<!-- generated: closures -->", "<!-- generated: written closures -->"
CELLS = {READ: "**reads**", SILENT: "omits", TOLD: "omits, message", ASKED: "one function", REFUSED: "refuses"}
TOOLS = {each.tag or "closing frames": each.tool for each in CONVENTIONS} | dict.fromkeys(DRAKE, "Drake")
JOINT = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"/>{4}</joint>'
AXIS = '<axis xyz="0 1 0"/>'
ROBOT = f"""<robot name="four_bar"><link name="base"/><link name="crank"/><link name="bar"/><link name="rocker"/>
{JOINT.format("a", "base", "crank", "0 0 0", AXIS)} {JOINT.format("b", "crank", "bar", "0 0 1", AXIS)}
{JOINT.format("c", "base", "rocker", "2 0 0", AXIS)}
<loop name="d" type="revolute"><predecessor link="rocker"><origin xyz="0 0 1"/></predecessor>
<successor link="bar"><origin xyz="2 0 0"/></successor>{AXIS}</loop><hrsynth><platform link="bar"/></hrsynth></robot>"""
"""A four-bar, to be written in every format."""


def table() -> str:
    """Return the Markdown table of all constructs that close loops, and what each program does with them."""
    rows = [
        (f"`{name}`", TOOLS.get(name.partition("/")[0], ""), *(CELLS.get(known.get(each, ""), "") for each in PROGRAMS))
        for name, known in CONSTRUCTS.items()
    ]
    return markdown(("construct", "written by", *(f"`{each}`" for each in PROGRAMS)), rows)


def written_table() -> str:
    """Return the Markdown table of the formats that are written, and the programs that read their loops."""
    rows = []
    for form in (each for each in list_writable_formats() if each.name != "usd"):  # no program of the table reads USD
        constructs = written_constructs(form.endings[0])
        readers = [each for each in PROGRAMS if all(CONSTRUCTS[name].get(each) == READ for name in constructs)]
        endings, names = (", ".join(f"`{each}`" for each in part) for part in (form.endings, constructs))
        rows.append((form.name, endings, names, ", ".join(f"`{each}`" for each in readers) or "none"))
    return markdown(("format", "extensions", "a loop is written as", "programs that read it"), rows)


def written_constructs(ending: str) -> list[str]:
    """Return the constructs by which a written robot closes its loops, as ``lint`` names them."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"robot{ending}"
        save(load(ROBOT), file)
        messages = [each.message for each in lint(file).findings]
    return [name for name in CONSTRUCTS if any(f" ({name}): " in each for each in messages)]
