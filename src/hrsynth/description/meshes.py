"""Mesh files of a robot: located, copied to a new place, read as triangles.

Their names are paths from the folder of the robot's own file, or addresses (``package://…``); a mesh that lies in a USD
file is ``FILE#PRIM``.
"""

from __future__ import annotations

import io
import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadRequest, HrsynthError
from ..geometry.vectors import Array
from ..mechanism.model import Mechanism, Note
from ..tolerances import MESH_SECONDS, ROBOT_FILE_MAX_BYTES
from ..untrusted import run_program
from . import xml
from .formats.urdf.xacro_process import has_manifest, list_installed_packages
from .jointgraph import join_names

MESH_FILES_MAX = 2000
"""Largest number of mesh files copied with a robot."""
MESH_FILES_MAX_BYTES = 500_000_000
"""Largest total size of these mesh files (bytes)."""

KNOWN = (".stl", ".obj", ".dae", ".ply", ".off", ".msh", ".glb", ".gltf", ".3mf", ".wrl", ".usd", ".usda", ".usdc")
"""Extensions of meshes: no other file is read or copied."""
PROCESS = Path(__file__).with_name("mesh_process.py")


def locate_mesh(name: str, folder: Path) -> Path | None:
    """Return the file of a mesh's address: next to the robot file, of a package in a folder above it, or of one that is
    installed; None if it does not exist, or lies outside of the robot's folders and that package, links followed."""
    for path in _list_candidates(name, folder):
        if _is_in_robot_folders(path.resolve(), folder.resolve()):
            return path
    package, _, rest = name.removeprefix("package://").partition("/")
    for home in list_installed_packages(package) if name.startswith("package://") else ():
        if (home / rest).is_file() and (home / rest).resolve().is_relative_to(home.resolve()):
            return home / rest
    return None


def _is_in_robot_folders(path: Path, folder: Path) -> bool:
    """Return True if a file lies in the folders of a robot: its package (the nearest folder with a manifest) and
    packages next to it; without one the folder above that of the robot's file, or only that if the one above is the
    user's or holds everything."""
    package = next((each for each in (folder, *folder.parents) if has_manifest(each)), None)
    if package is None:
        home = Path.home().resolve()
        wide = folder.parent in (Path(folder.anchor), home, home.parent)
        return path.is_relative_to(folder if wide else folder.parent)
    if path.is_relative_to(package) or not path.is_relative_to(package.parent):
        return path.is_relative_to(package)
    return has_manifest(package.parent / path.relative_to(package.parent).parts[0])


def _list_candidates(name: str, folder: Path) -> Iterator[Path]:
    """Yield the files that an address may refer to."""
    scheme, _, rest = name.partition("://")
    try:
        paths = [folder / name] if not rest else [Path(rest)] if scheme == "file" else []
        if scheme in ("package", "model") and (rest := rest.lstrip("/")):
            paths = [
                path
                for parent in (folder, *folder.resolve().parents)
                for path in (parent / rest, parent / Path(*Path(rest).parts[1:]))
            ]
        yield from (path for path in paths if path.is_file())
    except (OSError, ValueError):
        return


def read_robot_meshes(
    names: Iterable[str], robot: str | None, within: Path | None = None
) -> dict[str, tuple[Array, Any] | None]:
    """The points (n, 3) and triangles (m, 3) of meshes that the file of a robot names; None for those that cannot be
    read. With ``within`` only files of that folder are read, also those that lie flat in it. Raises ``BadRequest`` for
    what unpacks to too much."""
    folder = Path(robot).parent if robot else Path()
    found: dict[str, tuple[Array, Any] | None] = dict.fromkeys(names)
    files: dict[str, tuple[str, str | None]] = {}
    for name in found:
        path = locate_mesh(name, folder)
        if within is not None:
            path = _find_in_folder(path or within / Path(name).name, within)
        if path is not None and path.suffix.lower() in KNOWN:
            files[name] = str(path.resolve()), None
    files |= {
        name: (f"{name}.obj", text)
        for name, text in _read_usd_meshes([name for name in found if name not in files], folder, within).items()
    }
    if not files:
        return found
    try:
        told = io.BytesIO(
            run_program(PROCESS, str(ROBOT_FILE_MAX_BYTES), seconds=MESH_SECONDS, given=json.dumps([*files.values()]))
        )
    except BadRequest as error:
        raise BadRequest(f"the robot's meshes: {error}") from None
    for name in files:
        if (counts := json.loads(told.readline())) is not None:
            points, faces = (
                np.frombuffer(told.read(24 * count), kind).reshape(-1, 3)
                for count, kind in zip(counts, (float, np.int64), strict=True)
            )
            found[name] = points, faces
    return found


def _find_in_folder(path: Path, within: Path) -> Path | None:
    """Return a file if it lies in a folder, links resolved, or else the one of its name there."""
    for each in (path, within / path.name):
        if each.is_file() and each.resolve().is_relative_to(within.resolve()):
            return each
    return None


def _read_usd_meshes(names: Iterable[str], folder: Path, within: Path | None = None) -> dict[str, str]:
    """Return the meshes that lie in USD files, as the text of ``.obj`` files."""
    asked: dict[Path, dict[str, str]] = {}
    for name in names:
        file, sign, prim = name.partition("#")
        path = locate_mesh(file, folder) if sign and locate_mesh(name, folder) is None else None
        if path is not None and within is not None:
            path = _find_in_folder(path, within)
        if path is not None:
            asked.setdefault(path, {})[name] = prim
    if not asked:
        return {}
    from .formats.usd.stage import read_usd_meshes

    found = read_usd_meshes({path: [*prims.values()] for path, prims in asked.items()})
    return {
        name: text
        for prims, texts in zip(asked.values(), found, strict=True)
        for name, text in zip(prims, texts, strict=True)
    }


