"""Poses in text: those that were checked, where a freedom is lost, all assembly modes, paths without a singularity."""

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
from ...mechanism.pose import Pose
from ...tolerances import NOISE, RANK_GAP
from .robots import NO_MATRIX, formation
from .tables import (
    GAP,
    LINE,
    NAMES,
    NOT_BOUNDED,
    Rows,
    camera,
    describe_watched,
    dropped_limits,
    head,
    is_bounded,
    joint_rows,
    known_row,
    listing,
    wrap_lines,
)

if TYPE_CHECKING:
    from ...analysis.aspects.aspects import AspectTable, ModePair
    from ...analysis.aspects.path import PathAnswer, SampledRoute
    from ...analysis.check import Check, Checked, GridCheck, LoopCheck
    from ...analysis.configuration_report import ConfigurationReport, SingularityDistances, SingularityReport
    from ...analysis.modes.assembly_mode import AssemblyMode
    from ...analysis.modes.modes import AssemblyModes
    from ...analysis.modes.near import NearMode
    from ...analysis.observed import ObservedRobot
    from ...analysis.singularity.singularities import Singularity

STATES = {
    REGULAR: "regular",
    "type1": "Type 1 singularity",
    "type2": "Type 2 singularity",
    "type3": "Type 3 singularity (Type 1 and 2 at once)",
    CONSTRAINT: "constraint singularity",
    UNDECIDED: "not decided",
}
_SINCE = {"hidden": "the observed directions", "real": "the motors' coordinates"}


def check(found: Check) -> str:
    """What is observed, a block for each pose, then redundant constraints and the grid in numbers."""
    seen = [f"{leg} ({', '.join(each)})" for leg, each in describe_watched(found.setup).items()]
    generic, written = found.setup.mobility, found.as_written
    rows = [
        head(found.setup)[0],
        ("observed", seen),
        *camera(found.setup),
        *known_row(
            "mobility",
            None
            if written in (None, generic)
            else f"{written.total} as the file is written, {generic.total} in normal form",
        ),
        ("lengths in", f"{found.length:.4g} m (the characteristic length), angles in radians"),
        *dropped_limits(found.setup),
    ]
    for posture in found.postures:
        rows += [*GAP, ("pose", str(posture.pose)), *_posture(posture, found.length, found.setup)]
    for each in found.unreached:
        rows += [*GAP, ("pose", each.pose), ("not reached", each.reason)]
    rows += [*GAP, _redundant_row(found)]
    if found.grid is not None:
        counts = Counter(found.grid.states)
        axes = zip(found.grid.grid.shape, found.grid.grid.names, strict=True)
        size = " × ".join(f"{count} {name}" for count, name in axes)
        fixed, free = str(found.grid.grid.fixed), ", ".join(_free(found.grid))
        beyond = sum(bool(each.beyond_limits) for each in found.grid.postures if each is not None)
        rows.append(
            (
                "grid",
                [
                    f"{size}: " + ", ".join(f"{counts[state]} {state}" for state in sorted(counts)),
                    *([found.grid.dependent] if found.grid.dependent else []),
                    *([f"{beyond} beyond limits of joints"] if beyond else []),
                    *([f"held: {fixed}"] if fixed else []),
                    f"free, at each pose nearest to the zero configuration: {free}" if free else "no part is free",
                ],
            )
        )
    return listing(rows)


def _redundant_row(found: Checked) -> tuple[str, str | list[str]]:
    """The redundant constraints of each loop."""
    each_loop = [f"the loop {each.loop}: {each.rows} of its constraints" for each in found.redundant]
    return "redundant", each_loop or "no constraint"


def loop_check(found: LoopCheck) -> str:
    """What the loops alone say, and what it takes to say more."""
    told = found.constraints
    counted = f"{told.smallest_kept:.2g} is the weakest singular value that counts, {told.largest_dropped:.1g} "
    values = [f"{told.rank} independent of {told.rows}; as parts of the largest,"]
    values += [f"{counted}the strongest that does not (gap {told.gap:.1e}, needed {RANK_GAP:.0e})"]
    return listing(
        [
            ("robot", found.robot.name),
            (
                "mobility",
                f"{found.mobility.total}: {told.coordinates} coordinates, {told.rank} independent constraints",
            ),
            ("constraints", values if told.rank else f"rank 0 of {told.rows}"),
            ("loops", wrap_lines(", ".join(told.loops), LINE - NAMES) if told.loops else "none, an open tree"),
            _redundant_row(found),
            ("lengths in", f"{found.length:.4g} m (the characteristic length), angles in radians"),
            *GAP,
            ("to say more", [line for each in found.more for line in wrap_lines(each, LINE - NAMES)]),
        ]
    )


