"""``python -m hrsynth.families [FOLDER [NAME …]]``: write every shipped robot to FOLDER (default ``robots``), or those
robots and linkages that are named."""

from __future__ import annotations

import sys
from pathlib import Path

from .. import description
from ..errors import BadRequest
from .linkages import LINKAGES
from .table import ROBOTS


def main(folder: str = "robots", *names: str) -> None:
    """Writes NAME.urdf for every robot of the table, or for the robots and linkages that are named; raises
    ``BadRequest`` for a name that there is not."""
    shipped, target = {robot.name: robot.make for robot in ROBOTS}, Path(folder)
    for name in names:
        if name not in shipped and name not in LINKAGES:
            raise BadRequest("a robot to write", name, sorted([*shipped, *LINKAGES]))
    target.mkdir(parents=True, exist_ok=True)
    for name in names or shipped:
        robot = shipped[name]() if name in shipped else LINKAGES[name]().mechanism(name)
        description.save(robot, target / f"{name}.urdf")


if __name__ == "__main__":
    main(*sys.argv[1:])
