"""Hidden robots and sets of legs, with their verdicts."""

from __future__ import annotations

from ...analysis.controllability import Legs, Verdict
from ...analysis.derive import Derivation
from ...analysis.exact import ExactVerdict, power_above
from ...analysis.observed import ObservedRobot
from ...kinematics.certificate import Certificate
from ...tolerances import RANK_CUTOFF, RANK_GAP, SAME_RELATION, SURELY_SOMETHING
from .tables import listing, table


def _angle(angle: float | None) -> str:
    return "" if angle is None else f"{angle:.1e}"


def derivation(found: Derivation, hidden_file: str | None = None, report: str | None = None) -> str:
    """The hidden robot first, the proof next, the trace last."""
    mobility = found.mobility
    observed = ", ".join(f"{o.leg} ({o.link})" for o in found.setting.observed)
    hidden = found.hidden_architecture
    reference = found.setting.mechanism.reference
    rows = [
        ("robot", f"{found.robot.name}   {found.architecture}"),
        ("dof", f"{found.dof} (mobility {mobility.total}, of which {mobility.idle} idle)"),
        *([] if found.setting.anatomy.point is None else
          [("", "the platform is a point: its velocity is what is controlled, its turn is idle")]),
        ("observed", observed),
        *([("camera on", reference)] if reference != found.setting.mechanism.base else []),
        ("hidden robot", str(hidden) if hidden else "none: every observed direction is constant"),
        ("verdict", found.verdict.verdict),
        *([("", near(found.verdict))] if found.verdict.near else []),
        *[("" if i else "mode", text) for i, text in enumerate(_modes(found.setting))],
        ("architecture", exact_words(found.exact, found.verdict.rank)),
        *[("lost at zero" if i == 0 else "", freedom.name) for i, freedom in enumerate(found.verdict.lost)],
        *([] if found.verdict.graph else
          [("", "there is no interaction matrix: observed links move while the platform rests")]),
        ("certificate", certificate(found.certificate)),
    ]
    if found.paper is not None:
        paper = found.paper
        rows.append(("paper's form", f"{paper.hidden}: {'equivalent' if paper.equivalent else 'NOT equivalent'}"
                     f" ({paper.reason})"))
        rows += [("", f"gains {freedom.name}") for freedom in paper.gains]
        rows += [("", f"loses {freedom.name}") for freedom in paper.loses]
    if hidden_file is not None:
        rows.append(("written to", hidden_file))
    if report is not None:
        rows.append(("report", report))
    steps = [(step.rule, step.leg or "all", "yes" if step.accepted else "no", _angle(step.largest_angle), step.reason)
             for step in found.steps]
    return "\n".join([listing(rows), "", table(steps, ("rule", "leg", "taken", "angle", "why"))])


def _modes(setting: ObservedRobot) -> list[str]:
    """For which operation mode a verdict holds, where others were met."""
    found = setting.beside()
    own = setting.everything.signature
    return [f"for the operation mode of the zero configuration: {own.dof} dof ({own.motion}), mobility {own.mobility}",
            *(f"another that was met: {text}" for text in found)] if found else []


def near(found: Verdict) -> str:
    """How far a verdict is from another one, where that is not far."""
    if found.rank and found.counted < SURELY_SOMETHING:
        return (f"near another verdict: a motion that counts as seen has the singular value {found.counted:.1e}, which "
                f"counts above {RANK_CUTOFF:.0e} (rates of the directions, characteristic lengths, radians)")
    return (f"near another verdict: a motion that counts as not seen has the singular value {found.dropped:.1e}, which "
            f"counts above {RANK_CUTOFF:.0e} (rates of the directions, characteristic lengths, radians)")


def certificate(found: Certificate) -> str:
    """How closely the hidden robot agrees with the real one, and how closely it must."""
    return (f"{'passed' if found.passed else 'FAILED'} at {found.samples} configurations"
            f" ({found.discarded} discarded): {found.reason + '; ' if found.reason else ''}"
            f"largest angle {found.largest_angle:.1e} (allowed {SAME_RELATION:.0e}), smallest rank gap "
            f"{found.smallest_gap:.1e} (needed {RANK_GAP:.0e}), follows to {found.residual:.1e}")


def verdict(found: Verdict) -> str:
    """What a set of legs sees, and what it does not."""
    lost = [("lost" if i == 0 else "", freedom.name) for i, freedom in enumerate(found.lost)]
    return listing([("legs", ", ".join(found.legs)), ("verdict", f"{found.verdict} (rank {found.rank} of {found.dof})"),
                    *lost])


def exact_words(exact: ExactVerdict, rank: int) -> str:
    """The architecture's verdict beside the ``rank`` that the robot itself shows."""
    if exact.rank is None:
        return f"not decided: {exact.reason}"
    text = f"{exact.verdict}, {exact.reason}"
    if exact.rank == rank:
        return text
    return (f"{text}: generic geometry sees {exact.rank} of {exact.dof} freedoms, this robot {rank}, because of its "
            "dimensions")


def exact_cell(exact: ExactVerdict, rank: int) -> str:
    """The same in a cell of a table."""
    if exact.rank is None:
        return "not decided"
    text = "proved" if exact.proved else f"{exact.instances} instance" + "s" * (exact.instances > 1)
    return text if exact.rank == rank else f"{text}, of generic geometry: {exact.rank} of {exact.dof}"


def legs(found: Legs) -> str:
    """One line a set of legs, the smallest sets of the best rank last."""
    rows = [(", ".join(each.legs), each.verdict, f"{each.rank} of {each.dof}", exact_cell(exact, each.rank),
             "; ".join(freedom.name for freedom in each.lost))
            for each, exact in zip(found.sets, found.exact, strict=True)]
    lines = [f"{found.robot}   {found.architecture}   {found.dof} dof", "",
             table(rows, ("legs", "verdict", "rank", "exact", "lost (at the zero configuration)")), "",
             f"smallest sets of the best rank: {found.smallest}"]
    lines += [f"not decided in exact arithmetic: {reason}"
              for reason in dict.fromkeys(each.reason for each in found.exact if not each.exact)]
    chance = max(each.chance for each in found.exact)
    if chance:
        lines.append(f"exact but for a chance below {power_above(chance)}: identities tested at random instances")
    lines += [f"legs {', '.join(each.legs)}: {near(each)}" for each in found.sets if each.near]
    lines += _modes(found.setting)
    if not found.complete:
        lines.append("not all sets were tried: there are too many legs")
    return "\n".join(lines)
