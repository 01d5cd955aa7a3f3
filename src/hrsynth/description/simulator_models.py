"""Models of MuJoCo and Pinocchio that exist in memory: read through their exact numbers as MJCF text, and made."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from lxml import etree

from ..errors import BadRequest, MissingExtra
from ..geometry.so3 import convert_to_quaternions
from ..geometry.vectors import Array
from . import xml
from .numerals import format_exact, format_exact_vector

if TYPE_CHECKING:
    import mujoco

START = "q0"
"""Keyframe of the configuration that comes with a Pinocchio model."""
LIMIT_MAX = 1e20
"""Largest limit of a joint that counts as one."""
PURE_MOTION_MIN = 1e-12
"""Smallest part of a unit motion that is not rounding."""


def load_mujoco(what: str) -> Any:
    """Return the module mujoco, which draws without a screen on Linux; raises ``MissingExtra`` if it is not
    installed."""
    if sys.platform == "linux":
        os.environ.setdefault("MUJOCO_GL", "egl")  # read once, at the first import
    try:
        import mujoco
    except ImportError:
        raise MissingExtra(what, "bench") from None
    return mujoco


def write_model(robot: Any) -> tuple[str, str | None] | None:
    """Return the MJCF text of a model of MuJoCo or Pinocchio with the name of its keyframe, None for other objects.

    Raises ``BadRequest`` for what MJCF cannot express.
    """
    parts = robot if isinstance(robot, tuple) else (robot,)
    kind = f"{type(parts[0]).__module__.partition('.')[0]}.{type(parts[0]).__name__}" if parts else ""
    if kind == "mujoco.MjSpec":
        try:
            return _write_mujoco(parts[0].compile()), None
        except ValueError as error:
            raise BadRequest("the MjSpec", " ".join(str(error).split()), "one that MuJoCo compiles") from None
    if kind == "mujoco.MjModel":
        return _write_mujoco(parts[0]), None
    if kind == "pinocchio.Model":
        return _PinocchioText(*parts[:7]).text(), START if len(parts) > 2 else None
    return None


def _place(tag: str, position: Array, quaternion: Array, **others: str) -> xml.Element:
    """Return an element at a pose; ``quaternion`` has its scalar first."""
    pose = {"pos": format_exact_vector(position), "quat": format_exact_vector(quaternion)}
    return xml.create_element(tag, **pose, **others)


def _write_mujoco(model: mujoco.MjModel) -> str:
    """Return the bodies, joints, equalities, motors, keyframes and texts of a compiled model."""
    import mujoco

    kinds, equal = mujoco.mjtObj, mujoco.mjtEq

    def name(kind: Any, i: int) -> str:
        given: str | None = mujoco.mj_id2name(model, kind, i)
        return given or f"{kind.name.removeprefix('mjOBJ_').lower()}_{i}"

    root = etree.Element("mujoco", model=model.names.split(b"\0", 1)[0].decode() or "robot")
    etree.SubElement(root, "compiler", angle="radian")
    bodies = [etree.SubElement(root, "worldbody")]
    for i in range(1, model.nbody):
        body = _place("body", model.body_pos[i], model.body_quat[i], name=name(kinds.mjOBJ_BODY, i))
        bodies[model.body_parentid[i]].append(body)
        bodies.append(body)
        for j in range(model.body_jntadr[i], model.body_jntadr[i] + model.body_jntnum[i]):
            kind = mujoco.mjtJoint(model.jnt_type[j]).name.removeprefix("mjJNT_").lower()
            joint = etree.SubElement(body, "joint", name=name(kinds.mjOBJ_JOINT, j), type=kind)
            if kind != "free":
                joint.set("pos", format_exact_vector(model.jnt_pos[j]))
            if kind in ("hinge", "slide"):
                joint.set("axis", format_exact_vector(model.jnt_axis[j]))
                joint.set("ref", format_exact(model.qpos0[model.jnt_qposadr[j]]))
                if model.jnt_limited[j]:
                    joint.set("range", format_exact_vector(model.jnt_range[j]))
        if model.body_mass[i]:
            mass, inertia = format_exact(model.body_mass[i]), format_exact_vector(model.body_inertia[i])
            body.append(_place("inertial", model.body_ipos[i], model.body_iquat[i], mass=mass, diaginertia=inertia))
    for i in range(model.nsite):
        site = _place("site", model.site_pos[i], model.site_quat[i], name=name(kinds.mjOBJ_SITE, i))
        bodies[model.site_bodyid[i]].append(site)
    equality, turn = etree.SubElement(root, "equality"), np.array([1.0, 0, 0, 0])
    for i in range(model.neq):
        kind, data, ends = equal(model.eq_type[i]), model.eq_data[i], (model.eq_obj1id[i], model.eq_obj2id[i])
        tag = kind.name.removeprefix("mjEQ_").lower()
        element = xml.create_element(tag, name=name(kinds.mjOBJ_EQUALITY, i))
        element.set("active", "true" if model.eq_active0[i] else "false")
        if kind == equal.mjEQ_JOINT:
            element.set("polycoef", format_exact_vector(data[:5]))
            for key, j in zip(("joint1", "joint2"), ends, strict=True):
                if j >= 0:
                    element.set(key, name(kinds.mjOBJ_JOINT, j))
        elif kind in (equal.mjEQ_CONNECT, equal.mjEQ_WELD):
            rigid = kind == equal.mjEQ_WELD
            if rigid:
                element.set("torquescale", format_exact(data[10]))
            places = [(data[3:6], data[6:10]), (data[:3], turn)] if rigid else [(data[:3], turn), (data[3:6], turn)]
            for number, (j, place) in enumerate(zip(ends, places, strict=True), 1):
                title = name(kinds.mjOBJ_SITE, j)
                if model.eq_objtype[i] != kinds.mjOBJ_SITE:
                    title = f"{element.get('name')}:{number}"
                    bodies[j].append(_place("site", *place, name=title))
                element.set(f"site{number}", title)
        else:
            raise BadRequest(f"equality {element.get('name')!r} of the model", tag, "connect, weld or joint")
        equality.append(element)
    actuator = etree.SubElement(root, "actuator")
    for i in range(model.nu):
        kind = mujoco.mjtTrn(model.actuator_trntype[i])
        if kind in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
            driven = name(kinds.mjOBJ_JOINT, model.actuator_trnid[i, 0])
            etree.SubElement(actuator, "motor", name=name(kinds.mjOBJ_ACTUATOR, i), joint=driven)
        elif kind == mujoco.mjtTrn.mjTRN_TENDON:
            raise BadRequest("an actuator of the model", name(kinds.mjOBJ_ACTUATOR, i), "actuators of joints")
    keyframe = etree.SubElement(root, "keyframe")
    for i in range(model.nkey):
        etree.SubElement(keyframe, "key", name=name(kinds.mjOBJ_KEY, i), qpos=format_exact_vector(model.key_qpos[i]))
    custom = etree.SubElement(root, "custom")
    for i in range(model.ntext):
        start = model.text_adr[i]
        data = bytes(model.text_data[start : start + model.text_size[i] - 1]).decode()
        etree.SubElement(custom, "text", name=name(kinds.mjOBJ_TEXT, i), data=data)
    return xml.format_document(root)


class _PinocchioText:
    """MJCF text of a Pinocchio model; with the other fields of a ``PinocchioExport``, as far as they are given."""

    def __init__(
        self,
        model: Any,
        loops: Sequence[Any] = (),
        q0: Array | None = None,
        _joints: object = None,
        motors: Sequence[str] = (),
        _closures: object = None,
        couplings: Sequence[Array] = (),
    ) -> None:
        self.model, self.loops, self.q0, self.motors, self.couplings = model, loops, q0, motors, couplings
        self.root = etree.Element("mujoco", model=model.name or "robot")
        self.world = etree.SubElement(self.root, "worldbody")
        self.bodies = [self.world]
        self.values: dict[str, list[float]] = {}
        """MuJoCo's coordinates of each joint in the configuration."""
        self.origins: dict[int, Array] = {}
        """Origin of the frame of a joint's body in the joint's frame, unless it is the same."""

    def _add(self, tag: str, name: str, i: int, X: Any, parent: xml.Element | None = None) -> xml.Element:
        """Add an element at a pose in the frame of a joint."""
        position = X.translation - self.origins.get(i, np.zeros(3))
        element = _place(tag, position, convert_to_quaternions(X.rotation), name=name)
        (self.bodies[i] if parent is None else parent).append(element)
        return element

    def text(self) -> str:
        """Return all of it."""
        etree.SubElement(self.root, "compiler", angle="radian")
        main, links = dict[int, Any](), [frame for frame in self.model.frames if frame.type.name == "BODY"]
        for frame in links:
            i, X = frame.parentJoint, frame.placement
            still = not i or self.model.joints[i].shortname() == "JointModelFreeFlyer"
            if X.isIdentity(0.0) or (not still and np.array_equal(X.rotation, np.eye(3))):
                main.setdefault(i, frame)
        if 0 in main and main[0].name != "world":
            self.bodies[0] = etree.SubElement(self.world, "body", name=main[0].name)
        taken = {frame.name for frame in links}
        for i in range(1, self.model.njoints):
            title = str(self.model.names[i])
            if i in main:
                self.origins[i] = main[i].placement.translation
                title = main[i].name
            elif title in taken:
                title = f"{title}_body"
            self._add_joint(i).set("name", title)
        for frame in links:
            if main.get(frame.parentJoint) is not frame:
                self._add("body", frame.name, frame.parentJoint, frame.placement)
        self._add_relations()
        if self.q0 is not None:
            keyframe = etree.SubElement(self.root, "keyframe")
            qpos = [value for joint in self.world.iter("joint") for value in self.values[str(joint.get("name"))]]
            etree.SubElement(keyframe, "key", name=START, qpos=format_exact_vector(qpos))
        return xml.format_document(self.root)

    def _add_joint(self, i: int) -> xml.Element:
        """Add the bodies of a joint, one for each placement in it; return the last one."""
        model, joint, name = self.model, self.model.joints[i], str(self.model.names[i])
        carrier, body = model.parents[i], self.bodies[model.parents[i]]
        parts, origin = list(_list_parts(joint, model.jointPlacements[i], name)), self.origins.get(i, np.zeros(3))
        last = max(number for number, part in enumerate(parts) if part[0] is not None)
        for number, (X, tag, axis, start, count) in enumerate(parts):
            if X is not None:
                X = X * type(X)(np.eye(3), origin) if number == last else X
                parent = self.world if tag == "free" else body
                body = self._add("body", f"{name}__{number + 1}_body", carrier if number == 0 else 0, X, parent)
            title = name if len(parts) == 1 else f"{name}__{number + 1}"
            element = etree.SubElement(body, "joint", name=title, type=tag)
            if tag != "free":
                element.set("pos", format_exact_vector(-origin if number >= last else np.zeros(3)))
            if axis is not None:
                element.set("axis", format_exact_vector(axis))
            if count == 1:
                limits = model.lowerPositionLimit[start], model.upperPositionLimit[start]
                if max(map(abs, limits)) < LIMIT_MAX and limits[0] < limits[1]:
                    element.set("range", format_exact_vector(limits))
            if self.q0 is not None:
                self.values[title] = _convert_value(tag, self.q0[start : start + count])
        inertia = model.inertias[i]
        if inertia.mass:
            six = inertia.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            values = {"pos": inertia.lever - origin, "mass": [inertia.mass], "fullinertia": six}
            written = {key: format_exact_vector(value) for key, value in values.items()}
            body.append(xml.create_element("inertial", **written))
        self.bodies.append(body)
        return body

    def _add_relations(self) -> None:
        """Add loops, couplings and motors."""
        equality, actuator = etree.SubElement(self.root, "equality"), etree.SubElement(self.root, "actuator")
        for number, loop in enumerate(self.loops, 1):
            title = loop.name or f"loop_{number}"
            ends = (loop.joint1_id, loop.joint1_placement), (loop.joint2_id, loop.joint2_placement)
            for k, (i, X) in enumerate(ends, 1):
                self._add("site", f"{title}:{k}", i, X)
            sites = {f"site{k}": f"{title}:{k}" for k in (1, 2)}
            tag = {3: "connect", 6: "weld"}.get(loop.residualSize())
            if tag is None:
                raise BadRequest(f"constraint {title!r}", type(loop).__name__, "one of 3 or 6 dimensions")
            equality.append(xml.create_element(tag, name=title, **sites))
        column = {self.model.joints[i].idx_v: str(self.model.names[i]) for i in range(1, self.model.njoints)}
        zero: Array = np.zeros(self.model.nq) if self.q0 is None else self.q0
        for row in self.couplings:
            driving, driven = sorted(np.flatnonzero(row), key=lambda k: abs(row[k] - 1.0))[::-1]
            ratio = -row[driving] / row[driven]
            joints = (self.model.joints[self.model.getJointId(column[k])] for k in (driven, driving))
            y, x = (float(zero[joint.idx_q]) for joint in joints)
            polynomial = format_exact_vector((y - ratio * x, ratio, 0, 0, 0))
            etree.SubElement(equality, "joint", joint1=column[driven], joint2=column[driving], polycoef=polynomial)
        for motor in self.motors:
            etree.SubElement(actuator, "motor", name=f"motor_{motor}", joint=motor)


