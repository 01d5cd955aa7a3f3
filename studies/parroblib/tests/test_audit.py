"""Published tables compared: what is read, what is computed, how disagreements are settled."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import hrsynth
from hrsynth.errors import BadRequest
from parroblib.__main__ import main
from parroblib.closing import BatchState, batch, close, forward
from parroblib.exact import by_legs, exact
from parroblib.freedoms import freedoms, freedoms_left
from parroblib.motions import dimensions, factors
from parroblib.prime_field import NotExact
from parroblib.run import audit
from parroblib.study import StudyCase, motor_choices, study
from parroblib.tables import PublishedRobot, cell, read
from parroblib.tests.small_tables import write

REAL = Path(os.environ.get("HRSYNTH_PUBLISHED", Path(__file__).resolve().parents[4] / "shared" / "parroblib"))
"""Where the published tables may lie; tests that need them are skipped without."""


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("published") / "tables")


def robot(tables: Path, name: str) -> PublishedRobot:
    return next(each for each in read(tables).robots if each.name == name)


def dof_of(legs: np.ndarray) -> int:
    """Freedoms of a platform by one rank: rates q̇ and a twist V with J_i q̇_i = V, less the idle rates."""
    n, m, _ = legs.shape
    A = np.zeros((6 * n, n * m + 6))
    for i in range(n):
        A[6 * i : 6 * i + 6, i * m : (i + 1) * m] = legs[i].T
        A[6 * i : 6 * i + 6, -6:] = -np.eye(6)
    idle = sum(m - np.linalg.matrix_rank(each) for each in legs)
    return int(n * m + 6 - np.linalg.matrix_rank(A) - idle)


def random_legs(random: np.random.Generator) -> np.ndarray:
    """Twists of legs that share some freedoms, some of them twice in a leg."""
    n, m, shared = random.integers(2, 5), random.integers(3, 7), random.integers(0, 4)
    legs = random.standard_normal((n, m, 6))
    legs[:, :shared] = random.standard_normal((m, 6))[:shared]
    legs[:, -1] = np.where(random.random() < 0.3, legs[:, 0], legs[:, -1])
    return legs


def test_freedoms_are_those_of_the_closed_loops_in_any_frame():
    random = np.random.default_rng(0)
    for _ in range(60):
        legs = random_legs(random)
        mixed = np.einsum("ij,nmj->nmi", random.standard_normal((6, 6)), legs)
        found = freedoms(legs[None]), freedoms(mixed[None])
        assert [int(each.dof[0]) for each in found] == [dof_of(legs), dof_of(legs)]
        driven = np.zeros((1, *legs.shape[:2]), dtype=bool)
        driven[0, :, 0] = True
        assert int(freedoms_left(legs[None], driven, np.ones(3))[0][0]) == dof_of(legs * ~driven[0, ..., None])


def test_screws_of_joints_and_dimensions_are_rates_of_the_ends(tables: Path):
    random = np.random.default_rng(1)
    for each in read(tables).robots:
        parts = factors(each)
        of = batch([parts], len(each.chain.joints))
        lengths = np.append(random.uniform(0.3, 1.0, (1, of.count)), [[0.0]], axis=1)
        at = BatchState(
            lengths, random.uniform(-1, 1, (1, each.legs, of.joints)), np.zeros((1, 1, 3)), np.eye(3)[None, None]
        )
        p, R, joints, sizes = forward(of, at)
        step = 1e-6
        for k in range(of.joints + of.count):
            q, more = at.q.copy(), lengths.copy()
            if k < of.joints:
                q[:, :, k] += step
            else:
                more[:, k - of.joints] += step
            p_next, R_next, _, _ = forward(of, BatchState(more, q, at.p, at.R))
            screw = joints[:, :, k] if k < of.joints else sizes[:, :, k - of.joints]
            rate = screw[..., :3] + np.cross(screw[..., 3:], p)
            assert np.allclose((p_next - p) / step, rate, atol=1e-4)
            turned = np.einsum("bnij,bnkj->bnik", R_next - R, R) / step
            assert np.allclose(turned[..., 2, 1], screw[..., 3], atol=1e-4)
            assert np.allclose(turned[..., 0, 2], screw[..., 4], atol=1e-4)


def test_what_is_known_of_known_robots_is_found(tables: Path):
    found = {
        case.robot.name: each
        for case, each in study([StudyCase(each, each.drives[0].angles) for each in read(tables).robots], 3)
    }
    assert all(each.moves for each in found.values())
    assert {name: each.motion for name, each in found.items()} == {
        "P3RRR1G1P1": (2, 1),
        "P3PRP1G1P1": (2, 1),
        "P3PRRR1G2P2": (3, 0),
        "P3RRPRR1G1P1": (3, 1),
        "P6RRPRRR1G2P1": (3, 3),
        "P6RRPRRR1G6P1": (3, 3),
    }
    losses = {
        name: [
            each.motors[((joint,),) * len(next(iter(each.motors)))].left
            for joint in range(len(next(r for r in read(tables).robots if r.name == name).chain.joints))
        ]
        for name, each in found.items()
    }
    assert losses["P3RRR1G1P1"] == [0, 0, 0]
    assert losses["P3PRP1G1P1"][1] == 2  # each of them turns as the platform does
    assert losses["P3PRRR1G2P2"][0] == 1  # three slides in one plane
    assert losses["P6RRPRRR1G2P1"][2] == 1  # two regular hexagons are singular (O. Ma, J. Angeles, ICRA 1991)
    assert losses["P6RRPRRR1G6P1"][2] == 0  # another Gough-Stewart platform
    assert found["P3RRPRR1G1P1"].finite
    assert min(losses["P3RRPRR1G1P1"]) >= 1  # four freedoms, three motors


def test_what_watched_legs_show_is_what_the_engine_says(tables: Path):
    """The words of the catalog for the same legs: 3(Rz*-Rz-Rz) needs three, 6-UPS three of six (tests of `legs`)."""
    found = {
        case.robot.name: each.watched
        for case, each in study([StudyCase(each, each.drives[0].angles) for each in read(tables).robots], 4)
    }
    assert {name: (each.seen, each.fewest) for name, each in found.items()} == {
        "P3RRR1G1P1": (3, 3),
        "P3PRP1G1P1": (1, 1),
        "P3PRRR1G2P2": (3, 3),
        "P3RRPRR1G1P1": (3, 3),
        "P6RRPRRR1G2P1": (6, 3),
        "P6RRPRRR1G6P1": (6, 3),
    }
    assert found["P3RRR1G1P1"].fewest == min(map(len, hrsynth.legs("3rrr_m1").minimal))


@pytest.mark.slow
def test_numbers_and_ranks_modulo_primes_agree(tables: Path):
    compared = 0
    for case, found in study([StudyCase(each, each.drives[0].angles) for each in read(tables).robots], 5):
        try:
            first, second = exact(case.robot, found.letters, motor_choices(case.robot), 1)
        except NotExact:
            continue
        compared += 1
        assert first.said == second.said
        assert (first.dof, first.translations, first.idle) == (sum(found.motion), found.motion[0], found.idle)
        for driven, (all_left, stated) in first.left.items():
            assert (all_left, stated) >= (found.motors[driven].left, found.motors[driven].stated)
            if not first.orbit:
                assert (all_left, stated) == (found.motors[driven].left, found.motors[driven].stated)
    assert compared >= 4
    assert by_legs(robot(tables, "P3RRPRR1G1P1"), "a", 0) == (3, 1)
    assert by_legs(robot(tables, "P3PRRR1G2P2"), "a", 0) == (3, 0)


def test_a_closed_robot_is_closed(tables: Path):
    each = robot(tables, "P3PRRR1G2P2")
    parts = factors(each)
    of = batch([parts] * 8, 4)
    random = np.random.default_rng(2)
    start = BatchState(
        np.append(random.uniform(0.3, 1.0, (8, of.count)), np.zeros((8, 1)), axis=1),
        random.uniform(-1, 1, (8, 3, 4)),
        random.uniform(-0.5, 0.5, (8, 1, 3)),
        np.tile(np.eye(3), (8, 1, 1, 1)),
    )
    state, closed = close(of, start, np.zeros((8, 1, 3)), np.ones((8, 1, 3)), sized=True)
    assert closed.any()
    p, R, _, _ = forward(of, state)
    assert np.abs(p - state.p)[closed].max() < 1e-11
    assert np.abs(R - np.eye(3))[closed].max() < 1e-11
    assert len(dimensions(parts)) == of.count


def test_every_disagreement_is_told_and_settled(tables: Path):
    found = audit(tables).to_dict()
    assert (found["rows"], found["compared"], found["defects"], found["without_chain"]) == (6, 6, [], [])
    told = {(each["robot"], each["kind"]): (each["theirs"], each["ours"]) for each in found["disagreements"]}
    assert told == {
        ("P3PRP1G1P1A2", "loses more"): ("0", "2"),
        ("P3RRPRR1G1P1", "more dof"): ("3T0R", "3T1R"),
        ("P3RRPRR1G1P1A1", "dof that are not counted"): ("0", "1 (0 stated)"),
    }
    assert {each["settled"] for each in found["disagreements"]} <= {"modulo primes", "modulo primes, leg by leg"}
    assert all(":" in each["at"] for each in found["disagreements"])
    assert found["agree"] == 4


def test_as_many_freedoms_of_another_kind_are_no_agreement(tmp_path: Path):
    """Three freedoms of a planar robot are not one translation and two turns."""
    folder = write(tmp_path / "other")
    for path in (folder / "robots").iterdir():
        path.unlink()
    (folder / "robots" / "sym_1T2R_list.csv").write_text("Name\nP3RRR1G1P1;S3RRR1\n")
    (found,) = audit(folder).disagreements
    assert (found["kind"], found["theirs"], found["ours"]) == ("not found to move so", "1T2R", "2T1R")


def test_tables_with_holes_are_read(tables: Path, tmp_path: Path):
    folder = write(tmp_path / "holes")
    chains = folder / "chains" / "S3RRR.csv"
    text = chains.read_text()
    chains.write_text(text.replace("a3", "a3?") + "S3RRRx\n" + "\n" + "S3RRR2;R;0\n")
    motors = folder / "robots" / "actuation.csv"
    rows = motors.read_text().splitlines()
    motors.write_text(
        "\n".join(
            [
                "sym_3T0R;P3PRRR1G2P2A1;1;0",
                "nonsense",
                rows[2].removesuffix(";0;") + ";two;",
                *rows[1:3],
                "",
                rows[3].rsplit(";", 2)[0] + ";;",
            ]
        )
    )
    for path in (folder / "synthesis").iterdir():
        path.unlink()
    with (folder / "robots" / "sym_3T0R_list.csv").open("a") as file:
        file.write("P3PRRR1G2\nP3PRRR1G11P2\n\nP3PRRR9V2G1P1;S4PRRR9V2;?\n")
    found = audit(folder)
    where = [f"{Path(each.file).name}:{each.line}" for each in found.defects]
    assert Counter(where) == Counter(
        [
            "S3RRR.csv:3",
            "S3RRR.csv:4",
            "S3RRR.csv:6",
            "actuation.csv:1",
            "actuation.csv:2",
            "actuation.csv:3",
            "sym_3T0R_list.csv:4",
            "sym_3T0R_list.csv:5",
        ]
    )
    assert {name for _, name, _ in found.no_chain} == {"P3RRR1G1P1", "P3PRRR9V2G1P1"}
    assert [each["theirs"] for each in found.records[-1]["choices"]] == []
    record = next(each for each in found.records if each["robot"] == "P3PRRR1G2P2")
    assert (record["choices"][0]["theirs"], record["working"]["theirs"]) == (None, None)
    assert not record["disagreements"]
    assert found.groups[0]["counts"] == 0


NINES = "9" * 5000
LIST, CHAIN, MOTORS, TRIED = (
    "robots/sym_2T1R_list.csv",
    "chains/S3RRR.csv",
    "robots/actuation.csv",
    "synthesis/2T1R.csv",
)
DRIVEN = "sym_2T1R;P3RRR1G1P1A2;0;1;0;0;1;0;0;1;0;"


@pytest.mark.parametrize(
    ("table", "old", "new", "line", "said"),
    [
        (LIST, None, "P3RRR1G\u00b2P1;S3RRR1", 4, "not the name of a robot"),
        (LIST, None, "P\u0663RRR1G1P1", 4, "not the name of a robot"),
        (LIST, None, "P0RRR1G1P1;S3RRR1", 4, "not the name of a robot"),
        (LIST, None, f"P3RRR1G{NINES}P1", 4, "not the name of a robot"),
        (LIST, None, "\0\0;x", 4, r"got '\x00\x00'"),
        (LIST, None, b"x\xe4;", 4, "not UTF-8"),
        (LIST, None, "P3RRR1G1P1;S3RRR1", 4, "repeated: first in sym_2T1R_list.csv:2"),
        (LIST, None, "P3RRR1G1P2;S3PRP1", 4, "the chain of P3RRR1G1P2 is not that of its name"),
        (LIST, "Name;Chain;Joints\n", "", 1, "a row where a head line should be"),
        (LIST, "P3", "x\u2028y\nP3", 2, "not the name of a robot"),
        (CHAIN, "a3", "pi/0", 3, "neither a number, a multiple of pi nor a name"),
        (CHAIN, "a3", "1_000", 3, "neither a number, a multiple of pi nor a name"),
        (CHAIN, "a3", "1e300", 3, "a cell is larger than"),
        (CHAIN, "a3", "-1e-300", 3, "nearer to zero"),
        (CHAIN, "a3", "9" * 400 + "*pi", 3, "a cell is larger than"),
        (CHAIN, "a3", "alpha3", 3, "joint 3: alpha3 is no length, but in a"),
        (CHAIN, "R;0;0;0;a3", "R;a3;0;0;a3", 3, "joint 3: a3 is no angle, but in beta"),
        (CHAIN, "a3", "q3", 3, "joint 3: q3 is no length, but in a"),
        (CHAIN, "q2", "q9", 3, "joint 2: theta of R is not coordinate q2"),
        (
            CHAIN,
            None,
            "S3RRR1;R;0;0;0;0;q1;d1;0;R;0;0;0;a2;q2;d2;0;R;0;0;0;a3;q3;d3;0",
            4,
            "repeated: first in S3RRR.csv:3",
        ),
        (MOTORS, None, DRIVEN + "\u00b2;", 8, "the loss of rank is not a whole number"),
        (MOTORS, None, DRIVEN + NINES, 8, "the loss of rank is not a whole number"),
        (MOTORS, None, DRIVEN.replace("A2", "A" + NINES), 8, "no choice of motors"),
        (MOTORS, None, DRIVEN.replace(";0;1;0;", ";;1;0;", 1), 8, "not 3 × 3 joints"),
        (MOTORS, None, DRIVEN.replace("A2", "A1") + "0;", 8, "repeated: first in actuation.csv:1"),
        (MOTORS, None, DRIVEN.replace("G1P1", "G2P1") + "0;", 8, "of a robot that its group does not list"),
        (TRIED, None, "S3RRR1;3;2;1;\u00b2;2", 4, "not a whole number"),
        (TRIED, None, "S3RRR1;3;2;1;0;two", 4, "not a whole number"),
        (TRIED, None, f"S3RRR1;3;2;1;0;{NINES}", 4, "not a whole number"),
        (TRIED, None, "S3RRR1;3;1;1;0;3", 4, "repeated: first in 2T1R.csv:2"),
    ],
    ids=lambda value: ascii(value)[:24] if isinstance(value, str | bytes) else None,
)
def test_rows_that_cannot_be_read_are_told_in_one_line(
    tmp_path: Path, table: str, old: str | None, new: str | bytes, line: int, said: str
):
    """Each with its file and line; all other rows are read."""
    folder = write(tmp_path / "tables")
    path = folder / table
    text = path.read_text()
    content = (
        text.encode() + (new if isinstance(new, bytes) else new.encode())
        if old is None
        else text.replace(old, str(new), 1).encode()
    )
    path.write_bytes(content)
    found = read(folder)
    (defect,) = [each for each in found.defects if each.file == str(path)]
    assert (defect.line, said in str(defect)) == (line, True), str(defect)
    assert len(str(defect)) < 300 + len(str(path))
    assert str(defect).isprintable()
    assert len(found.robots) + len(found.no_chain) == 6 - (old == "Name;Chain;Joints\n")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("robots/sym_9T9R_list.csv", b"Name\nP3RRR1G1P1\n", "the name gives no group"),
        ("robots/sym_0T0R_list.csv", b"Name\nP3RRR1G1P1\n", "the name gives no group"),
        ("robots/sym_13T0R_list.csv", b"Name\nP3RRR1G1P1\n", "the name gives no group"),
        ("robots/sym_1T1R_list.csv", b"", "no rows"),
        ("robots/sym_1T1R_list.csv", "Name\nP3RRR1G1P1\n".encode("utf-16"), "cannot be read: not UTF-8"),
        ("robots/actuation.csv", None, "cannot be read: Is a directory"),
        ("chains/S3RRR.csv", b"Name\n;Type\n", "no rows"),
        ("synthesis/other.csv", b"Chain\n", "the name gives no group"),
    ],
)
def test_tables_that_cannot_be_read_are_told_in_one_line(tmp_path: Path, name: str, content: bytes | None, said: str):
    folder = write(tmp_path / "tables")
    path = folder / name
    if content is None:
        path.unlink()
        path.mkdir()
    else:
        path.write_bytes(content)
    (defect,) = read(folder).defects
    assert (defect.file, said in str(defect)) == (str(path), True)


def test_nothing_need_have_been_tried(tmp_path: Path):
    folder = write(tmp_path / "tables")
    (folder / TRIED).write_text("Chain;Legs;G;P;Status;Number\n")
    (folder / MOTORS).write_text("")
    found = read(folder)
    assert (found.defects, [each.working for each in found.robots if each.group == "2T1R"]) == ([], [None, None])


def test_counts_are_those_of_as_many_legs(tmp_path: Path):
    """What was tried with other numbers of legs says nothing of a robot."""
    folder = write(tmp_path / "tables")
    (folder / TRIED).write_text("Chain;Legs;G;P;Status;Number\nS3RRR1;4;1;1;0;1\nS3RRR1;3;1;1;0;2\n")
    assert robot(folder, "P3RRR1G1P1").working == 2


@pytest.mark.parametrize(
    ("text", "value"),
    [("pi/2", np.pi / 2), ("-pi", -np.pi), ("2*pi/3", 2 * np.pi / 3), ("0.25", 0.25), ("alpha2", "alpha2")],
)
def test_cells(text: str, value: float | str):
    assert cell(text) == value


@pytest.mark.parametrize("text", ["", "nan", "pi2", "a", "1/0", "pi/0", "1_0", "\u0663", "1e7", "1e-7"])
def test_what_is_no_cell(text: str):
    with pytest.raises(ValueError, match="cell"):
        cell(text)


def test_a_broken_audit_goes_on_with_the_same_bytes(tables: Path, tmp_path: Path):
    whole, broken = tmp_path / "whole.jsonl", tmp_path / "broken.jsonl"
    audit(tables, kept=whole, only="2T1R")
    lines = whole.read_text().splitlines(keepends=True)
    broken.write_text("".join(lines[:2]) + lines[2][:20])
    told: list[tuple[int, int]] = []
    audit(tables, kept=broken, only="2T1R", tell=lambda _, done, total: told.append((done, total)))
    assert broken.read_bytes() == whole.read_bytes()
    assert told[-1] == (2, 2)
    with pytest.raises(BadRequest, match="another study"):
        audit(tables, kept=whole, only="2T1R", seed=1)


def test_the_command_line(tables: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["audit", str(tables), "--only", "2T1R", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["rows"], data["agree"]) == (2, 1)
    assert main(["audit", str(tables), "--sample", "1"]) == 0
    assert "rows compared" in capsys.readouterr().out
    broken = write(tmp_path / "broken")
    with (broken / "robots" / "sym_2T1R_list.csv").open("a") as file:
        file.write("\nP3XYZ;S3RRR1\n")
    assert main(["audit", str(broken), "--only", "2T1R"]) == 0
    out, err = capsys.readouterr()
    assert re.search(r"^parroblib: .*sym_2T1R_list.csv:\d+: not the name of a robot: got P3XYZ", err, re.MULTILINE)
    assert out.splitlines()[-3].startswith("left out: 1 line of the tables, ")
    for arguments, said in (
        ([str(tmp_path / "none")], "no folder of tables"),
        ([str(tmp_path)], "no table of robots"),
        ([str(tables), "--only", "4T"], "no group of these tables"),
        ([str(tables), "-o", "x.csv"], "one per line"),
    ):
        assert main(["audit", *arguments]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(not REAL.is_dir(), reason="the published tables are not here")
def test_published_tables():
    """Robots of the stated motion agree in nearly all losses of rank; those of planar robots are elementary."""
    planar = audit(REAL, only="2T1R").to_dict()
    assert {(each["robot"], each["ours"]) for each in planar["disagreements"] if each["kind"] == "loses more"} == {
        ("P3PRP1G1P1A2", "2"),
        ("P3RPP1G1P1A1", "2"),
    }
    for group, part in (("3T2R", 0.9), ("3T3R", 0.9)):
        found = audit(REAL, only=group, sample=64).groups[0]
        stated = found["choices"] - found["choices_not_stated"] - found["choices_not_compared"]
        assert found["choices_agree"] > part * stated
        assert found["moves_as_stated"] == found["robots"]
