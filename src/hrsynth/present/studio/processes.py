"""Server side of the worker processes: their creation, and the queue of requests of each."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any

from ...tolerances import LARGEST_ANSWER

STUDIO_WAITING_REQUESTS_MAX = 64
"""Largest number of waiting requests of a tab."""
WORKER_START_TIMEOUT_S = 60.0
"""Time limit for the start of a process (s)."""

DESK = "hrsynth.present.studio.analysis_service:AnalysisService"
"""Class that answers."""
START = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from {} import main; main(int(sys.argv[2]), sys.argv[3])"
)
FRAME_LENGTH_BYTES = 4
"""Bytes of a frame's length."""


class ForkServer:
    """A process with all modules loaded, from which others are forked quickly; it starts when this is made."""

    def __init__(self, desk: str = DESK) -> None:
        self.desk, self.lock, self.closed = desk, Lock(), False
        self._start()

    def _start(self) -> None:
        self.control, other = socket.socketpair()
        quiet = None if os.environ.get("HRSYNTH_DEBUG") else subprocess.DEVNULL
        with other:
            self.process = subprocess.Popen(
                [
                    sys.executable,
                    "-I",
                    "-c",
                    START.format(f"{__package__}.worker"),
                    json.dumps(sys.path),
                    str(other.fileno()),
                    self.desk,
                ],
                stdin=subprocess.DEVNULL,
                stdout=quiet,
                stderr=quiet,
                pass_fds=[other.fileno()],
                start_new_session=True,
            )

    def channel(self) -> socket.socket:
        """The near end of the channel to a new child; closing it kills the child. Raises ``OSError``."""
        near, far = socket.socketpair()
        with far:
            try:
                with self.lock:
                    if self.closed:
                        raise ConnectionError("closed")
                    if self.process.poll() is not None:
                        self.control.close()
                        self._start()
                    socket.send_fds(self.control, [b"+"], [far.fileno()])
            except OSError:
                near.close()
                raise
        near.setblocking(False)
        return near

    def close(self) -> None:
        """End it and all its children."""
        with self.lock:
            self.closed = True
            self.control.close()
        try:
            self.process.wait(1.0)
        except subprocess.TimeoutExpired:  # still loading modules, without children
            self.process.kill()
            self.process.wait()


@dataclass
class WorkerProcess:
    """One process of a tab, and the requests that wait for it: one is answered at a time, in order.

    A request that takes longer than ``seconds`` or is cancelled ends the process; the next one starts a new process.
    Requests are complete, so nothing is lost with it.
    """

    forks: ForkServer
    setup: bytes
    seconds: float
    send: Callable[[str], Awaitable[None]]
    waiting: deque[tuple[int, bytes]] = field(default_factory=deque)
    current: tuple[int, asyncio.Task[str]] | None = None
    streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
    more: asyncio.Event = field(default_factory=asyncio.Event)

    def ask(self, number: int, text: bytes) -> bool:
        """Append a request to the queue; return False if it is full."""
        if len(self.waiting) >= STUDIO_WAITING_REQUESTS_MAX:
            return False
        self.waiting.append((number, text))
        self.more.set()
        return True

    def cancel(self, number: int) -> bool:
        """Cancel a request; return True if it was waiting. One under way is reported when its process has ended."""
        if self.current is not None and self.current[0] == number:
            self.current[1].cancel()
        kept = [each for each in self.waiting if each[0] != number]
        found = len(kept) < len(self.waiting)
        self.waiting = deque(kept)
        return found

    async def run(self) -> None:
        """Answer until cancelled; the process ends with this."""
        try:
            with contextlib.suppress(OSError, EOFError, TimeoutError):
                await self._started()  # before the first request comes
            while True:
                while not self.waiting:
                    self.more.clear()
                    await self.more.wait()
                number, text = self.waiting.popleft()
                task = asyncio.create_task(self._answered(number, text))
                self.current = number, task
                try:
                    await asyncio.wait([task])
                finally:
                    self.current = None
                    task.cancel()
                await self.send(cancel_message(number) if task.cancelled() else task.result())
        finally:
            self._end()

    async def _answered(self, number: int, text: bytes) -> str:
        """Return the message that answers a request."""
        whole = False
        try:
            reader, writer = await self._started()
            writer.write(wrap_message(text))
            async with asyncio.timeout(self.seconds):
                await writer.drain()
                answer = await _frame(reader)
            whole = True
            return answer.decode()
        except TimeoutError:
            return format_gone(
                number, f"the analysis took longer than {self.seconds:g} seconds and was cancelled", "TooSlow"
            )
        except (OSError, EOFError):
            return format_gone(number, "the analysis process has ended: it may have run out of memory", "Ended")
        finally:
            if not whole:
                self._end()

    async def _started(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        """The process, made where there is none, ready to answer."""
        if self.streams is not None and self.streams[0].at_eof():  # it has ended meanwhile
            self._end()
        if self.streams is None:
            channel = await asyncio.to_thread(self.forks.channel)
            self.streams = reader, writer = await asyncio.open_unix_connection(sock=channel)
            writer.write(wrap_message(self.setup))
            try:
                async with asyncio.timeout(WORKER_START_TIMEOUT_S):
                    await _frame(reader)
            except BaseException:
                self._end()
                raise
        return self.streams

    def _end(self) -> None:
        if self.streams is not None:
            self.streams[1].transport.abort()
            self.streams = None


def wrap_message(text: bytes) -> bytes:
    """Return a frame, as the other side reads it."""
    return len(text).to_bytes(FRAME_LENGTH_BYTES, "big") + text


async def _frame(reader: asyncio.StreamReader) -> bytes:
    size = int.from_bytes(await reader.readexactly(FRAME_LENGTH_BYTES), "big")
    if size > 2 * LARGEST_ANSWER:
        raise EOFError(size)
    return await reader.readexactly(size)


def cancel_message(number: int) -> str:
    """Return the message of a cancelled request."""
    return format_gone(number, "cancelled", "Cancelled")


def format_gone(number: int | None, error: str, kind: str) -> str:
    """Return the message of a request without an answer."""
    message: dict[str, Any] = {"n": number, "error": error, "kind": kind}
    return json.dumps(message)
