"""The native format: URDF for the spanning tree, ``<loop>`` and ``<hrsynth>`` elements for everything else."""

from __future__ import annotations

from ...file_format import FileFormat, RobotFile
from ...keyframes import SRDF
from .read import parse
from .write import write_text as write

__all__ = ["DIALECT", "parse", "write"]


def _is_native_file(file: RobotFile) -> bool:
    return file.tag == "robot" and file.strict and file.has_child("hrsynth")


DIALECT = FileFormat("native", _is_native_file, (".urdf",), rank=1, reread=False, keyframe_ending=SRDF)
