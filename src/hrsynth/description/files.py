"""Files written completely or not at all; lines kept between two runs carry a checksum."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import stat
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from ..errors import BadRequest
from ..processes import require_posix


def convert_to_path(file: object) -> Path:
    """Return the path of a file. Raises ``BadRequest`` for other objects."""
    if not isinstance(file, str | os.PathLike):
        raise BadRequest("a file", file, "its path")
    return Path(file)


class NotRegular(OSError):
    """Directory, pipe or device in place of a file to read."""


def open_regular(path: str | Path) -> BinaryIO:
    """Return an opened file. Raises ``NotRegular`` for one that may be endless or wait for another program, else
    ``OSError``."""
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode):
        raise NotRegular(errno.EINVAL, "a directory" if stat.S_ISDIR(mode) else "not a regular file")
    return open(path, "rb")


def require_writable(path: str | Path) -> Path:
    """Return the path of a file to write. Raises ``BadRequest`` if it cannot be written: before long work, not after
    it."""
    require_folder(path)
    return locate_replaceable(path)


def require_folder(path: str | Path) -> None:
    """Raise ``BadRequest`` if there is no folder for this file or folder, or if creating it there fails (it is
    tried)."""
    try:
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise _make_write_error("no such folder", target.parent)
        _create_draft(target).unlink()
    except (OSError, ValueError) as error:
        raise _make_write_error(f"its folder allows no such file ({_describe_os_error(error)})", path) from None


def require_other(path: str | Path, *sources: str | Path | None, beside: str | None = None) -> None:
    """Raise ``BadRequest`` if a file to write, alone or with the one ``beside`` it, is one that was read."""
    real = os.path.realpath(path)
    if any(source is not None and os.path.realpath(source) == real for source in sources):
        what = "the file" if beside in (None, str(path)) else f"the file that goes with {beside}"
        raise BadRequest(f"cannot write {what}: it is the input file", str(path), "another file")


def require_same(path: Path, content: bytes) -> None:
    """Raise ``BadRequest`` if an unnamed file would be replaced by other content."""
    try:
        same = not path.exists() or (path.stat().st_size == len(content) and path.read_bytes() == content)
    except (OSError, ValueError) as error:
        raise _make_write_error(_describe_os_error(error), path) from None
    if not same:
        raise BadRequest(
            "cannot write the file that goes with it: it exists with other content",
            str(path),
            remedy="Move it, or choose another output.",
        )


def write_whole(path: str | Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file, at once or piece by piece, under a temporary name, then rename it. Raises ``BadRequest`` if it
    cannot be written."""
    try:
        with open_replacement(path) as draft, draft.open("wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
    except (OSError, ValueError) as error:
        raise _make_write_error(_describe_os_error(error), path) from None


def locate_replaceable(path: str | Path) -> Path:
    """Return the path of a file to be rewritten. Raises ``BadRequest`` for a directory or a device."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise _make_write_error("a directory", path)
    if target.exists() and not target.is_file():
        raise _make_write_error("not a regular file", path)
    return target


def _make_write_error(reason: str, path: str | Path) -> BadRequest:
    return BadRequest(
        f"cannot write the file: {reason}",
        str(path),
        "a file in an existing folder with write permission",
    )


def _describe_os_error(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


def _create_draft(target: Path) -> Path:
    """Make an empty file of a random name next to a file; an existing link of this name is not followed."""
    draft = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    return draft


@contextlib.contextmanager
def open_replacement(path: str | Path, *, sync: bool = False) -> Iterator[Path]:
    """Yield an empty file next to a file. It replaces the file when the block ends without an error, with ``sync`` only
    once it is on the disk. Raises ``BadRequest`` for a directory or a device, ``OSError`` if the disk refuses."""
    target = locate_replaceable(path)
    draft = _create_draft(target)
    try:
        yield draft
        if target.exists():
            shutil.copymode(target, draft)
        if sync:
            with draft.open("rb") as written:
                os.fsync(written.fileno())
        os.replace(draft, target)
    finally:
        draft.unlink(missing_ok=True)


def open_kept(path: Path, flags: int = os.O_RDWR) -> int:
    """Open a file that outlives a run, with a predictable name, and create it if missing. Raises ``OSError``, also for
    a symbolic link."""
    return os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)


def add_checksum(text: str) -> str:
    """Return a line with its checksum appended."""
    return f"{text} {zlib.crc32(text.encode()):08x}"


def unseal_line(raw: bytes) -> str | None:
    """Return the line that :func:`add_checksum` sealed, without its end; None if it is damaged."""
    text, _, checksum = raw.rstrip(b"\n").rpartition(b" ")
    return text.decode() if checksum == b"%08x" % zlib.crc32(text) and text.isascii() else None


def require_alone(handle: int, otherwise: str, path: Path, allowed: str = "one build at a time") -> None:
    """Lock an open file or folder until it is closed; raises ``BadRequest`` where another process has it."""
    require_posix("a file that several processes may write", "fcntl")
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BadRequest(otherwise, str(path), allowed) from None
