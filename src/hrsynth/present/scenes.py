"""Scene of all assembly modes, as points in the base frame (m).

Which curves and surfaces are drawn follows from how the platform moves (proofs.md 8; MMT Figs. 5, 7, 11, 15).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from ..analysis.loci.tips import Tip, TipLoci
from ..analysis.modes.assembly_mode import AssemblyMode
from ..analysis.modes.modes import AssemblyModes
from ..geometry.loci import Circle, Curve, Line, Point, Reach, Sphere, shift_reach
from ..geometry.vectors import Array, invert_pose, transform
from .coupler import evaluate_curve, sweep_third_point, trace_coupler, trace_coupler_chains
from .skeleton import trace_leg_outlines, trace_link_outline

LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
GOAL, CLOSES, OPEN, UNKNOWN, NEAR = "goal", "reachable", "unreachable", "unknown", "near"
_STATES = {True: CLOSES, False: OPEN, None: UNKNOWN}
SCENE_EXTENT_FRACTION = 1.3
"""Lines and planes are drawn over this many times the extent of what lies about them."""
FINE, COARSE, TURN = 241, 61, 73
"""Samples of a curve; of a surface along its first curve, and along its second."""


@dataclass(frozen=True, eq=False)
class Trace:
    """A curve (n, 3) or surface (m, n, 3). ``moving``: traced by the platform on the other legs, not the reach of one
    leg alone."""

    points: Array
    words: str
    moving: bool = False


@dataclass(frozen=True, eq=False)
class PlacedMode:
    """One mode: its number as in the text, its state, its caption, the marked point (3,), the outlines of
    the platform links, and the strokes of the real robot's legs (none where it does not close)."""

    label: str
    state: str
    words: str
    at: Array
    platform: tuple[Array, ...]
    strokes: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class ModesScene:
    """Drawn scene. ``normal`` (3,) is that of the plane in which everything moves, None in space; ``ground``
    (n, 3) are the centres of the base's joints; ``rest`` the legs whose curves are not drawn, though they count."""

    normal: Array | None
    traces: tuple[Trace, ...]
    placed: tuple[PlacedMode, ...]
    ground: Array
    rest: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the scene in a few numbers: each mode's marked point, each trace's middle and spread (m)."""
        return {
            "modes": [{"label": each.label, "state": each.state, "at": each.at.tolist()} for each in self.placed],
            "traces": [
                {
                    "words": each.words,
                    "middle": each.points.reshape(-1, 3).mean(axis=0).tolist(),
                    "spread": each.points.reshape(-1, 3).std(axis=0).tolist(),
                }
                for each in self.traces
            ],
        }


@dataclass(frozen=True, eq=False)
class _Plot:
    """The point that is marked, by its body and its place (3,) there, what the platform traces with it, what it can
    reach by each leg alone, and the legs that are in this."""

    body: str
    place: Array
    traces: tuple[Trace, ...] = ()
    reaches: tuple[tuple[Reach, str], ...] = ()
    legs: tuple[str, ...] = ()

    def mark(self, mode: AssemblyMode) -> Array:
        assert mode.bodies is not None
        X = mode.bodies[self.body]
        return transform(X, self.place)


def build_modes_scene(found: AssemblyModes) -> ModesScene:
    """Return the scene of the modes, which must not be a continuous family."""
    confined = found.confined
    plot = _make_platform_plot(found) if confined is None or confined.back else _PLOTS[confined.motion](found, confined)
    listed = [(str(k), mode) for k, mode in enumerate(found.modes, 1)]
    listed += [(f"near {k}", mode) for k, mode in enumerate(found.near_modes, 1)]
    placed = tuple(_place(found, plot, label, mode) for label, mode in listed)
    about = np.vstack([*(trace.points.reshape(-1, 3) for trace in plot.traces), *(each.at[None] for each in placed)])
    drawn = tuple(Trace(_sample_reach(reach, about, found.goal.model.length), words) for reach, words in plot.reaches)
    mechanism = found.goal.model.mechanism
    ground = np.array([joint.point for joint in mechanism.joints_of(mechanism.base)])
    rest = tuple(leg for leg in found.labels if plot.legs and leg not in plot.legs)
    return ModesScene(_find_plane_normal(found), (*plot.traces, *drawn), placed, ground, rest)


def _place(found: AssemblyModes, plot: _Plot, label: str, mode: AssemblyMode) -> PlacedMode:
    assert mode.bodies is not None
    goal = found.goal
    bodies = tuple(trace_link_outline(goal.model.mechanism, body, X) for body, X in mode.bodies.items())
    strokes = () if mode.configuration is None else trace_leg_outlines(mode.configuration, tuple(mode.bodies))
    state = NEAR if label.startswith(NEAR) else GOAL if mode.goal else _STATES[mode.reachable]
    said = "not found" if mode.reachable is None else "not assembled"
    if mode.goal:
        words = "given pose"
    elif mode.left_open:
        words = f"{said}: " + ", ".join(
            f"{noun}{'s' * (len(names) > 1)} {', '.join(names)}" for noun, names in mode.left_open
        )
    else:
        words = f"{said}: beyond joint limits" if mode.beyond_limits else "assembled"
    return PlacedMode(label, state, words, plot.mark(mode), bodies, strokes)


def _find_plane_normal(found: AssemblyModes) -> Array | None:
    """The normal of the plane in which the platform moves, where there is one."""
    if found.confined is not None and found.confined.plane is not None:
        return found.confined.plane
    shifts = found.setup.motion.translations
    flat = found.confined is None or found.confined.motion == "translations"
    return np.cross(*shifts.T) if shifts.shape[1] == 2 and flat else None


def _locate_tip_at_goal(found: AssemblyModes, tip: Tip) -> Array:
    """A tip at the goal, (3,)."""
    X = found.goal.pose(tip.body)
    return transform(X, tip.place)


def _make_platform_plot(found: AssemblyModes) -> _Plot:
    """The platform's own position, and no curves."""
    bodies = (each.bodies for each in (*found.modes, *found.near_modes))
    body = next(iter(next(each for each in bodies if each)))
    p = found.pose
    place = invert_pose(found.goal.pose(body)) @ np.array([p.x, p.y, p.z, 1.0])
    return _Plot(body, place[:3])


