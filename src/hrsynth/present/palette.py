"""Palette: one colour for one meaning, in the 3D scene, drawings, figures and pages.

The colours can be distinguished with all kinds of colour blindness: a test simulates them (Machado 2009).
"""

from __future__ import annotations

import json

MEANINGS = {
    "base": ("base", "#cdc9d4"),
    "leg": ("leg", "#9e9aa2"),
    "joint": ("passive joint", "#2a3747"),
    "motor": ("motor", "#08594c"),
    "virtual": ("virtual link", "#ada4ff"),
    "actuator": ("virtual actuator", "#cd139b"),
    "observed": ("observed direction", "#3d6ae9"),
    "unobserved": ("direction not observed", "#b7d0ff"),
    "mode": ("another assembly mode", "#05b2ca"),
    "goal": ("goal", "#723f11"),
    "ellipsoid": ("error of the platform point", "#6334b5"),
    "frame": ("frames of base and platform, handles", "#000000"),
    "unknown": ("platform: error unknown", "#747278"),
    "step0": ("error very small", "#8ad7ac"),
    "step1": ("error small", "#f1df50"),
    "step2": ("error medium", "#ed953c"),
    "step3": ("error large", "#e04c3c"),
    "step4": ("Type 2 singularity, or nearly", "#5f1223"),
    "background": ("background", "#f5f7fa"),
}
"""Label in legends and colour of each meaning."""
PAGE = {
    "ink": "#1b2530",
    "soft": "#4d5a68",
    "edge": "#75818e",
    "line": "#cfd6de",
    "ground": "#eef1f5",
    "face": "#ffffff",
    "main": "#0b57c4",
    "pressed": "#08429a",
    "chosen": "#eaf1fc",
    "good": "#0a5c45",
    "partly": "#7a5200",
    "wrong": "#a3123a",
    "notice": "#fff3d6",
}
"""Text, lines and backgrounds of pages and drawings; pressed and selected elements; good, partial and bad results."""
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of curves without a meaning, in the order of the style of all plots."""
SYMBOL_TINT_FRACTION = 0.4
"""Fraction of its colour inside a symbol; its complement is white."""


def get_colour(meaning: str) -> str:
    """Return the colour of a meaning."""
    return MEANINGS[meaning][1]


def make_tint(colour: str, share: float = SYMBOL_TINT_FRACTION) -> str:
    """Mix a colour with white."""
    parts = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(255 + share * (part - 255)):02x}" for part in parts)


def format_css() -> str:
    """Format the colours as variables of a style sheet."""
    every = {**PAGE, **{name: get_colour(name) for name in MEANINGS}, "driven": make_tint(get_colour("motor"))}
    return ":root { " + " ".join(f"--{name}: {value};" for name, value in every.items()) + " }\n"


def format_js() -> str:
    """Format the meanings as a script, for ``colours.js``."""
    return f"const COLOURS = {json.dumps(MEANINGS)};\n"
