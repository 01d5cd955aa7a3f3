"""Certificates that are false and were made to look sound: most were accepted once, some would stop the checker."""

from __future__ import annotations

import copy
import json
import math
import subprocess
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hrsynth
from hrsynth.certificates import verify_certificate as checker
from hrsynth.errors import HrsynthError, InvalidCertificate

Record = dict[str, Any]
HALF = math.sqrt(3) / 4


def text(x: Any) -> Any:
    return [text(each) for each in x] if isinstance(x, list | tuple) else str(Fraction(x))


def bar(length: object = 1, centre: object = 1, legs: Sequence[tuple[object, Record]] = ()) -> Record:
    """A bar from the origin, its end on the circle of radius 1 about (centre, 0); more tips along it, and what they
    reach. Of length 1, centre 1: the bar at ±60°."""
    tips = [*([at, 0, 0] for at, _ in legs), [0, 0, 0], [length, 0, 0]]
    loop = [
        [text([length, 0]), -1, [1, 0]],
        [text([-Fraction(centre), 0]), -1, [0, 0]],  # type: ignore[arg-type]
        [text([-1, 0]), -1, [0, 1]],
    ]
    return {
        "kind": "loops",
        "angles": 2,
        "slides": 0,
        "loops": [loop],
        "besides": [],
        "others": [],
        "tips": text(tips),
        "links": [[[1, 0], []]] * len(tips),
        "reaches": [each for _, each in legs],
        "bound": {"kind": "degrees", "groups": [[0], [1], [2], [3]]},
    }


def line(height: object, along: object = 1) -> Record:
    return {"line": text([[0, height, 0], [along, 0, 0]])}


def boxed(system: Record, *starts: complex, radius: object = Fraction(1, 10**12), off: float = 0.0) -> Record:
    """The system with a box for the closing near each angle of the bar, at a middle ``off`` that angle."""
    equations, *_ = checker.loops(system, checker.rational(system["tips"]))
    scaled = [
        {e: c / 2 ** max(map(abs, p.values())).bit_length() for e, c in p.items()}
        for p in map(checker.integral, equations)
    ]

    def at(x: Any) -> tuple[Any, Any]:
        values = np.array([sum(float(c) * np.prod(x ** np.array(e)) for e, c in p.items()) for p in scaled])
        slopes = [
            [sum(float(c) * np.prod(x ** np.array(e)) for e, c in checker.slope(p, k).items()) for k in range(4)]
            for p in scaled
        ]
        return values, np.array(slopes)

    length, centre, radius_ = (float(Fraction(system["loops"][0][k][0][0])) for k in (0, 1, 2))
    boxes = []
    for angle in starts:
        end, back = ((length * np.exp(sign * angle) + centre) / -radius_ for sign in (1j, -1j))
        x = np.array([np.cos(angle), (end + back) / 2, np.sin(angle), (end - back) / 2j], dtype=complex)
        for _ in range(8):
            F, J = at(x)
            x = x - np.linalg.solve(J, F)
        x = x + off * np.array([-x[2], -x[3], x[0], x[1]])
        boxes.append(
            {
                "middle": text([[v.real, v.imag] for v in x]),
                "radius": text(radius),
                "inverse": [[text([v.real, v.imag]) for v in row] for row in np.linalg.inv(at(x)[1])],
            }
        )
    return system | {"boxes": boxes}


def posed(system: Record, *angles: object, within: object = Fraction(1, 10**7)) -> Record:
    """The first boxes with the poses at these angles."""
    for box, angle in zip(system["boxes"], angles, strict=False):
        c, s = math.cos(angle), math.sin(angle)  # type: ignore[arg-type]
        box |= {"pose": text([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0]]), "within": text(within)}
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


SIXTY = math.pi / 3


def sound() -> Record:
    return posed(boxed(bar(), SIXTY, -SIXTY), SIXTY, -SIXTY)


def led() -> Record:
    """The middle of the bar on a line: one of its two places fits."""
    system = posed(boxed(bar(legs=[(0.5, line(HALF))]), SIXTY, -SIXTY), SIXTY)
    system["boxes"][1]["misses"] = 0
    return system


def far() -> Record:
    """A bar that is too long: two complex places."""
    return boxed(bar(1.5, 0.1), AWAY, -AWAY)


AWAY = 2.11j
"""About the angle at which a bar of length 1.5 meets the circle of radius 1 about (0.1, 0)."""


def test_sound_certificates_are_accepted():
    assert checker.verify(certificate(2, 2, sound())) == "2 real of 2 complex poses, and no other"
    assert checker.verify(certificate(0, 2, far())) == "0 real of 2 complex poses, and no other"
    assert checker.verify(certificate(1, 1, led())).endswith("no other (more than needed fits)")
    assert checker.verify(certificate(3, 3, led(), sound())).endswith("(more than needed fits) (2 systems)")


def test_lines_through_one_point_need_no_size():
    record = hrsynth.certificate(hrsynth.modes(hrsynth.load("prrrp_m1"), ["1", "2"]))
    assert (record["real"], record["complex"]) == (1, 1)


def ignored_tips() -> Record:
    """Tips of a second body were not where they are told, and no other body is in the plane."""
    return certificate(2, 2, posed(sound(), 1.0, 2.0) | {"bodies": [1, 1]})


def no_tips_compared() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 2.0) | {"bodies": []})


