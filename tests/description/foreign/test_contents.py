"""Masses, inertias, shapes, colours and meshes survive between all dialects, or it is said what does not."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hrsynth.cli import run_command
from hrsynth.description import load, save
from hrsynth.description.contents import Content, collect_content
from hrsynth.description.formats.usd import stage
from hrsynth.description.meshes import locate_mesh, read_robot_meshes
from hrsynth.errors import BadRequest
from hrsynth.geometry.vectors import convert_rpy_to_rotation
from hrsynth.mechanism import Mechanism

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
FACES = ((0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3))
MESH = (
    bytes(80)
    + (4).to_bytes(4, "little")
    + b"".join(bytes(12) + CORNERS[list(face)].tobytes() + bytes(2) for face in FACES)
)
ENDINGS = (".urdf", ".xml", ".sdf", ".yaml", ".usda")


def filled(folder: Path, seed: int = 0) -> Mechanism:
    """A shipped robot, all of whose links have masses and shapes in random places, two with meshes of two folders."""
    rng = np.random.default_rng(seed)
    (folder / "src" / "parts").mkdir(parents=True)
    for name in ("src/a.stl", "src/parts/b.stl"):
        (folder / name).write_bytes(MESH)
    robot, links = load("3rps"), {}
    for number, link in enumerate(robot.links.values()):
        at, turn = (" ".join(f"{v:.5f}" for v in rng.uniform(-1, 1, 3)) for _ in range(2))
        place = f'<origin xyz="{at}" rpy="{turn}"/>'
        A = rng.uniform(-1, 1, (3, 3))
        J = A @ A.T + 2 * np.eye(3)
        tensor = " ".join(
            f'{key}="{J[i, j]:.6f}"'
            for key, i, j in (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))
        )
        shape = (
            '<box size="0.1 0.2 0.3"/>',
            '<sphere radius="0.25"/>',
            '<cylinder radius="0.1" length="2"/>',
            '<capsule radius="0.1" length="0.5"/>',
            '<mesh filename="a.stl" scale="0.5 0.5 0.5"/>',
            '<mesh filename="parts/b.stl"/>',
        )[number % 6]
        links[link.name] = replace(
            link,
            xml=(
                f'<inertial>{place}<mass value="{rng.uniform(0.1, 9):.4f}"/><inertia {tensor}/></inertial>',
                f'<visual name="hull_{number}">{place}<geometry>{shape}</geometry>'
                '<material name=""><color rgba="1 0.5 0 1"/></material></visual>',
                f"<collision>{place}<geometry>{shape}</geometry></collision>",
            ),
        )
    save(replace(robot, links=links), folder / "src" / "robot.urdf")
    return load(folder / "src" / "robot.urdf")


def same(mine: Content, theirs: Content, folders: tuple[Path, Path]) -> None:
    """Masses and inertias about the link's own axes, shapes with their places, meshes by the file that is named."""
    assert mine.inertial is not None
    assert theirs.inertial is not None
    assert theirs.inertial.mass == mine.inertial.mass
    R, S = (each.inertial.X[:3, :3] for each in (mine, theirs))
    assert S @ theirs.inertial.inertia @ S.T == pytest.approx(R @ mine.inertial.inertia @ R.T, abs=1e-9)
    assert theirs.inertial.X[:3, 3] == pytest.approx(mine.inertial.X[:3, 3], abs=1e-9)
    assert [(s.kind, s.role, s.name, s.colour) for s in theirs.solids] == [
        (s.kind, s.role, s.name, s.colour) for s in mine.solids
    ]
    for a, b in zip(mine.solids, theirs.solids, strict=True):
        assert b.sizes == pytest.approx(a.sizes, rel=1e-12)
        assert pytest.approx(a.X, abs=1e-9) == b.X
        assert b.scale == pytest.approx(a.scale, rel=1e-9)
        if a.file is not None:
            one, two = (locate_mesh(s.file, folder) for s, folder in zip((a, b), folders, strict=True))
            assert one is not None
            assert two is not None
            assert one.read_bytes() == two.read_bytes()


PAIRS = [
    pytest.param(*pair, marks=[pytest.mark.slow] * (".usda" in pair or ".yaml" in pair))
    for pair in itertools.permutations(ENDINGS, 2)
]


@pytest.mark.some(3)
@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_what_links_hold_survives_from_dialect_to_dialect(first: str, second: str, tmp_path: Path):
    if ".usda" in (first, second):
        pytest.importorskip("pxr")
    robot = filled(tmp_path)
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
    assert save(robot, tmp_path / "one" / f"robot{first}") == ()
    assert save(tmp_path / "one" / f"robot{first}", tmp_path / "two" / f"robot{second}", meshes="copy") == ()
    back = load(tmp_path / "two" / f"robot{second}")
    assert sorted(path.name for path in (tmp_path / "two" / "meshes").iterdir()) == ["a.stl", "b.stl"]
    for name, link in robot.links.items():
        same(
            collect_content(link, robot), collect_content(back.links[name], back), (tmp_path / "src", tmp_path / "two")
        )


