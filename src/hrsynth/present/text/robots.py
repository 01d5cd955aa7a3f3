"""Robots in text: as read, hidden robot, leg sets, suggestions, exported code, 3D view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import comb, degrees, prod
from typing import TYPE_CHECKING

from ...analysis.exact import ExactVerdict, round_up_power
from ...analysis.setup_records import describe_other_modes
from ...analysis.verdict import ELSEWHERE
from ...errors import HrsynthError
from ...tolerances import NONZERO_SINGULAR_VALUE_MIN, RANK_CUTOFF_FRACTION, RANK_GAP_MIN, RELATION_ANGLE_TOL
from .branches import UNITS, format_end_rows, format_limit_rows
from .tables import (
    LINE,
    TABLE_NAME_COLUMNS_MAX,
    Rows,
    describe_watched,
    format_camera_rows,
    format_head_rows,
    format_known_row,
    format_listing,
    format_robot_row,
    format_sets,
    format_table,
    wrap_lines,
)

if TYPE_CHECKING:
    from ...analysis.advice import Advice, FurtherMeasurement
    from ...analysis.controllability import Legs
    from ...analysis.derive import Derivation
    from ...analysis.formation import Formation
    from ...analysis.observed import ObservedRobot
    from ...analysis.verdict import Verdict
    from ...codegen.export import ExportedCode
    from ...kinematics.equivalence import EquivalenceCheck
    from ...mechanism import Mechanism
    from ...mechanism.legs import LegDecomposition
    from ...rewrite.strategy import Step
    from ..view.view import View

NO_FREEDOM = "the platform cannot move"
NO_MATRIX = "no interaction matrix: observed links move while the platform is fixed"
_KINDS = {
    "leg": "leg (direction of its default segment)",
    "direction": "direction of another link",
    "line": "position of an observed line",
    "encoder": "encoder on a joint",
    "offered": "--sensor",
}
_SETS_PRINTED_MAX = 6
"""Largest number of sets of measurements that are listed."""


def format_robot(found: Mechanism) -> str:
    """Return name, size and motors, the legs with their default segments, and the notes of reading."""
    from ...mechanism.legs import decompose
    from ...mechanism.normal import reduce_to_normal_form
    from ...mechanism.sensors import list_default_segments

    rows: Rows = [
        ("links, joints", f"{len(found.links)}, {len(found.joints)}"),
        ("base", found.base),
        ("platform links", ", ".join(found.bodies)) if found.formation else ("platform", found.platform_words),
        ("motors", ", ".join(joint.name for joint in found.joints.values() if joint.is_actuated) or "none"),
        *format_known_row("camera on", found.reference if found.reference != found.base else None),
    ]
    try:
        decomposition = decompose(reduce_to_normal_form(found).mechanism)
        rows.insert(0, ("robot", f"{found.name}   {decomposition.architecture()}"))
        watched = {label: f"observed at {o.link}" for label, o in list_default_segments(decomposition).items()}
        rows += [(f"leg {leg.label}", watched.get(leg.label, "no observable segment")) for leg in decomposition.legs]
    except HrsynthError as error:
        rows[:0] = [("robot", [found.name, str(error)])]
    return format_listing([*rows, ("note", [str(note) for note in found.notes])])


def format_derivation(found: Derivation) -> str:
    """Return the hidden robot, the verdict, the equivalence check, and the steps."""
    mobility, hidden, unchecked, observed = found.mobility, found.hidden_architecture, found.unchecked, found.setup
    dof = [f"{found.dof} (mobility {mobility.total}, of which {mobility.internal} internal)"]
    if observed.decomposition.point is not None:
        dof.append("the platform is a point: its velocity is controlled, its rotation is an internal motion")
    name, seen = format_head_rows(observed)
    if found.verdict.formation is not None:
        dof[0] = f"{found.dof} of {len(found.verdict.formation.bodies)} links{dof[0].removeprefix(str(found.dof))}"
    rows: Rows = [
        name,
        *_format_leg_ends(observed.decomposition),
        ("dof", dof),
        seen,
        *format_camera_rows(observed),
        ("hidden robot", str(hidden) if hidden else "none: every observed direction is constant"),
        (
            "verdict",
            [
                found.verdict.verdict,
                *([NO_FREEDOM] if not found.dof else []),
                *([describe_near_verdict(found.verdict)] if found.verdict.is_near_cutoff else []),
            ],
        ),
        *format_formation(found.verdict.formation),
        ("operation mode", _describe_modes(observed)),
        ("architecture", wrap_lines(describe_exact(found.exact, found.verdict.rank), LINE - TABLE_NAME_COLUMNS_MAX)),
        *format_unobserved_rows(found.verdict),
        ("at zero", [f"{each} (hrsynth check)" for each in describe_zero(found.verdict)]),
        ("", [] if found.verdict.has_interaction_matrix else NO_MATRIX),
        ("equivalence", wrap_lines(format_certificate(found.equivalence), LINE - TABLE_NAME_COLUMNS_MAX)),
        ("equal where", wrap_lines("; ".join(found.equal_where), LINE - TABLE_NAME_COLUMNS_MAX) if hidden else []),
    ]
    if unchecked is not None:
        equivalent = "equivalent" if unchecked.equivalent else "NOT equivalent"
        rows.append(
            (
                "unchecked",
                [
                    f"{unchecked.hidden}: {equivalent} ({unchecked.reason})",
                    *(f"gains {freedom.name}" for freedom in unchecked.gains),
                    *(f"loses {freedom.name}" for freedom in unchecked.loses),
                ],
            )
        )
    return "\n".join(
        [
            format_listing(rows),
            "",
            format_table(list(_format_attempts(found.steps)), ("rule", "leg", "accepted", "angle", "reason")),
        ]
    )


def _format_leg_ends(decomposition: LegDecomposition) -> Rows:
    """Return the row of the platform links on which the legs of an articulated platform end."""
    links = {
        leg.platform_link: [each.label for each in decomposition.legs if each.platform_link == leg.platform_link]
        for leg in decomposition.legs
    }
    return (
        []
        if len(links) < 2
        else [("legs end on", "; ".join(f"{link}: {', '.join(labels)}" for link, labels in links.items()))]
    )


def _format_attempts(steps: Sequence[Step]) -> Iterator[tuple[str, ...]]:
    """Yield a row per step; of consecutive discarded proposals of a rule the first, and the number of the others."""
    for back, each in groupby(steps, lambda step: step.discarded):
        run = list(each)
        starts = [i for i, step in enumerate(run) if step.rule == run[0].rule] if back else [0]
        for step in run[: starts[1]] if len(starts) > 1 else run:
            angle = "" if step.largest_angle is None else f"{step.largest_angle:.1e}"
            yield step.rule, step.leg or "all", "yes" if step.accepted else "no", angle, step.reason
        if starts[1:]:
            yield (
                run[0].rule,
                run[0].leg or "all",
                "no",
                "",
                (f"{len(starts) - 1} more proposals, also discarded (--json lists them)"),
            )


def format_unobserved_rows(found: Verdict) -> Rows:
    """Return the row of unobserved dof; at zero, unless their names contain the pose."""
    names = [freedom.name for freedom in found.unobserved]
    return [("unobserved" if any(ELSEWHERE in name for name in names) else "unobserved at zero", names)]


def describe_zero(found: Verdict) -> list[str]:
    """Return a note if the rank at the zero configuration is lower than elsewhere."""
    rank = found.rank_at_zero
    if rank is None:
        return []
    return [
        f"{f'only {rank}' if rank else 'none'} of {found.dof} dof observed: the zero configuration is a Type 2 "
        "singularity"
    ]


def format_formation(found: Formation | None) -> Rows:
    """Return the rows of the trivial motions and flexes of a formation."""
    if found is None:
        return []
    return [
        ("trivial", list(found.trivial) or "none"),
        ("flexes", [each.name for each in found.flexes] or "none"),
        *format_known_row("not generic", found.special or None),
    ]


def _describe_modes(observed: ObservedRobot) -> list[str]:
    """Name the operation mode of a verdict, if others were found."""
    signature = observed.all_samples.signature
    zero = f"{signature.dof} dof ({signature.motion}), mobility {signature.mobility}"
    others = [f"another that was found: {text}" for text in describe_other_modes(observed)]
    return [f"that of the zero configuration: {zero}", *others] if others else []


def describe_near_verdict(found: Verdict) -> str:
    """Describe how near a verdict is to another one."""
    counts = found.rank and found.smallest_kept < NONZERO_SINGULAR_VALUE_MIN
    return (
        f"near another verdict: {'smallest kept' if counts else 'largest dropped'} singular value "
        f"{found.smallest_kept if counts else found.largest_dropped:.1e}, "
        f"threshold {RANK_CUTOFF_FRACTION:.0e} (rates of the directions, characteristic lengths, radians)"
    )


def format_certificate(found: EquivalenceCheck) -> str:
    """Describe the equivalence check of the hidden robot, with its tolerances."""
    return (
        f"{'passed' if found.passed else 'FAILED'} at {found.samples} configurations"
        f" ({found.discarded} discarded): {found.reason + '; ' if found.reason else ''}"
        f"largest angle {found.largest_angle:.1e} (allowed {RELATION_ANGLE_TOL:.0e}), smallest rank gap "
        f"{found.smallest_gap:.1e} (needed {RANK_GAP_MIN:.0e}), assembly residual {found.residual:.1e}"
    )


def format_verdict(found: Verdict) -> str:
    """Return the verdict on a set of legs and its unobserved dof."""
    return format_listing(
        [
            ("legs", ", ".join(found.legs)),
            ("verdict", f"{found.verdict} (rank {found.rank} of {found.dof})"),
            ("unobserved", [freedom.name for freedom in found.unobserved]),
        ]
    )


def describe_exact(exact: ExactVerdict, rank: int) -> str:
    """Describe the verdict on the architecture, and its difference from the ``rank`` of this robot."""
    if exact.rank is None:
        return f"undecided: {exact.reason}"
    text = f"{exact.verdict}, {exact.reason}"
    if exact.rank == rank:
        return text
    return (
        f"{text}: rank {exact.rank} of {exact.dof} for generic geometry, {rank} for this robot, because of its "
        "dimensions"
    )


def format_exact_cell(exact: ExactVerdict, rank: int) -> str:
    """Return :func:`describe_exact` as a cell of a table."""
    if exact.rank is None:
        return "undecided"
    text = "proved" if exact.proved else f"{exact.instances} instance" + "s" * (exact.instances > 1)
    return text if exact.rank == rank else f"{text}, generic geometry: {exact.rank} of {exact.dof}"


def format_unobserved_cell(found: Verdict) -> str:
    """Name the unobserved dof of a set of legs, as a cell of a table."""
    if found.formation is None:
        return "; ".join(freedom.name for freedom in found.unobserved)
    return f"{len(found.formation.trivial)} trivial" + "".join(f"; {flex.name}" for flex in found.formation.flexes)


def format_legs(found: Legs) -> str:
    """Return the smallest sets of the best rank, and a row per set of legs."""
    rows = [
        (
            ", ".join(each.legs),
            each.verdict,
            f"{each.rank} of {each.dof}",
            format_exact_cell(exact, each.rank),
            format_unobserved_cell(each),
        )
        for each, exact in zip(found.sets, found.exact, strict=True)
    ]
    lost = "unobserved" if any(ELSEWHERE in row[-1] for row in rows) else f"unobserved (at {found.where})"
    if found.setup.mechanism.formation:
        lost = f"unobserved (at {found.where})"
    lines = [
        f"{found.robot}   {found.architecture}   {found.dof} dof",
        f"platform: {found.setup.robot.platform_words}",
        "",
        *wrap_lines(f"smallest sets of the best rank: {found.smallest}" if found.dof else NO_FREEDOM, more="  "),
        "",
        format_table(rows, ("legs", "verdict", "rank", "exact", lost)),
        "",
        *(
            line
            for leg, seen in describe_watched(found.setup).items()
            for line in wrap_lines(f"leg {leg}: {', '.join(seen)}", more="  ")
        ),
    ]
    lines += [
        f"undecided in exact arithmetic: {reason}"
        for reason in dict.fromkeys(each.reason for each in found.exact if not each.exact)
    ]
    chance = max(each.chance for each in found.exact)
    if chance:
        lines.append(f"exact except for a chance below {round_up_power(chance)}: identities tested at random instances")
    lines += [
        f"legs {', '.join(each.legs)}: {describe_near_verdict(each)}" for each in found.sets if each.is_near_cutoff
    ]
    fewer = [
        f"{{{', '.join(each.legs)}}} ({each.rank_at_zero} of {each.dof})"
        for each in found.sets
        if each.rank_at_zero is not None
    ]
    if fewer:
        lines += wrap_lines(
            f"lower rank at {found.where}, a Type 2 singularity with these sets: " + "  ".join(fewer),
            more="  ",
        )
    lines += [f"operation mode: {text}" for text in _describe_modes(found.setup)]
    if not found.complete:
        lines.append(
            "too many sets, not all are listed: "
            + (
                "no other set of this size has the best rank at the samples"
                if found.minimal_complete
                else "no leg can be omitted from the smallest sets, but a smaller set may exist"
            )
        )
    return "\n".join(lines)


def describe_export(found: ExportedCode) -> str:
    """Return the robot, the units and the proved domain of exported code."""
    proof = found.proof
    rows: Rows = [
        format_robot_row(proof.robot),
        ("language", found.lang),
        ("motors", ", ".join(proof.motors)),
        ("joints", f"{len(proof.passive)} passive, {len(proof.fixed)} internal (fixed)"),
        ("directions", ", ".join(found.legs) or "none"),
    ]
    if found.lang == "c++":
        lines = ["each continues the last one, proved at run time over the whole step,", "or is not given"]
        rows.append(
            ("answers", lines + ["forward, jump: for any motors in the cells, proved in advance"] * found.jumps)
        )
    if found.jumps:
        rows.append(
            ("inverse", "in closed form" if found.closed else "by Newton's method, from nearby motor positions")
        )
    rows.append(("units", UNITS))
    for part in proof.parts:
        rows.append(
            (
                "proved domain",
                [f"{name} {low:.6g} to {high:.6g}" for name, low, high in zip(part.motors, *part.proved, strict=True)]
                + [f"and in all of {part.in_cells}, {100 * part.volume_fraction:.4g} % of the box"],
            )
        )
        rows += format_end_rows(part)
    rows += [("in no loop", [f"{name} {low:.6g} to {high:.6g}" for name, low, high in found.free])] * bool(found.free)
    rows += format_limit_rows(proof)
    if proof.injective_box is not None:
        rows.append(
            (
                "inverse map",
                [
                    f"{name} {low:.6g} to {high:.6g}"
                    for name, low, high in zip(proof.motors, *proof.injective_box, strict=True)
                ]
                + ["no two motor positions in this box give the same platform pose on this branch, proved"],
            )
        )
    return format_listing([*rows, ("size", f"{len(found.code.encode()) / 1024:.0f} kB")])


def encode_program(found: ExportedCode) -> bytes:
    """Return the source code."""
    return found.code.encode()


def format_advice(found: Advice) -> str:
    """Return the present verdict, then the smallest sets of further measurements, by kind."""
    now = found.now
    rows = [
        *format_head_rows(found.setup),
        *format_camera_rows(found.setup),
        ("verdict", f"{now.verdict} (rank {now.rank} of {now.dof})"),
        *format_unobserved_rows(now),
    ]
    return "\n".join([format_listing(rows), "", *_describe_missing(found)])


def _describe_missing(found: Advice) -> list[str]:
    if found.nothing_missing:
        return ["No measurement is missing" if found.now.dof else NO_FREEDOM.capitalize()]
    limits = [] if found.has_sufficient_sets else ["No set of legs, links, lines and encoders has a higher rank"]
    if not found.complete:
        limits = [f"Not every set was tried or decided: {found.tried} tried, {found.undecided} undecided"]
    if not found.sets:
        return limits
    groups: dict[tuple[str, ...], list[tuple[FurtherMeasurement, ...]]] = {}
    for each in found.sets:
        groups.setdefault(tuple(m.kind for m in each.measurements), []).append(each.measurements)
    best = found.sets[0].verdict
    gap = min(each.verdict.gap for each in found.sets)
    what = "one more measurement" if found.size == 1 else f"{found.size} more measurements"
    if any(each.cost != len(each.measurements) for each in found.sets):
        what = f"further measurements at a cost of {found.sets[0].cost:g}"
    ways = "one way" if len(found.sets) == 1 else f"{len(found.sets)} ways"
    lines = [
        f"{best.verdict.capitalize()} (rank {best.rank} of {best.dof}) with {what}, {ways}, smallest rank gap "
        f"{gap:.1e} (needed {RANK_GAP_MIN:.0e}):",
        *(
            f"  {line}"
            for group in groups.items()
            for way in _group_kinds(*group)
            for line in wrap_lines(way, LINE - 2, more="    ")
        ),
    ]
    starred = any(m.actuated for each in found.sets for m in each.measurements)
    return [
        *lines,
        *(["* a joint with a motor"] if starred else []),
        *_list_singular_sets(found),
        *_list_options(found),
        *limits,
    ]


def _list_singular_sets(found: Advice) -> list[str]:
    """List the sets with a lower rank at the zero configuration."""
    fewer = [[m.name for m in each.measurements] for each in found.sets if each.verdict.rank_at_zero is not None]
    if not fewer:
        return []
    which = "all of these" if len(fewer) == len(found.sets) else f"{len(fewer)} of these"
    more = (
        ""
        if len(fewer) <= _SETS_PRINTED_MAX
        else f"  and {len(fewer) - _SETS_PRINTED_MAX} more (rank_at_zero with --json)"
    )
    verb = "has" if len(fewer) == 1 else "have"
    title = f"{which} {verb} a lower rank at the zero configuration, a Type 2 singularity with them:"
    return (
        [title]
        if len(fewer) == len(found.sets)
        else [
            title,
            *(
                f"  {line}"
                for line in wrap_lines("  ".join(format_sets(fewer[:_SETS_PRINTED_MAX])) + more, LINE - 2, more="  ")
            ),
        ]
    )


def _list_options(found: Advice) -> list[str]:
    """Return the options for other commands, of the first set that they accept, a regular zero configuration first."""
    if not all(each.is_segment_direction for each in found.setup.observed):
        return []
    for each in sorted(found.sets, key=lambda each: each.verdict.rank_at_zero is not None):
        sensor = [m.of if m.kind == "offered" else f"encoder:{m.of}" for m in each.measurements if m.kind != "leg"]
        if all(
            m.kind in ("leg", "offered")
            or (m.kind == "encoder" and m.of in found.setup.robot.joints and m.axis is None)
            for m in each.measurements
        ):
            legs = ",".join([*found.setup.labels, *(m.of for m in each.measurements if m.kind == "leg")])
            return ["for other commands: " + " ".join([f"--observe {legs}", *(f"--sensor {text}" for text in sensor)])]
    return []


def _group_kinds(kinds: tuple[str, ...], found: Sequence[tuple[FurtherMeasurement, ...]]) -> list[str]:
    """Describe the sets of the same kinds: "any 2 of" if all choices are sets, else one by one."""
    counts = {kind: kinds.count(kind) for kind in kinds}
    names = {kind: list(dict.fromkeys(m.name for each in found for m in each if m.kind == kind)) for kind in counts}
    if len(found) == prod(comb(len(names[kind]), count) for kind, count in counts.items()):
        return [
            " and ".join(
                f"{_KINDS[kind]}: any {'' if count == 1 else f'{count} '}of {', '.join(names[kind])}"
                if len(names[kind]) > count
                else f"{_KINDS[kind]}: {', '.join(names[kind])}"
                for kind, count in counts.items()
            )
        ]
    title = " and ".join(_KINDS[kind] if count == 1 else f"{count} × {_KINDS[kind]}" for kind, count in counts.items())
    shown = "  ".join(format_sets([m.name for m in each] for each in found[:_SETS_PRINTED_MAX]))
    more = "" if len(found) <= _SETS_PRINTED_MAX else f"  and {len(found) - _SETS_PRINTED_MAX} more (all with --json)"
    return [f"{title}:", f"  {shown}{more}"]


def format_view(found: View) -> str:
    """Return what is drawn, the ranges of the sliders, and the notes."""
    sliders = []
    for slider in found.sliders:
        low, high = slider.values[0], slider.values[-1]
        ends = f"{degrees(low):.3g}° to {degrees(high):.3g}°" if slider.unit == "rad" else f"{low:.4g} to {high:.4g} m"
        sliders.append(f"{slider.name}: {ends}, {len(slider.values)} closed configurations")
    return format_listing(
        [
            format_robot_row(found.setup.robot, found.machines[0].words),
            format_head_rows(found.setup)[1],
            *(("hidden robot", machine.words) for machine in found.machines[1:]),
            ("sliders", sliders),
            ("other modes", ", ".join(outline.label for outline in found.mode_outlines) or []),
            *(("note", note) for note in found.notes),
        ]
    )
