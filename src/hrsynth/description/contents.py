"""Masses, inertias and shapes of links, carried from one format to another.

A mechanism keeps them as the child elements of URDF's ``<link>``; other formats are read into these elements and
written from what :func:`collect_content` returns. Metres, kilograms, radians; all poses are in the link's frame.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..geometry.vectors import Array, freeze_array, normalise_vector
from ..mechanism.model import Link, Mechanism, Note
from . import numerals, xml
from .jointgraph import ORIGIN, join_names

SIZES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": (),
}
"""Attributes of each kind of shape. Cylinders and capsules lie along z; a capsule's length excludes its caps."""
SHAPES = ("visual", "collision")
INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass, pose of its centre (4, 4), and inertia (3, 3) in that frame; None if absent."""

    mass: float
    X: Array = field(default_factory=lambda: ORIGIN)
    inertia: Array | None = None


@dataclass(frozen=True, eq=False)
class Solid:
    """Shape: its kind with its sizes, or the file of a mesh with its scale; ``role`` is visual or collision."""

    kind: str
    sizes: tuple[float, ...] = ()
    X: Array = field(default_factory=lambda: ORIGIN)
    role: str = "visual"
    name: str | None = None
    colour: tuple[float, ...] | None = None
    file: str | None = None
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Content:
    """Content of a link; ``rest`` has the elements that are not read."""

    inertial: Inertial | None = None
    solids: tuple[Solid, ...] = ()
    rest: tuple[str, ...] = ()


def scale_shapes(link: Link, factor: float) -> Link:
    """Return the link with the lengths of its shapes and of its centre of mass scaled; attributes that are not numbers
    stay."""
    found = []
    for text in link.xml:
        if not text.startswith(tuple(f"<{tag}" for tag in (*SHAPES, "inertial"))):
            found.append(text)
            continue
        element = xml.parse_fragment(text)
        for each in element.iter("origin", "mesh", *SIZES):
            for key in ("xyz", "size", "radius", "length", *(("scale",) if each.tag == "mesh" else ())):
                words = each.get(key, "1 1 1" if key == "scale" else "").split()
                try:
                    values = factor * numerals.parse(" ".join(words), len(words))
                except ValueError:
                    continue
                if words:
                    each.set(key, numerals.format_exact_vector(values))
        found.append(xml.format_canonical(element))
    return replace(link, xml=tuple(found))


def collect_content(link: Link, robot: Mechanism) -> Content:
    """Return the content of a link; a colour may be named by a ``<material>`` of the robot."""
    if not link.xml:
        return Content()
    colours = {
        name: colour
        for fragment in robot.xml
        if fragment.startswith("<material")
        for name, colour in [_parse_material(xml.parse_fragment(fragment), {})]
        if name and colour
    }
    inertial, solids, rest = None, [], []
    for fragment in link.xml:
        element = None if fragment.startswith("@") else xml.parse_fragment(fragment)
        try:
            if element is None:
                rest.append(fragment)
            elif element.tag == "inertial" and inertial is None:
                inertial = _parse_inertial(element)
            elif element.tag in SHAPES:
                solids.append(_parse_solid(element, colours))
            else:
                rest.append(fragment)
        except ValueError:
            rest.append(fragment)
    return Content(inertial, tuple(solids), tuple(rest))


def _parse_numbers(element: xml.Element | None, name: str, default: tuple[float, ...]) -> Array:
    text = None if element is None else element.get(name)
    return np.array(default, dtype=float) if text is None else numerals.parse(text, len(default))


def _parse_pose(element: xml.Element) -> Array:
    origin = element.find("origin")
    return freeze_array(
        numerals.compute_origin_pose(_parse_numbers(origin, "xyz", (0, 0, 0)), _parse_numbers(origin, "rpy", (0, 0, 0)))
    )


def _parse_inertial(element: xml.Element) -> Inertial:
    (mass,) = _parse_numbers(element.find("mass"), "value", (0,))
    tensor = element.find("inertia")
    if tensor is None:
        return Inertial(float(mass), _parse_pose(element))
    xx, yy, zz, xy, xz, yz = (float(_parse_numbers(tensor, key, (0,))[0]) for key in INERTIA)
    return Inertial(float(mass), _parse_pose(element), freeze_array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _parse_material(
    element: xml.Element | None, known: Mapping[str, tuple[float, ...]]
) -> tuple[str, tuple[float, ...] | None]:
    if element is None:
        return "", None
    name, colour = element.get("name", ""), element.find("color")
    if colour is None:
        return name, known.get(name)
    return name, tuple(float(v) for v in _parse_numbers(colour, "rgba", (1, 1, 1, 1)))


def _parse_solid(element: xml.Element, colours: Mapping[str, tuple[float, ...]]) -> Solid:
    shapes = [child for each in element.findall("geometry") for child in xml.list_children(each) if child.tag in SIZES]
    if len(shapes) != 1:
        raise ValueError("one shape")
    (shape,) = shapes
    kind, place, role = str(shape.tag), _parse_pose(element), str(element.tag)
    colour = _parse_material(element.find("material"), colours)[1]
    if kind == "mesh":
        scale = tuple(float(v) for v in _parse_numbers(shape, "scale", (1, 1, 1)))
        if not shape.get("filename"):
            raise ValueError("the file of a mesh")
        return Solid(kind, (), place, role, element.get("name"), colour, shape.get("filename"), scale)
    count = 3 if kind == "box" else 1
    sizes = tuple(float(v) for key in SIZES[kind] for v in _parse_numbers(shape, key, (0,) * count))
    if not all(size > 0 for size in sizes):
        raise ValueError("sizes above 0")
    return Solid(kind, sizes, place, role, element.get("name"), colour)


def write_fragments(content: Content) -> tuple[str, ...]:
    """Return the content as child elements of URDF's ``<link>``, each as text."""
    found = []
    if content.inertial is not None:
        mass, tensor = content.inertial.mass, content.inertial.inertia
        element = xml.create_element(
            "inertial",
            *_write_origin(content.inertial.X),
            xml.create_element("mass", value=numerals.format_exact(mass)),
        )
        if tensor is not None:
            entries = zip(INERTIA, (*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]), strict=True)
            element.append(
                xml.create_element("inertia", **{key: numerals.format_exact(value) for key, value in entries})
            )
        found.append(xml.format_canonical(element))
    for solid in content.solids:
        if solid.file is not None:
            shape = xml.create_element("mesh", filename=solid.file)
            if solid.scale != (1.0, 1.0, 1.0):
                shape.set("scale", numerals.format_exact_vector(solid.scale))
        elif solid.kind == "box":
            shape = xml.create_element("box", size=numerals.format_exact_vector(solid.sizes))
        else:
            sizes = zip(SIZES[solid.kind], solid.sizes, strict=True)
            shape = xml.create_element(solid.kind, **{key: numerals.format_exact(value) for key, value in sizes})
        element = xml.create_element(solid.role, *_write_origin(solid.X), xml.create_element("geometry", shape))
        if solid.name:
            element.set("name", solid.name)
        if solid.colour is not None and solid.role == "visual":
            colour = xml.create_element("color", rgba=numerals.format_exact_vector(solid.colour))
            element.append(xml.create_element("material", colour, name=""))
        found.append(xml.format_canonical(element))
    return (*found, *content.rest)


