"""Server of the page, on this machine only. It reads no robot but to check options of the command line at its start: it
serves its own files and passes requests on."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import tempfile
import threading
import time
import webbrowser
from collections.abc import Iterable, Mapping
from dataclasses import replace
from http import HTTPStatus
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import BadRequest, FileTooLarge, HrsynthError, MissingExtra
from ...processes import require_posix
from ...results import with_spelling
from ...tolerances import SENDER_TIMEOUT_S
from .. import palette
from .guard import HOST, Guard
from .processes import DESK, ForkServer
from .tabs import StartupState, Tabs

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from uvicorn import Server

    from ...mechanism import Mechanism
    from ..view.view import View

STUDIO_CONNECTIONS_MAX = 100
"""Largest number of connections to the server."""
LARGEST_ASK = 256 * 1024
"""Largest message of the page (bytes)."""
SERVER_CLOSE_TIMEOUT_S = 2.0
"""Time that open connections have when the server ends (s)."""

PAGE = Path(__file__).parent / "page"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Files of the page's folder that are served."""
MAIN = "studio.html"
WRITTEN = {"palette.css": palette.format_css, "palette.js": palette.format_js}
"""Generated files of the page."""


@with_spelling
def studio(
    robot: str | Path | Mechanism | None = None,
    observe: Iterable[str | int] | str | None = None,
    camera: str | None = None,
    *,
    port: int = 0,
    open_: bool = True,
) -> StudioServer:
    """Serve the studio on this machine and open it in the browser.

    Parameters
    ----------
    robot
        Robot, folder of robots, or None for the gallery.
    observe
        Observed legs, by default those of the file.
    camera
        Link that carries the camera, by default the base.
    port
        Port of the server; 0 for any free port.
    open_
        Open the browser.

    Returns
    -------
    StudioServer
        Server with ``address`` and ``stop()``; it also ends with this process.

    Raises
    ------
    BadRequest
        If the robot is unknown or the port is not available.
    BadRobotFile
        If the file is missing or not a robot file.
    MissingExtra
        If the extra ``studio`` is not installed.

    Examples
    --------
    >>> server = hrsynth.studio("3rrr_m1", open_=False)
    >>> server.stop()
    """
    return start_studio(robot, observe, camera, {}, port, open_)


def start_studio(
    robot: str | Path | Mechanism | None,
    observe: Iterable[str | int] | str | None,
    camera: str | None,
    overrides: dict[str, Any],
    port: int,
    open_: bool,
) -> StudioServer:
    """Serve the studio as :func:`studio`, of a file with ``overrides`` as on the command line."""
    from ...description import find_robot_file, load
    from ...description.overrides import parse_names
    from ...description.reading import open_robot_file
    from ...mechanism import Mechanism

    watched = parse_names(observe if observe is None or isinstance(observe, str) else map(str, observe))
    first = {"camera": camera, "watch": None if watched in (None, ("all",)) else list(watched)}
    options = _list_overrides(overrides)
    if options and (robot is None or os.path.isdir(str(robot))):
        raise BadRequest("options of a robot file without a file", list(options), remedy="Name the file.")
    if options and not isinstance(robot, Mechanism):
        read = load(robot, **options)
        robot = read if "/" in options.get("keyframe", "") else robot  # the page names no other files
    if robot is None:
        here = StartupState()
    elif isinstance(robot, Mechanism):
        given = _describe_source(robot)
        here = StartupState(given=given, mechanism=robot if given is None else None, first=first)
    elif os.path.isdir(robot):
        here = StartupState(folder=Path(robot))
    else:
        if not options:
            open_robot_file(find_robot_file(robot))
        here = StartupState(given={"robot": str(robot), "options": options}, first=first)
    server = StudioServer(here, port)
    if open_:
        server.show()
    return server


def serve_view(found: View, port: int = 0, open_: bool = True, source: dict[str, Any] | None = None) -> StudioServer:
    """Serve the page of a view, without panels; ``source``: the robot and its options on the command line. Raises as
    :func:`studio`."""
    if not all(seen.is_segment_direction for seen in found.setup.observed):
        raise BadRequest(
            "--sensor: a served view shows directions of segments only",
            ", ".join(found.setup.labels),
            remedy="Write a page with --static view.html or View.save.",
        )
    robot = found.setup.robot
    if source is None or "/" in (source["keyframe"] or ""):  # the page names no files
        given = _describe_source(robot)
    else:
        given = {"robot": source["robot"], "options": _list_overrides(source)}
    first = {
        "watch": [seen.link for seen in found.setup.observed],
        "camera": found.setup.robot.camera,
        "hidden": found.derivation is not None,
    }
    server = StudioServer(
        StartupState(given=given, mechanism=robot if given is None else None, first=first, panels=False), port
    )
    if open_:
        server.show()
    return server


def _list_overrides(source: Mapping[str, Any]) -> dict[str, Any]:
    """Return the overrides of a file that are given on the command line, as ``load`` takes them."""
    from ...description.overrides import parse_names

    lists = {name: parse_names(source.get(name) or None) for name in ("motors", "freeze")}
    return {
        name: value
        for name, value in {**source, **lists}.items()
        if name != "robot" and value not in (None, "", []) and value is not False
    }


def _describe_source(robot: Mechanism) -> dict[str, Any] | None:
    """Return a robot by its file, or by the name of a shipped one, if it equals that."""
    from ...description import list_robots, load

    if robot.file is None:
        return None
    known = {path.resolve(): name for name, path in list_robots().items()}
    name = known.get(Path(robot.file).resolve(), robot.file)
    try:
        read = load(name)
    except HrsynthError:
        return None
    return {"robot": name, "options": {}} if replace(robot, camera=read.camera) == read else None


