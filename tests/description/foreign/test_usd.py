"""USD: what is written is read again the same and means the same to OpenUSD alone; units, axes, drives; refusals."""

from __future__ import annotations

import importlib.util
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from description.foreign.test_traps import full_mobility
from description.foreign.test_writers import KINDS, bare
from description.samples import every_joint
from hrsynth import derive
from hrsynth.cli import run_command
from hrsynth.description import build_spanning_mechanism, list_robots, load, save
from hrsynth.description.contents import collect_content
from hrsynth.errors import BadRobotFile, MissingExtra
from hrsynth.mechanism import JointType

pytest.importorskip("pxr")

ROBOTS = [name if name == "3rps" else pytest.param(name, marks=pytest.mark.slow) for name in list_robots()]
HEAD = '#usda 1.0\n(\n defaultPrim = "r"\n metersPerUnit = {metres}\n upAxis = "{up}"\n)\n'
BODY = """def Xform "{name}" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {{
  double3 xformOp:translate = {at}
  {more}
  uniform token[] xformOpOrder = ["xformOp:translate"{order}]
}}
"""
JOINT = """def {kind} "{name}" ({apis}) {{
  {body0}
  rel physics:body1 = </r/{two}>
  point3f physics:localPos0 = {p}
  point3f physics:localPos1 = {q}
  {more}
}}
"""


def body(name: str, at: tuple[float, ...] = (0, 0, 0), more: str = "", order: str = "") -> str:
    return BODY.format(name=name, at=tuple(at), more=more, order=order)


def joint(
    name: str,
    one: str,
    two: str,
    p: tuple[float, ...],
    q: tuple[float, ...],
    more: str = "",
    kind: str = "PhysicsRevoluteJoint",
    apis: str = "",
) -> str:
    said = f"prepend apiSchemas = [{apis}]" if apis else ""
    return JOINT.format(
        kind=kind,
        name=name,
        apis=said,
        two=two,
        p=p,
        q=q,
        more=more,
        body0=f"rel physics:body0 = </r/{one}>" if one else "",
    )


def stage(parts: str, metres: float = 1, up: str = "Z") -> str:
    root = 'def Xform "r" (prepend apiSchemas = ["PhysicsArticulationRootAPI"]) {\n'
    return HEAD.format(metres=metres, up=up) + root + parts + "}\n"


LOOP = "bool physics:excludeFromArticulation = 1"
DRIVEN = "float drive:angular:physics:stiffness = 10"


def four_bar(axis: str = "Y", unit: float = 1, up: str = "Z", *, crank: str = DRIVEN) -> str:
    """Bars 1 and 2 long, in the plane normal to ``axis``; ``unit`` metres a unit."""
    long, high = np.array([1, 0, 0]), np.array([0, 0, 1] if axis == "Y" else [0, 1, 0])
    token = f'uniform token physics:axis = "{axis}"'

    def at(x: float, z: float) -> tuple[float, ...]:
        return tuple(float(v) for v in (x * long + z * high) / unit)

    limits = "float physics:lowerLimit = -60\n  float physics:upperLimit = 90"
    return stage(
        body("ground")
        + body("crank")
        + body("bar", at(0, 1))
        + body("rocker", at(2, 0))
        + joint("hold", "", "ground", at(0, 0), at(0, 0), kind="PhysicsFixedJoint")
        + joint(
            "a",
            "ground",
            "crank",
            at(0, 0),
            at(0, 0),
            f"{token}\n  {limits}\n  {crank}",
            apis='"PhysicsDriveAPI:angular"',
        )
        + joint("b", "crank", "bar", at(0, 1), at(0, 0), token)
        + joint("c", "ground", "rocker", at(2, 0), at(0, 0), token)
        + joint("d", "rocker", "bar", at(0, 1), at(2, 0), f"{token}\n  {LOOP}"),
        unit,
        up,
    )


def read(folder: Path, text: str, **given: object):
    path = folder / "robot.usda"
    path.write_text(text)
    return load(path, **given)


