"""Command studio: start the server, print its address, stop it with Ctrl-C."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING, Any

from ..options import OBSERVATION, Option
from .colour import print_text
from .commands import Group, add_command
from .options import SOURCE, list_shipped_names, split_names

if TYPE_CHECKING:
    from ..present.studio.server import StudioServer

PORT = Option("port", "Port of the server (default: any free one).", None, int, 0, low=0, high=65535)


def studio(
    robot: str | None, observe: str | None, camera: str | None, port: int, browser: bool, **overrides: Any
) -> None:
    """Serve the page until Ctrl-C."""
    from ..present.studio.server import start_studio

    watched = None if observe is None else split_names(observe)
    serve(start_studio(robot, watched, camera, overrides, port, browser), "The studio")


def serve(server: StudioServer, what: str) -> None:
    """Print the address of the page, and wait until Ctrl-C or the end of the terminal; then stop the server."""

    def end(*_: Any) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup leaves it
                signal.signal(number, end)
    try:
        print_text(f"{what} is served at {server.address} (Ctrl-C ends it).")
        server.wait()
    except KeyboardInterrupt:
        pass
    finally:
        server.stop()


def add(app: Group) -> None:
    """Register the command."""
    add_command(
        app,
        "studio",
        "Open an interactive page in the browser: a robot, a folder of robots or dropped files, "
        "with hidden robot, modes, accuracy and runs.",
        (
            Option(
                "robot",
                "A robot file in any format, a shipped robot's name, example:NAME, or a folder.",
                "[ROBOT|FOLDER]",
                argument=True,
                words=list_shipped_names,
            ),
            Option("observe", "Legs to observe (1,4), links, or all (default: all).", "LEGS", group=OBSERVATION),
            Option("camera", "The link that carries the camera.", "LINK", group=OBSERVATION),
            PORT,
            Option("browser", "Open the page in the browser.", None, bool, True, ("--browser/--no-browser",)),
            *SOURCE[1:],
        ),
        studio,
        ("quattro --observe 1,4", "robots/ --port 8000 --no-browser"),
    )
