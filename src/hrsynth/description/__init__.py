"""Robot files and mechanisms, both ways: one module a dialect."""

from __future__ import annotations

import contextlib
import difflib
import os
from importlib import resources
from pathlib import Path

from ..errors import BadRequest
from ..mechanism.model import Mechanism
from . import native
from .files import write_whole
from .tree import spanning

__all__ = ["load", "native", "save", "shipped", "spanning"]


def shipped() -> dict[str, Path]:
    """The robots that come with the package: name to file, sorted by name."""
    packaged = Path(str(resources.files("hrsynth").joinpath("robots")))
    folder = packaged if packaged.is_dir() else Path(__file__).parents[3] / "robots"
    return {path.stem: path for path in sorted(folder.glob("*.urdf"), key=lambda path: path.stem)}


def load(robot: str | Path) -> Mechanism:
    """The mechanism of a robot file, or of a shipped robot given by its name.

    Raises
    ------
    BadRequest
        For a name that is neither; with the shipped names closest to it.
    BadRobotFile, LoopsNotClosed
        For a file that is no assembled robot.
    """
    path = Path(robot)
    if isinstance(robot, str) and not path.suffix and len(path.parts) == 1:
        with contextlib.suppress(OSError, ValueError):
            if path.is_file():
                return native.read(path)
        robots = shipped()
        if robot in robots:
            return native.read(robots[robot])
        if not os.path.exists(robot):
            close = difflib.get_close_matches(robot, robots, n=5) or list(robots)
            raise BadRequest("neither a file nor a shipped robot", robot,
                             "a file, or a name that `hrsynth robots` lists, such as " + ", ".join(close))
    return native.read(path)


def save(mechanism: Mechanism, path: str | Path) -> None:
    """Write a robot file, whole or not at all.

    Raises
    ------
    BadRequest
        Where the file cannot be written, or the mechanism not be said in the native dialect.
    """
    write_whole(path, native.write(mechanism).encode())
