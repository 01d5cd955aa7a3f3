"""Poses of a platform as a user writes them: some parts given, the others free; and grids of poses.

The platform's frame in the base frame, metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypedDict, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import BadRequest
from ..geometry.vectors import Array, convert_rpy_to_rotation
from ..options import parse_plain_number
from ..records import FLAT, As, Record, recorded
from ..results import Value
from ..tolerances import POSE_VALUE_MAX, PRINTED_POSE_TOL

if TYPE_CHECKING:
    from .model import Mechanism

HALF_TURN_TOL_RAD = 5e-7
"""Angle (radians) from -pi within which a rotation is printed as pi."""
GRID_CELLS_MAX = 100_000
"""Largest number of cells of a grid of poses; more is taken for a mistake."""
JOINT_VALUE_MAX = 100.0
"""Largest joint value (metres, radians) of a request; paths to it use small steps."""

UNITS: dict[str, Callable[[float], float]] = {"deg": math.radians, "mm": lambda number: number / 1000}
"""Units with which numbers may be written, and their conversion to radians and metres."""
LENGTHS = ("x", "y", "z")
SCALARS = (*LENGTHS, "phi")
PARTS = (*SCALARS, "rpy")
TURNS = ("roll", "pitch", "yaw")
"""The angles of rpy, as parts of a grid."""
ANGLES = ("phi", "rpy", *TURNS)
EXAMPLE = "x=0.02,y=0.1,z=-0.7, and phi=10deg or rpy=0.1/0/0"


@dataclass(frozen=True)
class Pose(Record):
    """Parts of a platform's pose; None is free. ``phi`` is the rotation from the zero configuration about the one axis
    about which the platform rotates, or else about the base frame's z, ``rpy`` URDF's fixed-axis roll, pitch, yaw."""

    x: Annotated[float | None, "null: free"] = None
    y: Annotated[float | None, "null: free"] = None
    z: Annotated[float | None, "null: free"] = None
    phi: Annotated[float | None, float, As(optional=True), "present if it was given"] = None
    rpy: Annotated[tuple[float, float, float] | None, "roll, pitch, yaw about fixed axes"] = None
    shown: str = field(default="", repr=False, compare=False)
    """Text as it was typed, or in the form in which another pose was typed."""

    def __post_init__(self) -> None:
        if self.phi is not None and self.rpy is not None:
            raise BadRequest("pose with both phi and rpy", str(self), "one of them")
        for name, values in self.given.items():
            if not all(isinstance(value, int) or math.isfinite(value) for value in values):
                raise BadRequest(f"pose: {name} is not finite", "/".join(map(str, values)), "a finite number")
            if max(map(abs, values)) > POSE_VALUE_MAX:
                raise BadRequest(
                    f"pose: {name} is too large", "/".join(map(str, values)), f"at most {POSE_VALUE_MAX:g}"
                )

    @classmethod
    def parse(cls, text: str) -> Pose:
        """Return the pose written as ``x=0.02,y=0.1,z=-0.7,phi=10deg``. Raises ``BadRequest``."""
        parts = _split_fields(text, "pose")
        fields: dict[str, Any] = {
            name: _parse_triple(value, text) if name == "rpy" else _parse_number(value, name, text)
            for name, value in parts
        }
        return cls(**fields, shown=",".join(map("=".join, parts)))

    @classmethod
    def of(cls, X: Array, point: Array | None = None) -> Pose:
        """Return the pose of a homogeneous matrix X_BP (4, 4); for a point body only the position of ``point`` (in the
        platform's frame)."""
        x, y, z = map(float, X[:3, 3] if point is None else X[:3, :3] @ point + X[:3, 3])
        if point is not None:
            return cls(x, y, z)
        roll, pitch, yaw = map(normalise_half_turn, compute_rpy(X[:3, :3]))
        return cls(x, y, z, rpy=(roll, pitch, yaw))

    @property
    def given(self) -> dict[str, tuple[float, ...]]:
        """Parts that are given, each with its numbers."""
        parts: dict[str, tuple[float, ...] | None] = {
            name: None if (value := getattr(self, name)) is None else (value,) for name in SCALARS
        }
        return {name: values for name, values in {**parts, "rpy": self.rpy}.items() if values is not None}

    def without(self, names: Iterable[str]) -> Pose:
        """Return the pose with these parts free."""
        gone = set(names) & self.given.keys()
        return Pose(**{name: getattr(self, name) for name in PARTS if name not in gone}) if gone else self

    @property
    def rotation(self) -> Array | None:
        """R_BP (3, 3) if rpy is given."""
        return None if self.rpy is None else convert_rpy_to_rotation(*self.rpy)

    def __str__(self) -> str:
        return self.shown or write_parts(self.given)


@dataclass(frozen=True)
class PoseForm:
    """Form in which a user writes poses with several rotation axes: ``phi`` for one rotation, rpy in ``degrees``."""

    phi: bool = False
    degrees: bool = False

    @classmethod
    def of(cls, poses: Iterable[AskedPose]) -> PoseForm:
        """Return the form in which these poses are written."""
        typed = [each for each in poses if isinstance(each, Pose)]
        return cls(
            any(each.phi is not None or "phi=" in each.shown for each in typed),
            any("deg" in each.shown for each in typed),
        )


RADIANS = PoseForm()


@dataclass(frozen=True)
class ModeNumber:
    """Pose by its number in a list of assembly modes, written ``mode:3``."""

    number: int

    def __str__(self) -> str:
        return f"mode:{self.number}"


@dataclass(frozen=True)
class JointPose:
    """Pose by coordinates of joints, counted as the file counts them (m, rad): written ``joints:knee=0.3,hip=5deg``, or
    ``motors:0.1,0.2`` in the order of the file. Motors that are not named stay at the zero configuration; other joints
    follow the loops."""

    motors: bool
    values: tuple[tuple[str, tuple[float, ...]], ...]
    """Coordinates by name; without names (empty) in the order of the file."""
    units: tuple[tuple[str, str], ...] = ()
    """Names, or numbers in the order of the file, of those given with a unit (``deg``, ``mm``), and that unit."""

    @classmethod
    def of(cls, kind: str, given: Any) -> JointPose:
        """Return those of ``joints`` or ``motors``, given as a text, as a dict by names, or in the order of the file.
        Raises ``BadRequest``."""
        pairs: list[tuple[str, Any]] = []
        if isinstance(given, str):
            parts = [part.rpartition("=") for part in given.split(",")]
            pairs = [(name.strip(), value.strip()) for name, _, value in parts]
        elif isinstance(given, Mapping):
            pairs = [(str(name), value) for name, value in given.items()]
        elif isinstance(given, Iterable):
            pairs = [("", value) for value in given]
        names = {name for name, _ in pairs}
        if not pairs or ("" in names and len(names) > 1):
            raise BadRequest(f"{kind} of a pose: all by name, or all in the order of the file", given, JOINT_POSES)
        if "" not in names and len(names) < len(pairs):
            raise BadRequest(f"{kind} of a pose: name given twice", given, "each name once")
        read = [(name, *_parse_coordinates(kind, value)) for name, value in pairs]
        return cls(
            kind == "motors",
            tuple((name, values) for name, values, _ in read),
            tuple((name or str(number), unit) for number, (name, _, unit) in enumerate(read) if unit),
        )

    @property
    def kind(self) -> str:
        """``motors`` or ``joints``."""
        return "motors" if self.motors else "joints"

    @property
    def given(self) -> dict[str, tuple[float, ...]]:
        """Coordinates by name."""
        return dict(self.values)

    def __str__(self) -> str:
        parts = ((name and f"{name}=") + "/".join(map(_write_number, each)) for name, each in self.values)
        return f"{self.kind}:{','.join(parts)}" if self.values else ""


def _parse_coordinates(kind: str, given: Any) -> tuple[tuple[float, ...], str]:
    """Return the coordinates of one joint, and the unit if they have one: numbers in metres or radians, or a text with
    / between, such as ``5deg`` or ``20mm``."""
    try:
        if isinstance(given, str):
            read = [_read_number(part.strip(), tuple(UNITS)) for part in given.split("/")]
            numbers, unit = [number for number, _ in read], max(unit for _, unit in read)
        else:
            numbers, unit = np.atleast_1d(given).tolist(), ""
        if all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < JOINT_VALUE_MAX for x in numbers):
            return tuple(map(float, numbers)), unit
    except (TypeError, ValueError, OverflowError):
        pass
    expected = f"metres or radians below {JOINT_VALUE_MAX:g}, or with deg or mm"
    raise BadRequest(f"{kind} of a pose: not a number of {expected}", given, JOINT_POSES)


