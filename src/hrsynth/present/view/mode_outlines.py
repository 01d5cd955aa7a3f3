"""Outlines of the other assembly modes of the zero configuration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.modes.assembly_mode import AssemblyMode
from ...analysis.modes.modes import modes
from ...analysis.observed import ObservedRobot
from ...errors import HrsynthError
from ...geometry.vectors import Array, invert_pose
from ...mechanism.pose import Pose
from ...records import Recorded
from ...results import Value
from .states import place, round_page_values


@dataclass(frozen=True, eq=False, repr=False)
class ModeOutline(Value):
    """Assembly mode other than the given pose: its number as in ``modes``, its pose, whether the robot can be assembled
    there (``reachable``, ``assembly``), and the displacement (7,) of each link, None if unknown."""

    label: Recorded[str]
    pose: Recorded[Pose]
    reachable: Recorded[bool | None]
    assembly: str
    places: tuple[Array | None, ...]

    @property
    def words(self) -> str:
        """Format the pose, with its rotation as phi or rpy."""
        told = Pose.parse(str(self.pose))
        x, y, z = (round(value or 0.0, 3) + 0.0 for value in (told.x, told.y, told.z))
        name, angles = ("rpy", told.rpy or (0.0,)) if told.phi is None else ("phi", (told.phi,))
        turn = np.round(np.degrees(angles), 1) + 0.0
        turned = f", {name} " + "/".join(f"{angle:g}" for angle in turn) + "°" if turn.any() else ""
        return f"x {x:g}, y {y:g}, z {z:g} m{turned}"

    def scene(self) -> dict[str, Any]:
        """Return the data for the page."""
        places = [None if each is None else round_page_values(each[None])[0] for each in self.places]
        return {
            "label": self.label,
            "words": self.words + f" (assembled: {self.assembly})" * (self.assembly != "yes"),
            "reachable": self.reachable,
            "places": places,
        }


def list_mode_outlines(setup: ObservedRobot) -> tuple[tuple[ModeOutline, ...], tuple[str, ...]]:
    """Return all other modes, and notes if there are none or the list is incomplete."""
    try:
        found = modes(setup)
    except HrsynthError as error:
        return (), (f"assembly modes are not listed: {error}",)
    if found.found.continuous_family is not None:
        return (), (f"assembly modes are not listed: {found.found.singular_solutions}",)
    notes = () if found.found.complete else ("more assembly modes may exist than are listed",)
    listed = [(str(number), mode) for number, mode in enumerate(found.modes, 1) if not mode.goal]
    listed += [(f"near {number}", mode) for number, mode in enumerate(found.near_modes, 1)]
    return tuple(build_mode_outline(setup, *each) for each in listed), notes


def build_mode_outline(setup: ObservedRobot, label: str, mode: AssemblyMode) -> ModeOutline:
    """Return the outline of an assembly mode with its ``label``."""

    def where(link: str) -> Array | None:
        if mode.configuration is not None:
            X = mode.configuration.pose(link)
        elif mode.bodies is not None and link in mode.bodies:
            X = mode.bodies[link]
        else:
            return None
        return place(X @ invert_pose(setup.mechanism.links[link].pose))

    places = tuple(where(link) for link in setup.mechanism.links)
    return ModeOutline(label, mode.pose, mode.reachable, mode.assembly, places)
