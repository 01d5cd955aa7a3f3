"""3D view of a robot: its links and joints, its hidden robot, sliders, directions, assembly modes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...analysis.analysis_declaration import analysis
from ...analysis.derive import Derivation, derive
from ...analysis.observation_inputs import POINTS, CameraLike, LegsLike, Seed, SensorLike
from ...analysis.observed import ObservedRobot, RobotLike
from ...geometry.vectors import Array, orient_axis
from ...kinematics.coordinates import Coordinates
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism import Mechanism
from ...mechanism.model import PlatformChoice
from ...mechanism.observation import Observation
from ...mechanism.observations.direction import Direction
from ...options import option
from ...progress import report
from ...records import FLAT, As, Number, Recorded, Shown, recorded
from ...results import Result, Value
from ..outputs import OUTPUTS, load_function
from .meshes import collect_meshes
from .mode_outlines import ModeOutline, list_mode_outlines
from .scale import choose_error_unit, scale
from .shapes import PAGE_DIGITS_COUNT, ROD_RADIUS_FRACTION, Drawer, Shape
from .sights import compute_image_frames, list_cameras
from .states import HIDDEN, REAL, Mover, Slider, ViewState, place, round_page_values

ARROW = (0.35, 0.7)
"""Length of an arrow at least and at most (characteristic lengths); between these, a part ``SHARE`` of its link's."""
ARROW_LENGTH_FRACTION = 0.55
RAIL_END_LENGTH_FRACTION = 4.0
"""Margin of a rail at each end (radii of rods)."""


@dataclass(frozen=True, eq=False, repr=False)
class Machine(Value):
    """Robot that is drawn: ``key`` real or hidden, its label, its links in order, its shapes, the base's
    and the platform's frame (7,) at the zero configuration, and of each link the real robot's leg that holds it."""

    key: str
    words: str
    links: tuple[str, ...]
    platform: tuple[str, ...]
    shapes: tuple[Shape, ...]
    frames: tuple[tuple[str, Array], ...] = ()
    legs: tuple[str | None, ...] = ()

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        places = {name: i for i, name in enumerate(self.links)}
        return {
            "key": self.key,
            "words": self.words,
            "links": list(self.links),
            "legs": list(self.legs),
            "platform": [places[link] for link in self.platform],
            "shapes": [shape.scene(places) for shape in self.shapes],
            "frames": [{"link": places[link], "place": round_page_values(X[None])[0]} for link, X in self.frames],
        }


@dataclass(frozen=True, eq=False, repr=False)
class Arrow(Value):
    """Observed direction: its leg, its link, and where the arrow runs (2, 3) at the zero configuration."""

    leg: str
    link: str
    ends: Array


@dataclass(frozen=True, eq=False, repr=False)
class View(Result, shown_as="view"):
    """Result of :func:`format_view`. ``normal`` (3,) is that of the plane in which everything moves, None in space."""

    setup: Annotated[ObservedRobot, FLAT]
    derivation: Derivation | None
    mover: Mover
    machines: tuple[Machine, ...]
    home: ViewState
    sliders: Recorded[tuple[Slider, ...]]
    arrows: tuple[Arrow, ...]
    mode_outlines: Annotated[tuple[ModeOutline, ...], As("modes")]
    normal: Array | None
    notes: Recorded[tuple[str, ...]]

    def headline(self) -> str:
        """Return the robot, and the number of sliders and modes."""
        return f"{self.setup.robot.name}, {len(self.sliders)} sliders, {len(self.mode_outlines)} other assembly modes"

    @property
    @recorded(As("largest_distance"))
    def largest(self) -> float | None:
        """Largest of the smallest singular values that are shown."""
        found = [state.distance for slider in self.sliders for state in slider.states]
        return max((value for value in found if value is not None), default=self.home.distance)

    def save(self, file: str | Path) -> None:
        """Write the view as one page (.html) that needs neither server nor network.

        Raises
        ------
        BadRequest
            If the file cannot be written.
        """
        (each,) = OUTPUTS[self.shown_as].files
        each.require(str(file), {})
        each.writer(self, str(file), {})[0]()

    def serve(self, port: int = 0, *, open_: bool = True) -> Any:
        """Serve the view on this machine, where all sliders move together, and open it in the browser.

        Parameters
        ----------
        port
            Port of the server; 0 for any free port.
        open_
            Open the browser.

        Returns
        -------
        StudioServer
            Server with ``address`` and ``stop()``.

        Raises
        ------
        BadRequest
            If the port is not available.
        """
        return load_function("studio.server:serve_view")(self, port, open_)

    dof = Shown(int, lambda self: self.setup.dof)
    shown = Shown(dict[str, str], lambda self: {machine.key: machine.words for machine in self.machines})
    distance = Shown(Number, lambda self: self.home.distance)

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        every = list_cameras(self.setup)
        return {
            **describe_stage(self.setup, self.machines, self.arrows),
            "scale": scale(choose_error_unit(self.setup)),
            "kept": True,
            "words": "; ".join(f"{machine.key} {machine.words}" for machine in self.machines),
            "legs": [{"name": arrow.leg, "watched": True} for arrow in self.arrows],
            "state": self.home.scene(),
            "sliders": [slider.scene() for slider in self.sliders],
            "ghosts": [outline.scene() for outline in self.mode_outlines],
            "notes": list(self.notes),
            "cameras": [
                {"name": eye.name, "half": half.tolist()}
                for eye, half in zip(every, compute_image_frames(every, self.home.sights), strict=True)
            ],
        }


