"""The view as one self-contained page: MeshCat's viewer, the scene and the script that moves it, no network."""

from __future__ import annotations

import importlib.util
from html import escape
from pathlib import Path
from typing import Any

from ...errors import MissingExtra
from .view import View

FOLDER = Path(__file__).parent


def static(found: View) -> bytes:
    """The view as a page that needs no server."""
    return page(found).encode()


def inline(found: View) -> str:
    """The same page in a frame, for a notebook; raises ``MissingExtra``."""
    return (f'<iframe srcdoc="{escape(page(found))}" title="{escape(found.headline())}" '
            'style="width: 100%; height: 560px; border: 0"></iframe>')


def page(found: View, *, live: bool = False) -> str:
    """The page; ``live`` where a server answers its sliders."""
    from jinja2 import Environment, StrictUndefined

    def own(name: str) -> str:
        return (FOLDER / name).read_text(encoding="utf-8")

    scene: dict[str, Any] = {**found.scene(), "live": live}
    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(own("page.html"))
    return template.render(robot=found.setting.robot.name, scene=scene, viewer=viewer(), style=own("page.css"),
                           solids=own("solids.js"), script=own("page.js"))


def viewer() -> str:
    """MeshCat's script with the notices of what it holds; raises ``MissingExtra``."""
    spec = importlib.util.find_spec("meshcat")
    for place in spec.submodule_search_locations or () if spec is not None else ():
        script = Path(place, "viewer", "dist", "main.min.js")
        if script.is_file():
            notice = script.with_name(script.name + ".LICENSE.txt")
            words = notice.read_text(encoding="utf-8") if notice.is_file() else ""
            return words + "\n" + script.read_text(encoding="utf-8")
    raise MissingExtra("the 3D view", "view")
