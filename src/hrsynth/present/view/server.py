"""The view with a server behind it, on this machine alone: any sliders together, the loops solved at every move.

Other pages in the same browser can send requests here too, under a name of their own for this machine or from a foreign
origin: what does not come from the page itself is answered 403.
"""

from __future__ import annotations

import contextlib
import json
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass, field
from http import HTTPStatus
from http.client import HTTP_PORT
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock, Thread
from typing import Any

import numpy as np

from ...errors import BadRequest
from ...tolerances import SLIDER_ARRIVED
from .mode_outlines import mode_outlines
from .page import page
from .states import Posed
from .view import View

HOST = "127.0.0.1"
NAMES = (HOST, "localhost", "[::1]")
"""What a browser on this machine may call it."""
QUESTION_BYTES = 10_000
"""Bytes of a question at most."""
PATIENCE = 10.0
"""Seconds that a question may pause while it is sent."""


@dataclass(eq=False)
class Session:
    """A view and where its robot is now; it answers one question at a time."""

    found: View
    here: Posed = field(init=False)
    lock: Lock = field(default_factory=Lock)

    def __post_init__(self) -> None:
        self.here = self.found.mover.home

    def answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        """The state at the coordinates ``values``, or as near as the robot comes (``stopped``), or at ``home``; with
        ``modes`` the other assembly modes there. Raises ``ValueError`` for what is no such question."""
        mover = self.found.mover
        wanted = np.array(asked["values"], dtype=float)
        if wanted.shape != mover.coordinates.values.shape or not np.isfinite(wanted).all() or mover.far(wanted):
            raise ValueError("values")
        with self.lock:
            if asked.get("home"):
                self.here, reached = mover.home, wanted
            else:
                self.here, reached = mover.sent(self.here, wanted)
            reply: dict[str, Any] = {"state": mover.shown(self.here).scene(),
                                     "stopped": bool(np.max(np.abs(reached - wanted), initial=0.0) > SLIDER_ARRIVED)}
            if asked.get("modes") and self.found.mode_outlines:
                others, _ = mode_outlines(self.found.setting, self.here.real)
                reply["ghosts"] = [outline.scene() for outline in others]
        return reply


class Server(ThreadingHTTPServer):
    """The page at the root, and answers to its questions."""

    daemon_threads = True

    def __init__(self, found: View, port: int) -> None:
        self.session, self.shown = Session(found), page(found, live=True).encode()
        super().__init__((HOST, port), Handler)
        plain = NAMES if self.server_port == HTTP_PORT else ()
        hosts = {*plain, *(f"{name}:{self.server_port}" for name in NAMES)}
        self.hosts, self.origins = frozenset(hosts), frozenset(f"http://{host}" for host in hosts)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Nothing: a question that breaks off has no answer, and the library never prints."""


class Handler(BaseHTTPRequestHandler):
    """One question to a :class:`Server`."""

    server: Server
    timeout = PATIENCE

    def parse_request(self) -> bool:
        """Whether there is a question, and it comes from the page or opens it; else it is answered here."""
        if not super().parse_request():
            return False
        trusted = self._only("Host") in self.server.hosts
        if self.command != "GET":
            trusted = trusted and self._only("Origin") in self.server.origins
        if not trusted:
            self._reply(HTTPStatus.FORBIDDEN)
        return trusted

    def _only(self, name: str) -> str | None:
        """The value of a header that is given once."""
        found = self.headers.get_all(name, [])
        return found[0].strip() if len(found) == 1 else None

    def do_GET(self) -> None:
        """The page, and nothing else."""
        if self.path == "/":
            self._reply(HTTPStatus.OK, self.server.shown, "text/html; charset=utf-8")
        else:
            self._reply(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """A question of the page's sliders."""
        try:
            size = self._only("Content-Length") or ""
            if self.path != "/pose" or not (size.isascii() and size.isdecimal()) or int(size) > QUESTION_BYTES:
                raise ValueError(self.path)
            answer = self.server.session.answer(json.loads(self.rfile.read(int(size))))
        except (ValueError, KeyError, TypeError, AttributeError):
            self._reply(HTTPStatus.BAD_REQUEST)
        else:
            self._reply(HTTPStatus.OK, json.dumps(answer).encode(), "application/json")

    def _reply(self, status: HTTPStatus, body: bytes = b"", kind: str = "text/plain") -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing: the library never prints."""


class BackgroundServer:
    """A view that is served while other things are done: its ``address``, and how it ends."""

    def __init__(self, server: Server) -> None:
        self.server, self.address = server, address_of(server)
        Thread(target=server.serve_forever, daemon=True).start()

    def stop(self) -> None:
        """End it."""
        self.server.shutdown()
        self.server.server_close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.address}>"


def served(found: View, port: int, open_: bool) -> BackgroundServer:
    """Answer until ``stop()`` or the end of the process; ``open_`` opens the page in the browser. Raises as
    :func:`serve`."""
    here = BackgroundServer(bound(found, port))
    if open_:
        Thread(target=webbrowser.open, args=(here.address,), daemon=True).start()
    return here


def bound(found: View, port: int) -> Server:
    """A server at a port, any that is free for 0; raises ``BadRequest`` for one that cannot be had."""
    try:
        return Server(found, port)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or "no such port"
        raise BadRequest(f"cannot serve the view: {reason}", port, "a free port, or 0 for any") from None


def address_of(server: Server) -> str:
    """Where its page is."""
    return f"http://{HOST}:{server.server_port}/"


def serve(found: View, port: int, ready: Callable[[Server, str], None]) -> None:
    """Answer until an interrupt or the server's ``shutdown``; ``ready`` is told the server and its address once the
    page can be opened. Port 0 is any that is free.

    Raises ``BadRequest`` for a port that cannot be had.
    """
    with bound(found, port) as server, contextlib.suppress(KeyboardInterrupt):
        ready(server, address_of(server))
        server.serve_forever()
