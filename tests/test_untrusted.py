"""Files of strangers, by all doors: nothing in them runs, nothing elsewhere is read, what they unpack to is limited."""

from __future__ import annotations

import ast
import contextlib
import gzip
import io
import json
import os
import pickle
import re
import sqlite3
import struct
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hrsynth import certificate, modes, untrusted
from hrsynth import certificates as certificates_
from hrsynth.catalog import query
from hrsynth.catalog import store as stores
from hrsynth.catalog.jsonl import format_head, parse_record
from hrsynth.catalog.store import store
from hrsynth.certificates import verify, verify_certificate, verify_path, verify_ranks
from hrsynth.cli import run_command
from hrsynth.description import save
from hrsynth.description.formats.gepetto import settings
from hrsynth.description.formats.gepetto.settings import LARGEST_BESIDE
from hrsynth.description.meshes import locate_mesh, read_robot_meshes
from hrsynth.errors import BadRequest, HrsynthError, InvalidCertificate
from hrsynth.mechanism.model import make_fresh_name
from hrsynth.untrusted import ARCHIVE_FILES_MAX, UNPACKED_MAX_BYTES
from patience import allow

ROOT = Path(__file__).resolve().parent.parent
LINKS = '<link name="base"/><link name="crank">{}</link><link name="bar"/><link name="rocker"/>'
JOINT = (
    '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz="{}"/><axis xyz="0 1 0"/>'
    "</joint>"
)
LOOP = (
    '<loop name="d" type="revolute"><predecessor link="rocker"><origin xyz="0 0 1"/></predecessor>'
    '<successor link="bar"><origin xyz="2 0 0"/></successor><axis xyz="0 1 0"/></loop>'
    '<transmission name="m"><joint name="a"/></transmission><hrsynth><platform link="bar"/></hrsynth>'
)
SECONDS, BYTES = 60, 2_000_000_000


def robot(mesh: str) -> str:
    visual = f'<visual><geometry><mesh filename="{mesh}"/></geometry></visual>'
    joints = "".join(
        JOINT.format(*each)
        for each in (("a", "base", "crank", "0 0 0"), ("b", "crank", "bar", "0 0 1"), ("c", "base", "rocker", "2 0 0"))
    )
    return f'<robot name="r">{LINKS.format(visual)}{joints}{LOOP}</robot>'


class Touch:
    """Makes a file where it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return open, (str(self.path), "w")


# What a file unpacks to


def test_gzip_is_inflated_up_to_the_limit():
    one = gzip.compress(b"x" * 600)
    assert untrusted.unpack_gzip(gzip.compress(b"x" * 1000), "f", 1000) == b"x" * 1000
    assert untrusted.unpack_gzip(one + b"\0" * 8, "f", 1000) == b"x" * 600
    for bomb in (gzip.compress(b"x" * 1001), one + one, gzip.compress(b"x" * 10**7)):
        with pytest.raises(BadRequest, match=r"unpacks to more than 1000 bytes\. Use"):
            untrusted.unpack_gzip(bomb, "f", 1000)
    for bad in (one[:-9], b"\x1f\x8bno", one + b"rest", gzip.compress(one)[:5]):
        with pytest.raises(BadRequest, match="truncated or not gzip"):
            untrusted.unpack_gzip(bad, "f", 1000)


def archive(*names: str, size: int | None = None) -> bytes:
    """A zip archive; with ``size`` its list of files says that each has so many bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        for name in names:
            file.writestr(zipfile.ZipInfo(name), b"x")
    data = bytearray(out.getvalue())
    at = data.find(b"PK\x01\x02")
    while size is not None and at >= 0:
        data[at + 24 : at + 28] = struct.pack("<I", size)
        at = data.find(b"PK\x01\x02", at + 1)
    return bytes(data)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (archive("a", size=UNPACKED_MAX_BYTES + 1), "unpacks to"),
        (archive("a", "b", size=UNPACKED_MAX_BYTES // 2 + 1), "unpacks to"),
        (archive(*map(str, range(ARCHIVE_FILES_MAX + 1))), "files"),
        (archive("3D/../../a"), "lead out"),
        (archive("/a"), "lead out"),
        (archive("..\\a"), "lead out"),
        (archive("a")[:-5], "cannot be read"),
        (archive("a", "b", size=9), None),
        (b"solid", None),
    ],
)
def test_archives_are_judged_by_their_lists(content: bytes, said: str | None):
    found = untrusted.find_packing_defect(content)
    assert (found is None) is (said is None)
    assert said is None or said in str(found)


