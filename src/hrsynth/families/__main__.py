"""``python -m hrsynth.families [FOLDER [NAME …]]``: write every shipped robot to FOLDER (default ``robots``), or those
robots, linkages and examples that are named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from .. import description
from ..errors import BadRequest, HrsynthError
from ..mechanism import Mechanism
from .linkages import LINKAGES
from .planar import six_poses
from .table import ROBOTS


def main(folder: str = "robots", *names: str) -> list[Path]:
    """Writes NAME.urdf for every robot of the table, or for those that are named; the files. Raises ``BadRequest`` for
    a name that there is not."""
    shipped, target = {robot.name: robot.make for robot in ROBOTS}, Path(folder)
    makers: dict[str, Callable[[], Mechanism]] = {
        **shipped,
        **{name: partial(_build_linkage, name) for name in LINKAGES},
        "six_poses": six_poses,
    }
    if folder.startswith("-"):
        raise BadRequest("an option", folder, "none: python -m hrsynth.families [FOLDER [NAME …]]")
    for name in names:
        if name not in makers:
            raise BadRequest("a robot to write", name, sorted(makers))
    target.mkdir(parents=True, exist_ok=True)
    files = [target / f"{name}.urdf" for name in names or shipped]
    for file in files:
        description.save(makers[file.stem](), file)
    return files


def _build_linkage(name: str) -> Mechanism:
    return LINKAGES[name]().mechanism(name)


if __name__ == "__main__":
    try:
        print(*(f"The robot {file.stem} is written to {file}." for file in main(*sys.argv[1:])), sep="\n")
    except HrsynthError as error:
        print(f"hrsynth: {error}", file=sys.stderr)
        sys.exit(2)
