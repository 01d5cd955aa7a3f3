"""Reader of USD: rigid bodies, joints of UsdPhysics between them, drives as motors; units and up axis of the stage."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ....errors import BadRobotFile, Defect
from ....geometry.so3 import convert_from_quaternion
from ....geometry.vectors import Array, build_pose, freeze_array, invert_pose, normalise_vector, rotate_about_axis
from ....mechanism.model import JointType, Limits, Link, Motor, make_fresh_name
from ....tolerances import EXACT_INCIDENCE_TOL, INCIDENCE_TOL, VECTOR_LENGTH_MIN
from ... import xml
from ...annotations import PREFIX, drop_world, read_annotation
from ...chains import name_chain_joint
from ...contents import Content, Inertial, Solid, rotate_z_to, write_fragments
from ...conversion import find_joint_value
from ...file_format import RobotFile
from ...jointgraph import ORIGIN, CouplingSpec, FrameSpec, JointGraph, JointSpec, join_names
from ...jointmotion import compute_closure_residual
from ...numerals import FILE_NUMBER_MAX, format_exact_vector
from . import EXCLUDED
from .stage import read_prims

SINGLE_PRECISION_TOL = 1e-6
"""Relative difference up to which a number of single precision equals one of double precision."""

AXES = {"X": np.eye(3)[0], "Y": np.eye(3)[1], "Z": np.eye(3)[2]}
_KINDS = {
    "PhysicsRevoluteJoint": JointType.REVOLUTE,
    "PhysicsPrismaticJoint": JointType.PRISMATIC,
    "PhysicsSphericalJoint": JointType.SPHERICAL,
    "PhysicsFixedJoint": JointType.FIXED,
}
FREEDOMS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
_BOUNDS = "lowerLimit", "upperLimit", "low", "high", "maxForce"
_NUMBERS = *_BOUNDS, "mass", "stiffness", "damping", "gearing", "offset", "radius", "height", "size"
_LENGTHS = dict.fromkeys(_NUMBERS, 0)
_LENGTHS |= dict.fromkeys(("centerOfMass", "diagonalInertia", "localPos0", "localPos1", "scale"), 3)
_LENGTHS |= {"principalAxes": 4, "localRot0": 4, "localRot1": 4, "inertia": 6}
"""Numbers in the value of an attribute, by the last part of its name; 0 for a number."""
_SPACES = {"physics", "limit", "drive", "physxMimicJoint", PREFIX}
_SWINGS = "D6 joints with two swings (Y, Z) are universal joints, first Y, then Z"
_MIMIC = re.compile(r"physxMimicJoint:(\w+):gearing")


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of a USD stage. Raises ``BadRobotFile`` with all its defects, ``MissingExtra`` without the
    package of OpenUSD."""
    if file.data.startswith(b"PK"):
        raise xml.make_file_error(
            file.path,
            "a zip archive, such as a package of USD files",
            "the robot file in it, unzipped",
        )
    told = read_prims(file.path)
    return _StageReader(str(file.path), told).graph()


@dataclass(eq=False)
class _Prim:
    """Prim: its values and relationships, its pose (4, 4) without scale in the z-up world in metres, its scale."""

    path: str
    kind: str
    apis: tuple[str, ...]
    values: Mapping[str, Any]
    relations: Mapping[str, list[str]]
    name: str
    told: Mapping[str, Any]
    X: Array = field(default_factory=lambda: ORIGIN)
    M: Array = field(default_factory=lambda: np.eye(3))
    """Rotation and scale of its coordinates (3, 3), in metres."""

    def has_api(self, api: str) -> bool:
        return any(each == api or each.startswith(api + ":") for each in self.apis)