def bomb_3mf(path: Path, vertices: int) -> None:
    """Equal vertices, and one triangle."""
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file,
        file.open("3D/3dmodel.model", "w", force_zip64=True) as model,
    ):
        space = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
        model.write(
            f'<model unit="meter" xmlns="{space}"><resources><object id="1" type="model"><mesh><vertices>'.encode()
        )
        for _ in range(vertices // 10_000):
            model.write(b'<vertex x="0" y="0" z="0"/>' * 10_000)
        model.write(
            b'</vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object></resources>'
            b'<build><item objectid="1"/></build></model>'
        )


def bomb_glb(path: Path) -> None:
    """A mesh of 60,000 points, which 20,000 nodes hold."""
    points = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) * 20_000
    text = json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(20_000))}],
            "nodes": [{"mesh": 0}] * 20_000,
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 60_000, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": len(points)}],
            "buffers": [{"byteLength": len(points)}],
        }
    ).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(points))
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(points), b"BIN\0")
        + points
    )


def bomb_catalog(folder: Path, line: bytes, count: int) -> None:
    folder.mkdir()
    with gzip.open(folder / "planar.jsonl.gz", "wb", compresslevel=9) as file:
        file.write(format_head("planar", count=count).encode() + b"\n")
        for _ in range(count // 100_000):
            file.write(line * 100_000)


def run(*arguments: str) -> tuple[int, str, int]:
    """Exit status and standard error of a command, and the largest memory (bytes) of it and the processes it starts."""
    code = (
        "import subprocess, sys, resource\nrun = subprocess.run([sys.executable, '-m', 'hrsynth', *sys.argv[1:]], "
        "capture_output=True, text=True)\nprint(run.returncode, resource.getrusage(resource.RUSAGE_CHILDREN)"
        ".ru_maxrss, run.stderr, sep='\\n')"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True, timeout=3 * SECONDS
    ).stdout
    status, memory, errors = told.split("\n", 2)
    return int(status), errors.strip(), int(memory) * 1024


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bomb.3mf", "large.3mf", "bomb.glb"])
@pytest.mark.parametrize("command", ["convert ROBOT out.usda", "view ROBOT --static out.html"])
def test_a_mesh_unpacks_to_no_more_than_is_allowed(name: str, command: str, tmp_path: Path):
    if name.endswith(".3mf"):
        bomb_3mf(tmp_path / name, 20_000_000 if name == "bomb.3mf" else 7_000_000)
    else:
        bomb_glb(tmp_path / name)
    (tmp_path / "robot.urdf").write_text(robot(name))
    words = [
        str(tmp_path / {"ROBOT": "robot.urdf"}.get(word, word)) if "." in word or word == "ROBOT" else word
        for word in command.split()
    ]
    start = os.times()
    status, errors, memory = run(*words)
    end = os.times()
    errors = "\n".join(line for line in errors.splitlines() if "working" not in line and ", step " not in line)
    assert (status, len(errors.splitlines())) == (2, 1), errors
    assert name in errors
    assert memory < BYTES
    assert end.children_user + end.children_system - start.children_user - start.children_system < SECONDS
    assert not list(tmp_path.glob("out.*"))


@pytest.mark.slow
@pytest.mark.parametrize(("line", "count"), [(b"\n", 10**9), (b'{"key":"a","group":"planar"}\n', 5 * 10**6)])
@pytest.mark.parametrize("command", [["list"], ["show", "a"]])
def test_a_catalog_unpacks_to_no_more_than_is_allowed(line: bytes, count: int, command: list[str], tmp_path: Path):
    bomb_catalog(tmp_path / "catalog", line, count)
    assert (tmp_path / "catalog" / "planar.jsonl.gz").stat().st_size < 3_000_000
    status, errors, memory = run("catalog", *command, "--catalog", str(tmp_path / "catalog"))
    assert (status, len(errors.splitlines())) == (2, 1), errors
    assert "unpacks to more than 100000000 bytes" in errors
    assert memory < BYTES


def test_a_program_that_reads_has_limits(tmp_path: Path):
    program = tmp_path / "program.py"
    for body, said in (
        ("bytearray(10**10)", "bytes of memory"),
        ("import sys; sys.stdout.write('x' * 10**7)", None),
        ("import os; os.abort()", "reader crashed"),
        ("while True: pass", "memory or time|not read within"),
        ("from hrsynth.untrusted import refuse; refuse('a\\nb')", "a b"),
    ):
        program.write_text(f"def main():\n    {body}\n")
        if said is None:
            assert untrusted.run_program(program, seconds=1) == b"x" * 10**7
            continue
        with pytest.raises(BadRequest, match=said):
            untrusted.run_program(program, seconds=1)


@pytest.mark.slow
def test_it_prints_no_more_than_a_file_may_unpack_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(untrusted, "UNPACKED_MAX_BYTES", 10**6)
    (tmp_path / "program.py").write_text("def main():\n    print('x' * 10**7)\n")
    with pytest.raises(BadRequest, match="more than 1000000 bytes"):
        untrusted.run_program(tmp_path / "program.py", seconds=5)


# What is read


def tetrahedron(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    return path


@pytest.fixture
def homes(tmp_path: Path) -> Path:
    """A robot's file in a package, with meshes in it, beside it, and elsewhere."""
    for name in ("ws/pkg/meshes/a.obj", "ws/pkg/urdf/b.obj", "ws/other/c.obj", "ws/plain/d.obj", "secret.obj"):
        tetrahedron(tmp_path / name)
    for name in ("pkg", "other"):
        (tmp_path / "ws" / name / "package.xml").write_text("<package/>")
    (tmp_path / "ws" / "pkg" / "urdf" / "link.obj").symlink_to(tmp_path / "secret.obj")
    return tmp_path


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("b.obj", True),
        ("../meshes/a.obj", True),
        ("package://pkg/meshes/a.obj", True),
        ("package://other/c.obj", True),
        ("file://{}/ws/pkg/meshes/a.obj", True),
        ("model://pkg/urdf/b.obj", True),
        ("../../other/c.obj", True),
        ("../../../secret.obj", False),
        ("{}/secret.obj", False),
        ("file://{}/secret.obj", False),
        ("link.obj", False),
        ("package://pkg/../../secret.obj", False),
        ("package://plain/d.obj", False),
        ("../../plain/d.obj", False),
        ("package://secret.obj", False),
        ("http://127.0.0.1:9/a.obj", False),
        ("file:///etc/passwd", False),
        ("a\0b", False),
        ("", False),
        (".", False),
    ],
)
def test_a_mesh_is_read_in_the_robots_folders_alone(homes: Path, address: str, found: bool):
    folder = homes / "ws" / "pkg" / "urdf"
    assert (locate_mesh(address.format(homes), folder) is not None) is found