def test_mujoco_loads_masses_and_meshes_as_they_are(tmp_path: Path):
    mujoco = pytest.importorskip("mujoco")
    robot = filled(tmp_path)
    (tmp_path / "out").mkdir()
    save(robot, tmp_path / "out" / "robot.xml", meshes="copy")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert model.nmesh == 2
    for name, link in robot.links.items():
        body, inertial = model.body(name), collect_content(link, robot).inertial
        assert body.mass[0] == pytest.approx(inertial.mass, rel=1e-12)
        assert body.ipos == pytest.approx(inertial.X[:3, 3], abs=1e-9)
        assert sorted(body.inertia) == pytest.approx(sorted(np.linalg.eigvalsh(inertial.inertia)), rel=1e-6)


def test_what_a_dialect_cannot_hold_is_one_sentence(tmp_path: Path):
    robot = load("3rps")
    platform = robot.links[robot.platform]
    odd = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>',
        '<visual><geometry><mesh filename="nowhere.dae"/></geometry></visual>',
        "<gripper/>",
    )
    full = replace(
        robot, links={**robot.links, platform.name: replace(platform, xml=odd)}, file=str(tmp_path / "in.urdf")
    )
    lost = [str(note) for note in save(full, tmp_path / "out.xml")]
    assert len(lost) == 3
    for said in ("no body can have", "nowhere.dae", "<gripper> of links"):
        assert sum(said in line for line in lost) == 1
    (note,) = save(full, tmp_path / "out.urdf")
    assert note.text == "missing meshes: nowhere.dae"
    assert "nowhere.dae" in (tmp_path / "out.urdf").read_text()


def test_an_stl_of_text_is_not_given_to_mujoco(tmp_path: Path):
    robot = filled(tmp_path)
    (tmp_path / "src" / "a.stl").write_text("solid s\nendsolid s\n" + " " * 100)
    (note,) = save(robot, tmp_path / "out.xml")
    assert "a.stl" in note.text
    assert "binary" in note.text


