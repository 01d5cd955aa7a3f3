"""Poses in text: checked poses, singularities, assembly modes, paths without a singularity."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...analysis.aspects.verdicts import SAME, SEPARATED
from ...analysis.aspects.verdicts import UNDECIDED as UNDECIDED_PAIR
from ...analysis.configuration_report import CONSTRAINT, REGULAR, UNDECIDED
from ...constraints.condition import General
from ...kinematics.joint_coordinates import list_coordinate_joints
from ...mechanism.pose import JointPose, Pose
from ...tolerances import DIRECTION_SINE_TOL, INCIDENCE_TOL, RANK_GAP_MIN
from .robots import NO_MATRIX, format_formation
from .tables import (
    GAP,
    LINE,
    NOT_BOUNDED,
    TABLE_NAME_COLUMNS_MAX,
    Rows,
    check_bounded,
    describe_watched,
    format_camera_rows,
    format_dropped_limits,
    format_head_rows,
    format_joint_rows,
    format_known_row,
    format_listing,
    wrap_lines,
)

if TYPE_CHECKING:
    from ...analysis.aspects.aspects import AspectTable, ModePair
    from ...analysis.aspects.path import PathAnswer, SampledRoute
    from ...analysis.check import Check, Checked, GridCheck, LoopCheck
    from ...analysis.configuration_report import ConfigurationReport, SingularityDistances, SingularityReport
    from ...analysis.modes.assembly_mode import AssemblyMode
    from ...analysis.modes.modes import AssemblyModes
    from ...analysis.modes.near_modes import NearMode
    from ...analysis.observed import ObservedRobot
    from ...analysis.singularity.condition_check import Agreement
    from ...analysis.singularity.singularities import Singularity
    from ...mechanism import Mechanism

STATES = {
    REGULAR: "regular",
    "type1": "Type 1 singularity",
    "type2": "Type 2 singularity",
    "type3": "Type 3 singularity (Type 1 and 2 at once)",
    CONSTRAINT: "constraint singularity",
    UNDECIDED: "undecided",
}
_SINCE = {"hidden": "observed directions", "real": "motor coordinates"}


def check(found: Check) -> str:
    """Return the observations, a block for each pose, the redundant constraints and the counts of the grid."""
    seen = [f"{leg} ({', '.join(each)})" for leg, each in describe_watched(found.setup).items()]
    generic, written = found.setup.mobility, found.as_written
    rows = [
        format_head_rows(found.setup)[0],
        ("observed", seen),
        *format_camera_rows(found.setup),
        *format_known_row(
            "mobility",
            None
            if written in (None, generic)
            else f"{written.total} as the file is written, {generic.total} in normal form",
        ),
        ("lengths in", f"{found.length:.4g} m (the characteristic length), angles in radians"),
        *format_dropped_limits(found.setup),
    ]
    for posture in found.postures:
        rows += [*GAP, ("pose", str(posture.pose)), *_format_configuration(posture, found.length, found.setup)]
    for each in found.unreached:
        rows += [*GAP, ("pose", each.pose), ("not reached", each.reason)]
    rows += [*GAP, _format_redundant_row(found)]
    if found.grid is not None:
        counts = Counter(found.grid.states)
        axes = zip(found.grid.grid.shape, found.grid.grid.names, strict=True)
        size = " × ".join(f"{count} {name}" for count, name in axes)
        fixed = found.grid.grid.fixed_text
        beyond = 0 if found.grid.beyond is None else found.grid.beyond.sum()
        rows.append(
            (
                "grid",
                [
                    f"{size}: " + ", ".join(f"{counts[state]} {state}" for state in sorted(counts)),
                    *([found.grid.dependent] if found.grid.dependent else []),
                    *([f"{beyond} beyond joint limits"] if beyond else []),
                    *([f"fixed: {fixed}"] if fixed else []),
                    _describe_free_parts(found.grid, found.setup.robot),
                ],
            )
        )
    return format_listing(rows)


def _format_redundant_row(found: Checked) -> tuple[str, str | list[str]]:
    """Return the row of the redundant constraints of each loop."""
    each_loop = [f"loop {each.loop}: {each.rows} of its constraints" for each in found.redundant]
    return "redundant", each_loop or "none"


def format_loop_check(found: LoopCheck) -> str:
    """Return the mobility and rank of the loops, and the options needed for more."""
    told = found.constraints
    values = [f"{told.rank} independent of {told.rows}; singular values relative to the largest:"]
    values += [f"smallest kept {told.smallest_kept:.2g}, largest dropped {told.largest_dropped:.1g} "]
    values[1] += f"(gap {told.gap:.1e}, needed {RANK_GAP_MIN:.0e})"
    return format_listing(
        [
            ("robot", found.robot.name),
            (
                "mobility",
                f"{found.mobility.total}: {told.coordinates} coordinates, {told.rank} independent constraints",
            ),
            ("constraints", values if told.rank else f"rank 0 of {told.rows}"),
            (
                "loops",
                wrap_lines(", ".join(told.loops), LINE - TABLE_NAME_COLUMNS_MAX)
                if told.loops
                else "none, an open tree",
            ),
            _format_redundant_row(found),
            ("lengths in", f"{found.length:.4g} m (the characteristic length), angles in radians"),
            *GAP,
            ("for more", [line for each in found.more for line in wrap_lines(each, LINE - TABLE_NAME_COLUMNS_MAX)]),
        ]
    )


def _describe_free_parts(grid: GridCheck, robot: Mechanism) -> str:
    """Describe what a grid leaves free, and where that is."""
    fixed = grid.grid.fixed
    if isinstance(fixed, JointPose):
        motors = {joint.name for joint in list_coordinate_joints(robot, motors=True)} if fixed.motors else set[str]()
        some = bool(motors - {*grid.grid.names, *dict(fixed.values)})
        return "motors that are not given are at their zero, " * some + "other joints follow the loops"
    free = ", ".join(_list_free_parts(grid))
    return f"free, chosen nearest to the zero configuration: {free}" if free else "no free coordinate"


def _list_free_parts(grid: GridCheck) -> Iterator[str]:
    """Yield the coordinates that a grid leaves free, positions with their range."""
    poses = [each.pose for each in grid.postures if each is not None]
    for name in grid.free:
        values = [value for pose in poses if (value := getattr(pose, name, None)) is not None]
        low, high = (f"{round(bound(values), 6) + 0.0:.4g}" for bound in (min, max)) if values else ("", "")
        yield name if not values else f"{name} = {low}" if low == high else f"{name} {low} to {high}"


def _format_configuration(posture: ConfigurationReport, length: float, setup: ObservedRobot) -> Rows:
    shown = "directions" if all(each.is_segment_direction for each in setup.observed) else "observations"
    mobility, far, dof = posture.mobility, posture.distances, posture.dof
    turns = f", {posture.turns or 'none'} of which rotate{'s' * (posture.turns < 2)} it" if dof else ""
    if setup.motion.has_one_rotation and abs(setup.motion.normal[2]) < 1 - DIRECTION_SINE_TOL:
        turns += f", phi about {' '.join(f'{round(x, 6) + 0.0:.3g}' for x in setup.motion.normal)}"
    whose = f"bodies have {dof} dof" if setup.mechanism.formation else f"platform has {dof} dof{turns}"
    rows = [
        *format_joint_rows(posture.coordinates, posture.beyond_limits),
        *(
            (
                "singular S",
                f"revolute axes of the spherical joint {name}: {math.degrees(angle):.2g} deg from coplanar, where they "
                "rotate it about two axes only; not counted below",
            )
            for name, angle in posture.singular_spherical_joints.items()
        ),
        ("mobility", f"{mobility.total}, of which {mobility.internal} internal; the {whose}"),
        *_format_kinds(
            "hidden robot",
            f"the {shown} show {posture.hidden.rank} of {dof}",
            posture.hidden,
            "unobserved",
            whole=posture.hidden.rank == dof,
        ),
        *([] if posture.formation is None else [("verdict here", posture.formation.verdict)]),
        *format_formation(posture.formation),
    ]
    if far.condition is not None and far.type2 is not None and far.type1 is not None:
        rows += [
            ("", f"singular values of Mᵀ {far.type2:.3g} to {1 / far.type1:.3g}, condition {far.condition:.3g}"),
            *(
                [("error gain", _describe_gain(far, length, shown[:-1]))]
                if all(each.angular for each in setup.observed)
                else []
            ),
        ]
        if far.condition > 1 / INCIDENCE_TOL:
            rows.append(
                (
                    "",
                    "nearly singular: not distinguishable from a singularity "
                    f"with dimensions known to {INCIDENCE_TOL:g}",
                )
            )
    elif far.type2 is None:
        rows.append(("", NO_MATRIX))
    if posture.real is None:
        rows.append(("real robot", "no motors; name them with --motors"))
    else:
        rows += _format_kinds(
            "real robot", f"the motors determine {posture.real.rank} of {dof}", posture.real, "undetermined"
        )
    if posture.constraint_singular:
        rows.append(("loops", ["lose rank here; the platform gains", *(freedom.name for freedom in posture.gained)]))
    rows += [("redundant here", f"loop {each.loop}: {each.rows} more of its constraints") for each in posture.redundant]
    return [*rows, ("loop Jacobian", f"smallest singular value {far.constraints:.3g}, relative to the largest")]


def _format_kinds(name: str, what: str, kinds: SingularityReport, lost: str, *, whole: bool = True) -> Rows:
    state = STATES[kinds.state] if whole or kinds.state != REGULAR else "as many as at generic poses, not singular"
    if kinds.singularity_indices is not None and kinds.singularity_indices.RO < 0:
        state += f", but not generic: {-kinds.singularity_indices.RO} fewer unobserved than at generic poses"
    title = f"{what}: {state} (smallest rank gap {kinds.gap:.1e}, needed {RANK_GAP_MIN:.0e})"
    if kinds.singularity_indices is None:
        return [(name, title)]
    counts = "  ".join(f"{key} {value}" for key, value in kinds.singularity_indices.to_dict().items())
    return [
        (name, [title, f"above the generic values: {counts}"]),
        *((lost, freedom.name) for freedom in kinds.unobserved),
    ]


def _describe_gain(far: SingularityDistances, length: float, measured: str) -> str:
    """Describe the motion of the platform for one degree of error, if it is small enough for the first order."""
    if (
        far.millimetres is None
        or far.degrees is None
        or not (check_bounded(far.millimetres / 1e3, length) and check_bounded(math.radians(far.degrees)))
    ):
        return f"{NOT_BOUNDED}, per degree of {measured} error"
    return (
        f"{_format_small(far.millimetres)} mm and {_format_small(far.degrees)} deg per degree of {measured} error "
        "(first order, least observable twist)"
    )


def _format_small(value: float) -> str:
    return f"{0.0 if value < 1e-9 else value:.3g}"


def format_singularity(found: Singularity) -> str:
    """Return the condition in words and as an expression, the checks, and singular poses."""
    condition, checked = found.condition, found.checked
    name, seen = format_head_rows(found.setup)
    motors = dict.fromkeys(str(getattr(o, "joint", o.link)) for o in found.observation_model.observations)
    rows: Rows = [
        name,
        ("motors", ", ".join(motors)) if found.real else seen,
        ("verdict", f"{found.verdict.verdict} (rank {found.verdict.rank} of {found.verdict.dof})"),
        ("Type 2", found.words),
    ]
    if condition is not None:
        rows += [
            ("expression", f"{condition.expression}{' (never zero)' if condition.never else ' = 0'}"),
            ("factors", [f"{part}: {meaning}" for part, meaning in condition.parts]),
            ("where", [f"{name}: {meaning}" for name, meaning in condition.where.items()]),
            ("trivial factors", list(condition.factors)),
        ]
    rows.append(("loops", list(found.unexamined)))
    if checked is not None:
        rows.append(
            (
                "checked",
                [
                    f"{checked.points} random poses{_describe_within(checked)} and {len(checked.on_locus)} on the "
                    f"locus, {checked.disagreements} "
                    "disagreements of condition, expression and rank",
                    *(
                        []
                        if isinstance(condition, General)
                        else [
                            "largest angle between the named wrenches of a leg and the numerical ones "
                            f"{checked.largest_angle:.1e} rad"
                        ]
                    ),
                ],
            )
        )
        if condition is not None and condition.signed:
            rows.append(
                ("", f"expression positive at {checked.sides[0]}, negative at {checked.sides[1]} of the random poses")
            )
    rows += format_dropped_limits(found.setup)
    if condition is not None and not condition.never and all(each.beyond_limits for each in found.examples):
        searches = 0 if checked is None else checked.searches
        where = " within joint limits" if found.examples else ""
        rows.append(("singular at", f"none found{where} by {searches} searches, which does not exclude any"))
    rows.append(
        (
            "singular at",
            [
                line
                for each in found.examples
                for line in (
                    str(each.pose),
                    f"  singular value {each.sigma:.1e}, 1 cm away up to {each.nearby:.1e}; unobserved: "
                    + "; ".join(freedom.name for freedom in each.unobserved),
                    *[f"  beyond joint limits: {', '.join(each.beyond_limits)}"] * bool(each.beyond_limits),
                )
            ],
        )
    )
    return format_listing(rows)


def _describe_within(checked: Agreement) -> str:
    """Return how many of the random poses are within joint limits; nothing without limits."""
    return "" if checked.within is None else f" ({checked.within} within joint limits)"


def format_modes(found: AssemblyModes) -> str:
    """Return the pose with the fixed measured values, the count with its proof, a block for each mode."""
    count = found.found
    name, seen = format_head_rows(found.setup)
    if found.formation is not None:
        return _describe_formation(found, [name, seen, *format_formation(found.formation)])
    rows = [name, *([seen] if found.kind == "hidden" else []), ("fixed", f"{_describe_held(found)} at {found.pose}")]
    if found.near_modes:
        rows += [
            ("alike", f"{found.alike} (found, not proved, for errors up to {np.degrees(found.measurement_bound):.3g}°)")
        ]
    if count.continuous_family is None or count.complex is None:
        rows += [("modes", f"{found.count}, {describe_completeness(found)}"), ("proof", count.proof)]
    for each in count.snapped:
        legs = ", ".join(found.labels[k] for k in each.legs)
        rows.append(
            (
                "snapped",
                f"legs {legs} share a joint centre of the {each.where} (to {each.defect:.1e} m; "
                "use --as-written to keep the numbers)",
            )
        )
    rows += [*format_known_row("singular", count.singular_solutions), *format_dropped_limits(found.setup)]
    for number, motion in enumerate(found.self_motions, 1):
        place = "the given pose" if motion.goal else str(found.pose_of(motion))
        starts = f"{motion.hits} start{'s' * (motion.hits > 1)}"
        met = f"; {starts} ended on it or an equal one" if motion.hits else ""
        rows += [
            *GAP,
            (f"motion {number}", [f"through {place}", f"found, not proved: a self-motion {motion.words}{met}"]),
        ]
    for number, mode in enumerate(found.modes, 1):
        rows += [
            *GAP,
            (
                f"mode {number}",
                [
                    f"{mode.pose}" + ("   (the given pose)" if mode.goal else ""),
                    describe_proof(mode)
                    if mode.match_residual is not None
                    else f"{describe_proof(mode)}, residual {mode.residual:.1e}",
                    *describe_visibility(mode),
                    *describe_at_mode(mode, found),
                ],
            ),
        ]
    for number, mode in enumerate(found.antipodal, 1):
        rows += [
            *GAP,
            (
                f"antipodal {number}",
                [
                    f"{mode.pose}   not an assembly mode: opposite value of {', '.join(mode.opposite)}",
                    describe_proof(mode),
                    *describe_visibility(mode),
                ],
            ),
        ]
    for number, mode in enumerate(found.near_modes, 1):
        rows += [
            *GAP,
            (
                f"near {number}",
                [
                    f"{mode.pose}   found, not proved; measured values differ {mode.differs}",
                    *_describe_equilibrium(mode),
                    *describe_visibility(mode),
                    *describe_at_mode(mode, found),
                ],
            ),
        ]
    return format_listing(rows)


def _describe_formation(found: AssemblyModes, rows: Rows) -> str:
    """Return the count with its proof, and for each mode of a formation a block with the poses of all bodies."""
    if found.found.continuous_family is None:
        rows += [("modes", f"{found.count}, {describe_completeness(found)}"), ("proof", found.found.proof)]
    rows += format_known_row("singular", found.found.singular_solutions)
    for word, listed in (("mode", found.modes), ("antipodal", found.antipodal)):
        for number, mode in enumerate(listed, 1):
            told = [f"{body}: {Pose.of(X)}" for body, X in (mode.bodies or {}).items()]
            rows += [
                *GAP,
                (
                    f"{word} {number}",
                    [
                        *["the given configuration"] * mode.goal,
                        *[f"not an assembly mode: opposite value of {', '.join(mode.opposite)}"] * bool(mode.opposite),
                        *told,
                        f"residual {mode.residual:.1e}",
                        *[f"beyond joint limits: {', '.join(mode.beyond_limits)}"] * bool(mode.beyond_limits),
                    ],
                ),
            ]
    return format_listing(rows)


def _describe_held(found: AssemblyModes) -> str:
    if found.kind == "hidden" and not all(o.is_segment_direction for o in found.setup.observed):
        return "measured values"
    return _SINCE[found.kind]


def _describe_equilibrium(mode: NearMode) -> list[str]:
    """Describe the equilibrium at a near mode."""
    if mode.family:
        return ["one of a continuous family: the loop may stop at any of them"]
    return ["a stable equilibrium of the loop"] if mode.stable else []


def describe_visibility(mode: AssemblyMode) -> list[str]:
    """Describe what is behind the cameras, or that nothing is."""
    if mode.behind is None:
        return []
    return [f"behind the camera: {', '.join(mode.behind)}" if mode.behind else "in front of the camera"]


def describe_completeness(found: AssemblyModes) -> str:
    """Describe whether the list of modes is complete."""
    if found.found.complete:
        fitting = sum(mode.match_residual is not None and not mode.goal for mode in found.modes)
        return f"proved to be all among {found.within}" + (
            f"; {fitting} of them unproved match{'es' * (fitting > 1)}" if fitting else ""
        )
    return "found, not proved to be all"


def describe_proof(mode: AssemblyMode) -> str:
    """Describe the enclosure of a mode, or why it has none."""
    within = (
        "" if not np.isfinite(mode.radius) else f"{mode.shift:.1e} m" + (f", {mode.turn:.1e} rad" if mode.turn else "")
    )
    known = f"known to {within}" if within else "radius unknown"
    if mode.proved:
        return f"enclosure {within}".rstrip() + (f" ({', '.join(mode.enclosed)})" if mode.enclosed else "")
    if mode.match_residual is not None and mode.goal:
        return f"a mode by construction, pose not proved, {known}"
    if mode.match_residual is not None:
        return f"matches all legs to {mode.match_residual:.1e}, which does not prove it; if it is a mode, {known}"
    if mode.rounded:
        return f"not proved: enclosure {within} of the rounded geometry, not of the file's".replace("  ", " ")
    if mode.multiplicity > 1:
        return f"not proved, a singular solution, {known}"
    return f"{'a mode by construction, pose ' if mode.goal else ''}not proved, {known}"


def describe_at_mode(mode: AssemblyMode, found: AssemblyModes) -> list[str]:
    """Describe the assembly of the real robot at a mode, its joints and its distance from a singularity."""
    there, hidden = describe_assembly(mode, found.setup.limits_ignored), found.kind == "hidden"
    there += [f"{name} {told}" for name, told in format_joint_rows(mode.coordinates)]
    if mode.type2_distance is None:
        seen = NO_MATRIX if hidden else "the motors can move there while the platform is fixed"
        return [*there, *[seen] * (mode.configuration is not None)]
    matrix = "Mᵀ" if hidden else "the motors' Jacobian (motor rates by platform twist)"
    return [*there, f"smallest singular value of {matrix} {mode.type2_distance:.3g}"]


def describe_assembly(mode: AssemblyMode, unlimited: Sequence[str] = ()) -> list[str]:
    """Describe whether the real robot can be assembled at a mode; the limits of ``unlimited`` joints are ignored."""

    def several(noun: str, labels: Sequence[str]) -> str:
        return f"{noun}{'s' * (len(labels) > 1)} {', '.join(labels)}"

    match mode.assembly:
        case "yes":
            return ["the real robot can be assembled there" + (", some joint limits ignored" if unlimited else "")]
        case "beyond limits":
            return [
                f"the real robot can be assembled there only beyond joint limits: as found, of "
                f"{', '.join(mode.beyond_limits)}"
            ]
        case "no":
            return [
                f"the real robot cannot be assembled there: {several('leg', [leg for leg, _ in mode.misses])}",
                *(f"leg {leg}: {miss}" for leg, miss in mode.misses),
            ]
    where = (
        f"beyond joint limits: {', '.join(mode.beyond_limits)}"
        if mode.beyond_limits
        else f"with {' and '.join(several(*each) for each in mode.left_open)} left open"
    )
    return [f"the real robot was found assembled there only {where}; another assembly is not excluded"]


def format_path(found: PathAnswer) -> str:
    """Return the verdict with its reason, the values at the two poses, and the path."""
    value = "expression" if found.signed else "smallest singular value"
    rows = [
        *format_head_rows(found.setup),
        ("from", f"{found.start.pose}   ({value} {found.start.value:.4g})"),
        *format_joint_rows(found.start.coordinates),
        ("to", f"{found.goal.pose}   ({value} {found.goal.value:.4g})"),
        *format_joint_rows(found.goal.coordinates),
        *format_known_row("", "start and goal are the same pose: no path needed" if found.is_at_goal else None),
        ("verdict", [f"{found.verdict} ({'proved' if found.certified else 'not proved'})", found.reason]),
    ]
    if found.margin is not None:
        where = "all along the path" if found.certified and found.segments else "at both poses"
        rows.append(("distance", f"|{value}| at least {found.margin:.3g} {where}, {found.boxes} intervals"))
    if found.segments:
        rows.append(("path" if found.certified else "best path", [str(pose) for pose in found.poses]))
    rows.append(
        ("crossings", [f"leg {leg} changes its working mode at {found.poses[place]}" for leg, place in found.crossings])
    )
    if found.road is not None:
        rows.append(("sampled", describe_straight_path(found.road, value)))
    return format_listing([*rows, *format_known_row("not proved", found.not_proved if found.certified else None)])


def describe_straight_path(found: SampledRoute, value: str) -> list[str]:
    """Describe the samples on the straight path."""
    signs = {None: "", 0: ", the same sign at all"}.get(found.changes, f", {found.changes} sign changes")
    lines = [
        f"|{value}| at least {found.least:.3g} at {found.count} poses of the straight path, least at {found.at}{signs}"
    ]
    if found.reached < 1:
        lines.append(f"the robot was tracked over the first {100 * found.reached:.0f} % of that path only")
    return lines + [f"{found.out_of_view} is not in front of its camera on all of it"] * (found.out_of_view is not None)


_SIGNS = {SAME: "=", SEPARATED: "|", UNDECIDED_PAIR: "?"}


def format_aspects(found: AspectTable) -> str:
    """Return the modes, their aspects, the table of pairs, and the verdict on each pair that was examined."""
    listed = found.listed
    rows = [*format_head_rows(listed.setup), ("fixed", f"{_describe_held(listed)} at {listed.pose}")]
    if listed.found.continuous_family is not None:
        return format_listing([*rows, *format_known_row("singular", listed.found.singular_solutions)])
    rows += [
        ("modes", f"{listed.count}, {describe_completeness(listed)}"),
        ("aspects", f"{found.aspects_met} of the hidden robot: {format_aspect_groups(found)}"),
        ("cuspidal", _describe_cuspidal(found)),
        *GAP,
    ]
    numbers = range(1, len(found.places) + 1)
    wide = len(str(len(found.places)))
    rows.append(("", "  ".join(f"{k:>{wide}}" for k in numbers)))
    for k, verdicts in zip(numbers, found.table, strict=True):
        signs = "  ".join(f"{_SIGNS[verdict]:>{wide}}" for verdict in verdicts)
        rows.append((f"mode {k}", f"{signs}   {listed.modes[k - 1].pose}"))
    rows += [("", f"{SAME} =   {SEPARATED} |   {UNDECIDED_PAIR} ?"), *GAP]
    told: dict[str, list[str]] = {}
    for pair in found.pairs:
        if pair.answer is not None or pair.verdict == UNDECIDED_PAIR:
            told.setdefault(pair_words(pair), []).append("{}, {}".format(*pair.numbers))
    rows += [
        (first, [words, *textwrap.wrap("; ".join(rest), initial_indent="as are modes ")])
        for words, (first, *rest) in told.items()
    ]
    paths = [pair.answer for pair in found.pairs if pair.verdict == SAME and pair.answer is not None]
    passed = ", ".join(dict.fromkeys(name for each in paths for name in each.limits_ignored))
    return format_listing([*rows, *format_known_row("not proved", f"joint limits of {passed}" if passed else None)])


def format_aspect_groups(found: AspectTable) -> str:
    """List the modes of each aspect."""
    return "; ".join(f"mode{'s' * (len(group) > 1)} {', '.join(map(str, group))}" for group in found.groups)


def _describe_cuspidal(found: AspectTable) -> list[str]:
    changes = found.changes
    if not changes:
        return ["not shown by the modes at this pose; other poses are not examined"]
    direct = [pair for pair in changes if pair.answer is not None and not pair.answer.crossings]
    one, other = (direct or changes)[0].numbers
    how = "no leg changes its working mode" if direct else "legs change their working modes"
    return [
        f"yes: modes {one} and {other} have the same directions, and a proved path without",
        f"Type 2 singularity leads from one to the other; {how} on it",
    ]


def pair_words(pair: ModePair) -> str:
    """Describe the verdict on two modes and its reason."""
    certified = "" if pair.verdict == UNDECIDED_PAIR else f" ({'proved' if pair.certified else 'not proved'})"
    found = pair.answer
    if found is None or pair.verdict != SAME:
        return f"{pair.verdict}{certified}: {pair.reason}"
    bends = len(found.poses) - 2
    way = "straight" if not bends else f"via {bends} pose{'s' * (bends > 1)}"
    crossed = dict.fromkeys(leg for leg, _ in found.crossings)
    legs = f", changing the working mode of leg {', '.join(crossed)}" if crossed else ""
    return f"{pair.verdict}{certified}: {way}{legs}; distance {found.margin:.3g}, {found.boxes} intervals"