@analysis(
    160,
    examples=(
        "quattro --observe 1,4 --hidden",
        "quattro --observe 1,4 --static quattro.html",
        f"gough_stewart {POINTS} --static points.html",
    ),
)
def view(
    robot: RobotLike,
    observe: LegsLike = None,
    camera: CameraLike = None,
    *,
    sensor: SensorLike = None,
    hidden: Annotated[bool, option("Show the hidden robot too, its virtual actuators highlighted.")] = False,
    seed: Seed = 0,
) -> View:
    """A 3D view in the browser: sliders that keep the loops closed, what is observed, assembly modes.

    Parameters
    ----------
    robot, observe, camera, sensor, seed
        As for ``derive``. Without ``hidden`` neither a platform nor a segment is needed: the first link that can be the
        platform is moved, and ``notes`` report it.
    hidden
        Show the hidden robot too.

    Returns
    -------
    View
        Every position of a slider is a closed configuration in which one coordinate of the platform differs from the
        zero configuration. ``notes`` report assembly modes that cannot be listed, and missing meshes.

    Raises
    ------
    HrsynthError
        As for ``derive``.

    Examples
    --------
    >>> hrsynth.view("3rrr_m1")
    <View: 3rrr_m1, 3 sliders, 1 other assembly modes>
    """
    notes: tuple[str, ...] = ()
    if isinstance(robot, Mechanism) and robot.has_open_platform and not hidden:
        notes = (f"the sliders move link {robot.platform!r}: {robot.choice}",)
        robot = replace(robot, choice=PlatformChoice("assumption", "the first that could be"))
    setup = ObservedRobot.of(robot, observe, camera, sensor=sensor, seed=seed, blind=not hidden)
    derivation = derive(setup, seed=seed) if hidden else None
    other = None if derivation is None else derivation.hidden
    mover = Mover.of(setup, other)
    report("sliders")
    sliders = mover.sliders()
    report("modes")
    found, unlisted = list_mode_outlines(setup)
    shapes, missing = collect_meshes(setup)
    home = mover.with_error(mover.home)
    states = (home, *(state for slider in sliders for state in slider.states))
    machines = [
        build_machine(
            REAL,
            setup,
            setup.mechanism,
            str(setup.decomposition.architecture()),
            [state.places[REAL] for state in states],
            shapes,
        )
    ]
    if derivation is not None and other is not None:
        machines.append(
            build_machine(
                HIDDEN,
                setup,
                other,
                str(derivation.hidden_architecture),
                [state.places[HIDDEN] for state in states],
                shapes,
            )
        )
    elif hidden:
        notes = (*notes, "every observed direction is constant: there is no hidden robot")
    arrows = tuple(list_arrows(setup, setup.observed))
    return View(
        setup,
        derivation,
        mover,
        tuple(machines),
        home,
        sliders,
        arrows,
        found,
        find_plane_normal(setup.motion),
        (*notes, *unlisted, *missing),
    )