def test_without_a_package_the_folder_above_is_the_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "a" / "robot").mkdir(parents=True)
    tetrahedron(tmp_path / "far.obj")
    tetrahedron(tmp_path / "a" / "meshes" / "near.obj")
    assert locate_mesh("../meshes/near.obj", tmp_path / "a" / "robot") is not None
    assert locate_mesh("../../far.obj", tmp_path / "a" / "robot") is None
    monkeypatch.setenv("HOME", str(tmp_path / "a"))
    assert locate_mesh("../meshes/near.obj", tmp_path / "a" / "robot") is None


def test_what_lies_elsewhere_is_not_copied(homes: Path):
    (homes / "ws" / "pkg" / "urdf" / "robot.urdf").write_text(robot("../../../secret.obj"))
    (homes / "out").mkdir()
    (note,) = save(homes / "ws" / "pkg" / "urdf" / "robot.urdf", homes / "out" / "robot.sdf", meshes="copy")
    assert note.text == "meshes outside of the robot's folders keep their paths: ../../../secret.obj"
    assert [path.name for path in (homes / "out").iterdir()] == ["robot.sdf"]


def test_meshes_open_no_other_files_and_unpickle_nothing(tmp_path: Path):
    """Of a buffer that leads out, of materials, and of files whose formats are no meshes nothing is read."""
    inner = tmp_path / "robot"
    tetrahedron(inner / "good.obj")
    points = np.eye(3, dtype=np.float32).tobytes()
    (tmp_path / "out.bin").write_bytes(points)
    (inner / "in.bin").write_bytes(points)
    for name, uri in (
        ("in.gltf", "in.bin"),
        ("out.gltf", "../out.bin"),
        ("file.gltf", f"file://{tmp_path}/out.bin"),
        ("remote.gltf", "http://127.0.0.1:9/out.bin"),
    ):
        (inner / name).write_text(
            json.dumps(
                {
                    "asset": {"version": "2.0"},
                    "scene": 0,
                    "scenes": [{"nodes": [0]}],
                    "nodes": [{"mesh": 0}],
                    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
                    "bufferViews": [{"buffer": 0, "byteLength": 36}],
                    "buffers": [{"uri": uri, "byteLength": 36}],
                }
            )
        )
    hit = tmp_path / "hit"
    os.mkfifo(inner / "pipe.mtl")
    (inner / "pipe.obj").write_text("mtllib pipe.mtl\n" + (inner / "good.obj").read_text())
    for name in ("a.stl", "a.npz", "a.pkl", "a.obj", "a.ply", "a.dae"):
        (inner / name).write_bytes(pickle.dumps(Touch(hit)))
    (inner / "a.zip").write_bytes(archive("good.obj"))
    others = sorted(path.name for path in inner.iterdir() if path.name[0] in "aofr")
    names = ["good.obj", "in.gltf", "pipe.obj", *others]
    start = time.monotonic()
    found = read_robot_meshes(names, str(inner / "robot.urdf"))
    assert time.monotonic() - start < allow(2 * SECONDS)
    assert [name for name, mesh in found.items() if mesh is not None] == ["good.obj", "in.gltf", "pipe.obj"]
    assert not hit.exists()


