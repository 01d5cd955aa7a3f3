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
from hrsynth.errors import CertificateRefused, HrsynthError

Record = dict[str, Any]
HALF = math.sqrt(3) / 4


def text(x: Any) -> Any:
    return [text(each) for each in x] if isinstance(x, list | tuple) else str(Fraction(x))


def bar(length: object = 1, centre: object = 1, legs: Sequence[tuple[object, Record]] = ()) -> Record:
    """A bar from the origin, its end on the circle of radius 1 about (centre, 0); more tips along it, and what they
    reach. Of length 1, centre 1: t = ±√3, the bar at ±60°."""
    tips = [[0, 0], [length, 0], *([at, 0] for at, _ in legs)]
    reaches = [{"point": text([[0, 0]])}, {"circle": text([[centre, 0], [1, 0], [0, 1]])}, *(each for _, each in legs)]
    return {"kind": "planar", "square": 2, "tips": text(tips), "reaches": reaches,
            "bound": {"kind": "rank", "groups": [[[0], 2, 0]]}}


def line(height: object, along: object = 1) -> Record:
    return {"line": text([[0, height], [along, 0]])}


def boxed(system: Record, *starts: complex, radius: object = Fraction(1, 10 ** 12), off: complex = 0.0) -> Record:
    """The system with a box for the root at each start, its middle ``off`` the root."""
    (equation,), *_ = checker.planar(system, checker.rational(system["tips"]))
    equation = checker.integral(equation)
    p = np.polynomial.Polynomial([float(equation.get((k,), 0)) for k in range(3)])
    scale = 2 ** max(map(abs, equation.values())).bit_length()
    boxes = []
    for t in starts:
        for _ in range(60):
            t = t - p(t) / p.deriv()(t)
        slope = scale / p.deriv()(t)
        t += off
        boxes.append({"middle": text([[t.real, t.imag]]), "radius": text(radius),
                      "inverse": [[text([complex(slope).real, complex(slope).imag])]]})
    return system | {"boxes": boxes}


def posed(system: Record, *angles: object, within: object = Fraction(1, 10 ** 7)) -> Record:
    """The first boxes with the poses at these angles."""
    for box, angle in zip(system["boxes"], angles, strict=False):
        c, s = math.cos(angle), math.sin(angle)  # type: ignore[arg-type]
        box |= {"pose": text([[c, -s, 0], [s, c, 0]]), "within": text(within)}
    return system


def certificate(real: int, complex_: int, *systems: Record) -> Record:
    record = {"format": "hrsynth-certificate-1", "claim": "modes", "real": real, "complex": complex_,
              "systems": list(systems)}
    return sealed(record)


def sealed(record: Record) -> Record:
    return record | {"sha256": checker.digest(record)}


ROOT = math.sqrt(3)
SIXTY = math.pi / 3


def sound() -> Record:
    return posed(boxed(bar(), ROOT, -ROOT), SIXTY, -SIXTY)


def led() -> Record:
    """The middle of the bar on a line: one of its two places fits."""
    system = posed(boxed(bar(legs=[(0.5, line(HALF))]), ROOT, -ROOT), SIXTY)
    system["boxes"][1]["misses"] = 0
    return system


def far() -> Record:
    """A bar that is too long: two complex places, t = ±0.998 i."""
    return boxed(bar(10, 0.1), 1j, -1j)


def test_sound_certificates_are_accepted():
    assert checker.verify(certificate(2, 2, sound())) == "2 real of 2 complex poses, and no other"
    assert checker.verify(certificate(0, 2, far())) == "0 real of 2 complex poses, and no other"
    assert checker.verify(certificate(1, 1, led())).endswith("no other (more legs than needed fit)")
    assert checker.verify(certificate(3, 3, led(), sound())).endswith("(more legs than needed fit) (2 systems)")


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


def poses_called_infinite() -> Record:
    """Boxes so large that they hold t = ±i, where no pose is, besides their own solution."""
    return certificate(0, 0, boxed(bar(10, 0.1), 1j, -1j, radius=0.01))


def short_normal() -> Record:
    """The line's direction has length 1e-12: so had all misfits."""
    return certificate(2, 2, posed(boxed(bar(legs=[(0.5, line(HALF, 1e-12))]), ROOT, -ROOT), SIXTY, -SIXTY))


def tiny_units() -> Record:
    """A mechanism of size 1e-10 fits to 1e-9 anywhere."""
    system = led()
    tiny = Fraction(1, 10 ** 10)
    system["tips"] = [[str(Fraction(x) * tiny) for x in b] for b in system["tips"]]
    system["reaches"] = [{kind: [[str(Fraction(x) * tiny) for x in v] for v in vectors]}
                         for each in system["reaches"] for kind, vectors in each.items()]
    del system["boxes"][1]["misses"]
    return certificate(2, 2, posed(system, SIXTY, -SIXTY))


def large_sphere() -> Record:
    """Relative to its radius of 1e9 a circle is missed by little."""
    circle = {"circle": text([[0, 10 ** 9 + Fraction(1, 2)], [0, 10 ** 9], [-10 ** 9, 0]])}
    return certificate(2, 2, posed(boxed(bar(legs=[(0.5, circle)]), ROOT, -ROOT), SIXTY, -SIXTY))


