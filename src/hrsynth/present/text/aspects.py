"""Whether two poses are joined without a Type 2 singularity."""

from __future__ import annotations

from ...analysis.aspects.answer import PathAnswer
from .tables import listing


def path(found: PathAnswer) -> str:
    """The verdict with its reason, the values at the two poses, and the path."""
    setting = found.setting
    value = "expression" if found.signed else "smallest singular value"
    rows = [("robot", f"{setting.robot.name}   {setting.anatomy.architecture()}"),
            ("observed", ", ".join(f"{o.leg} ({o.link})" for o in setting.observed)),
            ("from", f"{found.start.pose}   ({value} {found.start.value:.4g})"),
            ("to", f"{found.goal.pose}   ({value} {found.goal.value:.4g})"),
            ("verdict", f"{found.verdict} ({'certified' if found.certified else 'not certified'})"),
            ("", found.reason)]
    if found.margin is not None:
        where = "all along the path" if found.certified and found.ways else "at both poses"
        rows.append(("margin", f"|{value}| at least {found.margin:.3g} {where}, {found.boxes} intervals"))
    if found.ways:
        head = "path" if found.certified else "best path"
        rows += [(head if i == 0 else "", str(pose)) for i, pose in enumerate(found.poses)]
    rows += [("" if i else "crossings", f"leg {leg} changes its working mode at {found.poses[place]}")
             for i, (leg, place) in enumerate(found.crossings)]
    if found.certified:
        rows.append(("not proved", found.not_proved))
    return listing(rows)
