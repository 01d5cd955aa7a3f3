"""Certificates that are false and were made to look sound: most were accepted once, some would stop the checker."""

from __future__ import annotations

import copy
import json
import math
import subprocess
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hrsynth
from hrsynth.certificates import verify_certificate as checker
from hrsynth.errors import HrsynthError, InvalidCertificate

Record = dict[str, Any]
HEIGHT = math.sqrt(3) / 2
NO_OTHER = "and no other among those of its equations"


def text(x: Any) -> Any:
    return [text(each) for each in x] if isinstance(x, list | tuple) else str(Fraction(x))


def circle(radius: object = 1, height: object = 0) -> Record:
    return {"circle": text([[0, height, 0], [radius, 0, 0], [0, radius, 0]])}


def body(radius: object = 1, place: object = Fraction(1, 2), legs: Sequence[tuple[object, Record]] = ()) -> Record:
    """A body that translates: its origin on a circle of a radius about that of the base and on the plane x = place;
    more tips at heights y, and what they reach. Of radius 1, place 1/2: y = ±√3/2."""
    tips = [[0, 0, 0], [0, 0, 0], *([0, at, 0] for at, _ in legs)]
    return {
        "kind": "shifting",
        "square": 2,
        "bodies": [0] * len(tips),
        "tips": text(tips),
        "reaches": [circle(radius), {"plane": text([[place, 0, 0], [1, 0, 0]])}, *(each for _, each in legs)],
        "bound": {"kind": "rank", "groups": [[[0, 1, 2], 2, 0]]},
    }


def line(height: object, along: object = 1) -> Record:
    return {"line": text([[0, height, 0], [along, 0, 0]])}


def boxed(system: Record, *starts: complex, radius: object = Fraction(1, 10**12), off: float = 0.0) -> Record:
    """The system with a box for the place near each height y, at a middle ``off`` from it."""
    equations, *_ = checker.shifting(system, checker.rational(system["tips"]))
    scaled = [
        {e: c / 2 ** max(map(abs, p.values())).bit_length() for e, c in p.items()}
        for p in map(checker.integral, equations)
    ]

    def at(x: Any) -> tuple[Any, Any]:
        values = np.array([sum(float(c) * np.prod(x ** np.array(e)) for e, c in p.items()) for p in scaled])
        slopes = [
            [sum(float(c) * np.prod(x ** np.array(e)) for e, c in checker.slope(p, k).items()) for k in range(3)]
            for p in scaled
        ]
        return values, np.array(slopes)

    boxes, place = [], float(Fraction(system["reaches"][1]["plane"][0][0]))
    for height in starts:
        x = np.array([place, height, 0.0], dtype=complex)
        for _ in range(8):
            F, J = at(x)
            x = x - np.linalg.solve(J, F)
        x = x + np.array([0.0, off, 0.0])
        boxes.append(
            {
                "middle": text([[v.real, v.imag] for v in x]),
                "radius": text(radius),
                "inverse": [[text([v.real, v.imag]) for v in row] for row in np.linalg.inv(at(x)[1])],
            }
        )
    return system | {"boxes": boxes}


def posed(system: Record, *heights: float, within: object = Fraction(1, 10**7)) -> Record:
    """The first boxes with the poses at these heights."""
    for box, height in zip(system["boxes"], heights, strict=False):
        box |= {"pose": text([[1, 0, 0, 0.5], [0, 1, 0, height], [0, 0, 1, 0]]), "within": text(within)}
    return system


def certificate(real: int, complex_: int, *systems: Record) -> Record:
    record = {
        "format": "hrsynth-certificate-1",
        "claim": "modes",
        "real": real,
        "complex": complex_,
        "systems": list(systems),
    }
    return sealed(record)


def sealed(record: Record) -> Record:
    return record | {"sha256": checker.digest(record)}


def sound() -> Record:
    return posed(boxed(body(), HEIGHT, -HEIGHT), HEIGHT, -HEIGHT)


