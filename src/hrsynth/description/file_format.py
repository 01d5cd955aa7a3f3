"""File format of robots: a folder of ``formats/`` that states how its files are recognised, read and written."""

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
    """Opened file: path, document (None if it is not XML), first bytes, and notes on text that was left out.
    ``strict``: no override is given, so the file must be complete; ``tolerance``: relations of joints up to it are made
    exact (None: by the file's digits); ``as_written``: none is; ``as_spelt``: mistyped names pass."""

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
        """Return the root element. Raises ``BadRobotFile`` if the file is not XML."""
        return xml.parse_document(xml.read_bytes(self.path), str(self.path)) if self.root is None else self.root

    @property
    def tag(self) -> str | None:
        """Name of the root element."""
        return None if self.root is None else str(self.root.tag)

    def has_child(self, tag: str) -> bool:
        """Return True if the root has a child element of that name."""
        return self.root is not None and self.root.find(tag) is not None


@dataclass(frozen=True)
class Written:
    """Output of a writer: the text of each file, and warnings of what the format cannot express."""

    texts: tuple[str, ...]
    lost: tuple[Note, ...] = ()


class Read(Protocol):
    """``read`` in ``read.py``: return a joint graph, assembled as in all formats, or a mechanism."""

    def __call__(self, file: RobotFile) -> JointGraph | Mechanism: ...


class Write(Protocol):
    """``write`` in ``write.py``."""

    def __call__(self, mechanism: Mechanism) -> Written: ...


def encode_text(text: str, path: Path) -> bytes:
    """Return the bytes of a file that is text."""
    return text.encode()


def list_single_file(path: Path) -> tuple[Path, ...]:
    """Return the files of a format that writes one."""
    return (path,)


def return_no_companion(path: Path) -> Path | None:
    """Return None: no other file is read together with this one."""
    return None


@dataclass(frozen=True)
class FileFormat:
    """Name of a format (its folder's), how its files are recognised by their content, and the extensions of the files
    that it writes (none: it is only read). ``files`` are all files written where one is named, the robot first;
    ``packed`` turns the text of a file into bytes. ``begins`` are the first bytes of files that are not XML, ``meshes``
    the extensions of meshes that it can name (None: any). ``partner`` is the file on the disk that is read together
    with one.

    A file has the first format that recognises it, in the order of ``rank``.
    """

    name: str
    knows: Callable[[RobotFile], bool]
    endings: tuple[str, ...] = ()
    files: Callable[[Path], tuple[Path, ...]] = list_single_file
    rank: int = 0
    begins: tuple[bytes, ...] = ()
    packed: Callable[[str, Path], bytes] = encode_text
    meshes: tuple[str, ...] | None = None
    partner: Callable[[Path], Path | None] = return_no_companion