def build_application(tabs: Tabs) -> Any:
    """Its paths below the secret: the page, its files, the socket of a tab, and what is dropped into one."""
    from starlette.applications import Starlette
    from starlette.responses import JSONResponse, Response
    from starlette.routing import Route, WebSocketRoute

    async def page(request: Request) -> Response:
        name = request.path_params.get("name", MAIN)
        known = {file.name: file for file in PAGE.iterdir() if file.suffix in TYPES and not file.is_symlink()}
        if name not in known and name not in WRITTEN:
            return Response(status_code=HTTPStatus.NOT_FOUND)
        content = WRITTEN[name]() if name in WRITTEN else known[name].read_bytes()
        return Response(content, media_type=TYPES[Path(name).suffix])

    async def upload(request: Request) -> Response:
        tab, name = tabs.open.get(request.query_params.get("tab", "")), request.query_params.get("name", "")
        if tab is None:
            return Response(status_code=HTTPStatus.NOT_FOUND)
        try:
            tab.uploads.require(name, request.headers.get("content-length"))
            await tab.uploads.receive(name, request.stream())
        except BadRequest as error:
            status = HTTPStatus.REQUEST_ENTITY_TOO_LARGE if isinstance(error, FileTooLarge) else HTTPStatus.BAD_REQUEST
            return JSONResponse({"error": str(error), "kind": type(error).__name__}, status)
        except TimeoutError:
            return Response(status_code=HTTPStatus.REQUEST_TIMEOUT)
        return JSONResponse({"file": name})

    return Starlette(
        routes=[
            Route("/", page),
            Route("/{name}", page, methods=["GET"]),
            Route("/upload", upload, methods=["POST"]),
            WebSocketRoute("/live", tabs.serve),
        ]
    )


class StudioServer:
    """A server in a thread of its own: the ``address`` of its page, and ``stop()``.

    Raises ``BadRequest`` for a port that cannot be had (0: any that is free), ``MissingExtra``.
    """

    def __init__(self, opening: StartupState, port: int = 0, *, desk: str = DESK) -> None:
        require_libraries()
        listener = bound(port)
        self.forks = ForkServer(desk)  # while modules are loaded there, the server's are loaded here
        try:
            self.server, self.guard, self.folder = make_server(opening, listener.getsockname()[1], self.forks)
        except BaseException:
            listener.close()
            self.forks.close()
            raise
        self.root = f"http://{HOST}:{listener.getsockname()[1]}/"
        self.address = f"{self.root}{self.guard.secret}/"
        self.thread = threading.Thread(target=self._run, args=(listener,), daemon=True)
        self.thread.start()
        while not self.server.started and self.thread.is_alive():
            time.sleep(0.005)

    def _run(self, listener: socket.socket) -> None:
        with self.folder, contextlib.suppress(SystemExit):
            try:
                asyncio.run(self.server.serve([listener]))
            finally:
                self.forks.close()

    def show(self) -> None:
        """Open the page in the browser."""
        threading.Thread(target=webbrowser.open, args=(self.root + self.guard.door() + "/",), daemon=True).start()

    def wait(self) -> None:
        """Wait until it ends."""
        self.thread.join()

    def stop(self) -> None:
        """End it, with all its processes and what was dropped into its page."""
        self.server.should_exit = True
        self.thread.join()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.address}>"


def require_libraries() -> None:
    """Raise ``NeedsPosix`` or ``MissingExtra`` where what serves the page is not there."""
    require_posix("the studio", "fcntl", "resource")
    if None in map(find_spec, ("h11", "starlette", "uvicorn", "websockets")):
        raise MissingExtra("serving a page", "studio")


def make_server(
    opening: StartupState, port: int, forks: ForkServer
) -> tuple[Server, Guard, tempfile.TemporaryDirectory[str]]:
    """The server, not started, who guards it, and the folder of what is dropped into its pages."""
    import h11
    import uvicorn
    from uvicorn.protocols.http.h11_impl import H11Protocol
    from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

    class PatientProtocol(H11Protocol):
        """A connection on which a request must come in time; each has one."""

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.patience = self.loop.call_later(SENDER_TIMEOUT_S, self._give_up)

        def _give_up(self) -> None:
            if self.conn.their_state is h11.IDLE:
                self.transport.close()

        def handle_websocket_upgrade(self, event: Any) -> None:
            self.patience.cancel()
            super().handle_websocket_upgrade(event)

        def connection_lost(self, exc: Exception | None) -> None:
            self.patience.cancel()
            super().connection_lost(exc)

    folder = tempfile.TemporaryDirectory(prefix="hrsynth-", ignore_cleanup_errors=True)
    tabs = Tabs(forks, opening.write(Path(folder.name)), Path(folder.name))
    guard = Guard(build_application(tabs), port)
    config = uvicorn.Config(
        guard,
        http=PatientProtocol,
        ws=WebSocketsSansIOProtocol,
        lifespan="off",
        loop="asyncio",
        log_config=None,
        log_level="debug" if os.environ.get("HRSYNTH_DEBUG") else "critical",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        limit_concurrency=STUDIO_CONNECTIONS_MAX,
        ws_max_size=LARGEST_ASK,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=int(SERVER_CLOSE_TIMEOUT_S),
    )
    return uvicorn.Server(config), guard, folder


def bound(port: int) -> socket.socket:
    """A socket at a port, which nobody else has; raises ``BadRequest`` for one that cannot be had."""
    listener = socket.socket()
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((HOST, port))
        listener.listen(STUDIO_CONNECTIONS_MAX)
    except (OSError, OverflowError) as error:
        listener.close()
        reason = getattr(error, "strerror", None) or "no such port"
        raise BadRequest(f"cannot serve the page: {reason}", port, "a free port, or 0 for any") from None
    return listener
