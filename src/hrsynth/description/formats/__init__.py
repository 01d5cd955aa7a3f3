"""Formats of robot files: a module or folder for each one, with ``DIALECT``, ``read`` and ``write``."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from typing import Any

from ...errors import BadRequest, BadRobotFile, Defect
from .. import xml
from ..file_format import FileFormat, Read, RobotFile, Write, WriteKeyframes
from ..jointgraph import JointGraph
from ..vocabulary import Vocabulary

NATIVE = "native"


@cache
def list_formats() -> dict[str, FileFormat]:
    """Return all formats by name, in the order in which they are tried on a file."""
    modules = [import_module(f"{__name__}.{each.name}") for each in pkgutil.iter_modules(__path__)]
    found: list[FileFormat] = [module.DIALECT for module in modules if hasattr(module, "DIALECT")]
    return {each.name: each for each in sorted(found, key=lambda each: (each.rank, each.name))}


def _find_part(dialect: str, name: str, part: str) -> Any:
    """Return an object of a format: of its module, or of the module ``part`` in its folder."""
    module = import_module(f"{__name__}.{dialect}")
    return getattr(import_module(f"{module.__name__}.{part}") if hasattr(module, "__path__") else module, name)


def list_writable_formats() -> list[FileFormat]:
    """Return the formats that are written, the native one first."""
    found = (each for each in list_formats().values() if each.endings)
    return sorted(found, key=lambda each: (each.name != NATIVE, each.name))


def recognise(file: RobotFile) -> str | None:
    """Return the name of the first format that recognises a file; None if none does."""
    return next((name for name, dialect in list_formats().items() if dialect.knows(file)), None)


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of a file in any format; an unknown format is refused by the native reader."""
    name = recognise(file)
    if name is None and file.root is None:
        raise xml.make_file_error(file.path, "no known format", f"XML, or a file of {', '.join(list_formats())}")
    name = name or NATIVE
    if file.model is not None and name != "sdf":
        raise BadRequest(f"--model: only SDFormat files hold several models: {file.path}", file.model)
    reader: Read = _find_part(name, "read", "read")
    graph = reader(file)
    if loops := [joint for joint in graph.joints.values() if joint.links[0] == joint.links[1]]:
        problem = "joint {} connects a link to itself"
        raise BadRobotFile(
            Defect(graph.file, each.line, problem.format(repr(each.name)), each.links[0], "two links") for each in loops
        )
    graph.notes[:0], graph.arguments = file.notes, file.arguments
    return graph


def get_vocabulary(dialect: str) -> Vocabulary:
    """Return the names of a format that is XML."""
    found: Vocabulary = _find_part(dialect, "NAMES", "names")
    return found


def get_keyframe_writer(dialect: str) -> WriteKeyframes:
    """Return the writer of a format's keyframes. Raises ``BadRequest`` if it has none."""
    try:
        write: WriteKeyframes = _find_part(dialect, "write_keyframes", "write")
    except AttributeError:
        raise BadRequest("keyframes in this format", dialect, "mjcf, or native with an SRDF file") from None
    return write


def get_writer(dialect: str) -> Write:
    """Return the writer of a format."""
    write: Write = _find_part(dialect, "write", "write")
    return write
