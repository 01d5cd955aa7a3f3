"""Control characters, which are escaped in every output."""

from __future__ import annotations

import re

STEERING = "\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff"
"""Control characters except tab and line feed, direction marks, line and paragraph separators, lone surrogates."""
_FOUND = re.compile(f"[{STEERING}]")
_NAMED = re.compile(r"\[U\+([0-9A-F]{4})\]")


def escape_steering(text: str) -> str:
    """Escape them as in JSON for a terminal; the text of a JSON object keeps its meaning."""
    return _FOUND.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def name_steering(text: str) -> str:
    """Replace them by names such as ``[U+202E]`` in a document: HTML, SVG, JSON for a page, code."""
    return _FOUND.sub(lambda found: f"[U+{ord(found[0]):04X}]", text)


def restore_steering(text: str) -> str:
    """Undo :func:`name_steering`."""
    return _NAMED.sub(lambda found: char if _FOUND.match(char := chr(int(found[1], 16))) else found[0], text)
