"""Which dialect a file is in, by its content; the reader of a foreign one is imported when a file needs it."""

from __future__ import annotations

import os
from pathlib import Path

from ...errors import BadRobotFile, Defect
from ...mechanism.model import Mechanism
from ...mechanism.part import between
from .. import xml
from ..reader import native
from ..tree import spanning
from . import xacro
from .given import Given, observing
from .graph import LINKS, Graph

_FOLDER = ("robot.yaml", "robot.yml")


def read(path: Path, wishes: Given) -> Mechanism:
    """The mechanism of a file in any dialect, or of a folder with a URDF and a YAML file.

    Raises ``BadRobotFile`` for what is no robot, ``BadRequest`` for what has to be given, ``LoopsNotClosed`` and
    ``RankUndecided`` where its loops stay open or undecided.
    """
    found = said(path, strict=not wishes.changes)
    if isinstance(found, Graph):
        if len(found.links) > LINKS or len(found.edges) > 2 * LINKS:
            raise _refused(path, f"{len(found.links)} links and {len(found.edges)} joints", f"up to {LINKS} links")
        from .build import build

        found = build(found, wishes)
    if wishes.base is not None:
        found = spanning(between(found, wishes.base, wishes.platform or found.platform))
    return found if wishes.observe is None else observing(found, wishes.observe)


def said(path: Path, *, strict: bool = True) -> Graph | Mechanism:
    """What a file says: the mechanism itself in the native dialect (where it is read strictly), else a joint graph."""
    if os.path.isdir(path):
        return _folder(path, strict)
    data = xml.content(path)
    if path.suffix.lower() in (".yaml", ".yml") and not data.lstrip().startswith(b"<"):
        return _with_urdf(path)
    root = xml.document(data, str(path))
    if not (strict and root.find("hrsynth") is not None):
        _require_few(path, root)
    match root.tag:
        case "mujoco":
            from . import mjcf
            from .mjcf_defaults import with_includes

            return mjcf.read(with_includes(root, str(path)), str(path))
        case "sdf" | "gazebo":
            from . import sdf

            return sdf.read(root, str(path))
    if xacro.needed(root):
        root = xacro.expanded(path)
    settings = _settings(path, root)
    if settings is not None:
        return _told_beside(path, settings)
    if root.tag != "robot" or (strict and root.find("hrsynth") is not None):
        return native(root, str(path))
    from . import urdf

    return urdf.read(root, str(path))


def _told_beside(path: Path, settings: Path) -> Graph:
    from . import gepetto

    return gepetto.read(path, settings)


def _require_few(path: Path, root: xml.Element) -> None:
    """Refuse what has too many links before any of them is read."""
    for count, _ in enumerate(root.iter("link", "body", "model", "default", "frame"), 1):
        if count > 2 * LINKS:
            raise _refused(path, f"more than {2 * LINKS} links, bodies and frames", f"up to {LINKS} links")


def _settings(path: Path, root: xml.Element) -> Path | None:
    """The YAML file beside a URDF that has no loops of its own, where there is one of this dialect."""
    if root.tag != "robot" or root.find("loop") is not None:
        return None
    for name in dict.fromkeys((path.with_suffix(".yaml").name, *(_FOLDER if path.stem == "robot" else ()))):
        beside = path.with_name(name)
        if beside != path and os.path.isfile(beside):
            from . import gepetto

            if gepetto.sayings(beside) is not None:
                return beside
    return None


def _with_urdf(settings: Path) -> Graph:
    for name in (settings.with_suffix(".urdf").name, "robot.urdf"):
        if settings.with_name(name).is_file():
            return _told_beside(settings.with_name(name), settings)
    raise _refused(settings, "no URDF file beside the YAML file", settings.with_suffix(".urdf").name)


def _folder(path: Path, strict: bool) -> Graph | Mechanism:
    """A folder's robot.urdf, or its only robot file."""
    if (path / "robot.urdf").is_file():
        return said(path / "robot.urdf", strict=strict)
    files = sorted(each for pattern in ("*.urdf", "*.sdf", "*.xml", "*.mjcf", "*.xacro") for each in path.glob(pattern)
                   if each.name not in ("package.xml", "model.config"))
    if len(files) != 1:
        raise _refused(path, "a folder of " + (f"{len(files)} robot files" if files else "no robot file"),
                       "robot.urdf with robot.yaml, or one robot file")
    return said(files[0], strict=strict)


def _refused(path: Path, what: str, allowed: str) -> BadRobotFile:
    return BadRobotFile([Defect(str(path), None, what, None, allowed)])
