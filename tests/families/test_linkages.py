"""Paradoxical linkages: what the engine says of their mobility, constraints and modes, by Denavit and Hartenberg."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.errors import BadRequest
from hrsynth.families.__main__ import main
from hrsynth.families.linkages import LINKAGES, Linkage
from hrsynth.geometry.vectors import Array, find_perpendicular, normalise_vector, rotate_about_axis
from hrsynth.mechanism.builder import Builder


def drawn(name: str, seed: int) -> tuple[Linkage, Array, Array]:
    """A linkage of random dimensions, closed angles, and how its base is turned."""
    rng = np.random.default_rng(seed)
    twists, lengths, offsets = rng.uniform(0.5, 1.2, 3), rng.uniform(0.5, 1.2, 4), rng.uniform(-0.3, 0.3, 3)
    dimensions = {
        "bennett": (*twists[:2], 1.0),
        "goldberg": (*twists, 1.0),
        "myard": (twists[0], 1.0),
        "sarrus": (lengths, twists[0] + 0.3, 0.5),
        "line_symmetric_bricard": (lengths[:3], twists, offsets),
        "plane_symmetric_bricard": (lengths[:3], twists),
        "schatz": (1.0, 0.2 + abs(offsets[0])),
    }
    linkage = LINKAGES[name](*dimensions[name])
    return linkage, linkage.regular(rng), rotate_about_axis(rng.normal(size=3), rng.uniform(0, 3))


def closings(linkage: Linkage, seed: int, starts: int, second: float) -> list[Array]:
    """Closed angles (n,) with the second angle held, one for each random start that ends there."""
    found = (
        linkage.close(start, second)
        for start in np.random.default_rng(seed).uniform(-np.pi, np.pi, (starts, len(linkage.lengths)))
    )
    return [angles for angles in found if angles is not None]


def moved(linkage: Linkage, angles: Array, zero: Array) -> Array:
    """The displacement (4, 4) of the middle link since ``zero``, in the frame of the second axis there."""
    link = len(linkage.lengths) // 2 + 1
    now, then = (np.linalg.inv(frames[1]) @ frames[link] for frames in (linkage.frames(angles), linkage.frames(zero)))
    return now @ np.linalg.inv(then)


def check_mobility(name: str, seed: int) -> None:
    """One freedom where Kutzbach's formula has n − 6; 7 − n constraints of the one loop repeat others."""
    linkage, zero, tilt = drawn(name, seed)
    count = len(linkage.lengths)
    values = np.linalg.svd(linkage.axes(zero), compute_uv=False)
    assert values[count - 1] < 1e-9 < values[count - 2]
    found = hrsynth.check(linkage.mechanism(name, zero, tilt))
    (posture,) = found.postures
    assert (posture.mobility.total, posture.mobility.internal, posture.dof) == (1, 0, 1)
    ((rows, loop),) = [(each.rows, each.loop) for each in found.redundant]
    assert rows == 7 - count
    assert loop in found.setup.mechanism.joints


LISTED = {
    "bennett": 1,
    "goldberg": 1,
    "myard": 1,
    "line_symmetric_bricard": 2,
    "plane_symmetric_bricard": 2,
    "sarrus": 4,
    "schatz": 2,
}
"""How many modes there are with one joint driven, proved to be all."""


def check_modes(name: str, seed: int, starts: int) -> int:
    """With one joint driven the modes that are listed are those that random starts of the closure equations find."""
    linkage, zero, tilt = drawn(name, seed)
    mechanism = linkage.mechanism(name, zero, tilt)
    found = hrsynth.modes(mechanism, real=True)
    assert found.found.continuous_family is None
    assert found.found.complete
    assert len(found.modes) == LISTED[name]
    assert all(mode.assembly == "yes" for mode in found.modes)
    frame = np.eye(4)
    frame[:3, :3] = tilt
    frame = frame @ linkage.frames(zero)[1]
    platform = mechanism.platform
    back = np.linalg.inv(mechanism.links[platform].pose)
    told = [np.linalg.inv(frame) @ mode.bodies[platform] @ back @ frame for mode in found.modes if mode.bodies]
    ends = closings(linkage, seed + 100, starts, zero[1])
    assert ends
    for end in ends:
        if np.linalg.svd(np.delete(linkage.axes(end), 1, 1), compute_uv=False)[-1] > 1e-4:  # no singular closure
            assert min(np.abs(moved(linkage, end, zero) - each).max() for each in told) < 1e-6
    return len(told)