def led() -> Record:
    """The origin on a line: one of its two places fits."""
    system = posed(boxed(body(legs=[(0, line(HEIGHT))]), HEIGHT, -HEIGHT), HEIGHT)
    system["boxes"][1]["misses"] = 0
    return system


def far() -> Record:
    """A plane beside the circle: two complex places."""
    return boxed(body(place=1.5), AWAY, -AWAY)


AWAY = 1.118j
"""About the height at which the plane x = 3/2 meets the circle of radius 1."""


def test_sound_certificates_are_accepted():
    assert checker.verify(certificate(2, 2, sound())) == f"2 real of 2 complex poses, {NO_OTHER}"
    assert checker.verify(certificate(0, 2, far())) == f"0 real of 2 complex poses, {NO_OTHER}"
    assert checker.verify(certificate(1, 1, led())).endswith("among those of its equations (more than needed fits)")
    assert checker.verify(certificate(3, 3, led(), sound())).endswith("(more than needed fits) (2 systems)")


def ignored_tips() -> Record:
    """Tips of a second body were not where they are told, and no other body is in the plane."""
    return certificate(2, 2, posed(sound(), 1.0, 0.2) | {"bodies": [1, 1]})


def no_tips_compared() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 0.2) | {"bodies": []})


def tips_called_arrows() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 0.2, within=3) | {"arrows": 2, "hub": ["0", "0", "0"]})


def vague_pose() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 0.2, within=3))


def poses_that_miss_a_leg() -> Record:
    """Each real pose says besides that it misses a leg: none counts as complex."""
    system = sound()
    for box in system["boxes"]:
        box["misses"] = 0
    return certificate(2, 0, system)


def a_box_with_another_word() -> Record:
    system = sound()
    system["boxes"][0]["far"] = 1
    return certificate(2, 2, system)


def system_twice() -> Record:
    return certificate(4, 4, sound(), sound())


def no_system() -> Record:
    return certificate(0, 0)


def short_normal() -> Record:
    """The line's direction has length 1e-12: so had all misfits."""
    return certificate(2, 2, posed(boxed(body(legs=[(0, line(HEIGHT, 1e-12))]), HEIGHT, -HEIGHT), HEIGHT, -HEIGHT))


def tiny_units() -> Record:
    """A mechanism of size 1e-10 fits to 1e-9 anywhere."""
    tiny = Fraction(1, 10**10)
    system = boxed(body(tiny, tiny / 2, [(0, line(HEIGHT * tiny, tiny))]), HEIGHT * 1e-10, -HEIGHT * 1e-10)
    for box in posed(system, HEIGHT * 1e-10, -HEIGHT * 1e-10)["boxes"]:
        box["pose"][0][3] = str(tiny / 2)
    return certificate(2, 2, system)


def large_sphere() -> Record:
    """Relative to its radius of 1e9 a circle is missed by little."""
    large = circle(10**9, 10**9 + HEIGHT)
    return certificate(2, 2, posed(boxed(body(legs=[(0, large)]), HEIGHT, -HEIGHT), HEIGHT, -HEIGHT))


def fits_beside_the_solution() -> Record:
    """A large box, at whose middle the leg fits; the solution is not there."""
    system = boxed(body(legs=[(0, line(HEIGHT + 0.001))]), HEIGHT, -HEIGHT, radius=0.01, off=0.001)
    system["boxes"][1]["misses"] = 0
    return certificate(1, 1, posed(system, HEIGHT, within=1))


def complex_poses_forgotten() -> Record:
    """The origin is on a sphere wherever it is on the circle: the two complex places fit all legs."""
    return certificate(0, 0, boxed(body(place=1.5, legs=[(0, {"sphere": text([[0, 0, 0], [1]])})]), AWAY, -AWAY))


def normal_taken_for_a_direction() -> Record:
    system = led()
    system["reaches"][2] = {"plane": system["reaches"][2]["line"]}
    return certificate(1, 1, system)


