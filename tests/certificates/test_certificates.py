"""Certificates: accepted by one file of plain Python without this package, refused when anything in them is not so."""

from __future__ import annotations

import copy
import json
import random
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from sympy import ZZ
from sympy.polys.matrices import DomainMatrix

import hrsynth
from analysis.modes.ankles import ankle, carried
from analysis.modes.draws import FAMILIES, MEETING, SURFACES, spatial
from analysis.modes.gears import five_bar, linkage
from analysis.modes.laws import draw, needs_msolve
from analysis.modes.test_planar_loops import LINKS, STEPHENSON, on_three_legs
from analysis.modes.test_spheres import NAMED
from certificates.mutations import FALSE, false, means_the_same, scribbled
from families.test_linkages import LISTED, drawn
from hrsynth.analysis.modes.modes import AssemblyModes
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.geometry import build_mechanism
from hrsynth.certificates import verify_certificate as checker
from hrsynth.certificates import verify_ranks
from hrsynth.certificates.modes import of_systems
from hrsynth.cli import run_command
from hrsynth.errors import BadRequest, InvalidCertificate, NoCertificate
from hrsynth.mechanism import Mechanism
from hrsynth.solving.platform.solve import solve
from oracle import Oracle

FILE = Path(checker.__file__)
ROBOTS = {
    "quattro": ("1", "4"),
    "gough_stewart": ("1", "3", "5"),
    "delta": ("1", "2"),
    "quattro_rigid": ("1", "2"),
    "6pus": ("1", "2", "3", "4"),
}
"""Platforms that turn, translate, of two bodies; as many legs as needed, and more."""


@cache
def of(name: str) -> str:
    return json.dumps(hrsynth.certificate(hrsynth.modes(hrsynth.load(name), list(ROBOTS[name]))))


