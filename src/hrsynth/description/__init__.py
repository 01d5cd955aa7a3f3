"""Robot files and mechanisms, both ways: one module a file format."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import tempfile
from codecs import BOM_UTF8
from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from ..errors import (
    AssumedBase,
    AssumedPlatform,
    BadRequest,
    BadRobotFile,
    HrsynthError,
    shorten_text,
    warn_caller,
)
from ..geometry.vectors import Array
from ..mechanism.model import Mechanism, Note
from ..results import with_spelling
from ..tolerances import ROBOT_FILE_MAX_BYTES
from . import formats, xml
from .conversion import compute_written_values
from .example_data import PREFIX, list_examples
from .file_format import FileFormat, RobotFile
from .files import convert_to_path, open_regular, require_same, require_writable, write_whole
from .formats import native
from .jointgraph import join_names
from .meshes import carry_meshes, remove_written, write_meshes
from .overrides import Overrides
from .reading import read
from .simulator_models import load_mujoco, write_model
from .tree import build_spanning_mechanism

if TYPE_CHECKING:
    from mujoco import MjModel, MjSpec
    from pinocchio import Model
    from yourdfpy import URDF

__all__ = [
    "build_spanning_mechanism",
    "list_examples",
    "list_robots",
    "list_save_targets",
    "load",
    "native",
    "save",
    "to_mujoco",
    "to_urdf",
]

NAMED = "a path, the name of a shipped robot, example:NAME"
"""Ways to give a robot's file."""
LOADED = f"{NAMED}, an open file, XML text, a yourdfpy.URDF, a model of MuJoCo or Pinocchio"
"""Objects that are read."""
ERROR_INPUT_CHARACTERS_MAX = 60
"""Letters of a given value that a message shows."""
WARNING_CHARACTERS_MAX = 400
"""Letters of a warning."""
GIVEN, NOWHERE = "the given text", "(nowhere, as no file is given)"
"""Name of a given text in errors, and of the folder of the files that it names."""


def list_robots() -> dict[str, Path]:
    """List the robots of the package.

    Returns
    -------
    dict
        Name to file, sorted by name.

    Examples
    --------
    >>> "3rrr_m1" in hrsynth.list_robots()
    True
    """
    packaged = Path(str(resources.files("hrsynth").joinpath("robots")))
    folder = packaged if packaged.is_dir() else Path(__file__).parents[3] / "robots"
    return {path.stem: path for path in sorted(folder.glob("*.urdf"), key=lambda path: path.stem)}


@with_spelling
def load(
    robot: str | Path | Mechanism | URDF | MjSpec | MjModel | Model | tuple[Any, ...] | IO[str] | IO[bytes],
    *,
    base: str | None = None,
    platform: str | None = None,
    motors: Iterable[str] | str | None = None,
    observe: Iterable[str] | str | None = None,
    close: Iterable[str] | str = (),
    freeze: Iterable[str] | str = (),
    keyframe: str | None = None,
    unit: str | None = None,
    tolerance: float | None = None,
    as_written: bool = False,
    args: Mapping[str, object] | Iterable[str] | str | None = None,
    model: str | None = None,
) -> Mechanism:
    """Return the mechanism of a robot file, of a robot of the package by its name, or of a given text or object.

    Parameters
    ----------
    robot
        Path of a file in any format; name of a robot of the package, or ``example:NAME`` of the package
        example-robot-data; an open file; XML text (any text with ``<``; relative file names in it are not found); a
        ``yourdfpy.URDF``, read as the file that it writes (a tree, whose closures are given); a ``mujoco.MjSpec`` or
        ``mujoco.MjModel``; a ``pinocchio.Model``, alone or as ``(model, constraint_models)`` or ``(model,
        constraint_models, q0)``, also what ``to_pinocchio`` returns; or a mechanism, which is returned unchanged.
    base
        Base link. Only the part between base and platform remains.
    platform
        Platform link.
    motors
        Joints with motors, as a list or a text with commas, like all lists here.
    observe
        Links to observe at their default segments.
    close
        Closures ``A:B[:TYPE[/AXIS]]`` that make the frames of two links (or points ``A@x,y,z`` in them, m) meet; a
        joint with an axis needs it, in A's frame: ``A:B:revolute/0,0,1``.
    freeze
        Joints to fix at zero.
    keyframe
        Keyframe of the file or of an SRDF file next to it (or ``FILE.srdf:NAME``) that becomes the zero configuration.
    unit
        Unit of the file's lengths: m, mm, cm or in.
    tolerance
        Relations of joints (axes parallel, perpendicular, through one point; equal rods …) that hold to this tolerance
        (characteristic lengths, rad) are made exact with the least change. Default: from the file's digits.
    as_written
        Keep the numbers of the file as they are.
    args
        Arguments of a xacro file: ``{"loops": True}``, or texts ``name:=value``.
    model
        Model of an SDFormat file with several.

    Returns
    -------
    Mechanism
        Links, joints and loops, all geometry in the base frame at the zero configuration (m, rad). ``notes`` lists
        what reading assumed, solved or repaired.

    Raises
    ------
    BadRequest
        For an unknown name, with the closest names, and if an option is missing.
    BadRobotFile
        For defects of the file, all of them with their lines.
    LoopClosureFailure, UndecidedRank, UndecidedStructure
        For loops that stay open, and for rounded numbers that leave the rank of the loops or the structure undecided.

    Warns
    -----
    AssumedBase, AssumedPlatform
        For an assumed base or platform. If several links could be the platform, it stays open until an analysis needs
        it.

    Examples
    --------
    >>> hrsynth.load("3rrr_m1")
    <Mechanism: 3rrr_m1, 8 links, 9 joints, 3 motors>
    """

    overrides = Overrides.said(
        base=base,
        platform=platform,
        motors=motors,
        close=close,
        freeze=freeze,
        observe=observe,
        keyframe=keyframe,
        unit=unit,
        tolerance=tolerance,
        as_written=as_written,
        args=args,
        model=model,
    )
    if isinstance(robot, Mechanism):
        if overrides.has_any or any(value is not None for value in (tolerance, base, observe, args, model)):
            raise BadRequest(
                "--base, --platform and the other file overrides need a file: this robot is already read",
                robot.name,
                "a file or the name of a robot",
            )
        return robot
    if isinstance(robot, os.PathLike) or (isinstance(robot, str) and "<" not in robot):
        found = read(find_robot_file(robot), overrides)
    else:
        found = _read_content(robot, overrides)
    for note in found.notes:
        if note.base:
            warn_caller(shorten_text(f"{found.name}: {note.text}", WARNING_CHARACTERS_MAX), AssumedBase)
    if found.choice is not None and found.choice.chosen == "assumption":
        text = f"{found.name}: the platform is link {found.platform!r}, {found.choice}"
        warn_caller(
            shorten_text(f"{text} (platform={found.platform!r} confirms it)", WARNING_CHARACTERS_MAX), AssumedPlatform
        )
    return found