def _free(grid: GridCheck) -> Iterator[str]:
    """The parts of the pose that a grid leaves free, positions with their range."""
    poses = [each.pose for each in grid.postures if each is not None]
    for name in grid.free:
        values = [value for pose in poses if (value := getattr(pose, name, None)) is not None]
        low, high = (f"{round(bound(values), 6) + 0.0:.4g}" for bound in (min, max)) if values else ("", "")
        yield name if not values else f"{name} = {low}" if low == high else f"{name} {low} to {high}"


def _posture(posture: ConfigurationReport, length: float, setup: ObservedRobot) -> Rows:
    shown = "directions" if all(each.by_segment for each in setup.observed) else "observations"
    mobility, far, dof = posture.mobility, posture.distances, posture.dof
    whose = "bodies have" if setup.mechanism.formation else "platform has"
    rows = [
        *joint_rows(posture.coordinates, posture.beyond_limits),
        *(
            (
                "flat wrist",
                f"the R that make {name} one S are {math.degrees(angle):.2g} degrees from where their "
                "axes lie in a plane and turn it in two ways: not counted below",
            )
            for name, angle in posture.singular_spherical_joints.items()
        ),
        (
            "mobility",
            f"{mobility.total}, of which {mobility.internal} idle; the {whose} "
            + ("one freedom" if dof == 1 else f"{dof} freedoms"),
        ),
        *_kinds(
            "hidden robot",
            f"the {shown} show {posture.hidden.rank} of {dof}",
            posture.hidden,
            "not seen",
            whole=posture.hidden.rank == dof,
        ),
        *([] if posture.formation is None else [("verdict here", posture.formation.verdict)]),
        *formation(posture.formation),
    ]
    if far.condition is not None and far.type2 is not None and far.type1 is not None:
        rows += [
            ("", f"singular values of Mᵀ {far.type2:.3g} to {1 / far.type1:.3g}, condition {far.condition:.3g}"),
            *(
                [("", f"one degree of error in the {shown}{_describe_moved(far, length)}")]
                if all(each.angular for each in setup.observed)
                else []
            ),
        ]
        if far.condition > 1 / NOISE:
            rows.append(("", f"nearly singular: dimensions known to {NOISE:g} cannot tell it from a singularity"))
    elif far.type2 is None:
        rows.append(("", NO_MATRIX))
    if posture.real is None:
        rows.append(("real robot", "has no motors: --motors names them"))
    else:
        rows += _kinds("real robot", f"the motors determine {posture.real.rank} of {dof}", posture.real, "not held")
    if posture.constraint_singular:
        rows.append(("loops", ["lose rank here, the platform has", *(freedom.name for freedom in posture.gained)]))
    rows += [
        ("redundant here", f"the loop {each.loop}: {each.rows} more of its constraints") for each in posture.redundant
    ]
    return [*rows, ("loops' margin", f"{far.constraints:.3g} (weakest singular value, as part of the largest)")]


def _kinds(name: str, what: str, kinds: SingularityReport, lost: str, *, whole: bool = True) -> Rows:
    state = STATES[kinds.state] if whole or kinds.state != REGULAR else "as many as at generic poses, not singular"
    if kinds.singularity_indices is not None and kinds.singularity_indices.RO < 0:
        state += f", but special: {-kinds.singularity_indices.RO} fewer are lost than at generic poses"
    title = f"{what}: {state} (smallest rank gap {kinds.gap:.1e}, needed {RANK_GAP:.0e})"
    if kinds.singularity_indices is None:
        return [(name, title)]
    counts = "  ".join(f"{key} {value}" for key, value in kinds.singularity_indices.to_dict().items())
    return [
        (name, [title, f"over the generic values: {counts}"]),
        *((lost, freedom.name) for freedom in kinds.unobserved),
    ]


def _describe_moved(far: SingularityDistances, length: float) -> str:
    """How far one degree of error moves the platform, where that is a small motion."""
    if (
        far.millimetres is None
        or far.degrees is None
        or not (is_bounded(far.millimetres / 1e3, length) and is_bounded(math.radians(far.degrees)))
    ):
        return f": {NOT_BOUNDED}"
    return (
        f", to first order: {_small(far.millimetres)} mm and {_small(far.degrees)} degrees along the weakest "
        "freedom that they show"
    )