def carry_meshes(
    robot: Mechanism, target: Path, endings: tuple[str, ...] | None, *, copy: bool
) -> tuple[Mechanism, dict[Path, Callable[[], bytes]], list[Note]]:
    """A robot whose meshes are named from the folder of ``target``; what has to be written there for it (``copy``: all
    meshes, into ``meshes/``); and notes.

    A format that can name only files with certain extensions (``endings``) gets no others, nor names of missing files.
    """
    if robot.file is None or not any("<mesh" in fragment for link in robot.links.values() for fragment in link.xml):
        return replace(robot, file=str(target)), {}, []
    source, folder = Path(robot.file), target.parent
    source = source if source.is_dir() else source.parent
    moved: dict[str, str | None] = {}
    files: dict[Path, Callable[[], bytes]] = {}
    missing, outside, foreign, inside, strange, drawn = (list[str]() for _ in range(6))
    copied: dict[tuple[Path, str], str] = {}
    stems: Counter[str] = Counter()
    texts = cache(lambda: _read_usd_meshes(drawn, source))

    def place(name: str) -> str | None:
        """Return the name of a mesh in the new file; None if it is left out."""
        path, (file, sign, prim) = locate_mesh(name, source), name.partition("#")
        inner = locate_mesh(file, source) if path is None and sign else None
        if path is None and inner is None:
            (outside if any(_list_candidates(name, source)) else missing).append(name)
            return name if endings is None else None
        ending = ".obj" if path is None else path.suffix.lower()
        if endings is not None and (ending not in endings or (inner is not None and not copy) or _is_text(path)):
            foreign.append(name)
            return None
        if copy and ending not in KNOWN:
            strange.append(name)
        elif copy:
            one = (path or inner or source).resolve(), "" if path is not None else prim
            if one in copied:
                return copied[one]
            if len(files) >= MESH_FILES_MAX:
                raise BadRequest(
                    f"{robot.name}: too many mesh files", f"more than {MESH_FILES_MAX}", f"up to {MESH_FILES_MAX}"
                )
            if path is not None and path.stat().st_size > MESH_FILES_MAX_BYTES:
                raise BadRequest("mesh too large, in bytes", path.stat().st_size, f"up to {MESH_FILES_MAX_BYTES}")
            stem = Path(prim).name if path is None else path.stem
            new = folder / "meshes" / f"{stem}{ending}"
            while new in files:
                stems[stem] += 1
                new = folder / "meshes" / f"{stem}_{stems[stem] + 1}{ending}"
            if path is None:
                drawn.append(name)
            files[new] = path.read_bytes if path is not None else lambda: texts()[name].encode()
            copied[one] = f"meshes/{new.name}"
            return copied[one]
        there = path if path is not None else inner
        if (
            locate_mesh(file, folder) is not None
            and there is not None
            and endings is None
            and os.path.samefile(str(locate_mesh(file, folder)), there)
        ):
            return name
        if inner is not None:
            inside.append(name)
        return os.path.relpath(str(there), folder) + (sign + prim if inner is not None else "")

    links = {}
    for title, link in robot.links.items():
        kept = []
        for fragment in link.xml:
            element = None if "<mesh" not in fragment else xml.parse_fragment(fragment)
            meshes = [] if element is None else [each for each in element.iter("mesh") if each.get("filename")]
            for each in meshes:
                name = str(each.get("filename"))
                if name not in moved:
                    moved[name] = place(name)
                each.set("filename", moved[name] or "")
            if not any(each.get("filename") == "" for each in meshes):
                kept.append(fragment if element is None else xml.format_canonical(element))
        links[title] = replace(link, xml=tuple(kept))
    notes = []
    for names, what in (
        (missing, "missing meshes" + (" are not written" if endings else "")),
        (outside, "meshes outside of the robot's folders keep their paths"),
        (foreign, f"meshes that are not binary {', '.join(endings or ())} files are not written"),
        (strange, "files without an extension of meshes are not copied"),
        (inside, "meshes lie in the USD file (--meshes copy writes them as files)"),
    ):
        if names:
            notes.append(Note("warning", f"{what}: {join_names(names, 4)}"))
    return replace(robot, links=links, file=str(target)), files, notes


def _is_text(path: Path | None) -> bool:
    """Return True if a file is an STL in text form."""
    if path is None or path.suffix.lower() != ".stl":
        return False
    with path.open("rb") as file:
        head = file.read(84)
    return head.startswith(b"solid") and path.stat().st_size != 84 + 50 * int.from_bytes(head[80:84], "little")


def write_meshes(files: dict[Path, Callable[[], bytes]]) -> list[Path]:
    """Write meshes and return the new ones. A file with other content is not replaced; all or none are written."""
    from .files import require_same, write_whole

    new: list[Path] = []
    size = 0
    try:
        for path, content in files.items():
            data = content()
            size += len(data)
            if size > MESH_FILES_MAX_BYTES:
                raise BadRequest("meshes too large, in bytes together", size, f"up to {MESH_FILES_MAX_BYTES}")
            require_same(path, data)
            if not path.exists():
                path.parent.mkdir(exist_ok=True)
                new.append(path)
                write_whole(path, data)
    except (OSError, HrsynthError) as error:
        remove_written(new)
        if isinstance(error, HrsynthError):
            raise
        raise BadRequest(f"cannot copy a mesh: {error.strerror}", str(error.filename)) from None
    return new


def remove_written(new: list[Path]) -> None:
    """Remove the files that :func:`write_meshes` wrote."""
    for path in new:
        path.unlink(missing_ok=True)
    for folder in {path.parent for path in new}:
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
