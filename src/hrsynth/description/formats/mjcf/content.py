"""Masses and shapes of MJCF's bodies, and the files of their meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np

from ....geometry.so3 import convert_to_quaternions
from ....geometry.vectors import Array, build_pose, freeze_array
from ....mechanism.model import Mechanism, Note
from ... import numerals, xml
from ...contents import Content, Inertial, Solid, collect_content, find_principal_axes, rotate_z_to, write_fragments
from ...elements import XmlReader
from ...jointgraph import join_names
from .defaults import Compiler, Defaults

_NO_MESH = None, (1.0, 1.0, 1.0)


@dataclass
class BodyContents:
    """Masses and shapes of a document's bodies; invalid ones are left out."""

    reader: XmlReader
    compiler: Compiler
    defaults: Defaults
    root: xml.Element
    folder: str = ""
    """Folder of the document, from that of the main one."""
    meshes: dict[str, tuple[str, tuple[float, ...]]] = field(default_factory=dict)
    """File and scale of each mesh, by its name."""
    colours: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        root, folder = self.root, ""
        for each in root.findall("compiler"):
            folder = each.get("meshdir", each.get("assetdir", folder))
        for each in root.iterfind("asset/material"):
            self.colours[each.get("name", "")] = self.defaults.of(each, None).get("rgba", "")
        for each in root.iterfind("asset/mesh"):
            given = self.defaults.of(each, None)
            if file := given.get("file"):
                scale = _parse_numbers(given.get("scale"), (1.0, 1.0, 1.0))
                self.meshes[given.get("name") or PurePosixPath(file).stem] = (
                    str(PurePosixPath(self.folder) / folder / file),
                    scale or (1.0, 1.0, 1.0),
                )

    def of(self, body: xml.Element, childclass: str | None) -> tuple[str, ...]:
        """Return the content of a body in URDF elements: a shape that is both visual and collision becomes two."""
        inertial, solids, before = None, list[Solid](), len(self.reader.defects)
        for element in xml.list_children(body):
            if element.tag == "inertial" and inertial is None:
                inertial = self._inertial(element)
            elif element.tag == "geom":
                solids += self._solids(element, self.defaults.of(element, childclass))
        del self.reader.defects[before:]
        return write_fragments(Content(inertial, tuple(solids)))

    def _place(self, element: xml.Element) -> Array | None:
        before = len(self.reader.defects)
        X = self.compiler.pose(element)
        return None if len(self.reader.defects) > before else freeze_array(X)

    def _inertial(self, element: xml.Element) -> Inertial | None:
        mass, X = _parse_numbers(element.get("mass"), (0.0,)), self._place(element)
        six, three = (
            _parse_numbers(element.get("fullinertia"), (0.0,) * 6),
            _parse_numbers(element.get("diaginertia"), (0.0,) * 3),
        )
        if mass is None or X is None or six is None or three is None:
            return None
        a, b, c, d, e, f = six if element.get("fullinertia") else (*three, 0.0, 0.0, 0.0)
        inertia = freeze_array([[a, d, e], [d, b, f], [e, f, c]])
        return Inertial(mass[0], X, inertia if np.any(inertia) else None)

    def _solids(self, element: xml.Element, given: Mapping[str, str]) -> list[Solid]:
        kind, X = given.get("type", "mesh" if "mesh" in given else "sphere"), self._place(element)
        file, scale = self.meshes.get(given.get("mesh", ""), _NO_MESH) if kind == "mesh" else _NO_MESH
        sizes = _parse_sizes(given.get("size", ""))
        ends = _parse_numbers(given.get("fromto"), (0.0,) * 6) if "fromto" in given else None
        if X is not None and ends is not None and kind in ("cylinder", "capsule") and sizes:
            a, b = np.array(ends[:3]), np.array(ends[3:])
            X = freeze_array(build_pose((a + b) / 2, rotate_z_to(b - a))) if np.any(a != b) else None
            sizes = sizes[0], float(np.linalg.norm(b - a)) / 2
        halves = {"sphere": (1,), "box": (2, 2, 2), "cylinder": (1, 2), "capsule": (1, 2)}.get(kind, ())
        whole = tuple(factor * size for factor, size in zip(halves, sizes, strict=False))
        if X is None or not (file or halves) or len(whole) < len(halves) or not all(size > 0 for size in whole):
            return []
        shown = given.get("rgba") or self.colours.get(given.get("material", ""))
        colour = _parse_numbers(shown, (0.0,) * 4) if shown else None
        if given.get("contype") == given.get("conaffinity") == "0":
            roles = ["visual"]
        else:
            group = _parse_numbers(given.get("group"), (0.0,)) or (0.0,)
            roles = ["collision"] if group[0] >= 3 else ["visual", "collision"]
        name = given.get("name")
        return [Solid(kind, whole, X, role, name, colour if role == "visual" else None, file, scale) for role in roles]


