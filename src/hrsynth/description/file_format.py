"""What a dialect of robot files is: a folder of ``formats/`` that says how its files are known, read and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ..mechanism.model import Mechanism, Note
from . import xml
from .jointgraph import JointGraph


@dataclass(frozen=True, eq=False)
class RobotFile:
    """A file that was opened: its place, its document (None where it is no XML), whether what it says of itself stands,
    as nothing was given that changes it, what it begins with, and what was left out of its text; up to what
    ``tolerance`` relations of its joints are made exact (None: as its digits say), or that they stay ``as_written``;
    whether mistyped names are let pass (``as_spelt``)."""

    path: Path
    root: xml.Element | None
    strict: bool = True
    start: bytes = b""
    notes: tuple[Note, ...] = ()
    tolerance: float | None = None
    as_written: bool = False
    as_spelt: bool = False

    @property
    def document(self) -> xml.Element:
        """The root element; raises ``BadRobotFile`` for what is no XML."""
        return xml.document(xml.content(self.path), str(self.path)) if self.root is None else self.root

    @property
    def tag(self) -> str | None:
        """The name of the root element."""
        return None if self.root is None else str(self.root.tag)

    def has(self, tag: str) -> bool:
        """Whether the root has a child element of that name."""
        return self.root is not None and self.root.find(tag) is not None


@dataclass(frozen=True)
class Written:
    """What a dialect makes of a mechanism: the text of each file, and warnings of what it cannot say."""

    texts: tuple[str, ...]
    lost: tuple[Note, ...] = ()


class Read(Protocol):
    """``read`` in ``read.py``: a joint graph, of which the rest is made as for all dialects, or a mechanism."""

    def __call__(self, file: RobotFile) -> JointGraph | Mechanism: ...


class Write(Protocol):
    """``write`` in ``write.py``."""

    def __call__(self, mechanism: Mechanism) -> Written: ...


def as_text(text: str, path: Path) -> bytes:
    """The bytes of a dialect whose files are text."""
    return text.encode()


def one_file(path: Path) -> tuple[Path, ...]:
    """The files of a dialect that writes one."""
    return (path,)


def alone(path: Path) -> Path | None:
    """No other file is read together with one."""
    return None


@dataclass(frozen=True)
class FileFormat:
    """A dialect's name (that of its folder), how its files are known by their content, and the endings of those that it
    writes: none where it is only read. ``files`` are all that are written where one is named, the robot first;
    ``packed`` makes the bytes of a file of its text. ``begins`` is what its files begin with where they are no XML,
    ``meshes`` the endings of the meshes that it can name, None where any. ``partner`` is the file on the disk that is
    read together with one.

    A file is of the first dialect that knows it, in the order of ``rank``.
    """

    name: str
    knows: Callable[[RobotFile], bool]
    endings: tuple[str, ...] = ()
    files: Callable[[Path], tuple[Path, ...]] = one_file
    rank: int = 0
    begins: tuple[bytes, ...] = ()
    packed: Callable[[str, Path], bytes] = as_text
    meshes: tuple[str, ...] | None = None
    partner: Callable[[Path], Path | None] = alone
