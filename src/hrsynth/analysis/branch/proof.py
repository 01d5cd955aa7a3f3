"""The branch of the zero configuration as a function of the motors, proved cell by cell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from ...description.assembly.zero_configuration import at_file_zero
from ...equations.joint_equations import LoopSystem, build_loop_system
from ...equations.loop_parts import LoopPart, evaluate_all_equations, split_loop_system
from ...errors import BadMechanism, BadRequest, LoopClosureFailure
from ...geometry.vectors import Array
from ...mechanism import Mechanism
from ...options import option
from ...progress import report
from ...tolerances import CLOSURE_RESIDUAL_TOL
from ..analysis_declaration import analysis
from ..observed import RobotLike, read_robot
from .answer import PASSED, BranchCell, BranchPart, BranchProof
from .cells import prove_all
from .ends import find_toggles, list_full_turns
from .growth import CellGrid, GrownCell, Growth, find_largest_box, make_whole_cell, split_box
from .injectivity import prove_injective_box
from .limits import list_branch_limits
from .redundant import bound_closure_error, list_unexplained_equations
from .safe_box import find_safe_box

BRANCH_CELLS_MAX = 1000
"""Largest number of cells of motor coordinates in the proof of a branch, per part of the loops."""
BRANCH_BOX_WIDTH_MAX = 1000.0
"""Widest interval of a motor (radians, characteristic lengths) of a branch."""
BRANCH_CELL_DEPTH_MAX = 7
"""Largest number of halvings of a cell per motor."""
BRANCH_CELL_SIZE_FRACTION = 2.0
"""Largest cell tried, as a multiple of the largest one proved around zero."""

GROUPS = "motion of the links in a subgroup of lower dimension"
BOUNDED = "bounded over the tubes"
BoxLike = Mapping[str, Sequence[float]] | str


MotorBox = Annotated[
    BoxLike | None,
    option(
        "Intervals of motors (m, rad), such as hip=-1:1,slide=0:0.2 (default: the file's limits, else a "
        "full turn, or plus and minus a characteristic length).",
        "INTERVALS",
    ),
]
Cells = Annotated[int, option("Largest number of cells to try for each part of the loops.", "COUNT", low=1)]


TimeLimit = Annotated[
    float | None,
    option(
        "Seconds after which no more cells are tried (default: none, so that no machine changes the result).",
        "SECONDS",
        low=0,
    ),
]


@analysis(
    60,
    examples=("rrrrr_m1 --box shoulder_1=-0.2:0.2,shoulder_2=-0.2:0.2",),
    seeded=False,
)
def branch(
    robot: RobotLike, box: MotorBox = None, *, max_cells: Cells = BRANCH_CELLS_MAX, time_limit: TimeLimit = None
) -> BranchProof:
    """Prove that the passive joints are a function of the motors on the branch of the zero configuration.

    Parameters
    ----------
    robot
        Mechanism, observed robot, path of a file, or name of a shipped robot.
    box
        Interval of each motor (m, rad), a mapping or text ``hip=-1:1,slide=0:0.2``. Default: the limits of the file;
        without them a full turn, or plus and minus a characteristic length.
    max_cells
        Largest number of cells to try for each part of the loops.
    time_limit
        Seconds after which no more cells are tried, for each part of the loops; None: no limit.

    Returns
    -------
    BranchProof
        Proved cells, each with exactly one closure per motor value; the ends of the proof; the inverse map.

    Raises
    ------
    MotorsNotEnough
        If the motors do not determine the platform at the zero configuration.
    BadRequest
        For unknown motors, or motors that depend on each other.
    LoopClosureFailure
        If the file does not close its loops.

    Notes
    -----
    Interval arithmetic over cells of motor values (Krawczyk's test), docs/pages/prove_a_branch.md.

    Examples
    --------
    >>> hrsynth.branch("rrrrr_m1", {"shoulder_1": (-0.05, 0.05), "shoulder_2": (-0.05, 0.05)})
    <BranchProof: rrrrr_m1, 2 motors, 2 passive coordinates: shoulder_1, shoulder_2: 100 % of the box proved, 1 cell>
    """
    return prove_branch(robot, box, max_cells, time_limit)


def prove_branch(
    robot: RobotLike, box: BoxLike | None, max_cells: int, time_limit: float | None = None, whole: bool = False
) -> BranchProof:
    """The branch of a robot as :func:`branch` proves it; ``whole``: no cell counts in which a joint that turns a rod is
    not proved to have one value."""
    if max_cells < 1:
        raise BadRequest("--max-cells", max_cells, "1 or more")
    given = read_robot(robot)
    mechanism = given if isinstance(given, Mechanism) else given.robot
    mechanism.require_platform()
    mechanism.require_motors()
    motors = [name for name, joint in mechanism.joints.items() if joint.is_actuated]
    asked = parse_box(box)
    if not _has_zero_within(mechanism, asked):
        filed = at_file_zero(mechanism)
        mechanism = filed if filed is not None and _has_zero_within(filed, asked) else mechanism
    system, parts, held = choose_shape(mechanism, motors, box, whole)
    intervals, source = _read_box(system, box)
    found, grown = [], []
    for part in parts:
        core = part if whole else part.core
        grid, coarsest = _build_grid(part, intervals), BRANCH_CELL_SIZE_FRACTION * _estimate_reach(core, intervals)
        q0, x0 = (system.zero[list(places)] for places in (core.driven, core.unknowns))
        growth = Growth(
            core,
            grid,
            q0,
            x0,
            BRANCH_CELL_DEPTH_MAX * (1 + len(part.driven)),
            max_cells,
            coarsest,
            _list_first_cells(grid, q0, coarsest, max_cells),
        ).run(np.inf if time_limit is None else time_limit)
        grown.append(growth)
        report("parts", len(grown), len(parts))
    back, regular = prove_injective_box(system, grown)
    for part, growth in zip(parts, grown, strict=True):
        if growth.part is not part:
            growth.extend(part)
        found.append(_answer(part, growth))
    units, names = system.units[list(system.driven)], system.names
    injective = None if back is None else (back[0] * units, back[1] * units)
    passive = tuple(names[i] for part in parts for i in part.unknowns)
    idle = tuple(names[i] for i in held)
    proof = BranchProof(
        mechanism,
        system,
        tuple(names[i] for i in system.driven),
        passive,
        idle,
        tuple(found),
        injective,
        regular,
        source,
        sum(growth.tried for growth in grown),
        tuple(list_branch_limits(mechanism, motors, found, idle)),
    )
    return replace(proof, safe_box=_find_safe_box(proof, grown))


def _has_zero_within(mechanism: Mechanism, box: Mapping[str, tuple[float, float]]) -> bool:
    """Return True if a box of motors holds the zero configuration."""
    return all(low <= _read_zero(mechanism, name) <= high for name, (low, high) in box.items())


def _find_safe_box(proof: BranchProof, grown: Sequence[Growth]) -> tuple[Array, Array] | None:
    """The box in which all joints are within their limits, for all parts together; None without one."""
    if any(limit.joint in proof.fixed and limit.verdict == PASSED for limit in proof.limits):
        return None
    system, outer = proof.system, proof.proved if proof.regular or proof.injective_box is None else proof.injective_box
    limits = {
        i: (low / system.units[i], high / system.units[i])
        for i, name in enumerate(system.names)
        for low, high in [proof.robot.filed.get(name, (-np.inf, np.inf))]
        if np.isfinite([low, high]).any()
    }
    low, high = np.array(outer)
    for part, growth in zip(proof.parts, grown, strict=True):
        places, units = [proof.motors.index(name) for name in part.motors], system.units[list(growth.part.driven)]
        box = find_safe_box(growth, limits, low[places] / units, high[places] / units)
        if box is None:
            return None
        whole = box[0] == low[places] / units, box[1] == high[places] / units
        low[places] = np.where(whole[0], low[places], box[0] * units)
        high[places] = np.where(whole[1], high[places], box[1] * units)
    ends = np.array([proof.robot.filed.get(name, (-np.inf, np.inf)) for name in proof.motors]).reshape(-1, 2)
    return np.maximum(low, ends[:, 0]), np.minimum(high, ends[:, 1])


Shaped = tuple[LoopSystem, tuple[LoopPart, ...], tuple[int, ...]]


def choose_shape(mechanism: Mechanism, motors: Sequence[str], box: BoxLike | None, whole: bool) -> Shaped:
    """The loops in the coordinates in which the larger cell about zero is proved: those of the joints alone, or with
    the pose of the platform, seen from which all legs are alike."""
    system = build_loop_system(mechanism, motors).as_filed
    errors, _ = evaluate_all_equations(system, system.loops, system.gears, system.zero)
    if len(errors) and np.linalg.norm(errors) > CLOSURE_RESIDUAL_TOL:
        raise LoopClosureFailure(
            mechanism.name, float(np.linalg.norm(errors)), CLOSURE_RESIDUAL_TOL, system.loops[0].name
        )
    joints: Shaped = (system, *split_loop_system(system))
    if len(joints[1]) != 1 or mechanism.base == mechanism.platform:
        return joints
    try:
        other = build_loop_system(mechanism, motors, free=True).as_filed
    except BadMechanism:  # a motor or a gear carries the platform itself
        return joints
    posed: Shaped = (other, *split_loop_system(other))
    if len(posed[1]) != 1:
        return joints

    def reach(shape: Shaped) -> float:
        (part,) = shape[1]
        return _estimate_reach(part if whole else part.core, _read_box(shape[0], box)[0])

    return max((joints, posed), key=reach)


def _estimate_reach(part: LoopPart, intervals: Mapping[int, tuple[float, float]]) -> float:
    """The size of the largest cell about zero that is proved at once, as part of the box: by half as often as needed,
    or two thirds of that."""
    grid = _build_grid(part, intervals)
    sizes = np.array([scale * 2.0**-k for k in range(2 * BRANCH_CELL_DEPTH_MAX) for scale in (1.0, 0.7)])
    half = np.minimum(grid.high - grid.low, 2 * np.pi)[None] / 2 * sizes[:, None]
    q, x = (np.tile(part.system.zero[list(places)], (len(half), 1)) for places in (part.driven, part.unknowns))
    tubes = prove_all(part, q, half, x)
    return max((float(size) for size, tube in zip(sizes, tubes, strict=True) if tube is not None), default=0.0)


def _list_first_cells(grid: CellGrid, zero: Array, coarsest: float, max_cells: int) -> list[GrownCell]:
    """Return the first cells: the box, or, if the cell limit is reached before fine enough cells fill it, as many as
    the limit allows of those that are proved about zero."""
    n = len(grid.low)
    if not coarsest or coarsest**n * max_cells >= 1:
        return make_whole_cell(n)
    half = coarsest / BRANCH_CELL_SIZE_FRACTION * np.minimum(grid.high - grid.low, 2 * np.pi) / 2
    return split_box(grid, zero, half, max_cells)


def _build_grid(part: LoopPart, intervals: Mapping[int, tuple[float, float]]) -> CellGrid:
    own = [intervals[i] for i in part.driven]
    return CellGrid(np.array([low for low, _ in own]), np.array([high for _, high in own]))


def _read_box(system: LoopSystem, box: BoxLike | None) -> tuple[dict[int, tuple[float, float]], str]:
    """The interval of each driven coordinate, in the system's units, and where they come from."""
    given = parse_box(box)
    limits = system.mechanism.filed
    found, sources = {}, set()
    for i in system.driven:
        each = system.coordinates[i]
        unit = system.length if each.slides else 1.0
        wanted = given.pop(each.name, None)
        low, high = (-np.inf, np.inf) if wanted is not None else limits.get(each.joint, (-np.inf, np.inf))
        if wanted is not None:
            low, high = wanted
            sources.add("as requested")
        elif high - low <= BRANCH_BOX_WIDTH_MAX * unit:
            sources.add("limits of the file")
        else:
            reach = system.length if each.slides else np.pi
            low, high = max(low, each.zero * unit - reach), min(high, each.zero * unit + reach)
            sources.add("plus and minus a characteristic length" if each.slides else "a full turn")
        zero = round(each.zero * unit, 12)
        if not low <= zero <= high or not 0 < high - low <= BRANCH_BOX_WIDTH_MAX * unit:
            raise BadRequest(
                f"--box {each.name}={low:g}:{high:g}: interval of the motor",
                f"{low:g}:{high:g}",
                f"low < high, with {zero:.6g} (zero configuration) in it, at most "
                f"{BRANCH_BOX_WIDTH_MAX * unit:.4g} {'m' if each.slides else 'rad'} wide",
            )
        found[i] = low / unit, high / unit
    if given:
        raise BadRequest("--box: motors", ", ".join(sorted(given)), [system.names[i] for i in system.driven])
    return found, ", ".join(sorted(sources))


def _read_zero(mechanism: Mechanism, name: str) -> float:
    """The file's coordinate of a motor at the zero configuration."""
    joint = mechanism.joints.get(name)
    return 0.0 if joint is None or joint.offset is None or joint.offset.ndim > 1 else float(joint.offset[0])


def parse_box(box: BoxLike | None) -> dict[str, tuple[float, float]]:
    """Return the requested intervals by motor."""
    if box is None:
        return {}
    if not isinstance(box, Mapping | str):
        raise BadRequest("--box", box, "a dict such as {'hip': (-1, 1)}, or a text such as hip=-1:1,slide=0:0.2")
    pairs = box.items() if isinstance(box, Mapping) else [each.rpartition("=")[::2] for each in box.split(",")]
    found: dict[str, tuple[float, float]] = {}
    for name, interval in pairs:
        if str(name).strip() in found:
            raise BadRequest(f"--box: motor {str(name).strip()} is given twice", remedy="Omit one.")
        try:
            low, high = (float(v) for v in (interval.split(":") if isinstance(interval, str) else interval))
        except (TypeError, ValueError):
            raise BadRequest(
                f"--box: interval of motor {name!r}" if name else "--box", interval, "low:high, such as hip=-1:1"
            ) from None
        found[str(name).strip()] = (low, high)
    return found


def _answer(part: LoopPart, growth: Growth) -> BranchPart:
    """Return the grown cells in metres and radians."""
    system = part.system
    unit_q, unit_x = system.units[list(part.driven)], system.units[list(part.unknowns)]
    cells = []
    for leaf in growth.proved:
        tube = leaf.tube
        assert tube is not None
        low, high = growth.grid.point(leaf.low), growth.grid.point(leaf.high)
        middle = (low + high) / 2
        cells.append(
            BranchCell(
                low * unit_q,
                high * unit_q,
                tube.at(middle) * unit_x,
                tube.slopes * unit_x[:, None] / unit_q,
                tube.radius * unit_x,
                tube.weakest,
                tuple(sorted(leaf.neighbours)),
            )
        )
    low, high = growth.grid.low, growth.grid.high
    box: tuple[Array, Array] = growth.q0, growth.q0
    if growth.proved:
        corners = find_largest_box(growth)
        box = growth.grid.point(corners[0]), growth.grid.point(corners[1])
    names = system.names
    loose = list_unexplained_equations(part)
    tubes = [leaf.tube for leaf in growth.proved if leaf.tube is not None]
    redundant = "" if not part.left_out else GROUPS if not loose else BOUNDED
    return BranchPart(
        tuple(names[i] for i in part.driven),
        tuple(names[i] for i in part.unknowns),
        growth.q0 * unit_q,
        growth.x0 * unit_x,
        (low * unit_q, high * unit_q),
        (box[0] * unit_q, box[1] * unit_q),
        growth.share,
        float(np.prod((box[1] - box[0]) / (high - low))),
        tuple(cells),
        find_toggles(growth),
        list_full_turns(growth),
        bound_closure_error(part, tubes, loose),
        redundant,
    )
