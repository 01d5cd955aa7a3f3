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
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.certificates import verify_path as checker
from hrsynth.cli import run_command
from hrsynth.errors import InvalidCertificate, NoCertificate

FILE = Path(checker.__file__)
PATHS = {
    "3rrr_m1": (None, "x=0,y=0,phi=0", "x=0.02,y=0,phi=5deg"),
    "gough_stewart": ("1,3,5", "x=0,y=0,z=0.3", "x=0.02,y=0.01,z=0.32,rpy=0.1/0/0"),
    "quattro": ("1,4", "x=0,y=0,z=-0.7,phi=0", "x=0.05,y=0,z=-0.7,phi=0.1"),
    "delta": (None, "x=0,y=0,z=-0.4", "x=0.02,y=0.03,z=-0.45"),
    "orthoglide": (None, "x=0,y=0,z=0", "x=0.02,y=0.03,z=-0.05"),
}
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
@pytest.mark.parametrize(
    "name",
    [name if name in ("3rrr_m1", "orthoglide") else pytest.param(name, marks=pytest.mark.slow) for name in PATHS],
)
def test_what_is_certified_is_accepted(name, tmp_path):
    record = json.loads(of(name))
    assert hrsynth.verify(record, name).startswith("same aspect: ")
    path = tmp_path / "c.json"
    path.write_text(of(name))
    done = subprocess.run([sys.executable, "-I", str(FILE), str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("accepted: same aspect: ")
    with pytest.raises(InvalidCertificate, match="not for"):
        hrsynth.verify(record, "delta" if name != "delta" else "orthoglide")


def test_no_path_between_separated_poses_is_accepted():
    """However it goes and however finely it is cut: the condition is zero on it."""
    record = json.loads(separated())
    assert checker.verify(record).startswith("separated: ")
    assert record["modes"][0] == record["modes"][1]
    rng = random.Random(1)
    for count in (1, 10, 300):
        (p, q), (r, s) = ([[Fraction(x) for x in part] for part in node] for node in record["path"])
        bent = [Fraction(rng.randint(-10, 10), 1000) for _ in p]
        nodes = []
        for k in range(count + 1):
            t = Fraction(k, count)
            at = [a + t * (b - a) + t * (1 - t) * c for a, b, c in zip(p, r, bent, strict=True)]
            nodes.append([[str(x) for x in at], [str(a + t * (b - a)) for a, b in zip(q, s, strict=True)]])
        false = record | {
            "verdict": "same aspect",
            "modes": record["modes"][:1],
            "path": nodes,
            "ends": [nodes[0], nodes[-1]],
        }
        with pytest.raises(checker.PathRejection):
            checker.verify(sealed(false))


def test_one_aspect_is_not_told_to_be_two():
    record = json.loads(of("3rrr_m1"))
    false = record | {"verdict": "separated", "modes": record["modes"] * 2, "path": record["ends"]}
    with pytest.raises(checker.PathRejection, match="one sign"):
        checker.verify(sealed(false))


def test_a_separation_says_how_many_working_modes_it_is_of():
    """Of the goal's directions, of one; of the goal's pose, of all, and those of the start's sign are refused."""
    found = checker.verify(json.loads(separated()))
    assert found.endswith("in 1 of 8 working modes (platform: translations 2, rotations 1)")
    answer = hrsynth.path("3prr_m1", start="x=0,y=0", goal="x=0.0585,y=0.073,phi=-88deg")
    record = hrsynth.certificate(answer)
    assert "in 8 of 8 working modes" in hrsynth.verify(record, "3prr_m1")
    rng, mixed = random.Random(5), 0
    for _ in range(12):
        shift = [str(Fraction(rng.randint(-30, 30), 100)) for _ in "xy"]
        node = [shift, ["1", str(Fraction(rng.randint(-40, 40), 100))]]
        record = json.loads(separated())
        record["path"][1] = record["ends"][1] = node
        sides = {modes: judged(record, [record["modes"][0], list(modes)]) for modes in product((1, -1), repeat=3)}
        assert set(sides.values()) <= {"separated", "the condition has one sign at both poses", UNREACHED}
        goals = [list(modes) for modes in sides]
        every = judged(record, [record["modes"][0], *goals])
        assert (every == "separated") is (set(sides.values()) == {"separated"})
        assert judged(record, [record["modes"][0], goals[0], goals[0]]) != "separated"
        mixed += len(set(sides.values())) == 2
    assert mixed


UNREACHED = "a leg that may not reach, or a vector that may be zero"


def judged(record, modes):
    """What the checker says of a separation in other working modes."""
    try:
        return checker.verify(sealed(record | {"modes": modes})).split(":")[0]
    except checker.PathRejection as reason:
        return str(reason)


@pytest.mark.parametrize(("sense", "mode"), [(1, 1), (1.0, 1), (1, 1.0), (True, 1), (1, True)])
def test_no_float_rounds_a_zero_away(sense, mode):
    """The direction (3/5, 4/5, 0) of a rod makes 3 u² − 9/5 u zero, also where a factor ±1 is told as a float."""
    node = [["3", "4"], ["1"]]
    leg = {"kind": "slide", "axis": None, "aside": "0", "tip": [True, ["0"] * 3, ["0"] * 3], "centre": ["0"] * 3}
    along = ["dot", "u", "x"]
    motion = {
        "origin": ["0"] * 3,
        "along": [["1", "0", "0"], ["0", "1", "0"]],
        "home": ["1", "0", "0", "0"],
        "about": [],
    }
    false = {
        "format": "hrsynth-certificate-1",
        "claim": "path",
        "verdict": "same aspect",
        "legs": [leg],
        "modes": [[mode]],
        "motion": motion,
        "vectors": {
            "u": ["leg", 0, sense, ["0"] * 3],
            "x": ["point", False, ["0"] * 3, ["1", "0", "0"]],
            "o": ["point", False, ["0"] * 3, ["0"] * 3],
        },
        "points": ["o"],
        "path": [node, node],
        "ends": [node, node],
        "condition": ["+", ["*", "3", along, along], ["*", "-3", "3/5", along]],
    }
    with pytest.raises(checker.PathRejection):
        checker.verify(sealed(false))
    false["condition"] = along
    if type(sense) is type(mode) is int:
        assert checker.verify(sealed(false)).startswith("same aspect")


def at(record, *keys):
    """A part of a record: the object that holds it, and its key there."""
    for key in keys[:-1]:
        record = record[key]
    return record, keys[-1]


def put(value, *keys):
    """A change of one part of a record."""

    def change(record):
        inside, key = at(record, *keys)
        inside[key] = value

    return change


def lifted(record):
    """The middle of the path is raised out of the platform's plane."""
    record["path"][len(record["path"]) // 2][0].append("1/10")


def tilted(record):
    """The platform is tilted in the middle of the path."""
    record["path"][len(record["path"]) // 2][1].append("1/10")


def freed(record):
    """The platform is given the motion by which its path leaves the plane."""
    record["motion"]["along"].append(["0", "0", "1"])
    for node in record["path"]:
        node[0].append("0")
    record["path"][1][0][2] = "1/1000"
    record["ends"] = [record["path"][0], record["path"][-1]]


def shortened(record):
    """The path ends half way."""
    record["path"] = record["path"][: len(record["path"]) // 2]
    record["ends"][1] = record["path"][-1]


def dropped(record):
    """A leg is not in the file."""
    record["vectors"]["B3"] = record["vectors"]["B2"]
    record["vectors"]["tau3"] = ["point", False, ["0"] * 3, ["1", "0", "0"]]
    record["legs"].pop()
    record["modes"][0].pop()


def old(record):
    """A record as it was before it named motions: poses of points and quaternions."""
    del record["motion"]


NUMBER, PLACE = "a number in words", ("path", 0, 0, 0)
FORGERIES = {
    "a path out of the plane": (lifted, "a shift that the platform does not have"),
    "a tilted platform": (tilted, "a turn that the platform does not have"),
    "no motions": (old, "motions of the platform are missing"),
    "motions in words": (put("xy", "motion", "along"), "a vector of another length"),
    "a quaternion of zero": (put(["0", "0"], "path", 1, 1), "a quaternion that may be zero"),
    "home of zero": (put(["0"] * 4, "motion", "home"), "a quaternion that may be zero"),
    "half a turn between two poses": (put(["-1", "0"], "path", 1, 1), "may"),
    "far away": (put("99", "path", 1, 0, 0), "a leg that may not reach"),
    "other ends": (put([["0", "0"], ["1", "0"]], "ends", 0), "the ends of another path"),
    "one pose": (lambda r: r.update(path=r["path"][:1], ends=r["path"][:1] * 2), "too few poses"),
    "two sets of working modes": (lambda r: r["modes"].append(r["modes"][0]), "one set of working modes"),
    "a working mode for each leg but one": (lambda r: r["modes"][0].pop(), "no certificate"),
    "a working mode of zero": (put(0, "modes", 0, 0), "a working mode"),
    "true as a working mode": (put(True, "modes", 0, 0), "a working mode"),
    "a float": (put(0.5, *PLACE), NUMBER),
    "no number": (put(float("nan"), *PLACE), NUMBER),
    "infinity": (put("1e999", *PLACE), NUMBER),
    "infinity in words": (put("inf", *PLACE), NUMBER),
    "a denominator of zero": (put("1/0", *PLACE), "no certificate"),
    "a long number": (put("9" * 400, *PLACE), NUMBER),
    "a large number": (put("9" * 299, "path", 1, 0, 0), "a leg that may not reach"),
    "an axis of zero": (put(["0"] * 3, "legs", 0, "axis"), "may be zero"),
    "a rod of no length": (put("0", "legs", 0, "rod"), "a leg that may not reach"),
    "a leg of another kind": (put("spring", "legs", 0, "kind"), "no certificate"),
    "a condition of zero": (put("0", "condition"), "the condition may be zero"),
    "a condition that is a vector": (put("n", "condition"), "a condition that is not a number"),
    "a product of vectors": (put(["*", "n", "n"], "condition"), "a product of vectors"),
    "another verdict": (put("proved", "verdict"), "another verdict"),
}
"""What a forger writes into a true record, sealed again, and why it is refused."""
FOR_ANOTHER = {
    "a platform that leaves its plane": freed,
    "half of the path": shortened,
    "a leg less": dropped,
    "another axis of the turn": put(["1/100", "0", "1"], "motion", "about", 0),
    "another origin": put("1/10", "motion", "origin", 2),
    "a turned home": put("1/1000", "motion", "home", 3),
    "a condition that holds anywhere": put("1", "condition"),
    "a leg of another length": put("4/5", "legs", 0, "rod"),
    "another start": put(0.01, "start", "x"),
    "no start": put(float("nan"), "start", "x"),
    "another goal": put(0.0, "goal", "x"),
    "fewer legs": lambda r: r["observed"].pop(),
    "another question": put(True, "any_mode"),
    "any question": put("x", "any_mode"),
}
"""What is a certificate, but not of the robot."""


@pytest.mark.parametrize("name", FORGERIES)
def test_forgeries_are_refused_with_a_reason(name):
    change, why = FORGERIES[name]
    record = json.loads(of("3rrr_m1"))
    change(record)
    with pytest.raises(checker.PathRejection, match=why):
        checker.verify(sealed(record))


@pytest.mark.some(3)
@pytest.mark.parametrize("name", FOR_ANOTHER)
def test_what_is_true_of_another_robot_is_refused_for_this(name):
    record = json.loads(separated() if "question" in name else of("3rrr_m1"))
    FOR_ANOTHER[name](record)
    with pytest.raises(InvalidCertificate):
        hrsynth.verify(sealed(record), "3rrr_m1")


def test_a_duplicate_key_is_refused(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(of("3rrr_m1").replace('"verdict":', '"verdict": "separated", "verdict":'))
    done = subprocess.run([sys.executable, "-I", str(FILE), str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "refused: a duplicate key\n")


def numbers(record, *keys):
    """Where all numbers of a part of a record are."""
    if isinstance(record, dict | list):
        for key, each in record.items() if isinstance(record, dict) else enumerate(record):
            yield from numbers(each, *keys, key)
    elif isinstance(record, int | float) or (isinstance(record, str) and not set(record) - set("0123456789/-")):
        yield keys


def holds(record):
    """Whether a record of one aspect is true, by floats at five places of each piece."""
    nodes, motion = record["path"], record["motion"]

    def vec(texts):
        return np.array([float(Fraction(x)) for x in texts])

    def value(each, p, R, legs):
        kind, *rest = each
        if kind == "point":
            return rest[0] * p + R @ vec(rest[1]) + vec(rest[2])
        if kind == "leg":
            return rest[1] * legs[rest[0]] + vec(rest[2])
        start, end, axis = (None if part is None else value(part, p, R, legs) for part in rest)
        along = end - start if axis is None else np.cross(axis, end - start)
        return along / np.linalg.norm(along)

    def tree(each, values):
        if isinstance(each, str):
            return values[each] if each in values else float(Fraction(each))
        parts = [tree(part, values) for part in each[1:]]
        return {
            "+": lambda: sum(parts),
            "*": lambda: math.prod(parts),
            "dot": lambda: float(np.dot(*parts)),
            "cross": lambda: np.cross(*parts),
            "det": lambda: float(np.linalg.det(np.array(parts))),
        }[each[0]]()

    sides = set()
    for one, other in pairwise(nodes):
        for t in np.linspace(0, 1, 5):
            shift, turn = ((1 - t) * vec(a) + t * vec(b) for a, b in zip(one, other, strict=True))
            p = vec(motion["origin"]) + sum(s * vec(v) for s, v in zip(shift, motion["along"], strict=True))
            v = sum((s * vec(a) for s, a in zip(turn[1:], motion["about"], strict=True)), np.zeros(3))
            (W, *V), w = vec(motion["home"]), turn[0]
            q = np.array([w * W - v @ V, *(w * np.array(V) + W * v + np.cross(v, V))])
            w, v = q[0] / np.linalg.norm(q), q[1:] / np.linalg.norm(q)
            K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
            R = np.eye(3) + 2 * w * K + 2 * K @ K
            legs = []
            for leg, mode in zip(record["legs"], record["modes"][0], strict=True):
                follows, turned, constant = leg["tip"]
                D = follows * p + R @ vec(turned) + vec(constant) - vec(leg["centre"])
                a, rod = vec(leg["axis"]) / np.linalg.norm(vec(leg["axis"])), float(Fraction(leg["rod"]))
                if leg["kind"] == "rail":
                    legs.append(vec(leg["centre"]) + a * (D @ a + mode * math.sqrt(rod**2 - D @ D + (D @ a) ** 2)))
                    continue
                flat, radius = D - D @ a * a, float(Fraction(leg["radius"]))
                along = (D @ D + radius**2 - rod**2) / 2 / np.linalg.norm(flat)
                aside = mode * math.sqrt(radius**2 - along**2)
                legs.append(vec(leg["centre"]) + (along * flat + aside * np.cross(a, flat)) / np.linalg.norm(flat))
            values = {symbol: value(each, p, R, legs) for symbol, each in record["vectors"].items()}
            origin = values[record["points"][0]]
            values |= {symbol: values[symbol] - origin for symbol in record["points"]}
            sides.add(np.sign(tree(record["condition"], values)))
    return len(sides) == 1 and 0 not in sides


def mutated(name, count):
    """How many records with one number changed are accepted; all of them are true."""
    rng, accepted = random.Random(4), 0
    unread = ("start", "goal", "sha256")
    places = list(numbers({key: each for key, each in json.loads(of(name)).items() if key not in unread}))
    for _ in range(count):
        record = json.loads(of(name))
        inside, key = at(record, *rng.choice(places))
        if isinstance(inside[key], str):
            value = Fraction(inside[key])
            inside[key] = str(
                rng.choice(
                    (
                        Fraction(rng.randint(-99, 99), 100),
                        value * rng.choice((-1, 0, 2, Fraction(101, 100))),
                        value + Fraction(rng.randint(-9, 9), 10 ** rng.randint(1, 12)),
                    )
                )
            )
        else:
            inside[key] = rng.choice((-inside[key], 1 - inside[key], 2, 0))
        for end, node in enumerate((record["path"][0], record["path"][-1])):
            record["ends"][end] = rng.choice((node, node, record["ends"][end]))
        try:
            checker.verify(sealed(record))
        except checker.PathRejection:
            continue
        accepted += 1
        assert holds(record), record
    return accepted


def test_a_true_record_holds_by_floats():
    assert all(holds(json.loads(of(name))) for name in ("3rrr_m1", "orthoglide"))


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["orthoglide", "3rrr_m1"])
def test_a_changed_number_is_refused_or_still_true(name):
    assert 0 < mutated(name, 60) < 60


@pytest.mark.long
def test_thousands_of_changed_numbers_are_refused_or_still_true():
    assert all(0 < mutated(name, 2000) < 2000 for name in ("3rrr_m1", "orthoglide", "delta"))


def spoil(record, rng) -> str:
    """A change that leaves no proof."""
    node = rng.choice(record["path"])
    match rng.randrange(9):
        case 0:
            record["ends"][rng.randrange(2)][0][rng.randrange(2)] = str(Fraction(rng.randint(1, 9), 10**6))
        case 1:
            node[0] = [str(rng.randint(50, 99))] * len(node[0])
        case 2:
            node[1] = ["0"] * len(node[1])
        case 3:
            record["verdict"] = rng.choice(("separated", "proved", None))
        case 4:
            unread = ("robot", "observed", "any_mode", "start", "goal", "sha256")
            del record[rng.choice([key for key in record if key not in unread])]
        case 5:
            record["condition"] = rng.choice(("0", ["+", record["condition"], ["*", "-1", record["condition"]]], [], 1))
        case 6:
            record["modes"][0][rng.randrange(len(record["legs"]))] = rng.choice((0, 2, "1", None, 1.5))
        case 7:
            rng.choice(record["legs"])[rng.choice(("kind", "tip", "centre"))] = rng.choice((None, "x", [], {}, 3))
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
        with pytest.raises(checker.PathRejection):
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
        for found, value in (
            (checker.plus(one, other), x + y),
            (checker.minus(one, other), x - y),
            (checker.times(one, other), x * y),
            (checker.square(one), x * x),
        ):
            assert found[0] <= value * checker.ONE <= found[1]
            assert (
                found[1] - found[0]
                <= 2 * checker.ONE * (1 + abs(a) + abs(b) + b - a) * (1 + abs(c) + abs(d) + d - c) ** 2 * (1 + b - a)
                + 4
            )
        if c * d > 0:
            found = checker.over(one, other)
            assert found[0] <= x / y * checker.ONE <= found[1]
        if a > 0:
            low, high = checker.root(one)
            assert low * low <= x * checker.ONE**2 <= high * high
            assert math.isqrt(checker.ONE) ** 2 == checker.ONE


def test_what_has_no_certificate_says_why():
    crossing = copy.copy(hrsynth.path("3rrr_m1", start="x=0,y=0,phi=0", goal="x=0.02,y=0,phi=5deg"))
    object.__setattr__(crossing, "certified", False)
    with pytest.raises(NoCertificate, match="enclosed away from zero"):
        hrsynth.certificate(crossing)


def test_command_line(tmp_path, capsys):
    path = tmp_path / "c.json"
    assert (
        run_command(["path", "3rrr_m1", "--start", "x=0,y=0,phi=0", "--goal", "x=0.02,y=0", "--certificate", str(path)])
        == 0
    )
    assert f"The certificate is written to {path}." in capsys.readouterr().out
    assert run_command(["verify", str(path), "--robot", "3rrr_m1"]) == 0
    assert capsys.readouterr().out.startswith("accepted: same aspect: ")
    path.write_text(path.read_text().replace("same aspect", "separated"))
    assert run_command(["verify", str(path)]) == 3