# What is in files never runs

CODE = "__import__('pathlib').Path({!r}).write_text('x')"


def doors() -> Iterator[tuple[str, str]]:
    """Every door by which a file comes in, as a command, and what the file is called."""
    for name in (
        "robot.urdf",
        "robot.xml",
        "robot.sdf",
        "robot.usda",
        "robot.usd",
        "robot.usdz",
        "robot.yaml",
        "robot.zip",
        "robot.urdf.gz",
        "robot",
    ):
        yield "check FILE", name
    yield "lint FILE", "robot.urdf"
    yield "verify FILE", "c.json"
    yield "catalog list --catalog FOLDER", "planar.jsonl"
    yield "catalog list --catalog FOLDER", "planar.jsonl.gz"
    yield "catalog list --catalog FILE", "planar.sqlite"


def contents(hit: Path) -> dict[str, bytes]:
    code = CODE.format(str(hit))
    array = io.BytesIO()
    np.save(array, np.array([Touch(hit)], dtype=object), allow_pickle=True)
    return {
        "pickle": pickle.dumps(Touch(hit)),
        "array": array.getvalue(),
        "python": f"#!/usr/bin/python3\n{code}\n".encode(),
        "yaml": f'closed_loop: !!python/object/apply:eval ["{code}"]\n'.encode(),
        "zip": archive("robot.urdf"),
        "gzip": gzip.compress(robot("a.stl").encode()),
        "deep": b"[" * 200_000,
        "deeper": b'{"key":' * 200_000,
        "xinclude": b'<robot name="r" xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="/etc/passwd" '
        b'parse="text"/></robot>',
        "external": b'<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot name="&e;"><link name="a"/></robot>',
        "included": b'<mujoco><include file="/etc/passwd"/></mujoco>',
        "fetched": b'<sdf version="1.9"><include><uri>file:///etc</uri></include></sdf>',
        "zeros": b"\0" * 5000,
        "nothing": b"",
        "number": b'{"format": 1e999999999}',
    }


