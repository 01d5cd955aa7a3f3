"""One four-bar in every dialect: R joints with the axis y at A, B, C and D; most link frames are tilted."""

from __future__ import annotations

import numpy as np

from hrsynth.geometry.vectors import Array, build_pose, convert_rpy_to_rotation, invert_pose

A, B, C, D = (np.array(p) for p in ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (2.0, 0.0, 1.5), (2.2, 0.0, 0.0)))
Y = np.array([0.0, 1.0, 0.0])
TILTS = {"base": (0, 0, 0), "crank": (0.1, -0.2, 0.3), "bar": (0.3, 0.2, -0.4), "rocker": (-0.5, 0.1, 0.2)}
ORIGINS = {"base": A, "crank": A, "bar": B, "rocker": D}
X: dict[str, Array] = {name: build_pose(ORIGINS[name], convert_rpy_to_rotation(*TILTS[name])) for name in TILTS}


def words(values: object) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(v)) for v in np.ravel(np.asarray(values)))


def at(link: str, point: Array) -> str:
    """A point of the world in a link's frame."""
    return words((invert_pose(X[link]) @ np.append(point, 1.0))[:3])


def along(link: str, direction: Array = Y) -> str:
    """A direction of the world in a link's frame."""
    return words(X[link][:3, :3].T @ direction)


def rpy(R: Array) -> str:
    """Roll, pitch, yaw of a rotation."""
    return words((np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0])))


def _joint(name: str, parent: str, child: str, extra: str = "") -> str:
    relative = invert_pose(X[parent]) @ X[child]
    return (
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(relative[:3, 3])}" rpy="{rpy(relative[:3, :3])}"/><axis xyz="{along(child)}"/>'
        f"{extra}</joint>"
    )


def _frame(name: str, link: str, point: Array, z: Array = Y) -> str:
    """A link fixed to another at a point of the world, its z axis along a direction of the world."""
    x = np.array([1.0, 0.0, 0.0])
    R = X[link][:3, :3].T @ np.column_stack((x, np.cross(z, x), z))
    return (
        f'<link name="{name}"/><joint name="{name}_fixed" type="fixed"><parent link="{link}"/>'
        f'<child link="{name}"/><origin xyz="{at(link, point)}" rpy="{rpy(R)}"/></joint>'
    )


TREE = (
    '<link name="base"/><link name="crank"/><link name="bar"/><link name="rocker"/>'
    + _joint("a", "base", "crank")
    + _joint("b", "crank", "bar")
    + _joint("c", "base", "rocker")
)
MOTOR = '<transmission name="m"><joint name="a"/></transmission>'


def urdf(closure: str) -> str:
    """The URDF tree with something that closes its loop."""
    return f'<robot name="four_bar">\n{TREE}\n{closure}\n{MOTOR}</robot>'


def ends(tag: str, link: str, extra: str = "") -> str:
    return f'<{tag} link="{link}"><origin xyz="{at(link, C)}"/>{extra}</{tag}>'


URDF = {
    "urdf+": urdf(f'<loop name="d" type="spherical">{ends("predecessor", "rocker")}{ends("successor", "bar")}</loop>'),
    "two joints, one child": urdf(
        _frame("tip", "bar", C) + '<joint name="d" type="continuous"><parent link="rocker"/><child link="tip"/>'
        f'<origin xyz="{at("rocker", C)}" rpy="{rpy(X["rocker"][:3, :3].T @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]])}"/>'
        '<axis xyz="0 0 1"/></joint>'
    ),
    "gazebo": urdf(
        f'<gazebo><joint name="d" type="revolute"><parent>rocker</parent><child>bar</child>'
        f"<pose>{at('bar', C)} 0 0 0</pose><axis><xyz>{along('bar')}</xyz></axis></joint></gazebo>"
    ),
    "gazebo, model axis": urdf(
        f'<gazebo><joint name="d" type="revolute"><parent>rocker</parent><child>bar</child><pose>{at("bar", C)} 0 0 0'
        "</pose><axis><xyz>0 1 0</xyz><use_parent_model_frame>1</use_parent_model_frame></axis></joint></gazebo>"
    ),
    "constraint": urdf(
        f'<constraint name="d" type="revolute"><parent link="rocker"/><parent_origin xyz="{at("rocker", C)}"/>'
        f'<parent_axis xyz="{along("rocker")}"/><child link="bar"/><child_origin xyz="{at("bar", C)}"/>'
        f'<child_axis xyz="{along("bar")}"/></constraint>'
    ),
    "loop_joint": urdf(
        f'<loop_joint name="d" type="spherical"><link1 link="rocker" xyz="{at("rocker", C)}"/>'
        f'<link1 link="bar" xyz="{at("bar", C)}"/></loop_joint>'
    ),
    "onshape": urdf(_frame("closing_d_1", "rocker", C) + _frame("closing_d_2", "bar", C)),
    "onshape hinge": urdf(
        "".join(
            _frame(f"closing_d_{k}{z}", link, C + offset * Y)
            for k, link in ((1, "rocker"), (2, "bar"))
            for z, offset in (("", 0.0), ("_z", 0.1))
        )
    ),
}

