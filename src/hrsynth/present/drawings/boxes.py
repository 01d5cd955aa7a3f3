"""Boxes of a drawn mechanism (joints, planar parallelograms) between links, and the paths that they form.

A group of boxes is cut into *ears*: a path between two links that are there already, then another, until every box
is in one. The first ear of a leg is its shortest chain from the base to the platform; the next ones stand beside it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from ...mechanism import JointType, Mechanism
from ...mechanism.composites import WordGraph
from ...mechanism.notation import Letter, Word


@dataclass(frozen=True)
class Box:
    """A joint, or the four joints of a planar parallelogram, between the links ``tail`` and ``head``."""

    letter: str
    joints: tuple[str, ...]
    tail: str
    head: str
    driven: bool = False
    virtual: bool = False
    inside: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """virtual, motor or joint."""
        return "virtual" if self.virtual else "motor" if self.driven else "joint"

    def other(self, link: str) -> str:
        """The link at the other end."""
        return self.head if link == self.tail else self.tail


@dataclass(frozen=True)
class Ear:
    """Boxes in series; ``links`` has one more, and the first and (unless ``open``) the last were there before."""

    boxes: tuple[Box, ...]
    links: tuple[str, ...]
    open: bool = False


def list_boxes(mechanism: Mechanism, observed: Collection[str], virtual: Collection[str]) -> list[Box]:
    """Every joint in one box; a parallelogram whose cranks are neither observed nor joined to anything else is one."""
    kept = {mechanism.base, mechanism.platform, *observed}
    pairs = [
        edge
        for edge in WordGraph(mechanism, kept).recognise().edges()
        if edge.word == Word((Letter("Pi"),)) or edge.word == Word((Letter("Pi", True),))
    ]
    found: dict[str, Box] = {}
    for edge in pairs:
        joints = [mechanism.joints[name] for name in edge.joints]
        found[edge.joints[0]] = Box(
            "Π",
            edge.joints,
            edge.tail,
            edge.head,
            any(j.is_actuated for j in joints),
            not set(edge.joints).isdisjoint(virtual),
            edge.inside,
        )
    inner = {name for edge in pairs for name in edge.joints}
    for joint in mechanism.joints.values():
        if joint.name not in inner:
            letter = "6" if joint.type is JointType.FREE else joint.type.value
            found[joint.name] = Box(
                letter, (joint.name,), joint.predecessor, joint.successor, joint.is_actuated, joint.name in virtual
            )
    return [found[name] for name in mechanism.joints if name in found]


def split_ears(boxes: Iterable[Box], ends: Sequence[str]) -> Iterator[Ear]:
    """All boxes, each in one ear; the links ``ends`` are there from the start."""
    left = list(boxes)
    there = dict.fromkeys(ends)
    while left:
        ear = _find_ear(left, tuple(there))
        there.update(dict.fromkeys(ear.links))
        taken = set(map(id, ear.boxes))
        left = [box for box in left if id(box) not in taken]
        yield ear


def _find_ear(boxes: Sequence[Box], there: tuple[str, ...]) -> Ear:
    """The shortest path between two links that are there; else the longest way out; else what hangs on nothing."""
    at: dict[str, list[Box]] = {}
    for box in boxes:
        at.setdefault(box.tail, []).append(box)
        at.setdefault(box.head, []).append(box)
    known = set(there)
    closed: Ear | None = None
    out: Ear | None = None
    for start in there:
        for ear in _list_ways(at, start, known):
            if not ear.open and (closed is None or len(ear.boxes) < len(closed.boxes)):
                closed = ear
            elif ear.open and (out is None or len(ear.boxes) > len(out.boxes)):
                out = ear
    found = closed or out
    return found if found is not None else Ear((boxes[0],), (boxes[0].tail, boxes[0].head), True)


def _list_ways(at: dict[str, list[Box]], start: str, known: set[str]) -> Iterator[Ear]:
    """The shortest ways from a link over links that are new: to each that is there, and to each new one."""
    pending = [Ear((), (start,))]
    seen = {start}
    for way in pending:
        for box in at.get(way.links[-1], ()):
            link = box.other(way.links[-1])
            if link in seen:
                continue
            seen.add(link)
            longer = Ear((*way.boxes, box), (*way.links, link), link not in known)
            yield longer
            if longer.open:
                pending.append(longer)