def called_far() -> Record:
    """In units so small that all poses are 10^9 of them away."""
    large = 10**9
    return certificate(0, 0, boxed(body(large, large // 2), HEIGHT * large, -HEIGHT * large))


def another_name() -> Record:
    """The rank of one number, told as that of a stack of two matrices."""
    return sealed(
        {
            "format": "hrsynth-certificate-1",
            "claim": "ranks",
            "matrices": {"A; X": [[1]]},
            "stacks": [{"of": ["A; X"], "rank": 1, "rows": [0], "columns": [0], "kernel": []}],
        }
    )


FORGED: tuple[Callable[[], Record], ...] = (
    ignored_tips,
    no_tips_compared,
    tips_called_arrows,
    vague_pose,
    system_twice,
    no_system,
    short_normal,
    tiny_units,
    large_sphere,
    fits_beside_the_solution,
    complex_poses_forgotten,
    called_far,
    normal_taken_for_a_direction,
    another_name,
    poses_that_miss_a_leg,
    a_box_with_another_word,
)


@pytest.mark.parametrize("forged", FORGED, ids=lambda each: each.__name__)
def test_a_forged_certificate_is_refused(forged):
    with pytest.raises(checker.CertificateRejection):
        print(checker.verify(forged()))


@pytest.mark.parametrize(
    "chart",
    [
        [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 1]],
        [["1", "2", "0", "0"], ["3/2", "5/2", "0", "0"], ["0", "0", "1", "0"], ["0", "0", "0", "1"]],
        [[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        [[1, 0, 0, 0, 1], *np.eye(4, dtype=int).tolist()[1:]],
    ],
)
def test_a_chart_is_four_independent_rows_of_integers(chart):
    record = {"chart": chart, "arrows": 0, "hub": ["0"] * 3, "reaches": [{"point": text([[0, 0, 0]])}]}
    with pytest.raises((checker.CertificateRejection, ValueError)):
        checker.pose(record, [[Fraction(0)] * 3])


@pytest.mark.parametrize("groups", [[[[k], 12, 0] for k in range(4)], [[[0, 1, 2, 3], 2, 0], *[[[], 1, 0]] * 10**6]])
def test_a_bound_is_found_at_once(groups):
    """Caps of 12 are 28,561 monomials; groups of nothing have no end."""
    with pytest.raises(checker.CertificateRejection):
        checker.rank([{(0, 0, 0, 0): 1}], [False] * 4, {"bound": {"groups": groups}})


def test_a_reason_holds_nothing_that_a_terminal_obeys():
    system = sound()
    system["reaches"] = [{"\x1b[2K\raccepted: 4 real of 8": []}]
    with pytest.raises(checker.CertificateRejection) as reason:
        checker.verify(certificate(2, 2, system))
    assert str(reason.value).isprintable()


def test_no_key_is_told_twice(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps(certificate(2, 2, sound())).replace('"real"', '"real": 4, "real"'))
    with pytest.raises(InvalidCertificate, match="twice"):
        hrsynth.verify(path)
    for content in (path.read_text(), "[" * 200_000):
        path.write_text(content)
        done = subprocess.run(
            [sys.executable, "-I", str(Path(checker.__file__)), str(path)], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr, done.stdout[:7]) == (3, "", "refused")


@pytest.mark.parametrize(
    "about",
    [
        {},
        {"at": 3, "observed": []},
        {"at": {}, "observed": [["a", "b"]], "kind": "1/0"},
        {"at": {"up": 1}, "observed": [], "kind": "hidden"},
        {"at": {}, "kind": "hidden", "observed": [1]},
    ],
)
def test_a_certificate_about_nothing_is_not_about_a_robot(about):
    record = sealed(copy.deepcopy(certificate(2, 2, sound())) | about)
    with pytest.raises(HrsynthError):
        hrsynth.verify(record, hrsynth.load("3rpr_m1"))