@pytest.mark.some(1, 10)
@pytest.mark.parametrize("size", [1500, 4000])
def test_a_cut_stage_is_refused_with_the_line(tmp_path: Path, size: int):
    path = tmp_path / "robot.usda"
    save(load("delta"), path)
    path.write_text(text := path.read_text()[:size])
    with pytest.raises(BadRobotFile) as refused:
        load(path)
    assert refused.value.lines() == [
        f"{path}: OpenUSD cannot read robot.usda from line {len(text.splitlines())} on: expected a whole stage"
    ]


@pytest.mark.parametrize(
    "ending", [".usda", pytest.param(".usd", marks=pytest.mark.slow), pytest.param(".usdc", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("name", ROBOTS)
def test_a_shipped_robot_comes_back_the_same(name: str, ending: str, tmp_path: Path):
    robot = load(name)
    assert save(robot, tmp_path / f"robot{ending}") == ()
    back = load(tmp_path / f"robot{ending}")
    assert back.differences(build_spanning_mechanism(robot)) == []
    assert back.name == robot.name
    assert back.notes == ()


@pytest.mark.some(0, 4)
@pytest.mark.parametrize("name", ROBOTS)
def test_its_hidden_robot_is_the_same(name: str, tmp_path: Path):
    save(load(name), tmp_path / "robot.usdc")
    ours, theirs = (derive(robot).to_dict() for robot in (load(name), load(tmp_path / "robot.usdc")))
    assert len(ours["unobserved"]) == len(theirs["unobserved"])
    for part in ("verdict", "notation", "dof", "mobility"):
        assert ours[part] == theirs[part]
    for own, other in zip(ours["observed"], theirs["observed"], strict=True):
        assert own.pop("axis") == pytest.approx(other.pop("axis"), abs=1e-12)
        assert own == other


@pytest.mark.parametrize("seed", [pytest.param(0, marks=pytest.mark.slow), 2])
def test_joints_of_every_type_come_back(seed: int, tmp_path: Path):
    robot = build_spanning_mechanism(every_joint([*KINDS, *KINDS], KINDS, seed))
    save(robot, tmp_path / "robot.usda")
    assert bare(load(tmp_path / "robot.usda")).differences(bare(robot)) == []


@pytest.mark.parametrize("name", ROBOTS)
def test_openusd_alone_counts_the_same_freedoms_and_closes_the_same_loops(name: str, tmp_path: Path):
    """Bodies, frames and locks as the schemas say them, put together without any code of the package."""
    from pxr import Usd, UsdGeom, UsdPhysics

    robot = load(name)
    save(robot, tmp_path / "robot.usda")
    opened = Usd.Stage.Open(str(tmp_path / "robot.usda"))
    bodies = [prim for prim in opened.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    index = {prim.GetPath(): number for number, prim in enumerate(bodies)}
    assert len(bodies) == len(robot.links)
    assert UsdGeom.GetStageUpAxis(opened) == "Z"
    free_of = {
        "PhysicsRevoluteJoint": [3],
        "PhysicsPrismaticJoint": [0],
        "PhysicsSphericalJoint": [3, 4, 5],
        "PhysicsFixedJoint": [],
    }
    rows, loops = [], 0
    for prim in [each for each in opened.Traverse() if each.IsA(UsdPhysics.Joint)]:
        each = UsdPhysics.Joint(prim)
        frames, ends = [], []
        for relation, place, turn in (
            (each.GetBody0Rel(), each.GetLocalPos0Attr(), each.GetLocalRot0Attr()),
            (each.GetBody1Rel(), each.GetLocalPos1Attr(), each.GetLocalRot1Attr()),
        ):
            targets = relation.GetTargets()
            W = np.eye(4)
            if targets:
                W = np.array(UsdGeom.Xformable(opened.GetPrimAtPath(targets[0])).ComputeLocalToWorldTransform(0)).T
            w, (x, y, z) = turn.Get().GetReal(), turn.Get().GetImaginary()
            R = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ]
            )
            frames.append((W[:3, :3] @ R, W[:3, :3] @ np.array(place.Get()) + W[:3, 3]))
            ends.append(index[targets[0]] if targets else None)
        assert np.max(np.abs(frames[0][0] - frames[1][0])) < 1e-5
        assert np.max(np.abs(frames[0][1] - frames[1][1])) < 1e-5
        loops += each.GetExcludeFromArticulationAttr().Get()
        assert each.GetExcludeFromArticulationAttr().Get() == any(
            not own.in_tree for own in robot.joints.values() if own.name == prim.GetName()
        )
        free = free_of.get(prim.GetTypeName())
        if free is None:
            free = [
                k
                for k, axis in enumerate(("transX", "transY", "transZ", "rotX", "rotY", "rotZ"))
                if not prim.HasAPI(UsdPhysics.LimitAPI, axis)
            ]
        S, p = frames[0]
        for k in [k for k in range(6) if k not in free]:
            e = S[:, k % 3]
            wrench = np.concatenate([e, np.cross(p, e)]) if k < 3 else np.concatenate([np.zeros(3), e])
            row = np.zeros(6 * len(bodies))
            for end, sign in zip(ends, (-1, 1), strict=True):
                if end is not None:
                    row[6 * end : 6 * end + 6] += sign * wrench
            rows.append(row)
    singular = np.linalg.svd(np.array(rows), compute_uv=False)
    rank = int(np.sum(singular > 1e-4 * singular[0]))
    assert loops == sum(not own.in_tree for own in robot.joints.values())
    assert 6 * len(bodies) - rank == full_mobility(robot)


def test_units_the_up_axis_and_degrees(tmp_path: Path):
    robot = read(tmp_path, four_bar(), platform="bar")
    small = read(tmp_path, four_bar("Z", 0.01, "Y"), platform="bar")
    assert robot.base == small.base == "ground"
    for each in (robot, small):
        assert each.length == pytest.approx(load_length(each), rel=1e-9)
        assert np.linalg.norm(each.joints["d"].point - each.joints["c"].point) == pytest.approx(1, abs=1e-6)
        assert np.linalg.norm(each.joints["c"].point - each.joints["a"].point) == pytest.approx(2, abs=1e-6)
        limits = each.joints["a"].limits
        assert (limits.lower, limits.upper) == pytest.approx((-np.pi / 3, np.pi / 2), abs=1e-6)
        assert [name for name, joint in each.joints.items() if joint.is_actuated] == ["a"]
        assert not each.joints["d"].in_tree
        assert full_mobility(each) == 1


def load_length(robot) -> float:
    points = np.array([joint.point for joint in robot.joints.values()])
    return float(np.mean(np.linalg.norm(points - points.mean(axis=0), axis=1)))


def test_units_that_are_not_told_are_centimetres_and_said(tmp_path: Path):
    robot = read(tmp_path, four_bar().replace(" metersPerUnit = 1\n", ""), platform="bar")
    assert robot.joints["c"].point == pytest.approx((0.02, 0, 0), abs=1e-9)
    assert any("centimetres" in note.text for note in robot.notes)


def test_joints_count_from_where_the_bodies_stand(tmp_path: Path):
    """A crank that the file turned by 30 degrees about its joint: limits are counted from there, loops close."""
    angle = np.pi / 6
    turn = f"quatd xformOp:orient = ({np.cos(angle / 2):.17g}, 0, {np.sin(angle / 2):.17g}, 0)"
    text = stage(
        body("ground")
        + body("crank", more=turn, order=', "xformOp:orient"')
        + joint("hold", "", "ground", (0, 0, 0), (0, 0, 0), kind="PhysicsFixedJoint")
        + joint(
            "a",
            "ground",
            "crank",
            (0, 0, 0),
            (0, 0, 0),
            'uniform token physics:axis = "Y"\n float physics:lowerLimit = -10\n float physics:upperLimit = 90',
        )
    )
    robot = read(tmp_path, text)
    limits = robot.joints["a"].limits
    assert (limits.lower, limits.upper) == pytest.approx(np.radians([-40, 60]), abs=1e-6)
    assert robot.links["crank"].pose[:3, 0] == pytest.approx((np.cos(angle), 0, -np.sin(angle)), abs=1e-9)


def test_a_scaled_body_carries_its_joints_farther(tmp_path: Path):
    size = "double3 xformOp:scale = (2, 2, 2)"
    text = stage(
        body("ground", more=size, order=', "xformOp:scale"')
        + body("arm", (2, 0, 0))
        + joint("hold", "", "ground", (0, 0, 0), (0, 0, 0), kind="PhysicsFixedJoint")
        + joint("a", "ground", "arm", (1, 0, 0), (0, 0, 0))
    )
    assert read(tmp_path, text).joints["a"].point == pytest.approx((2, 0, 0), abs=1e-12)


LOCK = "float limit:{0}:physics:low = 1\n float limit:{0}:physics:high = -1\n"
FREEDOMS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("free", "kinds"),
    [
        (("rotX", "rotZ"), "U"),
        (("transX", "rotY"), "PR"),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in [
                ((), "F"),
                (("rotY",), "R"),
                (("transZ",), "P"),
                (("rotX", "rotY"), "U"),
                (FREEDOMS[3:], "S"),
                (("transY", "rotY"), "C"),
                (("transX", "transZ", "rotY"), "E"),
                (("transX", "transY"), "PP"),
                (("transX", "transY", "transZ"), "PPP"),
            ]
        ),
    ],
)
def test_a_d6_is_the_joint_that_its_locks_leave(free: tuple[str, ...], kinds: str, tmp_path: Path):
    locks = "".join(LOCK.format(each) for each in FREEDOMS if each not in free)
    apis = ", ".join(f'"PhysicsLimitAPI:{each}"' for each in FREEDOMS if each not in free)
    text = stage(
        body("ground")
        + body("a")
        + body("tool")
        + joint("hold", "", "ground", (0, 0, 0), (0, 0, 0), kind="PhysicsFixedJoint")
        + joint("first", "ground", "a", (0, 0, 0), (0, 0, 0))
        + joint("j", "a", "tool", (0, 0, 1), (0, 0, 0), locks, "PhysicsJoint", apis)
    )
    robot = read(tmp_path, text, platform="tool")
    found = [each for each in robot.joints.values() if each.name.partition("__")[0] == "j"]
    assert "".join(sorted(each.type for each in found)) == "".join(sorted(kinds))
    assert sum(each.type.freedoms for each in found) == len(free)
    if kinds == "U":  # the swing is fixed in the first body, the twist in the second
        (u,) = found
        assert np.abs(u.axes[1]) == pytest.approx((1, 0, 0))
        assert abs(u.axes[0][0]) < 1e-12


