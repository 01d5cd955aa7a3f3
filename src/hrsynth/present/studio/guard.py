"""Access to the server: only from the page that it served itself.

Other pages in the same browser can send requests here too, under a name of their own for this machine, or from a
foreign origin; other users of this machine can connect. So each request must have exactly one Host of a list, begin its
path with the secret of this run and, where it opens a socket or sends something, have the page's own Origin just once.
"""

from __future__ import annotations

import hmac
import secrets
from http import HTTPStatus
from typing import Any

HOST = "127.0.0.1"
NAMES = (HOST, "localhost", "[::1]")
"""What a browser on this machine may call it."""
HTTP_PORT = 80
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' {}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "x-frame-options": "DENY",
    "connection": "close",
}


class Guard:
    """An application behind the rules above: what does not keep them is answered 403, what has another path 404, both
    without a body."""

    def __init__(self, app: Any, port: int) -> None:
        self.app, self.secret = app, secrets.token_urlsafe(32)
        self.once: set[str] = set()
        plain = NAMES if port == HTTP_PORT else ()
        self.hosts = frozenset(name.encode() for name in (*plain, *(f"{name}:{port}" for name in NAMES)))

    def door(self) -> str:
        """A path that leads to the page once: what is on a browser's command line can be read by other users."""
        path = secrets.token_urlsafe(32)
        self.once.add(path)
        return path

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer a request, or open a socket."""
        host = get_single_header(scope, b"host")
        if host not in self.hosts or not self._is_own_request(scope, host):
            await refuse(scope, send, HTTPStatus.FORBIDDEN)
            return
        first, slash, rest = scope["raw_path"].decode("ascii").removeprefix("/").partition("/")
        if scope["type"] == "http" and scope["method"] == "GET" and first in self.once and not rest:
            self.once.discard(first)
            await refuse(scope, send, HTTPStatus.SEE_OTHER, {"location": f"/{self.secret}/"})
        elif not hmac.compare_digest(first, self.secret):
            await refuse(scope, send, HTTPStatus.NOT_FOUND)
        elif not slash:
            await refuse(scope, send, HTTPStatus.SEE_OTHER, {"location": f"/{self.secret}/"})
        else:
            headers = HEADERS | {"content-security-policy": POLICY.format(f"ws://{host.decode()}")}

            async def sent(message: Any) -> None:
                if message["type"] == "http.response.start":
                    message["headers"] = [*message["headers"], *encode_headers(headers)]
                await send(message)

            await self.app({**scope, "path": f"/{rest}", "raw_path": f"/{rest}".encode()}, receive, sent)

    def _is_own_request(self, scope: Any, host: bytes) -> bool:
        """Return True if a request comes from the page, or opens it."""
        if scope["type"] == "http" and scope["method"] in ("GET", "HEAD"):
            return not list_header_values(scope, b"origin") or get_single_header(scope, b"origin") == b"http://" + host
        return get_single_header(scope, b"origin") == b"http://" + host


def list_header_values(scope: Any, name: bytes) -> list[bytes]:
    """Return the values of all occurrences of a header."""
    return [value.strip() for key, value in scope["headers"] if key.lower() == name]


def get_single_header(scope: Any, name: bytes) -> bytes:
    """Return the value of a header that occurs once, else nothing."""
    found = list_header_values(scope, name)
    return found[0] if len(found) == 1 else b""


def encode_headers(headers: dict[str, str]) -> list[tuple[bytes, bytes]]:
    """Headers as they are sent."""
    return [(name.encode(), value.encode()) for name, value in headers.items()]


async def refuse(scope: Any, send: Any, status: HTTPStatus, headers: dict[str, str] | None = None) -> None:
    """Answer with a status alone."""
    kind = "http" if scope["type"] == "http" else "websocket.http"
    told = {"content-length": "0", "connection": "close", **(headers or {})}
    await send({"type": f"{kind}.response.start", "status": int(status), "headers": encode_headers(told)})
    await send({"type": f"{kind}.response.body", "body": b""})
