"""Measurement bounds: half-angles of cones about directions, and amounts of noise for other observations.

To first order the errors of an observation are the images of unit balls: a cone is one ball, an image point a disc, an
ellipse that is found by five of its points two balls.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from ...errors import BadRequest
from ...geometry.vectors import Array, rotate_about_axis
from ...kinematics.configuration import ClosedConfiguration, measure
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Observation
from ...mechanism.noise import Noise, compute_noise_rates
from ...mechanism.observations.direction import SeenAxis
from ...options import parse_plain_number
from ...results import Value
from ...tolerances import VISIBLE_SINE_MIN

CONE_HALF_ANGLE_MIN_RAD = 1e-15
"""Half-angle (rad) of a cone below which directions are equal as numbers."""

ANGLES = "0.1deg, 0.002 (radians)"
EXAMPLE = f"{ANGLES}, or one for each leg such as 1=0.1deg,2=0.2deg"
ALLOWED = "more than 0 and less than 90deg"

Cones = float | str | Mapping[str, float | str] | Mapping[int, float | str]
"""One half-angle (rad) for all observed directions, one for each leg or link, or either as text."""


def list_half_angles(cones: Cones, observed: Sequence[Observation]) -> Array:
    """The half-angle (rad) of each observation's cone, (k,); raises ``BadRequest`` where one is missing, is of nothing
    that is observed, or is not between 0 and 90 degrees."""
    given = _parse(cones) if isinstance(cones, str) else cones
    if not isinstance(given, Mapping):
        return np.full(len(observed), _require_angle(given, given))
    given = {str(name): _parse_angle(value) if isinstance(value, str) else value for name, value in given.items()}
    names = {name for o in observed for name in (o.leg, o.link)}
    unknown = [name for name in given if name not in names]
    if unknown:
        raise BadRequest(
            f"--cone {unknown[0]}: not observed",
            None,
            "legs " + ", ".join(dict.fromkeys(o.leg for o in observed)),
        )
    found = []
    for o in observed:
        value = given.get(o.link, given.get(o.leg))
        if value is None:
            raise BadRequest(f"--cone {cones}: no angle for leg {o.leg}", remedy=f"Use {EXAMPLE}.")
        found.append(_require_angle(value, value))
    return np.array(found)


def _parse(text: str) -> float | dict[str, float]:
    fields = [field.strip() for field in text.split(",")]
    if len(fields) == 1 and "=" not in fields[0]:
        return _parse_angle(fields[0])
    found: dict[str, float] = {}
    for field in fields:
        name, equals, value = (piece.strip() for piece in field.partition("="))
        if not equals:
            raise BadRequest(f"--cone {field}: not of the form LEG=ANGLE", remedy=f"Use {EXAMPLE}.")
        if name in found:
            raise BadRequest(f"--cone: leg {name} is given twice", remedy="Omit one.")
        found[name] = _parse_angle(value)
    return found


def require_single_angle(cone: float | str) -> float:
    """Return one half-angle (rad) for all observations; raises ``BadRequest``."""
    return _parse_angle(cone, ANGLES) if isinstance(cone, str) else _require_angle(cone, cone)


def _parse_angle(text: str, allowed: str = EXAMPLE) -> float:
    digits = text.removesuffix("deg").strip()
    try:
        value = parse_plain_number(digits)
    except ValueError:
        raise BadRequest("--cone: angle", text, allowed) from None
    return _require_angle(value if digits == text else math.radians(value), text)


def _require_angle(value: Any, shown: object) -> float:
    if isinstance(value, bool) or not (isinstance(value, Real) and 0 < float(value) < math.pi / 2):
        raise BadRequest("--cone: half-angle", shown, ALLOWED)
    if value < CONE_HALF_ANGLE_MIN_RAD:
        raise BadRequest("--cone: half-angle", shown, f"at least {CONE_HALF_ANGLE_MIN_RAD:g} (radians)")
    return float(value)


@dataclass(frozen=True, eq=False)
class ErrorBalls:
    """First-order errors of the observations at a configuration: for each ball the index of its observation, its number
    there, and its map (rows, 3) to the regulated vector (characteristic lengths). For directions ``fed`` is the value
    itself, else the error of a servo loop: its rates (rows, n) are those of the values times the ``slopes`` (None: all
    1)."""

    balls: tuple[tuple[int, int], ...]
    maps: tuple[Array, ...]
    slopes: tuple[Array, ...] | None

    def rows(self, rates: Array) -> Array:
        """Return the rates (rows, n) of the regulated vector, from those of the values."""
        if self.slopes is None:
            return rates
        places = np.cumsum([0, *(slope.shape[1] for slope in self.slopes)])
        return np.vstack([slope @ rates[a:b] for slope, a, b in zip(self.slopes, places, places[1:], strict=False)])


@dataclass(frozen=True, eq=False, repr=False)
class MeasurementBounds(Value):
    """Measurement bounds of the observations: half-angle (rad) of the cone about each direction, (k,), zero for other
    observations; ``amounts`` of noise by their units for those."""

    cones: Array
    noise: Noise | None = None

    @classmethod
    def of(cls, cone: Cones | None, noise: str | Noise | None, observed: Sequence[Observation]) -> MeasurementBounds:
        """Parse a user's bounds; raises ``BadRequest`` if an observation has none."""
        amounts = Noise.read(noise)
        axes = [o for o in observed if isinstance(o, SeenAxis)]
        others = [o for o in observed if not isinstance(o, SeenAxis)]
        if cone is None and amounts is None:
            raise BadRequest(
                "the measurement bounds are missing",
                remedy="Give --cone 0.1deg for directions, or --noise 0.1deg,0.3px,1mm for other observations.",
            )
        if cone is not None and not axes:
            raise BadRequest("--cone: applies to directions only", remedy="Use --noise.")
        if others and amounts is None:
            raise BadRequest(
                f"--cone bounds directions only; {others[0].text} has no bound",
                remedy="Add --noise in its unit, such as 0.3px or 1mm.",
            )
        if amounts is not None:
            amounts.amounts_for(others if cone is not None else observed)
        angle = 0.0 if amounts is None else amounts.of("rad")
        half = list_half_angles(cone, axes) if cone is not None else np.full(len(axes), angle)
        found = np.zeros(len(observed))
        found[[i for i, o in enumerate(observed) if isinstance(o, SeenAxis)]] = half
        return cls(found, amounts if others else None)

    @property
    def amounts(self) -> dict[str, float]:
        """The noise by its units."""
        return {} if self.noise is None else dict(self.noise.amounts)

    def own(self, place: int, seen: Observation) -> dict[str, float]:
        """The noise that one observation has; of a direction that is its cone."""
        if isinstance(seen, SeenAxis):
            return {"rad": float(self.cones[place])} if self.cones[place] else {}
        own = {unit: amount for unit, amount in self.amounts.items() if unit in seen.found_by}
        return {"px": own["px"]} if "px" in own else own

    @property
    def each(self) -> str:
        """Name of the set that contains an error."""
        return "cone" if self.noise is None else "error"

    @property
    def inside(self) -> str:
        """Describe the errors that are considered, and their bounds."""
        return "of the directions inside their cones" if self.noise is None else "that the noise allows"

    def words(self, place: int, seen: Observation) -> str:
        """Describe the bound of one observation."""
        if isinstance(seen, SeenAxis):
            return f"within {np.degrees(self.cones[place]):.4g}°" if self.cones[place] else "exact"
        own = self.own(place, seen)
        return f"within {' and '.join(str(Noise(((unit, own[unit]),))) for unit in own)}" if own else "exact"

    def select(self, places: Sequence[int]) -> MeasurementBounds:
        """Return the bounds of some of the observations."""
        return MeasurementBounds(self.cones[list(places)], self.noise)

    def exact(self, observed: Sequence[Observation]) -> tuple[str, ...]:
        """Return the observations without error."""
        return tuple(o.leg for i, o in enumerate(observed) if not self.own(i, o))

    def at(self, at: ClosedConfiguration, observation_model: ObservationModel) -> ErrorBalls:
        """The errors at a configuration."""
        every = observation_model.observations
        balls: list[tuple[int, int]] = []
        maps: list[Array] = []
        if all(isinstance(o, SeenAxis) for o in every):
            for i, cone in enumerate(self.cones):
                balls.append((i, 0))
                maps.append(np.kron(np.eye(len(every))[:, i : i + 1], cone * np.eye(3)))
            return ErrorBalls(tuple(balls), tuple(maps), None)
        values = measure(at.model, at.q, observation_model.reference, every)[2]
        slopes = tuple(o.error_slope(value, value) for o, value in zip(every, values, strict=True))
        ends = np.cumsum([0, *(len(slope) for slope in slopes)])
        for i, (o, value) in enumerate(zip(every, values, strict=True)):
            unit = at.model.length ** np.broadcast_to(o.dimension, o.size)
            own = (
                [self.cones[i] * np.eye(3)]
                if isinstance(o, SeenAxis)
                else [each / unit[:, None] for each in compute_noise_rates(o, value * unit, self.own(i, o))]
            )
            for number, each in enumerate(own):
                whole = np.zeros((ends[-1], 3))
                whole[ends[i] : ends[i + 1]] = slopes[i] @ each
                if whole.any():
                    balls.append((i, number))
                    maps.append(whole)
        return ErrorBalls(tuple(balls), tuple(maps), slopes)

    def radii(self, balls: Sequence[tuple[int, int]]) -> Array:
        """Return the units of the balls' unit vectors: cones in radians, others as fractions of the ball."""
        return np.array([self.cones[i] or 1.0 for i, _ in balls])

    def wrong(
        self,
        observed: Sequence[Observation],
        values: Sequence[Array],
        length: float,
        balls: ErrorBalls,
        way: Array,
        part: float,
    ) -> list[Array]:
        """Return the measured values with errors of a fraction of ``way`` (balls, 3), in units of :meth:`radii`."""
        found = list(values)
        shocks = np.zeros((len(observed), 2, 3))
        for (i, number), each in zip(balls.balls, way, strict=True):
            shocks[i, number] = part * each
        for i, (o, value) in enumerate(zip(observed, values, strict=True)):
            if isinstance(o, SeenAxis):
                found[i] = rotate_directions(value[None], shocks[i, :1])[0]
            elif own := self.own(i, o):
                unit = length ** np.broadcast_to(o.dimension, o.size)
                found[i] = o.sense(value * unit, shocks[i], own) / unit
        return found


def rotate_directions(u: Sequence[Array] | Array, way: Array) -> Array:
    """u (k, 3), each turned by the angle ‖way‖ towards its way (k, 3), which is normal to it."""
    return np.array(
        [
            rotate_about_axis(np.cross(a, b), float(np.linalg.norm(b))) @ a if np.any(b) else a
            for a, b in zip(u, way, strict=True)
        ]
    )


IN_SIGHT = "Choose a pose at which everything observed is visible, or point the camera's z axis at it."


def find_invisible(at: ClosedConfiguration, observation_model: ObservationModel) -> Observation | None:
    """Return an observation that is not in front of its camera, or outside its image, at a configuration; else None."""
    return next(
        (
            o
            for o in observation_model.observations
            if o.in_front(at.pose(o.seen_from or observation_model.reference), at.pose(o.link)) < VISIBLE_SINE_MIN
        ),
        None,
    )
