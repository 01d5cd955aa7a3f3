"""The colours of the 3D scene: told apart by every kind of colour-blind eyes, and read on a label."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.present.palette import MEANINGS, PAGE, SERIES

APART = 15.0
"""Distance of two colours (CIE 1976 L*a*b*; 2.3 can just be seen) at least, whoever looks."""
EYES = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
"""What linear RGB looks like: Machado, Oliveira, Fernandes 2009, table 1, severity 1."""
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
"""Linear sRGB to XYZ (IEC 61966-2-1), white D65."""


def linear(colour: str) -> np.ndarray:
    v = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    t = TO_XYZ @ light / TO_XYZ.sum(axis=1)
    f = np.where(t > (6 / 29) ** 3, np.cbrt(np.maximum(t, 0)), t * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def seen(colour: str, eyes: str) -> np.ndarray:
    return lab(np.clip(EYES[eyes] @ linear(colour), 0, 1))


@pytest.mark.parametrize("eyes", EYES)
def test_any_two_meanings_differ_to_all_eyes(eyes: str):
    colours = {meaning: seen(colour, eyes) for meaning, (_, colour) in MEANINGS.items()}
    apart = {pair: float(np.linalg.norm(colours[pair[0]] - colours[pair[1]])) for pair in combinations(colours, 2)}
    assert {pair: d for pair, d in apart.items() if d < APART} == {}


def test_the_simulated_eyes_confuse_what_they_should():
    """Red and green of one lightness are far apart to most, and close to who lacks red's or green's cones."""
    red, green = "#c05a4a", "#7d8a38"
    apart = {eyes: float(np.linalg.norm(seen(red, eyes) - seen(green, eyes))) for eyes in EYES}
    assert apart["normal"] > 40
    assert apart["deuteranopia"] < 0.5 * apart["normal"]
    assert lab(np.ones(3)) == pytest.approx([100, 0, 0], abs=1e-3)


def test_a_meaning_has_one_colour_and_words_of_its_own():
    words, colours = zip(*MEANINGS.values(), strict=True)
    assert len(set(words)) == len(set(colours)) == len(words)
    assert all(re.fullmatch("#[0-9a-f]{6}", colour) for colour in colours)


def test_no_other_file_holds_a_colour():
    """Lights are white to grey; all else is asked of the palette."""
    package = Path(hrsynth.__file__).parent
    for file in (each for folder in ("present", "catalog") for each in sorted((package / folder).rglob("*"))):
        if file.suffix in (".py", ".js", ".css", ".html", ".j2") and file.name not in ("three.min.js", "palette.py"):
            found = re.findall(r"(?:0x|#)[0-9a-fA-F]{6}\b", file.read_text(encoding="utf-8"))
            parts = [[int(each[-6:][i : i + 2], 16) for i in (0, 2, 4)] for each in found]
            assert all(np.ptp(each) < 20 for each in parts), file.name


def test_the_style_of_plots_has_the_colours_of_the_palette():
    text = (Path(hrsynth.__file__).parent / "present" / "style.mplstyle").read_text(encoding="utf-8")
    used = {f"#{each}" for each in re.findall(r"\b[0-9a-f]{6}\b", text)}
    assert used <= {*SERIES, *PAGE.values()}
    assert {*SERIES} <= used


def test_names_are_read_on_every_colour():
    """Black or white, as `Colours.ink` chooses: 4.5 to 1 (WCAG 2.2, 1.4.3)."""
    for meaning, (_, colour) in MEANINGS.items():
        y = float(TO_XYZ[1] @ linear(colour))
        contrast = (y + 0.05) / 0.05 if y > 0.179 else 1.05 / (y + 0.05)
        assert contrast >= 4.5, meaning
