"""Error maxima in text."""

from __future__ import annotations

import numpy as np

from ...analysis.accuracy.accuracy import Accuracy
from ...analysis.accuracy.field import Field
from ...analysis.accuracy.pose_errors import Extent, PoseErrors
from ...analysis.accuracy.sampled import Sampled
from ...geometry.vectors import Array
from ...tolerances import DAMPED
from .tables import listing

FAR = 0.1
"""Relative difference from which samples are said to part from the linear law."""
NEAR = 0.1
"""Part of its value at the pose below which a smallest singular value is said to be near zero."""


def accuracy(found: Accuracy, file: str | None = None) -> str:
    """The cones, the range of errors over a grid, a block for each single pose."""
    setting = found.setting
    rows = [("robot", f"{setting.robot.name}   {setting.anatomy.architecture()}"),
            ("observed", ", ".join(f"{o.leg} ({o.link}) within {np.degrees(cone):.4g}°"
                                   for o, cone in zip(setting.observed, found.cones, strict=True))),
            ("errors", "largest over all errors of the directions inside their cones, to first order")]
    if setting.mechanism.reference != setting.mechanism.base:
        rows.insert(2, ("camera on", setting.mechanism.reference))
    if found.field is not None:
        rows += [("", ""), *field_rows(found.field)]
    for errors, true in zip(found.poses, found.sampled, strict=True):
        rows += [("", ""), ("pose", str(errors.pose)), *_pose(errors, true)]
    if file is not None:
        rows += [("", ""), ("written", file)]
    return listing(rows)


def field_rows(field: Field) -> list[tuple[str, str]]:
    """What a grid holds: its size, what is reached of it, the range of the errors, how they were checked."""
    grid = field.grid
    size = " × ".join(f"{count} {name}" for count, name in zip(grid.shape, grid.names, strict=True))
    ranges = ", ".join(f"{name} {values[0]:.4g} to {values[-1]:.4g}" for name, values in grid.axes)
    fixed = str(grid.fixed)
    rows = [("poses", f"{size}: {ranges}" + (f"; {fixed}" if fixed else "")),
            ("reached", f"{np.sum(field.reached)} of {field.reached.size}"),
            ("position", _range(1e3 * field.position, "mm")),
            ("orientation", _range(np.degrees(field.orientation), "degrees"))]
    if field.spots is not None and field.spots.count:
        rows.append(("checked", f"against Pinocchio at {field.spots.count} random poses, largest difference "
                                f"{field.spots.difference:.1e}"))
    if field.gap > 1e-9:
        rows.append(("", f"three cones and more: upper bounds, nowhere more than {100 * field.gap:.2g} % too large"))
    return rows


def _range(errors: Array, unit: str) -> str:
    finite = errors[np.isfinite(errors)]
    if not np.nanmax(errors, initial=0.0) > 0:
        return "no errors: the platform does not move so"
    text = (f"{finite.min():.4g} to {finite.max():.4g} {unit}, median {np.median(finite):.4g}" if finite.size
            else "infinite")
    lost = int(np.sum(np.isinf(errors)))
    return text + (f"; infinite at {lost} poses, where a freedom is lost" if lost and finite.size else "")


def _pose(errors: PoseErrors, true: Sampled | None) -> list[tuple[str, str]]:
    rows = [*_extent("position", errors.position, 1e3, "mm"),
            *_extent("orientation", errors.orientation, 180 / np.pi, "degrees")]
    return rows if true is None else rows + _samples(errors, true)


def _samples(errors: PoseErrors, true: Sampled) -> list[tuple[str, str]]:
    rows = [("samples", f"{true.count} true errors give up to {1e3 * true.position:.4g} mm, "
                        f"{np.degrees(true.orientation):.4g} degrees"),
            ("", f"smallest singular value of Mᵀ met {true.weakest:.3g}, at the pose {true.usual:.3g}"
                 + (": a singularity is near" if not true.weakest >= max(NEAR * true.usual, DAMPED) else ""))]
    if true.ended:
        rows.append(("", f"for {len(true.ended)} of them the best fit becomes flat on the way, first at "
                         f"{true.ended[0]:.2g} of the error: a controller slips away there, and further than is told"))
    if true.not_found:
        rows.append(("", f"{true.not_found} of them were not followed to the end: the solver gave up, which says "
                         "nothing of the robot"))
    if _apart(true.position, errors.position) or _apart(true.orientation, errors.orientation):
        rows.append(("", "they part from the maxima above, which are not to be relied on here"))
    return rows


def _extent(name: str, extent: Extent, unit: float, word: str) -> list[tuple[str, str]]:
    if not np.isfinite(extent.largest):
        return [(name, "infinite: a freedom is lost here")]
    if extent.direction is None:
        return [(name, "no error: the platform does not move so")]
    rows = [(name, f"{unit * extent.largest:.4g} {word}, along {_vector(extent.direction)}")]
    if extent.anisotropy is not None and extent.least_direction is not None:
        rows.append(("", f"least along {_vector(extent.least_direction)}: {unit * extent.least:.4g} {word}, "
                         f"anisotropy {extent.anisotropy:.3g}"))
    return rows


def _apart(true: float, linear: Extent) -> bool:
    return np.isfinite(linear.largest) and abs(true - linear.largest) > FAR * max(linear.largest, 1e-12)


def _vector(vector: Array) -> str:
    return " ".join(f"{value + 0.0:.3f}" for value in np.round(vector, 3))
