"""Closed forms of the legs of a batch, whose tips are joints on links that go with the platform."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..closed_forms.leg_reading import LegReader, LegTip
from ..closed_forms.legs import ClosedFormLeg
from ..closed_forms.platform_points import PlatformPoint
from ..geometry.vectors import invert_pose
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.observations.direction import Direction
from .platform_coordinates import Frames, PlatformCoordinates


def recognise_leg(
    decomposition: LegDecomposition, leg: Leg, seen: Direction, coordinates: PlatformCoordinates, frames: Frames
) -> ClosedFormLeg | None:
    """The closed form of the leg, or None; ``seen`` is the direction observed in it."""
    p, R = coordinates.place(frames[decomposition.mechanism.platform])
    reader = LegReader(decomposition.mechanism, leg, frames, p, R)
    form = reader.recognise(
        list(_list_tips(decomposition, leg, coordinates)), frames[seen.link][:, :3, :3] @ seen.direction
    )
    if form is None or coordinates.rotations.shape[1]:
        return form
    return replace(form, tip=PlatformPoint(True, np.zeros(3), R[0] @ form.tip.turned + form.tip.constant))


def _list_tips(decomposition: LegDecomposition, leg: Leg, coordinates: PlatformCoordinates) -> Iterator[LegTip]:
    mechanism, body = decomposition.mechanism, coordinates.links.get(leg.platform_link)
    if decomposition.point is not None:
        frame = mechanism.links[mechanism.platform].pose
        place = frame[:3, :3] @ decomposition.point + frame[:3, 3]
        end = mechanism.joints_of(mechanism.platform)[0]
        yield LegTip(end.point, lambda point: PlatformPoint(True, np.zeros(3), point - place), end)
    elif body is not None:
        to_body = invert_pose(mechanism.links[leg.platform_link].pose)
        for name in leg.joints:
            joint = mechanism.joints[name]
            if leg.platform_link in joint.links:
                yield LegTip(joint.point, lambda point: body.point(to_body[:3, :3] @ point + to_body[:3, 3]), joint)
