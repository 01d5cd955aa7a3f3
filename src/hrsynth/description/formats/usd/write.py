"""Writer of USD text: rigid bodies of an articulation, joints of UsdPhysics, loops excluded from the articulation.

UsdPhysics holds joint frames, limits and masses in single precision, angles in degrees. The same numbers are next to
them in double precision, as attributes ``hrsynth:…`` that other programs ignore; reading prefers those if they agree.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from ....geometry.so3 import convert_to_quaternions
from ....geometry.vectors import Array, build_pose, find_perpendicular, invert_pose, normalise_vector
from ....mechanism.model import Joint, JointType, Limits, Mechanism, Note
from ... import numerals
from ...annotations import PREFIX, list_annotations
from ...contents import SIZES, Content, Solid, collect_content, find_principal_axes, list_unsupported_content
from ...file_format import Written
from ...jointgraph import join_names
from ...meshes import read_robot_meshes
from ...tree import build_spanning_mechanism, list_outward_joints
from . import EXCLUDED
from .read import FREEDOMS

_TYPES = {
    JointType.REVOLUTE: "PhysicsRevoluteJoint",
    JointType.PRISMATIC: "PhysicsPrismaticJoint",
    JointType.SPHERICAL: "PhysicsSphericalJoint",
    JointType.FIXED: "PhysicsFixedJoint",
}
_FREE = {
    JointType.REVOLUTE: ("rotX",),
    JointType.PRISMATIC: ("transX",),
    JointType.SPHERICAL: FREEDOMS[3:],
    JointType.UNIVERSAL: ("rotX", "rotY"),
    JointType.CYLINDRICAL: ("transX", "rotX"),
    JointType.PLANAR: ("transY", "transZ", "rotX"),
    JointType.FREE: FREEDOMS,
    JointType.FIXED: (),
}
"""Directions that each type leaves free in frames whose x is the axis (of a universal joint the second; y is the
first)."""


def write(mechanism: Mechanism) -> Written:
    """Return the USD text of a mechanism, and warnings of losses."""
    robot = build_spanning_mechanism(mechanism)
    return _UsdWriter(robot).write()


class _UsdWriter:
    def __init__(self, robot: Mechanism) -> None:
        self.robot = robot
        self.root = _make_identifier(robot.name, {})
        taken: dict[str, int] = {"joints": 1}
        self.names = {link: _make_identifier(link, taken) for link in robot.links}
        taken = {"to_world": 1}
        self.joints = {joint: _make_identifier(joint, taken) for joint in robot.joints}
        self.lost: list[Note] = []

    def write(self) -> Written:
        robot, body = self.robot, list[str]()
        says = [f"{key} {text}" for key, text in list_annotations(robot, motors=True)]
        body += [
            f"custom string {PREFIX}:name = {_format_text(robot.name)}",
            f"custom string[] {PREFIX}:says = [{', '.join(map(_format_text, says))}]",
        ]
        unread: list[str] = []
        contents = {name: collect_content(link, robot) for name, link in robot.links.items()}
        self.meshes = read_robot_meshes(
            [solid.file for content in contents.values() for solid in content.solids if solid.file is not None],
            robot.file,
        )
        for name, link in robot.links.items():
            body += self._body(name, link.pose, contents[name], unread)
        order = [*list_outward_joints(robot), *(joint for joint in robot.joints.values() if not joint.in_tree)]
        weld = [f"rel physics:body1 = </{self.root}/{self.names[robot.base]}>"]
        joints = _write_prim("PhysicsFixedJoint", "to_world", weld)
        joints += [line for each in order for line in self._joint(each)]
        body += _write_prim("Scope", "joints", joints)
        head = [
            "#usda 1.0",
            "(",
            f"    defaultPrim = {_format_text(self.root)}",
            "    kilogramsPerUnit = 1",
            "    metersPerUnit = 1",
            '    upAxis = "Z"',
            ")",
            "",
        ]
        text = "\n".join([*head, *_write_prim("Xform", self.root, body, ["PhysicsArticulationRootAPI"])]) + "\n"
        self.lost += list_unsupported_content(robot, SIZES, dialect="USD")
        if unread:
            what = "meshes that cannot be read are written by their names alone: "
            self.lost.append(Note("warning", what + join_names(unread)))
        wide = [
            joint.name
            for joint in robot.joints.values()
            if joint.type is JointType.SPHERICAL
            and joint.limits is not None
            and (joint.limits.lower, joint.limits.upper) != (None, None)
        ]
        if wide:
            what = "limits of spherical joints are not written: "
            self.lost.append(Note("warning", what + join_names(wide)))
        return Written((text,), tuple(self.lost))

    def _body(self, name: str, X: Array, content: Content, unread: list[str]) -> list[str]:
        apis, lines = ["PhysicsRigidBodyAPI"], [*_label(name, self.names[name]), *_transform_of(X)]
        inertial = content.inertial
        if inertial is not None and inertial.mass > 0:
            apis.append("PhysicsMassAPI")
            lines += [
                f"float physics:mass = {_format_number(inertial.mass)}",
                f"point3f physics:centerOfMass = {_format_tuple(inertial.X[:3, 3])}",
            ]
            if inertial.inertia is not None:
                R = inertial.X[:3, :3]
                tensor = inertial.inertia if np.array_equal(R, np.eye(3)) else R @ inertial.inertia @ R.T
                moments, turn = find_principal_axes(tensor)
                lines += [
                    f"float3 physics:diagonalInertia = {_format_tuple(moments)}",
                    f"quatf physics:principalAxes = {_format_tuple(convert_to_quaternions(turn))}",
                ]
                six = (*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2])
                lines.append(f"custom double[] {PREFIX}:inertia = [{', '.join(map(_format_number, six))}]")
        taken: dict[str, int] = {}
        for solid in content.solids:
            lines += self._solid(name, solid, taken, unread)
        return _write_prim("Xform", self.names[name], lines, apis)

    def _solid(self, link: str, solid: Solid, taken: dict[str, int], unread: list[str]) -> list[str]:
        """Return a shape; a mesh with its triangles and, for reading it again, the name of its file."""
        title = _make_identifier(solid.name or solid.role, taken)
        lines = [f"custom string {PREFIX}:name = {_format_text(solid.name)}"] if solid.name else []
        if solid.role == "collision":
            lines.append('uniform token purpose = "guide"')
        elif solid.colour is not None:
            red, green, blue, opacity = solid.colour
            lines.append(f"color3f[] primvars:displayColor = [{_format_tuple((red, green, blue))}]")
            if opacity != 1:
                lines.append(f"float[] primvars:displayOpacity = [{_format_number(opacity)}]")
        apis = ["PhysicsCollisionAPI"] if solid.role == "collision" else []
        kind, scale = {"box": "Cube"}.get(solid.kind, solid.kind.capitalize()), (1.0, 1.0, 1.0)
        if solid.file is not None:
            found = self.meshes[solid.file]
            lines += [
                f"custom string {PREFIX}:mesh = {_format_text(solid.file)}",
                f"custom double3 {PREFIX}:scale = {_format_tuple(solid.scale)}",
            ]
            if found is None:
                unread.append(f"{link} ({solid.file})")
                return _write_prim("Xform", title, [*lines, *_transform_of(solid.X)], apis)
            points, faces = found
            points = points * solid.scale
            rows = ", ".join(_format_tuple(np.round(point, 9) + 0.0) for point in points)
            lines += [
                f"point3f[] points = [{rows}]",
                f"int[] faceVertexCounts = [{', '.join(['3'] * len(faces))}]",
                f"int[] faceVertexIndices = [{', '.join(str(v) for v in np.ravel(faces))}]",
                'uniform token subdivisionScheme = "none"',
            ]
        elif kind == "Cube":
            lines.append("double size = 1")
            scale = solid.sizes[0], solid.sizes[1], solid.sizes[2]
        else:
            lines += [
                f"double {'height' if key == 'length' else key} = {_format_number(value)}"
                for key, value in zip(SIZES[solid.kind], solid.sizes, strict=True)
            ]
            lines += ['uniform token axis = "Z"'] * (kind != "Sphere")
        return _write_prim(kind, title, [*lines, *_transform_of(solid.X, scale)], apis)

    def _joint(self, joint: Joint) -> list[str]:
        """Return a joint between two bodies; joints without a type of USD are D6 whose other directions are locked."""
        robot, kind = self.robot, joint.type
        X_J = build_pose(joint.point, _build_frame(joint, robot))
        lines = _label(joint.name, self.joints[joint.name])
        if not joint.in_tree or kind is JointType.FREE:
            lines.append(f"uniform bool {EXCLUDED} = true")
        for side, link in enumerate(joint.links):
            X = invert_pose(robot.links[link].pose) @ X_J
            turn = convert_to_quaternions(X[:3, :3])
            lines += [
                f"rel physics:body{side} = </{self.root}/{self.names[link]}>",
                f"point3f physics:localPos{side} = {_format_tuple(X[:3, 3])}",
                f"quatf physics:localRot{side} = {_format_tuple(turn)}",
                f"custom double3 {PREFIX}:localPos{side} = {_format_tuple(X[:3, 3])}",
                f"custom quatd {PREFIX}:localRot{side} = {_format_tuple(turn)}",
            ]
        apis: list[str] = []
        free = _FREE[kind]
        if kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.SPHERICAL):
            lines.append('uniform token physics:axis = "X"')
        if kind not in _TYPES:
            for each in (each for each in FREEDOMS if each not in free):
                apis.append(f"PhysicsLimitAPI:{each}")
                lines += [f"float limit:{each}:physics:low = 1", f"float limit:{each}:physics:high = -1"]
        if joint.limits is not None:
            lines += _write_limits(kind, joint.limits, free, apis)
        if joint.motor is not None and free:
            lines += _drive(kind, joint.limits, free, apis)
        lines += self._mimic(joint, free, apis)
        return _write_prim(_TYPES.get(kind, "PhysicsJoint"), self.joints[joint.name], lines, apis)

    def _mimic(self, joint: Joint, free: tuple[str, ...], apis: list[str]) -> Iterator[str]:
        """Return a coupling in PhysX's form: q + gearing × q of the reference = 0."""
        for gear in self.robot.couplings:
            if gear.driven != joint.name:
                continue
            other = self.robot.joints[gear.driver]
            if len(free) != 1 or other.type is not joint.type:
                what = f"USD has no coupling between a rotation and a translation; not written: {gear.name}"
                self.lost.append(Note("warning", what))
                continue
            stem = f"physxMimicJoint:{free[0]}:"
            apis.append(f"PhysxMimicJointAPI:{free[0]}")
            yield f"float {stem}gearing = {_format_number(-gear.ratio)}"
            yield f"float {stem}offset = 0"
            yield f"rel {stem}referenceJoint = </{self.root}/joints/{self.joints[other.name]}>"
            yield f"custom double {PREFIX}:ratio = {_format_number(gear.ratio)}"
            yield f"custom string {PREFIX}:coupling = {_format_text(gear.name)}"


