"""Formats of robot files: one folder each, discovered automatically, with ``DIALECT``, ``read`` and ``write``."""

from __future__ import annotations

import pkgutil
from dataclasses import replace
from functools import cache
from importlib import import_module

from ...mechanism.model import Mechanism
from ..file_format import FileFormat, Read, RobotFile, Write
from ..jointgraph import JointGraph
from ..vocabulary import Vocabulary

NATIVE = "native"


@cache
def list_formats() -> dict[str, FileFormat]:
    """Return all formats by name, in the order in which they are tried on a file."""
    folders = [each.name for each in pkgutil.iter_modules(__path__) if each.ispkg]
    found: list[FileFormat] = [import_module(f"{__name__}.{name}").DIALECT for name in folders]
    return {each.name: each for each in sorted(found, key=lambda each: (each.rank, each.name))}


def list_writable_formats() -> list[FileFormat]:
    """Return the formats that are written, the native one first."""
    found = (each for each in list_formats().values() if each.endings)
    return sorted(found, key=lambda each: (each.name != NATIVE, each.name))


def read(file: RobotFile) -> JointGraph | Mechanism:
    """Return the content of a file in any format; an unknown format is refused by the native reader."""
    name = next((name for name, dialect in list_formats().items() if dialect.knows(file)), NATIVE)
    reader: Read = import_module(f"{__name__}.{name}.read").read
    robot = reader(file)
    if isinstance(robot, JointGraph):
        robot.notes[:0] = file.notes
        return robot
    return replace(robot, notes=(*file.notes, *robot.notes)) if file.notes else robot


def get_vocabulary(dialect: str) -> Vocabulary:
    """Return the names of a format that is XML."""
    found: Vocabulary = import_module(f"{__name__}.{dialect}.names").NAMES
    return found


def get_writer(dialect: str) -> Write:
    """Return the writer of a format."""
    write: Write = import_module(f"{__name__}.{dialect}.write").write
    return write
