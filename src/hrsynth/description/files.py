"""Files are written whole or not at all; lines that are kept between two runs carry a checksum."""

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


def as_path(file: object) -> Path:
    """The path of a file; raises ``BadRequest`` for what is none."""
    if not isinstance(file, str | os.PathLike):
        raise BadRequest("a file", file, "its path")
    return Path(file)


class NotRegular(OSError):
    """What is to be read is a directory, a pipe or a device."""


def open_regular(path: str | Path) -> BinaryIO:
    """A file to read; raises ``NotRegular`` for what may have no end, or waits for another program, else
    ``OSError``."""
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode):
        raise NotRegular(errno.EINVAL, "a directory" if stat.S_ISDIR(mode) else "not a regular file")
    return open(path, "rb")


def require_writable(path: str | Path) -> Path:
    """Where a file will be; raises ``BadRequest`` where it cannot be written: before long work, not after it."""
    require_folder(path)
    return replaceable(path)


def require_folder(path: str | Path) -> None:
    """Raise ``BadRequest`` where there is no folder to make this file or folder in, or it takes none of that name,
    which is tried."""
    try:
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise _unwritten("no such folder", target.parent)
        _new_draft(target).unlink()
    except (OSError, ValueError) as error:
        raise _unwritten(f"no such file can be made in its folder ({_reason(error)})", path) from None


def require_other(path: str | Path, *sources: str | Path | None) -> None:
    """Raise ``BadRequest`` where a file to write is one that was read."""
    real = os.path.realpath(path)
    if any(source is not None and os.path.realpath(source) == real for source in sources):
        raise BadRequest("cannot write the file: it is the one being read", str(path), "another file")


def require_same(path: Path, content: bytes) -> None:
    """Raise ``BadRequest`` where a file that nobody named would be replaced by other content."""
    try:
        same = not path.exists() or (path.stat().st_size == len(content) and path.read_bytes() == content)
    except (OSError, ValueError) as error:
        raise _unwritten(_reason(error), path) from None
    if not same:
        raise BadRequest(
            "cannot write the file that goes with it: it already exists, with other content",
            str(path),
            "another name, or that file moved away",
        )


def write_whole(path: str | Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file, at once or piece by piece, under a temporary name, then rename it; raises ``BadRequest`` where it
    cannot be written."""
    try:
        with replacement(path) as draft, draft.open("wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
    except (OSError, ValueError) as error:
        raise _unwritten(_reason(error), path) from None


def replaceable(path: str | Path) -> Path:
    """Where a file is that is to be written anew; raises ``BadRequest`` for a directory or a device."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise _unwritten("a directory", path)
    if target.exists() and not target.is_file():
        raise _unwritten("not a regular file", path)
    return target


def _unwritten(reason: str, path: str | Path) -> BadRequest:
    return BadRequest(
        f"cannot write the file: {reason}",
        str(path),
        "a file, new or old, in a folder that is there and can be written to",
    )


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


def _new_draft(target: Path) -> Path:
    """Make an empty file of a random name beside a file; nothing that is there under this name is followed."""
    draft = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    return draft


@contextlib.contextmanager
def replacement(path: str | Path, *, sync: bool = False) -> Iterator[Path]:
    """An empty file beside a file; what is written there takes the file's place when the block ends without an error,
    with ``sync`` not before it is on the disk. Raises ``BadRequest`` for a directory or a device, ``OSError`` where
    the disk refuses."""
    target = replaceable(path)
    draft = _new_draft(target)
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
    """Open a file that outlives a run, and whose name can be known before, made where there is none. Raises
    ``OSError``, for a symbolic link as well."""
    return os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)


def seal_line(text: str) -> str:
    """A line with its checksum behind it."""
    return f"{text} {zlib.crc32(text.encode()):08x}"


def unseal_line(raw: bytes) -> str | None:
    """The line that :func:`seal_line` sealed, without its end; None for a damaged one."""
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