def _build_frame(joint: Joint, robot: Mechanism) -> Array:
    """Return a rotation (3, 3) with x along the axis; of a universal joint x along the second axis, y along the
    first."""
    if not joint.axes:
        return robot.links[joint.successor].pose[:3, :3]
    x = joint.axes[-1]
    y = find_perpendicular(x, joint.axes[0] if joint.type is JointType.UNIVERSAL else None)
    return np.column_stack((x, y, normalise_vector(np.cross(x, y))))


def _write_limits(kind: JointType, limits: Limits, free: tuple[str, ...], apis: list[str]) -> Iterator[str]:
    for key in ("lower", "upper", "velocity", "effort"):
        value = getattr(limits, key)
        if value is not None and not (kind is JointType.SPHERICAL and key in ("lower", "upper")):
            yield f"custom double {PREFIX}:{key} = {_format_number(value)}"
    pairs: Mapping[str, str] = {"lower": "physics:lowerLimit", "upper": "physics:upperLimit"}
    if kind is JointType.SPHERICAL or (limits.lower, limits.upper) == (None, None):
        return
    for each in free:
        factor = 180 / math.pi if each.startswith("rot") else 1.0
        if kind not in _TYPES:
            apis.append(f"PhysicsLimitAPI:{each}")
            pairs = {"lower": f"limit:{each}:physics:low", "upper": f"limit:{each}:physics:high"}
        for key, name in pairs.items():
            value = getattr(limits, key)
            if value is not None:
                yield f"float {name} = {_format_number(value * factor)}"


