"""Closures that files state in unusual words: read, or told with what would close them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from description.foreign.examples import (
    GEPETTO_POINT,
    MJCF,
    SDF,
    URDF,
    A,
    B,
    C,
    D,
    X,
    _frame,
    along,
    at,
    ends,
    urdf,
    words,
)
from description.foreign.test_dialects import lines, mobility
from hrsynth.description import load, save
from hrsynth.errors import BadRequest, BadRobotFile
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import JointType, Mechanism
from hrsynth.mechanism.normal import reduce_to_normal_form
from oracle import Oracle

FOUR = sorted(tuple(point + 0.0) for point in (A, B, C, D))
DRAKE = urdf("").replace("<robot", '<robot xmlns:drake="http://drake.mit.edu"', 1)
BALL = (
    '<drake:ball_constraint><drake:ball_constraint_body_A name="rocker"/><drake:ball_constraint_body_B name="bar"/>'
    f'<drake:ball_constraint_p_AP value="{at("rocker", C)}"/><drake:ball_constraint_p_BQ value="{at("bar", C)}"/>'
    "</drake:ball_constraint>"
)
PIN = (
    f'<link name="pin"/><joint name="d" type="continuous"><parent link="rocker"/><child link="pin"/>'
    f'<origin xyz="{at("rocker", C)}"/><axis xyz="{along("rocker")}"/></joint>'
)


def read(folder: Path, text: str, ending: str = "urdf", **given: object) -> Mechanism:
    path = folder / f"robot.{ending}"
    path.write_text(text)
    return load(path, **given)


def notes(robot: Mechanism, kind: str) -> list[str]:
    return [note.text for note in robot.notes if note.kind == kind]


def is_the_four_bar(robot: Mechanism) -> bool:
    normal = reduce_to_normal_form(robot).mechanism
    return lines(normal) == FOUR and mobility(normal) == 1


def frames(one: str, two: str) -> str:
    return urdf(_frame(one, "rocker", C) + _frame(two, "bar", C))


def test_a_ball_constraint_of_drake_closes_the_loop(tmp_path: Path):
    assert is_the_four_bar(read(tmp_path, DRAKE.replace("</robot>", BALL + "</robot>")))
    wrong = DRAKE.replace("</robot>", BALL.replace('A name="rocker"', 'A name="rokker"') + "</robot>")
    with pytest.raises(BadRobotFile, match=r"ball_constraint.*rokker"):
        read(tmp_path, wrong)


@pytest.mark.parametrize("declared", [True, False])
def test_a_ball_constraint_in_sdf_does_too_its_prefix_declared_or_not(declared: bool, tmp_path: Path):
    text = SDF["1.7"]
    start = text.index('<joint name="d"')
    text = text[:start] + text[text.index("</joint>", start) + 8 :]
    said = {"body_A": "rocker", "p_AP": at("rocker", C), "body_B": "bar", "p_BQ": at("bar", C)}
    tag = "drake:ball_constraint"
    ball = f"<{tag}>" + "".join(f"<{tag}_{key}>{value}</{tag}_{key}>" for key, value in said.items()) + f"</{tag}>"
    text = text.replace("</model>", ball + "</model>")
    if declared:
        text = text.replace("<sdf", '<sdf xmlns:drake="drake.mit.edu"', 1)
    robot = read(tmp_path, text, "sdf")
    assert is_the_four_bar(robot)
    assert any("declares the prefix 'drake'" in each for each in notes(robot, "ignored")) is not declared


STIFF = {"0 0 0": JointType.SPHERICAL, "9 9 0": JointType.REVOLUTE, "9 9 9": JointType.FIXED}


@pytest.mark.parametrize("torque", STIFF)
def test_a_bushing_is_the_joint_that_its_stiffness_leaves(torque: str, tmp_path: Path):
    """The z axes of both frames lie along the hinge."""
    text = "".join(
        f'<frame name="f{k}" link="{link}" xyz="{at(link, C)}" rpy="{rpy(link)}"/>'
        for k, link in enumerate(("rocker", "bar"))
    )
    text += (
        f'<drake:linear_bushing_rpy><drake:bushing_frameA name="f0"/><drake:bushing_frameC name="f1"/>'
        f'<drake:bushing_torque_stiffness value="{torque}"/><drake:bushing_force_stiffness value="7 7 7"/>'
        "</drake:linear_bushing_rpy>"
    )
    path = tmp_path / "robot.urdf"
    path.write_text(DRAKE.replace("</robot>", text + "</robot>"))
    if STIFF[torque] is JointType.FIXED:
        robot = load(path, platform="bar")
        assert mobility(robot) == 0
    else:
        robot = load(path)
        assert is_the_four_bar(robot)
    assert any(f"read as a {STIFF[torque].name.lower()} joint" in each for each in notes(robot, "assumption"))


def test_a_bushing_that_is_no_joint_of_loops_is_told(tmp_path: Path):
    text = (
        '<drake:linear_bushing_rpy><drake:bushing_frameA name="rocker"/><drake:bushing_frameC name="bar"/>'
        '<drake:bushing_torque_stiffness value="0 0 0"/><drake:bushing_force_stiffness value="0 0 7"/>'
        "</drake:linear_bushing_rpy>"
    )
    robot = read(tmp_path, DRAKE.replace("</robot>", text + "</robot>"), platform="bar")
    assert any("--close rocker:bar:spherical" in each for each in notes(robot, "open"))
    assert mobility(robot) == 3


def rpy(link: str) -> str:
    """The orientation in a link of a frame whose z axis is the world's y axis."""
    R = X[link][:3, :3].T @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).astype(float)
    return words((np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0])))


