"""Servo runs that the papers print: simulations, and experiments with their noise."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Replay:
    """A printed run: source, observed legs, start and goal, printed outcome and figures (``said``), and a remark on the
    computed ones; λ (1/s) and the noise. Runs of one ``order`` are ranked by their errors as printed in ``place`` (1:
    the best; equal places: about the same)."""

    source: str
    robot: str
    legs: tuple[str, ...]
    way: tuple[str, str]
    ended: str
    said: str
    remark: str = ""
    gain: float = 0.8
    noise: str | None = None
    dynamics: bool = False
    order: str = ""
    place: int = 0
    printed: tuple[float | None, float | None] = (None, None)
    """Errors of position (m) and orientation (rad) as printed."""


_ALL = ("1", "2", "3", "4")
_HIGH = ("x=0,y=0,z=-0.75,phi=0", "x=-0.2,y=0,z=-0.56,phi=0")
_LOW = ("x=0.05,y=0.05,z=-0.8,phi=0", "x=0.03,y=0.03,z=-0.59,phi=0")
_ACROSS = ("x=0.02,y=0.1,z=-0.7,phi=0", "x=-0.2,y=0.01,z=-0.7,phi=0")
_DOWN = ("x=0.05,y=0.05,z=-0.8,phi=0", "x=0.03,y=0.03,z=-0.65,phi=0")
_RIGID = ("x=0.1,y=0.04,z=-0.93", "x=0,y=-0.25,z=-0.7")
_RIGID_2 = ("x=0.1,y=0.04,z=-0.93", "x=0,y=-0.3,z=-0.85")
_TURNS = "in position: this noise averages out except for a shift in z; in orientation the order is as printed"
_HELD = "not a mode, but this noise keeps the run near it; without noise it continues to the goal"
_PERSISTS = "about the size of the bound: of errors that do not average out"
_AVERAGED = "this noise averages out; errors of the experiment persist"
_NEAR_MODE = "(0.03, 0.03, −0.65) is not a mode: two of its directions are 0.5° off"


def _bench(
    table: str,
    legs: tuple[str, ...],
    way: tuple[str, str],
    ended: str,
    metres: float,
    radians: float,
    remark: str = _AVERAGED,
    place: int = 0,
) -> Replay:
    """An experiment of MMT 5.2: λ = 0.2, directions wrong by about 0.1 rad."""
    return Replay(
        table,
        "quattro",
        legs,
        way,
        ended,
        f"{metres:.2f} m, {radians:.2f} rad",
        remark,
        0.2,
        "0.1",
        True,
        table if place else "",
        place,
        (metres, radians),
    )


SIMULATED = (
    Replay(
        "MMT 5.1.3, Fig. 23",
        "quattro",
        ("1", "4"),
        _HIGH,
        ended="assembly mode",
        said="(−0.2, 0, −0.909)",
        remark="the same mode, 7 mm from the printed digits",
    ),
    Replay("MMT 5.1.3, Fig. 22", "quattro", ("2", "3"), _HIGH, ended="goal", said="(−0.2, 0, −0.56)"),
    Replay(
        "MMT 5.1.3, Fig. 25",
        "quattro",
        _ALL,
        _LOW,
        ended="assembly mode",
        said="(0.03, 0.03, −0.65)",
        remark=_NEAR_MODE,
    ),
    Replay(
        "MMT 5.1.3, Fig. 26",
        "quattro",
        _ALL,
        ("x=0.028,y=0,z=-0.617,phi=0", "x=-0.6,y=0,z=-0.8,phi=0"),
        ended="local minimum",
        said="(−0.588, 0, −0.847)",
        remark="the printed pose is not on the boundary, and the run does not stop",
    ),
    Replay(
        "IROS V, Fig. 6",
        "quattro_rigid",
        ("1", "2"),
        _RIGID,
        gain=5,
        ended="assembly mode",
        said="(0, −0.25, −0.958)",
        remark="the printed mode is out of a rod's reach; these dimensions give one 2 mm from the goal",
    ),
    Replay("IROS V, Fig. 5", "quattro_rigid", ("1", "3"), _RIGID, gain=5, ended="goal", said="(0, −0.25, −0.7)"),
)
NOISY = (
    Replay(
        "MMT 5.1.3, Fig. 28",
        "quattro",
        ("2", "3"),
        _ACROSS,
        noise="0.1deg",
        ended="goal",
        said="3 mm, 0.05 rad",
        remark=_PERSISTS,
        order="Fig. 28",
        place=1,
        printed=(0.003, 0.05),
    ),
    Replay(
        "MMT 5.1.3, Fig. 28",
        "quattro",
        ("2", "4"),
        _ACROSS,
        noise="0.1deg",
        ended="goal",
        said="7 mm, 0.07 rad",
        remark=_PERSISTS,
        order="Fig. 28",
        place=2,
        printed=(0.007, 0.07),
    ),
    Replay(
        "MMT 5.1.3, Fig. 29",
        "quattro",
        ("1", "4"),
        _DOWN,
        noise="0.1deg",
        ended="goal",
        said="as {1, 3, 4}",
        order="Fig. 29",
        place=2,
    ),
    Replay(
        "MMT 5.1.3, Fig. 29",
        "quattro",
        ("1", "3", "4"),
        _DOWN,
        noise="0.1deg",
        ended="goal",
        said="as {1, 4}",
        order="Fig. 29",
        place=2,
    ),
    Replay(
        "MMT 5.1.3, Fig. 29",
        "quattro",
        _ALL,
        _DOWN,
        noise="0.1deg",
        ended="goal",
        said="best",
        order="Fig. 29",
        place=1,
    ),
    Replay(
        "IROS V, Fig. 7a",
        "quattro_rigid",
        ("1", "2"),
        _RIGID_2,
        gain=5,
        noise="0.01deg",
        ended="goal",
        said="1.6 mm",
        remark="2.7 times what errors of 0.01° can make at this pose, to first order",
        order="Fig. 7a",
        place=3,
        printed=(0.0016, None),
    ),
    Replay(
        "IROS V, Fig. 7a",
        "quattro_rigid",
        ("1", "3"),
        _RIGID_2,
        gain=5,
        noise="0.01deg",
        ended="goal",
        said="0.22 mm",
        remark=_PERSISTS,
        order="Fig. 7a",
        place=2,
        printed=(0.00022, None),
    ),
    Replay(
        "IROS V, Fig. 7a",
        "quattro_rigid",
        _ALL,
        _RIGID_2,
        gain=5,
        noise="0.01deg",
        ended="goal",
        said="0.15 mm",
        remark=_PERSISTS,
        order="Fig. 7a",
        place=1,
        printed=(0.00015, None),
    ),
    Replay(
        "IROS V, Fig. 7b", "quattro_rigid", ("1", "3"), _RIGID_2, gain=5, noise="0.1deg", ended="goal", said="converges"
    ),
)
MEASURED = (
    _bench("MMT Table 2", ("1", "4"), _HIGH, "assembly mode", 0.10, 2.15),
    _bench("MMT Table 3", ("2", "3"), _HIGH, "goal", 0.10, 0.90),
    _bench("MMT Table 4", _ALL, _LOW, "assembly mode", 0.07, 0.05, _HELD),
    _bench("MMT Table 5", ("2", "3"), _ACROSS, "goal", 0.11, 0.06, place=1),
    _bench("MMT Table 5", ("2", "4"), _ACROSS, "goal", 0.23, 0.68, place=2),
    _bench("MMT Table 6", ("1", "4"), _DOWN, "goal", 0.11, 0.39, place=3),
    _bench("MMT Table 6", ("1", "3", "4"), _DOWN, "goal", 0.09, 0.31, _TURNS, place=2),
    _bench("MMT Table 6", _ALL, _DOWN, "goal", 0.07, 0.05, _TURNS, place=1),
)
REPLAYS = SIMULATED + NOISY + MEASURED
