"""The studio's server from outside: requests written by hand, sockets of the page."""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from hrsynth.present.studio.server import StudioServer

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection


def port_of(server: StudioServer) -> int:
    return int(server.root.rstrip("/").rpartition(":")[2])


def origin_of(server: StudioServer) -> str:
    return server.root.rstrip("/")


def said(server: StudioServer, lines: list[str], body: bytes = b"") -> bytes:
    """What is answered to a request; PORT and SECRET are filled in."""
    text = "\r\n".join(lines).replace("PORT", str(port_of(server))).replace("SECRET", server.guard.secret)
    with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as line:
        line.sendall(text.encode("latin-1") + b"\r\n\r\n" + body)
        line.shutdown(socket.SHUT_WR)
        return read_all(line)


def read_all(line: socket.socket) -> bytes:
    """All that comes until the other end closes, in whatever way."""
    found = b""
    try:
        while part := line.recv(65536):
            found += part
    except ConnectionResetError:
        pass
    return found


def status_of(answer: bytes) -> int:
    """The status of an answer; 0 where there is none."""
    return int(answer.split()[1]) if answer.startswith(b"HTTP/") else 0


def body_of(answer: bytes) -> bytes:
    return answer.partition(b"\r\n\r\n")[2]


class Page:
    """What the page does."""

    def __init__(self, line: ClientConnection) -> None:
        self.line, self.number = line, 0
        self.start = json.loads(line.recv(timeout=20))

    def send(self, kind: str, **fields: Any) -> int:
        self.number += 1
        self.line.send(json.dumps({"n": self.number, "ask": kind, **fields}))
        return self.number

    def heard(self) -> dict[str, Any]:
        return json.loads(self.line.recv(timeout=30))

    def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        number = self.send(kind, **fields)
        answer = self.heard()
        assert answer["n"] == number, answer
        return answer


@contextmanager
def opened(server: StudioServer, origin: str | None = "") -> Iterator[Page]:
    """A tab, of the page itself or of another one."""
    from websockets.sync.client import connect

    address, own = server.address.replace("http://", "ws://") + "live", origin_of(server) if origin == "" else origin
    with connect(address, origin=own, proxy=None, max_size=None) as line:  # type: ignore[arg-type]
        yield Page(line)


def posted(server: StudioServer, tab: str, name: str, body: bytes, *headers: str) -> bytes:
    """What is answered to a file that is dropped in."""
    sizes = (
        []
        if any(each.lower().startswith(("content-length", "transfer-enc")) for each in headers)
        else [f"Content-Length: {len(body)}"]
    )
    return said(
        server,
        [
            f"POST /SECRET/upload?tab={tab}&name={name} HTTP/1.1",
            "Host: 127.0.0.1:PORT",
            "Origin: http://127.0.0.1:PORT",
            *sizes,
            *headers,
        ],
        body,
    )


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def soon(what: Callable[[], bool], seconds: float = 10.0) -> bool:
    """Whether something comes true in time."""
    end = time.monotonic() + seconds
    while not what():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True