@dataclass
class _StageReader:
    file: str
    told: Mapping[str, Any]
    defects: list[Defect] = field(default_factory=list)
    bodies: dict[str, str] = field(default_factory=dict)
    """Link of each rigid body, by the path of its prim."""
    titles: dict[str, list[str]] = field(default_factory=dict)
    """Joints that each joint is read as, by the path of its prim."""
    mistyped: list[str] = field(default_factory=list)
    """Attributes whose values have not the type of their schema."""

    def defect(self, path: str, what: str, value: object = None, allowed: str | None = None) -> None:
        found = None if value is None else str(value)
        self.defects.append(Defect(self.file, None, f"<{path}>: {what}", found, allowed))

    def require_sound(self) -> None:
        if self.defects:
            raise BadRobotFile(self.defects)

    def graph(self) -> JointGraph:
        """Return the bodies, joints, drives, and annotations of our writer."""
        told = self.told
        self.metres = self._positive("metersPerUnit", told["metres"])
        self.kilograms = self._positive("kilogramsPerUnit", told["kilograms"])
        self.up = build_pose(rotation=rotate_about_axis((1, 0, 0), math.pi / 2)) if told["up"] == "Y" else np.eye(4)
        self.require_sound()
        self.prims = {each["path"]: self._prim(each) for each in told["prims"]}
        own = [each for each in self.prims.values() if isinstance(each.values.get(f"{PREFIX}:says"), list | dict)]
        name = own[0].values.get(f"{PREFIX}:name") if own else None
        graph = self.result = JointGraph(str(name or told["name"] or "robot"), self.file, "USD")
        if not told["metres_told"]:
            graph.note("assumption", "lengths are in centimetres, USD's default without metersPerUnit")
        if told["missing"]:
            graph.note("ignored", f"contents of missing files: {join_names(told['missing'])}")
        if self.mistyped:
            graph.note("ignored", f"attributes whose values are not of their type: {join_names(self.mistyped)}")
        for prim in self.prims.values():
            if prim.has_api("PhysicsRigidBodyAPI"):
                self._body(prim)
        joints = [prim for prim in self.prims.values() if prim.told["joint"]]
        if not self.bodies:
            self.defect("/", "no rigid bodies", None, "prims with PhysicsRigidBodyAPI")
        self.require_sound()
        graph.is_articulated = any(prim.has_api("PhysicsArticulationRootAPI") for prim in self.prims.values())
        self.world = graph.fresh("world")
        self.poses = {link: self.prims[path].X for path, link in self.bodies.items()}
        self.poses[self.world] = ORIGIN
        self._contents()
        for prim in joints:
            self._joint(prim)
        self._hold_kinematic()
        graph.note_assumed()
        self.require_sound()
        self._mimics(joints)
        if any(self.world in joint.links for joint in graph.joints.values()):
            graph.links = {self.world: Link(self.world), **graph.links}
            graph.base = self.world
        else:
            graph.base = next(
                (
                    self.bodies[path]
                    for path, prim in self.prims.items()
                    if path in self.bodies and prim.has_api("PhysicsArticulationRootAPI")
                ),
                None,
            )
        self._stand(graph)
        if own:
            self._says(own[0])
        else:
            self._drives(joints)
        self.require_sound()
        return drop_world(graph)

    def _positive(self, what: str, value: float) -> float:
        if not 0 < value <= FILE_NUMBER_MAX:
            self.defect("/", what, value, "a number above 0")
        return float(value)

    def _prim(self, told: Mapping[str, Any]) -> _Prim:
        """Return a prim with its pose: USD's matrices act on rows, and its lengths are in units of the stage."""
        values = {key: value for key, value in told["values"].items() if _has_type(key, value)}
        label = values.get(f"{PREFIX}:name")
        self.mistyped += [f"{told['path']}.{key}" for key in told["values"] if key not in values]
        name = label if isinstance(label, str) and label else told["name"]
        found = _Prim(told["path"], told["type"], tuple(told["apis"]), values, told["relations"], name, told)
        if told["X"] is None:
            return found
        W = np.array(told["X"], dtype=float).T
        if not np.all(np.abs(W) <= FILE_NUMBER_MAX):
            self.defect(found.path, "transform not finite or too large")
            return found
        found.M = self.metres * (self.up[:3, :3] @ W[:3, :3])
        U, sizes, V = np.linalg.svd(W[:3, :3])
        if not sizes[-1] > VECTOR_LENGTH_MIN * max(1.0, sizes[0]):
            if told["shape"] or found.has_api("PhysicsRigidBodyAPI"):
                self.defect(found.path, "transform with zero volume")
            return found
        R = W[:3, :3] if np.max(np.abs(W[:3, :3].T @ W[:3, :3] - np.eye(3))) < EXACT_INCIDENCE_TOL else U @ V
        R = -R if np.linalg.det(R) < 0 else R
        found.X = freeze_array(build_pose(self.metres * (self.up[:3, :3] @ W[:3, 3]), self.up[:3, :3] @ R))
        return found

    def _body(self, prim: _Prim) -> None:
        graph, name = self.result, prim.name
        if name in graph.links:
            parent = prim.path.split("/")[-2]
            name = graph.fresh(f"{parent}_{name}" if parent else name)
        graph.links[name] = Link(name)
        self.bodies[prim.path] = name

    def _carrier(self, path: str) -> str | None:
        """Return the body that a prim belongs to: itself or the nearest one above it; None for the world."""
        while path and path != "/":
            if path in self.bodies:
                return path
            path = path.rpartition("/")[0]
        return None

    def _contents(self) -> None:
        """Read masses and shapes of the bodies."""
        inertials = {path: self._inertial(self.prims[path]) for path in self.bodies}
        solids: dict[str, list[Solid]] = {path: [] for path in self.bodies}
        lost = []
        for prim in self.prims.values():
            carrier = self._carrier(prim.path)
            if carrier is None or not (prim.told["shape"] or f"{PREFIX}:mesh" in prim.values):
                continue
            solid = self._solid(prim, self.prims[carrier])
            if solid is None:
                lost.append(prim.path)
            else:
                solids[carrier].append(solid)
        if lost:
            self.result.note("ignored", f"{len(lost)} shapes that other formats do not have: {join_names(lost)}")
        for path, link in self.bodies.items():
            content = write_fragments(Content(inertials[path], tuple(solids[path])))
            self.result.links[link] = Link(link, xml=content)

    def _inertial(self, prim: _Prim) -> Inertial | None:
        """Return an inertia of UsdPhysics; a mass or moments of zero are computed by the simulator, and left out."""
        values = prim.values
        mass = _round_single(values.get("physics:mass"))
        if not mass > 0:
            return None
        centre = _read_vector(values.get("physics:centerOfMass"))
        centre = np.zeros(3) if centre is None else prim.X[:3, :3].T @ prim.M @ centre
        moments, turn = (
            _read_vector(values.get("physics:diagonalInertia")),
            _read_quaternion(values.get("physics:principalAxes")),
        )
        if moments is None or not np.any(moments):
            return Inertial(mass * self.kilograms, freeze_array(build_pose(centre)))
        R = np.eye(3) if turn is None else convert_from_quaternion(normalise_vector(turn))
        inertia = self.kilograms * self.metres**2 * (R @ np.diag(moments) @ R.T)
        exact = values.get(f"{PREFIX}:inertia")
        if isinstance(exact, list) and len(exact) == 6:
            xx, yy, zz, xy, xz, yz = exact
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            inertia = (
                tensor
                if np.max(np.abs(tensor - inertia)) <= SINGLE_PRECISION_TOL * np.max(np.abs(inertia))
                else inertia
            )
        return Inertial(mass * self.kilograms, freeze_array(build_pose(centre)), freeze_array(inertia))

    def _solid(self, prim: _Prim, body: _Prim) -> Solid | None:
        """Return a shape in the frame of its body, if its kind and scale are known."""
        values, X = prim.values, invert_pose(body.X) @ prim.X
        stretch = prim.X[:3, :3].T @ prim.M
        sizes = np.diag(stretch)
        role = "collision" if self._has_collision(prim, body) else "visual"
        name = prim.name if values.get(f"{PREFIX}:name") else None
        colour = tuple(prim.told["colour"]) if prim.told["colour"] is not None and role == "visual" else None
        if np.max(np.abs(stretch - np.diag(sizes))) > SINGLE_PRECISION_TOL * np.max(np.abs(sizes)) or not np.all(
            sizes > 0
        ):
            return None
        if f"{PREFIX}:mesh" in values or prim.kind == "Mesh":
            address = values.get(f"{PREFIX}:mesh")
            own = f"{self.file.rpartition('/')[2]}#{prim.path}"
            scale = _read_vector(values.get(f"{PREFIX}:scale"))
            factors = tuple(float(v) for v in (sizes if address is None or scale is None else scale))
            return Solid("mesh", (), freeze_array(X), role, name, colour, str(address or own), factors)
        along = AXES.get(str(values.get("axis", "Z")), AXES["Z"])
        long = float(along @ sizes)
        across = [float(size) for size, each in zip(sizes, along, strict=True) if not each]
        rounds = max(sizes) - min(sizes) <= SINGLE_PRECISION_TOL * max(sizes)
        radius, height = (_round_single(values.get(key)) for key in ("radius", "height"))
        turned = freeze_array(X @ build_pose(rotation=rotate_z_to(along))) if not along[2] else freeze_array(X)
        if prim.kind == "Cube":
            edges = tuple(_round_single(values.get("size", 2.0)) * float(size) for size in sizes)
            return Solid("box", edges, freeze_array(X), role, name, colour) if min(edges) > 0 else None
        if prim.kind == "Sphere" and rounds and radius > 0:
            return Solid("sphere", (radius * float(sizes[0]),), freeze_array(X), role, name, colour)
        if (
            prim.kind in ("Cylinder", "Capsule")
            and abs(across[0] - across[1]) <= SINGLE_PRECISION_TOL * across[0]
            and min(radius, height) > 0
            and (prim.kind == "Cylinder" or rounds)
        ):
            return Solid(prim.kind.lower(), (radius * across[0], height * long), turned, role, name, colour)
        return None

    def _has_collision(self, prim: _Prim, body: _Prim) -> bool:
        path = prim.path
        while len(path) >= len(body.path):
            if path in self.prims and self.prims[path].has_api("PhysicsCollisionAPI"):
                return True
            path = path.rpartition("/")[0]
        return bool(prim.told["guide"])

    def _joint(self, prim: _Prim) -> None:
        """Add a joint: its frames on its two bodies and the directions that it leaves free."""
        graph, values = self.result, prim.values
        if values.get("physics:jointEnabled") is False:
            graph.note("ignored", f"the joint {prim.name!r}, which is not enabled")
            return
        if prim.kind == "PhysicsDistanceJoint":
            self.defect(prim.path, "distance joint", None, "two spherical joints and the rod between them")
            return
        if not prim.kind.startswith("Physics") or not prim.kind.endswith("Joint"):
            graph.note(
                "ignored",
                f"the joint {prim.name!r} of type {prim.kind or 'none'}, unknown in UsdPhysics "
                "(--close adds a closure)",
            )
            return
        ends = [self._end(prim, side) for side in (0, 1)]
        if ends[0] is None or ends[1] is None:
            return
        one, two = ends[0], ends[1]
        if one.link == two.link:
            self.defect(prim.path, "joint from a body to itself", one.link, "two bodies (physics:body0, physics:body1)")
            return
        name = make_fresh_name(prim.name, graph.joints)
        free = self._freedoms(prim)
        excluded = values.get(EXCLUDED) is True and len(free) < 6
        before = set(graph.joints)
        self._add(name, prim, (one, two), free, in_tree=not excluded)
        self.titles[prim.path] = [each for each in graph.joints if each not in before]

    def _end(self, prim: _Prim, side: int) -> FrameSpec | None:
        """Return the joint's frame on one of its bodies (on the world if none is named)."""
        targets = prim.relations.get(f"physics:body{side}", [])
        if len(targets) > 1 or (targets and targets[0] not in self.prims):
            self.defect(prim.path, f"physics:body{side}", " ".join(targets)[:80], "one prim of the stage")
            return None
        turn = _read_quaternion(prim.values.get(f"physics:localRot{side}"), prim.values.get(f"{PREFIX}:localRot{side}"))
        place = _read_vector(prim.values.get(f"physics:localPos{side}"), prim.values.get(f"{PREFIX}:localPos{side}"))
        if turn is None or place is None or not np.all(np.abs(place) <= FILE_NUMBER_MAX):
            self.defect(prim.path, f"the joint's frame on physics:body{side}", None, "a finite position, a rotation")
            return None
        self.result.digits.read(format_exact_vector([*place, *map(_round_single, turn)]))
        self.result.digits.length(float(np.linalg.norm(turn)))
        if not targets:
            return FrameSpec(
                self.world,
                freeze_array(
                    self.up @ build_pose(self.metres * place, convert_from_quaternion(normalise_vector(turn)))
                ),
            )
        target, carrier = self.prims[targets[0]], self._carrier(targets[0])
        X = target.X @ build_pose(
            target.X[:3, :3].T @ target.M @ place, convert_from_quaternion(normalise_vector(turn))
        )
        if carrier is None:
            return FrameSpec(self.world, freeze_array(X))
        body = self.prims[carrier]
        return FrameSpec(self.bodies[carrier], freeze_array(X if carrier == "/" else invert_pose(body.X) @ X))

    def _freedoms(self, prim: _Prim) -> tuple[str, ...]:
        """Return the directions that a joint leaves free: by its type, or for a D6 those that no limit locks."""
        axis = str(prim.values.get("physics:axis", "X"))
        kind = _KINDS.get(prim.kind)
        if kind is not None and axis not in AXES:
            self.defect(prim.path, "physics:axis", axis, "X, Y, Z")
            axis = "X"
        locked = [each for each in FREEDOMS if _is_locked(prim.values, each)]
        match kind:
            case JointType.REVOLUTE:
                return (f"rot{axis}",)
            case JointType.PRISMATIC:
                return (f"trans{axis}",)
            case JointType.SPHERICAL:
                return FREEDOMS[3:]
            case JointType.FIXED:
                return ()
        if prim.kind != "PhysicsJoint":
            self.defect(prim.path, "unknown joint type", prim.kind, ", ".join((*_KINDS, "PhysicsJoint")))
        return tuple(each for each in FREEDOMS if each not in locked)

    def _add(
        self, name: str, prim: _Prim, ends: tuple[FrameSpec, FrameSpec], free: tuple[str, ...], *, in_tree: bool
    ) -> None:
        """Add one joint, or a chain of P and R if no joint type leaves exactly these directions free."""
        axes: tuple[Array, ...]
        slides, turns = ([AXES[each[-1]] for each in free if each.startswith(word)] for word in ("trans", "rot"))
        letters = "".join(each[-1] for each in free)
        limits = self._limits(prim, free)
        match len(slides), len(turns):
            case 0, 0:
                kind, axes = JointType.FIXED, ()
            case (1, 0) | (0, 1):
                kind, axes = (JointType.PRISMATIC if slides else JointType.REVOLUTE), tuple(slides + turns)
            case 0, 2:
                # PhysX rotates the predecessor's swing (Y, Z) first, the successor's twist (X) last
                kind, axes = JointType.UNIVERSAL, (turns[1], turns[0])
                if letters == "YZ":
                    axes = (turns[0], turns[1])
                    self.result.assumed.setdefault(_SWINGS, []).append(name)
            case 0, 3:
                kind, axes = JointType.SPHERICAL, ()
            case 1, 1 if letters[0] == letters[1]:
                kind, axes = JointType.CYLINDRICAL, tuple(slides)
            case 2, 1 if letters[2] not in letters[:2]:
                kind, axes = JointType.PLANAR, tuple(turns)
            case 3, 3:
                kind, axes = JointType.FREE, ()
            case _:
                self._chain(name, ends, slides, turns, in_tree=in_tree)
                return
        self.result.joints[name] = JointSpec(name, kind, ends, axes, limits, in_tree=in_tree)

    def _chain(
        self, name: str, ends: tuple[FrameSpec, FrameSpec], slides: list[Array], turns: list[Array], *, in_tree: bool
    ) -> None:
        graph, before = self.result, ends[0]
        parts = [(JointType.PRISMATIC, axis) for axis in slides] + [(JointType.REVOLUTE, axis) for axis in turns[::-1]]
        for number, (kind, axis) in enumerate(parts, 1):
            last = number == len(parts)
            title = graph.fresh(name_chain_joint(name, number))
            if not last:
                graph.links[title] = Link(title)
                self.poses[title] = self.poses[str(ends[0].link)] @ ends[0].X
            graph.joints[title] = JointSpec(
                title, kind, (before, ends[1] if last else FrameSpec(title)), (axis,), in_tree=in_tree or not last
            )
            before = FrameSpec(title)

    def _limits(self, prim: _Prim, free: tuple[str, ...]) -> Limits | None:
        """Return limits in degrees and units of the stage as radians and metres, for one-dof joints or equal limits in
        all directions."""
        pairs = []
        for each in free:
            factor = math.pi / 180 if each.startswith("rot") else self.metres
            keys = [
                ("physics:lowerLimit", "physics:upperLimit"),
                tuple(f"limit:{each}:physics:{k}" for k in ("low", "high")),
            ]
            found = next(
                ((prim.values[a], prim.values[b]) for a, b in keys if a in prim.values and b in prim.values),
                (None, None),
            )
            pairs.append(
                tuple(None if value is None or not math.isfinite(value) else factor * value for value in found)
            )
        lower, upper = pairs[0] if pairs and len(set(pairs)) == 1 else (None, None)
        if lower is not None and upper is not None and not lower < upper:
            lower = upper = None
        values = {"lower": lower, "upper": upper}
        for key, value in values.items():
            exact = prim.values.get(f"{PREFIX}:{key}")
            if (
                isinstance(exact, float)
                and value is not None
                and abs(exact - value) <= SINGLE_PRECISION_TOL * max(1.0, abs(value))
            ):
                values[key] = exact
        for key in ("velocity", "effort"):
            exact = prim.values.get(f"{PREFIX}:{key}")
            values[key] = exact if isinstance(exact, float) else None
        if values["effort"] is None and len(free) == 1:
            forces = [value for key, value in prim.values.items() if re.fullmatch(r"drive:\w+:physics:maxForce", key)]
            values["effort"] = forces[0] if forces and math.isfinite(forces[0]) else None
        return Limits(**values) if any(value is not None for value in values.values()) else None

    def _hold_kinematic(self) -> None:
        """Fix kinematic bodies in the world."""
        for path, link in self.bodies.items():
            if self.prims[path].values.get("physics:kinematicEnabled") is True:
                name = self.result.fresh(f"{link}_held")
                ends = FrameSpec(self.world, self.prims[path].X), FrameSpec(link)
                self.result.joints[name] = JointSpec(name, JointType.FIXED, ends)
                self.result.note("merged", f"the kinematic body {link!r} is fixed in the world")

    def _mimics(self, joints: list[_Prim]) -> None:
        """Add the couplings of PhysX's mimic joints: q + gearing × q of the reference + offset = 0."""
        for prim in joints:
            for key, gearing in prim.values.items():
                match = _MIMIC.fullmatch(key)
                stem = key.removesuffix("gearing")
                targets = prim.relations.get(f"{stem}referenceJoint", [])
                ends = [self.titles.get(path, []) for path in (*targets, prim.path)]
                if match is None or len(targets) != 1 or any(len(end) != 1 for end in ends):
                    continue
                names = ends[0][0], ends[1][0]
                types = {self.result.joints[name].type for name in names}
                turns = types == {JointType.REVOLUTE}
                if not turns and types != {JointType.PRISMATIC}:
                    self.defect(
                        prim.path, "mimic between joints of different types", None, "two revolute or two prismatic ones"
                    )
                    continue
                exact = prim.values.get(f"{PREFIX}:ratio")
                ratio = -float(gearing)
                if isinstance(exact, float) and abs(exact - ratio) <= SINGLE_PRECISION_TOL * max(1.0, abs(ratio)):
                    ratio = exact
                offset = -_round_single(prim.values.get(f"{stem}offset")) * (math.pi / 180 if turns else self.metres)
                label = prim.values.get(f"{PREFIX}:coupling")
                title = label if isinstance(label, str) else self.result.fresh(f"mimic_{prim.name}")
                self.result.gears.append(CouplingSpec(title, *names, ratio, offset or 0.0))

    def _stand(self, graph: JointGraph) -> None:
        """Let the robot start where the file's poses of the bodies are, if the joints' motions reach them."""
        apart = []
        for name, joint in graph.joints.items():
            T, S = joint.frames(self.poses)
            D = invert_pose(T) @ S
            if not joint.in_tree or np.max(np.abs(D - np.eye(4))) <= EXACT_INCIDENCE_TOL:
                continue
            length = max(1.0, *(float(np.linalg.norm(end.X[:3, 3])) for end in joint.ends))
            if compute_closure_residual(joint, T, S, length) > INCIDENCE_TOL:
                apart.append(name)
            else:
                graph.start[name] = find_joint_value(joint, D)
        if apart:
            graph.note(
                "assumption",
                "the bodies of these joints do not lie where the joints put them, and are moved there: "
                + join_names(apart),
            )

    def _says(self, prim: _Prim) -> None:
        """Read platform, camera, motors and observations as our writer adds them."""
        for text in prim.values[f"{PREFIX}:says"] or []:
            key, _, rest = str(text).partition(" ")
            wrong = read_annotation(self.result, key, rest)
            if wrong is not None:
                self.defect(prim.path, wrong, str(text)[:80])

    def _drives(self, joints: list[_Prim]) -> None:
        """Put motors on joints whose drives have gains; if none has gains, on all with drives. MuJoCo's actuators name
        their joints."""
        gains: dict[str, bool] = {}
        for prim in joints:
            names = [each for each in self.titles.get(prim.path, []) if self.result.joints[each].kind.freedoms]
            if prim.has_api("PhysicsDriveAPI"):
                drives = [
                    value
                    for key, value in prim.values.items()
                    if re.fullmatch(r"drive:\w+:physics:(stiffness|damping)", key)
                ]
                limp = any(
                    value == 0 for key, value in prim.values.items() if re.fullmatch(r"drive:\w+:physics:maxForce", key)
                )
                gains |= dict.fromkeys(names, any(_round_single(value) > 0 for value in drives) and not limp)
        actuators = [prim for prim in self.prims.values() if prim.kind == "MjcActuator"]
        for prim in actuators:
            targets = [each for path in prim.relations.get("mjc:target", []) for each in self.titles.get(path, [])]
            gains |= dict.fromkeys(targets, True)
            if not targets:
                self.result.note("ignored", f"the actuator {prim.name!r}, which drives no joint")
        driven = [name for name in gains if gains[name] or not any(gains.values())]
        for name in driven:
            self.result.joints[name] = replace(self.result.joints[name], motor=Motor(f"motor_{name}"))
        if len(driven) < len(gains):
            what = f"the motors are {join_names(driven)}: the joints whose drives have gains (--motors changes them)"
            self.result.note("assumption", what)