def _write_origin(X: Array) -> list[xml.Element]:
    attributes = {}
    if np.any(X[:3, 3]):
        attributes["xyz"] = numerals.format_exact_vector(X[:3, 3])
    angles = numerals.compute_rounded_rpy(X[:3, :3])
    if any(angles):
        attributes["rpy"] = numerals.format_exact_vector(angles)
    return [xml.create_element("origin", **attributes)] if attributes else []


def find_principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments (3,) of an inertia and the rotation (3, 3) of their frame, with the smallest
    angle."""
    if not np.any(inertia - np.diag(np.diag(inertia))):
        return np.diag(inertia), np.eye(3)
    moments, R = np.linalg.eigh(inertia)
    order = np.argmax(np.abs(R), axis=0)
    if len(set(order.tolist())) == 3:
        back = np.argsort(order)
        moments, R = moments[back], R[:, back] * np.sign(np.diag(R[:, back]))
    if np.linalg.det(R) < 0:
        R[:, 2] = -R[:, 2]
    return moments, R


def rotate_z_to(direction: Array) -> Array:
    """Return a rotation (3, 3) that takes z to a direction."""
    z = normalise_vector(direction)
    x = normalise_vector(np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z))
    return np.column_stack((x, np.cross(z, x), z))


def list_unsupported_content(robot: Mechanism, kinds: Collection[str], *, dialect: str) -> list[Note]:
    """Yield a note of all content that a format cannot hold; ``kinds`` are the shapes that it has (none: no masses
    either)."""
    found = []
    contents = {name: collect_content(link, robot) for name, link in robot.links.items()}
    if not kinds and any(content.inertial is not None for content in contents.values()):
        found.append("masses and inertias")
    other = sorted({_read_tag(each) for content in contents.values() for each in content.rest})
    if other:
        found.append(f"{', '.join(other)} of links")
    joints = sorted({_read_tag(each) for joint in robot.joints.values() for each in joint.xml})
    if joints:
        found.append(f"{', '.join(joints)} of joints")
    whole = sorted({_read_tag(each) for each in robot.xml} - {"<material>"})
    if whole:
        found.append(f"{', '.join(whole)} of the robot")
    for kind in (each for each in SIZES if each not in kinds):
        links = [name for name, content in contents.items() if any(solid.kind == kind for solid in content.solids)]
        if links:
            found.append(f"the {kind} shapes of {join_names(links)}")
    return [Note("warning", f"{dialect} has no place for these, which are lost: {'; '.join(found)}")] if found else []


def _read_tag(fragment: str) -> str:
    return fragment.partition("=")[0] if fragment.startswith("@") else f"<{xml.parse_fragment(fragment).tag}>"
