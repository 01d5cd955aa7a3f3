"""A robot as a physical MuJoCo model: MJCF text with rods, masses and velocity servos on the robot's own motors.

Every body's frame is the base frame at the zero configuration, so that joint centres and axes are written as they are
and a simulated body's pose is the displacement of its link. The loops are cut at their loosest joints; a cut joint is
hung on one link as a light body that is welded to the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree as Xml

import numpy as np

from ..errors import BadMechanism
from ..geometry.vectors import Array
from ..kinematics.pinocchio_model import choose_slide_direction
from ..mechanism import Joint, JointType, Mechanism, graphs
from ..mechanism.screws import split_elementary

GRAVITY_ACCELERATION = 9.81
"""m/s²."""
ROD_DENSITY = 1500.0
"""Density of all rods (kg/m³)."""
MUJOCO_ROD_RADIUS_FRACTION = 0.02
"""Radius of all rods, in characteristic lengths of the robot."""
MUJOCO_STEP_S = 5e-4
"""Seconds of a step of the simulation."""
STIFF = {"solref": "0.001 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
"""Loops that keep closed to micrometres."""
ROTOR_INERTIA_FRACTION = 1e4
"""Rotor inertia of a geared motor: fraction of the inertia of a rod as long as the robot."""
MOTOR_TIME_CONSTANT_S = 0.004
"""Time constant of a motor's velocity servo with that rotor (s)."""
CUT_JOINT_INERTIA_FRACTION = 100.0
"""Inertia added to a joint through which a loop is cut: fraction of the same; its light body yields without."""
PASSIVE_DAMPING_FRACTION = 1e-3
"""Damping of passive joints, as a fraction of that inertia per second."""
ACTUATED_TREE_WEIGHT_COUNT = 100.0
_WEIGHTS = {"F": 0.0, "R": 1.0, "P": 1.0, "C": 2.0, "U": 2.0, "E": 3.0, "S": 4.0}


@dataclass
class MujocoModel:
    """The MJCF element of a mechanism under construction."""

    mechanism: Mechanism
    root: Xml.Element = field(default_factory=lambda: Xml.Element("mujoco"))

    @property
    def radius(self) -> float:
        """Radius of the rods (m)."""
        return MUJOCO_ROD_RADIUS_FRACTION * self.mechanism.length


def mockup(mechanism: Mechanism) -> str:
    """Return the MJCF of a mechanism that moves from its zero configuration under gravity along −z; motors are named as
    their joints. Raises ``BadMechanism`` for a joint with six dof."""
    made = MujocoModel(mechanism)
    root = made.root
    root.set("model", mechanism.name)
    Xml.SubElement(
        root,
        "option",
        timestep=str(MUJOCO_STEP_S),
        gravity=f"0 0 {-GRAVITY_ACCELERATION}",
        integrator="implicitfast",
        iterations="100",
        tolerance="1e-12",
    )
    Xml.SubElement(root, "compiler", angle="radian", autolimits="false", inertiafromgeom="true")
    Xml.SubElement(Xml.SubElement(root, "default"), "geom", contype="0", conaffinity="0", density=str(ROD_DENSITY))
    world = Xml.SubElement(root, "worldbody")
    equality = Xml.SubElement(root, "equality")
    actuator = Xml.SubElement(root, "actuator")
    tree, loops = _cut(mechanism)
    bodies = {mechanism.base: world}
    _rods(made, world, mechanism.base)
    for joint, parent in tree:
        link = joint.other(parent)
        bodies[link] = _body(bodies[parent], link)
        _joints(made, bodies[link], joint if parent == joint.predecessor else joint.turned())
        _rods(made, bodies[link], link)
    for joint in loops:
        _loop(made, bodies, equality, joint)
    _drive(made, actuator, [joint for joint, _ in tree])
    _gears(mechanism, equality)
    return Xml.tostring(root, encoding="unicode")


def _cut(mechanism: Mechanism) -> tuple[list[tuple[Joint, str]], list[Joint]]:
    """Joints of a spanning tree, each with the link it hangs on, and the others; motors are never cut."""
    joints = list(mechanism.joints.values())
    for joint in joints:
        if joint.type is JointType.FREE:
            raise BadMechanism(f"{mechanism.name}: a joint with six dof has no MuJoCo model", joint.name)
    weights = [
        _WEIGHTS[joint.type.value] - (ACTUATED_TREE_WEIGHT_COUNT if joint.is_actuated else 0.0) for joint in joints
    ]
    tree = graphs.build_spanning_forest(mechanism.links, joints, weights)
    ordered = [(joint, near) for joint, near, _ in graphs.order_outward(mechanism.base, tree)]
    return ordered, [joint for joint in joints if all(joint is not each for each in tree)]


