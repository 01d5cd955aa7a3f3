"""``python -m hrsynth.families [FOLDER]``: write every shipped robot to FOLDER (default ``robots``)."""

from __future__ import annotations

import sys
from pathlib import Path

from .. import description
from .table import ROBOTS


def main(folder: str = "robots") -> None:
    """Writes NAME.urdf for every robot of the table."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for robot in ROBOTS:
        description.save(robot.make(), target / f"{robot.name}.urdf")


if __name__ == "__main__":
    main(*sys.argv[1:2])