def _make_translating_plot(found: AssemblyModes, confined: TipLoci) -> _Plot:
    """Return the loci of the platform's position on each leg alone: they intersect at the modes (MMT Fig. 5)."""
    plot = _make_platform_plot(found)
    X = found.goal.pose(plot.body)
    p = transform(X, plot.place)
    curves = [(tip, curve) for tip in confined.tips for curve in (tip.curve, *(each for each, _ in tip.others))]
    reaches = tuple(
        (shift_reach(curve, p - _locate_tip_at_goal(found, tip)), f"platform on leg {tip.leg}")
        for tip, curve in curves
        if not isinstance(curve, Point)
    )
    return _Plot(plot.body, plot.place, (), reaches)


def _make_planar_plot(found: AssemblyModes, confined: TipLoci) -> _Plot:
    """The coupler curve of two tips and the third leg's curve (MMT Fig. 7); about a pivot a circle and a curve."""
    n = confined.plane
    legs = _list_deciding_legs(found, confined, 3) or _list_deciding_legs(found, confined, 2)
    if n is None or not legs:
        return _make_platform_plot(found)
    tips = [confined.tips[k] for k in legs]
    at = np.array([_locate_tip_at_goal(found, tip) for tip in tips])
    level = at - np.outer(at @ n, n)
    flat = [shift_reach(_build_curve(tip), -n * float(n @ tip.curve.centre)) for tip in tips]
    last = tips[-1]
    reach, words, names = (
        (flat[-1], _name_trace(last, (last,))),
        _name_trace(last, tips[:-1]),
        tuple(tip.leg for tip in tips),
    )
    if len(tips) == 2:
        circle = Circle(flat[0].centre, n, float(np.linalg.norm(level[1] - level[0])))
        return _Plot(last.body, last.place, (), ((circle, words), reach), names)
    bar = float(np.linalg.norm(level[1] - level[0]))
    branches = trace_coupler_chains(flat[0], flat[1], bar, FINE)
    traces = tuple(Trace(trace_coupler(each, level, n), words, True) for each in branches)
    return _Plot(last.body, last.place, traces, (reach,), names)


def _make_spatial_plot(found: AssemblyModes, confined: TipLoci) -> _Plot:
    """The surface of the third tip while two tips slide on their curves, and the third leg's curve (MMT Fig. 11)."""
    legs = _list_deciding_legs(found, confined, 3)
    if not legs:
        return _make_platform_plot(found)
    tips = [confined.tips[k] for k in legs]
    at = np.array([_locate_tip_at_goal(found, tip) for tip in tips])
    last = tips[-1]
    branches = trace_coupler_chains(
        _build_curve(tips[0]), _build_curve(tips[1]), float(np.linalg.norm(at[1] - at[0])), COARSE
    )
    surfaces = (sweep_third_point(each, at, TURN) for each in branches)
    traces = tuple(Trace(each[0] if len(each) == 1 else each, _name_trace(last, tips[:-1]), True) for each in surfaces)
    return _Plot(
        last.body, last.place, traces, ((last.curve, _name_trace(last, (last,))),), tuple(tip.leg for tip in tips)
    )


