"""Robots of the package example-robot-data by name, ``example:cassie``: URDF and SDF files; nothing is imported."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

PREFIX = "example:"
PACKAGE = "example-robot-data"
FOLDER = f"cmeel.prefix/share/{PACKAGE}/robots"


def list_examples() -> dict[str, Path]:
    """List the robots of example-robot-data.

    Returns
    -------
    dict
        Name to file, sorted by name; files of one name get the folder's name before theirs.

    Examples
    --------
    >>> robots = hrsynth.list_examples()
    """
    from importlib.metadata import distribution

    folder = Path(str(distribution(PACKAGE).locate_file(FOLDER)))
    files = [path for ending in ("urdf", "sdf") for path in folder.glob(f"*/*/*.{ending}")]
    count = Counter(path.stem for path in files)
    named = {
        path.stem if count[path.stem] == 1 else f"{path.parts[-3].removesuffix('_description')}-{path.stem}": path
        for path in files
    }
    return dict(sorted(named.items()))
