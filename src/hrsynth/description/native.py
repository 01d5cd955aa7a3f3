"""The native dialect: URDF for the spanning tree, ``<loop>`` and ``<hrsynth>`` elements for the rest."""

from __future__ import annotations

from pathlib import Path

from ..mechanism.model import Mechanism
from . import xml
from .reader import parse
from .writer import write

__all__ = ["parse", "read", "write"]


def read(path: str | Path) -> Mechanism:
    """The mechanism that a robot file describes.

    Raises
    ------
    BadRobotFile
        With every defect of the file and its line.
    LoopsNotClosed
        Where a loop is open at the zero configuration.
    """
    return parse(xml.content(path), str(path))
