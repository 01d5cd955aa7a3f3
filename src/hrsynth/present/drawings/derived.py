"""A derivation → an SVG drawing: the kinematic scheme of the real robot, and beside it that of its hidden robot."""

from __future__ import annotations

import re

from ...analysis.derive import Derivation
from . import svg
from .schematic import robot_svg

HEAD, GAP = 30.0, 24.0
"""Height of the words above the schemes, and the space between them (pixels)."""


def derivation_svg(found: Derivation) -> bytes:
    """Both robots, the architecture over each; the real one alone where every leg is blind."""
    watched = [o.link for o in found.setting.observed]
    schemes = [(f"real robot  {found.architecture}", robot_svg(found.setting.anatomy, observed=watched))]
    if found.hidden is not None:
        motors = [joint.name for joint in found.hidden.joints.values() if joint.actuated]
        schemes.append((f"hidden robot  {found.hidden_architecture}", robot_svg(found.hidden, virtual=motors)))
    x, tall, parts = 0.0, 0.0, []
    for words, scheme in schemes:
        width, height = _size(scheme)
        parts += [svg.words(words, x + 16, 20, font_weight="bold"), _placed(scheme, x)]
        x, tall = x + width + GAP, max(tall, height)
    return svg.picture(x - GAP, HEAD + tall, f"Derivation of {found.robot.name}", found.headline(), *parts).encode()


def _size(scheme: str) -> tuple[float, float]:
    width, height = (re.search(rf' {name}="([\d.]+)"', scheme) for name in ("width", "height"))
    assert width is not None
    assert height is not None
    return float(width[1]), float(height[1])


def _placed(scheme: str, x: float) -> str:
    """A drawing as a part of another one."""
    return scheme.replace("<svg ", f'<svg x="{svg.number(x)}" y="{svg.number(HEAD)}" ', 1)
