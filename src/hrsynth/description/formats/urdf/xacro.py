"""Xacro files: the package of that name, if installed, expands them in a restricted process."""

from __future__ import annotations

import importlib.util
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ....errors import BadRequest, MissingExtra
from ....mechanism.model import Note
from ....tolerances import ROBOT_FILE_MAX_BYTES
from ... import xml
from ...jointgraph import join_names
from ...xml import XML_ELEMENTS_MAX

XACRO_TIMEOUT_S = 4
"""Seconds after which expanding a xacro file is given up."""


def is_needed(root: xml.Element) -> bool:
    """Return True if a URDF document uses elements of xacro, or declares its prefix and has expressions."""
    if root.tag != "robot":
        return False
    if any("xacro}" in element.tag for element in root.iter("*") if isinstance(element.tag, str)):
        return True
    declared = any(str(uri).endswith("xacro") for uri in root.nsmap.values())
    return declared and any(
        start in str(value) for element in root.iter("*") for value in element.attrib.values() for start in ("${", "$(")
    )


def expand(
    path: Path, given: Sequence[str] = (), notes: list[Note] | None = None
) -> tuple[xml.Element, dict[str, str]]:
    """Return the expanded document of a xacro file with the ``given`` arguments ``name:=value``, and the arguments that
    it declares with their values; add ``notes`` on assumed packages. Raises ``BadRobotFile``, ``MissingExtra``, and
    ``BadRequest`` for an argument that the file does not declare."""
    import subprocess

    if importlib.util.find_spec("xacro") is None:
        raise MissingExtra(f"{path}: a xacro file", "xacro")
    process = Path(__file__).with_name("xacro_process.py")
    command = [
        sys.executable,
        "-P",
        str(process),
        str(path.resolve()),
        str(ROBOT_FILE_MAX_BYTES),
        str(XML_ELEMENTS_MAX),
        *given,
    ]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=XACRO_TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        raise xml.make_file_error(path, "xacro did not finish", f"{XACRO_TIMEOUT_S} seconds") from None
    if run.returncode < 0:
        raise xml.make_file_error(path, "xacro was stopped", f"{XACRO_TIMEOUT_S} seconds and 900 MB of memory")
    if run.returncode:
        file, line, said = _read_last_message(run.stderr)
        raise xml.make_file_error(
            path if file is None else xml.shorten_path(path, file),
            f"xacro refuses it: {said[:300]}",
            None if ", expected " in said else "a file that xacro expands",
            line=line,
        )
    first, _, text = run.stdout.partition("\n")
    root, head = xml.parse_document(text, str(path)), json.loads(first)
    added = [] if notes is None else notes
    for package, folder in head["assumed"].items():
        added.append(
            Note("assumption", f"the package {package!r}, which is not here, is read from the file's own {folder}")
        )
    xml.give_places(root, path, head["places"])
    declared: dict[str, str] = head["arguments"]
    for name in (text.partition(":=")[0] for text in given):
        if name not in declared:
            raise BadRequest(
                f"--arg: {path} declares no such argument", name, join_names(declared, like=name) or "none"
            )
    return root, declared


def _read_last_message(errors: str) -> tuple[str | None, int | None, str]:
    """Return file, line and text of the last message of the process."""
    last = "".join([line for line in errors.splitlines() if line.strip()][-1:])
    try:
        found = json.loads(last)
        return found["file"], found["line"], found["said"]
    except (ValueError, TypeError, KeyError):
        return None, None, last
