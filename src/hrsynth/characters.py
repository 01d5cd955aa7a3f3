"""Characters that steer what shows a text, a terminal or a page: none leaves but as a name of itself."""

from __future__ import annotations

import re

STEERING = "\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff"
"""Control characters but tab and line feed, marks of direction, separators of lines and paragraphs, lone surrogates."""
_FOUND = re.compile(f"[{STEERING}]")
_NAMED = re.compile(r"\[U\+([0-9A-F]{4})\]")


def escape_steering(text: str) -> str:
    """A text for a terminal, in which they are escaped as in JSON: a text of JSON stays the same JSON."""
    return _FOUND.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def name_steering(text: str) -> str:
    """A document, such as HTML, SVG, JSON for a page or code, with them named as ``[U+202E]``."""
    return _FOUND.sub(lambda found: f"[U+{ord(found[0]):04X}]", text)


def restore_steering(text: str) -> str:
    """What a page says of names that it was told by :func:`name_steering`."""
    return _NAMED.sub(lambda found: char if _FOUND.match(char := chr(int(found[1], 16))) else found[0], text)