@pytest.mark.some(12)
@pytest.mark.parametrize("what", list(contents(Path())))
@pytest.mark.parametrize(("command", "name"), list(doors()), ids=lambda each: each.replace(" ", "_"))
def test_hostile_content_is_one_line_at_every_door(command: str, name: str, what: str, tmp_path: Path, capsys):
    hit, folder = tmp_path / "hit", tmp_path / "in"
    folder.mkdir()
    (folder / name).write_bytes(contents(hit)[what])
    places = {"FILE": str(folder / name), "FOLDER": str(folder)}
    status = run_command([places.get(word, word) for word in command.split()])
    out, err = capsys.readouterr()
    assert status in {"lint": (1, 2), "verify": (2, 3)}.get(command.split()[0], (2,)), err
    assert len(err.splitlines()) <= 1
    assert "defect of hrsynth" not in err
    assert "root:" not in out + err
    assert not hit.exists()
    assert [path.name for path in folder.iterdir()] == [name]


@pytest.mark.parametrize("command", ["check", pytest.param("derive", marks=pytest.mark.slow)])
def test_names_are_no_code(command: str, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    text = robot("a.stl")
    for number, name in enumerate(("base", "crank", "bar", "rocker", "a", "b", "c", "d")):
        text = text.replace(f'"{name}"', '"' + CODE.format("hit") + str(number) + '"')
    seen = f'<observe leg="{CODE.format("hit")}" link="{CODE.format("hit")}1" axis="0 0 1"/></hrsynth>'
    (tmp_path / "robot.urdf").write_text(text.replace("</hrsynth>", seen))
    assert run_command([command, "robot.urdf"]) == 0
    assert "__import__" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["robot.urdf"]


ALLOWED = {
    "batch/sections.py": {"exec"},
    "equations/compiled_module.py": {"exec_module"},
    "solving/exhaust.py": {"loads of pickle"},
    "untrusted.py": {"run_path"},
}
"""What runs text or unpickles, of this program's own making: straight-line code of numbers, the state of a search that
goes to another process, a program of the package."""


def calls(path: Path) -> Iterator[str]:
    text = path.read_text(encoding="utf-8")
    if not re.search(r"eval|exec|compile|import__|os\.|run_|parse_expr|_load|loads|sympify|pickle|shell|yaml", text):
        return
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        name = ast.unparse(node.func)
        last, keys = name.rpartition(".")[2], {each.arg: each.value for each in node.keywords}
        if name in ("eval", "exec", "compile", "__import__", "os.system", "os.popen") or last in (
            "exec_module",
            "run_path",
            "run_module",
            "parse_expr",
            "unsafe_load",
            "full_load",
        ):
            yield last
        elif re.fullmatch(r"(pickle|joblib|marshal|shelve|dill|torch)\.(loads?|open)", name):
            yield f"{last} of {name.partition('.')[0]}"
        elif (
            (last == "sympify" and "strict" not in keys)
            or "allow_pickle" in keys
            or "shell" in keys
            or (name == "yaml.load")
        ):
            yield last


@pytest.mark.slow
def test_nothing_that_runs_text_is_called_but_on_own_text():
    package = ROOT / "src" / "hrsynth"
    found = {str(path.relative_to(package)): told for path in package.rglob("*.py") if (told := set(calls(path)))}
    assert found == ALLOWED


# Certificates and catalogs


def test_a_number_of_a_certificate_is_short(tmp_path: Path):
    for text in (
        '{"format":"hrsynth-certificate-1","claim":"modes","tips":[["1e999999999","0","0"]],"systems":[]}',
        '{"claim":"ranks"}',
        "[]",
        '{"claim":"path","claim":"modes"}',
        '{"claim":' + '{"a":' * 9000,
    ):
        (tmp_path / "c.json").write_text(text)
        with pytest.raises(HrsynthError) as caught:
            verify(tmp_path / "c.json")
        assert len(caught.value.lines()) == 1


def certificates() -> Iterator[tuple[str, dict[str, Any]]]:
    """Small certificates that say little and would take long, with the claim that they make."""
    tips = [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]] * 20
    system = {"kind": "spatial", "square": 3, "tips": tips, "reaches": [{"sphere": [tips[0], ["1"]]}] * 60}
    box = {"boxes": [], "bound": {"kind": "rank", "groups": []}}
    yield "60 tips", {"claim": "modes", "systems": [{**system, **box}]}
    size = 600
    rows = [[int((i * i + 3 * j * j + i * j) % 7 > 3) for j in range(size)] for i in range(size)]
    stack = {"of": ["A"], "rank": size, "rows": list(range(size)), "columns": list(range(size)), "kernel": []}
    yield "ranks", {"claim": "ranks", "matrices": {"A": rows}, "stacks": [stack]}
    yield (
        "one row often",
        {
            "claim": "ranks",
            "matrices": {"A": [[1] * 200]},
            "stacks": [{**stack, "rows": [0] * 10**5, "columns": list(range(200))}],
        },
    )


