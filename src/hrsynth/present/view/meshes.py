"""Visual shapes of a robot's own file, in place of rods: meshes and solids of any format, nothing fetched."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.observed import ObservedRobot
from ...description.contents import Solid, collect_content
from ...description.meshes import read_robot_meshes
from ...geometry.vectors import Array
from .shapes import BASE, LEG, PLATFORM, Shape

VIEW_TRIANGLES_MAX = 200_000
"""Triangles of all meshes together beyond which they are left out: the page holds them as text."""


def collect_meshes(setup: ObservedRobot, within: Path | None = None) -> tuple[tuple[Shape, ...], tuple[str, ...]]:
    """The shapes of the file's visuals, on the links of the normal form, and notes where meshes are missing; with
    ``within`` no files are read that do not lie in that folder."""
    robot, mechanism = setup.robot, setup.mechanism
    found, missing, between, count = [], [], [], 0
    shown = [
        solid
        for name, link in robot.links.items()
        if setup.normal.into.get(name) in mechanism.links
        for solid in collect_content(link, robot).solids
        if solid.role == "visual"
    ]
    files = read_robot_meshes([solid.file for solid in shown if solid.file is not None], robot.file, within)
    for name, link in robot.links.items():
        into = setup.normal.into.get(name)
        if into is None or into not in mechanism.links:
            if any(solid.role == "visual" for solid in collect_content(link, robot).solids):
                between.append(name)
            continue
        role = BASE if into == mechanism.base else PLATFORM if into in setup.decomposition.platform else LEG
        for solid in collect_content(link, robot).solids:
            if solid.role != "visual":
                continue
            surface = _load_surface(solid, files)
            if surface is None:
                missing.append(f"{name}: {solid.file}")
                continue
            points, faces = surface
            home = link.pose @ solid.X
            found.append(Shape("mesh", into, points @ home[:3, :3].T + home[:3, 3], 0.0, role, faces=faces))
            count += len(faces)
            if count > VIEW_TRIANGLES_MAX:
                return (), (f"the meshes have more than {VIEW_TRIANGLES_MAX} triangles: rods are drawn instead",)
    notes = [f"{len(missing)} visual shapes cannot be read ({missing[0]}): rods are drawn instead"] if missing else []
    if between:
        notes.append(f"links inside merged joints are not drawn: {', '.join(between)}")
    return tuple(found), tuple(notes)


def _load_surface(solid: Solid, files: Mapping[str, tuple[Array, Any] | None]) -> tuple[Array, Any] | None:
    """The points (n, 3) and triangles (m, 3) of a visual in its own frame (m), None of a mesh that cannot be read."""
    if solid.file is not None:
        read = files[solid.file]
        return None if read is None else (read[0] * np.array(solid.scale), read[1])
    from trimesh import creation

    if solid.kind == "box":
        made = creation.box(extents=solid.sizes)
    elif solid.kind == "sphere":
        made = creation.icosphere(subdivisions=2, radius=solid.sizes[0])
    else:
        radius, height = solid.sizes
        made = (
            creation.cylinder(radius=radius, height=height, sections=32)
            if solid.kind == "cylinder"
            else creation.capsule(radius=radius, height=height, count=[16, 16])
        )
    return np.asarray(made.vertices), np.asarray(made.faces)
