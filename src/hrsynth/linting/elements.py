"""Links and joints in documents of all XML formats: masses with inertias, limits, names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from lxml import etree

from ..description import numerals, xml
from ..geometry.vectors import Array
from .linted_file import LintedFile

ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Places of MJCF's six numbers in the matrix."""
NAMES = {(0, 0): "ixx", (1, 1): "iyy", (2, 2): "izz", (0, 1): "ixy", (0, 2): "ixz", (1, 2): "iyz"}


def parse_number(text: str | None) -> float | None:
    """Return the number of a text, None if it is not a number."""
    try:
        return None if text is None else float(numerals.parse(text, 1)[0])
    except ValueError:
        return None


@dataclass(frozen=True, eq=False)
class NumberAt:
    """Number in a document: an attribute (one of its words), or the text of an element."""

    element: xml.Element
    attribute: str | None = None
    word: int | None = None

    @property
    def text(self) -> str | None:
        """Text as it is written."""
        whole = self.element.get(self.attribute) if self.attribute else (self.element.text or "").strip() or None
        return whole if whole is None or self.word is None else whole.split()[self.word]

    @property
    def value(self) -> float | None:
        """Number, None if it is not one."""
        return parse_number(self.text)

    def put(self, text: str) -> None:
        """Write another text."""
        if self.word is not None:
            words = ((self.element.get(self.attribute) if self.attribute else self.element.text) or "").split()
            words[self.word] = text
            text = " ".join(words)
        if self.attribute is None:
            self.element.text = text
        else:
            self.element.set(self.attribute, text)


@dataclass(frozen=True, eq=False)
class InertialElement:
    """Mass of a link in a document: the element, the mass, the inertia (3, 3) about the centre of mass (None if absent
    or not numbers), and the function that writes another."""

    link: str
    element: xml.Element
    mass: NumberAt | None
    inertia: Array | None
    write: Callable[[Array], None]


def list_inertials(file: LintedFile) -> Iterator[InertialElement]:
    """Yield all inertial elements of a document, in order."""
    if file.root is None or file.dialect is None:
        return
    tag = {"urdf": "link", "sdf": "link", "mjcf": "body"}[file.dialect]
    for link in file.root.iter(tag):
        element = link.find("inertial")
        if element is not None:
            yield _READ[file.dialect](link.get("name") or "", element)


def _read_urdf(link: str, element: xml.Element) -> InertialElement:
    mass, inertia = element.find("mass"), element.find("inertia")

    def write(matrix: Array) -> None:
        for found in element.findall("inertia"):
            for at in ENTRIES:
                found.set(NAMES[at], numerals.format_exact(matrix[at]))

    given = None if inertia is None else _parse_matrix([inertia.get(NAMES[at]) for at in ENTRIES])
    return InertialElement(link, element, None if mass is None else NumberAt(mass, "value"), given, write)


def _read_sdf(link: str, element: xml.Element) -> InertialElement:
    mass, inertia = element.find("mass"), element.find("inertia")

    def write(matrix: Array) -> None:
        for found in element.findall("inertia"):
            for at in ENTRIES:
                entry = found.find(NAMES[at])
                entry = etree.SubElement(found, NAMES[at]) if entry is None else entry
                entry.text = numerals.format_exact(matrix[at])

    given = None if inertia is None else _parse_matrix([inertia.findtext(NAMES[at]) for at in ENTRIES])
    return InertialElement(link, element, None if mass is None else NumberAt(mass), given, write)


def _read_mjcf(link: str, element: xml.Element) -> InertialElement:
    mass = NumberAt(element, "mass") if element.get("mass") is not None else None
    words = (element.get("diaginertia") or element.get("fullinertia") or "").split()
    given = _parse_matrix([*words, *["0"] * (6 - len(words))]) if len(words) in (3, 6) else None

    def write(matrix: Array) -> None:
        for name in {"diaginertia", "fullinertia"} & set(element.attrib):
            del element.attrib[name]
        diagonal = not any(matrix[at] for at in ENTRIES[3:])
        entries = ENTRIES[:3] if diagonal else ENTRIES
        element.set(
            "diaginertia" if diagonal else "fullinertia", numerals.format_exact_vector([matrix[at] for at in entries])
        )

    return InertialElement(link, element, mass, given, write)


_READ = {"urdf": _read_urdf, "sdf": _read_sdf, "mjcf": _read_mjcf}


def _parse_matrix(words: list[str | None]) -> Array | None:
    values = [0.0 if word is None or not word.strip() else parse_number(word) for word in words]
    if any(value is None for value in values):
        return None
    matrix = np.zeros((3, 3))
    for at, value in zip(ENTRIES, values, strict=True):
        matrix[at] = matrix[at[::-1]] = value
    return matrix


@dataclass(frozen=True, eq=False)
class LimitElement:
    """Limits of a joint in a document: its name and type, the element of the joint and of the limits, the two bounds
    (None if absent)."""

    joint: str
    kind: str
    owner: xml.Element
    element: xml.Element
    lower: NumberAt | None
    upper: NumberAt | None

    @property
    def is_angle(self) -> bool:
        """Coordinate is an angle."""
        return self.kind in ("revolute", "hinge", "continuous")

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Both bounds."""
        found = [None if each is None else each.value for each in (self.lower, self.upper)]
        return None if found[0] is None or found[1] is None else (found[0], found[1])


def list_limits(file: LintedFile) -> Iterator[LimitElement]:
    """Yield all limits of joints in a document, in order; MJCF's in its own unit."""
    for joint in list_joint_elements(file):
        name, kind = joint.get("name") or "", joint.get("type", "hinge" if file.dialect == "mjcf" else "")
        if file.dialect == "mjcf":
            if len((joint.get("range") or "").split()) == 2 and joint.get("limited") != "false":
                yield LimitElement(name, kind, joint, joint, *(NumberAt(joint, "range", word) for word in (0, 1)))
            continue
        limit = joint.find("axis/limit" if file.dialect == "sdf" else "limit")
        if limit is None or kind == "continuous":
            continue
        if file.dialect == "sdf":
            ends = [None if (each := limit.find(tag)) is None else NumberAt(each) for tag in ("lower", "upper")]
        else:
            free = (limit.get("free") or "").split()
            ends = [
                NumberAt(limit, key) if limit.get(key) is not None and key not in free else None
                for key in ("lower", "upper")
            ]
        yield LimitElement(name, kind, joint, limit, ends[0], ends[1])


def list_joint_elements(file: LintedFile) -> list[xml.Element]:
    """Return the elements of joints: of the tree, loops, and those of plugins."""
    if file.root is None:
        return []
    if file.dialect == "urdf":
        return [each for each in file.root if each.tag in ("joint", "loop")]
    if file.dialect == "sdf":
        return list(file.root.iter("joint"))
    return [each for world in file.root.findall("worldbody") for each in world.iter("joint", "freejoint")]
