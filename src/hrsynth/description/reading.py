"""Reading of a robot file: the file is opened, its format recognised, its mechanism assembled with the overrides."""

from __future__ import annotations

import os
from dataclasses import replace
from hashlib import sha256
from itertools import islice
from pathlib import Path

from ..budgets import CHARACTERISTIC_LENGTH_MAX_M, FOREIGN_FILE_LINKS_MAX
from ..errors import LoopClosureFailure
from ..mechanism.model import Mechanism, Note
from ..mechanism.part import extract_between
from . import formats, xml
from .file_format import RobotFile
from .formats.urdf import xacro
from .jointgraph import JointGraph
from .jointmotion import propose_closure_fix
from .overrides import Overrides, observe_links
from .tree import build_spanning_mechanism

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
    try:
        robot = formats.read(file)
    except LoopClosureFailure as error:
        if file.as_written or not file.strict or not propose_closure_fix(error.residual):
            raise
        robot = formats.read(replace(file, strict=False))  # rounded: closed as files of other tools are
    if isinstance(robot, JointGraph):
        if len(robot.links) > FOREIGN_FILE_LINKS_MAX or len(robot.joints) > 2 * FOREIGN_FILE_LINKS_MAX:
            raise xml.make_file_error(
                file.path,
                "too many links or joints",
                f"up to {FOREIGN_FILE_LINKS_MAX} links",
                value=f"{len(robot.links)} links and {len(robot.joints)} joints",
            )
        from .assembly.build import build
        from .assembly.generic import with_generic_zero

        robot = _restrict_to_part(build(robot, overrides), overrides)
        return robot if overrides.keyframe is not None or robot.has_open_platform else with_generic_zero(robot)
    return _restrict_to_part(robot, overrides)


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
    if data.startswith(tuple(each for dialect in formats.list_formats().values() for each in dialect.begins)):
        return RobotFile(path, None, strict, data[:8])
    if path.suffix.lower() in (".yaml", ".yml") and not data.lstrip().startswith(b"<"):
        return RobotFile(path, None, strict, tolerance=given.tolerance, as_written=given.as_written)
    notes: list[Note] = []
    root = xml.parse_document(data, str(path), notes)
    _require_few(path, root)
    return RobotFile(
        path,
        xacro.expand(path) if xacro.is_needed(root) else root,
        strict,
        b"",
        tuple(notes),
        given.tolerance,
        given.as_written,
    )


def _require_few(path: Path, root: xml.Element) -> None:
    """Refuse a file with too many links, joints, keyframes or observations before any of them is read."""
    links, joints = ("link", "body", "model", "default", "frame"), ("joint", "connect", "weld")
    for names, most, what in (
        (links, 2 * FOREIGN_FILE_LINKS_MAX, "links, bodies and frames"),
        (joints, 4 * FOREIGN_FILE_LINKS_MAX, "joints"),
        (("key", "observe"), FOREIGN_FILE_LINKS_MAX, "keyframes and observations"),
    ):
        if sum(1 for _ in islice(root.iter(*names), most + 1)) > most:
            allowed = f"{FOREIGN_FILE_LINKS_MAX} links" if names is links else most
            raise xml.make_file_error(path, f"too many {what}", f"up to {allowed}", value=f"more than {most}")


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
