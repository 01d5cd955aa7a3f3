"""Gepetto's extended URDF: ``robot.urdf`` for the tree, ``robot.yaml`` for closures, motors and joint types."""

from __future__ import annotations

from pathlib import Path

from ...file_format import FileFormat, RobotFile
from .settings import ENDINGS, KEYS, find_partner, find_settings


def _list_files(path: Path) -> tuple[Path, ...]:
    return path.with_suffix(".urdf"), path if path.suffix.lower() in ENDINGS else path.with_suffix(".yaml")


def _is_gepetto_file(file: RobotFile) -> bool:
    return file.has_key(*KEYS) or find_settings(file) is not None


DIALECT = FileFormat("gepetto", _is_gepetto_file, ENDINGS, _list_files, rank=-1, partner=find_partner, reread=False)
