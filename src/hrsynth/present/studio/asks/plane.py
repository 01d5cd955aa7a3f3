"""Values over a plane of poses: errors of the platform, singularity distance, the Type 2 locus."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from ....analysis.accuracy.accuracy import require_full_observation
from ....analysis.accuracy.error_map import Mapper
from ....analysis.accuracy.measurement_bounds import MeasurementBounds
from ....analysis.accuracy.pose_errors import search_largest_errors
from ....analysis.singularity.condition_check import compute_smallest_value
from ....batch.pose_continuation import spread
from ....errors import BadRequest
from ....geometry.vectors import Array, convert_to_lists
from ....kinematics.configuration import ClosedConfiguration
from ....kinematics.continuation import track
from ....kinematics.coordinates import Coordinates
from ....mechanism.pose import SCALARS, Grid, Pose
from ....results import Value
from ....tolerances import POSE_VALUE_MAX, RELATION_ANGLE_TOL, SLIDER_TARGET_TOL
from ...text.tables import NOT_BOUNDED, check_bounded
from ...view.scale import CONE, CONE_TEXT, SIGNS, STEPS, choose_error_unit, round_digits
from ...view.states import Mover
from ..commands import NONE, format_commands, format_digits, is_reproduced_by_pose
from ..request import Request

LOCUS_SINGULAR_VALUE_FRACTION = 0.2
"""Fraction of the median of the smallest singular value of Mᵀ in a plane, below which a sign change of a determinant is
a zero."""
STUDIO_PLANE_SIDE_MAX = 101
"""Poses per side of a plane of the studio."""
STUDIO_SWEEP_SIDE_MAX = 16
"""Poses per side of a plane that is solved pose by pose."""

ACCURACY, DISTANCE = "accuracy", "distance"
DISTANCES = (0.01, 0.03, 0.1, 0.3)
"""Steps of the singularity distance (the smallest singular value of Mᵀ, characteristic lengths)."""
PLANE_CHECKED_POSES_COUNT = 2
"""Poses at which the batch is compared with Pinocchio; few, as a dragged plane is computed often."""
PLANE_SIDE_VALUES_COUNT = 24
"""Values per side, by default."""


@dataclass(frozen=True, eq=False, repr=False)
class PoseField(Value):
    """Values (n, n) over a plane, NaN where no pose is reached, the first index along the first coordinate, and the
    segments (k, 2, 2) of the Type 2 locus, in the two coordinates."""

    values: Array
    locus: Array


def answer(request: Request) -> dict[str, Any]:
    """Return a plane of two coordinates, the others as at ``here``, the third at ``at``."""
    setup, mover = request.seeing(), request.mover()
    require_full_observation(setup)
    here = request.here(mover)
    kind = request.text("kind", (ACCURACY, DISTANCE)) or ACCURACY
    pair = _pair(mover, request.text("of"))
    size = request.count("size", 2, STUDIO_PLANE_SIDE_MAX) or PLANE_SIDE_VALUES_COUNT
    values = mover.read(here)
    third = [i for i in range(len(values)) if i not in pair]
    ranges = [_read_slider_range(request, mover, i) for i in pair]
    at = request.number("at", -POSE_VALUE_MAX, POSE_VALUE_MAX)
    if at is not None and third:
        low, high = _read_slider_range(request, mover, third[0])
        if not low - SLIDER_TARGET_TOL <= at <= high + SLIDER_TARGET_TOL:
            raise BadRequest("at", at, f"{low:.6g} to {high:.6g}")
        values[third[0]] = at
    mapper, unit = Mapper(setup, MeasurementBounds(np.full(len(setup.observed), CONE))), choose_error_unit(setup)
    known = mapper.batch is not None and _is_closed_form_solution(mover, here.real)
    cells = size if known else min(size, STUDIO_SWEEP_SIDE_MAX)
    grid = build_plane_grid(mover, here.real, pair, values, ranges, cells)
    if grid is not None and known:
        found = map_by_batch(mapper, grid, kind, unit)
    else:
        found = map_one_by_one(mover, here.real, pair, values, ranges, cells, kind, unit)
    same = NONE
    if grid is not None and (known or is_reproduced_by_pose(setup, here.real)):
        text = format_grid(grid)
        same = (
            format_commands(request, "accuracy", cone=CONE_TEXT, grid=text)
            if kind == ACCURACY
            else format_commands(request, "check", grid=text)
        )
    place = _make_placer(mover, pair, values)
    (a, b), (c, d) = (map(float, ends) for ends in ranges)
    across = mover.coordinates.places[third[0]] if third else None
    return {
        "corners": [place(x, y).tolist() for x, y in ((a, c), (b, c), (b, d), (a, d))],
        "n": cells,
        "values": convert_to_lists(found.values.T),
        "unit": unit if kind == ACCURACY else "",
        "steps": list(STEPS[unit] if kind == ACCURACY else DISTANCES),
        "falling": kind == DISTANCE,
        "at": float(values[third[0]]) if third else None,
        "normal": np.eye(3)[across].tolist() if across is not None and across < 3 else None,
        "locus": [[place(*point).tolist() for point in segment] for segment in found.locus],
        "words": _describe_plane(kind, unit, found, here.real.model.length)
        + ("" if grid is not None and known else SINGLY),
        "of": [mover.coordinates.names[i] for i in pair],
        **same,
    }


SINGLY = " The poses were computed one by one: the Type 2 locus between them is not drawn."


def _read_slider_range(request: Request, mover: Mover, index: int) -> Array:
    """Return the least and the largest value of a coordinate's slider, (2,)."""
    return np.sort([mover.read(end)[index] for end in request.ends[index]])