def _drive(kind: JointType, limits: Limits | None, free: tuple[str, ...], apis: list[str]) -> Iterator[str]:
    """Return a drive without gains (the simulator's user chooses them) for each coordinate."""
    words = {JointType.REVOLUTE: ("angular",), JointType.PRISMATIC: ("linear",)}.get(kind, free)
    for word in words:
        apis.append(f"PhysicsDriveAPI:{word}")
        yield f'uniform token drive:{word}:physics:type = "force"'
        if limits is not None and limits.effort is not None:
            yield f"float drive:{word}:physics:maxForce = {_format_number(limits.effort)}"


def _write_prim(kind: str, name: str, lines: Iterable[str], apis: Iterable[str] = ()) -> list[str]:
    """Return a prim: its schemas, and its content, indented."""
    schemas = ", ".join(map(_format_text, apis))
    head = (
        [f"def {kind} {_format_text(name)} (", f"    prepend apiSchemas = [{schemas}]", ")"]
        if schemas
        else [f"def {kind} {_format_text(name)}"]
    )
    return [*head, "{", *(f"    {line}" for line in lines), "}"]


def _transform_of(X: Array, scale: tuple[float, ...] = (1.0, 1.0, 1.0)) -> list[str]:
    """Return the transform of a prim in its parent's frame."""
    found, order = [], []
    if np.any(X[:3, 3]):
        found.append(f"double3 xformOp:translate = {_format_tuple(X[:3, 3])}")
        order.append("xformOp:translate")
    if not np.array_equal(X[:3, :3], np.eye(3)):
        found.append(f"quatd xformOp:orient = {_format_tuple(convert_to_quaternions(X[:3, :3]))}")
        order.append("xformOp:orient")
    if scale != (1.0, 1.0, 1.0):
        found.append(f"double3 xformOp:scale = {_format_tuple(scale)}")
        order.append("xformOp:scale")
    return [*found, f"uniform token[] xformOpOrder = [{', '.join(map(_format_text, order))}]"] if order else []


def _label(name: str, identifier: str) -> list[str]:
    """Return the name if USD's identifiers cannot hold it."""
    return [] if name == identifier else [f"custom string {PREFIX}:name = {_format_text(name)}"]


def _make_identifier(name: str, taken: dict[str, int]) -> str:
    """Return a name of letters, digits and underscores that no sibling has."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII) or "_"
    plain = plain if not plain[0].isdigit() else f"_{plain}"
    found, number = plain, 2
    while found in taken:
        found, number = f"{plain}_{number}", number + 1
    taken[found] = 1
    return found


def _format_text(value: str) -> str:
    """Return a text in quotes."""
    return json.dumps(value, ensure_ascii=False)


def _format_number(value: float) -> str:
    return numerals.format_exact(value)


def _format_tuple(values: Iterable[float]) -> str:
    return f"({', '.join(_format_number(float(value)) for value in values)})"
