"""Journal of a build: each entry is on the disk as soon as it is computed, so that a killed build continues."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..description.files import add_checksum, open_kept, require_alone, unseal_line
from ..errors import BadRequest, BuildInterruption
from .jsonl import format_head, parse_word, read_head

ENDING = ".part"


class Journal:
    """An append-only file of records in the order in which they were made; open in one process at a time.

    Each line ends with its checksum. A last line that was torn is cut off, a damaged one is passed over: those records
    are made again. Raises ``BadRequest`` for a journal of another version, one that another build has open, or one that
    cannot be opened, ``BuildInterruption`` where the disk takes no more.
    """

    def __init__(self, path: Path, group: str, *, anew: bool = False) -> None:
        self.path = path
        try:
            self._file = open_kept(path, os.O_RDWR | os.O_APPEND)
        except OSError as error:
            raise BadRequest(f"{path}: cannot write: {error.strerror}", remedy="Choose another path.") from None
        try:
            require_alone(self._file, "another build is writing this journal", path)
            if anew:
                os.ftruncate(self._file, 0)
            self._places = self._read(group)
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def __contains__(self, word: str) -> bool:
        return word in self._places

    def __len__(self) -> int:
        return len(self._places)

    def lines(self, words: Iterable[str]) -> Iterator[str]:
        """The records of these words."""
        for word in words:
            start, size = self._places[word]
            yield os.pread(self._file, size, start).decode("ascii")

    def add(self, made: Iterable[tuple[str, str]]) -> None:
        """Append words with their lines; returns when they are on the disk."""
        made = list(made)
        lines, place = [f"{add_checksum(text)}\n" for _, text in made], self._end
        self._append("".join(lines))
        for (word, text), line in zip(made, lines, strict=True):
            self._places[word] = place, len(text)
            place += len(line)

    def remove(self) -> None:
        """The records are in the store: the journal is no longer needed."""
        self.path.unlink(missing_ok=True)

    def _read(self, group: str) -> dict[str, tuple[int, int]]:
        """Return start and length of the line of each key."""
        places: dict[str, tuple[int, int]] = {}
        self._end = 0
        with os.fdopen(os.dup(self._file), "rb") as content:
            content.seek(0)
            for raw in content:
                if not raw.endswith(b"\n"):
                    break
                text = unseal_line(raw)
                if self._end == 0:
                    if text is None:
                        raise BadRequest(
                            f"{self.path}: journal without checksums or with a damaged first line",
                            remedy="Remove the file or use --anew.",
                        )
                    read_head(text, str(self.path), f"{self.path}: not the journal of a build", None)
                elif text is not None:
                    with contextlib.suppress(BadRequest):
                        places[parse_word(text)] = self._end, len(text)
                self._end += len(raw)
        os.ftruncate(self._file, self._end)
        if self._end == 0:
            self._append(add_checksum(format_head(group)) + "\n")
        return places

    def _append(self, text: str) -> None:
        content = text.encode("ascii")
        try:
            done = 0
            while done < len(content):
                done += os.write(self._file, content[done:])
            os.fsync(self._file)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._end)
            raise BuildInterruption(f"{self.path}: {error.strerror}", str(self.path)) from None
        self._end += len(content)
