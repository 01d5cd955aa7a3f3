"""Visual shapes of a robot's own file, in place of rods: meshes and solids, read through yourdfpy, nothing fetched."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.observed import ObservedRobot
from ...description.meshes import located
from ...geometry.vectors import Array
from .shapes import BASE, LEG, PLATFORM, Shape

MOST_TRIANGLES = 200_000
"""Triangles of all meshes together beyond which they are left out: the page holds them as text."""


def meshes(setting: ObservedRobot) -> tuple[tuple[Shape, ...], tuple[str, ...]]:
    """The shapes of the file's visuals, on the links of the normal form, and a note where meshes are missing."""
    file = setting.robot.file
    if file is None or Path(file).suffix != ".urdf" or b"<visual" not in Path(file).read_bytes():
        return (), ()
    found, missing = [], []
    for link, X, geometry in _visuals(Path(file)):
        into = setting.normal.into.get(link)
        if into is None or into not in setting.mechanism.links or link not in setting.robot.links:
            continue
        try:
            solid = _solid(geometry, Path(file).parent)
        except (OSError, ValueError, NotImplementedError, ImportError, KeyError, IndexError) as error:
            missing.append(f"{link}: {' '.join(str(error).split())[:120]}")
            continue
        home = setting.robot.links[link].pose @ X
        points = np.asarray(solid.vertices) @ home[:3, :3].T + home[:3, 3]
        mechanism = setting.mechanism
        role = BASE if into == mechanism.base else PLATFORM if into in setting.anatomy.platform else LEG
        found.append(Shape("mesh", into, points, 0.0, role, faces=np.asarray(solid.faces)))
    if sum(len(shape.faces) for shape in found if shape.faces is not None) > MOST_TRIANGLES:
        return (), (f"the meshes have more than {MOST_TRIANGLES} triangles: rods are drawn instead",)
    note = (f"{len(missing)} visual shapes cannot be read ({missing[0]}): rods are drawn instead",) if missing else ()
    return tuple(found), note


def _visuals(file: Path) -> Iterator[tuple[str, Array, Any]]:
    """Link, pose (4, 4) in the link's frame and geometry of each visual."""
    from yourdfpy import URDF

    urdf = URDF.load(str(file), build_scene_graph=False, load_meshes=False)
    for link in urdf.robot.links:
        for visual in link.visuals:
            if visual.geometry is not None:
                yield link.name, np.eye(4) if visual.origin is None else visual.origin, visual.geometry


def _solid(geometry: Any, folder: Path) -> Any:
    """The triangles of a visual's geometry (m)."""
    import trimesh

    if geometry.box is not None:
        return trimesh.creation.box(extents=geometry.box.size)
    if geometry.cylinder is not None:
        return trimesh.creation.cylinder(radius=geometry.cylinder.radius, height=geometry.cylinder.length, sections=32)
    if geometry.sphere is not None:
        return trimesh.creation.icosphere(subdivisions=2, radius=geometry.sphere.radius)
    if geometry.mesh is None:
        raise ValueError("no geometry")
    path = located(geometry.mesh.filename, folder)
    if path is None:
        raise OSError(f"no local file {geometry.mesh.filename}")
    solid: Any = trimesh.load(path, force="mesh")
    if not len(solid.faces):
        raise ValueError(f"no triangles in {path.name}")
    solid.apply_scale(1.0 if geometry.mesh.scale is None else geometry.mesh.scale)
    return solid