def _read_content(robot: Any, overrides: Overrides) -> Mechanism:
    """Return the mechanism of a text, an open file (read at its path if the content is the same) or a ``yourdfpy.URDF``
    (meshes in its folder). Raises ``BadRequest`` for anything else."""
    looked_in, name = None, str(getattr(robot, "name", ""))
    if isinstance(robot, str):
        data: Any = robot
    elif callable(getattr(robot, "read", None)):
        try:
            data = robot.read(ROBOT_FILE_MAX_BYTES + 1)
        except (OSError, ValueError):
            raise BadRequest(
                "the open file cannot be read", _shorten_value(robot), "a file that is open for reading"
            ) from None
    elif type(robot).__module__.partition(".")[0] == "yourdfpy" and hasattr(robot, "write_xml_string"):
        data, name = robot.write_xml_string(), ""
        looked_in = getattr(getattr(robot, "_filename_handler", None), "keywords", {}).get("dir")
    elif written := write_model(robot):
        data, name = written[0], "robot.xml"
        if written[1] is not None and overrides.keyframe is None:
            overrides = replace(overrides, keyframe=written[1])
    else:
        data = None
    decoded = isinstance(data, str)
    data = data.encode(errors="replace") if decoded else data
    if not isinstance(data, bytes):
        raise BadRequest("a robot's file", _shorten_value(robot), LOADED)
    with contextlib.suppress(OSError):
        if os.path.isfile(name) and _split_lines(Path(name).read_bytes()) == _split_lines(data):
            return read(Path(name), overrides)
    if decoded:  # whatever encoding it declares
        data = re.sub(rb"""^(\s*<\?xml[^>]*?)\s+encoding=("[^"]*"|'[^']*')""", rb"\1", data)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"robot{Path(name).suffix[:10] or '.urdf'}"
        file.write_bytes(data)

        def said(text: str) -> str:
            whole = text.replace(str(file), GIVEN).replace(folder, NOWHERE)
            return shorten_text(
                re.sub(
                    rf"\S{{{ERROR_INPUT_CHARACTERS_MAX},}}",
                    lambda word: shorten_text(word[0], ERROR_INPUT_CHARACTERS_MAX),
                    whole,
                ),
                300,
            )

        try:
            found = read(file, overrides)
        except BadRobotFile as error:
            raise BadRobotFile(
                replace(each, file=said(each.file), problem=said(each.problem), got=each.got and said(each.got))
                for each in error.defects
            ) from None
        except HrsynthError as error:
            error.file, error.args = None, (said(str(error)),)
            raise
    return replace(found, file=str(Path(looked_in) / f"{found.name}.urdf") if looked_in else None, sha256=None)