GEPETTO_POINT = (
    urdf(_frame("one", "rocker", C) + _frame("two", "bar", C)).replace(MOTOR, ""),
    "closed_loop: [['one', 'two']]\ntype: ['3d']\nname_mot: ['a']\n",
)
GEPETTO_RIGID = (
    urdf(
        f'<link name="pin"/><joint name="d" type="continuous"><parent link="rocker"/><child link="pin"/>'
        f'<origin xyz="{at("rocker", C)}"/><axis xyz="{along("rocker")}"/></joint>'
        + _frame("two", "bar", C).replace(
            rpy(X["bar"][:3, :3].T @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]]), rpy(X["bar"][:3, :3].T @ X["rocker"][:3, :3])
        )
    ).replace(MOTOR, ""),
    "closed_loop:\n- [pin, two]\ntype: ['6d']\nname_mot: [a]\n",
)


def quat(R: Array) -> str:
    """w x y z of a rotation with a positive trace."""
    w = np.sqrt(1 + np.trace(R)) / 2
    return words((w, (R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w)))


def _body(name: str, parent: str, joint: str, inside: str = "") -> str:
    relative = invert_pose(X[parent]) @ X[name]
    return (
        f'<body name="{name}" pos="{words(relative[:3, 3])}" quat="{quat(relative[:3, :3])}">'
        f'<joint name="{joint}" axis="{along(name)}"/>{inside}</body>'
    )


def mjcf(equality: str, bar: str = "", rocker: str = "", head: str = "") -> str:
    """The MJCF tree with something that closes its loop."""
    crank = _body("crank", "base", "a", _body("bar", "crank", "b", bar))
    return (
        f'<mujoco model="four_bar">{head}<worldbody><body name="base">{crank}'
        f"{_body('rocker', 'base', 'c', rocker)}</body></worldbody><equality>{equality}</equality>"
        '<actuator><motor name="m" joint="a"/></actuator></mujoco>'
    )


_PIN = X["rocker"][:3, :3].T @ X["bar"][:3, :3]
MJCF = {
    "connect": mjcf(f'<connect name="d" body1="rocker" body2="bar" anchor="{at("rocker", C)}"/>'),
    "two connects": mjcf(
        f'<connect name="d" body1="rocker" body2="bar" anchor="{at("rocker", C)}"/>'
        f'<connect body1="rocker" body2="bar" anchor="{at("rocker", C + Y)}"/>'
    ),
    "sites": mjcf(
        '<connect name="d" site1="s" site2="t"/>',
        f'<site name="t" pos="{at("bar", C)}"/>',
        f'<frame pos="{at("rocker", C)}"><site name="s"/></frame>',
    ),
    "weld behind a joint": mjcf(
        '<weld name="w" body1="pin" body2="bar"/>',
        rocker=(f'<body name="pin" pos="{at("rocker", C)}"><joint name="d" axis="{along("rocker")}"/></body>'),
    ),
    "classes and degrees": mjcf(
        f'<connect name="d" body1="rocker" body2="bar" anchor="{at("rocker", C)}"/>',
        head=(
            '<compiler angle="degree" eulerseq="XYZ"/><default><joint range="-90 90"/><default class="other">'
            '<joint type="slide"/></default></default>'
        ),
    ),
}


def _link(name: str) -> str:
    return f'<link name="{name}"><pose>{words(X[name][:3, 3])} {rpy(X[name][:3, :3])}</pose></link>'


def _sdf_joint(name: str, parent: str, child: str, point: Array, axis: str, flag: str = "", where: str = "") -> str:
    place = where or f"<pose>{at(child, point)} 0 0 0</pose>"
    return (
        f'<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child>{place}'
        f"<axis><xyz{axis}</xyz>{flag}</axis></joint>"
    )


def sdf(version: str, style: str) -> str:
    """The joint graph in SDFormat, its axes given in the model's frame or in the joints'."""
    joints = []
    for name, parent, child, point in (
        ("a", "base", "crank", A),
        ("b", "crank", "bar", B),
        ("c", "base", "rocker", D),
        ("d", "rocker", "bar", C),
    ):
        axis, flag, where = f">{along(child)}", "", ""
        if style in ("model", "flag"):
            axis = ">0 1 0"
            flag = "<use_parent_model_frame>1</use_parent_model_frame>" if style == "flag" else ""
        elif style == "expressed":
            axis = ' expressed_in="__model__">0 1 0'
            where = f'<pose relative_to="{parent}">{at(parent, point)} 0 0 0</pose>'
        joints.append(_sdf_joint(name, parent, child, point, axis, flag, where))
    if style == "expressed":
        joints.append('<frame name="eye" attached_to="bar"><pose>0 0 1 0 0 0</pose></frame>')
    return (
        f'<sdf version="{version}"><model name="four_bar"><pose>1 2 3 0.4 0.5 0.6</pose>'
        + "".join(map(_link, X))
        + "".join(joints)
        + "</model></sdf>"
    )


