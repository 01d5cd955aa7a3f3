"""The view as one self-contained page: the studio's stage, the scene and the script that moves it, no network."""

from __future__ import annotations

from html import escape
from pathlib import Path

from ...characters import name_steering
from .. import palette
from .view import View

FOLDER = Path(__file__).parent
STAGE = FOLDER.parent / "studio" / "page"
SCRIPTS = ("colours.js", "solids.js", "robots.js", "overlays.js", "gizmo.js", "sight.js", "stage.js")
"""What draws the stage beside three.js, in this order."""


def static(found: View) -> bytes:
    """The view as a page that needs no server."""
    return page(found).encode()


def inline(found: View) -> str:
    """The same page in a frame, for a notebook."""
    return (
        f'<iframe srcdoc="{escape(page(found))}" title="{escape(name_steering(found.headline()))}" '
        'style="width: 100%; height: 560px; border: 0"></iframe>'
    )


def page(found: View) -> str:
    """The page."""
    from jinja2 import Environment, StrictUndefined

    def text(*files: Path) -> str:
        return "".join(file.read_text(encoding="utf-8") for file in files)

    made = Environment(autoescape=True, undefined=StrictUndefined)
    # nothing that steers is hidden in an escape
    made.policies["json.dumps_kwargs"] = {"sort_keys": True, "ensure_ascii": False}
    template = made.from_string(text(FOLDER / "page.html"))
    return name_steering(
        template.render(
            robot=found.setting.robot.name,
            scene=found.scene(),
            style=palette.css() + text(FOLDER / "page.css", STAGE / "stage.css"),
            three=text(STAGE / "three.min.js"),
            script=palette.js() + text(*(STAGE / name for name in SCRIPTS), FOLDER / "page.js"),
        )
    )
