"""Names of elements and attributes of a format: a mistyped one is a defect, another unknown one a note.

A name is mistyped if its element cannot have it and one edit (a character inserted, deleted, replaced or exchanged with
the next; letter case, ``-`` and ``_`` do not count) makes it a name that the element can have and lacks, or can have
repeatedly. Names with a prefix or in a namespace belong to other programs.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from ..errors import Defect
from ..mechanism.model import Note
from . import xml
from .file_format import RobotFile

NAME_SIMILARITY_MIN = 0.65
"""Similarity from which an unknown name in a file counts as a misspelling."""
XML_UNKNOWN_NAMES_MAX = 300
"""Different names that a format does not have from which on a document is refused."""

ANY = "..."
"""Entry of a table: an element may hold names of other programs, which are not reported."""


@dataclass(frozen=True)
class ElementNames:
    """Names that an element can have: attributes, child elements, those of them that may be repeated; ``open``: it may
    hold names of other programs."""

    attributes: frozenset[str]
    children: frozenset[str]
    repeated: frozenset[str]
    open: bool


@dataclass(frozen=True, eq=False)
class UnknownName:
    """Name that a format does not have in its place, the ``known`` ones there, and the ``meant`` ones of which it is a
    misspelling."""

    element: xml.Element
    name: str
    is_attribute: bool
    known: frozenset[str]
    meant: tuple[str, ...]

    @property
    def line(self) -> int | None:
        """Line of the element that has the attribute, or of the element itself."""
        return xml.get_line(self.element)

    @property
    def place(self) -> str:
        """Kind of name and its element."""
        if self.is_attribute:
            return f"attribute of <{self.element.tag}>"
        parent = self.element.getparent()
        return "element" if parent is None else f"element in <{parent.tag}>"

    @property
    def found(self) -> str:
        """Name as it is written."""
        return self._written(self.name)

    @property
    def remedy(self) -> str:
        """Names of which it is a misspelling, or the most similar one, as they are written."""
        alike = difflib.get_close_matches(self.name.casefold(), self.known, n=1, cutoff=NAME_SIMILARITY_MIN)
        return " or ".join(map(self._written, self.meant or alike))

    def _written(self, name: str) -> str:
        return name if self.is_attribute else f"<{name}>"


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """Names of a format. ``text`` has a line ``element: attributes | children`` for each element that is read
    (``parent/element`` if its names depend on the parent; a child with ``*`` may be repeated, ``...`` stands for names
    of other programs; indented lines continue one). ``others`` are names that are not reported."""

    text: str
    others: str = ""
    inside: Mapping[str, Vocabulary] = field(default_factory=dict)
    """Formats of some ``parent/element``, with all that is in them."""

    @cached_property
    def _others(self) -> frozenset[str]:
        return frozenset(self.others.split())

    @cached_property
    def elements(self) -> dict[str, ElementNames]:
        """Table of elements and their names."""
        found = dict[str, ElementNames]()
        for row in filter(str.strip, self.text.replace("\n    ", " ").splitlines()):
            keys, _, names = row.partition(":")
            attributes, children = (set(part.split()) for part in (names + "|").split("|")[:2])
            several = frozenset(each[:-1] for each in children if each.endswith("*"))
            once = frozenset(each for each in children - {ANY} if not each.endswith("*"))
            known = ElementNames(frozenset(attributes), once | several, several, ANY in children)
            found |= dict.fromkeys(keys.split(), known)
        return found

    def is_other(self, name: str) -> bool:
        """Return True for a name that is not reported: one of the ``others``, or with a prefix or a namespace."""
        return "}" in name or ":" in name or name in self._others

    def unknown(self, root: xml.Element) -> Iterator[UnknownName]:
        """Yield the names in a document that the format does not have where they are, in order, until there are too
        many different ones to compare."""
        key, met = str(root.tag), set[tuple[str, str]]()
        for each in self._of(root, self.elements[key]) if key in self.elements else ():
            met.add((each.name, each.place))
            if len(met) > XML_UNKNOWN_NAMES_MAX:
                return
            yield each

    def _of(self, element: xml.Element, known: ElementNames) -> Iterator[UnknownName]:
        given = [str(name) for name in element.attrib]
        for name in given:
            if name not in known.attributes and not self.is_other(name):
                meant = find_misspelt(name, known.attributes.difference(given))
                if meant or not known.open:
                    yield UnknownName(element, name, True, known.attributes, meant)
        children = xml.list_children(element)
        tags = {str(child.tag) for child in children}
        for child in children:
            tag = str(child.tag)
            if tag in known.children:
                key = f"{element.tag}/{tag}"
                inner = self.inside.get(key, self)
                names = inner.elements.get(key) or inner.elements.get(tag)
                if names is not None:
                    yield from inner._of(child, names)
            elif not self.is_other(tag):
                meant = find_misspelt(tag, known.children - (tags - known.repeated))
                if meant or not known.open:
                    yield UnknownName(child, tag, False, known.children, meant)

    def check(self, root: xml.Element, file: RobotFile) -> tuple[list[Defect], list[Note]]:
        """Return the defects of a document's mistyped names, and a note of each other unknown name; if the file is read
        as spelt, mistyped names are no defects."""
        defects, notes = list[Defect](), dict[tuple[str, str], list[UnknownName]]()
        for each in self.unknown(root):
            if not each.meant:
                notes.setdefault((each.name, each.place), []).append(each)
            elif not file.as_spelt:
                where = getattr(each.line, "file", str(file.path))
                defects.append(Defect(where, each.line, f"unknown {each.place}", each.found, each.remedy))
        if len({(each.problem, each.got) for each in defects}) + len(notes) >= XML_UNKNOWN_NAMES_MAX:
            raise xml.make_file_error(
                file.path, "too many names that the format does not have", f"fewer than {XML_UNKNOWN_NAMES_MAX}"
            )
        return defects, [_note_of(found) for found in notes.values()]


def _note_of(found: list[UnknownName]) -> Note:
    """Return the note of one name, for all its occurrences."""
    first = found[0]
    alike = first.remedy and f" (perhaps {first.remedy})"
    where = "" if first.line is None else f" (line {first.line}{', and more' * (len(found) > 1)})"
    return Note("ignored", f"unknown {first.place}: got {first.found}{alike}{where}")


def find_misspelt(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Return the ``known`` names that one edit makes of a name, in order; letter case, ``-`` and ``_`` are ignored."""
    plain = _strip_accents(name)
    return tuple(
        sorted(each for each in known if plain == (other := _strip_accents(each)) or _is_one_edit(plain, other))
    )


def _strip_accents(name: str) -> str:
    return name.casefold().replace("-", "").replace("_", "")


def _is_one_edit(one: str, two: str) -> bool:
    """Return True if a character inserted, deleted, replaced or exchanged with the next makes one text the other."""
    if abs(len(one) - len(two)) > 1:
        return False
    k = next((k for k, (a, b) in enumerate(zip(one, two, strict=False)) if a != b), min(len(one), len(two)))
    a, b = one[k:], two[k:]
    return a[1:] == b[1:] or a[1:] == b or a == b[1:] or (a[2:] == b[2:] and a[:2] == b[1::-1])