@cache
def ranks(legs: str) -> str:
    return json.dumps(hrsynth.certificate(hrsynth.derive(hrsynth.load("quattro"), legs.split(","))))


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_listed_is_certified(name, tmp_path):
    found = hrsynth.modes(hrsynth.load(name), list(ROBOTS[name]))
    record = json.loads(of(name))
    assert record["real"] == len(found.modes)
    assert record["complex"] == found.found.complex
    assert hrsynth.verify(record, hrsynth.load(name)).startswith(f"{len(found.modes)} real of {found.found.complex}")
    path = tmp_path / "c.json"
    path.write_text(json.dumps(record))
    done = subprocess.run([sys.executable, "-I", str(FILE), str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("accepted: ")


WITHOUT = {"two bodies, second circle and slide parallel"}
"""Families with a curve of zeros at half-angle tangents i and −i."""
LONGER = {
    "spatial, six spheres",
    "spatial, three planes and three spheres",
    "spatial, six planes",
    "spatial, a pivot and three spheres",
    "spatial, two circles and two spheres",
    "spatial, a line and four spheres",
}


NEEDED = {
    name: [mark for mark, names in ((pytest.mark.slow, LONGER), (needs_msolve, SURFACES)) if name in names]
    for name in sorted(FAMILIES | MEETING | SURFACES)
    if "planar" not in name
}


@pytest.mark.some(2, 8)
@pytest.mark.parametrize("name", [pytest.param(name, marks=marks) for name, marks in NEEDED.items()])
def test_random_platforms(name):
    """The checker's bound, which trusts no resultant, is the engine's count."""
    system, _ = draw(name, 1)
    found = solve(system)
    if name in WITHOUT:
        with pytest.raises(checker.CertificateRejection, match="no bound of their"):
            of_systems(found, {})
        return
    record = of_systems(found, {})
    assert (record["real"], record["complex"]) == (len(found.modes), found.complex)


def displaced(record, mechanism, box) -> np.ndarray:
    """The poses (links, 4, 4) of a box's links."""
    found = []
    for link in mechanism.links:
        D = np.array([[float(Fraction(x)) for x in row] for row in box["links"][link]])
        D[:, 3] *= mechanism.length
        found.append(np.vstack([D, [0, 0, 0, 1]]) @ mechanism.links[link].pose)
    return np.array(found)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["quattro", "gough_stewart", "delta"])
def test_links_are_told_where_the_robot_closes(name):
    """Joints by screws, and the watched directions, at as many modes as are told to be assembled; nowhere else."""
    found = hrsynth.modes(hrsynth.load(name), list(ROBOTS[name]))
    record, mechanism = json.loads(of(name)), found.setup.mechanism
    boxes = [box for system in record["systems"] for box in system["boxes"] if "links" in box]
    assert len(boxes) == sum(mode.assembly in ("yes", "beyond limits") for mode in found.modes) > 0
    assert checker.verify(record).endswith(f"; the robot closes at {len(boxes)} of the real ones, to 1e-9")
    oracle, watched = Oracle(mechanism), found.setup.samples.observation_model.observations
    states = [displaced(record, mechanism, box) for box in boxes]
    assert max(oracle.error(state) for state in states) < 1e-8
    seen = [oracle.directions(state, watched) for state in states]
    assert max(np.abs(each - seen[0]).max() for each in seen) < 1e-8
    if len(boxes) > 1:
        boxes[0]["links"], boxes[1]["links"] = boxes[1]["links"], boxes[0]["links"]
        record["sha256"] = checker.digest(record)
        with pytest.raises(checker.CertificateRejection, match="not on its link"):
            checker.verify(record)


def test_driven_joints_are_the_same_at_all_modes():
    record = hrsynth.certificate(hrsynth.modes(hrsynth.load("3rps"), real=True))
    assert checker.verify(record).endswith("; the robot closes at 8 of the real ones, to 1e-9")
    for row in record["assembly"]["held"]:
        assert len(row[3]) == 3
    held = record["assembly"]["held"][-1]
    held[3][2] = str(Fraction(held[3][2]) + Fraction(1, 10**6))
    record["sha256"] = checker.digest(record)
    with pytest.raises(checker.CertificateRejection, match="another measurement"):
        checker.verify(record)


def test_another_robot_is_told():
    record = json.loads(of("quattro"))
    with pytest.raises(InvalidCertificate, match="not for"):
        hrsynth.verify(record, scaled("quattro"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quattro", "delta"])
def test_a_certificate_of_the_real_robot_is_about_it(name: str):
    record = json.loads(json.dumps(hrsynth.certificate(hrsynth.modes(name, real=True))))
    assert "no other" in hrsynth.verify(record, name)


def scaled(name: str) -> Mechanism:
    """A robot that is a hundredth larger."""
    robot = hrsynth.load(name)
    links = {
        key: replace(link, pose=np.vstack([np.hstack([link.pose[:3, :3], 1.01 * link.pose[:3, 3:]]), link.pose[3:]]))
        for key, link in robot.links.items()
    }
    joints = {key: replace(joint, point=1.01 * joint.point) for key, joint in robot.joints.items()}
    return replace(robot, links=links, joints=joints)


@pytest.mark.some(1)
@pytest.mark.parametrize("legs", ["1,4", "1,2", "1"])
def test_ranks_are_those_of_an_independent_elimination(legs):
    record = json.loads(ranks(legs))
    for stack in record["stacks"]:
        rows = [row for key in stack["of"] for row in record["matrices"][key]]
        assert DomainMatrix(rows, (len(rows), len(rows[0])), ZZ).to_field().rank() == stack["rank"]
    seen = {tuple(stack["of"]): stack["rank"] for stack in record["stacks"]}
    lost = seen["A", "Y", "X"] - seen["A", "Y"]
    derived = hrsynth.derive(hrsynth.load("quattro"), legs.split(","))
    assert derived.dof - lost == derived.exact.rank
    assert hrsynth.verify(record).endswith(f": the legs observe {derived.exact.rank} of 4 dof at this instance")


def attacked(text: str, count: int, seed: int) -> Counter[str]:
    """How many false certificates of each kind were refused; none is accepted."""
    rng, told = random.Random(seed), Counter()
    record = json.loads(text)
    for _ in range(count):
        name, changed = false(record, rng)
        with pytest.raises(checker.CertificateRejection):
            print(name, checker.verify(changed))
        told[name] += 1
    return told


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["quattro_rigid", "delta", "6pus", "gough_stewart"])
def test_false_certificates_are_refused(name):
    assert sum(attacked(of(name), 40, 1).values()) == 40


@pytest.mark.slow
def test_every_kind_of_falsehood_is_tried():
    told = attacked(of("gough_stewart"), 300, 2)
    assert set(told) == {change.__name__ for change in FALSE}


def test_a_changed_text_is_refused():
    rng = random.Random(3)
    for text in (of("delta"), ranks("1,2")):
        for _ in range(200):
            changed = scribbled(text, rng)
            if means_the_same(text, changed):
                continue
            with pytest.raises((checker.CertificateRejection, verify_ranks.RankRejection, ValueError)):
                (verify_ranks if "stacks" in text else checker).verify(json.loads(changed))


@cache
def alone(kinds: str) -> str:
    """A random platform whose tips are on such curves and surfaces, as many as needed."""
    drawn = spatial(np.random.default_rng(1), kinds)
    return json.dumps(of_systems(solve(drawn.system, near=False), {}))


@pytest.mark.some(1)
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("kinds", "count"),
    [
        ("PSSS", 12),
        pytest.param("CCSS", 20, marks=pytest.mark.long),
        *(pytest.param(kinds, 500, marks=pytest.mark.long) for kinds in ("CCSS", "EEEEEE", "LLC")),
    ],
)
def test_false_certificates_with_zeros_at_infinity_or_of_poses_are_refused(kinds, count):
    assert sum(attacked(alone(kinds), count, 5).values()) == count


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count", "far"), [("gough_stewart", 28, 12), ("quattro", 4, 0), ("i4l", 2, 2)])
def test_robots_with_motors_held(name, count, far):
    found = hrsynth.modes(hrsynth.load(name), real=True)
    told = checker.verify(hrsynth.certificate(found))
    assert told.startswith(f"{len(found.modes)} real of {count} complex poses, and no other")
    assert (f"({far} solutions are farther)" in told) == (far > 0)


def driven(name: str) -> AssemblyModes:
    """A linkage with one joint held."""
    linkage, zero, tilt = drawn(name, 1)
    return hrsynth.modes(linkage.mechanism(name, zero, tilt), real=True)


NATURAL: dict[str, Callable[[], AssemblyModes]] = {
    "gears against each other": lambda: hrsynth.modes(five_bar(-1.0)[0], "1"),
    "three turns to two": lambda: hrsynth.modes(five_bar(1.5, 2)[0], "1"),
    "more than needed": lambda: hrsynth.modes(five_bar(-1.0)[0]),
    "six-bar": lambda: hrsynth.modes(linkage(STEPHENSON, LINKS, "coupler", "j6"), real=True),
    "two bodies": lambda: hrsynth.modes(linkage(STEPHENSON, LINKS, "c", "j0"), real=True),
    "a tool on a plate on three legs": lambda: hrsynth.modes(on_three_legs(), real=True),
    "a slide on the platform": lambda: hrsynth.modes(
        build_mechanism(parse("(Rz!-Rz*-Ph)+(Rz!-Rz-Rz*)+(Rz!-Rz*-Rz)")), real=True
    ),
    "a platform that is a point": lambda: hrsynth.modes("prrrp_parallel_point", real=True),
    "an ankle": lambda: hrsynth.modes(ankle("SPU", 1, offset=0.05)[0], real=True),
    "a rod watched": lambda: hrsynth.modes(ankle("RSU", 1, offset=0.05)[0], "1"),
    "both rods watched": lambda: hrsynth.modes(ankle("RUS", 1, offset=0.05)[0]),
    "a turn and a slide": lambda: hrsynth.modes(carried("RP", 1), real=True),
    "lines through three points": lambda: hrsynth.modes("3prp", real=True),
    **{name: partial(driven, name) for name in LISTED},
}


@pytest.mark.some(1, 1)
@pytest.mark.parametrize("name", NATURAL)
def test_lists_are_certified_in_natural_coordinates(name: str):
    found = NATURAL[name]()
    told = hrsynth.verify(json.loads(json.dumps(hrsynth.certificate(found))), found.setup.robot)
    assert told.startswith(f"{len(found.modes)} real pose{'s' * (len(found.modes) > 1)}, and no other among ")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["AABBCD on ABCDEF", "AABCDE on ABCCDE"])