def describe_stage(setup: ObservedRobot, machines: Sequence[Machine], arrows: Iterable[Arrow]) -> dict[str, Any]:
    """Return the data of a scene for the page."""
    mechanism, normal = setup.mechanism, find_plane_normal(setup.motion)
    places = {name: i for i, name in enumerate(mechanism.links)}
    return {
        "name": setup.robot.name,
        "length": mechanism.length,
        "radius": _choose_rod_radius(mechanism),
        "freedoms": {
            key: np.round(rows, PAGE_DIGITS_COUNT).tolist() for key, rows in list_platform_motions(setup).items()
        },
        "normal": None if normal is None else np.round(normal, PAGE_DIGITS_COUNT).tolist(),
        "machines": [machine.scene() for machine in machines],
        "arrows": [
            {"leg": a.leg, "link": places[a.link], "ends": np.round(a.ends, PAGE_DIGITS_COUNT).tolist()} for a in arrows
        ],
    }


def list_platform_motions(setup: ObservedRobot) -> dict[str, Array]:
    """Return the directions (k, 3) of the platform's translations and rotations: together as many as its dof, those of
    its coordinates if there are more."""
    motion = setup.motion
    places = np.array(
        Coordinates.of(setup.all_samples.start, setup.all_samples.observation_model, motion).places, dtype=int
    )
    found = {}
    for key, span, at in (
        ("translations", motion.translations, places[places < 3]),
        ("rotations", motion.rotations, places[places >= 3] - 3),
    ):
        found[key] = span.T[: len(at)] if len(at) in (0, span.shape[1]) else np.eye(3)[at]
    return found


def build_machine(
    key: str, setup: ObservedRobot, mechanism: Mechanism, words: str, places: Sequence[Array], meshes: Sequence[Shape]
) -> Machine:
    """Return a mechanism to be drawn, ``key`` real or hidden, with rails for displacements ``places`` (links, 7)."""
    real = setup.mechanism
    kept = tuple(shape for shape in meshes if shape.link in mechanism.links)
    drawer = Drawer(mechanism, real, setup.decomposition.platform, _choose_rod_radius(real), kept)
    shapes = drawer.shapes(_measure_travels(drawer, places))
    frames = tuple((link, place(mechanism.links[link].pose)) for link in (mechanism.base, mechanism.platform))
    legs = {link: leg.label for leg in setup.decomposition.legs for link in leg.links}
    return Machine(
        key,
        words,
        tuple(mechanism.links),
        setup.decomposition.platform,
        shapes,
        frames,
        tuple(map(legs.get, mechanism.links)),
    )


def _choose_rod_radius(mechanism: Mechanism) -> float:
    return ROD_RADIUS_FRACTION * mechanism.length


def _measure_travels(drawer: Drawer, states: Sequence[Array]) -> dict[str, tuple[float, float]]:
    """Return the travel of each prismatic joint on the base, with a margin for its carriage (m)."""
    from scipy.spatial.transform import Rotation

    links = {name: i for i, name in enumerate(drawer.mechanism.links)}
    found = {}
    for joint in drawer.sliders():
        places = np.array([state[links[joint.successor]] for state in states])
        moved = Rotation.from_quat(places[:, 3:]).apply(np.array(joint.point)) + places[:, :3] - joint.point
        ways = moved @ joint.axis
        margin = RAIL_END_LENGTH_FRACTION * drawer.radius
        found[joint.name] = (float(ways.min()) - margin, float(ways.max()) + margin)
    return found


def list_arrows(setup: ObservedRobot, observations: Iterable[Observation]) -> Iterator[Arrow]:
    """An arrow on the middle of each link with a direction, along what is or could be observed."""
    mechanism = setup.mechanism
    for seen in observations:
        if not isinstance(seen, Direction):
            continue
        direction = mechanism.links[seen.link].pose[:3, :3] @ seen.direction
        ways = np.array([joint.point for joint in mechanism.joints_of(seen.link)])
        along = ways @ direction
        middle = ways.mean(axis=0) + (0.5 * (along.min() + along.max()) - along.mean()) * direction
        half = 0.5 * float(np.clip(ARROW_LENGTH_FRACTION * np.ptp(along), *(np.array(ARROW) * mechanism.length)))
        yield Arrow(seen.leg, seen.link, np.array([middle - half * direction, middle + half * direction]))


def find_plane_normal(motion: PlatformMotion) -> Array | None:
    """The normal of the plane in which the platform moves, None where it leaves every plane."""
    if motion.translations.shape[1] != 2:
        return None
    normal = np.cross(*motion.translations.T)
    if motion.rotations.shape[1] > 1 or (motion.rotations.shape[1] and abs(normal @ motion.rotations[:, 0]) < 1 - 1e-6):
        return None
    return orient_axis(normal)
