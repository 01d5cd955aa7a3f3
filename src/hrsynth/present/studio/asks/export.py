"""Export of a page, a report, a figure or a robot file."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ....description import formats
from ....description.meshes import carry_meshes
from ....errors import BadRequest
from ...outputs import OUTPUTS
from ...show import draw
from ...view.view import view
from ..commands import format_commands
from ..request import Request

NATIVE = "native"


def answer(request: Request) -> dict[str, Any]:
    """Return the file of a ``kind``, its bytes in base64."""
    kind = request.text("kind", KINDS)
    if kind is None:
        raise BadRequest("kind", None, tuple(KINDS))
    ending, type_, made = KINDS[kind]
    name, content, same = made(request)
    name = re.sub(r"[^\w.-]", "_", name)
    return {"name": f"{name}{ending}", "type": type_, "base64": base64.b64encode(content).decode(), **same}


def _export_page(request: Request) -> tuple[str, bytes, dict[str, str]]:
    found = view(request.seeing(), hidden=True)
    (each,) = OUTPUTS["view"].files
    name = found.setup.robot.name
    same = format_commands(request, "view", "--static", f"{name}.html", hidden=True)
    return name, _join_bytes(each.content(found, ".html", {})[0]), same


def _report(request: Request) -> tuple[str, bytes, dict[str, str]]:
    name = f"{request.derivation.robot.name}_report"  # the page has the bare name
    report = next(each for each in OUTPUTS["derive"].files if each.option == "report")
    content = report.content(request.derivation, ".html", {"seed": 0})[0]
    return name, _join_bytes(content), format_commands(request, "derive", "--report", f"{name}.html")


def _export_figure(request: Request) -> tuple[str, bytes, dict[str, str]]:
    same = format_commands(request, "derive")
    return (
        request.derivation.robot.name,
        draw(request.derivation).content,
        {**same, "python": f"hrsynth.draw({same['python']})"},
    )


def _export_robot(request: Request) -> tuple[str, bytes, dict[str, str]]:
    mechanism = request.mechanism
    dialect = next(each for each in formats.list_writable_formats() if each.name == NATIVE)
    name = re.sub(r"[^\w.-]", "_", mechanism.name)
    target = Path(mechanism.file or name).with_name(f"{name}.urdf")
    robot, _, _ = carry_meshes(mechanism, target, dialect.meshes, copy=False)
    (text,) = formats.get_writer(NATIVE)(robot).texts
    same = format_commands(request, "import", "--yes", "-o", target.name, watching=False)
    loaded = format_commands(request, "load", watching=False)["python"]
    return name, dialect.packed(text, target), {**same, "python": f"hrsynth.save({loaded}, {target.name!r})"}


def _join_bytes(content: Any) -> bytes:
    return content if isinstance(content, bytes) else b"".join(content)


KINDS: dict[str, tuple[str, str, Callable[[Request], tuple[str, bytes, dict[str, str]]]]] = {
    "page": (".html", "text/html", _export_page),
    "report": (".html", "text/html", _report),
    "figure": (".svg", "image/svg+xml", _export_figure),
    "robot": (".urdf", "application/xml", _export_robot),
}
"""Suffix, media type and maker of each kind."""