def test_six_legged_pods_whose_rods_share_balls(name):
    """Their solutions at infinity are multiple; moved within rounding they are far, single and enclosed."""
    maker, count = NAMED[name]
    found = solve(maker(np.random.default_rng(0)).system, near=False)
    told = checker.verify(of_systems(found, {}))
    assert told.startswith(f"{len(found.modes)} real of {count} complex poses")
    assert told.endswith(f"({40 - count} solutions are farther)")


@pytest.mark.long
def test_thousands_of_false_certificates():
    told: Counter[str] = Counter()
    for seed, text in enumerate(map(of, ROBOTS)):
        told += attacked(text, 1000, seed)
    assert sum(told.values()) == 1000 * len(ROBOTS)


@pytest.mark.slow
def test_false_ranks_are_refused():
    rng = random.Random(4)
    record = json.loads(ranks("1,2"))
    for _ in range(60):
        changed = copy.deepcopy(record)
        stack = rng.choice(changed["stacks"])
        match rng.randrange(5):
            case 0:
                stack["rank"] += rng.choice((-1, 1))
            case 1:
                stack["kernel"].pop()
            case 2:
                stack["kernel"][0] = stack["kernel"][-1] if len(stack["kernel"]) > 1 else [0] * len(stack["kernel"][0])
            case 3:
                stack["rows"][0] = stack["rows"][-1]
            case 4:
                vector = rng.choice(stack["kernel"])
                rows = [row for key in stack["of"] for row in changed["matrices"][key]]
                used = [j for j in range(len(vector)) if any(row[j] for row in rows)]
                vector[rng.choice(used)] += 1
        changed["sha256"] = verify_ranks.digest(changed)
        with pytest.raises(verify_ranks.RankRejection):
            print(verify_ranks.verify(changed))