PLUGIN = (
    '<plugin filename="libgz-sim-detachable-joint-system.so" name="gz::sim::systems::DetachableJoint">'
    "<parent_link>{}</parent_link><child_model>{}</child_model><child_link>bar</child_link></plugin>"
)


@pytest.mark.parametrize("model", ["four_bar", "", "name_it_was_spawned_with"])
def test_a_detachable_joint_of_gazebo_holds_links_as_they_lie(model: str, tmp_path: Path):
    """Of a model of another name, which the robot may be when it is spawned, where the frames coincide."""
    text = urdf(f"{PIN}<gazebo>{PLUGIN.format('pin', model)}</gazebo>")
    robot = read(tmp_path, text, platform="bar")
    if model.startswith("name"):
        assert mobility(robot) == 4
        assert any("--close pin:bar:fixed" in each for each in notes(robot, "open"))
        eye = (
            f'<link name="eye"/><joint name="eye_fixed" type="fixed"><parent link="bar"/><child link="eye"/>'
            f'<origin xyz="{at("bar", C)}" rpy="{_rpy(X["bar"][:3, :3].T @ X["rocker"][:3, :3])}"/></joint>'
        )
        text = text.replace(PIN, PIN + eye).replace(">bar<", ">eye<")
        robot = read(tmp_path, text)
    assert is_the_four_bar(robot)
    assert any("detachable joint" in each for each in notes(robot, "assumption"))


@pytest.mark.parametrize("model", ["four_bar", "__model__"])
def test_so_does_one_in_sdf(model: str, tmp_path: Path):
    text = SDF["1.7"].replace(
        '<joint name="d" type="revolute"><parent>rocker</parent><child>bar</child>',
        '<joint name="d" type="revolute"><parent>rocker</parent><child>pin</child>',
    )
    pin = f'<link name="pin"><pose>{words(X["bar"][:3, 3])} {_rpy(X["bar"][:3, :3])}</pose></link>'
    text = text.replace("<joint", pin + "<joint", 1).replace("</model>", PLUGIN.format("pin", model) + "</model>")
    assert is_the_four_bar(read(tmp_path, text, "sdf"))


def _rpy(R: Array) -> str:
    return words((np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0])))


