"""Figure of the equilibria of a loop: the robot at the goal, and the platform at every stable equilibrium."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kinematics.configuration import ClosedConfiguration
from ..simulation.equilibria.equilibrium import CRITICAL, STABLE, Equilibria, Equilibrium
from . import palette
from .figure_format import PNG, Paper, draw_legend_within, print_figure, wrap_title
from .palette import SERIES
from .plots import describe_pose, in_style, make_empty_figure, make_legend_entry
from .skeleton import trace_leg_outlines, trace_link_outline
from .sketch import Sketch
from .view.view import find_plane_normal

WIDE, TALL, EDGE, SCALES = 7.2, 6.4, 0.2, 0.8
"""Width and height of the figure, its margin, and the room for the scales (inches)."""
DRAWN_EQUILIBRIUM_RANGE_FRACTION = 1.6
"""Distance from the middle of the robot up to which equilibria are drawn, over the extent of the robot."""
LOOKS: dict[str, dict[str, Any]] = {
    "goal": {"color": palette.get_colour("goal"), "marker": "*", "markersize": 13},
    "assembly mode": {"color": palette.get_colour("mode"), "marker": "D", "markersize": 8},
    "antipodal": {"color": SERIES[3], "marker": "s", "markersize": 8},
    "critical": {"color": SERIES[1], "marker": "o", "markersize": 8},
    "other": {"color": "0.6", "marker": "x", "markersize": 5},
}
BASE: dict[str, Any] = {"color": "black", "marker": "s", "markersize": 4}
WORDS = {
    "goal": "goal",
    "assembly mode": "other assembly mode",
    "antipodal": "antipodal pose",
    "critical": "nonzero error, stable",
    "other": "saddle or unstable",
}


@in_style
def draw_equilibria(found: Equilibria, paper: Paper = PNG) -> bytes:
    """Draw the equilibria as a figure on ``paper``."""
    goal, platform = found.goal, found.setup.decomposition.platform
    mechanism, motion = goal.model.mechanism, found.setup.motion
    ground = np.array([joint.point for joint in mechanism.joints_of(mechanism.base)])
    robot = [
        *trace_leg_outlines(goal, platform),
        *_list_outlines(goal, platform),
        *_list_observation_lines(found, goal),
    ]
    extent = np.vstack([ground, *robot])
    middle, size = (extent.min(axis=0) + extent.max(axis=0)) / 2, float(np.ptp(extent, axis=0).max())
    drawn = [(each, motion.position(each.configuration.pose(motion.link))) for each in found.points]
    near = [(each, p) for each, p in drawn if np.abs(p - middle).max() <= DRAWN_EQUILIBRIUM_RANGE_FRACTION * size]
    shapes = [
        (
            look(each),
            [*_list_outlines(each.configuration, platform), *_list_observation_lines(found, each.configuration)],
        )
        for each, _ in near
        if each.stability == STABLE
    ]
    every = np.vstack([extent, *(p for _, p in near), *(stroke for _, some in shapes for stroke in some)])
    figure = make_empty_figure(paper.wide(WIDE), TALL)
    far = len(drawn) - len(near)
    beyond = f"; {far} farther away not drawn" if far else ""
    word = "legs " if all(each.is_segment_direction for each in found.setup.observed) else ""
    title = figure.suptitle(
        f"{found.setup.robot.name}, {word}{', '.join(found.setup.labels)} observed, goal "
        f"{describe_pose(found.pose)}\n{len(found.stable)} of {len(found.points)} equilibria stable"
        f"{beyond}",
        va="top",
    )
    above = wrap_title(figure, title)
    kinds = [kind for kind in WORDS if any(look(each) == kind for each, _ in near)]
    entries = [
        make_legend_entry("robot at the goal", color="0.72"),
        make_legend_entry("joints of the base", linestyle="", **BASE),
        *(make_legend_entry(WORDS[k], linestyle="", **LOOKS[k]) for k in kinds),
    ]
    if shapes:
        entries.append(
            make_legend_entry("platform at stable equilibria (in their colour)", color="black", linewidth=1.6)
        )
    low = draw_legend_within(figure, entries, figure.get_figwidth(), loc="lower center")
    wide, tall = figure.get_figwidth(), figure.get_figheight()
    box = (SCALES / wide, (low + SCALES) / tall, 1 - (SCALES + EDGE) / wide, 1 - (low + SCALES + above + EDGE) / tall)
    sketch = Sketch.of(find_plane_normal(motion), ground, [])
    place = sketch.place(figure, box, every)
    for stroke in robot:
        sketch.stroke(place, stroke, color="0.72", linewidth=1.2)
    for kind, some in shapes:
        for stroke in some:
            sketch.stroke(place, stroke, color=LOOKS[kind]["color"], linewidth=1.6, zorder=5)
    for kind in reversed(kinds):
        points = np.array([p for each, p in near if look(each) == kind])
        sketch.stroke(place, points, linestyle="", zorder=8 if kind != "other" else 4, **LOOKS[kind])
    sketch.stroke(place, ground, linestyle="", zorder=6, **BASE)
    return print_figure(figure, paper)


def look(each: Equilibrium) -> str:
    """Return the kind as which an equilibrium is drawn."""
    return each.kind if each.kind != CRITICAL or each.stability == STABLE else "other"


def _list_outlines(at: ClosedConfiguration, platform: Any) -> list[Any]:
    return [trace_link_outline(at.model.mechanism, link, at.pose(link)) for link in platform]


def _list_observation_lines(found: Equilibria, at: ClosedConfiguration) -> list[Any]:
    """Return the observations other than segments, as lines in space."""
    reference, size = found.setup.mechanism.reference, at.model.length / 2
    return [
        line
        for each in found.setup.observed
        if not each.is_segment_direction
        for line in each.draw(at.pose(each.seen_from or reference), at.pose(each.link), size).lines
    ]
