"""The native format: URDF for the spanning tree, ``<loop>`` and ``<hrsynth>`` elements for everything else."""

from __future__ import annotations

from ...file_format import FileFormat, RobotFile
from .read import parse
from .write import text as write

__all__ = ["DIALECT", "parse", "write"]


def _knows(file: RobotFile) -> bool:
    return file.tag == "robot" and file.strict and file.has("hrsynth")


DIALECT = FileFormat("native", _knows, (".urdf",), rank=1)
