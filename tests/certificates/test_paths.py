"""Certificates of paths: accepted by one file of plain Python, refused when a path crosses the singular locus."""

from __future__ import annotations

import copy
import json
import math
import random
import subprocess
import sys
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

import hrsynth
from hrsynth.certificates import verify_path as checker
from hrsynth.cli import execute
from hrsynth.errors import CertificateRefused, NoCertificate

FILE = Path(checker.__file__)
PATHS = {"3rrr_m1": (None, "x=0,y=0,phi=0", "x=0.02,y=0,phi=5deg"),
         "gough_stewart": ("1,3,5", "x=0,y=0,z=0.3", "x=0.02,y=0.01,z=0.32,rpy=0.1/0/0"),
         "quattro": ("1,4", "x=0,y=0,z=-0.7,phi=0", "x=0.05,y=0,z=-0.7,phi=0.1"),
         "delta": (None, "x=0,y=0,z=-0.4", "x=0.02,y=0.03,z=-0.45"),
         "orthoglide": (None, "x=0,y=0,z=0", "x=0.02,y=0.03,z=-0.05")}
"""Cranks, rails and rods that slide; robots that turn in a plane, in space, about an axis and not at all."""


@cache
def of(name: str) -> str:
    observe, start, goal = PATHS[name]
    return json.dumps(hrsynth.certificate(hrsynth.path(name, observe, start=start, goal=goal)))


@cache
def separated() -> str:
    return json.dumps(hrsynth.certificate(hrsynth.path("3rrr_m1", start="x=0,y=0,phi=0", goal="mode:2")))


def sealed(record):
    return record | {"sha256": checker.digest(record)}


@pytest.mark.some(1)
@pytest.mark.parametrize("name", [name if name in ("3rrr_m1", "orthoglide") else
                                  pytest.param(name, marks=pytest.mark.slow) for name in PATHS])
