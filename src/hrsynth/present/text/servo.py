"""A servo run in text."""

from __future__ import annotations

import math

from ...simulation.result import Servo
from ...simulation.track import CONSTRAINT, LIMIT, TYPE_1, TYPE_2
from ...tolerances import DAMPED
from .tables import listing

_PASSED = {TYPE_2: "crosses a Type 2 singularity of the hidden robot",
           TYPE_1: "a watched leg passes its limit (Type 1) into another working mode",
           LIMIT: "a leg that is not watched passes its limit",
           CONSTRAINT: "crosses a constraint singularity of the loops"}


def servo(found: Servo, file: str | None = None) -> str:
    """What was asked, where the run ended and why, what it passed, and how far noise kept it away."""
    setting, run, track = found.setting, found.run, found.track
    rows = [("robot", f"{setting.robot.name}   {setting.anatomy.architecture()}"),
            ("observed", ", ".join(f"{o.leg} ({o.link})" for o in setting.observed)),
            ("from", str(found.start)), ("to", str(found.goal)),
            ("controller", f"gain {found.gain:g} per second, sensed: {found.sense}"
                           + ("" if found.noise is None else f", noise {found.noise}"))]
    rows += [("", ""), ("ended", f"{found.ended} after {run.times[-1]:.3g} s"), ("", found.ending.reason),
             ("at", str(found.pose))]
    off = found.from_goal
    if found.ended != "goal":
        rows.append(("", f"{1e3 * off[0]:.4g} mm and {_degrees(off[1])} degrees from the goal"))
    listed = found.ending.modes
    if listed is not None:
        rows += [("modes" if i == 0 else "", f"{i + 1}: {mode.pose}" + ("   (the goal)" if mode.goal else ""))
                 for i, mode in enumerate(listed.modes)]
    if found.spread is not None:
        s = found.spread
        rows.append(("noise", f"keeps it within {1e3 * s.metres:.3g} mm and {_degrees(s.radians)} degrees of "
                              f"there, root mean square {1e3 * s.rms_metres:.2g} mm and "
                              f"{_degrees(s.rms_radians)} degrees"))
        if s.aside:
            rows.append(("", f"holds it aside: on average {1e3 * s.offset:.3g} mm from there, at "
                             f"({' '.join(f'{value:.4g}' for value in s.mean)})"))
    rows += [("", line) for line in found.notes]
    least = track.to_dict(run.times.tolist())
    if least["smallest"] is not None:
        rows.append(("on the way", f"smallest singular value of Mᵀ {least['smallest']:.3g}, at {least['at']:.3g} s"))
    rows += [("", f"{_PASSED[each.kind]} before {run.times[each.place]:.3g} s, at "
                  f"{found.pose_of(run.configurations[each.place])}") for each in track.passages or ()]
    if track.passages == ():
        met = least["smallest"] is not None and least["smallest"] < DAMPED
        rows.append(("", "a Type 2 singularity met and left again on the same side" if met
                     else "no singularity crossed"))
    if file is not None:
        rows.append(("picture", file))
    return listing(rows)


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 6):.2g}"