def fits_beside_the_solution() -> Record:
    """A large box, at whose middle the leg fits; the solution is not there."""
    t = ROOT + 0.001
    system = boxed(bar(legs=[(0.5, line(t / (1 + t * t)))]), ROOT, -ROOT, radius=0.01, off=0.001)
    system["boxes"][1]["misses"] = 0
    return certificate(1, 1, posed(system, SIXTY, within=1))


def complex_poses_forgotten() -> Record:
    """The bar's middle is on a circle wherever its end is: the two complex places fit all legs."""
    half = {"circle": text([[0.05, 0], [0.5, 0], [0, 0.5]])}
    return certificate(0, 0, boxed(bar(10, 0.1, [(5, half)]), 1j, -1j))


def normal_taken_for_a_direction() -> Record:
    system = led()
    system["reaches"][2] = {"plane": system["reaches"][2]["line"]}
    return certificate(1, 1, system)


def tips_out_of_the_plane() -> Record:
    system = bar(10, 1)
    return certificate(0, 2, boxed(system | {"tips": text([[0, 0, 0], [1, 0, 10]])}, 1j, -1j))


def called_far() -> Record:
    """In units so small that all poses are 10^9 of them away."""
    large = 10 ** 9
    system = bar(large, large)
    system["reaches"][1] = {"circle": text([[large, 0], [large, 0], [0, large]])}
    return certificate(0, 0, boxed(system, ROOT, -ROOT))


def another_name() -> Record:
    """The rank of one number, told as that of a stack of two matrices."""
    return sealed({"format": "hrsynth-certificate-1", "claim": "ranks", "matrices": {"A; X": [[1]]},
                   "stacks": [{"of": ["A; X"], "rank": 1, "rows": [0], "columns": [0], "kernel": []}]})


FORGED: tuple[Callable[[], Record], ...] = (
    ignored_tips, no_tips_compared, tips_called_arrows, vague_pose, system_twice, no_system, poses_called_infinite,
    short_normal, tiny_units, large_sphere, fits_beside_the_solution, complex_poses_forgotten, called_far,
    normal_taken_for_a_direction, tips_out_of_the_plane, another_name, poses_that_miss_a_leg, a_box_with_another_word)


@pytest.mark.parametrize("forged", FORGED, ids=lambda each: each.__name__)
def test_a_forged_certificate_is_refused(forged):
    with pytest.raises(checker.NotAccepted):
        print(checker.verify(forged()))


@pytest.mark.parametrize("chart", [
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 1]],
    [["1", "2", "0", "0"], ["3/2", "5/2", "0", "0"], ["0", "0", "1", "0"], ["0", "0", "0", "1"]],
    [[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], [[1, 0, 0, 0, 1], *np.eye(4, dtype=int).tolist()[1:]]])
def test_a_chart_is_four_independent_rows_of_integers(chart):
    record = {"chart": chart, "arrows": 0, "hub": ["0"] * 3, "reaches": [{"point": text([[0, 0, 0]])}]}
    with pytest.raises((checker.NotAccepted, ValueError)):
        checker.pose(record, [[Fraction(0)] * 3])


@pytest.mark.parametrize("groups", [[[[k], 12, 0] for k in range(4)], [[[0, 1, 2, 3], 2, 0], *[[[], 1, 0]] * 10 ** 6]])
def test_a_bound_is_found_at_once(groups):
    """Caps of 12 are 28,561 monomials; groups of nothing have no end."""
    with pytest.raises(checker.NotAccepted):
        checker.rank([{(0, 0, 0, 0): 1}], [False] * 4, {"bound": {"groups": groups}})


def test_a_reason_holds_nothing_that_a_terminal_obeys():
    system = sound()
    system["reaches"][0] = {"\x1b[2K\raccepted: 4 real of 8": []}
    with pytest.raises(checker.NotAccepted) as reason:
        checker.verify(certificate(2, 2, system))
    assert str(reason.value).isprintable()


def test_no_key_is_told_twice(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps(certificate(2, 2, sound())).replace('"real"', '"real": 4, "real"'))
    with pytest.raises(CertificateRefused, match="twice"):
        hrsynth.verify(path)
    for content in (path.read_text(), "[" * 200_000):
        path.write_text(content)
        done = subprocess.run([sys.executable, "-I", str(Path(checker.__file__)), str(path)], capture_output=True,
                              text=True, check=False)
        assert (done.returncode, done.stderr, done.stdout[:7]) == (3, "", "refused")


@pytest.mark.parametrize("about", [
    {}, {"at": 3, "observed": []}, {"at": {}, "observed": [["a", "b"]], "kind": "1/0"},
    {"at": {"up": 1}, "observed": [], "kind": "hidden"}, {"at": {}, "kind": "hidden", "observed": [1]}])
def test_a_certificate_about_nothing_is_not_about_a_robot(about):
    record = sealed(copy.deepcopy(certificate(2, 2, sound())) | about)
    with pytest.raises(HrsynthError):
        hrsynth.verify(record, hrsynth.load("3rpr_m1"))
