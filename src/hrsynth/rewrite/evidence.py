"""Facts about the real robot that rules use: loci of directions and proximal centres over whole motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.ranks import compute_kernel_basis, draw_in_space
from ..geometry.vectors import Array, normalise_vector, transform
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.pinocchio_model import PinocchioModel
from ..kinematics.sampling import Samples
from ..kinematics.tasks import solve
from ..mechanism import Joint, JointType, Mechanism, graphs
from ..mechanism.cameras import CameraObservation
from ..mechanism.composites import WordEdge, WordGraph
from ..mechanism.legs import LegDecomposition
from ..mechanism.normal import locate_centre_pair
from ..mechanism.observations.direction import SeenAxis
from ..tolerances import CLOSURE_SOLVER_TOL, LOCUS_EXTENT_TOL


@dataclass(frozen=True, eq=False)
class LinearLocus:
    """The set a point or a direction moves on: its dimension as a flat (0 fixed, 1 line, 2 plane, 3 space), and
    orthonormal ``axes`` with the flat's directions first, the normals last (rows)."""

    dimension: int
    axes: Array

    @property
    def normal(self) -> Array:
        """The normal of a plane."""
        return self.axes[2]


def fit_linear_locus(points: Array, scale: float) -> LinearLocus:
    """The smallest flat that holds all points, shape (n, 3); ``scale`` is what no extent is relative to."""
    centred = points - points.mean(axis=0)
    _, s, Vt = np.linalg.svd(centred / np.sqrt(len(points)), full_matrices=True)
    return LinearLocus(int(np.sum(s > LOCUS_EXTENT_TOL * scale)), Vt)


@dataclass(frozen=True, eq=False)
class ProximalChain:
    """Part of a leg between the reference link and the observed link ℓ, moved on its own.

    ``joints`` are its joints, ``before`` its last link, ``k_joint`` the joint K to ℓ, ``anchor`` A at zero.
    """

    joints: tuple[Joint, ...]
    before: str
    k_joint: Joint
    anchor: Array
    rotations: Array
    """Orientations of ``before`` seen from the reference link, relative to the zero configuration, (n, 3, 3)."""
    anchors: Array
    """Positions of A, (n, 3), in base coordinates with the reference link fixed."""
    length: float

    @cached_property
    def anchor_locus(self) -> LinearLocus:
        """Linear locus of A."""
        return fit_linear_locus(self.anchors, self.length)

    @cached_property
    def is_translating(self) -> bool:
        """Return True if the link before K only translates relative to the reference link."""
        return bool(np.max(np.abs(self.rotations - np.eye(3))) < LOCUS_EXTENT_TOL)

    def has_constant_direction(self, direction: Array) -> bool:
        """Return True if a direction fixed in the link before K is constant in the reference link."""
        return bool(np.max(np.abs(self.rotations @ direction - direction)) < LOCUS_EXTENT_TOL)

    @cached_property
    def turning_axis(self) -> Array | None:
        """Constant direction about which the link before K rotates, or None."""
        spread = np.concatenate([R - np.eye(3) for R in self.rotations])
        _, s, Vt = np.linalg.svd(spread)
        if s[0] < LOCUS_EXTENT_TOL or s[2] > LOCUS_EXTENT_TOL * len(self.rotations):
            return None
        return Vt[2]

    @cached_property
    def single_revolute(self) -> Joint | None:
        """The base R joint, if the proximal chain is that joint alone."""
        if len(self.joints) == 1 and self.joints[0].type is JointType.REVOLUTE:
            return self.joints[0]
        return None


