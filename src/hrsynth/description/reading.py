"""Reading of a robot file: the file is opened, its format recognised, its mechanism assembled with the overrides."""

from __future__ import annotations

import os
from dataclasses import replace
from hashlib import sha256
from itertools import islice
from pathlib import Path

from ..mechanism.model import Mechanism, Note
from ..mechanism.part import extract_between
from ..tolerances import CHARACTERISTIC_LENGTH_MAX_M
from . import formats, xml
from .file_format import RobotFile
from .formats.urdf import xacro
from .overrides import Overrides, observe_links
from .tree import build_spanning_mechanism

FOREIGN_FILE_LINKS_MAX = 1000
"""Links above which a foreign file is refused."""

AS_IT_IS = Overrides()
"""Overrides without any option."""


def read(path: Path, overrides: Overrides) -> Mechanism:
    """Return the mechanism of a file in any format, or of a folder with a URDF and a YAML file.

    Raises ``BadRobotFile`` for a file that is not a robot, ``BadRequest`` for missing options, ``LoopClosureFailure``
    and ``UndecidedRank`` for loops that stay open or undecided."""
    robot = build_mechanism(open_robot_file(path, overrides), overrides)
    data = b"" if robot.file is None else xml.read_bytes(Path(robot.file))
    return replace(robot, options=overrides.words, sha256=sha256(data).hexdigest())


def build_mechanism(file: RobotFile, overrides: Overrides) -> Mechanism:
    """Return the mechanism of an opened file; raises like :func:`read`."""
    from .assembly.assemble import assemble

    graph = formats.read(file)
    if len(graph.links) > FOREIGN_FILE_LINKS_MAX or len(graph.joints) > 2 * FOREIGN_FILE_LINKS_MAX:
        raise xml.make_file_error(
            file.path,
            "too many links or joints",
            f"at most {FOREIGN_FILE_LINKS_MAX} links and {2 * FOREIGN_FILE_LINKS_MAX} joints",
            value=f"{len(graph.links)} links and {len(graph.joints)} joints",
        )
    robot = _restrict_to_part(assemble(graph, overrides), overrides)
    if graph.is_complete or overrides.keyframe is not None or robot.has_open_platform:
        return robot
    from .assembly.generic import with_generic_zero

    return with_generic_zero(robot)


def _restrict_to_part(robot: Mechanism, overrides: Overrides) -> Mechanism:
    """Return the whole robot or the part between base and platform, with the observations of the overrides."""
    if overrides.base is not None or overrides.observe is not None:
        robot.require_platform()
    if overrides.base is not None:
        robot = build_spanning_mechanism(extract_between(robot, overrides.base, overrides.platform or robot.platform))
    if overrides.unit is None and robot.length > CHARACTERISTIC_LENGTH_MAX_M:
        text = f"the robot's characteristic length is {robot.length:.3g} m: if its file is in millimetres, --unit mm"
        robot = replace(robot, notes=(*robot.notes, Note("open", text)))
    return robot if overrides.observe is None else observe_links(robot, overrides.observe)


def open_robot_file(path: Path, given: Overrides = AS_IT_IS, *, strict: bool | None = None) -> RobotFile:
    """Return an opened file (a folder's robot.urdf, or its only robot file) with the ``given`` overrides."""
    strict = not given.has_any if strict is None else strict
    if os.path.isdir(path):
        path = _find_in_folder(path)
    data = xml.read_bytes(path)
    opened = RobotFile(path, None, strict, data, model=given.model)
    is_yaml = path.suffix.lower() in (".yaml", ".yml")
    if not xml.may_be_document(data) and (is_yaml or formats.recognise(opened) is not None):
        return opened
    notes: list[Note] = []
    root = xml.parse_document(data, str(path), notes)
    _require_few(path, root)
    arguments: dict[str, str] = {}
    if xacro.is_needed(root):
        root, arguments = xacro.expand(path, given.args, notes)
    elif given.args:
        notes.append(Note("ignored", f"--arg {given.args[0]}: the file is not a xacro file"))
    return replace(opened, root=root, notes=tuple(notes), arguments=arguments)


def _require_few(path: Path, root: xml.Element) -> None:
    """Refuse a file with too many links, joints, keyframes or observations before any of them is read."""
    links, joints = ("link", "body", "model", "default", "frame"), ("joint", "connect", "weld")
    for names, most, what in (
        (links, 2 * FOREIGN_FILE_LINKS_MAX, "link, body, model, default and frame"),
        (joints, 4 * FOREIGN_FILE_LINKS_MAX, "joint, connect and weld"),
        (("key", "observe"), FOREIGN_FILE_LINKS_MAX, "key and observe"),
    ):
        if sum(1 for _ in islice(root.iter(*names), most + 1)) > most:
            raise xml.make_file_error(path, f"too many {what} elements", f"at most {most}", value=f"more than {most}")


def _find_in_folder(path: Path) -> Path:
    if (path / "robot.urdf").is_file():
        return path / "robot.urdf"
    files = sorted(
        each
        for pattern in ("*.urdf", "*.sdf", "*.xml", "*.mjcf", "*.xacro", "*.usd", "*.usda", "*.usdc")
        for each in path.glob(pattern)
        if each.name not in ("package.xml", "model.config")
    )
    if len(files) != 1:
        raise xml.make_file_error(
            path,
            "a folder with " + (f"{len(files)} robot files" if files else "no robot file"),
            "robot.urdf with robot.yaml, or one robot file",
        )
    return files[0]
