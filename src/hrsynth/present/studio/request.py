"""Request of the studio, read and checked field by field: the robot, the observed legs, the configuration."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.derive import Derivation, derive
from ...analysis.observed import ObservedRobot
from ...analysis.pose_requests import observe
from ...description import list_robots, load
from ...description.example_data import PREFIX
from ...errors import BadRequest, LoopClosureFailure
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.pinocchio_model import PinocchioModel
from ...mechanism import Mechanism
from ...results import Value
from ...tolerances import CACHED_OBSERVED_ROBOTS_COUNT, HIDDEN_ROBOT_RESIDUAL_TOL, POSE_VALUE_MAX
from ..view.states import Mover, RealAndHiddenState

STUDIO_NAME_CHARACTERS_MAX = 500
"""Longest name in a request of the studio (characters)."""
STUDIO_LIST_NAMES_MAX = 200
"""Longest list of names in a request."""

SHIPPED, FILE, FOLDER, GIVEN = "shipped", "file", "folder", "given"
LISTS, TEXTS = ("motors", "close", "freeze", "args"), ("base", "platform", "keyframe", "unit", "model")
OPTIONS = (*TEXTS, *LISTS, "tolerance", "as_written")
"""Options of a robot file in a request, as in ``hrsynth.load``."""


@dataclass(frozen=True)
class RobotSource:
    """Source of a robot: the argument of ``hrsynth.load``, its options, and the time stamp of its file."""

    robot: str
    options: tuple[tuple[str, Any], ...]
    written: tuple[int, int] | None = None

    def load(self) -> Mechanism:
        """Return the mechanism; it is read again only if its file changes."""
        return _load(self)


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def _load(source: RobotSource) -> Mechanism:
    return load(source.robot, **dict(source.options))


@dataclass(frozen=True, eq=False, repr=False)
class Request(Value):
    """Request with its ``fields``, and the folders of its robots (see :class:`.AnalysisService`). Every
    field is read by one of these methods; all raise ``BadRequest`` in one line."""

    fields: Mapping[str, Any]
    folder: Path | None = None
    uploads: Path | None = None
    given: Mapping[str, Any] | None = None

    # Fields of any request

    def has_flag(self, name: str) -> bool:
        """Return a truth value, False by default."""
        found = self.fields.get(name)
        if found is not None and not isinstance(found, bool):
            raise BadRequest(name, found, "true or false")
        return bool(found)

    def text(self, name: str, allowed: Iterable[str] | None = None) -> str | None:
        """A short text, one of those ``allowed``."""
        found = self.fields.get(name)
        return None if found is None else _require_text(name, found, allowed)

    def number(self, name: str, low: float, high: float) -> float | None:
        """A number from ``low`` to ``high``."""
        found = self.fields.get(name)
        return None if found is None else _require_number(name, found, low, high)

    def count(self, name: str, low: int, high: int) -> int | None:
        """A whole number from ``low`` to ``high``."""
        found = self.number(name, low, high)
        if found is not None and found != int(found):
            raise BadRequest(name, found, "a whole number")
        return None if found is None else int(found)

    def vector(self, name: str, size: int) -> Array | None:
        """So many finite numbers."""
        found = self.fields.get(name)
        return None if found is None else _require_vector(name, found, size)

    # The robot

    @cached_property
    def source(self) -> RobotSource:
        """Return the source of the robot."""
        said = self.fields.get("robot")
        if not isinstance(said, dict):
            raise BadRequest("robot", said, "an object with a field `source`")
        kind, _, name = _require_text("source of a robot", said.get("source", "")).partition(":")
        options = _list_options(said.get("options"))
        if kind == SHIPPED:
            if name not in list_robots():
                raise BadRequest("no such shipped robot", name, "a name of the gallery")
            return RobotSource(name, options)
        if kind == GIVEN:
            if self.given is None:
                raise BadRequest(
                    "source given: the command line names no robot", remedy="Choose a robot of the gallery."
                )
            if name not in ("", self.given_name):
                raise BadRequest("the robot of the command line", self.given_name, name)
            own = {**dict(_list_options(self.given.get("options"))), **dict(options)}
            return _find_source(str(self.given["robot"]), tuple(sorted(own.items())))
        if kind == PREFIX.removesuffix(":"):
            return RobotSource(f"{PREFIX}{name}", options)
        if self.fence is None:
            raise BadRequest("source of a robot", said.get("source"), "shipped:NAME, file:NAME, folder:NAME or given")
        return _find_source(str(locate_inside(self.fence, name)), options)

    @property
    def given_name(self) -> str:
        """Return the name of the robot of the command line, of a file without its folder."""
        return "" if self.given is None else Path(str(self.given["robot"])).name

    def describe_link(self) -> dict[str, Any]:
        """Return source and options of the robot for a link, which may be opened by another server."""
        said = str(self.fields["robot"]["source"])
        if said.partition(":")[0] == GIVEN:
            robot = self.source.robot
            said = f"{SHIPPED}:{robot}" if robot in list_robots() else f"{GIVEN}:{self.given_name}"
        return {"source": said, "options": dict(self.source.options)}

    @cached_property
    def fence(self) -> Path | None:
        """The folder that all files of a robot must lie in; None for a shipped robot, and for that of the command
        line."""
        said = self.fields.get("robot")
        kind = str(said.get("source", "")).partition(":")[0] if isinstance(said, dict) else ""
        return {FILE: self.uploads, FOLDER: self.folder}.get(kind)

    @cached_property
    def mechanism(self) -> Mechanism:
        """Return the robot as read."""
        return self.source.load()

    @cached_property
    def watched(self) -> tuple[str, ...] | None:
        """Return the names of the observed legs; None: those of the file."""
        found = self.fields.get("watch")
        return None if found is None else _require_texts("watch", found)

    @cached_property
    def camera(self) -> str | None:
        """The link that carries the camera, None for the base."""
        return self.text("camera")

    @cached_property
    def setup(self) -> ObservedRobot:
        """Return the observed robot; with all legs if none is observed."""
        return observe(self.mechanism, self.watched or None, self.camera).by_segments("the studio")

    @property
    def has_no_observation(self) -> bool:
        """Return True if no leg is observed."""
        return self.watched == ()

    def seeing(self) -> ObservedRobot:
        """Return the observed robot; raise ``BadRequest`` if no leg is observed."""
        if self.has_no_observation:
            raise BadRequest("no leg is observed", remedy="Observe at least one leg.")
        return self.setup

    @cached_property
    def derivation(self) -> Derivation:
        """Return the derivation of the hidden robot."""
        return derive(self.seeing(), unchecked=False)

    def mover(self, hidden: bool = False) -> Mover:
        """Return the mover of the robot, and with ``hidden`` of its hidden robot."""
        other = self.derivation.hidden if hidden and not self.has_no_observation else None
        return _make_mover(self.setup, other)

    @property
    def ends(self) -> tuple[tuple[RealAndHiddenState, RealAndHiddenState], ...]:
        """Return the ends of each slider; they do not depend on the observed legs."""
        return _make_mover(observe(self.mechanism, None, self.camera), None).ends

    # Where it is

    def here(self, mover: Mover, field: str = "here") -> RealAndHiddenState:
        """Return a configuration, by default the zero configuration; a hidden robot of other legs is ignored. Raise
        ``BadRequest`` if loops are not closed."""
        found = self.fields.get(field)
        if found is None:
            return mover.home
        if not isinstance(found, dict):
            raise BadRequest(field, found, "the field of an answer, or null")
        model = mover.home.real.model
        q = _require_configuration(model, found.get("q"))
        try:
            at = ClosedConfiguration.of(model, q)
        except LoopClosureFailure as error:
            raise BadRequest(
                f"{field}: the loops are not closed: residual", f"{error.residual:.2g}", f"at most {error.tolerance:g}"
            ) from None
        other = found.get("hidden")
        if mover.hidden is None:
            return RealAndHiddenState(at)
        if isinstance(other, dict) and other.get("legs") == list(self.setup.labels):
            q = _require_configuration(mover.hidden, other.get("q"))
            posed = mover.beside(at, q)
            if posed is None:
                raise BadRequest(
                    f"{field}: hidden robot and platform differ by more than {HIDDEN_ROBOT_RESIDUAL_TOL:g}"
                )
            return posed
        if other is not None and not isinstance(other, dict):
            raise BadRequest(f"{field}: hidden", other, "the field of an answer, or null")
        return mover.with_hidden(at)

    def describe_here(self, posed: RealAndHiddenState) -> dict[str, Any]:
        """Return the field ``here`` of an answer."""
        hidden = None if posed.hidden is None else {"legs": list(self.setup.labels), "q": posed.hidden.tolist()}
        return {"q": posed.real.q.tolist(), "hidden": hidden}


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def _make_mover(setup: ObservedRobot, hidden: Mechanism | None) -> Mover:
    return Mover.of(setup, hidden)


def locate_inside(root: Path, name: str) -> Path:
    """The file of a name in a folder, links resolved; raises ``BadRequest`` for one that lies outside of it or is not
    there."""
    try:
        top, path = root.resolve(), (root / name).resolve()
        if name and "\0" not in name and path.is_relative_to(top) and path != top and path.exists():
            return path
    except (OSError, ValueError, RuntimeError):
        pass
    raise BadRequest("no such file", name, "an uploaded file, or one of the folder")


def _find_source(robot: str, options: tuple[tuple[str, Any], ...]) -> RobotSource:
    """A robot by its path, or by a name."""
    try:
        state = Path(robot).stat()
    except (OSError, ValueError):
        return RobotSource(robot, options)
    return RobotSource(robot, options, (state.st_mtime_ns, state.st_size))


def _list_options(found: Any) -> tuple[tuple[str, Any], ...]:
    """The options that are set, sorted by name."""
    if found is None:
        return ()
    if not isinstance(found, dict):
        raise BadRequest("options of a robot", found, "an object")
    set_: dict[str, Any] = {}
    for name, value in found.items():
        if name not in OPTIONS:
            raise BadRequest("options of a robot: unknown option", name, OPTIONS)
        if value is None or value == [] or value is False:
            continue
        if name in LISTS:
            set_[name] = _require_texts(name, value)
        elif name in TEXTS:
            set_[name] = _require_text(name, value)
        elif name == "tolerance":
            set_[name] = _require_number(name, value, 0.0, 1.0)
        elif value is not True:
            raise BadRequest(name, value, "true or false")
        else:
            set_[name] = True
    # a file beside the robot's own would be read: FILE.srdf:NAME
    if "/" in set_.get("keyframe", "") or "\\" in set_.get("keyframe", ""):
        raise BadRequest("keyframe", set_["keyframe"], "the name of a keyframe")
    return tuple(sorted(set_.items()))


def _require_text(name: str, found: Any, allowed: Iterable[str] | None = None) -> str:
    if not isinstance(found, str) or len(found) > STUDIO_NAME_CHARACTERS_MAX or "\0" in found:
        raise BadRequest(name, found, f"a text of at most {STUDIO_NAME_CHARACTERS_MAX} characters")
    if allowed is not None and found not in tuple(allowed):
        raise BadRequest(name, found, tuple(allowed))
    return found


def _require_texts(name: str, found: Any) -> tuple[str, ...]:
    if not isinstance(found, list) or len(found) > STUDIO_LIST_NAMES_MAX:
        raise BadRequest(name, found, f"a list of at most {STUDIO_LIST_NAMES_MAX} names")
    return tuple(_require_text(name, each) for each in found)


def _require_number(name: str, found: Any, low: float, high: float) -> float:
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise BadRequest(name, found, "a number")
    if not (math.isfinite(found) if isinstance(found, float) else True) or not low <= found <= high:
        raise BadRequest(name, found, f"a number from {low:g} to {high:g}")
    return float(found)


def _require_vector(name: str, found: Any, size: int) -> Array:
    if not isinstance(found, list) or len(found) != size:
        raise BadRequest(name, found, f"a list of {size} numbers")
    return np.array([_require_number(name, each, -POSE_VALUE_MAX, POSE_VALUE_MAX) for each in found])


def _require_configuration(model: PinocchioModel, found: Any) -> Array:
    """Read a configuration of a model: of its size, finite, with unit quaternions."""
    q = _require_vector("here: coordinates", found, len(model.q0))
    if not model.is_normalized(q):
        raise BadRequest("here: a rotation is not a unit quaternion")
    return q