def test_what_is_certified_is_accepted(name, tmp_path):
    record = json.loads(of(name))
    assert hrsynth.verify(record, name).startswith("same aspect: ")
    path = tmp_path / "c.json"
    path.write_text(of(name))
    done = subprocess.run([sys.executable, "-I", str(FILE), str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("accepted: same aspect: ")
    with pytest.raises(CertificateRefused, match="not for"):
        hrsynth.verify(record, "delta" if name != "delta" else "orthoglide")


def test_no_path_between_separated_poses_is_accepted():
    """However it goes and however finely it is cut: the condition is zero on it."""
    record = json.loads(separated())
    assert checker.verify(record).startswith("separated: ")
    assert record["legs"][0] == record["legs"][1]
    rng = random.Random(1)
    for count in (1, 10, 300):
        (p, q), (r, s) = ([[Fraction(x) for x in part] for part in node] for node in record["path"])
        bent = [Fraction(rng.randint(-10, 10), 1000) for _ in p]
        nodes = []
        for k in range(count + 1):
            t = Fraction(k, count)
            at = [a + t * (b - a) + t * (1 - t) * c for a, b, c in zip(p, r, bent, strict=True)]
            nodes.append([[str(x) for x in at], [str(a + t * (b - a)) for a, b in zip(q, s, strict=True)]])
        false = record | {"verdict": "same aspect", "legs": record["legs"][:1], "path": nodes,
                          "ends": [nodes[0], nodes[-1]]}
        with pytest.raises(checker.PathNotAccepted):
            checker.verify(sealed(false))


def test_one_aspect_is_not_told_to_be_two():
    record = json.loads(of("3rrr_m1"))
    false = record | {"verdict": "separated", "legs": record["legs"] * 2, "path": record["ends"]}
    with pytest.raises(checker.PathNotAccepted, match="one sign"):
        checker.verify(sealed(false))


def test_legs_of_two_robots_separate_nothing():
    record = json.loads(separated())
    record["legs"][1][0]["rod"] = str(Fraction(record["legs"][1][0]["rod"]) * Fraction(1001, 1000))
    with pytest.raises(checker.PathNotAccepted, match="not the same"):
        checker.verify(sealed(record))


@pytest.mark.parametrize(("sense", "mode"), [(1, 1), (1.0, 1), (1, 1.0), (True, 1), (1, True)])
def test_no_float_rounds_a_zero_away(sense, mode):
    """The direction (3/5, 4/5, 0) of a rod makes 3 u² − 9/5 u zero, also where a factor ±1 is told as a float."""
    node = [["3", "4", "0"], ["1", "0", "0", "0"]]
    leg = {"kind": "slide", "axis": None, "aside": "0", "mode": mode, "tip": [True, ["0"] * 3, ["0"] * 3],
           "centre": ["0"] * 3}
    along = ["dot", "u", "x"]
    false = {"format": "hrsynth-certificate-1", "claim": "path", "verdict": "same aspect", "legs": [[leg]],
             "vectors": {"u": ["leg", 0, sense, ["0"] * 3], "x": ["point", False, ["0"] * 3, ["1", "0", "0"]],
                         "o": ["point", False, ["0"] * 3, ["0"] * 3]},
             "points": ["o"], "path": [node, node], "ends": [node, node],
             "condition": ["+", ["*", "3", along, along], ["*", "-3", "3/5", along]]}
    with pytest.raises(checker.PathNotAccepted):
        checker.verify(sealed(false))
    false["condition"] = along
    if type(sense) is type(mode) is int:
        assert checker.verify(sealed(false)).startswith("same aspect")


def spoil(record, rng) -> str:
    """A change that leaves no proof."""
    node = rng.choice(record["path"])
    match rng.randrange(9):
        case 0:
            record["ends"][rng.randrange(2)][0][rng.randrange(3)] = str(Fraction(rng.randint(1, 9), 10 ** 6))
        case 1:
            node[0] = [str(rng.randint(50, 99))] * 3
        case 2:
            node[1] = ["0"] * 4
        case 3:
            record["verdict"] = rng.choice(("separated", "proved", None))
        case 4:
            unread = ("robot", "observed", "start", "goal", "sha256")
            del record[rng.choice([key for key in record if key not in unread])]
        case 5:
            record["condition"] = rng.choice(("0", ["+", record["condition"], ["*", "-1", record["condition"]]], [], 1))
        case 6:
            rng.choice(record["legs"][0])["mode"] = rng.choice((0, 2, "1", None, 1.5))
        case 7:
            rng.choice(record["legs"][0])[rng.choice(("kind", "tip", "centre"))] = rng.choice((None, "x", [], {}, 3))
        case 8:
            node[rng.randrange(2)].append("1")
    record["sha256"] = checker.digest(record)
    return json.dumps(record)


def attacked(name, count):
    """How many were refused; none is accepted."""
    rng = random.Random(2)
    for _ in range(count):
        record = json.loads(of(name))
        changed = spoil(record, rng)
        with pytest.raises(checker.PathNotAccepted):
            print(changed, checker.verify(json.loads(changed)))
    return count


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["3rrr_m1", "orthoglide"])
def test_false_certificates_are_refused(name):
    assert attacked(name, 100) == 100


@pytest.mark.long
def test_a_thousand_false_certificates_of_each_are_refused():
    assert sum(attacked(name, 1000) for name in PATHS) == 5000


def test_intervals_hold_what_they_are_of():
    rng = random.Random(3)
    for _ in range(300):
        (a, b), (c, d) = (sorted(Fraction(rng.randint(-999, 999), rng.randint(1, 99)) for _ in range(2)) for _ in "xy")
        x, y = a + (b - a) * Fraction(rng.randint(0, 9), 9), c + (d - c) * Fraction(rng.randint(0, 9), 9)
        one, other = checker.interval(a, b), checker.interval(c, d)
        for found, value in ((checker.plus(one, other), x + y), (checker.minus(one, other), x - y),
                             (checker.times(one, other), x * y), (checker.square(one), x * x)):
            assert found[0] <= value * checker.ONE <= found[1]
            assert found[1] - found[0] <= 2 * checker.ONE * (1 + abs(a) + abs(b) + b - a) * (
                1 + abs(c) + abs(d) + d - c) ** 2 * (1 + b - a) + 4
        if c * d > 0:
            found = checker.over(one, other)
            assert found[0] <= x / y * checker.ONE <= found[1]
        if a > 0:
            low, high = checker.root(one)
            assert low * low <= x * checker.ONE ** 2 <= high * high
            assert math.isqrt(checker.ONE) ** 2 == checker.ONE


def test_what_has_no_certificate_says_why():
    crossing = copy.copy(hrsynth.path("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=5deg"))
    object.__setattr__(crossing, "certified", False)
    with pytest.raises(NoCertificate, match="enclosed away from zero"):
        hrsynth.certificate(crossing)


def test_command_line(tmp_path, capsys):
    path = tmp_path / "c.json"
    assert execute(["path", "3rrr_m1", "--start", "x=0,y=0,phi=0", "--goal", "x=0.02,y=0", "--certificate", str(path)]
                   ) == 0
    assert f"The certificate is written to {path}." in capsys.readouterr().out
    assert execute(["verify", str(path), "--robot", "3rrr_m1"]) == 0
    assert capsys.readouterr().out.startswith("accepted: same aspect: ")
    path.write_text(path.read_text().replace("same aspect", "separated"))
    assert execute(["verify", str(path)]) == 3