def test_detachable_joints_to_another_model_and_attachers_are_told(tmp_path: Path):
    text = SDF["1.7"].replace("</model>", PLUGIN.format("rocker", "cup").replace(">bar<", ">handle<") + "</model>")
    assert any("'handle' of the model 'cup'" in each for each in notes(read(tmp_path, text, "sdf"), "ignored"))
    attacher = '<plugin name="links" filename="libgazebo_ros_link_attacher.so"/>'
    robot = read(tmp_path, urdf(f"<gazebo>{attacher}</gazebo>"), platform="bar")
    assert any("does not name them: use --close A:B:TYPE" in each for each in notes(robot, "open"))
    for title in ('name="holder" filename="libholder.so"', ""):  # a plugin may have lost its name
        named = f"<plugin {title}><link_1>rocker</link_1><link_2>bar</link_2></plugin>"
        robot = read(tmp_path, urdf(f"<gazebo>{named}</gazebo>"), platform="bar")
        assert any("--close rocker:bar:fixed" in each for each in notes(robot, "open"))


PAIRS = [
    ("l1_cl1_1", "l1_cl1_2"),
    ("closedloop1_A_3D", "closedloop1_B_3D"),
    ("closedloop_knee_1A", "closedloop_knee_1B"),
    ("left_closure_a", "left_closure_b"),
    ("loop_closing.1", "loop_closing.2"),
    ("closing_d_1", "closing_d_2"),
]


@pytest.mark.parametrize("pair", PAIRS)
def test_paired_frames_of_any_spelling_close_loops(pair: tuple[str, str], tmp_path: Path):
    robot = read(tmp_path, frames(*pair))
    assert is_the_four_bar(robot)
    if not pair[0].startswith("closing"):
        assert any(f"{pair[0]}:{pair[1]}:spherical" in each for each in notes(robot, "assumption"))
    sites = MJCF["sites"].replace('<connect name="d" site1="s" site2="t"/>', "")
    assert is_the_four_bar(read(tmp_path, sites.replace('"s"', f'"{pair[0]}"').replace('"t"', f'"{pair[1]}"'), "xml"))


def test_the_name_says_that_frames_are_held_rigidly(tmp_path: Path):
    text = frames("closedloop1_A_6D", "closedloop1_B_6D")
    assert mobility(read(tmp_path, text, platform="bar")) == 0
    assert is_the_four_bar(read(tmp_path, text, close="closedloop1_A_6D:closedloop1_B_6D:3d"))


@pytest.mark.parametrize(
    "pair",
    [
        ("hand_1", "hand_2"),
        ("foot_A", "foot_B"),
        ("close_1", "close_2"),
        ("clip_1", "clip_2"),
        ("closure_1_left", "closure_1_right"),
        ("closed_loop1", "closed_loop2"),
    ],
)
def test_frames_of_other_names_are_not_held_together(pair: tuple[str, str], tmp_path: Path):
    assert mobility(read(tmp_path, frames(*pair), platform="bar")) == 3


def test_three_frames_of_a_kind_are_no_pair(tmp_path: Path):
    text = urdf(_frame("closure_1", "rocker", C) + _frame("closure_2", "bar", C) + _frame("closure_3", "crank", C))
    assert mobility(read(tmp_path, text, platform="bar")) == 3


def test_paired_frames_beside_other_closures_are_told(tmp_path: Path):
    loop = f'<loop name="d" type="spherical">{ends("predecessor", "rocker")}{ends("successor", "bar")}</loop>'
    robot = read(tmp_path, urdf(loop + _frame("cl1_1", "crank", B) + _frame("cl1_2", "bar", B)))
    assert is_the_four_bar(robot)
    assert any("--close cl1_1:cl1_2:spherical" in each for each in notes(robot, "open"))


def test_a_yaml_file_of_another_name_gives_the_closures(tmp_path: Path):
    text, yaml = GEPETTO_POINT
    (tmp_path / "other.yaml").write_text("gains: [1, 2]\n")
    (tmp_path / "closures.yaml").write_text(yaml)
    robot = read(tmp_path, text)
    assert is_the_four_bar(robot)
    assert any("closures.yaml" in each for each in notes(robot, "assumption"))
    assert is_the_four_bar(load(tmp_path / "closures.yaml"))
    (tmp_path / "unlike.yaml").write_text(yaml.replace("one", "none"))
    assert is_the_four_bar(load(tmp_path / "robot.urdf"))
    (tmp_path / "more.yml").write_text(yaml)
    with pytest.raises(BadRobotFile, match=r"several YAML files next to it close its loops.*closures.yaml, more.yml"):
        load(tmp_path / "robot.urdf")
    (tmp_path / "robot.yaml").write_text(yaml)
    assert is_the_four_bar(load(tmp_path / "robot.urdf"))