JOINT_POSES = "joints:NAME=VALUE,… or motors:VALUE,VALUE,… in the order of the file (m, rad, or with mm, deg)"


class RigidTransform(Protocol):
    """Object with a homogeneous matrix, such as ``pinocchio.SE3``."""

    @property
    def homogeneous(self) -> Array: ...


AskedPose = Pose | ModeNumber | JointPose
PoseLike = AskedPose | str | Mapping[str, Any] | ArrayLike | RigidTransform
"""Pose as a user gives it: a text, a dict of its parts, x y (z (roll pitch yaw)), a matrix (4, 4), an SE3 of Pinocchio;
coordinates as ``{"joints": {"knee": 0.3}}`` or ``{"motors": [0.1, 0.2]}``, in the order of the file."""
POSES = (
    f"a text such as {EXAMPLE}; a dict of these; numbers x, y or x, y, z or x, y, z, roll, pitch, yaw; a 4 × 4 matrix; "
    "a pinocchio.SE3"
)


def convert_to_pose(given: PoseLike) -> Pose:
    """Return the pose given in any form of ``PoseLike`` except by the number of a mode. Raises ``BadRequest``."""
    if isinstance(given, Pose):
        return given
    if isinstance(given, str):
        return Pose.parse(given)
    try:
        if isinstance(given, Mapping):
            return Pose.parse(
                ",".join(f"{name}={_format_value(value)}" for name, value in given.items() if value is not None)
            )
        if isinstance(given, bytes | bytearray):
            raise TypeError
        numbers = np.asarray(getattr(given, "homogeneous", given), dtype=float)
    except (TypeError, ValueError):
        raise BadRequest("a pose", given, POSES) from None
    if numbers.shape == (4, 4):
        R = numbers[:3, :3]
        if not (
            np.max(np.abs(R @ R.T - np.eye(3))) < PRINTED_POSE_TOL
            and np.linalg.det(R) > 0
            and np.max(np.abs(numbers[3] - np.eye(4)[3])) < PRINTED_POSE_TOL
        ):
            raise BadRequest("pose: not the matrix of a rotation and a translation", numbers.tolist(), POSES)
        return Pose.of(numbers)
    if numbers.shape not in ((2,), (3,), (6,)):
        raise BadRequest("a pose", given, POSES)
    x, y, *more = numbers.tolist()
    return Pose(x, y, more[0] if more else None, rpy=(more[1], more[2], more[3]) if len(more) > 1 else None)