def test_drives_without_gains_and_doubles_that_were_overtaken(tmp_path: Path):
    robot = read(tmp_path, four_bar(crank="float drive:angular:physics:damping = 0"), platform="bar")
    assert robot.joints["a"].is_actuated
    save(robot, tmp_path / "out.usda")
    text = (tmp_path / "out.usda").read_text()
    assert "point3f physics:localPos0 = (2, 0, 0)" in text
    (tmp_path / "out.usda").write_text(
        text.replace("point3f physics:localPos0 = (2, 0, 0)", "point3f physics:localPos0 = (2.5, 0, 0)").replace(
            "double3 xformOp:translate = (2, 0, 0)", "double3 xformOp:translate = (2.5, 0, 0)"
        )
    )
    edited = load(tmp_path / "out.usda")
    assert np.linalg.norm(edited.joints["c"].point - edited.joints["a"].point) == pytest.approx(2.5, abs=1e-6)


REFUSED = [
    ("#usda 1.0\n( subLayers = [@../outside.usda@] )\n", "outside of the file's folder"),
    ('#usda 1.0\ndef "r" (references = @https://hrsynth.example/r.usd@) {}\n', "outside of the file's folder"),
    ('#usda 1.0\ndef "r" (payload = @/etc/passwd@) {}\n', "outside of the file's folder"),
    ('#usda 1.0\ndef "r" (references = @robot.urdf@) {}\n', "not a USD file"),
    ('#usda 1.0\ndef "r" (clips = { dictionary default = { asset[] assetPaths = [@/etc/passwd@] } }) {}\n', "clips"),
    ("#usda 1.0\ndef Xform {", "OpenUSD"),
    ("#usda 1.0\n", "no rigid bodies"),
    ("PXR-USDC" + "x" * 200, "OpenUSD"),
    ("PK\x03\x04....", "package"),
    (stage("").replace("metersPerUnit = 1", "metersPerUnit = 0"), "metersPerUnit"),
    (stage(body("a") + joint("j", "a", "a", (0, 0, 0), (0, 0, 0))), "to itself"),
    (stage(body("a") + body("b") + joint("j", "c", "b", (0, 0, 0), (0, 0, 0))), "physics:body0"),
    (
        stage(body("a") + body("b") + joint("j", "a", "b", (0, 0, 0), (0, 0, 0), kind="PhysicsDistanceJoint")),
        "distance joint",
    ),
]


