"""``python -m hrsynth.families [FOLDER [NAME …]]``: write every shipped robot to FOLDER (default ``robots``), or those
robots, linkages and examples that are named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from .. import description
from ..errors import BadRequest
from ..mechanism import Mechanism
from .linkages import LINKAGES
from .planar import six_poses
from .table import ROBOTS


def main(folder: str = "robots", *names: str) -> None:
    """Writes NAME.urdf for every robot of the table, or for those that are named; raises ``BadRequest`` for a name that
    there is not."""
    shipped, target = {robot.name: robot.make for robot in ROBOTS}, Path(folder)
    makers: dict[str, Callable[[], Mechanism]] = {
        **shipped, **{name: partial(_linkage, name) for name in LINKAGES}, "six_poses": six_poses}
    for name in names:
        if name not in makers:
            raise BadRequest("a robot to write", name, sorted(makers))
    target.mkdir(parents=True, exist_ok=True)
    for name in names or shipped:
        description.save(makers[name](), target / f"{name}.urdf")


def _linkage(name: str) -> Mechanism:
    return LINKAGES[name]().mechanism(name)


if __name__ == "__main__":
    main(*sys.argv[1:])