def test_freedoms_are_counted_only_where_the_loops_rank_is_told():
    """Without rank A all joints' rates would count as the platform's freedoms."""
    record = json.loads(ranks("1,2"))
    assert "of 4 dof" in hrsynth.verify(record, "quattro")
    record["stacks"] = [each for each in record["stacks"] if each["of"] != ["A"]]
    record["sha256"] = verify_ranks.digest(record)
    assert "freedoms" not in hrsynth.verify(record)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pose_at_infinity_is_never_lost(sign):
    """A bar of length 1 from a pivot, its end on a circle: two poses, one at t = 0 or (sign −1) at t = ∞."""
    a, b = ([sign * Fraction(x, 5) for x in each] for each in ((-7, 4, 0), (-4, -7, 0)))
    pivot = checker.running(("point", [[Fraction(0)] * 3]), None, 1)
    end = checker.running(("circle", [[Fraction(2), Fraction(0), Fraction(0)], a, b]), 0, 1)
    equations = [checker.integral(checker.apart(pivot, end, Fraction(1)))]
    system = {"bound": {"kind": "rank", "groups": [[[0], 2, 0]]}}
    if sign == 1:
        assert checker.rank(equations, [True], system) == 2
    else:
        with pytest.raises(checker.CertificateRejection):
            checker.rank(equations, [True], system)


def test_command_line(tmp_path, capsys):
    path = tmp_path / "c.json"
    assert run_command(["modes", "delta", "--certificate", str(path)]) == 0
    assert f"The certificate is written to {path}." in capsys.readouterr().out
    assert run_command(["verify", str(path)]) == 0
    assert capsys.readouterr().out == (
        "accepted: 2 real of 2 complex poses, and no other among poses with the rotation of this one "
        "(more than needed fits); the robot closes at 2 of the real ones, to 1e-9\n"
    )
    assert run_command(["verify", str(path), "--robot", "delta", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["accepted"] is True
    assert run_command(["verify", str(path), "--robot", "orthoglide"]) == 3
    path.write_text(path.read_text().replace('"real": 2', '"real": 1'))
    assert run_command(["verify", str(path)]) == 3
    assert "refused" in capsys.readouterr().err
    assert run_command(["modes", "delta", "--certificate", str(tmp_path / "c.txt")]) == 2
    assert run_command(["modes", "hexa", "--observe", "1,2", "--certificate", str(tmp_path / "d.json")]) == 3
    assert not (tmp_path / "d.json").exists()


@pytest.mark.parametrize("text", ["", "[]", "{}", "null", '{"format": "hrsynth-certificate-1"}', "[" * 100_000])
def test_no_certificate_at_all(text, tmp_path):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises((InvalidCertificate, BadRequest)):
        hrsynth.verify(path)


def test_no_certificate_without_a_proof():
    with pytest.raises(NoCertificate, match="not proved complete"):
        hrsynth.certificate(hrsynth.modes(hrsynth.load("hexa"), ["1", "2"]))
    with pytest.raises(BadRequest, match="certificate"):
        hrsynth.certificate(hrsynth.check(hrsynth.load("3rpr_m1")))
