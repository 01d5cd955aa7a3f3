"""Noise of measurements: amounts as a user writes them, and their first-order effect on simulated sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import BadRequest
from ..geometry.vectors import Array
from ..options import parse_plain_number
from .cameras import CameraObservation
from .observation import Observation

NOISE_DIFFERENCE_STEP_MAX = 1e-5
"""Noise (radians, metres, fractions of the focal length) of the differences of its first-order effect."""
EDGE_NOISE_PIXELS_MAX = 50.0
"""Largest error of an edge (pixels)."""

EXAMPLE = "0.1deg or 0.002 (rad), 0.3px in the image, 1mm of lengths; several with commas"
UNITS = {"px": ("px", 1.0), "deg": ("rad", math.radians(1)), "mm": ("m", 1e-3), "m": ("m", 1.0), "": ("rad", 1.0)}
"""Suffixes of amounts, the longer ones first: unit of the error, and factor to it."""
IN_WORDS = {"px": ("pixels", "0.3px"), "rad": ("angles", "0.1deg"), "m": ("lengths", "1mm")}
"""Quantities of errors, and an example of each."""
MOST = {"px": EDGE_NOISE_PIXELS_MAX, "rad": math.pi / 2, "m": math.inf}


@dataclass(frozen=True)
class Noise:
    """Amounts of noise by unit: half-angles of cones (``rad``), errors in the image (``px``), of lengths (``m``); with
    ``bias`` each error is constant along a run."""

    amounts: tuple[tuple[str, float], ...]
    bias: bool = False

    @classmethod
    def read(cls, given: object) -> Noise | None:
        """Return the noise of a text or of a Noise. Raises ``BadRequest``."""
        if given is None or isinstance(given, Noise):
            return given
        if not isinstance(given, str):
            raise BadRequest("noise", given, "a text such as 0.1deg, 0.3px or 1mm")
        return cls.parse(given)

    @classmethod
    def parse(cls, text: str) -> Noise:
        """Return the noise of ``0.1deg``, ``0.002``, ``0.3px`` or ``0.3px,1mm``. Raises ``BadRequest``."""
        found: dict[str, float] = {}
        for word in map(str.strip, text.split(",")):
            ending = next(each for each in UNITS if word.endswith(each))
            unit, one = UNITS[ending]
            try:
                value = parse_plain_number(word.removesuffix(ending)) * one
            except ValueError:
                raise BadRequest("noise: not a number", text, EXAMPLE) from None
            if not 0 < value < MOST[unit] or unit in found:
                raise BadRequest(
                    "noise",
                    text,
                    "each unit once, more than 0; angles below 90deg (a number without unit is "
                    f"in radians), below {EDGE_NOISE_PIXELS_MAX:g}px",
                )
            found[unit] = value
        return cls(tuple(found.items()))

    def of(self, unit: str) -> float:
        """Return the amount in a unit, 0 if there is none."""
        return dict(self.amounts).get(unit, 0.0)

    def __str__(self) -> str:
        words = {"px": ("{:g}px", 1.0), "m": ("{:.10g}mm", 1e3), "rad": ("{:.4g}deg", math.degrees(1))}
        every = [words[unit][0].format(words[unit][1] * value) for unit, value in self.amounts]
        return ", ".join(every) + (", constant over time" if self.bias else "")

    def amounts_for(self, observations: Sequence[Observation]) -> dict[str, float]:
        """Return the amounts. Raises ``BadRequest`` for noise that none of the observations has, and for pixels of a
        camera without a focal length."""
        known = frozenset().union(*(each.found_by for each in observations))
        for unit, _ in self.amounts:
            if unit not in known:
                raise BadRequest(
                    f"noise: no observation has errors in {IN_WORDS[unit][0]}",
                    str(self),
                    [IN_WORDS[each][1] for each in sorted(known)] or "further observations (--sensor)",
                )
        amounts = dict(self.amounts)
        for each in observations:
            if (
                "px" in amounts
                and "px" in each.found_by
                and not (isinstance(each, CameraObservation) and each.camera and each.camera.focal)
            ):
                raise BadRequest(
                    f"noise in pixels: focal length of the camera of {each.text}",
                    "none",
                    "a camera with one (--camera NAME=LINK@x,y,z/r,p,y/FOCAL)",
                )
        return amounts


def count_vectors(seen: Observation) -> int:
    """Return the number of random vectors of an observation's noise."""
    return 1 if seen.size <= 3 else 2


def compute_noise_rates(seen: Observation, value: Array, amounts: Mapping[str, float]) -> list[Array]:
    """Return the rates (size, 3) of :meth:`.Observation.sense` by each random vector at zero, by central differences:
    to first order the errors are the sums of images of unit balls. ``value`` (size,) in metres."""
    own = {unit: amount for unit, amount in amounts.items() if unit in seen.found_by}
    if not own:
        return []
    largest = max(
        seen.pixels(own) if unit == "px" and isinstance(seen, CameraObservation) else amount
        for unit, amount in own.items()
    )
    scale = NOISE_DIFFERENCE_STEP_MAX / largest
    small = {unit: scale * amount for unit, amount in own.items()}
    ways = np.eye(6).reshape(6, 2, 3)
    columns = [(seen.sense(value, way, small) - seen.sense(value, -way, small)) / (2 * scale) for way in ways]
    return list(np.stack(columns, axis=1).reshape(seen.size, 2, 3).transpose(1, 0, 2)[: count_vectors(seen)])
