"""SVG as text: elements with few decimals, names kept safe, a title and a description for screen readers."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

from ...characters import name_steering
from ..palette import PAGE, get_colour, make_tint

INK, EMPTY = PAGE["ink"], PAGE["face"]
MOTOR, VIRTUAL, OBSERVED = get_colour("motor"), get_colour("actuator"), get_colour("observed")
"""Colours of motors (MMT Table 1), virtual actuators, observed segments."""
STROKES = {"joint": INK, "motor": MOTOR, "virtual": VIRTUAL}
FILLS = {"joint": EMPTY, "motor": make_tint(MOTOR), "virtual": make_tint(VIRTUAL)}
"""Line and inside of the symbol of a joint, by its kind."""
PALE = get_colour("background")
"""Behind a leg."""
FONT = "system-ui, 'DejaVu Sans', 'Liberation Sans', Arial, sans-serif"

Place = tuple[float, float]
"""x to the right, y down, in pixels."""


def format_coordinate(value: float) -> str:
    """A coordinate with at most one decimal."""
    return f"{value:.1f}".removesuffix(".0")


def format_attributes(**values: object) -> str:
    """``stroke_width=2`` as `` stroke-width="2"``; None is left out."""
    return "".join(
        f" {name.rstrip('_').replace('_', '-')}="
        f"{quoteattr(format_coordinate(value) if isinstance(value, float) else str(value))}"
        for name, value in values.items()
        if value is not None
    )


def format_element(name: str, *content: str, **values: object) -> str:
    """An element; its content is SVG already."""
    inner = "".join(content)
    return (
        f"<{name}{format_attributes(**values)}>{inner}</{name}>" if inner else f"<{name}{format_attributes(**values)}/>"
    )


def format_title(text: str) -> str:
    """Return the title, which is read out and shown under the pointer."""
    return format_element("title", escape(text))


def format_words(text: str, x: float, y: float, **values: object) -> str:
    """Text at a place."""
    return format_element("text", escape(text), x=x, y=y, **values)


def format_lines(points: Iterable[Iterable[Place]]) -> str:
    """The path data of polylines."""
    return "".join("M" + "L".join(f"{format_coordinate(x)} {format_coordinate(y)}" for x, y in way) for way in points)


def format_drawing(width: float, height: float, name: str, description: str, *content: str) -> str:
    """A whole drawing, on its own or inside a page."""
    return name_steering(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {format_coordinate(width)} {format_coordinate(height)}" '
        f'width="{format_coordinate(width)}" height="{format_coordinate(height)}" role="img" '
        f"aria-label={quoteattr(name)} "
        f'font-family="{FONT}" font-size="12">{format_title(name)}{format_element("desc", escape(description))}'
        f"{''.join(content)}</svg>\n"
    )
