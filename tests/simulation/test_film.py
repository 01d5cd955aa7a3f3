"""The animation of a run: the watched legs come to lie where they are to be; refusals before any work."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest
from hrsynth.present.animations import CROSSING_CAPTION_FRAMES_COUNT, FRAMES, draw_animation, list_captions
from hrsynth.present.outputs import OUTPUTS
from hrsynth.simulation.servo import ServoTask


def test_unknown_endings_and_folders_are_refused(tmp_path: Path):
    (file,) = OUTPUTS["servo"].files
    with pytest.raises(BadRequest, match=r"\.gif"):
        file.require(str(tmp_path / "run.mp4"), {})
    with pytest.raises(BadRequest):
        file.require(str(tmp_path / "nowhere" / "run.png"), {})
    file.require(str(tmp_path / "run.png"), {})


@pytest.mark.skipif(find_spec("mujoco") is None, reason="the extra bench is not installed")
def test_what_a_film_does_not_draw_is_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(ServoTask, "run", lambda _: pytest.fail("it runs"))
    sensor = ("point:platform@0.1,0,0", "point:platform@-0.1,0.1,0", "point:platform@0,-0.1,0")
    told = [word for each in sensor for word in ("--sensor", each)]
    assert (
        run_command(
            [
                "servo",
                "gough_stewart",
                "--camera",
                "eye=base@0.3,0.1,0",
                *told,
                "--start",
                "z=0.3",
                "--goal",
                "z=0.33",
                "-o",
                str(tmp_path / "run.gif"),
            ]
        )
        == 2
    )
    (line,) = capsys.readouterr().err.splitlines()
    assert "an animation shows observed legs only" in line
    assert ".png" in line


@pytest.mark.long
@pytest.mark.skipif(find_spec("mujoco") is None, reason="the extra bench is not installed")
def test_a_film_ends_with_the_watched_leg_over_its_wanted_place():
    """At the goal what is seen covers what is to be seen: no pale colour is left, and there was some at the start."""
    image_of = pytest.importorskip("PIL.Image")
    found = hrsynth.servo(hrsynth.load("3rpr_m1"), start="x=0,y=0,phi=0", goal="x=0.03,y=0.02,phi=0.1")
    assert found.outcome == "goal"
    try:
        image = image_of.open(io.BytesIO(draw_animation(found)))
    except hrsynth.errors.RenderFailure:
        pytest.skip("nothing can be rendered here")

    def pale(number: int) -> int:
        image.seek(number)
        colours = np.asarray(image.convert("RGB"), dtype=float)
        return int(np.sum((np.ptp(colours, axis=2) > 60) & (colours.min(axis=2) > 100)))

    assert image.size == (1280, 720)
    assert 10 < image.n_frames <= FRAMES + 12
    assert pale(image.n_frames - 1) < 0.5 * pale(0)


@pytest.mark.slow
def test_the_words_of_a_film_tell_start_crossings_and_end():
    found = hrsynth.servo(hrsynth.load("3rpr_m1"), start="x=-0.08,y=-0.06,phi=-10deg", goal="x=0.034,y=0.23,phi=23deg")
    moments = list(range(0, len(found.run.times), 2))
    words = list(list_captions(found, moments))
    assert len(words) == len(moments)
    assert words[0].startswith("Start.")
    assert words[-1].startswith("End: goal. The platform is")
    crossed = {place for place, each in zip(moments, words, strict=True) if "singularity" in each}
    assert bool(crossed) == bool(found.track.passages)
    for each in found.track.passages or ():
        assert any(0 <= place - each.place <= 2 * CROSSING_CAPTION_FRAMES_COUNT for place in crossed)
