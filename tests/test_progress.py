"""Progress: who sees the stages of an analysis, and when."""

from __future__ import annotations

import io
import logging

import pytest

import hrsynth
from hrsynth import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def run(monkeypatch: pytest.MonkeyPatch, stderr: io.StringIO, seed: int, after: float = 0.0) -> str:
    monkeypatch.setattr("sys.stderr", stderr)
    monkeypatch.setattr(progress, "SHOWN_AFTER_S", after)
    monkeypatch.setattr(progress, "SHOWN_AGAIN_S", 0.0)
    hrsynth.derive("3rrr_m1", seed=seed)
    return stderr.getvalue()


def test_a_terminal_shows_the_stages_and_is_left_clean(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = run(monkeypatch, Terminal(), 1001)
    lines = shown.split("\r")
    assert any("sampling, step" in line for line in lines)
    assert max(map(len, lines)) == progress.SHOWN_COLUMNS_COUNT
    assert lines[-1] == ""
    assert not lines[-2].strip()


@pytest.mark.parametrize("case", ["quick", "no terminal", "off", "watched"])
def test_nobody_else_sees_them(monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    """An analysis of less than two seconds, a file or a pipe, a user who does not want it or has a listener."""
    monkeypatch.setenv("HRSYNTH_PROGRESS", "0" if case == "off" else "1")
    stderr, stages, seed = io.StringIO() if case == "no terminal" else Terminal(), list[str](), 1002 + len(case)
    if case == "watched":
        with hrsynth.on_progress(stages.append):
            shown = run(monkeypatch, stderr, seed)
        assert "sampling" in stages
    else:
        shown = run(monkeypatch, stderr, seed, after=100.0 if case == "quick" else 0.0)
    assert shown == ""


def test_the_logger_has_each_step(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "hrsynth"):
        hrsynth.derive("3rrr_m1", seed=1003)
    assert "sampling" in caplog.messages


def test_a_stage_with_an_end_tells_how_much_is_done() -> None:
    """Of a grid each pose once, up to all of them."""
    stages = list[str]()
    with hrsynth.on_progress(stages.append):
        hrsynth.check("3rrr_m1", grid="x=0:0.01:3,y=0:0.01:2", seed=1004)
    counted = [stage for stage in stages if stage.startswith("poses, ")]
    assert counted == [f"poses, {number} of 6" for number in range(1, 7)]
    assert progress.format_step(counted[0], 9) == "poses, 1 of 6"
    assert progress.format_step("poses", 9) == "poses, step 9"
