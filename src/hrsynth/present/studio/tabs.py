"""Tabs of the page: each has a socket, two worker processes, and its uploaded files.

Motion has a process of its own, so that a drag never waits for a longer analysis.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .processes import ForkServer, WorkerProcess, cancel_message, format_gone
from .uploads import UploadFolder

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from ...mechanism import Mechanism

STUDIO_TABS_MAX = 8
"""Largest number of tabs served at once, with two processes each."""
MOVE_TIMEOUT_S = 10.0
"""Time limit of a move of the robot (s); its process then ends."""
REQUEST_TIMEOUT_S = 120.0
"""Time limit of any other request (s)."""

SOCKET_TRY_LATER_CODE = 1013
"""Close code of a socket if too many are open."""
MOVE, CANCEL = "move", "cancel"


@dataclass(frozen=True)
class StartupState:
    """Content of a server: a folder of robots, a robot with its options as ``given`` (see ``AnalysisService``) or as a
    ``mechanism``, the first state of the page (``watch``, ``camera``, ``hidden``), and whether it has ``panels``."""

    folder: Path | None = None
    given: dict[str, Any] | None = None
    mechanism: Mechanism | None = None
    first: dict[str, Any] = field(default_factory=dict)
    panels: bool = True

    def write(self, folder: Path) -> StartupState:
        """Write the mechanism to a file in a folder, for the processes that read it."""
        if self.mechanism is None:
            return self
        from ...description import save

        file = folder / "robot.urdf"
        save(self.mechanism, file, "native")
        return replace(self, mechanism=None, given={"robot": str(file), "options": {"as_written": True}})

    def message(self, tab: str) -> str:
        """Return the first message to a tab."""
        start = None if self.given is None else {"source": "given", "options": {}}
        return json.dumps(
            {"tab": tab, "start": start, "folder": self.folder is not None, "panels": self.panels, **self.first}
        )


class BrowserTab:
    """One tab, from the opening of its socket to the end."""

    def __init__(self, socket: WebSocket, uploads: UploadFolder, forks: ForkServer, opening: StartupState) -> None:
        self.socket, self.uploads = socket, uploads
        folder = opening.folder
        setup = json.dumps(
            {"folder": None if folder is None else str(folder), "uploads": str(uploads.folder), "given": opening.given}
        ).encode()
        self.mover, self.desk = (
            WorkerProcess(forks, setup, seconds, socket.send_text) for seconds in (MOVE_TIMEOUT_S, REQUEST_TIMEOUT_S)
        )

    async def run(self) -> None:
        """Answer until the socket is closed, from whichever side."""
        tasks = [asyncio.create_task(each) for each in (self._listen(), self.mover.run(), self.desk.run())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _listen(self) -> None:
        while True:
            message = await self.socket.receive()
            if message["type"] != "websocket.receive":
                return
            refused = self._route(message.get("text"))
            if refused is not None:
                await self.socket.send_text(refused)

    def _route(self, text: str | None) -> str | None:
        """Queue a request, or cancel one; return the error message if that fails."""
        try:
            asked = json.loads(text or "", parse_constant=_refuse_number)
            kind = asked["ask"]
            number = asked["of" if kind == CANCEL else "n"]
            if type(number) is not int or not isinstance(kind, str):
                raise TypeError(number)
        except (ValueError, KeyError, TypeError, RecursionError):
            return format_gone(
                None,
                "invalid message: expected an object with a whole number n and the name ask of an analysis",
                "Unknown",
            )
        if kind == CANCEL:
            return cancel_message(number) if self.mover.cancel(number) or self.desk.cancel(number) else None
        there = self.mover if kind == MOVE else self.desk
        return (
            None
            if there.ask(number, (text or "").encode())
            else format_gone(number, "too many requests wait", "TooMany")
        )


def _refuse_number(name: str) -> None:
    """Raise ``ValueError``: NaN and infinities are no JSON."""
    raise ValueError(name)


class Tabs:
    """All that are open."""

    def __init__(self, forks: ForkServer, opening: StartupState, folder: Path) -> None:
        self.forks, self.opening, self.folder = forks, opening, folder
        self.open: dict[str, BrowserTab] = {}

    async def serve(self, socket: WebSocket) -> None:
        """A tab from its beginning to its end; its processes and files go with it."""
        await socket.accept()
        if len(self.open) >= STUDIO_TABS_MAX:
            await socket.close(SOCKET_TRY_LATER_CODE, f"{STUDIO_TABS_MAX} tabs are open")
            return
        name = secrets.token_urlsafe(12)
        uploads = UploadFolder(self.folder / name)
        self.open[name] = tab = BrowserTab(socket, uploads, self.forks, self.opening)
        try:
            await socket.send_text(self.opening.message(name))
            await tab.run()
        finally:
            del self.open[name]
            shutil.rmtree(uploads.folder, ignore_errors=True)
