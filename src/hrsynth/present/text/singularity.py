"""The Type 2 condition of a robot."""

from __future__ import annotations

from collections.abc import Sequence

from ...analysis.singularity.singular import Singularity
from .tables import listing


def singularity(found: Singularity, file: str | None = None) -> str:
    """The condition in words and as an expression, what was checked, and singular poses."""
    anatomy, condition, checked = found.setting.anatomy, found.condition, found.checked
    measured = [o for o in found.question.observations]
    what = ("motors", ", ".join(dict.fromkeys(str(getattr(o, "joint", o.link)) for o in measured))) if found.real else (
        "observed", ", ".join(f"{o.leg} ({o.link})" for o in measured))
    rows = [("robot", f"{found.setting.robot.name}   {anatomy.architecture()}"), what,
            ("verdict", f"{found.verdict.verdict} (rank {found.verdict.rank} of {found.verdict.dof})"),
            ("Type 2", found.words)]
    if condition is not None:
        rows.append(("expression", f"{condition.expression}{' (never zero)' if condition.never else ' = 0'}"))
        rows += _listed("where", [f"{name}: {meaning}" for name, meaning in condition.where.items()])
        rows += _listed("split off", list(condition.factors))
    if checked is not None:
        rows += [("checked", f"{checked.points} random poses and {len(checked.on_locus)} on the locus, "
                  f"{checked.disagreements} disagreements of words, expression and rank"),
                 ("", f"largest angle between a leg's named wrenches and the rank's {checked.largest_angle:.1e} rad")]
        if condition is not None and condition.signed:
            rows.append(("", f"expression positive at {checked.sides[0]}, negative at {checked.sides[1]} of the random "
                         "poses"))
    if condition is not None and not condition.never and not found.examples:
        searches = 0 if checked is None else checked.searches
        rows.append(("singular at", f"not found by {searches} searches, which does not say that there is none"))
    for i, each in enumerate(found.examples):
        rows += [("singular at" if i == 0 else "", str(each.pose)),
                 ("", f"  singular value {each.sigma:.1e}, a centimetre away up to {each.nearby:.1e}; lost: "
                  + "; ".join(freedom.name for freedom in each.lost))]
    if file is not None:
        rows.append(("drawn in", file))
    return listing(rows)


def _listed(head: str, values: Sequence[str]) -> list[tuple[str, str]]:
    return [(head if i == 0 else "", value) for i, value in enumerate(values)]