SDF = {
    "1.4": sdf("1.4", "model"),
    "1.5": sdf("1.5", "joint"),
    "1.6": sdf("1.6", "flag"),
    "1.7": sdf("1.7", "joint"),
    "1.11": sdf("1.11", "expressed"),
}

FILES: dict[str, dict[str, str]] = {
    **{f"urdf: {name}": {"robot.urdf": text} for name, text in URDF.items()},
    "gepetto: 3d": {"robot.urdf": GEPETTO_POINT[0], "robot.yaml": GEPETTO_POINT[1]},
    "gepetto: 6d": {"robot.urdf": GEPETTO_RIGID[0], "robot.yaml": GEPETTO_RIGID[1]},
    **{f"mjcf: {name}": {"robot.xml": text} for name, text in MJCF.items()},
    **{f"sdf: {name}": {"robot.sdf": text} for name, text in SDF.items()},
}
"""Name of the example, its files; the first one is what is read."""

_BALL = "drake:ball_constraint"
_BALL_SDF = {"body_A": "rocker", "p_AP": at("rocker", C), "body_B": "bar", "p_BQ": at("bar", C)}
_OPEN_SDF = SDF["1.7"][: SDF["1.7"].index('<joint name="d"')]
_BUSHING = (
    '<frame name="f" link="rocker" xyz="0 0 1"/><drake:linear_bushing_rpy><drake:bushing_frameA name="f"/>'
    '<drake:bushing_frameC name="bar"/><drake:bushing_torque_stiffness value="9 9 0"/>'
    '<drake:bushing_force_stiffness value="7 7 7"/></drake:linear_bushing_rpy>'
)
_HOLDER = (
    '<plugin filename="libgz-sim-detachable-joint-system.so" name="gz::sim::systems::DetachableJoint">'
    "<parent_link>rocker</parent_link><child_model>four_bar</child_model><child_link>bar</child_link></plugin>"
)
EXTENDED: dict[str, dict[str, str]] = {
    "drake ball": {
        "robot.urdf": urdf(
            f'<{_BALL}><{_BALL}_body_A name="rocker"/><{_BALL}_p_AP value="{at("rocker", C)}"/>'
            f'<{_BALL}_body_B name="bar"/>'
            f'<{_BALL}_p_BQ value="{at("bar", C)}"/></{_BALL}><!-- a -- b -->'
        )
    },
    "drake ball in sdf": {
        "robot.sdf": f"{_OPEN_SDF}<{_BALL}>"
        + "".join(f"<{_BALL}_{key}>{value}</{_BALL}_{key}>" for key, value in _BALL_SDF.items())
        + f"</{_BALL}></model></sdf>"
    },
    "bushing": {"robot.urdf": urdf(_BUSHING)},
    "detachable": {"robot.urdf": urdf(f"<gazebo>{_HOLDER}</gazebo>")},
    "detachable in sdf": {"robot.sdf": f"{_OPEN_SDF}{_HOLDER}</model></sdf>"},
    "pairs": {"robot.urdf": urdf(_frame("l1_cl1_1", "rocker", C) + _frame("l1_cl1_2", "bar", C))},
    "loop_joint": {
        "robot.urdf": urdf(
            f'<loop_joint name="d" type="revolute"><parent link="rocker"/><child link="bar"/><parent_origin xyz="'
            f'{at("rocker", C)}"/><child_origin xyz="{at("bar", C)}"/><axis xyz="{along("rocker")}"/></loop_joint>'
        )
    },
    "other yaml": {"robot.urdf": GEPETTO_POINT[0], "closures.yaml": GEPETTO_POINT[1]},
    "free": {"robot.xml": MJCF["connect"].replace('<body name="base">', '<body name="base"><freejoint/>')},
    "sites": {
        "robot.xml": MJCF["sites"]
        .replace('<connect name="d" site1="s" site2="t"/>', "")
        .replace('"s"', '"cl1_a"')
        .replace('"t"', '"cl1_b"')
    },
    "copies": {
        "robot.xml": MJCF["connect"].replace(
            "<worldbody>",
            '<tendon><fixed name="t"><joint joint="k" coef="1"/><joint joint="l" coef="2"/></fixed></tendon><equality>'
            '<tendon tendon1="t"/></equality><worldbody><replicate count="3" euler="0 0 120"><body name="p">'
            '<joint name="k"/><body name="q" pos="1 0 0"><joint name="l"/></body></body></replicate>',
        )
    },
    "attached": {
        "robot.xml": '<mujoco><asset><model name="m" file="child.xml"/></asset><worldbody><body><joint/>'
        '<attach model="m" prefix="x"/></body></worldbody></mujoco>',
        "child.xml": MJCF["connect"],
    },
}
"""Closures in words that only some tools know: damaged, too."""
