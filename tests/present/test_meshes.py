"""Visual shapes of a robot's file: drawn where they can be read, rods and a note where they cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hrsynth import load, save, view
from hrsynth.description import list_robots
from hrsynth.present.view.view import View

ROBOT = "3rrr_m1"
SIZE = np.array([0.03, 0.02, 0.01])
BOX = (
    '<visual><origin xyz="0.1 0 0.05" rpy="0 0 1.5707963267948966"/>'
    '<geometry><box size="0.03 0.02 0.01"/></geometry></visual>'
)


def with_visuals(folder: Path, hidden: bool = False, **visuals: str) -> View:
    """A shipped robot with visuals on some of its links."""
    text = list_robots()[ROBOT].read_text()
    for link, visual in visuals.items():
        assert f'<link name="{link}"/>' in text
        text = text.replace(f'<link name="{link}"/>', f'<link name="{link}">{visual}</link>')
    file = folder / "robot.urdf"
    file.write_text(text)
    return view(load(file), hidden=hidden)


def mesh(name: str, scale: str = "1 1 1") -> str:
    return f'<visual><geometry><mesh filename="{name}" scale="{scale}"/></geometry></visual>'


def meshed(found: View, link: str) -> list[np.ndarray]:
    return [shape.points for shape in found.machines[0].shapes if (shape.kind, shape.link) == ("mesh", link)]


def rods(found: View, link: str) -> int:
    return sum((shape.kind, shape.link) == ("rod", link) for shape in found.machines[0].shapes)


@pytest.mark.slow
def test_solids_stand_for_the_rods_of_their_links(tmp_path: Path):
    found = with_visuals(tmp_path, hidden=True, platform=BOX)
    (points,) = meshed(found, "platform")
    X = found.setup.mechanism.links["platform"].pose
    middle = X[:3, :3] @ [0.1, 0, 0.05] + X[:3, 3]
    assert points.mean(axis=0) == pytest.approx(middle)
    assert np.ptp((points - X[:3, 3]) @ X[:3, :3], axis=0) == pytest.approx(SIZE[[1, 0, 2]])
    assert rods(found, "platform") == 0
    assert rods(found, "prox_1") == 1
    assert [shape.role for shape in found.machines[1].shapes if shape.kind == "mesh"] == ["platform"]
    joints = {shape.joint for shape in found.machines[0].shapes if shape.joint}
    assert joints == set(found.setup.mechanism.joints)


@pytest.mark.parametrize(
    "address",
    [
        "part.stl",
        pytest.param("package://some_robot/part.stl", marks=pytest.mark.slow),
        pytest.param("file://{folder}/part.stl", marks=pytest.mark.slow),
    ],
)
def test_mesh_files_beside_the_robot_are_read(tmp_path: Path, address: str):
    import trimesh

    trimesh.creation.box(extents=SIZE).export(tmp_path / "part.stl")
    (tmp_path / "none.stl").write_bytes(b"no mesh")
    found = with_visuals(tmp_path, prox_1=mesh(address.format(folder=tmp_path), "2 2 2"), prox_2=mesh("none.stl"))
    (points,) = meshed(found, "prox_1")
    X = found.setup.mechanism.links["prox_1"].pose
    assert np.ptp((points - X[:3, 3]) @ X[:3, :3], axis=0) == pytest.approx(2 * SIZE, rel=1e-5)
    (note,) = (note for note in found.notes if "visual" in note)
    assert "cannot be read (prox_2" in note
    assert (rods(found, "prox_1"), rods(found, "prox_2")) == (0, 1)


def test_meshes_of_an_object_of_yourdfpy_are_read_where_it_looks_for_them(tmp_path: Path):
    import trimesh
    import yourdfpy

    trimesh.creation.box(extents=SIZE).export(tmp_path / "part.stl")
    file = tmp_path / "arm.urdf"
    file.write_text(
        f'<robot name="arm"><link name="base"/><link name="hand">{mesh("part.stl", "2 2 2")}</link>'
        '<link name="arm"/><joint name="elbow" type="continuous"><parent link="base"/><child link="arm"/>'
        '<axis xyz="0 0 1"/></joint><joint name="hinge" type="continuous"><parent link="arm"/><child link="hand"/>'
        '<axis xyz="0 0 1"/><origin xyz="1 0 0"/></joint></robot>'
    )
    found = view(load(yourdfpy.URDF.load(str(file)), platform="hand", motors="elbow,hinge"))
    (points,) = meshed(found, "hand")
    assert np.ptp(points, axis=0) == pytest.approx(2 * SIZE, rel=1e-5)


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    "ending", [".xml", pytest.param(".sdf", marks=pytest.mark.slow), pytest.param(".usda", marks=pytest.mark.slow)]
)
def test_other_dialects_show_the_same_meshes(ending: str, tmp_path: Path):
    import trimesh

    trimesh.creation.box(extents=SIZE).export(tmp_path / "part.stl")
    first = with_visuals(tmp_path, prox_1=mesh("part.stl"), platform=mesh("part.stl", "2 1 3"))
    save(load(tmp_path / "robot.urdf"), tmp_path / f"other{ending}")
    second = view(load(tmp_path / f"other{ending}"))
    for link in ("prox_1", "platform"):
        (one,), (other,) = meshed(first, link), meshed(second, link)
        assert np.sort(other, axis=0) == pytest.approx(np.sort(one, axis=0), abs=1e-9)


@pytest.mark.parametrize(
    "address",
    [
        "missing.stl",
        pytest.param("package://none/missing.dae", marks=pytest.mark.slow),
        pytest.param("http://robots.invalid/part.stl", marks=pytest.mark.slow),
    ],
)
def test_missing_meshes_are_told_once_and_rods_drawn(tmp_path: Path, address: str):
    found = with_visuals(tmp_path, platform=BOX, prox_1=mesh(address), dist_2=mesh(address))
    assert [note for note in found.notes if note.startswith("2 visual shapes cannot be read (prox_1")]
    assert (rods(found, "prox_1"), rods(found, "dist_2"), rods(found, "platform")) == (1, 1, 0)


def test_links_that_a_merged_joint_swallows_are_told(tmp_path: Path):
    """Two hinges that meet are a U in the normal form, which has no link between them to carry a shape."""
    shape = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    links = "".join(f'<link name="{name}">{shape}</link>' for name in ("base", "yoke", "arm", "hand"))
    hinges = "".join(
        f'<joint name="{name}" type="continuous"><parent link="{one}"/><child link="{two}"/>'
        f'<origin xyz="{x} 0 0"/><axis xyz="{axis}"/></joint>'
        for name, one, two, x, axis in (
            ("pan", "base", "yoke", 0, "0 0 1"),
            ("tilt", "yoke", "arm", 0, "0 1 0"),
            ("elbow", "arm", "hand", 1, "0 1 0"),
        )
    )
    file = tmp_path / "head.urdf"
    file.write_text(
        f'<robot name="head">{links}{hinges}<hrsynth serial="true"><platform link="hand"/></hrsynth></robot>'
    )
    found = view(load(file))
    assert "yoke" not in found.setup.mechanism.links
    assert [note for note in found.notes if "merged" in note] == ["links inside merged joints are not drawn: yoke"]
    assert len(meshed(found, "hand")) == 1


@pytest.mark.some(0, 1)
@pytest.mark.parametrize(
    "ending", ["xml", pytest.param("sdf", marks=pytest.mark.slow), pytest.param("usda", marks=pytest.mark.slow)]
)
def test_a_robot_of_another_dialect_is_drawn_with_the_same_shapes(tmp_path: Path, ending: str):
    import trimesh

    trimesh.creation.box(extents=SIZE).export(tmp_path / "part.stl")
    rod = '<origin xyz="0.1 0.02 0" rpy="0.3 1 0"/><geometry><cylinder radius="0.01" length="0.2"/></geometry>'
    own = with_visuals(tmp_path, platform=BOX, prox_1=mesh("part.stl", "2 2 2"), dist_2=f"<visual>{rod}</visual>")
    target = tmp_path / f"other.{ending}"
    save(load(tmp_path / "robot.urdf"), target)
    if ending == "usda":
        pytest.importorskip("pxr")
    foreign = view(load(target))
    assert foreign.notes == own.notes
    for link in ("platform", "prox_1", "dist_2"):
        (points,), (there,) = meshed(own, link), meshed(foreign, link)
        assert np.sort(there, axis=0) == pytest.approx(np.sort(points, axis=0), abs=1e-6)
        assert rods(foreign, link) == 0
