"""Composite joints, recognised by geometry and never declared: planar parallelograms, equal parallel rods, carriers.

The joint graph is contracted step by step: every edge carries its architecture notation and the joints and links inside
it, until nothing contracts any more.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..geometry import lines
from ..geometry.vectors import Array, cross
from ..tolerances import POINT_DISTANCE_TOL
from . import graphs
from .model import JointType, Mechanism
from .normal import locate_centre_pair
from .notation import Bar, Carrier, Letter, Rods, Word


@dataclass(frozen=True)
class WordEdge:
    """Edge between two links: ``word`` read from ``tail`` to ``head``, the joints and the links inside."""

    tail: str
    head: str
    word: Word
    joints: tuple[str, ...]
    inside: tuple[str, ...] = ()

    def word_from(self, link: str) -> Word:
        """Return the word read from ``link`` to the other end."""
        return self.word if link == self.tail else self.word.reversed()

    def other(self, link: str) -> str:
        """Return the other end."""
        return self.head if link == self.tail else self.tail


@dataclass(frozen=True)
class BinaryLink:
    """Link with a spherical (or universal) joint at each end, from ``near`` to ``far`` (joint names)."""

    link: str
    near: str
    far: str


class WordGraph:
    """Contracted joint graph of a mechanism; ``kept`` links never disappear into an edge."""

    def __init__(self, mechanism: Mechanism, kept: Collection[str], links: Iterable[str] | None = None) -> None:
        self.mechanism = mechanism
        self.kept = set(kept)
        inside = set(mechanism.links if links is None else links)
        self._at: dict[str, dict[int, WordEdge]] = {name: {} for name in mechanism.links if name in inside}
        self._links = inside
        self._number = 0
        self._carriers: list[WordEdge] = []
        for joint in mechanism.joints.values():
            if joint.type is not JointType.FREE and set(joint.links) <= inside:
                letter = Letter(joint.type.value, joint.is_actuated)
                self._add(WordEdge(joint.predecessor, joint.successor, Word((letter,)), (joint.name,)))

    def _add(self, edge: WordEdge) -> None:
        self._number += 1
        for link in (edge.tail, edge.head):
            self._at[link][self._number] = edge

    def _remove(self, key: int, edge: WordEdge) -> None:
        for link in (edge.tail, edge.head):
            del self._at[link][key]

    def _remove_links(self, links: Iterable[str]) -> None:
        for link in links:
            for key, edge in self.edges_at(link):
                self._remove(key, edge)
            del self._at[link]

    def __len__(self) -> int:
        """Return the number of links that are left."""
        return len(self._at)

    def edges_at(self, link: str) -> list[tuple[int, WordEdge]]:
        """Return keys and edges at a link, oldest first."""
        return list(self._at[link].items())

    def edges(self) -> list[WordEdge]:
        """Return all edges, oldest first."""
        table = {key: edge for edges in self._at.values() for key, edge in edges.items()}
        return [table[key] for key in sorted(table)]

    def between(self, a: str, b: str) -> list[tuple[int, WordEdge]]:
        """Return keys and edges between two links."""
        return [(key, edge) for key, edge in self.edges_at(a) if edge.other(a) == b] if a in self._at else []

    def adjacency(self) -> graphs.Adjacency:
        """Return the links that are left, each with its neighbours."""
        return graphs.build_adjacency(self._at, ((edge.tail, edge.head) for edge in self.edges()))

    def keep(self, joints: Collection[str]) -> None:
        """Remove the edges of other joints than these."""
        for edges in self._at.values():
            for key in [key for key, edge in edges.items() if not set(edge.joints) <= set(joints)]:
                del edges[key]

    def recognise(self) -> WordGraph:
        """Contract planar parallelograms and equal parallel rods, nothing else."""
        for found in iter(lambda: next(self._rods(), None) or next(self._parallelograms(), None), None):
            edge, links = found
            self._remove_links(links)
            self._add(edge)
        return self

    def recognise_carriers(self) -> WordGraph:
        """Contract carriers as well: links guided by P joints at the end of a chain."""
        probe = WordGraph(self.mechanism, self.kept, self._links)
        while probe.recognise() and (probe._series() or probe._carrier()):
            pass
        for edge in probe._carriers:
            self._remove_links(link for link in edge.inside if link in self._at)
            for key, old in self.between(edge.tail, edge.head):
                if set(old.joints) <= set(edge.joints):
                    self._remove(key, old)
            self._add(edge)
        return self

    def reduce(self) -> WordGraph:
        """Contract everything in series or in parallel as well."""
        while True:
            self.recognise()
            if not (self._series() or self._carrier() or self._parallel()):
                return self

    def _binary(self) -> Iterator[tuple[str, WordEdge, WordEdge]]:
        for link in self.mechanism.links:
            if link in self._at and link not in self.kept:
                edges = self.edges_at(link)
                if len(edges) == 2 and edges[0][1].other(link) != edges[1][1].other(link):
                    yield link, edges[0][1], edges[1][1]

    def _groups(self, letters: set[str]) -> Iterator[tuple[str, str, list[BinaryLink]]]:
        """Yield binary links whose two joints are single joints of the given types, grouped by the pair that they
        connect."""
        table: dict[frozenset[str], list[tuple[str, WordEdge, WordEdge]]] = {}
        for link, first, second in self._binary():
            if all(
                len(edge.joints) == 1 and self.mechanism.joints[edge.joints[0]].type.value in letters
                for edge in (first, second)
            ):
                table.setdefault(frozenset((first.other(link), second.other(link))), []).append((link, first, second))
        for members in table.values():
            if len(members) < 2:
                continue
            link, first, second = members[0]
            tail, head = first.other(link), second.other(link)
            rods = []
            for link, first, second in members:
                near, far = (first, second) if first.other(link) == tail else (second, first)
                rods.append(BinaryLink(link, near.joints[0], far.joints[0]))
            yield tail, head, rods

    def _vector(self, rod: BinaryLink) -> tuple[Array, Array]:
        near, far = locate_centre_pair(self.mechanism.joints[rod.near], self.mechanism.joints[rod.far])
        return near, far - near

    def _rods(self) -> Iterator[tuple[WordEdge, list[str]]]:
        tolerance = POINT_DISTANCE_TOL * self.mechanism.length
        for tail, head, rods in self._groups({"S", "U"}):
            for rod in rods:
                near, vector = self._vector(rod)
                words = {self._rod_word(rod)}
                same = [rod]
                for other in rods:
                    start, along = self._vector(other)
                    words_match = self._shape(other) == self._shape(rod)
                    if (
                        other.link != rod.link
                        and words_match
                        and np.linalg.norm(along - vector) <= tolerance
                        and np.linalg.norm(start - near) > tolerance
                    ):
                        same.append(other)
                        words.add(self._rod_word(other))
                if len(same) >= 2:
                    word = max(words, key=lambda w: sum(letter.actuated for letter in w.items))  # type: ignore[union-attr]
                    joints = tuple(name for each in same for name in (each.near, each.far))
                    links = [each.link for each in same]
                    yield WordEdge(tail, head, Word((Rods(len(same), word),)), joints, tuple(links)), links
                    break

    def _rod_word(self, rod: BinaryLink) -> Word:
        return Word(
            tuple(
                Letter(self.mechanism.joints[name].type.value, self.mechanism.joints[name].is_actuated)
                for name in (rod.near, rod.far)
            )
        )

    def _shape(self, rod: BinaryLink) -> str:
        return self.mechanism.joints[rod.near].type.value + self.mechanism.joints[rod.far].type.value

    def _parallelograms(self) -> Iterator[tuple[WordEdge, list[str]]]:
        joints = self.mechanism.joints
        tolerance = POINT_DISTANCE_TOL * self.mechanism.length
        for tail, head, cranks in self._groups({"R"}):
            for one, two in combinations(cranks, 2):
                axis = joints[one.near].axis
                if not all(lines.is_parallel(axis, joints[name].axis) for name in (one.far, two.near, two.far)):
                    continue
                (a, along), (b, beside) = self._vector(one), self._vector(two)
                flat = np.eye(3) - np.outer(axis, axis)
                if (
                    np.linalg.norm(flat @ (along - beside)) <= tolerance
                    and np.linalg.norm(cross(flat @ along, flat @ (b - a))) > tolerance**2
                    and np.linalg.norm(flat @ along) > tolerance
                ):
                    motor = any(joints[n].is_actuated for c in (one, two) for n in (c.near, c.far))
                    names = tuple(n for c in (one, two) for n in (c.near, c.far))
                    links = [one.link, two.link]
                    yield WordEdge(tail, head, Word((Letter("Pi", motor),)), names, tuple(links)), links

    def _series(self) -> bool:
        """Contract all links in series: contracted edges have several joints, so no rod or crank is made or lost."""
        found = False
        for link, first, second in self._binary():
            self._remove_links((link,))
            a, b = first.other(link), second.other(link)
            self._add(
                WordEdge(
                    a,
                    b,
                    first.word_from(a) + second.word_from(link),
                    first.joints + second.joints,
                    (*first.inside, link, *second.inside),
                )
            )
            found = True
        return found

    def _parallel(self) -> bool:
        for a, b in dict.fromkeys((edge.tail, edge.head) for edge in self.edges()):
            edges = self.between(a, b)
            if len(edges) > 1:
                tail, head = edges[0][1].tail, edges[0][1].head
                branches: list[Word] = []
                for key, edge in edges:
                    self._remove(key, edge)
                    word = edge.word_from(tail)
                    bar = word.items[0]
                    branches.extend(bar.branches if isinstance(bar, Bar) and len(word.items) == 1 else (word,))
                self._add(
                    WordEdge(
                        tail,
                        head,
                        Word((Bar(tuple(branches)),)),
                        tuple(n for _, edge in edges for n in edge.joints),
                        tuple(n for _, edge in edges for n in edge.inside),
                    )
                )
                return True
        return False

    def _carrier(self) -> bool:
        """Contract {chain-sliders}: a link guided by P joints from another, and carried by the end of a chain from
        it."""
        for link in self.mechanism.links:
            if link not in self._at or link in self.kept:
                continue
            for key, sliders in self.edges_at(link):
                foot = sliders.other(link)
                if foot not in self.kept:
                    continue
                word = sliders.word_from(foot)
                if not all(isinstance(i, Letter) and i.letter == "P" and not i.actuated for i in word.items):
                    continue
                beside = [(k, e) for k, e in self.between(foot, link) if k != key]
                for other, chain in beside:
                    path = chain.word_from(foot)
                    follower = path.items[-1]
                    if (
                        len(path.items) >= 2
                        and isinstance(follower, Letter)
                        and follower.letter in "RS"
                        and not follower.actuated
                        and len(self.edges_at(link)) >= 3
                    ):
                        self._remove(key, sliders)
                        self._remove(other, chain)
                        self._carriers.append(
                            WordEdge(
                                foot,
                                link,
                                Word((Carrier(Word(path.items[:-1]), word),)),
                                chain.joints + sliders.joints,
                                chain.inside + sliders.inside,
                            )
                        )
                        self._add(self._carriers[-1])
                        return True
        return False