@pytest.mark.some(3)
@pytest.mark.parametrize("name", LINKAGES)
def test_a_paradoxical_linkage_has_one_freedom(name: str):
    check_mobility(name, 1)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["bennett", "myard", "schatz"])
def test_the_modes_of_a_driven_linkage_are_listed(name: str):
    assert check_modes(name, 1, 10) >= 1


def test_a_linkage_is_written_by_its_name(tmp_path: Path):
    main(str(tmp_path), "schatz", "3rps")
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["3rps", "schatz"]
    posture = hrsynth.check(hrsynth.load(tmp_path / "schatz.urdf")).postures[0]
    assert posture.mobility.total == 1
    with pytest.raises(BadRequest, match="'robot'"):
        main(str(tmp_path), "robot")


ZERO = {
    "bennett": [-2.575753, -1.446473, 2.575753, 1.446473],
    "goldberg": [2.575753, -1.446473, -2.165401, -1.69512, 2.73124],
    "myard": [0.24382, 2.28192, 1.448886, -1.692706, -2.28192],
    "sarrus": [-2.01301, -1.446473, -2.823702, -1.000322, 1.749778, -0.749456],
    "line_symmetric_bricard": [-2.77701, -1.446473, 1.118683, -2.77701, -1.446473, 1.118683],
    "plane_symmetric_bricard": [-2.899563, -1.446473, -2.121878, -1.321518, -2.121878, -1.446473],
    "schatz": [2.605633, -0.730875, -1.448371, -1.679842, 2.294982, 0.699726],
}


@pytest.mark.parametrize("name", LINKAGES)
def test_the_zero_configurations_of_linkages_stay(name: str):
    """What was written from them stays what it was, on every machine: the angles at zero (rad)."""
    assert LINKAGES[name]().regular(np.random.default_rng(0)) == pytest.approx(ZERO[name], abs=1e-6)


class Shaken(np.random.Generator):
    """Draws whose last digits are others."""

    def uniform(self, *args, **kwargs):
        return super().uniform(*args, **kwargs) * (1 + 1e-12)


@pytest.mark.parametrize("name", LINKAGES)
def test_the_last_digits_of_the_starts_do_not_decide_a_zero_configuration(name: str):
    assert LINKAGES[name]().regular(Shaken(np.random.PCG64(0))) == pytest.approx(ZERO[name], abs=1e-6)


@pytest.mark.slow
def test_dimensions_that_keep_a_joint_near_to_zero_end_with_the_farthest_angles():
    linkage, zero, _ = drawn("goldberg", 2)
    assert 0.05 < np.abs(np.sin(zero)).min() < 0.1
    values = np.linalg.svd(linkage.axes(zero), compute_uv=False)
    assert values[4] < 1e-9 < values[3]


def test_dimensions_that_do_not_close_are_refused():
    with pytest.raises(BadRequest, match="linkage"):
        Linkage.of([1.0, 0.1, 0.1, 0.1], [0.5] * 4).regular(np.random.default_rng(0))


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("name", LINKAGES)
def test_many_linkages(name: str):
    for seed in range(2, 5):
        check_mobility(name, seed)
        check_modes(name, seed, 12)


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("word", "closing"), [("RRRR", "S"), ("RRU", "S"), ("RPRR", "S"), ("URR", "S"), ("RRRRR", "U")]
)
def test_a_loop_that_closes_at_any_joint_is_answered(word: str, closing: str):
    """With joints that are no R and P, or more of them than are bounded, its modes are found."""
    rng, b = np.random.default_rng(len(word)), Builder("loop")
    places, links = rng.normal(size=(len(word) + 1, 3)), ["base", *(f"link_{k}" for k in range(1, len(word) + 1))]
    axes = [normalise_vector(each) for each in rng.normal(size=(len(word) + 1, 3))]
    b.link("base")
    for link, at in zip(links[1:], places, strict=False):
        b.link(link, at=at)

    def turns(k: int, kind: str) -> dict[str, Array]:
        return (
            {} if kind == "S" else {"axis": axes[k]} | ({"axis2": find_perpendicular(axes[k])} if kind == "U" else {})
        )

    for k, kind in enumerate(word):
        b.joint(f"joint_{k}", kind, links[k], links[k + 1], at=places[k], motor=k == 0, **turns(k, kind))
    b.joint("closing", closing, links[-1], "base", at=places[-1], loop=True, **turns(-1, closing))
    found = hrsynth.modes(b.build(platform=links[len(word) // 2]), real=True)
    assert sum(mode.goal for mode in found.modes) == 1