def _small(value: float) -> str:
    return f"{0.0 if value < 1e-9 else value:.3g}"


def singularity(found: Singularity) -> str:
    """The condition in words and as an expression, what was checked, and singular poses."""
    condition, checked = found.condition, found.checked
    name, seen = head(found.setup)
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
            ("split off", list(condition.factors)),
        ]
    rows.append(("loops", list(found.unexamined)))
    if checked is not None:
        rows.append(
            (
                "checked",
                [
                    f"{checked.points} random poses and {len(checked.on_locus)} on the locus, {checked.disagreements} "
                    "disagreements of words, expression and rank",
                    *(
                        []
                        if isinstance(condition, General)
                        else [
                            "largest angle between a leg's named wrenches and the rank's "
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
    if condition is not None and not condition.never and not found.examples:
        searches = 0 if checked is None else checked.searches
        rows.append(("singular at", f"not found by {searches} searches, which does not mean that there are none"))
    rows.append(
        (
            "singular at",
            [
                line
                for each in found.examples
                for line in (
                    str(each.pose),
                    f"  singular value {each.sigma:.1e}, a centimetre away up to {each.nearby:.1e}; lost: "
                    + "; ".join(freedom.name for freedom in each.unobserved),
                )
            ],
        )
    )
    return listing(rows)


def modes(found: AssemblyModes) -> str:
    """The pose whose measurements are held, the count with its proof, a block for each mode."""
    count = found.found
    name, seen = head(found.setup)
    if found.formation is not None:
        return _describe_formation(found, [name, seen, *formation(found.formation)])
    rows = [name, *([seen] if found.kind == "hidden" else []), ("held", f"{_describe_held(found)} at {found.pose}")]
    if found.near_modes:
        rows += [
            ("alike", f"{found.alike} (found, not proved, for errors up to {np.degrees(found.measurement_bound):.3g}°)")
        ]
    if count.continuous_family is None or count.complex is None:
        rows += [("modes", f"{found.count}, {all_of(found)}"), ("proof", count.proof)]
    for each in count.snapped:
        legs = ", ".join(found.labels[k] for k in each.legs)
        rows.append(
            (
                "meant",
                f"legs {legs} share a joint centre of the {each.where} (to {each.defect:.1e} m; "
                "--as-written takes the numbers as they are)",
            )
        )
    rows += [*known_row("special", count.singular_solutions), *dropped_limits(found.setup)]
    for number, motion in enumerate(found.self_motions, 1):
        place = "the pose itself" if motion.goal else str(found.pose_of(motion))
        starts = f"{motion.hits} start{'s' * (motion.hits > 1)}"
        met = f"; {starts} ended on it, or on one like it" if motion.hits else ""
        rows += [*GAP, (f"motion {number}", [f"through {place}, found, not proved: a self-motion {motion.words}{met}"])]
    for number, mode in enumerate(found.modes, 1):
        rows += [
            *GAP,
            (
                f"mode {number}",
                [
                    f"{mode.pose}" + ("   (the pose itself)" if mode.goal else ""),
                    proof_words(mode)
                    if mode.match_residual is not None
                    else f"{proof_words(mode)}, residual {mode.residual:.1e}",
                    *ahead(mode),
                    *at_mode(mode, found),
                ],
            ),
        ]
    for number, mode in enumerate(found.antipodal, 1):
        rows += [
            *GAP,
            (
                f"antipodal {number}",
                [
                    f"{mode.pose}   not a mode: the opposite value of {', '.join(mode.opposite)}",
                    proof_words(mode),
                    *ahead(mode),
                ],
            ),
        ]
    for number, mode in enumerate(found.near_modes, 1):
        rows += [
            *GAP,
            (
                f"near {number}",
                [
                    f"{mode.pose}   found, not proved; what is measured differs {mode.differs}",
                    *_rests(mode),
                    *ahead(mode),
                    *at_mode(mode, found),
                ],
            ),
        ]
    return listing(rows)


def _describe_formation(found: AssemblyModes, rows: Rows) -> str:
    """The count with its proof, a block with the places of all bodies for each mode of a formation."""
    if found.found.continuous_family is None:
        rows += [("modes", f"{found.count}, {all_of(found)}"), ("proof", found.found.proof)]
    rows += known_row("special", found.found.singular_solutions)
    for word, listed in (("mode", found.modes), ("antipodal", found.antipodal)):
        for number, mode in enumerate(listed, 1):
            told = [f"{body}: {Pose.of(X)}" for body, X in (mode.bodies or {}).items()]
            rows += [
                *GAP,
                (
                    f"{word} {number}",
                    [
                        *["the configuration itself"] * mode.goal,
                        *[f"not a mode: the opposite value of {', '.join(mode.opposite)}"] * bool(mode.opposite),
                        *told,
                        f"residual {mode.residual:.1e}",
                        *[f"beyond the limits of {', '.join(mode.beyond_limits)}"] * bool(mode.beyond_limits),
                    ],
                ),
            ]
    return listing(rows)


def _describe_held(found: AssemblyModes) -> str:
    if found.kind == "hidden" and not all(o.by_segment for o in found.setup.observed):
        return "what is observed"
    return _SINCE[found.kind]


def _rests(mode: NearMode) -> list[str]:
    """What the loop does at a near mode."""
    if mode.family:
        return ["one of a continuous family: the loop may rest at any of them"]
    return ["the loop rests there, stable"] if mode.stable else []


def ahead(mode: AssemblyMode) -> list[str]:
    """Whether what is seen is in front of the cameras."""
    if mode.behind is None:
        return []
    return [f"behind the camera: {', '.join(mode.behind)}" if mode.behind else "in front of the camera"]


def all_of(found: AssemblyModes) -> str:
    """Whether the modes are all."""
    if found.found.complete:
        fitting = sum(mode.match_residual is not None and not mode.goal for mode in found.modes)
        return f"proved to be all among {found.within}" + (
            f"; {fitting} of them fit{'s' * (fitting == 1)}, not proved" if fitting else ""
        )
    return "found, not proved to be all"


def proof_words(mode: AssemblyMode) -> str:
    """What is proved of a mode's place."""
    within = (
        ""
        if not np.isfinite(mode.radius)
        else f"to {mode.shift:.1e} m" + (f", {mode.turn:.1e} rad" if mode.turn else "")
    )
    known = f"known {within}" if within else "known to no radius"
    if mode.proved:
        return f"{', '.join(mode.enclosed)}{' ' if mode.enclosed else ''}enclosed {within}"
    if mode.match_residual is not None and mode.goal:
        return f"a mode by construction, its place not proved, {known}"
    if mode.match_residual is not None:
        return f"fits all legs to {mode.match_residual:.1e}, which does not prove it; if it is a mode, {known}"
    if mode.rounded:
        return f"not proved: enclosed {within} for the rounded geometry, not for the file's".replace("  ", " ")
    if mode.multiplicity > 1:
        return f"not proved, a multiple one {within}".rstrip()
    return f"{'a mode by construction, its place ' if mode.goal else ''}not proved, {known}"


def at_mode(mode: AssemblyMode, found: AssemblyModes) -> list[str]:
    """What the real robot does at a mode of a list."""
    there, hidden = assembly(mode, found.setup.limits_ignored), found.kind == "hidden"
    there += [f"{name} {told}" for name, told in joint_rows(mode.coordinates)]
    if mode.type2_distance is None:
        seen = NO_MATRIX if hidden else "the motors can move there while the platform rests"
        return [*there, *[seen] * (mode.configuration is not None)]
    matrix = "Mᵀ" if hidden else "the motors' Jacobian (motor rates by platform twist)"
    return [*there, f"smallest singular value of {matrix} {mode.type2_distance:.3g}"]


def assembly(mode: AssemblyMode, unlimited: Sequence[str] = ()) -> list[str]:
    """Whether the real robot can be assembled at a mode, and why not; ``unlimited`` joints have limits that are not
    looked at."""

    def several(noun: str, labels: Sequence[str]) -> str:
        return f"{noun}{'s' * (len(labels) > 1)} {', '.join(labels)}"

    match mode.assembly:
        case "yes":
            return ["the real robot can be assembled there" + (", as far as limits are looked at" if unlimited else "")]
        case "beyond limits":
            return [
                f"the real robot can be assembled there only beyond limits of joints: as found, of "
                f"{', '.join(mode.beyond_limits)}"
            ]
        case "no":
            return [
                f"the real robot cannot be assembled there: {several('leg', [leg for leg, _ in mode.misses])}",
                *(f"leg {leg}: {miss}" for leg, miss in mode.misses),
            ]
    where = (
        f"beyond the limits of {', '.join(mode.beyond_limits)}"
        if mode.beyond_limits
        else f"with {' and '.join(several(*each) for each in mode.left_open)} left open"
    )
    return [f"the real robot was found assembled there only {where}; whether it can be there otherwise is not known"]


def path(found: PathAnswer) -> str:
    """The verdict with its reason, the values at the two poses, and the path."""
    value = "expression" if found.signed else "smallest singular value"
    rows = [
        *head(found.setup),
        ("from", f"{found.start.pose}   ({value} {found.start.value:.4g})"),
        *joint_rows(found.start.coordinates),
        ("to", f"{found.goal.pose}   ({value} {found.goal.value:.4g})"),
        *joint_rows(found.goal.coordinates),
        *known_row("", "start and goal are the same pose: there is no path to find" if found.stays else None),
        ("verdict", [f"{found.verdict} ({'certified' if found.certified else 'not certified'})", found.reason]),
    ]
    if found.margin is not None:
        where = "all along the path" if found.certified and found.segments else "at both poses"
        rows.append(("margin", f"|{value}| at least {found.margin:.3g} {where}, {found.boxes} intervals"))
    if found.segments:
        rows.append(("path" if found.certified else "best path", [str(pose) for pose in found.poses]))
    rows.append(
        ("crossings", [f"leg {leg} changes its working mode at {found.poses[place]}" for leg, place in found.crossings])
    )
    if found.road is not None:
        rows.append(("sampled", road(found.road, value)))
    return listing([*rows, *known_row("not proved", found.not_proved if found.certified else None)])


def road(found: SampledRoute, value: str) -> list[str]:
    """What poses on the straight way say."""
    signs = {None: "", 0: ", the same sign at all of them"}.get(found.changes, f", {found.changes} changes of its sign")
    lines = [
        f"|{value}| at least {found.least:.3g} at {found.count} poses of the straight path, least at {found.at}{signs}"
    ]
    if found.reached < 1:
        lines.append(f"the robot was not followed further than {100 * found.reached:.0f} % of that path")
    return lines + [f"{found.out_of_view} is not in front of its camera all along it"] * (found.out_of_view is not None)


_SIGNS = {SAME: "=", SEPARATED: "|", UNDECIDED_PAIR: "?"}


def aspects(found: AspectTable) -> str:
    """The modes, how many aspects hold them, the table mode by mode, and what was asked of which pairs."""
    listed = found.listed
    rows = [*head(listed.setup), ("held", f"{_describe_held(listed)} at {listed.pose}")]
    if listed.found.continuous_family is not None:
        return listing([*rows, *known_row("special", listed.found.singular_solutions)])
    rows += [
        ("modes", f"{listed.count}, {all_of(listed)}"),
        ("aspects", f"{found.aspects_met} of the hidden robot: {aspect_groups(found)}"),
        ("cuspidal", _cuspidal(found)),
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
        (first, [words, *textwrap.wrap("; ".join(rest), initial_indent="so are modes ")])
        for words, (first, *rest) in told.items()
    ]
    paths = [pair.answer for pair in found.pairs if pair.verdict == SAME and pair.answer is not None]
    passed = ", ".join(dict.fromkeys(name for each in paths for name in each.limits_ignored))
    return listing([*rows, *known_row("not proved", f"limits of joints {passed}" if passed else None)])


def aspect_groups(found: AspectTable) -> str:
    """The modes of each aspect."""
    return "; ".join(f"mode{'s' * (len(group) > 1)} {', '.join(map(str, group))}" for group in found.groups)


def _cuspidal(found: AspectTable) -> list[str]:
    changes = found.changes
    if not changes:
        return ["not shown by the modes at this pose, which says nothing about other poses"]
    direct = [pair for pair in changes if pair.answer is not None and not pair.answer.crossings]
    one, other = (direct or changes)[0].numbers
    how = "no leg changes its working mode" if direct else "legs change their working modes"
    return [
        f"yes: modes {one} and {other} have the same directions, and a certified path without",
        f"Type 2 singularity leads from one to the other; {how} on it",
    ]


def pair_words(pair: ModePair) -> str:
    """The verdict on two modes, and what shows it."""
    certified = "" if pair.verdict == UNDECIDED_PAIR else f" ({'certified' if pair.certified else 'not certified'})"
    found = pair.answer
    if found is None or pair.verdict != SAME:
        return f"{pair.verdict}{certified}: {pair.reason}"
    bends = len(found.poses) - 2
    way = "straight" if not bends else f"over {bends} pose{'s' * (bends > 1)}"
    crossed = dict.fromkeys(leg for leg, _ in found.crossings)
    legs = f", changing the working mode of leg {', '.join(crossed)}" if crossed else ""
    return f"{pair.verdict}{certified}: {way}{legs}; margin {found.margin:.3g}, {found.boxes} intervals"