def _make_bodies_plot(found: AssemblyModes, confined: TipLoci) -> _Plot:
    """The surface of translation of one body's curve and the slide, and the other body's curve (MMT Fig. 15)."""
    legs = _list_deciding_legs(found, confined, 2)
    if not legs or not isinstance(confined.slide, Circle) or len({confined.tips[k].body for k in legs}) < 2:
        return _make_platform_plot(found)
    first, last = (confined.tips[k] for k in legs)
    sign = 1.0 if first.body == confined.bodies[0] else -1.0
    arms = [_locate_tip_at_goal(found, tip) - found.goal.pose(tip.body)[:3, 3] for tip in (first, last)]
    start = _sample_reach(first.curve, _locate_tip_at_goal(found, first)[None], 2 * confined.slide.radius, COARSE)
    around = evaluate_curve(confined.slide, np.linspace(0, 2 * np.pi, TURN))
    dome = (start - arms[0] + arms[1])[:, None] + sign * around
    return _Plot(
        last.body,
        last.place,
        (Trace(dome, _name_trace(last, (first,)), True),),
        ((last.curve, _name_trace(last, (last,))),),
        (first.leg, last.leg),
    )


_PLOTS: dict[str, Callable[[AssemblyModes, TipLoci], _Plot]] = {
    "translations": _make_translating_plot,
    "planar": _make_planar_plot,
    "spatial": _make_spatial_plot,
    "oriented": _make_spatial_plot,
    "bodies": _make_bodies_plot,
}


def _name_trace(tip: Tip, legs: Sequence[Tip]) -> str:
    """Name a trace: the locus of the attachment point of a leg while the platform is held by these legs alone."""
    return f"B{tip.leg.translate(LOWERED)} on leg{'s' if len(legs) > 1 else ''} {', '.join(each.leg for each in legs)}"


def _list_deciding_legs(found: AssemblyModes, confined: TipLoci, count: int) -> tuple[int, ...]:
    """The places of this many legs on curves for which the modes were solved, fixed tips first, and last the moving
    tip whose places at the modes are farthest apart. Empty where there are none or legs have several branches."""
    if any(tip.others for tip in confined.tips):
        return ()
    legs = next(
        (
            legs
            for mode in found.found.modes
            if len(legs := mode.legs) == count and all(isinstance(confined.tips[k].curve, Curve) for k in legs)
        ),
        (),
    )

    def apart(k: int) -> tuple[bool, float, int]:
        tip = confined.tips[k]
        places = [_Plot(tip.body, tip.place).mark(mode) for mode in found.modes]
        least = min((float(np.linalg.norm(a - b)) for a, b in combinations(places, 2)), default=0.0)
        return not isinstance(tip.curve, Point), round(least / found.goal.model.length, 6), k

    last = max(legs, key=apart, default=None)
    return tuple(sorted(legs, key=lambda k: (k == last, not isinstance(confined.tips[k].curve, Point))))


def _build_curve(tip: Tip) -> Curve:
    assert isinstance(tip.curve, Curve)
    return tip.curve


def _sample_reach(reach: Reach, about: Array, least: float, samples: int = FINE) -> Array:
    """Points to draw a reach with: a circle or sphere whole, a line or plane as far as what lies ``about`` it (n, 3),
    at least over ``least`` each way."""
    if isinstance(reach, Point):
        return reach.centre[None]
    if isinstance(reach, Circle):
        return evaluate_curve(reach, np.linspace(0, 2 * np.pi, samples))
    if isinstance(reach, Sphere):
        theta, phi = np.meshgrid(np.linspace(0, np.pi, COARSE), np.linspace(0, 2 * np.pi, TURN), indexing="ij")
        ball = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
        return reach.centre + reach.radius * ball
    axes = reach.direction[None] if isinstance(reach, Line) else np.linalg.svd(reach.normal[None])[2][1:]
    along = (about - reach.centre) @ axes.T
    middle = (along.min(axis=0) + along.max(axis=0)) / 2
    half = np.maximum(SCENE_EXTENT_FRACTION * (along.max(axis=0) - along.min(axis=0)) / 2, least)
    sides = [middle[i] + half[i] * np.linspace(-1, 1, 3) for i in range(len(axes))]
    if len(axes) == 1:
        return np.asarray(reach.centre + sides[0][:, None] * axes[0])
    return np.asarray(reach.centre + sides[0][:, None, None] * axes[0] + sides[1][None, :, None] * axes[1])
