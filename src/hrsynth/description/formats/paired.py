"""Frames whose names mark where a loop closes: ``closing_X_1`` and ``closing_X_2`` of onshape-to-robot, and other
spellings (``closedloop1_A_6D`` and ``closedloop1_B_6D``, ``l1_cl1_1`` and ``l1_cl1_2``)."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ...mechanism.model import JointType
from ..elements import XmlReader
from ..jointgraph import FrameSpec, JointGraph

_ONSHAPE = re.compile(r"closing_(?P<name>.+)_(?P<number>[12])")
_CLOSES = re.compile(r"(?<![a-z])(?:closing|closure|closed[ _-]?loop|loop[ _-]?clos|cl(?=\d))", re.IGNORECASE)
"""Words in the names of frames that close a loop."""
_SIDE = re.compile(r"(?P<stem>.*(?:[_.-]|\d(?=[ab])))(?P<side>[ab12])(?P<kind>[_.-]?[36]d)?", re.IGNORECASE)
_OTHERS = {"a": "bc", "A": "BC", "1": "203"}
"""Other side of each pair, and sides that a pair does not have."""
_KIND = re.compile(r"(?<!\d)(?P<number>[36])d(?![a-z])", re.IGNORECASE)


def join_onshape_pairs(reader: XmlReader, graph: JointGraph, frames: Mapping[str, FrameSpec]) -> None:
    """Close frames ``closing_X_1`` and ``closing_X_2``; with ``closing_X_1_z``, ``closing_X_2_z`` as well, by a
    revolute joint. A frame without its partner is a defect."""
    for name, frame in frames.items():
        match = _ONSHAPE.fullmatch(name)
        if match is None:
            continue
        partner = f"closing_{match['name']}_{3 - int(match['number'])}"
        if partner not in frames:
            reader.defect(frame.line, f"closing frame {name!r} without its partner", None, f"{partner!r} as well")
        elif match["number"] == "1" and frame.link != frames[partner].link:
            hinge = f"{name}_z" in frames and f"{partner}_z" in frames
            kind = JointType.REVOLUTE if hinge else JointType.SPHERICAL
            graph.close(graph.fresh(match["name"]), kind, (frame, frames[partner]))
            graph.closing.update({name, partner, f"{name}_z", f"{partner}_z"})


def join_named_pairs(graph: JointGraph, frames: Mapping[str, FrameSpec]) -> None:
    """Close pairs of frames whose names hold a word of closing and differ in one letter or number (A, B or 1, 2), with
    the joint of ``3D`` or ``6D`` in the name, else in a point. If other elements close loops, the pairs are only
    noted."""
    closed = any(not joint.in_tree for joint in graph.joints.values())
    read: dict[str, list[str]] = {}
    for name, frame in frames.items():
        match = _SIDE.fullmatch(name) if _CLOSES.search(name) and not _ONSHAPE.fullmatch(name) else None
        if match is None or match["side"] not in _OTHERS:
            continue
        partner, *more = (f"{match['stem']}{side}{match['kind'] or ''}" for side in _OTHERS[match["side"]])
        if partner not in frames or frames[partner].link == frame.link or any(each in frames for each in more):
            continue
        said = _KIND.search(name)
        kind = JointType.FIXED if said is not None and said["number"] == "6" else JointType.SPHERICAL
        wish = f"{name}:{partner}:{'fixed' if kind is JointType.FIXED else 'spherical'}"
        if closed:
            read.setdefault("open", []).append(wish)
            continue
        graph.close(graph.fresh(match["stem"].strip("_-. ") or "closure"), kind, (frame, frames[partner]))
        graph.closing.update({name, partner})
        read.setdefault("assumption", []).append(wish)
    for kind_of_note, wishes in read.items():
        what = (
            "frames close loops by their names (--close A:B:TYPE for another type): "
            if kind_of_note == "assumption"
            else "frames with names of loop closures are left open, because other elements close loops; --close "
        )
        graph.note(kind_of_note, what + ", ".join(wishes[:12]) + (" …" if wishes[12:] else ""))
