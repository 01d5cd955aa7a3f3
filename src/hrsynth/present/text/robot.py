"""A robot as it was read: its architecture, its motors, its legs and what is watched of them."""

from __future__ import annotations

from ...analysis.observed import defaults_of
from ...errors import HrsynthError
from ...mechanism import Mechanism
from ...mechanism.legs import decompose
from ...mechanism.normal import normal_form
from .tables import listing


def robot(found: Mechanism) -> str:
    """Name, size and motors; legs with their default segments, where the mechanism has legs; notes of its reading."""
    motors = ", ".join(joint.name for joint in found.joints.values() if joint.actuated) or "none"
    rows = [("links, joints", f"{len(found.links)}, {len(found.joints)}"), ("base", found.base),
            ("platform", found.platform), ("motors", motors)]
    if found.reference != found.base:
        rows.append(("camera on", found.reference))
    try:
        anatomy = decompose(normal_form(found).mechanism)
        rows.insert(0, ("robot", f"{found.name}   {anatomy.architecture()}"))
        watched = defaults_of(anatomy)
        rows += [(f"leg {leg.label}", _watched(watched[leg.label].link if leg.label in watched else None))
                 for leg in anatomy.legs]
    except HrsynthError as error:
        rows[:0] = [("robot", found.name), ("", str(error))]
    rows += [("note" if i == 0 else "", str(note)) for i, note in enumerate(found.notes)]
    return listing(rows)


def _watched(link: str | None) -> str:
    return "no segment with a direction of its own" if link is None else f"watched at {link}"