def tips_called_arrows() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 2.0, within=3) | {"arrows": 2, "hub": ["0", "0"]})


def vague_pose() -> Record:
    return certificate(2, 2, posed(sound(), 1.0, 2.0, within=3))


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


def one_pose_twice() -> Record:
    """A second bar, which is no part of the platform, has two places at each pose."""
    (loop,), boxes = bar()["loops"], []
    loops = [[[vector, slide, [0] * k + turns + [0] * (2 - k)] for vector, slide, turns in loop] for k in (0, 2)]
    for one, two in product(sound()["boxes"], repeat=2):
        middle = [x for k in (0, 2) for each in (one, two) for x in each["middle"][k : k + 2]]
        inverse = [[["0", "0"]] * 8 for _ in range(8)]
        for k, each in enumerate((one, two)):
            places = [2 * k, 2 * k + 1, 4 + 2 * k, 5 + 2 * k]  # of its equations, and of its unknowns
            for (i, row), (j, column) in product(enumerate(places), repeat=2):
                inverse[row][column] = each["inverse"][i][j]
        boxes.append(one | {"middle": middle, "inverse": inverse})
    return certificate(
        4,
        4,
        bar()
        | {
            "angles": 4,
            "loops": loops,
            "links": [[[1, 0, 0, 0], []]] * 2,
            "boxes": boxes,
            "bound": {"kind": "degrees", "groups": [[k] for k in range(8)]},
        },
    )


def a_curve_of_closings() -> Record:
    """A slide that is in no loop: there are no isolated closings, and none is told."""
    loop = [[text([1, 0]), -1, [1]], [text([-1, 0]), -1, [0]]]
    return certificate(
        0,
        0,
        bar()
        | {
            "angles": 1,
            "slides": 1,
            "loops": [loop],
            "links": [[[1], []]] * 2,
            "boxes": [],
            "bound": {"kind": "degrees", "groups": [[0], [1], [2]]},
        },
    )


def fewer_than_no_slides() -> Record:
    """Then an angle's sine is the number 1."""
    box = {"middle": text([[0, 0]]), "radius": "1/1000", "inverse": [[["1", "0"]]]}
    system = bar() | {"angles": 1, "slides": -1, "loops": [], "links": [[[1], []]] * 2, "boxes": [box]}
    return certificate(1, 1, posed(system | {"bound": {"kind": "degrees", "groups": [[0]]}}, math.pi / 2))


def short_normal() -> Record:
    """The line's direction has length 1e-12: so had all misfits."""
    return certificate(2, 2, posed(boxed(bar(legs=[(0.5, line(HALF, 1e-12))]), SIXTY, -SIXTY), SIXTY, -SIXTY))


def tiny_units() -> Record:
    """A mechanism of size 1e-10 fits to 1e-9 anywhere."""
    system = led()
    tiny = Fraction(1, 10**10)
    system["tips"] = [[str(Fraction(x) * tiny) for x in b] for b in system["tips"]]
    system["loops"] = [[[[str(Fraction(x) * tiny) for x in vector], *rest] for vector, *rest in system["loops"][0]]]
    system["reaches"] = [
        {kind: [[str(Fraction(x) * tiny) for x in v] for v in vectors]}
        for each in system["reaches"]
        for kind, vectors in each.items()
    ]
    del system["boxes"][1]["misses"]
    return certificate(2, 2, posed(system, SIXTY, -SIXTY))


def large_sphere() -> Record:
    """Relative to its radius of 1e9 a circle is missed by little."""
    circle = {"circle": text([[0, 10**9 + Fraction(1, 2), 0], [0, 10**9, 0], [-(10**9), 0, 0]])}
    return certificate(2, 2, posed(boxed(bar(legs=[(0.5, circle)]), SIXTY, -SIXTY), SIXTY, -SIXTY))


def fits_beside_the_solution() -> Record:
    """A large box, at whose middle the leg fits; the solution is not there."""
    system = boxed(bar(legs=[(0.5, line(math.sin(SIXTY + 0.001) / 2))]), SIXTY, -SIXTY, radius=0.01, off=0.001)
    system["boxes"][1]["misses"] = 0
    return certificate(1, 1, posed(system, SIXTY, within=1))


def complex_poses_forgotten() -> Record:
    """The bar's middle is on a circle wherever its end is: the two complex places fit all legs."""
    half = {"circle": text([[0.05, 0, 0], [0.5, 0, 0], [0, 0.5, 0]])}
    return certificate(0, 0, boxed(bar(1.5, 0.1, [(0.75, half)]), AWAY, -AWAY))


def normal_taken_for_a_direction() -> Record:
    system = led()
    system["reaches"][0] = {"plane": system["reaches"][0]["line"]}
    return certificate(1, 1, system)


def tips_out_of_the_plane() -> Record:
    return certificate(0, 2, far() | {"tips": text([[0, 0, 0], [1, 0, 10]])})


def called_far() -> Record:
    """In units so small that all poses are 10^9 of them away."""
    large = 10**9
    system = bar(large, large)
    system["loops"][0][2][0] = text([-large, 0])
    return certificate(0, 0, boxed(system, SIXTY, -SIXTY))


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
    one_pose_twice,
    a_curve_of_closings,
    fewer_than_no_slides,
    normal_taken_for_a_direction,
    tips_out_of_the_plane,
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
