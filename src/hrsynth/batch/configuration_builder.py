"""Closed configurations at platform poses: the poses of all links by leg, then the joints' coordinates.

Each leg's links start from the solution of its subproblem and are closed by a few Gauss-Newton steps, all poses at
once; a result counts only if Pinocchio's own loops are closed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from ..closed_forms.legs import ClosedFormLeg
from ..errors import SamplingFailure
from ..geometry.so3 import (
    convert_to_quaternions,
    convert_vectors_to_rotations,
    decompose_rotation,
    find_smallest_rotations,
)
from ..geometry.vectors import Array, freeze_array, hat, invert_pose
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.pinocchio_model import PinocchioModel, choose_slide_direction
from ..mechanism import Joint, JointType, Mechanism
from ..mechanism.legs import Leg, LegDecomposition
from ..mechanism.observations.direction import Direction
from ..mechanism.screws import split_elementary
from ..results import Value
from ..tolerances import CLOSURE_RESIDUAL_TOL
from .engine import Batch, Flags
from .iterative_leg import LEG_FINAL_STEPS_COUNT, IterativeLeg
from .program import POSE_CHUNK_COUNT

DIRECTION_RATE_GROWTH_MAX = 20.0
"""Largest ratio of direction rates to those at zero on a walk of poses in a batch."""

WALK_STEP_LENGTH_FRACTION = 0.15
"""Length of a step of a walk (characteristic lengths, radians)."""
LEG_GAUSS_NEWTON_STEPS_COUNT = 12
"""Gauss-Newton steps from where the subproblem puts a leg's links; what they do not close is led from zero."""