@pytest.mark.parametrize("kind", ["revolute", "spherical", "ball"])
def test_a_loop_joint_with_parent_and_child_is_read(kind: str, tmp_path: Path):
    text = (
        f'<loop_joint name="d" type="{kind}"><parent link="rocker"/><child link="bar"/><parent_origin xyz="'
        f'{at("rocker", C)}"/><child_origin xyz="{at("bar", C)}"/><axis xyz="{along("rocker")}" frame="parent"/>'
        "</loop_joint>"
    )
    assert is_the_four_bar(read(tmp_path, urdf(text)))
    with pytest.raises(BadRobotFile, match="loop_joint"):
        read(tmp_path, urdf(text.replace('<child link="bar"/>', "")))


def test_a_world_that_nobody_declares_is_the_ground(tmp_path: Path):
    text = URDF["urdf+"].replace('<link name="base"/>', "").replace('parent link="base"', 'parent link="world"')
    robot = read(tmp_path, text)
    assert is_the_four_bar(robot)
    assert robot.base == "world"
    assert any("'world' is declared" in each for each in notes(robot, "assumption"))


def test_hyphens_in_comments_and_undeclared_prefixes_are_told_and_read(tmp_path: Path):
    text = URDF["urdf+"].replace("\n", "\n<!-- a -- b -->\n<!-- c --->\n<gz:plugin odd:kind='1'/>\n", 1)
    robot = read(tmp_path, text)
    assert is_the_four_bar(robot)
    told = notes(robot, "ignored")
    assert any("2 comments that hold '--'" in each and "line 2" in each for each in told)
    assert {each.split("'")[1] for each in told if "prefix" in each} == {"gz", "odd"}
    for broken in ("<!-- a -- b ", "<gz:plugin></odd:plugin>", "<:a/>", "<gz:/>"):
        with pytest.raises(BadRobotFile, match="malformed XML"):
            read(tmp_path, URDF["urdf+"].replace("\n", f"\n{broken}\n", 1))
    many = "".join(f"<p{k}:a/>" for k in range(40))
    with pytest.raises(BadRobotFile, match="malformed XML"):
        read(tmp_path, URDF["urdf+"].replace("\n", f"\n{many}\n", 1))


def test_points_of_links_are_closed_by_flag(tmp_path: Path):
    wish = f"rocker@{at('rocker', C).replace(' ', ',')}:bar@{at('bar', C).replace(' ', ',')}"
    for close in (wish, f"{wish}:spherical", [wish]):
        assert is_the_four_bar(read(tmp_path, urdf(""), close=close))
    both = read(tmp_path, urdf(_frame("hook", "crank", B)), close=f"{wish}, hook:bar@0,0,0")
    assert sum(not joint.in_tree for joint in both.joints.values()) == 2
    for wrong in (
        "rocker@1,2:bar",
        "rocker@1,2,3",
        "rocker@a,b,c:bar",
        "rocker@1,2,1e99:bar",
        "rocker@1,2,3:none",
        "rocker@1,2,3:rocker",
        "rocker@1,2,3:bar:odd",
        ":",
        "@",
        "",
        "a:b:c:d",
    ):
        with pytest.raises(BadRequest, match="--close"):
            read(tmp_path, urdf(""), close=wrong)


def test_names_of_nested_models_are_no_types(tmp_path: Path):
    text = (
        '<sdf version="1.9"><model name="m"><link name="g"/>'
        '<model name="n"><link name="a"/><link name="b"/></model>'
        '<joint name="i" type="revolute"><parent>g</parent><child>n::a</child></joint>'
        '<joint name="j" type="revolute"><parent>g</parent><child>n::b</child></joint></model></sdf>'
    )
    robot = read(tmp_path, text, "sdf", close="n::a:n::b:fixed", platform="n::b")
    assert [joint.links for joint in robot.joints.values() if not joint.in_tree] == [("n::a", "n::b")]