def _split_lines(data: bytes) -> list[bytes]:
    """Return the lines of a file without line ends and byte order mark, which text that is read has lost."""
    return data.removeprefix(BOM_UTF8).splitlines()


def _shorten_value(value: object) -> object:
    """Return a value as a message shows it: whole if it is short."""
    return (
        value
        if len(repr(value)) <= ERROR_INPUT_CHARACTERS_MAX
        else shorten_text(str(value), ERROR_INPUT_CHARACTERS_MAX - 2)
    )


def find_robot_file(robot: str | os.PathLike[str]) -> Path:
    """Return the file of a name or path. Raises ``BadRequest`` for an unknown robot."""
    if not isinstance(robot, str | os.PathLike) or robot == "" or (isinstance(robot, str) and {"\n", "<"} & {*robot}):
        raise BadRequest("a robot's file", _shorten_value(robot), NAMED)
    path = Path(robot)
    if isinstance(robot, str) and robot.startswith(PREFIX) and not os.path.exists(robot):
        return _find_named_file(
            robot.removeprefix(PREFIX), list_examples(), "not a robot of example-robot-data", "robots --examples"
        )
    if isinstance(robot, str) and not path.suffix and len(path.parts) == 1:
        robots = list_robots()
        with contextlib.suppress(OSError, ValueError):
            if path.is_file() and (robot not in robots or _may_be_robot(path)):
                return path
        if robot in robots or not os.path.exists(robot):
            return _find_named_file(robot, robots, "neither a file nor a shipped robot", "robots")
    return path


def _may_be_robot(path: Path) -> bool:
    """Return True if a file begins as robot files do; any other with the name of a shipped robot does not hide it."""
    with open_regular(path) as stream:
        start = stream.read(1000)
    return xml.may_be_document(start) or formats.recognise(RobotFile(path, None, data=start)) is not None


def _find_named_file(name: str, files: dict[str, Path], what: str, command: str) -> Path:
    """Return the file of a robot by its name. Raises ``BadRequest`` with the closest names."""
    if name in files:
        return files[name]
    close = difflib.get_close_matches(name, files, n=5) or list(files)
    raise BadRequest(
        what, _shorten_value(name), f"a file or one of `hrsynth {command}`, such as " + ", ".join(close[:12])
    )


def list_save_targets(path: str | Path, format: str | None = None, *, keyframes: bool = False) -> tuple[Path, ...]:
    """Return the files that :func:`save` writes, the tree first. Raises ``BadRequest`` for an unknown format or
    extension, and for files that cannot be written."""
    chosen, target = _choose_format(Path(path), format), Path(path)
    files = chosen.files(target)
    if keyframes and chosen.keyframe_ending:
        files = (*files, target.with_suffix(chosen.keyframe_ending))
    for file in files:
        require_writable(file)
    return files


@with_spelling
def save(
    mechanism: Mechanism | str | Path,
    path: str | Path,
    format: str | None = None,
    *,
    meshes: str = "keep",
    keyframes: Mapping[str, Mapping[str, Array]] | None = None,
) -> tuple[Note, ...]:
    """Write a robot file, completely or not at all, and return warnings of what the format cannot express.

    Parameters
    ----------
    mechanism
        Mechanism, robot file or name of a robot.
    path
        File to write. A file that goes with it is not replaced by other content, nor is a file that is read
        together with one that stays.
    format
        ``native``, ``gepetto``, ``mjcf``, ``sdf`` or ``usd``, or an added one. Default: by the longest known
        extension, ``.urdf`` native, ``.xml`` and ``.mjcf`` MJCF, ``.sdf`` SDFormat, ``.usda``, ``.usd`` and ``.usdc``
        USD, ``.yaml`` Gepetto (with a ``.urdf`` of the same name next to it).
    meshes
        ``keep``: meshes stay and are named from the new file's folder; ``copy``: they are copied to ``meshes/`` next to
        it.
    keyframes
        Link poses by keyframe, such as ``link_poses`` of a result of ``check`` or ``modes``: keys of MJCF, or group
        states of an SRDF file next to a URDF. Turns are within half a turn of the zero configuration.

    Returns
    -------
    tuple of Note
        Warnings of what is lost.

    Raises
    ------
    BadRequest
        For an unknown format or extension, a file that cannot be written, or a mechanism that the format cannot
        express.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     notes = hrsynth.save(hrsynth.load("3rrr_m1"), f"{folder}/robot.urdf")
    """

    if meshes not in ("keep", "copy"):
        raise BadRequest("meshes", meshes, ("keep", "copy"))
    target = convert_to_path(path)
    chosen, mechanism = _choose_format(target, format), load(mechanism)
    robot, copies, notes = carry_meshes(mechanism, target, chosen.meshes, copy=meshes == "copy")
    new = write_meshes(copies)
    try:
        found = formats.get_writer(chosen.name)(robot)
        texts = zip(chosen.files(target), found.texts, strict=True)
        written = dict(texts)
        if keyframes:
            write = formats.get_keyframe_writer(chosen.name)
            values = {name: compute_written_values(robot, poses) for name, poses in keyframes.items()}
            written |= write(written[target], target, values)
        contents = {file: chosen.packed(text, file) for file, text in written.items()}
        for file, content in contents.items():
            if file != target:
                require_same(file, content)
            _require_whole(file, contents)
        for file, content in contents.items():
            write_whole(file, content)
        if chosen.reread:
            notes += _find_silent_losses(robot, target, listed=bool(found.lost))
    except BaseException:
        remove_written(new)
        raise
    return (*found.lost, *notes)


