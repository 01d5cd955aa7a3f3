"""View as one self-contained page: the page of the studio without panels, server and network."""

from __future__ import annotations

import re
from html import escape

from ...characters import name_steering
from ..view.view import View
from .server import MAIN, PAGE, WRITTEN

LINKS = {
    "style": re.compile(r'<link rel="stylesheet" href="(.*)">\n'),
    "script": re.compile(r'<script src="(.*)"></script>\n'),
}
"""Patterns of the files in the page."""
THREE = "three.min.js"


def render_static_page(found: View) -> bytes:
    """Return the view as a page that needs no server."""
    return render_saved_page(found).encode()


def format_inline(found: View) -> str:
    """Return the page in a frame, for a notebook."""
    return (
        f'<iframe srcdoc="{escape(render_saved_page(found))}" title="{escape(name_steering(found.headline()))}" '
        'style="width: 100%; height: 560px; border: 0"></iframe>'
    )


def render_saved_page(found: View) -> str:
    """Return the page with all its files."""
    from jinja2.utils import htmlsafe_json_dumps

    text = (PAGE / MAIN).read_text(encoding="utf-8")
    parts = {}
    for kind, link in LINKS.items():
        parts[kind] = [_read(name) for name in link.findall(text) if name != THREE]
        text = link.sub("", text)
    style = f"<style>\n{''.join(parts['style'])}</style>\n"
    # nothing that steers is hidden in an escape
    scene = htmlsafe_json_dumps(found.scene(), sort_keys=True, ensure_ascii=False)
    scripts = (
        f'<script type="application/json" id="kept">{scene}</script>\n'
        f"<script>\n{_read(THREE)}</script>\n<script>\n{''.join(parts['script'])}</script>\n"
    )
    return name_steering(text.replace("</head>", style + "</head>").replace("</body>", scripts + "</body>"))


def _read(name: str) -> str:
    return WRITTEN[name]() if name in WRITTEN else (PAGE / name).read_text(encoding="utf-8")