def _has_type(key: str, value: Any) -> bool:
    """Return False for an attribute whose value should be a number, or several, and is not; bounds may be infinite."""
    *spaces, name = key.split(":")
    if name not in _LENGTHS or value is None or not {*spaces[:1]} <= _SPACES:
        return True
    length = _LENGTHS[name]
    numbers = value if isinstance(value, list) and length else [value]
    if len(numbers) != max(1, length) or not all(isinstance(number, int | float) for number in numbers):
        return False
    return length > 0 or name in _BOUNDS or math.isfinite(value)


def _is_locked(values: Mapping[str, Any], freedom: str) -> bool:
    low, high = (values.get(f"limit:{freedom}:physics:{key}") for key in ("low", "high"))
    return low is not None and high is not None and bool(low >= high)


def _round_single(value: Any) -> float:
    """Return a number of single precision as the decimals from which it was rounded."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        return 0.0
    return float(str(np.float32(value))) if float(np.float32(value)) == value else float(value)


def _read_vector(value: Any, exact: Any = None, count: int = 3) -> Array | None:
    """Return so many finite numbers, as decimals; those of double precision next to them if they are the same."""
    numbers = np.array(value, dtype=float) if isinstance(value, list) and len(value) == count else None
    if numbers is None or not np.all(np.isfinite(numbers)):
        return None
    if isinstance(exact, list) and len(exact) == count:
        better = np.array(exact, dtype=float)
        if np.max(np.abs(better - numbers)) <= SINGLE_PRECISION_TOL * max(1.0, float(np.max(np.abs(numbers)))):
            return better
    return np.array([_round_single(v) for v in numbers])


def _read_quaternion(value: Any, exact: Any = None) -> Array | None:
    """Return a quaternion w x y z in the same manner; None if it is invalid."""
    turn = _read_vector(value, exact, 4)
    return turn if turn is not None and np.linalg.norm(turn) > VECTOR_LENGTH_MIN else None
