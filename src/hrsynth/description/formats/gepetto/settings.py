"""YAML file next to a URDF: located, and read without trust."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from ....errors import BadRobotFile
from ... import xml
from ...file_format import RobotFile

MOST_BESIDE, LARGEST_BESIDE = 50, 3_000_000
"""Number of sibling files of a kind, and their total size (bytes), above which none is read."""

ENDINGS = (".yaml", ".yml")
KEYS = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")
NULL = ("", "~", "null")


def read_settings(path: Path) -> dict[str, Any] | None:
    """Return the lists of a YAML file, None if it has none of this format's keys. All scalars are read as text, types
    are ignored. Raises ``BadRobotFile``."""
    from ...yaml_file import read_yaml

    found = read_yaml(path)
    if not isinstance(found, dict) or not set(KEYS) & set(found):
        return None
    return {key: None if isinstance(value, str) and value in NULL else value for key, value in found.items()}


def find_settings(file: RobotFile) -> tuple[Path, dict[str, Any]] | None:
    """Return the YAML file of this format next to a URDF without loops, and its content: the one of the same name, else
    the only one of another name with closures between the URDF's links and joints. Raises ``BadRobotFile`` if there are
    several."""
    if file.root is None or file.tag != "robot" or file.has_child("loop"):
        return None
    own = file.path.with_suffix(".yaml").name
    for name in dict.fromkeys((own, *(("robot.yaml", "robot.yml") if file.path.stem == "robot" else ()))):
        beside = file.path.with_name(name)
        if beside != file.path and os.path.isfile(beside):
            found = read_settings(beside)
            if found is not None:
                return beside, found
    if file.has_child("hrsynth"):
        return None
    named = [
        (path, found)
        for path in list_folder_files(file.path, *ENDINGS)
        if (found := _read_closures(path)) is not None
        and collect_frame_names(found) <= {str(each.get("name")) for each in file.root.iter("link", "joint")}
    ]
    if len(named) > 1:
        raise xml.make_file_error(
            file.path,
            "several YAML files next to it close its loops",
            "one of them as the robot file",
            value=", ".join(path.name for path, _ in named),
        )
    return named[0] if named else None


def list_folder_files(path: Path, *endings: str) -> list[Path]:
    """Return the files with these extensions next to a file, in order; none if they are too many or too large."""
    try:
        found = sorted(each for each in path.parent.iterdir() if each.suffix.lower() in endings and each != path)
        small = len(found) <= MOST_BESIDE and sum(each.stat().st_size for each in found) <= LARGEST_BESIDE
    except OSError:
        return []
    return found if small else []


def find_urdf(settings: Path, frames: set[str], names_in: Callable[[Path], set[str]] | None = None) -> Path:
    """Return the URDF of the same name, ``robot.urdf``, or the only one that has the frames. Raises
    ``BadRobotFile``."""
    for name in (settings.with_suffix(".urdf").name, "robot.urdf"):
        if settings.with_name(name).is_file():
            return settings.with_name(name)
    others = [
        path for path in list_folder_files(settings, ".urdf") if frames and frames <= (names_in or _read_names)(path)
    ]
    if len(others) == 1:
        return others[0]
    raise xml.make_file_error(
        settings,
        f"{len(others) or 'no'} URDF files next to the YAML file"
        + (" that have the frames of its closures" if others or frames else ""),
        settings.with_suffix(".urdf").name,
    )


def _read_names(path: Path) -> set[str]:
    """Return the names of a URDF's links and joints; none if it is not a URDF."""
    try:
        root = xml.parse_document(xml.read_bytes(path), str(path), [])
    except BadRobotFile:
        return set()
    return {str(each.get("name")) for each in root.iter("link", "joint")}


def find_partner(path: Path) -> Path | None:
    """Return the file on the disk that is read together with this one: the YAML file of a URDF, the URDF of a YAML
    file."""
    return _search_partner(path, cache(_read_names))


def _search_partner(path: Path, names_in: Callable[[Path], set[str]]) -> Path | None:
    try:
        if path.suffix.lower() in ENDINGS:
            said = read_settings(path)
            return None if said is None else find_urdf(path, collect_frame_names(said), names_in)
        found = find_settings(RobotFile(path, xml.parse_document(xml.read_bytes(path), str(path), [])))
    except (BadRobotFile, OSError):
        return None
    beside = list_folder_files(path, *ENDINGS) if found is None else [found[0]]
    return next(
        (
            each
            for each in beside
            if found or (_read_closures(each) is not None and _search_partner(each, names_in) == path)
        ),
        None,
    )


def collect_frame_names(said: dict[str, Any]) -> set[str]:
    """Return the names of the frames that closures connect."""
    pairs = said.get("closed_loop")
    flat = [
        each
        for pair in (pairs if isinstance(pairs, list) else [])
        for each in (pair if isinstance(pair, list) else [pair])
    ]
    return {str(each) for each in flat}


def _read_closures(path: Path) -> dict[str, Any] | None:
    """Return the content of a YAML file that closes loops; None for other YAML files."""
    try:
        data = xml.read_bytes(path)
        found = read_settings(path) if b"closed_loop" in data else None
    except BadRobotFile:
        return None
    return found if found is not None and collect_frame_names(found) else None
