"""Results → plain text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from ..analysis.controllability import Legs
from ..analysis.derive import Derivation
from ..tolerances import RANK_GAP, SAME_RELATION


def width(text: str) -> int:
    """Columns that ``text`` takes (combining low lines take none)."""
    return sum(1 for character in text if character != "\u0332")


def table(rows: Sequence[Sequence[str]], heads: Sequence[str]) -> str:
    """Columns set apart by two spaces, a rule under the heads; the last column is not padded."""
    everything = [list(heads), *map(list, rows)]
    columns = [max(width(row[i]) for row in everything) for i in range(len(heads))]

    def line(row: Sequence[str]) -> str:
        cells = [cell + " " * (columns[i] - width(cell)) for i, cell in enumerate(row)]
        return "  ".join(cells).rstrip()

    return "\n".join([line(heads), "  ".join("-" * size for size in columns), *map(line, rows)])


def _angle(angle: float | None) -> str:
    return "" if angle is None else f"{angle:.1e}"


def derivation(found: Derivation, hidden_file: str | None) -> str:
    """The hidden robot first, the proof next, the trace last."""
    mobility, certificate = found.mobility, found.certificate
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
        *[("lost at zero" if i == 0 else "", freedom.name) for i, freedom in enumerate(found.verdict.lost)],
        *([] if found.verdict.graph else
          [("", "there is no interaction matrix: observed links move while the platform rests")]),
        ("certificate", f"{'passed' if certificate.passed else 'FAILED'} at {certificate.samples} configurations"
         f" ({certificate.discarded} discarded): {certificate.reason + '; ' if certificate.reason else ''}"
         f"largest angle {certificate.largest_angle:.1e} (allowed {SAME_RELATION:.0e}), smallest rank gap "
         f"{certificate.smallest_gap:.1e} (needed {RANK_GAP:.0e}), follows to {certificate.residual:.1e}"),
    ]
    if found.paper is not None:
        paper = found.paper
        rows.append(("paper's form", f"{paper.hidden}: {'equivalent' if paper.equivalent else 'NOT equivalent'}"
                     f" ({paper.reason})"))
        rows += [("", f"gains {freedom.name}") for freedom in paper.gains]
        rows += [("", f"loses {freedom.name}") for freedom in paper.loses]
    if hidden_file is not None:
        rows.append(("written to", hidden_file))
    head = max(len(name) for name, _ in rows)
    lines = [f"{name:<{head}}  {value}" for name, value in rows]
    steps = [(step.rule, step.leg or "all", "yes" if step.accepted else "no", _angle(step.largest_angle), step.reason)
             for step in found.steps]
    return "\n".join([*lines, "", table(steps, ("rule", "leg", "taken", "angle", "why"))])


def legs(found: Legs) -> str:
    """One line a set of legs, the smallest sets of the best rank last."""
    rows = [(", ".join(each.legs), each.verdict, f"{each.rank} of {each.dof}",
             "; ".join(freedom.name for freedom in each.lost)) for each in found.sets]
    smallest = "  ".join("{" + ", ".join(each) + "}" for each in found.minimal)
    lines = [f"{found.robot}   {found.architecture}   {found.dof} dof", "",
             table(rows, ("legs", "verdict", "rank", "lost (at the zero configuration)")), "",
             f"smallest sets of the best rank: {smallest}"]
    if not found.complete:
        lines.append("not all sets were tried: there are too many legs")
    return "\n".join(lines)
