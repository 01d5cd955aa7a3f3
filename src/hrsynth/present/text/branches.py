"""Branch from motors to joints in text: the proved part, and the ends of the proof."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...analysis.branch.answer import UNSEEN
from .tables import Rows, format_listing, format_robot_row

if TYPE_CHECKING:
    from ...analysis.branch.answer import BranchPart, BranchProof, Toggle

UNITS = "metres and radians"
"""Units of the motor intervals."""


def format_branch(found: BranchProof) -> str:
    """Return the robot, then each part: its box, the proved fraction, and the ends of the proof."""
    rows: Rows = [
        format_robot_row(found.robot),
        ("motors", ", ".join(found.motors)),
        (
            "passive",
            f"{len(found.passive)} coordinates" + (f", {len(found.fixed)} internal ones fixed" if found.fixed else ""),
        ),
        ("box", found.box),
        ("units", UNITS),
        *format_limit_rows(found),
    ]
    for part in found.parts:
        rows += _format_part(part)
    if not found.parts:
        rows.append(("branch", "no loops: the motors are the only joints"))
    return format_listing(rows + _format_inverse_rows(found) + _format_safe_box(found))


def _format_safe_box(found: BranchProof) -> Rows:
    """Return the row of the box of motors within all limits and without singularity."""
    if found.safe_box is None or not found.parts:
        return []
    box = ",".join(
        f"{name}={low:.6g}:{high:.6g}" for name, low, high in zip(found.motors, *found.safe_box, strict=True)
    )
    kinds = "Type 1 or 2" if found.regular or found.injective_box is not None else "Type 2"
    unseen = ", ".join(limit.joint for limit in found.limits if limit.verdict == UNSEEN)
    within = f"all joints within their limits{f' (not examined: {unseen})' * bool(unseen)}, " * bool(found.robot.filed)
    return [("safe box", f"{box}: {within}no {kinds} singularity on this branch, proved")]


def format_limit_rows(found: BranchProof) -> Rows:
    """Return the row of joint limits: those of passive joints, and those of motors that the box exceeds."""
    words = found.limits_in_words()
    if beyond := found.motors_beyond():
        words.append("exceeded by the box, of motors: " + ", ".join(beyond))
    return [("limits", words)] if words else []


def _format_inverse_rows(found: BranchProof) -> Rows:
    """Return the rows of the inverse map, from the platform to the motors."""
    if not all(part.cells for part in found.parts):
        return []
    rows: Rows = [("", "")]
    if found.injective_box is None:
        rows.append(
            ("inverse map", "undecided: motor positions for a pose are found, others in the box may give the same pose")
        )
    else:
        (low, high), (least, most) = found.injective_box, found.proved
        whole = bool((low == least).all() and (high == most).all())
        rows.append(
            (
                "inverse map",
                f"no two motor positions in {'' if whole else 'a part of '}the proved box give the "
                "same platform pose on this branch, proved",
            )
        )
        if not whole:
            rows.append(
                (
                    "injective box",
                    [f"{name} {a:.6g} to {b:.6g}" for name, a, b in zip(found.motors, low, high, strict=True)],
                )
            )
    if found.regular:
        rows.append(("Type 1", "no such singularity on this branch in the proved box, proved"))
    return rows


def _format_part(part: BranchPart) -> Rows:
    bounds = [
        f"{name} {low:.6g} to {high:.6g} (of {first:.6g} to {last:.6g})"
        for name, low, high, first, last in zip(part.motors, *part.proved, *part.requested_box, strict=True)
    ]
    rows: Rows = [("", ""), ("from", ", ".join(part.motors)), ("to", ", ".join(part.passive))]
    if not part.cells:
        return [*rows, ("branch", "undecided: no cell about the zero configuration could be proved")]
    weakest = min(cell.smallest_singular_value for cell in part.cells)
    whole = part.volume_fraction == 1.0
    but = "; redundant equations only bounded" if part.closed_to else ""
    rows += [
        (
            "branch",
            ("one branch, proved in the whole box" if whole else f"one branch, proved in {part.percent} % of the box")
            + but,
        ),
        ("cells", f"{len(part.cells)}; smallest singular value of the loop Jacobian at least {weakest:.3g}"),
    ]
    if not whole:
        rows.append(("proved box", bounds))
    if part.unsure:
        rows.append(("rods", f"turns not proved to have one value in all cells: {', '.join(part.unsure)}"))
    rows += [
        (f"turn of {name}", "the branch returns to itself" if same else "the branch does not return to itself")
        for name, same in part.turns
    ]
    if part.redundant:
        rows.append(
            (
                "redundant",
                part.redundant
                + (
                    f": each holds to {part.closed_to:.2g} (cosines, or characteristic lengths)"
                    if part.closed_to
                    else ""
                ),
            )
        )
    return rows + format_end_rows(part)


def format_end_rows(part: BranchPart) -> Rows:
    """Return the row of the ends of a part's proof, with reasons."""
    return [("proof ends" if not place else "", _end(part, each)) for place, each in enumerate(part.toggles)]


def _end(part: BranchPart, end: Toggle) -> str:
    at = part.place(end.q)
    if not end.joints:
        return f"at {at}: {end.reason}"
    loops = f" (loop {', '.join(end.loops)})" if len(end.loops) == 1 else ""
    return f"at {at} (not proved): {', '.join(end.joints)} can move while all motors are fixed{loops}"