def coordinates(joint: Joint) -> Iterator[tuple[str, str, Array]]:
    """Yield name, MJCF type and axis of the simulated joints that make up a joint."""
    if joint.type is JointType.SPHERICAL:
        yield joint.name, "ball", np.array([0.0, 0.0, 1.0])
        return
    found = split_elementary(joint.type, joint.axes, choose_slide_direction)
    for number, (kind, axis) in enumerate(found):
        yield (
            f"{joint.name}__{number}" if len(found) > 1 else joint.name,
            "slide" if kind is JointType.PRISMATIC else "hinge",
            axis,
        )


def _joints(made: MujocoModel, body: Xml.Element, joint: Joint, extra: float = 0.0) -> None:
    for name, kind, axis in coordinates(joint):
        inertia = _inertia(made.mechanism, kind)
        moving = {
            "armature": (ROTOR_INERTIA_FRACTION if joint.is_actuated else extra) * inertia,
            "damping": 0.0 if joint.is_actuated else PASSIVE_DAMPING_FRACTION * inertia,
        }
        Xml.SubElement(
            body,
            "joint",
            {name: f"{value:.9g}" for name, value in moving.items()},
            name=name,
            type=kind,
            pos=_text(joint.point),
            axis=_text(axis),
        )


def _loop(made: MujocoModel, bodies: Mapping[str, Xml.Element], equality: Xml.Element, joint: Joint) -> None:
    """Close a loop: a ball by its centre, any other joint by a light body on one link that is welded to the other."""
    a, b = joint.links
    if joint.type is JointType.SPHERICAL:
        Xml.SubElement(
            equality, "connect", STIFF, body1=_name(made, a), body2=_name(made, b), anchor=_text(joint.point)
        )
        return
    half = _body(bodies[a], f"{joint.name}__cut")
    _joints(made, half, joint, CUT_JOINT_INERTIA_FRACTION)
    Xml.SubElement(half, "geom", type="sphere", size=_text([made.radius / 2]), pos=_text(joint.point), group="3")
    Xml.SubElement(equality, "weld", STIFF, body1=f"{joint.name}__cut", body2=_name(made, b), anchor=_text(joint.point))


def _drive(made: MujocoModel, actuator: Xml.Element, tree: list[Joint]) -> None:
    for joint in tree:
        for name, kind, _ in coordinates(joint) if joint.is_actuated else ():
            gain = ROTOR_INERTIA_FRACTION / MOTOR_TIME_CONSTANT_S * _inertia(made.mechanism, kind)
            Xml.SubElement(actuator, "velocity", name=name, joint=name, kv=f"{gain:.9g}")


def _gears(mechanism: Mechanism, equality: Xml.Element) -> None:
    for coupling in mechanism.couplings:
        names = {"joint1": coupling.driven, "joint2": coupling.driver}
        Xml.SubElement(equality, "joint", STIFF, **names, polycoef=f"0 {coupling.ratio} 0 0 0")


def _body(parent: Xml.Element, name: str) -> Xml.Element:
    return Xml.SubElement(parent, "body", name=name)


def _name(made: MujocoModel, link: str) -> str:
    return "world" if link == made.mechanism.base else link


def rods(mechanism: Mechanism, link: str) -> list[tuple[Array, Array]]:
    """The ends of a link's rods at the zero configuration: between two joint centres, or from more to their middle."""
    centres: list[Array] = []
    for joint in mechanism.joints_of(link):
        if all(np.linalg.norm(joint.point - each) > 1e-6 * mechanism.length for each in centres):
            centres.append(joint.point)
    if len(centres) < 2:
        return []
    if len(centres) == 2:
        return [(centres[0], centres[1])]
    middle = np.mean(centres, axis=0)
    return [(middle, each) for each in centres if np.linalg.norm(each - middle) > 1e-6 * mechanism.length]


def _rods(made: MujocoModel, body: Xml.Element, link: str) -> None:
    """The rods of a link; a ball where its joints have one centre."""
    found = rods(made.mechanism, link)
    for start, end in found:
        Xml.SubElement(body, "geom", type="capsule", size=_text([made.radius]), fromto=_text([*start, *end]))
    if not found:
        centres = [joint.point for joint in made.mechanism.joints_of(link)] or [np.zeros(3)]
        Xml.SubElement(body, "geom", type="sphere", size=_text([2 * made.radius]), pos=_text(centres[0]))


def _inertia(mechanism: Mechanism, kind: str) -> float:
    """A rod as long as the robot: its mass (kg) for what slides, else its mass times its squared length (kg m²)."""
    mass = ROD_DENSITY * np.pi * MUJOCO_ROD_RADIUS_FRACTION**2 * mechanism.length**3
    return mass if kind == "slide" else mass * mechanism.length**2


def _text(values: object) -> str:
    return " ".join(f"{float(value):.17g}" for value in np.ravel(np.asarray(values)))
