"""The servo loop in text: runs, basins, accuracy, selection of legs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...analysis.accuracy.ranges import ErrorRange
from ...batch.grids import list_grid_poses
from ...geometry.vectors import Array
from ...mechanism.pose import Grid, Pose
from ...tolerances import CONTROLLER_DAMPING_MIN, FIRST_ORDER_POSE_ERROR_MAX, RELATION_ANGLE_TOL
from .tables import (
    GAP,
    NOT_BOUNDED,
    Rows,
    check_bounded,
    format_camera_rows,
    format_dropped_limits,
    format_head_rows,
    format_joint_rows,
    format_known_row,
    format_listing,
    format_table,
    label_of,
)

if TYPE_CHECKING:
    from ...analysis.accuracy.accuracy import Accuracy
    from ...analysis.accuracy.error_map import SpotChecks
    from ...analysis.accuracy.measurement_bounds import MeasurementBounds
    from ...analysis.accuracy.nonlinear_check import NonlinearCheck
    from ...analysis.accuracy.pose_errors import ErrorEllipsoid, PoseErrors
    from ...analysis.accuracy.swept import SweptErrors
    from ...analysis.observed import ObservedRobot
    from ...selection.loop_ends import LoopEnds
    from ...selection.select import Candidate, ModeCount, Selection
    from ...simulation.equilibria.basins import Basins
    from ...simulation.result import Servo

LINEAR_ERROR_DIFFERENCE_TOL = 0.1
"""Relative difference above which samples contradict the linear law."""
NEAR_SINGULARITY_FRACTION = 0.1
"""Fraction of its value at the pose below which a smallest singular value indicates a singularity."""


def format_run(found: Servo) -> str:
    """Return start and goal, the outcome with its reason, the noise, and the crossings."""
    from ...simulation.crossings import CONSTRAINT, LIMIT, TYPE_1, TYPE_2

    passed = {
        TYPE_2: "crosses a Type 2 singularity of the hidden robot",
        TYPE_1: "an observed leg passes a Type 1 singularity into another working mode",
        LIMIT: "an unobserved leg passes a Type 1 singularity",
        CONSTRAINT: "crosses a constraint singularity of the loops",
    }
    run, track, off = found.run, found.track, found.from_goal
    rows = [
        *format_head_rows(found.setup),
        ("from", str(found.start)),
        ("to", str(found.goal)),
        (
            "controller",
            f"gain {found.gain:g} per second, sensor: {found.sense}"
            + ("" if found.depth == "exact" else f", depth: {found.depth}")
            + ("" if found.noise is None else f", noise {found.noise}"),
        ),
        *format_dropped_limits(found.setup),
        *GAP,
        ("outcome", [f"{found.outcome} after {run.times[-1]:.3g} s", found.run_outcome.reason]),
        ("at", str(found.pose)),
        *format_joint_rows(found.coordinates),
    ]
    if found.outcome != "goal":
        rows.append(("", f"{1e3 * off[0]:.4g} mm and {_format_degrees(off[1])} deg from the goal"))
    if found.run_outcome.modes is not None:
        rows.append(
            (
                "assembly modes",
                [
                    *(
                        f"{i}: {mode.pose}" + ("   (the goal)" if mode.goal else "")
                        for i, mode in enumerate(found.run_outcome.modes.modes, 1)
                    ),
                    "numbered as in modes --at with the goal",
                ],
            )
        )
    if found.spread is not None:
        s = found.spread
        rows.append(
            (
                "noise",
                f"within {1e3 * s.metres:.3g} mm and {_format_degrees(s.radians)} deg of this pose in this run, "
                f"root mean square {1e3 * s.rms_metres:.2g} mm and {_format_degrees(s.rms_radians)} deg",
            )
        )
        if s.has_bias:
            rows.append(
                (
                    "",
                    f"mean offset {1e3 * s.offset:.3g} mm, at ({' '.join(f'{value:.4g}' for value in s.mean)})",
                )
            )
    rows.append(("notes" if found.spread is None and found.notes else "", list(found.notes)))
    smallest, at, _ = track.timed(run.times)
    if smallest is not None:
        rows.append(("along the run", f"smallest singular value of Mᵀ {smallest:.3g}, at {at:.3g} s"))
    rows += [
        (
            "",
            f"{passed[each.kind]} at about {run.times[each.place]:.3g} s, near "
            f"{found.pose_of(run.configurations[each.place])}",
        )
        for each in track.passages or ()
    ]
    if track.passages == ():
        met = smallest is not None and smallest < CONTROLLER_DAMPING_MIN
        rows.append(
            (
                "",
                "a Type 2 singularity reached and left on the same side"
                if met
                else "no singularity of the hidden robot crossed",
            )
        )
    return format_listing(rows)


def format_basins(found: Basins) -> str:
    """Return the goal, the starts, the outcomes with their shares, and the method."""
    from ...simulation.equilibria.basins import LETTERS, hindrances

    size = " × ".join(f"{count} {name}" for count, name in zip(found.grid.shape, found.grid.names, strict=True))
    rows = [
        *format_head_rows(found.setup),
        *format_camera_rows(found.setup),
        ("to", str(found.goal)),
        ("starts", f"{found.starts:,} of {size}: {replace(found.grid, fixed=Pose())}"),
        *format_known_row("fixed", describe_held(found.grid, found.setup, found.batched)),
        *GAP,
    ]
    lines = [
        [
            letter,
            each.run_outcome.name,
            f"{each.count:,}",
            f"{100 * each.share:.3g} %",
            "" if each.pose is None else str(each.pose),
            str(each.example),
        ]
        for letter, each in zip(LETTERS, found.ends, strict=False)
    ]
    rows.append(
        ("outcomes", format_table(lines, ("", "outcome", "starts", "share", "at", "example start")).splitlines())
    )
    rows += [
        ("reasons" if number == 0 else "", f"{letter}: {each.run_outcome.reason}")
        for number, (letter, each) in enumerate(zip(LETTERS, found.ends, strict=False))
    ]
    notes = []
    if not found.batched:
        notes.append(f"each start simulated separately: {', '.join(hindrances(found.setup))}")
    elif found.checked:
        notes.append(
            f"integrated together; of {found.checked} starts that were also simulated separately, "
            f"{found.agreed} ended at the same pose"
        )
    if found.batched and found.followed:
        notes.append(f"{found.followed} runs could not be integrated this way and were simulated separately")
    if count := int(np.sum(found.damped)):
        notes.append(
            f"{count:,} runs ({100 * count / found.starts:.2g} %) reach a singularity, where noise decides the outcome"
        )
    rows.append(("method", notes))
    if found.certified is not None:
        drawn = found.certified.length and not found.certified.aside
        part = f": {100 * found.covered:.2g} % of the part of its basin that is drawn" if drawn else ""
        farther = found.certified.undamped_words
        rows.append(("proved radius", [f"{found.certified.words}{part}", *([farther] if farther else [])]))
    return format_listing(rows)


def _format_degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 6):.2g}"


def format_accuracy(found: Accuracy) -> str:
    """Return the measurement bounds, the range of errors over a grid, a block for each single pose."""
    name, _ = format_head_rows(found.setup)
    rows = [
        name,
        (
            "observed",
            ", ".join(f"{label_of(o)} {found.bounds.words(i, o)}" for i, o in enumerate(found.setup.observed)),
        ),
        *format_camera_rows(found.setup),
        ("errors", f"largest over all errors {found.bounds.inside}, to first order"),
        *format_dropped_limits(found.setup),
    ]
    length = found.setup.all_samples.model.length
    if found.field is not None:
        rows += [*GAP, *format_field_rows(found), *_format_grid_limits(found)]
    if found.swept is not None:
        rows += [*GAP, *_format_swept_rows(found, found.swept), *_format_grid_limits(found)]
    for errors, true in zip(found.poses, found.sampled, strict=True):
        rows += [
            *GAP,
            ("pose", str(errors.pose)),
            *format_joint_rows(errors.coordinates, errors.beyond_limits),
            *_format_extent("position", errors.position, 1e3, "mm", length),
            *_format_extent("orientation", errors.orientation, 180 / np.pi, "deg"),
            *([] if true is None else _format_samples(errors, true)),
        ]
    return format_listing(rows)


def _format_grid_limits(found: Accuracy) -> Rows:
    """Return the row of joint limits: how many poses of a grid are beyond them, or those that it does not check."""
    if found.field is not None and found.field.beyond is not None:
        return [("limits", f"{found.field.beyond.sum()} poses beyond joint limits")]
    limited = ", ".join(found.setup.mechanism.stops)
    return [("limits", f"those of {limited} are not checked")] if limited else []


def format_field_rows(found: Accuracy) -> Rows:
    """Return the rows of a grid: size, reached poses, range of the errors, check."""
    field, length = found.field, found.setup.all_samples.model.length
    assert field is not None
    ranges = [
        ErrorRange.of(field.position, FIRST_ORDER_POSE_ERROR_MAX * length),
        ErrorRange.of(field.orientation, FIRST_ORDER_POSE_ERROR_MAX),
    ]
    position = _format_range(ranges[0], field.position, 1e3, "mm")
    orientation = _format_range(ranges[1], field.orientation, 180 / np.pi, "deg")
    reached = f"{np.sum(field.reached)} of {field.reached.size}"
    reached += f"; {field.dependent}" if field.dependent else ""
    return _format_grid_rows(found, field.grid, reached, position, orientation, field.spots, field.gap)


def _format_swept_rows(found: Accuracy, swept: SweptErrors) -> Rows:
    """Return the rows of a grid that is in a file, without medians."""
    tally = swept.tally
    reached = f"{tally.reached} of {swept.grid.size}" + (
        f" ({swept.before} from an interrupted sweep)" if swept.before else ""
    )
    return _format_grid_rows(
        found,
        swept.grid,
        reached,
        _format_range(tally.position, None, 1e3, "mm"),
        _format_range(tally.orientation, None, 180 / np.pi, "deg"),
        swept.spots,
        tally.gap,
    )


def describe_held(grid: Grid, setup: ObservedRobot, as_at_home: bool) -> str | None:
    """Describe the fixed coordinates of a grid: all that do not vary if free ones keep their values at the zero
    configuration (``as_at_home``), else those given and the names of the free ones."""
    motion, typed = setup.motion, grid.fixed_text
    if not as_at_home:
        free = "" if grid.joints else ", ".join(motion.free(grid.parts))
        return (
            (typed or None)
            if not free
            else (f"{typed or 'nothing'}; free, chosen nearest to the zero configuration: {free}")
        )
    ends, _ = list_grid_poses(motion, grid, setup.robot.name, grid.places_at(np.array([0, grid.size - 1])))
    first, last = (dict(part.split("=") for part in str(motion.pose(X)).split(",")) for X in ends)
    given = dict(part.split("=") for part in typed.split(",") if part)
    turned = {"phi", "rpy"} & grid.parts
    return (
        ",".join(
            f"{name}={given.get(name, value)}"
            for name, value in {**first, **given}.items()
            if name in given
            or (value == last[name] and name not in grid.names and not (turned and name in ("phi", "rpy")))
        )
        or None
    )


def _format_grid_rows(
    found: Accuracy, grid: Grid, reached: str, position: str, orientation: str, spots: SpotChecks | None, gap: float
) -> Rows:
    size = " × ".join(f"{count} {name}" for count, name in zip(grid.shape, grid.names, strict=True))
    ranges = ", ".join(
        f"{name} {values[0]:.4g} to {values[-1]:.4g} {unit}"
        for (name, values), unit in zip(grid.axes, grid.list_units(found.setup.robot), strict=True)
    )
    rows = [
        ("poses", f"{size}: {ranges}"),
        *format_known_row("fixed", describe_held(grid, found.setup, spots is not None)),
        ("reached", reached),
        ("position", position),
        ("orientation", orientation),
    ]
    if spots is not None and spots.count:
        rows.append(
            ("checked", f"against Pinocchio at {spots.count} random poses, largest difference {spots.difference:.1e}")
        )
    return [*rows, *(("", line) for line in _describe_bounds(found.bounds, "nowhere", gap))]


def _describe_bounds(blur: MeasurementBounds, where: str, gap: float) -> list[str]:
    """Return a note on bounds that may be too large."""
    return (
        [f"three {blur.each}s or more: upper bounds, {where} more than {_format_percent(gap)} % too large"]
        if (gap > RELATION_ANGLE_TOL)
        else []
    )


def _format_range(found: ErrorRange, errors: Array | None, unit: float, word: str) -> str:
    if not found.moves:
        return "no error: the platform has no such motion"
    text = []
    if found.least is not None and found.largest is not None:
        text.append(f"{unit * found.least:.4g} to {unit * found.largest:.4g} {word}")
        if errors is not None:
            text[0] += f", median {unit * np.median(errors[errors <= found.largest]):.4g}"
    text += [f"{NOT_BOUNDED} at {found.slack} poses"] * (found.slack > 0)
    return "; ".join(
        [*text, *[f"infinite at {found.infinite} poses, where a dof is unobserved"] * (found.infinite > 0)]
    )


def _format_samples(errors: PoseErrors, true: NonlinearCheck) -> Rows:
    met = (
        f"smallest singular value of Mᵀ {true.smallest_singular_value:.3g}"
        if np.isfinite(true.smallest_singular_value)
        else "no Mᵀ"
    )
    if np.isfinite(true.usual):
        near = not true.smallest_singular_value >= max(NEAR_SINGULARITY_FRACTION * true.usual, CONTROLLER_DAMPING_MIN)
        met += f", at the pose {true.usual:.3g}" + (": near a singularity" if near else "")
    else:
        met += "; no Mᵀ at the pose: observed links move while the platform is fixed"
    lines = [
        f"{true.count} error samples give up to {1e3 * true.position:.4g} mm, {np.degrees(true.orientation):.4g} deg",
        met,
    ]
    if true.ended:
        lines.append(
            f"for {len(true.ended)} of them the least-squares minimum disappears, first at {true.ended[0]:.2g} of the "
            "error: a controller leaves it there, by more than computed"
        )
    if true.not_found:
        lines.append(f"{true.not_found} of them were not tracked to the end, as the solver stopped")
    whole = not true.not_found
    if _is_linear_unreliable(true.position, errors.position, whole) or _is_linear_unreliable(
        true.orientation, errors.orientation, whole
    ):
        lines.append("they contradict the maxima above, which are unreliable here")
    return [("samples", lines)]


def _format_extent(name: str, extent: ErrorEllipsoid, unit: float, word: str, length: float = 1.0) -> Rows:
    if not np.isfinite(extent.largest):
        return [(name, "infinite: a dof is unobserved here")]
    if not check_bounded(extent.largest, length):
        return [(name, f"{NOT_BOUNDED}: the cones are too large here, or a singularity is near")]
    if extent.direction is None:
        return [(name, "no error: the platform has no such motion")]
    lines = [f"{unit * extent.largest:.4g} {word}, along {_format_vector(extent.direction)}"]
    if extent.gap > RELATION_ANGLE_TOL:
        lines.append(f"an upper bound, at most {_format_percent(extent.gap)} % too large")
    if extent.anisotropy is not None and extent.least_direction is not None:
        lines.append(
            f"least along {_format_vector(extent.least_direction)}: {unit * extent.least:.4g} {word}, anisotropy "
            f"{extent.anisotropy:.3g}"
        )
    return [(name, lines)]


def _format_percent(gap: float) -> str:
    """Format a fraction as per cent with two digits, rounded up."""
    step = 10.0 ** (math.floor(math.log10(100 * gap)) - 1)
    return f"{math.ceil(100 * gap / step) * step:.2g}"


def _is_linear_unreliable(true: float, linear: ErrorEllipsoid, whole: bool) -> bool:
    """Return True if the largest sampled error contradicts the linear one; a smaller one does so only if the samples
    were tracked to the ``whole`` of their errors."""
    apart = true - linear.largest if not whole else abs(true - linear.largest)
    return np.isfinite(linear.largest) and apart > LINEAR_ERROR_DIFFERENCE_TOL * max(linear.largest, 1e-12)


def _format_vector(vector: Array) -> str:
    return " ".join(f"{value + 0.0:.3f}" for value in np.round(vector, 3))


def format_selection(found: Selection) -> str:
    """Return the displacement, the table of sets, the reasons for discarded ones."""
    observed, sight, blur = found.setup.observed, found.visible_from is not None, found.bounds
    length = found.setup.all_samples.model.length
    cones = dict.fromkeys(f"{np.degrees(cone):.4g}°" for cone in blur.cones)
    angle = (
        next(iter(cones))
        if len(cones) == 1
        else ", ".join(f"{o.leg} {np.degrees(cone):.4g}°" for o, cone in zip(observed, blur.cones, strict=True))
    )
    name, _ = format_head_rows(found.setup)
    wrong = (
        ("cones", f"{angle} about each direction")
        if blur.noise is None
        else ("observed", ", ".join(f"{o.leg} {blur.words(i, o)}" for i, o in enumerate(observed)))
    )
    rows = [
        name,
        ("from", str(found.start)),
        ("to", str(found.goal)),
        wrong,
        *format_dropped_limits(found.setup),
        ("sets", f"{len(found.candidates)}, kept: {len(found.kept)}"),
    ]
    if found.unexamined:
        rows.append(("", f"not examined: {len(found.unexamined)} ({found.left})"))
    if found.visible_from is not None:
        rows.append(("camera", f"on {found.visible_from.reference}"))
    blocks = [format_listing(rows)]
    if found.kept:
        heads = [
            "legs" if blur.noise is None else "observed",
            "others",
            "proved",
            "mm",
            "deg",
            "modes",
            "aspect",
            *(["visible"] if sight else []),
            "run",
        ]
        blocks.append(format_table([_format_row(each, sight, length) for each in found.kept], heads))
        blocks.append(
            "others: stable equilibria found besides the goal; proved: radius around the goal within\n"
            "which runs in its working mode are proved to end at it; mm, deg: largest errors at the\n"
            "goal; modes: assembly modes at start / goal, in brackets those at which the robot was\n"
            "found assembled; – not computed. Best first: by others, by proved radius (equal within\n"
            "a power of two), by mm"
        )
        radii = [
            each.equilibria.radius
            for each in found.kept
            if each.equilibria is not None and each.equilibria.radius is not None
        ]
        points = dict.fromkeys(each.measured for each in radii if each.measured)
        blocks += [f"distances from the goal: {each}" for each in points]
        if found.fewer is not None:
            blocks.append(found.fewer)
    gaps = [
        part.gap
        for each in (*found.kept, *found.unexamined)
        if (errors := each.errors) is not None
        for part in (errors.position, errors.orientation)
    ]
    blocks += _describe_bounds(blur, "none", max(gaps, default=0.0))
    if found.unexamined:
        blocks.append(
            format_table(
                [[_format_row(each, sight, length)[i] for i in (0, 3, 4)] for each in found.unexamined],
                ["not examined", "mm", "deg"],
            )
        )
    discarded = [each for each in found.candidates if each.discarded is not None]
    if discarded:
        blocks.append(
            format_table([(", ".join(each.legs), str(each.discarded)) for each in discarded], ("discarded", "reason"))
        )
    return "\n\n".join(blocks)


def _format_row(each: Candidate, sight: bool, length: float) -> list[str]:
    errors = each.errors
    assert errors is not None
    seen = [] if not sight else ["–" if each.seen is None else f"{100 * min(each.seen.values()):.0f} %"]
    position, orientation = errors.position.largest, errors.orientation.largest
    return [
        ", ".join(each.legs),
        *_describe_ends(each.equilibria),
        f"{1e3 * position:.4g}" if check_bounded(position, length) else "not bounded",
        f"{np.degrees(orientation):.4g}" if check_bounded(orientation) else "not bounded",
        f"{_describe_modes(each.start_modes)} / {_describe_modes(each.goal_modes)}",
        "–" if each.aspect is None else each.aspect.verdict,
        *seen,
        "–" if each.run is None else each.run.verdict,
    ]


def _describe_ends(ends: LoopEnds | None) -> list[str]:
    """Return the number of other stable equilibria, and the proved attraction radius."""
    if ends is None or ends.others is None:
        return ["–", "–"]
    if ends.radius is None or not ends.length:
        return [str(len(ends.others)), "–" if ends.radius is None else "undecided"]
    angle = ends.radius.angle
    turn = "" if angle is None else f", {np.degrees(angle):.2g}°"
    return [str(len(ends.others)), f"{1e3 * ends.length:.3g} mm{turn}"]


def _describe_modes(modes: ModeCount | None) -> str:
    return "–" if modes is None or modes.count is None else f"{modes.count} ({modes.reachable})"
