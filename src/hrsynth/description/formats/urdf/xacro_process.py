"""Run as a program: expand the xacro file that is named, to standard output; no files are written, none read elsewhere.

``$(find PACKAGE)`` stands for the folder, the file's own or one above it, that has what follows.
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path

MEMORY = 900_000_000
SECONDS = 4
LEVELS = 4
"""Folders above the file in which a package's files are looked for."""
MARK = "/find:package"


def located(spec: str, folder: Path) -> str:
    """The file that an include names; raises ``ValueError`` for what lies outside of the folder (of the package)."""
    if MARK in spec:
        rest = Path(spec.split(MARK)[-1].lstrip("/"))
        if ".." in rest.parts:
            raise ValueError(f"{rest} leaves the package")
        for home in (folder, *list(folder.parents)[:LEVELS]):
            for start in range(len(rest.parts)):
                candidate = home.joinpath(*rest.parts[start:])
                if candidate.is_file():
                    return str(candidate)
        raise ValueError(f"no folder above the file has {rest}")
    path = Path(spec) if Path(spec).is_absolute() else folder / spec
    if not path.resolve().is_relative_to(folder):
        raise ValueError(f"{spec} lies outside of the file's folder")
    return str(path)


def main(name: str) -> None:
    """Expand one file under limits of time, memory and writing."""
    for limit, amount in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, SECONDS)):
        resource.setrlimit(limit, (amount, amount))
    import xacro
    from xacro import substitution_args

    folder = Path(name).resolve().parent
    substitution_args._eval_find = lambda package: MARK
    substitution_args._eval_env = lambda variable: ""
    xacro.abs_filename_spec = lambda spec: located(spec, folder)
    sys.stdout.write(xacro.process_file(name).toxml())


if __name__ == "__main__":
    main(sys.argv[1])