def _format_value(value: Any) -> str:
    """Return a part of a pose as a text, to the last digit."""
    if isinstance(value, str):
        return value
    return repr(float(value)) if np.ndim(value) == 0 else "/".join(map(_format_value, value))


def parse_poses(given: PoseLike | Iterable[PoseLike] | None) -> list[AskedPose]:
    """Return the given poses, one or several. Raises ``BadRequest``."""
    if given is None:
        return []
    several: Any = given
    if isinstance(given, str | bytes | bytearray | AskedPose | Mapping) or hasattr(given, "homogeneous"):
        several = [given]
    elif not isinstance(given, Iterable) or (isinstance(given, np.ndarray) and given.ndim == 0):
        raise BadRequest("poses", given, f"one or several of: {POSES}")
    else:
        several = list(given)
        with suppress(ValueError):
            numbers = np.array(several)
            if numbers.dtype.kind in "iuf" and numbers.shape in ((2,), (3,), (6,), (4, 4)):
                several = [numbers]
    return [parse_pose(each) for each in several]


def parse_pose(given: PoseLike) -> AskedPose:
    """Return the given pose, by its parts, as ``mode:3`` or by coordinates of joints. Raises ``BadRequest``."""
    if isinstance(given, ModeNumber | JointPose):
        return given
    if isinstance(given, Mapping) and (kinds := [name for name in ("joints", "motors") if name in given]):
        if len(given) > 1:
            raise BadRequest(f"pose by {kinds[0]} and other parts", ", ".join(map(str, given)), "one of them")
        return JointPose.of(kinds[0], given[kinds[0]])
    if not isinstance(given, str):
        return convert_to_pose(given)
    name, colon, number = given.strip().partition(":")
    if colon and name in ("joints", "motors"):
        return JointPose.of(name, number)
    if not colon or name != "mode":
        if given.strip().casefold().startswith(("joint", "motor")):
            raise BadRequest("pose by joints or motors", given, JOINT_POSES)
        return Pose.parse(given)
    if not (number.isascii() and number.isdecimal()) or int(number) < 1:
        raise BadRequest("number of a mode", given, "mode:1, mode:2, … as listed by modes")
    return ModeNumber(int(number))


