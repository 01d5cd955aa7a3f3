"""What is missing."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, prod

from ...analysis.advice import Advice, FurtherMeasurement
from ...tolerances import RANK_GAP
from .tables import listing

_KINDS = {"leg": "leg (direction of its default segment)", "direction": "direction of another link",
          "line": "position of an observed line", "encoder": "encoder on a joint"}
_SHOWN = 6


def advice(found: Advice) -> str:
    """What is seen now, then the smallest sets of measurements that cure it, by kind."""
    now = found.now
    setting = found.setting
    reference = setting.mechanism.reference
    rows = [("robot", f"{found.robot}   {setting.anatomy.architecture()}"),
            ("observed", ", ".join(f"{o.leg} ({o.link})" for o in setting.observed)),
            *([("camera on", reference)] if reference != setting.mechanism.base else []),
            ("verdict", f"{now.verdict} (rank {now.rank} of {now.dof})"),
            *[("lost at zero" if i == 0 else "", freedom.name) for i, freedom in enumerate(now.lost)]]
    return "\n".join([listing(rows), "", *_missing(found)])


def _missing(found: Advice) -> list[str]:
    if found.nothing_missing:
        return ["Nothing is missing"]
    limits = [] if found.cured else ["No set of legs, links, lines and encoders sees more"]
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
    ways = "one way" if len(found.sets) == 1 else f"{len(found.sets)} ways"
    lines = [f"{best.verdict.capitalize()} (rank {best.rank} of {best.dof}) with {what}, {ways}, smallest rank gap "
             f"{gap:.1e} (needed {RANK_GAP:.0e}):",
             *(f"  {line}" for group in groups.items() for line in _ways(*group))]
    starred = any(m.actuated for each in found.sets for m in each.measurements)
    return [*lines, *(["* a joint with a motor"] if starred else []), *limits]


def _ways(kinds: tuple[str, ...], sets: Sequence[tuple[FurtherMeasurement, ...]]) -> list[str]:
    """The sets of the same kinds in a few words: any so many of each kind where all choices do, else one by one."""
    counts = {kind: kinds.count(kind) for kind in kinds}
    names = {kind: list(dict.fromkeys(m.name for each in sets for m in each if m.kind == kind)) for kind in counts}
    if len(sets) == prod(comb(len(names[kind]), count) for kind, count in counts.items()):
        return [" and ".join(f"{_KINDS[kind]}: any {'' if count == 1 else f'{count} '}of {', '.join(names[kind])}"
                             if len(names[kind]) > count else f"{_KINDS[kind]}: {', '.join(names[kind])}"
                             for kind, count in counts.items())]
    head = " and ".join(_KINDS[kind] if count == 1 else f"{count} × {_KINDS[kind]}" for kind, count in counts.items())
    shown = "  ".join("{" + ", ".join(m.name for m in each) + "}" for each in sets[:_SHOWN])
    more = "" if len(sets) <= _SHOWN else f"  and {len(sets) - _SHOWN} more (all with --json)"
    return [f"{head}:", f"  {shown}{more}"]
