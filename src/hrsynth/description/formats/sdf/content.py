"""Masses and shapes of SDFormat's links."""

from __future__ import annotations

import re

import numpy as np
from lxml import etree

from ....geometry.so3 import convert_to_quaternions
from ....geometry.vectors import Array, freeze_array
from ... import numerals, xml
from ...contents import INERTIA, SHAPES, SIZES, Content, Inertial, Solid, write_fragments
from ...elements import XmlReader
from .joint import read_pose, read_text

_NUMBERED = re.compile(r"(visual|collision)_\d+")


def read_content(reader: XmlReader, link: xml.Element) -> tuple[str, ...]:
    """Return the masses and shapes of a link; invalid ones are left out."""
    inertial, solids, before = None, [], len(reader.defects)
    for element in xml.list_children(link):
        try:
            if element.tag == "inertial" and inertial is None:
                inertial = _read_inertial(reader, element)
            elif element.tag in SHAPES:
                solids.append(_read_solid(reader, element))
        except ValueError:
            continue
    del reader.defects[before:]
    return write_fragments(Content(inertial, tuple(solids)))


def _place(reader: XmlReader, element: xml.Element) -> Array:
    place = element.find("pose")
    if place is not None and (place.get("relative_to") or place.get("frame")):
        raise ValueError("a pose in the link's frame")
    before = len(reader.defects)
    X = read_pose(reader, place)
    if len(reader.defects) > before:
        raise ValueError("six numbers")
    return freeze_array(X)


def _read_values(
    element: xml.Element | None, tag: str, default: tuple[float, ...] | None, count: int = 1
) -> tuple[float, ...]:
    given = read_text(element, tag)
    if given is None and default is not None:
        return default
    return tuple(float(v) for v in numerals.parse(given or "", count))


def _read_inertial(reader: XmlReader, element: xml.Element) -> Inertial:
    (mass,), tensor = _read_values(element, "mass", (1.0,)), element.find("inertia")
    if tensor is None:
        return Inertial(mass, _place(reader, element))
    defaults = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    a, b, c, d, e, f = (_read_values(tensor, key, (value,))[0] for key, value in zip(INERTIA, defaults, strict=True))
    return Inertial(mass, _place(reader, element), freeze_array([[a, d, e], [d, b, f], [e, f, c]]))


def _read_solid(reader: XmlReader, element: xml.Element) -> Solid:
    shapes = [child for each in element.findall("geometry") for child in xml.list_children(each) if child.tag in SIZES]
    if len(shapes) != 1:
        raise ValueError("one shape")
    (shape,), name = shapes, element.get("name")
    kind, role, X = str(shape.tag), str(element.tag), _place(reader, element)
    name = None if name is None or _NUMBERED.fullmatch(name) else name
    diffuse = element.find("material/diffuse")
    colour = (
        None
        if diffuse is None
        else tuple(map(float, numerals.parse(diffuse.text or "", len((diffuse.text or "").split()))))
    )
    colour = (*colour, 1.0) if colour is not None and len(colour) == 3 else colour
    if colour is not None and len(colour) != 4:
        raise ValueError("three or four numbers")
    if kind == "mesh":
        file = read_text(shape, "uri")
        if file is None:
            raise ValueError("a file")
        return Solid(kind, (), X, role, name, colour, file, _read_values(shape, "scale", (1.0, 1.0, 1.0), 3))
    sizes = (
        _read_values(shape, "size", None, 3)
        if kind == "box"
        else tuple(_read_values(shape, key, None)[0] for key in SIZES[kind])
    )
    if not all(size > 0 for size in sizes):
        raise ValueError("sizes above 0")
    return Solid(kind, sizes, X, role, name, colour)


def write_pose(parent: xml.Element, X: Array) -> None:
    """Append a ``<pose>`` unless it is the identity."""
    position = numerals.format_exact_vector(X[:3, 3])
    if not np.array_equal(X[:3, :3], np.eye(3)):
        turn = numerals.format_exact_vector(convert_to_quaternions(X[:3, :3])[[1, 2, 3, 0]])
        etree.SubElement(parent, "pose", rotation_format="quat_xyzw").text = f"{position} {turn}"
    elif np.any(X[:3, 3]):
        etree.SubElement(parent, "pose").text = f"{position} 0 0 0"


def write_content(element: xml.Element, content: Content) -> None:
    """Write the mass and the shapes of a link."""
    inertial = content.inertial
    if inertial is not None:
        part = etree.SubElement(element, "inertial")
        write_pose(part, inertial.X)
        etree.SubElement(part, "mass").text = numerals.format_exact(inertial.mass)
        if inertial.inertia is not None:
            tensor, (a, b, c) = etree.SubElement(part, "inertia"), inertial.inertia
            for key, value in zip(INERTIA, (a[0], b[1], c[2], a[1], a[2], b[2]), strict=True):
                etree.SubElement(tensor, key).text = numerals.format_exact(value)
    names: set[str] = set()
    for number, solid in enumerate(content.solids, 1):
        name = solid.name if solid.name and solid.name not in names else f"{solid.role}_{number}"
        names.add(name)
        part = etree.SubElement(element, solid.role, name=name)
        write_pose(part, solid.X)
        shape = etree.SubElement(etree.SubElement(part, "geometry"), solid.kind)
        if solid.file is not None:
            etree.SubElement(shape, "uri").text = solid.file
            if solid.scale != (1.0, 1.0, 1.0):
                etree.SubElement(shape, "scale").text = numerals.format_exact_vector(solid.scale)
        elif solid.kind == "box":
            etree.SubElement(shape, "size").text = numerals.format_exact_vector(solid.sizes)
        else:
            for key, value in zip(SIZES[solid.kind], solid.sizes, strict=True):
                etree.SubElement(shape, key).text = numerals.format_exact(value)
        if solid.colour is not None and solid.role == "visual":
            etree.SubElement(etree.SubElement(part, "material"), "diffuse").text = numerals.format_exact_vector(
                solid.colour
            )