class GridValues(TypedDict, total=False):
    """Values of the parts, or of the joints or motors, that vary."""

    x: list[float]
    y: list[float]
    z: list[float]
    phi: list[float]
    roll: list[float]
    pitch: list[float]
    yaw: list[float]
    joints: dict[str, list[float]]
    motors: dict[str, list[float]]


class FixedParts(TypedDict, total=False):
    """Parts of the pose, or coordinates of joints or motors, that a grid keeps constant."""

    x: float
    y: float
    z: float
    phi: float
    rpy: list[float]
    joints: dict[str, list[float]]
    motors: dict[str, list[float]]


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Value):
    """Line, plane or box of poses: the parts that vary with their values, and a pose with the other parts; or the
    same of coordinates of joints or motors."""

    axes: tuple[tuple[str, Array], ...]
    fixed: Pose | JointPose

    @classmethod
    def parse(cls, text: Grid | str, largest: int = GRID_CELLS_MAX) -> Grid:
        """Return the grid written as ``x=-0.3:0.3:21,y=0:0.1:5,z=-0.7`` (from:to:count), of at most ``largest`` poses,
        the same of ``motors:…`` or ``joints:…``, or a given grid. Raises ``BadRequest``."""
        if isinstance(text, Grid):
            return text
        if not isinstance(text, str):
            raise BadRequest("a grid", text, f"a text such as {GRIDS}")
        kind, colon, rest = text.strip().partition(":")
        kind = kind if colon and kind in ("joints", "motors") else ""
        axes: list[tuple[str, Array]] = []
        single: dict[str, str] = {}
        units: list[tuple[str, str]] = []
        for name, value in _split_fields(rest if kind else text, "grid", () if kind else (*SCALARS, *TURNS, "rpy")):
            if ":" not in value:
                single[name] = value
            elif name == "rpy":
                raise BadRequest("grid: a range of rpy", value, "ranges of " + ", ".join((*SCALARS, *TURNS)))
            else:
                axes.append((name, _parse_range(value, name, text, largest)))
                if kind:
                    _parse_coordinates(kind, axes[-1][1][[0, -1]].tolist())
                units += [(name, unit) for unit in UNITS if unit in value]
        if not 1 <= len(axes) <= 3:
            raise BadRequest("grid: number of ranges", text, f"one to three, such as {GRIDS}")
        cells = math.prod(len(values) for _, values in axes)
        if cells > largest:
            raise BadRequest("grid: number of poses", cells, f"at most {largest}")
        if kind:
            held = JointPose.of(kind, single) if single else JointPose(kind == "motors", ())
            return cls(tuple(axes), replace(held, units=(*held.units, *units)))
        return cls(tuple(axes), _parse_fixed_parts(single, [name for name, _ in axes], text))

    def __str__(self) -> str:
        kind = self.joints and f"{self.joints}:"
        ranges = [f"{name}={values[0]:.6g}:{values[-1]:.6g}:{len(values)}" for name, values in self.axes]
        return kind + ",".join([*ranges, *([self.fixed_text.removeprefix(kind)] if self.fixed_text else [])])

    @property
    def fixed_text(self) -> str:
        """The parts that do not vary, empty if there are none."""
        if isinstance(self.fixed, JointPose) or not {*TURNS} & {*self.names}:
            return str(self.fixed) if self.fixed.given else ""
        turns = dict(zip(TURNS, self.fixed.rpy or (), strict=True))
        single = {name: (angle,) for name, angle in turns.items() if name not in self.names}
        return write_parts({**self.fixed.without(["rpy"]).given, **single})

    @property
    def joints(self) -> str:
        """``joints`` or ``motors`` if their coordinates vary, else empty."""
        return self.fixed.kind if isinstance(self.fixed, JointPose) else ""

    @property
    @recorded(FLAT)
    def values_record(self) -> GridValues:
        """Values of the parts that vary."""
        return cast(GridValues, {self.joints: dict(self.axes)} if self.joints else dict(self.axes))

    @property
    @recorded(As("fixed"))
    def fixed_record(self) -> FixedParts:
        """Parts of the pose that the grid keeps constant."""
        if self.joints:
            return cast(FixedParts, {self.joints: self.fixed.given} if self.fixed.given else {})
        parts = {name: values if name == "rpy" else values[0] for name, values in self.fixed.given.items()}
        return cast(FixedParts, parts)

    @property
    def parts(self) -> set[str]:
        """Parts of the platform's pose that vary or are given; none in a grid of joints."""
        names = {"rpy" if name in TURNS else name for name in self.names}
        return set() if self.joints else names | {*self.fixed.given}

    def list_units(self, robot: Mechanism) -> tuple[str, ...]:
        """Return the unit of each axis for a robot, ``m`` or ``rad``."""
        if self.joints:
            return tuple("m" if robot.joints[name].type.has_translation else "rad" for name in self.names)
        return tuple("rad" if name in ANGLES else "m" for name in self.names)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values on each axis."""
        return tuple(len(values) for _, values in self.axes)

    @property
    def ndim(self) -> int:
        """1 for a line, 2 for a plane, 3 for a box."""
        return len(self.axes)

    @property
    @recorded(As("axes"))
    def names(self) -> tuple[str, ...]:
        """Parts that vary, in order."""
        return tuple(name for name, _ in self.axes)

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def places(self, start: int = 0, stop: int | None = None) -> Array:
        """Return the values of the parts that vary at all cells, or those from ``start`` to before ``stop``, (n, ndim),
        the last axis running fastest."""
        return self.places_at(np.arange(start, self.size if stop is None else min(stop, self.size)))

    def places_at(self, cells: NDArray[np.int64]) -> Array:
        """Return the values of the parts that vary at cells by their number, (n, ndim)."""
        on = np.unravel_index(cells, self.shape)
        return np.stack([values[i] for (_, values), i in zip(self.axes, on, strict=True)], axis=1)

    def poses(self) -> tuple[Pose, ...]:
        """Return the platform's poses of all cells, the last axis running fastest."""
        return self.poses_at(product(*(range(size) for size in self.shape)))

    def poses_at(self, cells: Iterable[Sequence[int]]) -> tuple[Pose, ...]:
        """Return the platform's poses of cells, each given by its index on every axis."""
        return tuple(map(self.pose, self._list_values(cells)))

    def pose(self, values: Sequence[float]) -> Pose:
        """Return the platform's pose with these values of the parts that vary."""
        if isinstance(self.fixed, JointPose):
            raise BadRequest("a grid of poses", str(self), GRIDS)
        given: dict[str, Any] = dict(zip(self.names, values, strict=True))
        if {*TURNS} & given.keys():
            rpy = self.fixed.rpy or (0.0, 0.0, 0.0)
            given["rpy"] = tuple(given.pop(name, angle) for name, angle in zip(TURNS, rpy, strict=True))
        return replace(self.fixed, **given)

    def requests_at(self, cells: Iterable[Sequence[int]]) -> tuple[Pose | JointPose, ...]:
        """Return the poses of cells as they are requested, of joints too."""
        return tuple(map(self.request, self._list_values(cells)))

    def request(self, values: Sequence[float]) -> Pose | JointPose:
        """Return the pose with these values of what varies, as it is requested."""
        if not isinstance(self.fixed, JointPose):
            return self.pose(values)
        varied = tuple((name, (value,)) for name, value in zip(self.names, values, strict=True))
        return replace(self.fixed, values=(*varied, *self.fixed.values))

    def _list_values(self, cells: Iterable[Sequence[int]]) -> Iterator[list[float]]:
        for cell in cells:
            yield [float(values[i]) for (_, values), i in zip(self.axes, cell, strict=True)]