@with_spelling
def to_urdf(robot: Mechanism | str | Path) -> str:
    """Return the text of a robot's own file: URDF, with the loops in elements that other readers leave out; also as
    ``Mechanism.to_urdf()``.

    Parameters
    ----------
    robot
        Mechanism, path of a file, or name of a shipped robot.

    Returns
    -------
    str
        Text that ``load`` reads.

    Examples
    --------
    >>> hrsynth.load(hrsynth.to_urdf("3rrr_m1")) == hrsynth.load("3rrr_m1")
    True
    """
    return formats.get_writer("native")(load(robot)).texts[0]


@with_spelling
def to_mujoco(robot: Mechanism | str | Path, *, keyframes: Mapping[str, Mapping[str, Array]] | None = None) -> MjModel:
    """Return a robot with its loops as a MuJoCo model; also as ``Mechanism.to_mujoco()``.

    Parameters
    ----------
    robot
        Mechanism, path of a file, or name of a shipped robot.
    keyframes
        Link poses by keyframe, as in :func:`save`.

    Returns
    -------
    mujoco.MjModel
        Bodies, joints and motors with the file's names (metres, kilograms, radians), the zero configuration as its
        reference, an equality for each loop and coupling.

    Raises
    ------
    BadRequest
        If MJCF cannot express the robot.
    MissingExtra
        If MuJoCo is not installed.

    Warns
    -----
    UserWarning
        Of what the model lacks, such as limits of loops.

    Examples
    --------
    >>> model = hrsynth.to_mujoco("3rrr_m1")
    >>> model.nv, model.neq, model.nu
    (7, 4, 3)
    """
    mujoco = load_mujoco("a model of MuJoCo")
    with tempfile.TemporaryDirectory() as folder:
        file = f"{folder}/robot.xml"
        for note in save(robot, file, keyframes=keyframes):
            warn_caller(shorten_text(note.text, WARNING_CHARACTERS_MAX), UserWarning)
        return mujoco.MjModel.from_xml_path(file)


def _find_silent_losses(robot: Mechanism, path: Path, *, listed: bool) -> list[Note]:
    """Return a warning if the written file, read back, is another mechanism. Frames of links may differ, and content if
    the writer has ``listed`` losses."""
    free = ("pose of link ", "content of ", "xml of ")[: 3 if listed else 1]
    try:
        differences = load(path).differences(build_spanning_mechanism(robot))
    except HrsynthError as error:
        differences = [str(error)]
    differences = [each for each in differences if not each.startswith(free)]
    text = "the written file, read back, is another mechanism: " + join_names(differences, 3)
    return [Note("warning", text)] if differences else []


def _require_whole(file: Path, others: Iterable[Path]) -> None:
    """Raise ``BadRequest`` if a file to be replaced is read together with one that stays."""
    partners = [each.partner(file) for each in formats.list_formats().values() if os.path.isfile(file)]
    written = set(map(os.path.realpath, others))
    for partner in filter(None, partners):
        if os.path.realpath(partner) not in written:
            raise BadRequest(
                f"cannot write the file: {partner.name} next to it would be read with it",
                str(file),
                remedy=f"Choose another name or move {partner.name}.",
            )


def _choose_format(target: Path, name: str | None) -> FileFormat:
    dialects = {each.name: each for each in formats.list_writable_formats()}
    if name is not None and name not in dialects:
        raise BadRequest("unknown format", name, tuple(dialects))
    endings = {ending: each for each in dialects.values() for ending in each.endings}
    matching = [ending for ending in endings if target.name.lower().endswith(ending)]
    if name is None and not matching:
        raise BadRequest(
            "cannot write the file: its extension belongs to no known format",
            str(target),
            ", ".join(sorted(endings)),
            remedy="Name the format.",
        )
    return endings[max(matching, key=len)] if name is None else dialects[name]
