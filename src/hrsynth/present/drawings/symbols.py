"""The kinematic symbol of each joint type, centred on the origin, its axis of travel along x; about 24 pixels wide."""

from __future__ import annotations

from . import svg

_RAIL = "M-15 -7H15M-15 7H15"
SHAPES: dict[str, str] = {
    "R": '<circle r="8"/><circle class="axis" r="1.5"/>',
    "P": '<rect x="-13" y="-7" width="26" height="14"/><path d="M-15 0H15"/>',
    "U": '<circle r="9"/><path d="M-9 0H9M0 -9V9"/>',
    "S": '<path d="M5 -9A10.5 10.5 0 1 0 5 9" fill="none"/><circle r="7"/>',
    "C": '<rect x="-13" y="-8" width="26" height="16"/><circle r="5"/><path d="M-15 0H15"/>',
    "E": f'<path d="{_RAIL}"/><rect x="-8" y="-4" width="16" height="8"/>',
    "F": '<path d="M-6 -6H6V6H-6Z"/>',
    "6": '<circle r="9" stroke-dasharray="3 2"/>',
    "Π": '<path d="M-13 9L-7 -9H13L7 9Z"/>'
    + "".join(f'<circle cx="{x}" cy="{y}" r="3"/>' for x, y in ((-13, 9), (-7, -9), (13, -9), (7, 9))),
}
"""R a circle (seen along its axis), P a sleeve on a rod, U a cross, S a ball in a cup, C a sleeve that also turns, E a
block between planes, Π a parallelogram with its four joints."""
WORDS = {
    "R": "revolute joint",
    "P": "prismatic joint",
    "U": "universal joint",
    "S": "spherical joint",
    "C": "cylindrical joint",
    "E": "planar joint",
    "F": "fixed joint",
    "6": "no joint (six dof)",
    "Π": "planar parallelogram",
}


def draw_symbol(letter: str, x: float, y: float, turned: float, fill: str, said: str, joints: str) -> str:
    """The symbol at a place, turned by an angle in degrees; ``joints`` are the names that it stands for."""
    return svg.format_element(
        "g",
        svg.format_title(said),
        SHAPES[letter],
        fill=fill,
        data_joint=joints,
        transform=f"translate({svg.format_coordinate(x)} {svg.format_coordinate(y)})"
        + (f"rotate({svg.format_coordinate(turned)})" if abs(turned) > 0.05 else ""),
    )


def draw_arrow(start: svg.Place, end: svg.Place) -> str:
    """An arrow head in the middle of a segment (path data)."""
    (x, y), (u, v) = start, end
    length = max(((u - x) ** 2 + (v - y) ** 2) ** 0.5, 1e-9)
    a, b = (u - x) / length, (v - y) / length
    middle = ((x + u) / 2 + 6 * a, (y + v) / 2 + 6 * b)
    wings = [(middle[0] - 13 * a - s * 6 * b, middle[1] - 13 * b + s * 6 * a) for s in (1, -1)]
    return svg.format_lines([(middle, *wings)]) + "Z"