def _pair(mover: Mover, said: str | None) -> tuple[int, int]:
    """Return the two coordinates whose names are joined in ``said``, by default the first two."""
    names = mover.coordinates.names
    if len(names) < 2:
        raise BadRequest("of: the platform has fewer than two dof, so no plane", said)
    found = [pair for pair in permutations(range(len(names)), 2) if said in (None, names[pair[0]] + names[pair[1]])]
    if not found:
        raise BadRequest("of", said, [names[i] + names[j] for i, j in permutations(range(len(names)), 2)])
    return found[0][0], found[0][1]


def _is_closed_form_solution(mover: Mover, at: ClosedConfiguration) -> bool:
    """Return True if a configuration is that of the closed forms at its pose: all legs have the same directions. Rods
    may be turned about themselves."""
    placer, question = mover.setup.placer, mover.setup.all_samples.observation_model
    if placer is None:
        return False
    (found,) = placer.configurations(at.pose(mover.setup.motion.link)[None])
    if found is None:
        return False
    apart, _ = question.target(found).error_and_jacobian(at.model, at.q)
    return float(np.linalg.norm(apart)) < RELATION_ANGLE_TOL


def build_plane_grid(
    mover: Mover, here: ClosedConfiguration, pair: tuple[int, int], values: Array, ranges: list[Array], size: int
) -> Grid | None:
    """Return the plane as a grid of poses, None if coordinates of a pose cannot express it."""
    names, motion = mover.coordinates.names, mover.setup.motion
    turns = [i for i, name in enumerate(names) if name not in SCALARS]
    if turns and (
        set(turns) & set(pair)
        or not np.array_equal(values[turns], mover.coordinates.read(here.pose(motion.link))[turns])
    ):
        return None
    parts: dict[str, Any] = {
        name: float(f"{value:.9g}")
        for i, (name, value) in enumerate(zip(names, values, strict=True))
        if i not in pair and i not in turns
    }
    if turns:
        parts["rpy"] = motion.pose(here.pose(motion.link)).rpy
    axes = tuple((names[i], np.linspace(ends[0], ends[1], size)) for i, ends in zip(pair, ranges, strict=True))
    return Grid(axes, Pose(**parts))


def format_grid(grid: Grid) -> str:
    """Format the grid as an option."""
    held = [f"{name}={'/'.join(map(format_digits, values))}" for name, values in grid.fixed.given.items()]
    return ",".join(
        [
            *(
                f"{name}={format_digits(values[0])}:{format_digits(values[-1])}:{len(values)}"
                for name, values in grid.axes
            ),
            *held,
        ]
    )


def map_by_batch(mapper: Mapper, grid: Grid, kind: str, unit: str) -> PoseField:
    """Evaluate the plane by closed forms, compared with Pinocchio at some poses."""
    found = mapper.over(grid, 0, PLANE_CHECKED_POSES_COUNT)
    table = found.smallest if kind == DISTANCE else _convert_errors(found.position, found.orientation, unit)
    signs, (x, y) = found.determinant, (values for _, values in grid.axes)
    if signs is None or found.smallest_at is None:
        return PoseField(table, np.zeros((0, 2, 2)))
    segments = np.array([*_find_zero_segments(x, y, signs)]).reshape(-1, 2, 2)
    # a determinant changes its sign as well where it is infinite (Type 1): there Mᵀ does not lose its rank
    least = found.smallest_at(segments.mean(axis=1)) if len(segments) else np.zeros(0)
    usual = float(np.nanmedian(found.smallest))
    return PoseField(table, segments[least < LOCUS_SINGULAR_VALUE_FRACTION * usual])