GRIDS = "x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 or motors:NAME=-0.5:0.5:21,NAME=-0.5:0.5:21 (from:to:count)"


def _parse_fixed_parts(single: Mapping[str, str], varied: Sequence[str], text: str) -> Pose:
    """Return the parts of a grid that do not vary; roll, pitch and yaw that nobody gives are zero."""
    parts = {name: value for name, value in single.items() if name not in TURNS}
    if turned := sorted({*TURNS} & {*varied, *single}):
        if other := {"phi", "rpy"} & {*varied, *single}:
            raise BadRequest(f"grid: {', '.join(other)} and {', '.join(turned)} are given", text, "one kind of them")
        parts["rpy"] = "/".join(single.get(name, "0") for name in TURNS)
    elif {"phi", "rpy"} <= {*varied, *single}:
        raise BadRequest("grid: both phi and rpy are given", text, "one of them")
    return Pose.parse(",".join(map("=".join, parts.items()))) if parts else Pose()


def compute_rpy(R: Array) -> tuple[float, float, float]:
    """Return fixed-axis roll, pitch, yaw of a rotation (3, 3); yaw is zero if the pitch is a right angle.

    The roll is read after the yaw is undone, so that the two agree near a right angle as well."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch, yaw = math.atan2(-R[2, 0], level), math.atan2(R[1, 0], R[0, 0]) if level > 1e-12 else 0.0
    s, c = math.sin(yaw), math.cos(yaw)
    return math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1]), pitch, yaw


def normalise_half_turn(angle: float) -> float:
    """Return an angle; 180 degrees, which has no sense, is made positive."""
    return -angle if abs(angle + math.pi) < HALF_TURN_TOL_RAD else angle


def write_parts(parts: Mapping[str, tuple[float, ...]], degrees: bool = False) -> str:
    """Return parts of a pose in one line, angles in radians or ``degrees``."""
    return ",".join(
        f"{name}={'/'.join(_write_number(round(math.degrees(v), 6)) + 'deg' for v in values)}"
        if degrees and name in ("phi", "rpy")
        else f"{name}={'/'.join(map(_write_number, values))}"
        for name, values in parts.items()
    )


def format_coordinates(value: float | Iterable[float]) -> str:
    """Return the coordinate or coordinates of a joint with six digits and nine decimals."""
    return "/".join(f"{round(x, 9) + 0.0:.6g}" for x in (value if isinstance(value, Iterable) else (value,)))


def _write_number(value: float) -> str:
    """Return six digits, and six decimals, so that a typed pose is the same to ``PRINTED_POSE_TOL``."""
    return f"{round(value, 6) + 0.0:.15g}" if abs(value) >= 1 else f"{round(value, 9) + 0.0:.6g}"


def _split_fields(text: str, what: str, known: Sequence[str] = PARTS) -> list[tuple[str, str]]:
    """Return name and value of each part, in order, each name once; any name if none is ``known``."""
    found: list[tuple[str, str]] = []
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise BadRequest(f"{what}: not name=value", part.strip(), EXAMPLE if known else GRIDS)
        if known and name not in known:
            raise BadRequest(f"{what}: unknown part", name, known)
        if name in dict(found):
            raise BadRequest(f"{what}: part given twice", name, "once")
        found.append((name, value))
    return found


def _read_number(text: str, units: Sequence[str]) -> tuple[float, str]:
    """Return a number (metres, radians) and the unit with which it is written, if any of ``units``; raises
    ``ValueError``."""
    unit = next((unit for unit in units if text.endswith(unit)), "")
    number: float = parse_plain_number(text.removesuffix(unit).strip())
    return UNITS[unit](number) if unit else number, unit


def _parse_number(value: str, name: str, text: str) -> float:
    try:
        number, _ = _read_number(value, ("mm",) if name in LENGTHS else ("deg",) if name in ANGLES else tuple(UNITS))
    except ValueError:
        unit = "a number of radians, or of degrees with deg" if name in ANGLES else "a number of metres, or with mm"
        if ":" in value:
            unit += "; from:to:count is for grids"
        raise BadRequest(f"pose {text!r}: {name} is not a number", value, unit) from None
    if not math.isfinite(number):
        raise BadRequest(f"pose {text!r}: {name} is not finite", value, "a finite number")
    return number


def _parse_triple(value: str, text: str) -> Sequence[float]:
    entries = value.split("/")
    if len(entries) != 3:
        raise BadRequest(f"pose {text!r}: rpy", value, "three angles, such as rpy=0.1/0/0 or rpy=10deg/0/0")
    return tuple(_parse_number(entry.strip(), "rpy", text) for entry in entries)


def _parse_range(value: str, name: str, text: str, largest: int) -> Array:
    entries = [entry.strip() for entry in value.split(":")]
    if len(entries) != 3 or not (value.isascii() and entries[2].isdecimal()) or not 2 <= int(entries[2]) <= largest:
        raise BadRequest(f"grid {text!r}: range of {name}", value, f"from:to:count with a count of 2 to {largest}")
    low, high = (_parse_number(entry, name, text) for entry in entries[:2])
    if low == high:
        raise BadRequest(f"grid {text!r}: range of {name} has no extent", value, "two different ends")
    return np.linspace(low, high, int(entries[2]))