@pytest.mark.parametrize(
    ("what", "record"),
    [pytest.param(*each, id=each[0]) for each in certificates()],
)
def test_a_small_certificate_is_checked_soon(what: str, record: dict[str, Any]):
    checker = verify_ranks if record["claim"] == "ranks" else verify_certificate
    record = {"format": "hrsynth-certificate-1", "real": 0, "complex": 0, **record}
    start = time.process_time()
    with pytest.raises(InvalidCertificate, match=r"too many|rows or columns"):
        verify({**record, "sha256": checker.digest(record)})
    assert time.process_time() - start < allow(5)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8, 9, 1000])
def test_a_free_name_is_found_without_counting_up_to_it(count: int):
    class Asked(set[str]):
        questions = 0

        def __contains__(self, name: object) -> bool:
            Asked.questions += 1
            return super().__contains__(name)

    taken = Asked(["a", *(f"a_{number}" for number in range(2, count + 1))])
    assert make_fresh_name("a", taken, {}) == f"a_{count + 1}"
    assert make_fresh_name("b", taken) == "b"
    assert Asked.questions < 30


def test_of_many_frames_that_nearly_meet_some_are_named(tmp_path: Path):
    file, tree = tmp_path / "tree.urdf", []
    for number in range(1, 400):
        tree.append(
            f'<link name="l{number}"/>' + JOINT.format(f"j{number}", f"l{(number - 1) // 2}", f"l{number}", "0.1 0 0")
        )
    file.write_text(f'<robot name="r"><link name="l0"/>{"".join(tree)}</robot>')
    start = time.process_time()
    assert run_command(["check", str(file), "--platform", "l9"]) in (2, 3)
    assert time.process_time() - start < allow(20)


def test_files_beside_a_robot_that_are_large_together_are_not_read(tmp_path: Path):
    file, size = tmp_path / "robot.urdf", LARGEST_BESIDE // 10
    for number in range(12):
        (tmp_path / f"{number}.yaml").write_bytes(bytes(size))
    assert settings.list_folder_files(file, ".yaml") == []
    for number in range(3):
        (tmp_path / f"{number}.yaml").unlink()
    assert len(settings.list_folder_files(file, ".yaml")) == 9


