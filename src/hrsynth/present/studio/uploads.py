"""Files that are dropped into the page: flat names, of limited size and number, each whole or not there."""

from __future__ import annotations

import asyncio
import os
import re
import secrets
from collections.abc import AsyncIterator
from pathlib import Path

from ...errors import BadRequest, FileTooLarge
from ...tolerances import SENDER_TIMEOUT_S

UPLOAD_MAX_BYTES = 20_000_000
"""Largest file dropped into the page (bytes)."""
UPLOADED_FILES_MAX = 50
"""Largest number of files of a tab."""
FILE_NAME_MAX_BYTES = 200
"""Longest name of such a file (bytes)."""
UPLOAD_TIMEOUT_S = 60.0
"""Time limit for a whole file (s)."""

NAME = re.compile(r"\w[\w .,()+@-]*")
"""A name without folders and odd characters."""
PART = ".part-"
"""What the name of a file begins with while it comes."""


class UploadFolder:
    """The files of one tab."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.coming: set[str] = set()
        folder.mkdir(mode=0o700)

    def require(self, name: str, length: str | None) -> None:
        """Raise ``BadRequest`` for a name or a length that is refused, before anything is read."""
        if not NAME.fullmatch(name) or name.endswith((" ", ".")) or len(name.encode()) > FILE_NAME_MAX_BYTES:
            raise BadRequest("file name", name, "letters, digits, spaces and . , ( ) + @ - _, no folder")
        if length is not None and not (length.isascii() and length.isdecimal()):
            raise BadRequest("file length", length, "a whole number")
        if length is not None and (len(length) > len(str(UPLOAD_MAX_BYTES)) or int(length) > UPLOAD_MAX_BYTES):
            raise FileTooLarge(name, UPLOAD_MAX_BYTES)
        if len({*os.listdir(self.folder), *self.coming, name} - self._parts()) > UPLOADED_FILES_MAX:
            raise BadRequest(f"{name}: more than {UPLOADED_FILES_MAX} files in one tab", remedy="Open another tab.")

    def _parts(self) -> set[str]:
        return {each for each in os.listdir(self.folder) if each.startswith(PART)}

    async def receive(self, name: str, chunks: AsyncIterator[bytes]) -> None:
        """Keep a file whose name was found good; raises ``FileTooLarge``, ``TimeoutError``."""
        part, size = self.folder / (PART + secrets.token_hex(8)), 0
        self.coming.add(name)
        try:
            async with asyncio.timeout(UPLOAD_TIMEOUT_S):
                with part.open("xb") as file:
                    while True:
                        async with asyncio.timeout(SENDER_TIMEOUT_S):
                            chunk = await anext(chunks, None)
                        if chunk is None:
                            break
                        size += len(chunk)
                        if size > UPLOAD_MAX_BYTES:
                            raise FileTooLarge(name, UPLOAD_MAX_BYTES)
                        file.write(chunk)
            part.replace(self.folder / name)
        finally:
            self.coming.discard(name)
            part.unlink(missing_ok=True)
