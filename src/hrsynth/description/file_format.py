"""File format of robots: a module of ``formats/`` that states how its files are recognised, read and written."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..geometry.vectors import Array
from ..mechanism.model import Mechanism, Note
from . import xml
from .jointgraph import JointGraph


@dataclass(frozen=True, eq=False)
class RobotFile:
    """Opened file: path, document (None if it is not XML), bytes, and notes on text that was left out.
    ``strict``: no override is given, so the file must be complete; ``as_spelt``: mistyped names pass; ``arguments``:
    those that a xacro file declares, with their values; ``model``: the name of the one to read."""

    path: Path
    root: xml.Element | None
    strict: bool = True
    data: bytes = b""
    notes: tuple[Note, ...] = ()
    as_spelt: bool = False
    arguments: Mapping[str, str] = field(default_factory=dict)
    model: str | None = None

    @property
    def document(self) -> xml.Element:
        """Return the root element. Raises ``BadRobotFile`` if the file is not XML."""
        return xml.parse_document(self.data, str(self.path)) if self.root is None else self.root

    @property
    def tag(self) -> str | None:
        """Name of the root element."""
        return None if self.root is None else str(self.root.tag)

    def has_child(self, tag: str) -> bool:
        """Return True if the root has a child element of that name."""
        return self.root is not None and self.root.find(tag) is not None

    def has_key(self, *keys: str) -> bool:
        """Return True if the file is not XML and has one of these keys of YAML, not indented."""
        wanted = "|".join(map(re.escape, keys)).encode()
        return self.root is None and re.search(rb"(?m)^(\{\s*)?[\"']?(%s)[\"']?\s*:" % wanted, self.data) is not None


@dataclass(frozen=True)
class Written:
    """Output of a writer: the text of each file, and warnings of what the format cannot express."""

    texts: tuple[str, ...]
    lost: tuple[Note, ...] = ()


Read = Callable[[RobotFile], JointGraph]
"""``read`` of a format."""
Write = Callable[[Mechanism], Written]
"""``write`` of a format."""
WriteKeyframes = Callable[[str, Path, Mapping[str, Mapping[str, Array]]], dict[Path, str]]
"""``write_keyframes`` of a format: of a written text, its file, and the joint values of each keyframe."""


@dataclass(frozen=True)
class FileFormat:
    """Name of a format (its module's), how its files are recognised by their content, and the extensions of the
    files that it writes (none: it is only read). ``files`` are all files written where one is named, the robot
    first; ``packed`` turns the text of a file into bytes. ``meshes`` are the extensions of meshes that it can name
    (None: any). ``partner`` is the file on the disk that is read together with one. ``reread``: a written file is read
    back, and what differs becomes a warning; False if tests show that the writer lists its losses. ``keyframe_ending``
    is the extension of the file next to it that holds its keyframes, unless it holds them itself.

    A file has the first format that recognises it, in the order of ``rank``.
    """

    name: str
    knows: Callable[[RobotFile], bool]
    endings: tuple[str, ...] = ()
    files: Callable[[Path], tuple[Path, ...]] = field(default=lambda path: (path,))
    rank: int = 0
    packed: Callable[[str, Path], bytes] = field(default=lambda text, path: text.encode())
    meshes: tuple[str, ...] | None = None
    partner: Callable[[Path], Path | None] = field(default=lambda path: None)
    reread: bool = True
    keyframe_ending: str = ""
