"""A grid of checked poses → a picture or a table."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from ..analysis.check import MEASURES, Check, GridCheck
from ..description.files import require_folder, write_whole
from ..errors import BadRequest
from ..mechanism.pose import PARTS
from .plots import distance_map

FORMATS = (".png", ".csv")


def writable(path: str, grid: str | None) -> None:
    """Raise ``BadRequest`` where there is nothing to write, or the ending of the name is no format."""
    if grid is None:
        raise BadRequest("only a grid of poses is written", path, "--output together with --grid")
    if Path(path).suffix.lower() not in FORMATS:
        raise BadRequest("cannot write the grid: unknown ending", path, FORMATS)
    require_folder(path)


def write(found: Check, path: str) -> None:
    """Write the grid of a check, whole or not at all; raises ``BadRequest``."""
    assert found.grid is not None
    write_whole(path, distance_map(found) if Path(path).suffix.lower() == ".png" else table(found.grid).encode())


def table(grid: GridCheck) -> str:
    """Comma-separated values: a line a pose (metres, radians), its state, and what was measured there."""
    stream = io.StringIO()
    given = [name for name in PARTS if grid.grid.poses()[0].given.get(name)]
    lines = csv.writer(stream, lineterminator="\n")
    lines.writerow([*given, "state", *MEASURES])
    columns = [grid.values(measure) for measure in MEASURES]
    for i, (pose, state) in enumerate(zip(grid.grid.poses(), grid.states, strict=True)):
        values = ["/".join(map(repr, pose.given[name])) for name in given]
        lines.writerow([*values, state, *("" if column[i] is None else repr(column[i]) for column in columns)])
    return stream.getvalue()
