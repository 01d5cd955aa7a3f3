"""Stages of USD, opened in a separate process: a file that breaks OpenUSD's library breaks nothing else."""

from __future__ import annotations

import importlib.util
import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ....errors import BadRequest, MissingExtra
from ....processes import require_posix
from ....tolerances import INCLUDED_FILES_MAX, ROBOT_FILE_MAX_BYTES, USD_SECONDS
from ....untrusted import run_program
from ... import xml

PROCESS = Path(__file__).with_name("stage_process.py")


def read_prims(path: Path) -> dict[str, Any]:
    """Return the content of a stage as plain values: ``stage`` and ``prims``. Raises ``BadRobotFile``, and
    ``MissingExtra`` if OpenUSD's package is not installed."""
    found: dict[str, Any] = json.loads(_run(path, "prims", str(path)))
    return found


def read_usd_meshes(asked: Mapping[Path, Sequence[str]]) -> list[list[str]]:
    """Return meshes of stages, by their prims, each as the text of an ``.obj`` file in its own frame and units: all in
    one process."""
    paths = [*asked]
    given = json.dumps({str(path): [*prims] for path, prims in asked.items()})
    found: list[list[str]] = json.loads(_run(paths[0], "meshes", str(paths[0]), given=given)) if paths else []
    return found


def convert_to_binary(text: str, path: Path) -> bytes:
    """Return the binary form, for ``path``, of a stage given as text. Raises ``BadRequest`` if there is no room for
    temporary files."""
    _require_package(path)
    try:
        with tempfile.TemporaryDirectory() as folder:
            one, two = Path(folder, "robot.usda"), Path(folder, "robot.usdc")
            one.write_text(text, encoding="utf-8")
            _run(one, "binary", str(one), str(two))
            return two.read_bytes()
    except OSError as error:
        raise BadRequest(f"cannot write a temporary file: {error.strerror}", tempfile.gettempdir()) from None


def _require_package(path: Path) -> None:
    if importlib.util.find_spec("pxr") is None:
        raise MissingExtra(f"{path}: USD", "usd")
    require_posix(f"{path}: USD, which is read under limits of time and memory,", "resource")


def _run(path: Path, *arguments: str, given: str = "") -> bytes:
    _require_package(path)
    try:
        return run_program(
            PROCESS, str(ROBOT_FILE_MAX_BYTES), str(INCLUDED_FILES_MAX), *arguments, seconds=USD_SECONDS, given=given
        )
    except BadRequest as error:
        raise xml.make_file_error(path, str(error)) from None
