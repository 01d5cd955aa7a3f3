"""All colours of pictures: one of each meaning, in the 3D scene, drawings, figures and pages alike.

Colours of meanings are told apart by all kinds of colour-blind eyes: a test simulates them (Machado 2009).
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
    "watched": ("watched direction", "#3d6ae9"),
    "unwatched": ("direction that is not watched", "#b7d0ff"),
    "mode": ("another assembly mode", "#05b2ca"),
    "goal": ("goal", "#723f11"),
    "ellipsoid": ("error of the platform's point", "#6334b5"),
    "frame": ("frame of base and platform, handles", "#000000"),
    "unknown": ("platform: error not known", "#747278"),
    "step0": ("error very small", "#8ad7ac"),
    "step1": ("error small", "#f1df50"),
    "step2": ("error middling", "#ed953c"),
    "step3": ("error large", "#e04c3c"),
    "step4": ("a freedom is lost, or nearly", "#5f1223"),
    "background": ("background", "#f5f7fa"),
}
"""What each meaning is called in a legend, and its colour."""
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
"""Text, lines and grounds of pages and drawings; what is pressed or chosen; good, partly good and bad news."""
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of curves that only differ from each other, in the order of the style of all plots."""
TINT = 0.4
"""How much of its colour the inside of a symbol has, the rest is white."""


def colour(meaning: str) -> str:
    """The colour of a meaning."""
    return MEANINGS[meaning][1]


def tint(colour: str, share: float = TINT) -> str:
    """A colour mixed with white."""
    parts = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(255 + share * (part - 255)):02x}" for part in parts)


def css() -> str:
    """The colours as variables of a style sheet."""
    every = {**PAGE, **{name: colour(name) for name in MEANINGS}, "driven": tint(colour("motor"))}
    return ":root { " + " ".join(f"--{name}: {value};" for name, value in every.items()) + " }\n"


def js() -> str:
    """The meanings as a script, for ``colours.js``."""
    return f"const COLOURS = {json.dumps(MEANINGS)};\n"