@pytest.mark.some(2)
@pytest.mark.parametrize(
    ("text", "said"),
    [pytest.param(*each, marks=[pytest.mark.slow] * (k > 4)) for k, each in enumerate(REFUSED)],
    ids=range(len(REFUSED)),
)
def test_what_is_refused(text: str, said: str, tmp_path: Path):
    (tmp_path / "in").mkdir()
    (tmp_path / "outside.usda").write_text("#usda 1.0\n")
    (tmp_path / "in" / "robot.usda").write_text(text)
    with pytest.raises(BadRobotFile, match=said):
        load(tmp_path / "in" / "robot.usda")


def test_a_refusal_is_one_line(tmp_path: Path, capsys):
    (tmp_path / "robot.usda").write_text("#usda 1.0\ndef Xform {")
    assert run_command(["check", str(tmp_path / "robot.usda")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_layers_of_the_folder_are_composed(tmp_path: Path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "base.usda").write_text(four_bar())
    text = (
        '#usda 1.0\n( defaultPrim = "r"\n metersPerUnit = 1\n upAxis = "Z" )\n'
        'def "r" (references = @./parts/base.usda@) {}\n'
    )
    assert full_mobility(read(tmp_path, text, platform="bar")) == 1


def test_layers_that_are_not_there_are_told(tmp_path: Path):
    robot = read(
        tmp_path,
        four_bar().replace('def Xform "bar" (', 'def Xform "bar" (references = @no/meshes.usda@\n'),
        platform="bar",
    )
    assert full_mobility(robot) == 1
    assert any("no/meshes.usda" in note.text for note in robot.notes)


def test_joints_and_bodies_of_one_name_keep_their_motors(tmp_path: Path):
    """A joint called as a link keeps its name, and so do its motor and the gear that it drives."""
    mimic = "float physxMimicJoint:rotY:gearing = -2\n rel physxMimicJoint:rotY:referenceJoint = </r/crank_j/crank>"
    inner = 'def Scope "crank_j" {\ndef PhysicsRevoluteJoint "crank" ('
    text = four_bar().replace('def PhysicsRevoluteJoint "a" (', inner)
    text = text.replace(DRIVEN + "\n}", DRIVEN + "\n}\n}")
    robot = read(tmp_path, text, platform="bar")
    (motor,) = [name for name, joint in robot.joints.items() if joint.is_actuated]
    assert set(robot.joints[motor].links) == {"ground", "crank"}
    arm = stage(
        body("ground")
        + body("crank")
        + body("tool")
        + joint("hold", "", "ground", (0, 0, 0), (0, 0, 0), kind="PhysicsFixedJoint")
        + 'def Scope "crank_j" {\n'
        + joint("crank", "ground", "crank", (0, 0, 0), (0, 0, 0))
        + "}\n"
        + joint("wrist", "crank", "tool", (0, 0, 1), (0, 0, 0), mimic)
        + 'def MjcActuator "act" {\n rel mjc:target = </r/crank_j/crank>\n}\n'
    )
    robot = read(tmp_path, arm)
    assert [(c.driver, c.driven, c.ratio) for c in robot.couplings] == [("crank", "wrist", 2.0)]
    assert [robot.joints[name].successor for name in robot.joints if robot.joints[name].is_actuated] == ["crank"]


def test_a_missing_package_is_told_with_what_installs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    path = tmp_path / "robot.usda"
    path.write_text(four_bar())
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == "pxr" else found(name, *a))
    with pytest.raises(MissingExtra, match=r'pip install "hrsynth\[usd\]"'):
        load(path)
    assert run_command(["check", str(path)]) == 3
    assert capsys.readouterr().err.count("\n") == 1
    assert run_command(["convert", "3rps", str(tmp_path / "out.usdc")]) == 3
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert str(tmp_path / "out.usdc") in error


def test_no_room_for_temporary_files_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    assert run_command(["convert", "3rps", "-o", str(tmp_path / "out.usdc")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "cannot write a temporary file" in error
    assert list(tmp_path.iterdir()) == []


def test_masses_shapes_and_colours_come_back(tmp_path: Path):
    robot = load("3rps")
    shapes = (
        '<inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/><mass value="0.1"/>'
        '<inertia ixx="0.01" iyy="0.02" izz="0.03" ixy="0.001" ixz="0" iyz="-0.002"/></inertial>',
        '<visual name="hull"><origin xyz="0 0 1" rpy="0 1 0"/><geometry><box size="0.1 0.2 0.3"/></geometry>'
        '<material name=""><color rgba="1 0.5 0 1"/></material></visual>',
        '<collision><geometry><cylinder radius="0.1" length="2"/></geometry></collision>',
        '<visual><geometry><sphere radius="0.25"/></geometry></visual>',
        '<collision><geometry><capsule radius="0.1" length="0.5"/></geometry></collision>',
    )
    links = {**robot.links, robot.platform: replace(robot.links[robot.platform], xml=shapes)}
    full = replace(robot, links=links)
    assert save(full, tmp_path / "robot.usda") == ()
    back = load(tmp_path / "robot.usda")
    one, two = collect_content(full.links[full.platform], full), collect_content(back.links[back.platform], back)
    assert two.inertial.mass == 0.1
    R, S = one.inertial.X[:3, :3], two.inertial.X[:3, :3]
    assert S @ two.inertial.inertia @ S.T == pytest.approx(R @ one.inertial.inertia @ R.T, abs=1e-12)
    assert two.inertial.X[:3, 3] == pytest.approx(one.inertial.X[:3, 3], abs=1e-12)
    assert [(s.kind, s.role, s.name, s.colour) for s in two.solids] == [
        (s.kind, s.role, s.name, s.colour) for s in one.solids
    ]
    for a, b in zip(one.solids, two.solids, strict=True):
        assert b.sizes == pytest.approx(a.sizes, rel=1e-12)
        assert pytest.approx(a.X, abs=1e-12) == b.X


def test_the_colour_of_a_mesh_that_is_missing_comes_back(tmp_path: Path):
    robot = load("3rps")
    shape = (
        '<visual><geometry><mesh filename="gone.stl"/></geometry>'
        '<material name=""><color rgba="1 0.5 0 0.25"/></material></visual>',
    )
    full = replace(robot, links={**robot.links, robot.platform: replace(robot.links[robot.platform], xml=shape)})
    assert "gone.stl" in str(save(full, tmp_path / "robot.usda"))
    back = load(tmp_path / "robot.usda")
    (solid,) = collect_content(back.links[back.platform], back).solids
    assert solid.file is not None
    assert solid.file.endswith("gone.stl")
    assert solid.colour == pytest.approx((1, 0.5, 0, 0.25), abs=1e-6)


def test_every_type_has_its_place():
    from hrsynth.description.formats.usd.write import _FREE

    assert {kind: len(free) for kind, free in _FREE.items()} == {kind: kind.freedoms for kind in JointType}


MISTYPED = {
    "physics:lowerLimit": "c",
    "physics:upperLimit": "c",
    "drive:angular:physics:maxForce": "c",
    "drive:angular:physics:stiffness": "c",
    "physics:mass": "bar",
    "physics:diagonalInertia": "bar",
    "physics:principalAxes": "bar",
}
WRONG = 'string {} = "a"', "string[] {} = ['a', 'b', 'c']", "float[] {} = [1, 2]"


@pytest.mark.some(4)
@pytest.mark.parametrize("value", WRONG)
@pytest.mark.parametrize("name", MISTYPED)
def test_attributes_of_another_type_are_ignored_and_told(name: str, value: str, tmp_path: Path):
    """The robot is the one without them."""
    plain = four_bar()
    start = plain.index("{", plain.index(f'"{MISTYPED[name]}" ')) + 1
    for file, text in (("plain", plain), ("robot", f"{plain[:start]}\n{value.format(name)}\n{plain[start:]}")):
        (tmp_path / f"{file}.usda").write_text(text)
    robot = load(tmp_path / "robot.usda", platform="bar")
    assert robot.differences(load(tmp_path / "plain.usda", platform="bar")) == []
    assert [f"/r/{MISTYPED[name]}.{name}" in note.text for note in robot.notes if "of their type" in note.text] == [
        True
    ]