def spherical(seed: int, points: bool) -> str:
    """Two or three R-R-R legs to a ball about a random centre; all but one are closed in points on their last axes."""
    rng = np.random.default_rng(seed)
    centre, legs = rng.uniform(-1, 1, 3), 2 + seed % 2
    text, closures = "", ""
    for leg in range(legs):
        axes = rng.normal(size=(3, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        inner = f'<joint name="j{leg}3" axis="{words(axes[2])}" pos="{words(centre + rng.normal() * axes[2])}"/>'
        last = leg == legs - 1
        tip = f'<body name="ball">{inner}</body>' if last else ""
        text += (
            f'<body name="a{leg}"><joint name="j{leg}1" axis="{words(axes[0])}" pos="{words(centre)}"/>'
            f'<body name="b{leg}"><joint name="j{leg}2" axis="{words(axes[1])}" pos="{words(centre + axes[1])}"/>'
            f"{tip}</body></body>"
        )
        if not last:
            for distance in (0.7,) if points else (0.7, -0.4):
                closures += (
                    f'<connect name="c{leg}{distance}" body1="b{leg}" body2="ball" '
                    f'anchor="{words(centre + distance * axes[2])}"/>'
                )
    return f'<mujoco><worldbody><body name="base">{text}</body></worldbody><equality>{closures}</equality></mujoco>'


@pytest.mark.some(3)
@pytest.mark.parametrize("seed", range(6))
def test_points_in_spherical_loops_are_hinges_through_the_centre(seed: int, tmp_path: Path):
    robot = read(tmp_path, spherical(seed, True), "xml", platform="ball")
    hinges = read(tmp_path, spherical(seed, False), "xml", platform="ball")
    assert all(joint.type is JointType.REVOLUTE for joint in robot.joints.values() if not joint.in_tree)
    assert {joint.type for joint in robot.joints.values()} == {joint.type for joint in hinges.joints.values()}
    assert mobility(robot) == mobility(hinges) == 3
    for name, joint in robot.joints.items():
        if not joint.in_tree:
            other = next(each for key, each in hinges.joints.items() if key.startswith(name[:2]))
            assert np.linalg.norm(np.cross(joint.axis, other.axis)) < 1e-9
    assert any("closes a spherical loop" in each for each in notes(robot, "merged"))


def test_a_point_at_the_centre_stays_a_point(tmp_path: Path):
    text = spherical(0, True)
    where = text.index('anchor="')
    rng = np.random.default_rng(0)
    centre = words(rng.uniform(-1, 1, 3))
    text = text[:where] + f'anchor="{centre}"' + text[text.index('"', where + 8) + 1 :]
    robot = read(tmp_path, text, "xml", platform="ball")
    assert [joint.type for joint in robot.joints.values() if not joint.in_tree] == [JointType.SPHERICAL]


def test_a_point_that_is_not_active_is_told_with_what_would_close_it(tmp_path: Path):
    off = MJCF["connect"].replace('<connect name="d"', '<connect name="d" active="false"')
    (told,) = notes(read(tmp_path, off, "xml", platform="bar"), "ignored")
    wish = told.partition("--close ")[2].partition(" closes it")[0]
    assert is_the_four_bar(read(tmp_path, off, "xml", close=wish))
    unknown = off.replace('body2="bar"', 'body2="none"')
    assert notes(read(tmp_path, unknown, "xml", platform="bar"), "ignored") == ["the inactive equality 'd'"]


def test_a_free_joint_is_no_bar(tmp_path: Path):
    text = MJCF["connect"].replace('<body name="base">', '<body name="base"><freejoint name="floats"/>')
    robot = read(tmp_path, text, "xml")
    assert is_the_four_bar(robot)
    assert robot.base == "base"
    assert any("'base' floats" in each for each in notes(robot, "assumption"))
    kept = read(tmp_path, text, "xml", base="world", platform="bar")
    assert kept.base == "world"


def test_a_base_in_another_component_is_looked_from(tmp_path: Path):
    text = urdf(f'<loop name="d" type="spherical">{ends("predecessor", "rocker")}{ends("successor", "bar")}</loop>')
    other = (
        '<link name="table"/><link name="leg"/><joint name="t" type="continuous"><parent link="table"/>'
        '<child link="leg"/></joint>'
    )
    text = text.replace('<link name="base"/>', other + '<link name="base"/>', 1)
    with pytest.raises(BadRequest, match="no such platform link"):
        read(tmp_path, text, platform="bar")
    robot = read(tmp_path, text, base="base", platform="bar")
    assert is_the_four_bar(robot)
    assert mobility(reduce_to_normal_form(read(tmp_path, text, base="crank", platform="rocker")).mechanism) == 1


@pytest.mark.parametrize("name", ["urdf+", "constraint", "onshape"])
def test_millimetres_are_asked_for_and_read(name: str, tmp_path: Path):
    metres = read(tmp_path, URDF[name], platform="bar")
    large = re.sub(
        r'xyz="([^"]*)"', lambda found: f'xyz="{words([1000 * float(x) for x in found[1].split()])}"', URDF[name]
    )
    asked = read(tmp_path, large, platform="bar")
    assert any("--unit mm" in each for each in notes(asked, "open"))
    assert asked.length == pytest.approx(1000 * metres.length)
    small = read(tmp_path, large, platform="bar", unit="mm")
    assert not any("--unit" in each for each in notes(small, "open"))
    assert small.length == pytest.approx(metres.length)
    assert is_the_four_bar(small)
    with pytest.raises(BadRequest, match="--unit"):
        read(tmp_path, large, unit="furlong")


def test_slides_and_gears_are_scaled_with_the_lengths(tmp_path: Path):
    text = (
        '<robot name="r"><link name="g"/><link name="s"/><link name="t"/>'
        '<joint name="p" type="prismatic"><parent link="g"/><child link="s"/>'
        '<limit lower="-100" upper="300" velocity="50" effort="7"/></joint>'
        '<joint name="r" type="continuous"><parent link="g"/><child link="t"/>'
        '<mimic joint="p" multiplier="0.01"/></joint></robot>'
    )
    robot = read(tmp_path, text, platform="t", unit="mm")
    limits = robot.joints["p"].limits
    assert limits is not None
    assert (limits.lower, limits.upper, limits.velocity, limits.effort) == (-0.1, 0.3, 0.05, 7)
    assert [each.ratio for each in robot.couplings] == [10.0]


def test_shapes_are_scaled_with_the_lengths(tmp_path: Path):
    shapes = (
        '<visual><origin xyz="10 0 0" rpy="0 0 1"/><geometry><box size="100 200 300"/></geometry></visual>'
        '<visual><geometry><mesh filename="a.stl"/></geometry></visual>'
        '<inertial><origin xyz="5 0 0"/><mass value="2"/>'
        '<inertia ixx="7" iyy="7" izz="7" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    robot = read(
        tmp_path,
        URDF["urdf+"].replace('<link name="crank"/>', f'<link name="crank">{shapes}</link>'),
        platform="bar",
        unit="mm",
    )
    box, mesh, inertial = robot.links["crank"].xml
    assert 'xyz="0.01 0 0" rpy="0 0 1"' in box
    assert 'size="0.1 0.2 0.3"' in box
    assert 'scale="0.001 0.001 0.001"' in mesh
    assert 'xyz="0.005 0 0"' in inertial
    assert 'value="2"' in inertial
    assert 'ixx="7"' in inertial
    assert any("masses and inertias are not scaled" in each for each in notes(robot, "open"))


def test_what_was_read_is_written_and_read_back(tmp_path: Path):
    for number, text in enumerate(
        (
            DRAKE.replace("</robot>", BALL + "</robot>"),
            frames("l1_cl1_1", "l1_cl1_2"),
            urdf(f"{PIN}<gazebo>{PLUGIN.format('pin', 'four_bar')}</gazebo>"),
        )
    ):
        robot = read(tmp_path, text)
        for ending in ("urdf", "xml", "sdf", "yaml"):
            save(robot, tmp_path / f"back{number}{ending}.{ending}")
            back = load(tmp_path / f"back{number}{ending}.{ending}")
            assert np.allclose(lines(reduce_to_normal_form(back).mechanism), FOUR, atol=1e-9)
            oracle = Oracle(back)
            assert oracle.mobility(oracle.zero()) == 1