def test_a_certificate_file_is_checked_within_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    file, checker = tmp_path / "c.json", tmp_path / "checker.py"
    file.write_text('{"claim": "ranks"}')
    monkeypatch.setattr(verify_ranks, "__file__", str(checker))
    monkeypatch.setattr(certificates_, "VERIFY_TIMEOUT_S", 1)
    for body, status, said in (
        ("while True: pass", 3, "memory or time|not read within 1 s"),
        ("bytearray(10**10)", 3, "bytes of memory"),
        ("print('accepted: rank')", 0, "rank"),
        ("print('refused: a: b')", 3, "a: b"),
    ):
        checker.write_text(f"def main(name):\n    {body}\n")
        monkeypatch.setattr(certificates_.ranks, "describe_ranks", lambda record: "")
        assert run_command(["verify", str(file)]) == status
        (line,) = "".join(capsys.readouterr()).splitlines()
        assert re.search(said, line)
    file.write_text(" " * (verify_ranks.LENGTH + 1))
    assert run_command(["verify", str(file)]) == 2
    assert f"longer than {verify_ranks.LENGTH} characters" in capsys.readouterr().err
    for each in (verify_certificate, verify_path, verify_ranks):
        assert each.main(str(file)) == 3
        assert "characters" in capsys.readouterr().out


def test_a_number_too_large_for_a_pose_is_one_line(tmp_path: Path, capsys):
    record = certificate(modes("3rpr_m1"))
    for value in (10**400, -(10**400), 1e300, True):
        changed = {**record, "at": {**record["at"], "x": value}}
        (tmp_path / "c.json").write_text(json.dumps({**changed, "sha256": verify_certificate.digest(changed)}))
        assert run_command(["verify", str(tmp_path / "c.json"), "--robot", "3rpr_m1"]) == 3
        (line,) = capsys.readouterr().err.splitlines()
        assert "it is not for 3rpr_m1" in line


