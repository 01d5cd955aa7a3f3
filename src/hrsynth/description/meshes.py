"""The files of meshes that a robot names: found, carried along to where it is written, read as triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..budgets import LARGEST_FILE
from ..geometry.vectors import Array


def located(name: str, folder: Path) -> Path | None:
    """The file that a mesh's address names: beside the robot file, or of a package in a folder above it; None where
    there is none on this machine."""
    scheme, _, rest = name.partition("://")
    try:
        if not rest:
            return folder / name if (folder / name).is_file() else None
        if scheme == "file":
            return Path(rest) if Path(rest).is_file() else None
        if scheme in ("package", "model") and (rest := rest.lstrip("/")):
            for parent in (folder, *folder.resolve().parents):
                for path in (parent / rest, parent / Path(*Path(rest).parts[1:])):
                    if path.is_file():
                        return path
    except (OSError, ValueError):
        return None
    return None


def triangles(name: str, robot: str | None) -> tuple[Array, Any] | None:
    """The points (n, 3) and triangles (m, 3) of a mesh that the file of a robot names; None where it cannot be read."""
    path = located(name, Path(robot).parent if robot else Path())
    if path is None or path.stat().st_size > LARGEST_FILE:
        return None
    import trimesh

    try:
        solid: Any = trimesh.load(path, force="mesh", process=False)
        points, faces = np.array(solid.vertices, dtype=float), np.array(solid.faces)
    except Exception:  # readers of many formats, each with errors of its own
        return None
    return (points, faces) if len(faces) and np.all(np.isfinite(points)) else None
