"""File under ``lint``: its document, its mechanism, and the reader's refusal."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from ..description import formats, xml
from ..description.file_format import RobotFile
from ..description.formats.urdf import xacro
from ..description.jointgraph import JointGraph
from ..description.overrides import Overrides
from ..description.reading import build_mechanism, open_robot_file
from ..errors import BadRobotFile, HrsynthError
from ..mechanism.model import Mechanism

Found = TypeVar("Found")
_HEAD = re.compile(rb"(?>\s|<\?.*?\?>|<!--.*?-->)*", re.DOTALL)
_TAIL = re.compile(rb"</[^<>]*>((?>\s|<!--.*?-->)*)$", re.DOTALL)
"""Text before and after the root element."""
DIALECTS = {"robot": "urdf", "mujoco": "mjcf", "sdf": "sdf"}
"""Formats by the names of their root elements."""


class LintedFile:
    """Robot file, opened once; ``text`` replaces its content after a fix. ``given`` are its overrides (platform,
    base …); ``readers`` are the programs that shall read it, ``other`` is a file of the same robot.

    Raises ``BadRobotFile`` for a file that cannot be opened, or is not a document.
    """

    def __init__(
        self,
        path: str | Path,
        given: Overrides | None = None,
        text: bytes | None = None,
        readers: tuple[str, ...] = (),
        other: LintedFile | None = None,
    ) -> None:
        self.given, self.readers, self.other = given or Overrides(), readers, other
        opened = open_robot_file(Path(path), Overrides(args=self.given.args, model=self.given.model), strict=False)
        if opened.root is None:  # a YAML file next to a document
            opened = open_robot_file(Path(formats.read(opened).file), strict=False)
        self.path, self.file = opened.path, str(opened.path)
        self.data = xml.read_bytes(opened.path) if text is None else text
        self.root = opened.root if text is None else xml.parse_document(text, self.file)
        self._opened = replace(opened, root=self.root)
        self.expanded = (
            text is None and self.root is not None and xacro.is_needed(xml.parse_document(self.data, self.file, []))
        )
        """The document is the output of xacro, so no fix can be written to the file."""
        self._remembered: dict[str, Any] = {}
        self.dialect = None if self.root is None else DIALECTS.get(str(self.root.tag))

    def open(self, *, strict: bool = False) -> RobotFile:
        """Return the file for a reader, which may change its document."""
        return replace(
            self._opened, root=copy.deepcopy(self.root), strict=strict and not self.given.has_any, as_spelt=not strict
        )

    def graph(self) -> JointGraph:
        """Return the joint graph of the file before assembly. Raises ``BadRobotFile``."""
        return formats.read(self.open())

    @cached_property
    def said(self) -> JointGraph | None:
        """Joint graph, None if it is refused; nothing may change it."""
        try:
            return self.graph()
        except HrsynthError:
            return None

    @cached_property
    def _read(self) -> Mechanism | HrsynthError:
        try:
            return build_mechanism(self.open(strict=True), self.given)
        except HrsynthError as error:
            return error

    @property
    def refusal(self) -> HrsynthError | None:
        """Error with which every command refuses the file, or None."""
        return self._read if isinstance(self._read, HrsynthError) else None

    @cached_property
    def mechanism(self) -> Mechanism | None:
        """Mechanism that every command reads; if its format refuses the file, the tolerant reader's; else None."""
        if isinstance(self._read, Mechanism):
            return self._read
        try:
            return build_mechanism(self.open(), self.given)
        except HrsynthError:
            return None

    def remember(self, name: str, make: Callable[[], Found]) -> Found:
        """Return a value that is computed once for several rules."""
        if name not in self._remembered:
            self._remembered[name] = make()
        found: Found = self._remembered[name]
        return found

    def element(self, line: int | None, *tags: str, name: str | None = None) -> xml.Element | None:
        """Return the only element with one of these tags that starts in a line of this file; of several that with the
        name."""
        if self.root is None or line is None or isinstance(line, xml.SourceLine):
            return None
        found = [each for each in self.root.iter(*tags) if xml.get_line(each) == line]
        if len(found) > 1:
            found = [each for each in found if each.get("name") == name]
        return found[0] if len(found) == 1 else None

    def after(self) -> LintedFile:
        """Return the file with its current document."""
        return LintedFile(self.path, self.given, self.text(), self.readers, self.other)

    def text(self) -> bytes:
        """Return the document as text."""
        from lxml import etree

        assert self.root is not None
        head, tail = _HEAD.match(self.data), _TAIL.search(self.data)
        text = etree.tostring(self.root, encoding="utf-8", with_tail=False)
        return (head[0] if head else b"") + text + (tail[1] if tail else b"")


def list_defects(error: HrsynthError) -> list[tuple[int | None, str]]:
    """Return line and text of all defects of an error."""
    if isinstance(error, BadRobotFile):
        return [(each.line, each.text) for each in error.defects]
    return [(None, " ".join(str(error).split()))]