@pytest.mark.parametrize(
    "line",
    [
        '{"key":"a","group":"planar"}',
        '{"key":"a","group":"planar","notation":3}',
        '{"key":"a","a":' + "[" * 100_000,
        '{"key":"a","a":"' + "x" * 1_100_000 + '"}',
    ],
    ids=["bare", "typed", "deep", "long"],
)
def test_a_record_that_is_not_whole_is_one_line(line: str, tmp_path: Path, capsys):
    (tmp_path / "planar.jsonl").write_text(f"{format_head('planar', count=1)}\n{line}\n")
    assert run_command(["catalog", "list", "--catalog", str(tmp_path)]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "record" in said


@pytest.mark.parametrize(
    "field",
    [
        '"x":[[],[]]',
        '"x":{"a":1}',
        '"choices":[{"joints":[[1]],"rank":1,"x":[]}]',
        '"minimal":[' + '["a"],' * 20_000 + '["a"]]',
    ],
)
def test_a_record_holds_no_lists_of_unknown_size(field: str):
    bare = '{"key":"a","group":"planar","refused":"no"'
    assert parse_record(bare + ',"x":1}')["x"] == 1
    with pytest.raises(BadRequest, match="not a catalog entry"):
        parse_record(f"{bare},{field}}}")


@pytest.mark.parametrize("ending", ["", ".sqlite"])
def test_records_take_no_more_memory_than_is_allowed(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    lines = [f'{{"key":"{i}","group":"planar","refused":"no","notation":"{"x" * i}"}}' for i in range(5)]
    (kept := store(tmp_path / f"planar{ending}")).journal("planar").remove()
    kept.write("planar", lines)
    for module, name, enough in (
        (query, "CATALOG_JSON_PARTS_MAX", 35),
        (stores, "CATALOG_MAX_BYTES", sum(map(len, lines))),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, enough + 200 * (module is stores and not ending))
            assert len(list(query.load(kept.path))) == 5
            patch.setattr(module, name, enough - 1)
            with pytest.raises(BadRequest, match=r"planar.*: (lines of )?more than"):
                list(query.load(kept.path))


PROGRAMS = {
    "a view": "ALTER TABLE versions RENAME TO v; CREATE VIEW versions AS WITH RECURSIVE t(x) AS (SELECT 1 UNION ALL "
    "SELECT x + 1 FROM t) SELECT max(x) AS format, 1 AS catalog FROM t",
    "another view": "DROP TABLE lines; CREATE VIEW lines AS SELECT 0 AS record, printf('%.*c', 900000000, 'x') AS line",
    "a computed column": "DROP TABLE lines; CREATE TABLE lines (record INTEGER PRIMARY KEY, line "
    "GENERATED ALWAYS AS (printf('%.*c', 9000, 'x'))); INSERT INTO lines VALUES (0)",
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON lines BEGIN DELETE FROM lines; END",
    "a virtual table": "CREATE VIRTUAL TABLE t USING fts5(x)",
    "a far row": "UPDATE groups SET count = 2000000000; UPDATE lines SET record = 1999999999",
    "a far record": "UPDATE records SET record = 9000000000000000000",
    "a large count": "UPDATE groups SET count = 10000000000000",
    "no number": "UPDATE groups SET count = 9e999",
    "no name": "UPDATE groups SET name = x'00'",
    "a log": "PRAGMA journal_mode = WAL",
}


@pytest.mark.parametrize("what", PROGRAMS)
def test_a_database_runs_no_program_and_counts_its_rows(what: str, tmp_path: Path, capsys):
    kept = store(file := tmp_path / "c.sqlite")
    kept.write("planar", ['{"key":"a","group":"planar","refused":"no"}'])
    with contextlib.closing(sqlite3.connect(file)) as changed:
        changed.executescript(PROGRAMS[what])
    for arguments in (["list"], ["list", "--json", "--modes", "3"], ["show", "3(Rz*-Rz-Rz)"]):
        status = run_command(["catalog", *arguments, "--catalog", str(file)])
        errors = capsys.readouterr().err
        assert (status, len(errors.splitlines())) == (2, 1), errors
        assert "c.sqlite" in errors
    assert [each.name for each in tmp_path.iterdir()] == ["c.sqlite"]


@pytest.mark.parametrize(
    ("change", "asked", "said"),
    [
        ("lines SET line = printf('%.*c', 200000, 'x')", {}, "too big"),
        ("texts SET text = zeroblob(1000000)", {"text": "no"}, "too big"),
        ("records SET notation = printf('%.*c', 200000, 'x')", {"legs": "3-R*"}, "too big"),
    ],
)
def test_a_text_of_a_database_is_short(change: str, asked: dict[str, Any], said: str, tmp_path: Path):
    kept = store(file := tmp_path / "c.sqlite")
    kept.write("planar", ['{"key":"a","group":"planar","refused":"no"}'])
    with contextlib.closing(sqlite3.connect(file)) as changed:
        changed.executescript(f"UPDATE {change}")
    with pytest.raises(BadRequest, match=said):
        list(query.load(file, **asked))


@pytest.mark.parametrize(
    "command", ["catalog list --catalog FOLDER", "catalog list --catalog FOLDER/p.sqlite", "verify FOLDER/p.json"]
)
def test_a_pipe_is_not_waited_for(command: str, tmp_path: Path, capsys):
    for name in ("planar.jsonl", "p.sqlite", "p.json"):
        os.mkfifo(tmp_path / name)
    assert run_command(command.replace("FOLDER", str(tmp_path)).split()) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "not a regular file" in said


# Where the program is


def test_from_an_archive_it_says_so_in_one_line(tmp_path: Path):
    package = ROOT / "src" / "hrsynth"
    with zipfile.ZipFile(tmp_path / "hrsynth.zip", "w") as file:
        for path in package.rglob("*.py"):
            file.write(path, path.relative_to(package.parent))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'hrsynth.zip')!r}); from hrsynth.cli import main; "
        "main(['robots'])"
    )
    told = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True)
    assert (told.returncode, told.stdout) == (2, "")
    (said,) = told.stderr.splitlines()
    assert "cannot run from an archive" in said
