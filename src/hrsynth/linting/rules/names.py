"""Names that other readers confuse, and links without joints."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from functools import partial

from ...description import xml
from ...description.chains import CUT, END, TIP
from ...mechanism import graphs
from ..elements import list_joint_elements
from ..findings import Fix, LintRule, RuleHit
from ..linted_file import LintedFile

RESERVED = re.compile(r"__.*__|world|.*::.*")
"""Names that SDFormat reserves."""
OWN = re.compile(rf"__[123]$|{TIP}$|{CUT}$|{END}$")
"""Suffixes that hrsynth's writers give to a joint and the link that it carries."""


def _find_clashes(file: LintedFile) -> Iterator[RuleHit]:
    if file.root is None or file.dialect == "mjcf":  # each kind has its own namespace
        return
    links = {each.get("name") for each in file.root.iter("link")}
    for joint in list_joint_elements(file):
        name = joint.get("name")
        if name in links and not OWN.search(name or ""):
            yield RuleHit(xml.get_line(joint), f"{joint.tag} {name!r} has the name of a link")


def _find_case_clashes(file: LintedFile) -> Iterator[RuleHit]:
    graph = file.said
    if graph is None:
        return
    for what, table in (("link", graph.links), ("joint", graph.joints)):
        often = Counter(name.casefold() for name in table)
        for name in table:
            if often[name.casefold()] > 1:
                yield RuleHit(
                    table[name].line, f"{what} {name!r}: another {what} has the same name except for capitals"
                )


def _find_reserved(file: LintedFile) -> Iterator[RuleHit]:
    graph = file.said
    for name, link in graph.links.items() if graph is not None else ():
        if RESERVED.fullmatch(name) and link.line is not None and graph is not None and name != graph.base:
            yield RuleHit(link.line, f"link {name!r}")


def _find_motor_names(file: LintedFile) -> Iterator[RuleHit]:
    if file.root is None:
        return
    names = (
        file.root.iterfind("transmission")
        if file.dialect == "urdf"
        else (each for section in file.root.findall("actuator") for each in section)
    )
    seen: set[str] = set()
    for each in names:
        name = each.get("name") if isinstance(each.tag, str) else None
        if name is not None and name in seen:
            yield RuleHit(xml.get_line(each), f"motor {name!r}: name already used")
        seen.add(name or "")


def _find_unused(file: LintedFile) -> Iterator[RuleHit]:
    graph = file.said
    if graph is None or len(graph.links) < 2:
        return
    parts = sorted(
        graphs.list_components(graphs.build_adjacency(graph.links, (each.links for each in graph.joints.values()))),
        key=len,
        reverse=True,
    )
    for part in parts[1:]:
        for name in (each for each in graph.links if each in part):
            alone = len(part) == 1 and name not in (graph.base, graph.platform)
            element = file.element(graph.links[name].line, "link", name=name) if alone else None
            yield RuleHit(
                graph.links[name].line,
                f"link {name!r}: no joint connects it to the others",
                remove_element(file, element),
            )


def remove_element(file: LintedFile, element: xml.Element | None) -> Fix | None:
    """Return the fix that removes an element; None if another element names it."""
    if element is None:
        return None
    name, everywhere = element.get("name"), file.remember("words", lambda: Counter(_list_words(file.root)))
    if name is not None and everywhere[name] > sum(word == name for word in _list_words(element)):
        return None
    return partial(_remove, element)


def _list_words(element: xml.Element | None) -> Iterator[str]:
    """Yield the values of all attributes and the texts of an element and its descendants."""
    for each in () if element is None else element.iter("*"):
        yield from (*each.attrib.values(), (each.text or "").strip())


def _remove(element: xml.Element) -> None:
    """Remove an element from its document, and the white space before it."""
    parent, before = element.getparent(), element.getprevious()
    if parent is None:
        return
    tail = element.tail or ""
    if before is not None:
        before.tail = tail if not (before.tail or "").strip() else (before.tail or "") + tail
    elif not (parent.text or "").strip():
        parent.text = tail if tail.strip() else parent.text
    parent.remove(element)


RULES = (
    LintRule(
        "name-clash",
        "note",
        "a joint with the name of a link",
        "URDF allows it. SDFormat has a single namespace and refuses it, and frames with that name are "
        "ambiguous in ROS and Gepetto.",
        "rename one of them, wherever it is referred to",
        _find_clashes,
    ),
    LintRule(
        "name-case",
        "note",
        "two names that differ in capitals only",
        "People confuse them, and so do file systems where names become file names.",
        "rename one of them",
        _find_case_clashes,
    ),
    LintRule(
        "name-reserved",
        "warning",
        "a name that SDFormat reserves",
        "Names with ::, names between double underscores and `world` have special meanings in SDFormat; in "
        "Gazebo, Drake and MuJoCo `world` is the ground.",
        "rename the link",
        _find_reserved,
    ),
    LintRule(
        "motor-name",
        "warning",
        "two motors with the same name",
        "Controllers find motors by their names.",
        "rename one of them",
        _find_motor_names,
    ),
    LintRule(
        "link-unused",
        "warning",
        "a link that no joint connects",
        "Most readers refuse a second root; hrsynth drops links that are not connected to the base.",
        "remove it, or add its joint",
        _find_unused,
        fixable=True,
    ),
)