class Evidence:
    """Facts about the real robot, gathered from its samples and from its legs moved on their own."""

    def __init__(self, decomposition: LegDecomposition, samples: Samples) -> None:
        self.anatomy = decomposition
        self.samples = samples
        self.mechanism: Mechanism = decomposition.mechanism
        self.reference = samples.observation_model.reference
        self._proximal: dict[str, ProximalChain | None] = {}

    def directions(self, index: int) -> Array:
        """All sampled values of observation ``index``, (n, 3), in base coordinates with the reference link fixed."""
        home = self.mechanism.links[self.reference].pose[:3, :3]
        values = [target.measured[index][1] for member in self.samples.members for target in member.way]
        return np.asarray(values) @ home.T

    def far(self, index: int) -> Array | None:
        """Unit vector in base axes, fixed in the reference link, as far as possible from all sampled values of what the
        first joint of the chain of observation ``index`` rotates; None where the values do not define that."""
        seen = self.samples.observation_model.observations[index]
        assert isinstance(seen, SeenAxis | CameraObservation)
        values = np.asarray([target.measured[index][1] for member in self.samples.members for target in member.way])
        units = np.broadcast_to(seen.dimension, seen.size)
        pointing = seen.pointing(values * self.samples.model.length**units)
        home = self.mechanism.links[seen.seen_from or self.reference].pose @ seen.view
        return None if pointing is None else home[:3, :3] @ choose_far_direction(pointing)

    def can_spin(self, link: str, direction: Array) -> bool:
        """Return True if a link can rotate about its direction while every other link is fixed.

        Links that it carries along on a P of the same direction may turn with it.
        """
        companions = {link}
        for joint in self.mechanism.joints_of(link):
            if joint.type is JointType.PRISMATIC and np.linalg.norm(np.cross(joint.axis, direction)) < LOCUS_EXTENT_TOL:
                companions.add(joint.other(link))
        if companions & {self.mechanism.base, self.mechanism.platform, self.reference}:
            return False
        at = self.samples.members[0].configuration
        kernel, _ = at.kernel()
        rest = [at.velocity(name) @ kernel for name in self.mechanism.links if name not in companions]
        still, _ = compute_kernel_basis(np.vstack(rest), 1.0)
        if still.shape[1] == 0:
            return False
        moves = at.velocity(link) @ kernel @ still
        turning = np.linalg.svd(moves[3:], full_matrices=False)
        if turning[1][0] < 1e-6:
            return False
        local = self.mechanism.links[link].pose[:3, :3].T @ direction
        axis = at.pose(link)[:3, :3] @ local
        return bool(np.linalg.norm(np.cross(turning[0][:, 0], axis)) < 1e-6)

    def proximal(self, link: str) -> ProximalChain | None:
        """The chain before ``link``, or None where it is not a chain of its own (a camera elsewhere, several joints
        K, one that slides)."""
        if link not in self._proximal:
            self._proximal[link] = self._find_proximal(link)
        return self._proximal[link]

    def joints_before(self, link: str) -> list[Joint]:
        """The joints of ``link`` on the reference link's side."""
        mechanism, leg = self.mechanism, self.anatomy.leg_of(link)
        if leg is None or self.reference not in (mechanism.base, mechanism.platform) or link == self.reference:
            return []
        near = graphs.find_component(mechanism.adjacency, self.reference, {*leg.links} - {link})
        return [j for j in mechanism.joints_of(link) if j.other(link) in near and j.type is not JointType.FREE]

    def carrier(self, link: str) -> str:
        """The link that turns as this one does, moved towards the reference link over P joints."""
        passed = {link}
        while True:
            found = self.joints_before(link)
            if len(found) != 1 or found[0].type is not JointType.PRISMATIC:
                return link
            before = found[0].other(link)
            if before in passed or before == self.reference:
                return link
            passed.add(before)
            link = before

    def parallel_rods(self, link: str) -> tuple[str, ...]:
        """The other rods of the group of equal parallel rods that holds a link."""
        for edge in self._composites:
            if link in edge.inside and len(edge.joints) == 2 * len(edge.inside):
                return tuple(other for other in edge.inside if other != link)
        return ()

    @cached_property
    def _composites(self) -> tuple[WordEdge, ...]:
        """The joints of the real robot with its composite elements recognised."""
        mechanism = self.mechanism
        return tuple(WordGraph(mechanism, {mechanism.base, mechanism.platform}).recognise().edges())

    def _find_proximal(self, link: str) -> ProximalChain | None:
        found = self.joints_before(link)
        if len(found) != 1 or found[0].type not in (JointType.REVOLUTE, JointType.UNIVERSAL, JointType.SPHERICAL):
            return None
        K, before = found[0], found[0].other(link)
        onward = [j for j in self.mechanism.joints_of(link) if j.name != K.name]
        anchor = K.point
        if onward and not onward[0].type.has_translation:
            anchor = locate_centre_pair(K, onward[0])[0]
        leg = self.anatomy.leg_of(link)
        assert leg is not None
        nodes = {self.reference}
        if before != self.reference:
            for path in graphs.list_paths(self.mechanism.adjacency, self.reference, before, {*leg.links} - {link}):
                nodes.update(path)
        joints = tuple(j for j in self.mechanism.joints.values() if set(j.links) <= nodes)
        rotations, anchors = _move_at_random(self.mechanism, self.reference, nodes, joints, before, anchor)
        return ProximalChain(joints, before, K, anchor, rotations, anchors, self.mechanism.length)


def _move_at_random(
    mechanism: Mechanism, reference: str, nodes: set[str], joints: Sequence[Joint], before: str, anchor: Array
) -> tuple[Array, Array]:
    """Return orientations of ``before`` and positions of A over random motions of the chain alone."""
    if before == reference:
        return np.eye(3)[None], anchor[None]
    part = Mechanism.of(
        "part", [mechanism.links[n] for n in mechanism.links if n in nodes], joints, base=reference, platform=before
    )
    model = PinocchioModel(part, mechanism.length)
    rng = np.random.default_rng(1)
    home = part.links[before].pose
    local = home[:3, :3].T @ (anchor - home[:3, 3])
    rotations, anchors = [], []
    for _ in range(12):
        q = model.q0
        if not model.loops:
            q = model.integrate(q, rng.uniform(-0.6, 0.6, model.nv))
        else:
            for _ in range(4):
                kernel, _ = ClosedConfiguration.of(model, q).kernel()
                q, _ = solve(model, model.integrate(q, 0.12 * draw_in_space(kernel, rng)), tolerance=CLOSURE_SOLVER_TOL)
        X = model.pose(q, before)
        rotations.append(X[:3, :3] @ home[:3, :3].T)
        anchors.append(transform(X, local))
    return np.asarray(rotations), np.asarray(anchors)


def choose_far_direction(directions: Array) -> Array:
    """A unit vector as far as possible from all given unit vectors (n, 3): the smallest axis of their scatter."""
    _, vectors = np.linalg.eigh(directions.T @ directions)
    return normalise_vector(vectors[:, 0])