Part = tuple[Any, str, "Array | None", int, int]
"""Placement before a part of a joint (None: that of the part before it), its type in MJCF, its axis, and where its
coordinates begin and how many they are."""


def _list_parts(joint: Any, X: Any, name: str) -> Iterator[Part]:
    """Yield the parts of a joint of Pinocchio after its placement. Raises ``BadRequest`` for screws and mimics."""
    kind, start = joint.shortname(), joint.idx_q
    if kind == "JointModelComposite":
        chain = joint.extract()
        for part, before in zip(chain.joints, chain.jointPlacements, strict=True):
            yield from _list_parts(part, X * before, name)
            X = type(X).Identity()
        return
    if kind in ("JointModelSpherical", "JointModelFreeFlyer"):
        yield X, "ball" if kind == "JointModelSpherical" else "free", None, start, joint.nq
        return
    data = joint.createData()
    neutral = np.zeros(start + joint.nq)
    if joint.nq > joint.nv:  # the last angle is its cosine and sine
        neutral[-2] = 1.0
    joint.calc(data, neutral)
    for k, (linear, angular) in enumerate(np.array(data.S).reshape(6, -1).T.reshape(-1, 2, 3)):
        slides, turns = (np.linalg.norm(part) > PURE_MOTION_MIN for part in (linear, angular))
        if slides == turns or "Mimic" in kind:
            raise BadRequest(f"joint {name!r} of the model", kind, "turns, slides, ball and free joints")
        count = 2 if k == joint.nv - 1 and joint.nq > joint.nv else 1
        yield None if k else X, "slide" if slides else "hinge", linear if slides else angular, start + k, count


def _convert_value(tag: str, q: Array) -> list[float]:
    """Return MuJoCo's coordinates of a part of a joint: an angle, and quaternions with the scalar first."""
    if tag in ("ball", "free"):
        return [*q[:-4], q[-1], *q[-4:-1]]
    return [float(np.arctan2(q[1], q[0]))] if len(q) == 2 else [float(q[0])]