def _parse_sizes(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(v) for v in numerals.parse(text, len(text.split())))
    except ValueError:
        return ()


def _parse_numbers(text: str | None, default: tuple[float, ...]) -> tuple[float, ...] | None:
    """Return the numbers of a text, the default if there is none, None if they are invalid."""
    if text is None:
        return default
    try:
        return tuple(float(v) for v in numerals.parse(text, len(default)))
    except ValueError:
        return None


def build_elements(robot: Mechanism) -> tuple[dict[str, list[xml.Element]], list[xml.Element], list[Note]]:
    """Return the elements of each body, the meshes as assets, and notes of content that MuJoCo does not accept."""
    assets: dict[tuple[str, tuple[float, ...]], str] = {}
    found: dict[str, list[xml.Element]] = {}
    names: set[str] = set()
    odd = []
    for link in robot.links.values():
        content, own = collect_content(link, robot), []
        if content.inertial is not None:
            element = _build_inertial(content.inertial)
            if element is None:
                odd.append(link.name)
            else:
                own.append(element)
        for solid in content.solids:
            own.append(_build_geom(solid, assets, names))
        found[link.name] = own
    notes = (
        [Note("warning", "masses and inertias that no body can have are not written: " + join_names(odd))]
        if odd
        else []
    )
    meshes = [
        xml.create_element("mesh", name=name, file=file)
        if scale == (1.0, 1.0, 1.0)
        else xml.create_element("mesh", name=name, file=file, scale=numerals.format_exact_vector(scale))
        for (file, scale), name in assets.items()
    ]
    return found, meshes, notes


def _build_inertial(inertial: Inertial) -> xml.Element | None:
    """Return the inertial element, None unless the mass is positive and each moment is at most the sum of the two
    others."""
    if not inertial.mass > 0:
        return None
    element = xml.create_element(
        "inertial", pos=numerals.format_exact_vector(inertial.X[:3, 3]), mass=numerals.format_exact(inertial.mass)
    )
    if inertial.inertia is None:
        element.set("diaginertia", "0 0 0")
        return element
    moments, _ = find_principal_axes(inertial.inertia)
    least, middle, most = sorted(moments)
    if not (least > 0 and least + middle >= most):
        return None
    if not np.array_equal(inertial.X[:3, :3], np.eye(3)):
        R = inertial.X[:3, :3]
        tensor = R @ inertial.inertia @ R.T
    else:
        tensor = inertial.inertia
    six = (*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2])
    element.set("fullinertia", numerals.format_exact_vector(six))
    return element


def _build_geom(solid: Solid, assets: dict[tuple[str, tuple[float, ...]], str], names: set[str]) -> xml.Element:
    element = xml.create_element("geom", type=solid.kind, mass="0")
    if solid.name and solid.name not in names:
        names.add(solid.name)
        element.set("name", solid.name)
    if solid.file is not None:
        stem, number, key = Path(solid.file).stem, 2, (solid.file, solid.scale)
        name = assets.get(key, stem)
        while key not in assets and name in assets.values():
            name, number = f"{stem}_{number}", number + 1
        element.set("mesh", assets.setdefault(key, name))
    else:
        sizes = solid.sizes
        half = {"box": tuple(size / 2 for size in sizes), "sphere": sizes}.get(solid.kind, (sizes[0], sizes[-1] / 2))
        element.set("size", numerals.format_exact_vector(half))
    if np.any(solid.X[:3, 3]):
        element.set("pos", numerals.format_exact_vector(solid.X[:3, 3]))
    if not np.array_equal(solid.X[:3, :3], np.eye(3)):
        element.set("quat", numerals.format_exact_vector(convert_to_quaternions(solid.X[:3, :3])))
    if solid.role == "visual":
        element.set("contype", "0")
        element.set("conaffinity", "0")
        if solid.colour is not None:
            element.set("rgba", numerals.format_exact_vector(solid.colour))
    element.set("group", "2" if solid.role == "visual" else "3")
    return element
