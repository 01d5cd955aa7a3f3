"""Parts of a report beside the derivation: leg sets, singularities, assembly modes, accuracy.

Each part is computed separately; one that is refused leaves a sentence with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from ...analysis.accuracy.accuracy import Accuracy, require_full_observation
from ...analysis.accuracy.error_map import Mapper
from ...analysis.accuracy.measurement_bounds import MeasurementBounds
from ...analysis.controllability import Legs, legs
from ...analysis.derive import Derivation
from ...analysis.modes.modes import AssemblyModes, modes
from ...analysis.observed import ObservedRobot
from ...analysis.singularity.singularities import Singularity, singularities
from ...errors import BadRequest, HrsynthError, NoResult
from ...mechanism.cameras import CameraObservation
from ...mechanism.pose import Pose
from ..view.scale import CONE_TEXT

REPORT_RANDOM_POSES_COUNT = 500
"""Random poses at which the singularity condition is checked."""
PIXELS, LENGTHS = "0.5px", "1mm"
"""Errors of image points and of lengths."""
MAP_SIDE, COARSE_MAP_SIDE = 101, 25
"""Poses per side of the map, with and without batched evaluation."""

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class RefusedPart:
    """Part that was refused, with the reason."""

    reason: str


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a report, each a result or the reason for its absence."""

    legs: Legs | RefusedPart
    singularity: Singularity | RefusedPart
    modes: AssemblyModes | RefusedPart
    accuracy: Accuracy | RefusedPart


def collect_report_parts(found: Derivation, seed: int) -> Parts:
    """Compute the parts of a report for the observed robot of the derivation, with its ``seed``."""
    setup, name = found.setup, found.robot.name
    return Parts(
        ask(name, lambda: legs(setup, seed=seed)),
        ask(name, lambda: singularities(setup, points=REPORT_RANDOM_POSES_COUNT, seed=seed)),
        ask(name, lambda: modes(setup, seed=seed)),
        ask(name, lambda: map_error_plane(setup, seed)),
    )


def ask(robot: str, question: Callable[[], Answer]) -> Answer | RefusedPart:
    """Return the result of a part, or the reason of its refusal."""
    try:
        return question()
    except HrsynthError as error:
        return RefusedPart(describe_refusal(error, robot))


def describe_refusal(error: HrsynthError, robot: str) -> str:
    """Return the message of an error without the name of the robot and the remedy."""
    return (error.problem if isinstance(error, BadRequest | NoResult) else str(error)).removeprefix(f"{robot}: ")


def map_error_plane(setup: ObservedRobot, seed: int) -> Accuracy:
    """Compute the error maxima over a plane of poses through the zero configuration."""
    units: set[str] = set()
    for each in setup.observed:
        focal = isinstance(each, CameraObservation) and each.camera is not None and each.camera.focal
        in_picture = "px" in each.found_by and (focal or len(each.found_by) == 1)
        units |= {"px"} if in_picture else each.found_by - {"px"}
    usual = ",".join(noise for noise, unit in ((CONE_TEXT, "rad"), (PIXELS, "px"), (LENGTHS, "m")) if unit in units)
    blur = MeasurementBounds.of(None, usual, setup.observed)
    require_full_observation(setup)
    mapper = Mapper(setup, blur)
    grid = mapper.plane(Pose(), COARSE_MAP_SIDE if mapper.batch is None else MAP_SIDE)
    return Accuracy(setup, blur, (), (), mapper.over(grid, seed))
