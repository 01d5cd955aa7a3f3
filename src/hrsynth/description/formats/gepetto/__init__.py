"""Gepetto's extended URDF: ``robot.urdf`` for the tree, ``robot.yaml`` for closures, motors and joint types."""

from __future__ import annotations

from pathlib import Path

from ...file_format import FileFormat, RobotFile
from .settings import ENDINGS, partner, settings_beside


def _files(path: Path) -> tuple[Path, ...]:
    return path.with_suffix(".urdf"), path if path.suffix.lower() in ENDINGS else path.with_suffix(".yaml")


def _knows(file: RobotFile) -> bool:
    return file.root is None or settings_beside(file) is not None


DIALECT = FileFormat("gepetto", _knows, ENDINGS, _files, rank=-1, partner=partner)