def map_one_by_one(
    mover: Mover,
    here: ClosedConfiguration,
    pair: tuple[int, int],
    values: Array,
    ranges: list[Array],
    size: int,
    kind: str,
    unit: str,
) -> PoseField:
    """Evaluate the plane pose by pose, each tracked from a neighbour, in the working mode of ``here``."""
    setup, motion, question = mover.setup, mover.setup.motion, mover.setup.samples.observation_model
    aims = []
    axes = [np.linspace(ends[0], ends[1], size) for ends in ranges]
    for point in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2):
        wanted = values.copy()
        wanted[list(pair)] = point
        aims.append(Coordinates(motion, mover.coordinates.places, wanted))

    def lead(cell: int, origin: ClosedConfiguration, halvings: int) -> ClosedConfiguration | None:
        there, came = track(origin, motion, aims[cell], halvings)
        return there if came == 1 else None

    blur = MeasurementBounds(np.full(len(setup.observed), CONE))
    found = np.full((2, len(aims)), np.nan)
    for i, at in enumerate(spread(here, (size, size), aims, lead)):
        if at is not None:
            found[:, i] = (
                (compute_smallest_value(at, question), np.nan)
                if kind == DISTANCE
                else search_largest_errors(at, question, blur)
            )
    table = found[0] if kind == DISTANCE else _convert_errors(found[0], found[1], unit)
    return PoseField(table.reshape(size, size), np.zeros((0, 2, 2)))


def _convert_errors(position: Array, orientation: Array, unit: str) -> Array:
    """Return errors in the unit in which they are shown; unbounded ones exceed any step."""
    found = 1e3 * position if unit == "mm" else np.degrees(orientation)
    return np.where(np.isinf(position) | np.isinf(orientation), POSE_VALUE_MAX, found)


def _find_zero_segments(x: Array, y: Array, values: Array) -> Iterator[Array]:
    """Yield segments (2, 2) on which values (nx, ny) vanish, between the sides of each cell that they cross."""
    for i, j in np.argwhere(np.isfinite(values[:-1, :-1] + values[1:, :-1] + values[:-1, 1:] + values[1:, 1:])):
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1), (i, j)]
        met = []
        for (a, b), (c, d) in pairwise(corners):
            if values[a, b] * values[c, d] < 0:
                part = values[a, b] / (values[a, b] - values[c, d])
                met.append([x[a] + part * (x[c] - x[a]), y[b] + part * (y[d] - y[b])])
        for k in range(0, len(met) - 1, 2):
            yield np.array(met[k : k + 2])


def _make_placer(mover: Mover, pair: tuple[int, int], values: Array) -> Callable[[float, float], Array]:
    """Return the function that draws points of the plane; a rotation is a distance along its axis, one radian the
    characteristic length."""
    motion, length = mover.setup.motion, mover.home.real.model.length
    ways, origin = np.eye(6, 3), motion.position(mover.home.real.pose(motion.link))
    ways[3:] = length * np.eye(3)
    if motion.rotations.shape[1] == 1:
        ways[3] = length * motion.normal
    places = mover.coordinates.places
    for i, number in enumerate(places):
        if i not in pair and number < 3:
            origin[number] = values[i]
    for i in pair:
        if places[i] < 3:
            origin[places[i]] = 0.0

    def place(a: float, b: float) -> Array:
        return origin + a * ways[places[pair[0]]] + b * ways[places[pair[1]]]

    return place


def _describe_plane(kind: str, unit: str, found: PoseField, length: float) -> str:
    """Describe the number of reached poses and the range of the values."""
    here = found.values[np.isfinite(found.values)]
    if not here.size:
        return "No pose of this plane is reached."
    part = f"{here.size} of these {found.values.size} poses are reached"
    if kind == DISTANCE:
        return f"{part}; the smallest singular value of Mᵀ lies between {here.min():.2g} and {here.max():.2g}."
    most = float(here.max())
    near = check_bounded(most / 1e3, length) if unit == "mm" else check_bounded(np.radians(most))
    worst = f"{round_digits(most)}{SIGNS[unit]}" if near else f"more, {NOT_BOUNDED}"
    return f"{part}; error of the platform per 0.1°: {round_digits(float(here.min()))}{SIGNS[unit]} to {worst}."