@dataclass(frozen=True, eq=False, repr=False)
class ConfigurationBuilder(Value):
    """A batch whose platform poses can be made closed configurations of ``twin``."""

    batch: Batch
    model: PinocchioModel
    decomposition: LegDecomposition
    seen: Mapping[str, Direction]
    legs: Mapping[str, IterativeLeg]

    @classmethod
    def of(
        cls, batch: Batch, model: PinocchioModel, decomposition: LegDecomposition, observations: Sequence[Direction]
    ) -> ConfigurationBuilder | None:
        """None where a leg is no known subproblem, or a link belongs neither to a leg nor to the platform."""
        mechanism = decomposition.mechanism
        placed = {mechanism.base, *batch.coordinates.links, *(name for leg in decomposition.legs for name in leg.links)}
        known = batch.coordinates.has_constant_twists and None not in batch.legs.values()
        if not (known and placed == set(mechanism.links)) or any(
            joint.type is JointType.FREE for joint in mechanism.joints.values()
        ):
            return None
        seen = {o.leg: o for o in observations}
        legs = {leg.label: IterativeLeg.of(mechanism, leg, seen[leg.label], None) for leg in decomposition.legs}
        return cls(batch, model, decomposition, seen, legs)

    def configurations(self, X: Array) -> list[ClosedConfiguration | None]:
        """The closed configurations at platform poses X (n, 4, 4), None where there is none in the working mode of the
        zero configuration."""
        found: list[ClosedConfiguration | None] = []
        for start in range(0, len(X), POSE_CHUNK_COUNT):
            frames, reached = self.frames(X[start : start + POSE_CHUNK_COUNT])
            q = freeze_array(compute_coordinates(self.model, frames))
            for here, there in zip(q, reached, strict=True):
                residual = float(np.linalg.norm(self.model.residual(here))) if there else np.inf
                found.append(
                    ClosedConfiguration(self.model, here, residual) if residual <= CLOSURE_RESIDUAL_TOL else None
                )
        return found

    def random_walk(self, count: int, seed: int = 0, steps: int = 40) -> Iterator[ClosedConfiguration]:
        """Yield ``count`` random configurations: walks of up to ``steps`` small steps of the platform from its zero
        configuration, side by side; a walk ends where the robot cannot reach further, or comes near to a Type 1
        singularity."""
        rng, batch = np.random.default_rng(seed), self.batch
        limit = DIRECTION_RATE_GROWTH_MAX * float(batch.evaluate(batch.home[None]).singular_values[0, 0])
        given = failed = 0
        walks = -(-count // steps)
        while given < count:
            walks *= 2
            ways = self._walks(rng, walks, steps, limit)
            failed += sum(len(way) < steps for way in ways)
            met = self.configurations(np.concatenate(ways)) if any(map(len, ways)) else []
            for way in np.split(np.arange(len(met)), np.cumsum([len(way) for way in ways])[:-1]):
                for at in takewhile(lambda at: at is not None, (met[i] for i in way)):
                    assert at is not None
                    yield at
                    given += 1
                    if given == count:
                        return
            if failed > 10 * (given + walks + 10):
                raise SamplingFailure(self.model.mechanism.name, given, count, given + failed)

    def _walks(self, rng: np.random.Generator, walks: int, steps: int, limit: float) -> list[Array]:
        """The platform poses (k, 4, 4) of each walk."""
        coordinates, length = self.batch.coordinates, self.batch.length
        ways: list[list[Array]] = [[] for _ in range(walks)]
        X = np.repeat(self.batch.home[None], walks, axis=0)
        velocity = np.zeros((walks, coordinates.dof))
        live = np.arange(walks)
        for _ in range(steps):
            velocity += rng.normal(size=velocity.shape) / 2
            velocity /= np.linalg.norm(velocity, axis=1, keepdims=True)
            shift, spin = np.split(WALK_STEP_LENGTH_FRACTION * velocity, [coordinates.translations.shape[1]], axis=1)
            p, R = coordinates.place(X)
            X = X.copy()
            X[:, :3, :3] = convert_vectors_to_rotations(spin @ coordinates.rotations.T) @ R
            X[:, :3, 3] = p + length * (shift @ coordinates.translations.T) - X[:, :3, :3] @ coordinates.point
            found = self.batch.evaluate(X, compiled=False)
            kept = np.flatnonzero(found.reached & ~(found.singular_values[:, 0] > limit))
            X, velocity, live = X[kept], velocity[kept], live[kept]
            for walk, pose in zip(live, X, strict=True):
                ways[walk].append(pose)
        return [np.array(way).reshape(-1, 4, 4) for way in ways]

    def frames(self, X: Array) -> tuple[dict[str, Array], Flags]:
        """Poses (n, 4, 4) of all links, metres, and where the legs are closed (n,)."""
        batch, mechanism = self.batch, self.decomposition.mechanism
        p, R = batch.coordinates.place(X)
        frames = {mechanism.base: np.broadcast_to(mechanism.links[mechanism.base].pose, (len(X), 4, 4))}
        frames |= {name: link.poses(p, R) for name, link in batch.coordinates.links.items()}
        reached = np.ones(len(X), dtype=bool)
        for leg in self.decomposition.legs:
            chain, form = self.legs[leg.label], batch.legs[leg.label]
            assert form is not None
            guess, u, there = self._guess(leg, form, frames, p, R)
            ends = chain.end(batch.coordinates, p, R)
            q = np.where(there[:, None], chain.system.read(guess.__getitem__), chain.system.zero)
            q, residual = chain.close(q, ends, LEG_GAUSS_NEWTON_STEPS_COUNT)
            left = there & ~(residual <= CLOSURE_RESIDUAL_TOL)
            q[left], residual[left] = chain.close(
                chain.start(int(left.sum())), ends[left], LEG_FINAL_STEPS_COUNT, u[left]
            )
            reached &= there & (residual <= CLOSURE_RESIDUAL_TOL)
            frames.update(chain.frames(leg.links, q))
        return frames, reached

    def _guess(
        self, leg: Leg, form: ClosedFormLeg, frames: Mapping[str, Array], p: Array, R: Array
    ) -> tuple[dict[str, Array], Array, Flags]:
        """Return the start poses of the leg's links: its first link on its circle or line, the others rotated as the
        observed one; its direction (n, 3), and where it reaches, (n,)."""
        mechanism, seen = self.decomposition.mechanism, self.seen[leg.label]
        n = len(p)
        zero = mechanism.links[seen.link].pose[:3, :3] @ seen.direction
        with np.errstate(invalid="ignore", divide="ignore"):
            u, there, B = form.pose(p, R)
            u = np.where(there[:, None], u, zero)
            first = np.where(there[:, None, None], form.displace(B, n), np.eye(4))
        turn = convert_vectors_to_rotations(find_smallest_rotations(zero, u))
        guess = {name: frames[name] for name in (mechanism.base, leg.platform_link)}
        for name in _order_links(mechanism, leg, form.crank):
            pose = mechanism.links[name].pose
            if name == form.crank:
                guess[name] = first @ pose
                continue
            joint, held = _find_holding_joint(mechanism, leg, name, guess)
            moved = guess[held] @ invert_pose(mechanism.links[held].pose)
            centre = moved[:, :3, :3] @ joint.point + moved[:, :3, 3]
            guess[name] = np.tile(np.eye(4), (n, 1, 1))
            guess[name][:, :3, :3] = turn @ pose[:3, :3]
            guess[name][:, :3, 3] = centre + turn @ (pose[:3, 3] - joint.point)
        return guess, u, there


def _order_links(mechanism: Mechanism, leg: Leg, crank: str) -> list[str]:
    """The leg's links, each after one that it hangs on."""
    order: list[str] = [crank] if crank in leg.links else []
    rest = [name for name in leg.links if name not in order]
    while rest:
        known = {mechanism.base, leg.platform_link, *order}
        chosen = next(name for name in rest if any(joint.other(name) in known for joint in mechanism.joints_of(name)))
        order.append(chosen)
        rest.remove(chosen)
    return order


def _find_holding_joint(mechanism: Mechanism, leg: Leg, name: str, placed: Mapping[str, Array]) -> tuple[Joint, str]:
    """The joint by which a link is placed, and the link beyond it: the platform's before others, turning ones first."""
    joints = [joint for joint in mechanism.joints_of(name) if joint.other(name) in placed]
    best = min(joints, key=lambda joint: (joint.type.has_translation, joint.other(name) != leg.platform_link))
    return best, best.other(name)


def compute_coordinates(model: PinocchioModel, frames: Mapping[str, Array]) -> Array:
    """Return the model's q (n, nq) for poses of all links (n, 4, 4), metres."""
    moved = _compute_displacements(model, frames)
    n = len(next(iter(frames.values())))
    q = np.repeat(model.q0[None], n, axis=0)
    for joint, parent, names in model.parts():
        turned = joint if joint.predecessor == parent else joint.turned()
        A, B = moved[turned.predecessor], moved[turned.successor]
        R = A[:, :3, :3].transpose(0, 2, 1) @ B[:, :3, :3]
        centre = B[:, :3, :3] @ joint.point + B[:, :3, 3] - A[:, :3, 3]
        shift = np.einsum("nji,nj->ni", A[:, :3, :3], centre) - joint.point
        values = _read_coordinates(turned, R, shift / model.length)
        for start, value in zip((model.start(name) for name in names), values, strict=True):
            q[:, start : start + value.shape[1]] = value
    return q


def compute_rates(model: PinocchioModel, frames: Mapping[str, Array], link: str) -> tuple[Array, Array]:
    """Return the effect of the model's velocities at closed poses of all links (n, 4, 4), metres: the rates of the
    closure residuals (n, rows, nv), and the twists (n, 6, nv) of a link at the base's origin; characteristic lengths
    and radians."""
    moved, (tree, cuts) = _compute_displacements(model, frames), model.spanned
    screws, rows = np.zeros((len(moved[link]), 6, model.nv)), [np.zeros((len(moved[link]), 0, model.nv))]
    moves = {model.mechanism.base: np.zeros(model.nv)}

    def beyond(joint: Joint, parent: str) -> Array:
        """Return True for coordinates that move the links beyond a joint, whose screws are added."""
        found, places = moves[parent].copy(), sorted(model.coordinates.get(joint.name, ()))
        if places:
            own = joint if joint.predecessor == parent else joint.turned()
            found[places] = 1.0
            screws[:, :, places[0] : places[-1] + 1] = _compute_screws(
                own, moved[parent], moved[joint.other(parent)], model.length
            )
        return found

    for joint in tree:
        parent = next(name for name in joint.links if name in moves)
        moves[joint.other(parent)] = beyond(joint, parent)
    ends = [beyond(joint, joint.predecessor) - moves[joint.successor] for joint in cuts]
    for joint, signs in zip(cuts, ends, strict=True):
        gap = screws * signs
        if joint.type is JointType.SPHERICAL:
            gap = gap[:, :3] - hat(_locate_centre(joint, moved[joint.predecessor]) / model.length) @ gap[:, 3:]
        rows.append(gap)
    return np.concatenate(rows, axis=1), screws * moves[link]


def _compute_screws(joint: Joint, A: Array, B: Array, length: float) -> Array:
    """The twists (n, 6, k) at the base's origin for unit velocities of a joint's coordinates, A and B (n, 4, 4) what
    brought its links from the zero configuration."""
    R, found = A[:, :3, :3], split_elementary(joint.type, joint.axes, choose_slide_direction)
    slides, turns = (
        np.array([axis for kind, axis in found if kind is each]).reshape(-1, 3)
        for each in (JointType.PRISMATIC, JointType.REVOLUTE)
    )
    turned = R @ turns.T
    if joint.type is JointType.UNIVERSAL:
        turned[:, :, 1] = B[:, :3, :3] @ turns[1]
    arms = hat(_locate_centre(joint, A) / length) @ turned
    slid = R @ slides.T
    return np.concatenate(
        [np.concatenate([slid, np.zeros_like(slid)], axis=1), np.concatenate([arms, turned], axis=1)], axis=2
    )


def _locate_centre(joint: Joint, A: Array) -> Array:
    return np.asarray(A[:, :3, :3] @ joint.point + A[:, :3, 3])


def _compute_displacements(model: PinocchioModel, frames: Mapping[str, Array]) -> dict[str, Array]:
    """Return the displacements of the links from the zero configuration to poses (n, 4, 4)."""
    return {name: X @ invert_pose(model.mechanism.links[name].pose) for name, X in frames.items()}


def _read_coordinates(joint: Joint, R: Array, shift: Array) -> list[Array]:
    """Return the coordinates of each of a joint's parts, (n, 1) or (n, 4), in the order of the model's."""
    match joint.type:
        case JointType.UNIVERSAL:
            first, second = joint.axes
            normal = np.cross(first, second)
            carried = R @ second
            one = np.arctan2(carried @ normal, carried @ np.cross(normal, first))[:, None]
            rest = convert_vectors_to_rotations(-one * first) @ R
            return [one, decompose_rotation(second[None], rest)]
        case JointType.SPHERICAL:
            return [convert_to_quaternions(R)[:, [1, 2, 3, 0]]]
        case _:
            return [
                shift @ axis[:, None] if kind is JointType.PRISMATIC else decompose_rotation(axis[None], R)
                for kind, axis in split_elementary(joint.type, joint.axes, choose_slide_direction)
            ]