def test_meshes_are_named_from_the_new_folder_and_never_overwritten(tmp_path: Path, capsys, monkeypatch):
    filled(tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far" / "away").mkdir(parents=True)
    assert run_command(["convert", "src/robot.urdf", "-o", "far/away/robot.sdf"]) == 0
    assert "../../src/parts/b.stl" in (tmp_path / "far" / "away" / "robot.sdf").read_text()
    (tmp_path / "far" / "meshes").mkdir()
    (tmp_path / "far" / "meshes" / "b.stl").write_text("precious")
    assert run_command(["convert", "src/robot.urdf", "far/robot.sdf", "--meshes", "copy"]) == 2
    assert "other content" in capsys.readouterr().err
    assert sorted(path.name for path in (tmp_path / "far").rglob("*")) == ["away", "b.stl", "meshes", "robot.sdf"]
    assert (tmp_path / "far" / "meshes" / "b.stl").read_text() == "precious"
    for asked in (
        ["convert", "3rps"],
        ["convert", "3rps", "a.xml", "-o", "b.xml"],
        ["convert", "3rps", "a.xml", "--meshes", "x"],
    ):
        assert run_command(asked) == 2


@pytest.mark.slow
def test_meshes_in_a_usd_file_become_files(tmp_path: Path):
    pytest.importorskip("pxr")
    save(filled(tmp_path), tmp_path / "robot.usda")
    text = (tmp_path / "robot.usda").read_text()
    (tmp_path / "robot.usda").write_text(
        "\n".join(line for line in text.splitlines() if "hrsynth:mesh" not in line and "hrsynth:scale" not in line)
    )
    (tmp_path / "out").mkdir()
    (note,) = save(tmp_path / "robot.usda", tmp_path / "out" / "kept.urdf")
    assert "--meshes copy" in note.text
    assert save(tmp_path / "robot.usda", tmp_path / "out" / "robot.xml", meshes="copy") == ()
    found = [path.read_text().count("\nf ") for path in (tmp_path / "out" / "meshes").iterdir()]
    assert found
    assert set(found) == {4}


@pytest.mark.slow
def test_all_meshes_in_usd_files_are_read_by_one_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("pxr")
    prim = (
        'def Mesh "{}" {{\n  point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]\n  int[] faceVertexCounts = [3]\n'
        "  int[] faceVertexIndices = [0, 1, 2]\n}}"
    )
    for file in "ab":
        (tmp_path / f"{file}.usda").write_text("#usda 1.0\n" + "\n".join(prim.format(f"p{k}") for k in range(20)))
    runs, run = [], stage.run_program
    monkeypatch.setattr(stage, "run_program", lambda *given, **rest: runs.append(given) or run(*given, **rest))
    names = [f"{file}.usda#/p{k}" for file in "ab" for k in range(20)]
    found = read_robot_meshes(names, str(tmp_path / "robot.urdf"))
    assert [found[name][0].shape for name in names] == [(3, 3)] * 40
    assert len(runs) == 1


def test_a_mesh_is_copied_once_however_it_is_spelt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    filled(tmp_path)
    folder = tmp_path / "src"
    text, name = (folder / "robot.urdf").read_text(), "parts/b.stl"
    visual = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    again = "".join(visual.format("./" * k + name) for k in range(1, 6))
    link = re.search(r'<link name="[^"]*"\s*>', text)[0]
    (folder / "robot.urdf").write_text(text.replace(link, link + again, 1))
    save(folder / "robot.urdf", tmp_path / "out.urdf", meshes="copy")
    copied = sorted(path.name for path in (tmp_path / "meshes").iterdir())
    assert [each for each in copied if each.startswith("b")] == ["b.stl"]
    monkeypatch.setattr("hrsynth.description.meshes.MESH_FILES_MAX", len(copied) - 1)
    with pytest.raises(BadRequest, match=f"up to {len(copied) - 1}"):
        save(folder / "robot.urdf", tmp_path / "new" / "out.urdf", meshes="copy")


def test_shapes_of_foreign_mjcf(tmp_path: Path):
    """Defaults, half sizes, ends instead of places, shapes that both are seen and collide."""
    (tmp_path / "robot.xml").write_text(
        '<mujoco><compiler angle="radian" meshdir="m"/><default><geom rgba="1 0 0 1"/>'
        '<default class="skin"><geom contype="0" conaffinity="0" type="mesh"/></default></default>'
        '<asset><mesh file="x.stl" scale="2 2 2"/></asset><worldbody><body name="a"><joint name="j"/>'
        '<inertial pos="0 0 1" mass="2" diaginertia="1 2 2" euler="0 0 1"/><geom type="box" size="1 2 3"/>'
        '<geom type="capsule" fromto="0 0 0 2 0 0" size="0.1" group="3"/><geom class="skin" mesh="x"/>'
        '<geom type="ellipsoid" size="1 2 3"/></body></worldbody></mujoco>'
    )
    robot = load(tmp_path / "robot.xml")
    found = collect_content(robot.links["a"], robot)
    assert [(s.kind, s.role, s.sizes, s.colour) for s in found.solids] == [
        ("box", "visual", (2, 4, 6), (1, 0, 0, 1)),
        ("box", "collision", (2, 4, 6), None),
        ("capsule", "collision", (0.1, 2), None),
        ("mesh", "visual", (), (1, 0, 0, 1)),
    ]
    assert found.solids[2].X[:3, 3] == pytest.approx((1, 0, 0))
    assert np.abs(found.solids[2].X[:3, 2]) == pytest.approx((1, 0, 0))
    assert (found.solids[3].file, found.solids[3].scale) == ("m/x.stl", (2, 2, 2))
    assert found.inertial.X[:3, :3] == pytest.approx(convert_rpy_to_rotation(0, 0, 1))


def test_a_half_written_robot_leaves_no_meshes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import hrsynth.description as description

    robot = filled(tmp_path)
    (tmp_path / "out").mkdir()

    def refuse(*_: object) -> None:
        raise BadRequest("no room")

    monkeypatch.setattr(description, "write_whole", refuse)
    with pytest.raises(BadRequest, match="no room"):
        save(robot, tmp_path / "out" / "robot.sdf", meshes="copy")
    assert list((tmp_path / "out").iterdir()) == []


def test_a_unit_is_that_of_shapes_too_and_inertias_stay_as_told(tmp_path: Path):
    robot = filled(tmp_path)
    small = load(tmp_path / "src" / "robot.urdf", unit="mm")
    assert any("inertias" in note.text for note in small.notes)
    for name, link in robot.links.items():
        one, two = collect_content(link, robot), collect_content(small.links[name], small)
        assert two.inertial.mass == one.inertial.mass
        assert two.inertial.X[:3, 3] == pytest.approx(one.inertial.X[:3, 3] / 1000)
        assert np.array_equal(two.inertial.inertia, one.inertial.inertia)
        for a, b in zip(one.solids, two.solids, strict=True):
            assert b.sizes == pytest.approx(np.array(a.sizes) / 1000)
            assert b.scale == pytest.approx(np.array(a.scale) / (1000 if a.file else 1))


def test_only_meshes_are_copied(tmp_path: Path):
    robot = filled(tmp_path)
    (tmp_path / "secret.txt").write_text("secret")
    text = (tmp_path / "src" / "robot.urdf").read_text()
    (tmp_path / "src" / "robot.urdf").write_text(text.replace('"a.stl"', '"../secret.txt"'))
    (tmp_path / "out").mkdir()
    (note,) = save(load(tmp_path / "src" / "robot.urdf"), tmp_path / "out" / "robot.urdf", meshes="copy")
    assert "secret.txt" in note.text
    assert [path.name for path in (tmp_path / "out" / "meshes").iterdir()] == ["b.stl"]
    assert robot.name in (tmp_path / "out" / "robot.urdf").read_text()
