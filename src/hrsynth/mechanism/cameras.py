"""Cameras, and what they see of a link: observations that are functions of a point B and an axis d fixed in the link,
both in the frame of a camera with its centre C on the reference link (docs/pages/observations.md).

A kind gives its value and partial derivatives, the wrenches that remain when it is held, and its virtual chain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import ClassVar, Self

import numpy as np

from ..errors import BadMechanism, UndefinedValue
from ..geometry.jets import Jet
from ..geometry.vectors import Array, Numbers, dot, frozen, hat, inverse, perpendicular, transform, unit
from ..results import Value
from ..tolerances import NEAREST_SEEN, SAME_POINT
from .observation import Drawn, Observation, ObservationRecord

AT_CENTRE = frozen(np.eye(4))
RING = 48
"""Sides of a polygon by which a circle is drawn."""


@dataclass(frozen=True, eq=False, repr=False)
class NamedCamera(Value):
    """A named camera on a link: its frame's ``pose`` (4, 4) in the link's (x right, y down, z ahead, its origin the
    centre C); the focal length and the size of its pictures, in pixels, where they are known."""

    name: str
    link: str
    pose: Array = field(default_factory=lambda: AT_CENTRE)
    focal: float | None = None
    width: int | None = None
    height: int | None = None
    line: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose))

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> NamedCamera:
        """The same camera where links became parts of others, as for observations."""
        return replace(self, link=into[self.link], pose=relative_pose(self.link, into, poses) @ self.pose)


def relative_pose(link: str, into: Mapping[str, str], poses: Mapping[str, Array]) -> Array:
    """The pose of a link in the frame of the one that took it in."""
    return AT_CENTRE if into[link] == link else inverse(poses[into[link]]) @ poses[link]


@dataclass(frozen=True, eq=False)
class VirtualJoint:
    """A joint of a virtual chain, at the zero configuration in base axes: its type's letter, centre, axes."""

    letter: str
    at: Array
    axes: tuple[Array, ...] = ()
    actuated: bool = False


@dataclass(frozen=True, eq=False)
class ViewGeometry:
    """Where camera and link are, in one frame: the centre C, the camera's z axis, the point B, the axis d; to build a
    chain also ``far``, a unit vector far from all values of what its first U turns."""

    C: Numbers
    z: Numbers
    B: Numbers
    d: Numbers
    far: Array | None = None

    @property
    def ray(self) -> Array:
        """The unit vector from C to B."""
        return unit(self.B - self.C)

    @property
    def foot(self) -> Array:
        """The point of the line (B, d) that is nearest to C."""
        return np.asarray(self.B - ((self.B - self.C) @ self.d) * self.d)


@dataclass(frozen=True, eq=False)
class FixedValueLocus:
    """What a held value leaves of a point of the link at ``place`` (3,), or with ``turns`` of a direction of it.

    A point stays in the planes ``through`` (3,) with these ``normals`` (k, 3) and, where ``radius`` is given, on the
    sphere about ``through``; a direction keeps its angles with the normals. All in the frame of the
    :class:`ViewGeometry`."""

    place: Array
    normals: Array
    through: Array
    radius: float | None = None
    turns: bool = False


def kept_in(place: Array, through: Array, *across: Array) -> FixedValueLocus:
    """A point in planes with these normals, of any length: three hold it, two leave it a line."""
    return FixedValueLocus(place, np.array([unit(n) for n in across]), through)


def turned_across(d: Array, *across: Array) -> FixedValueLocus:
    """A direction that keeps its angles with these vectors, of any length."""
    return FixedValueLocus(d, np.array([unit(n) for n in across]), np.zeros(3), turns=True)


def in_plane(at: ViewGeometry, n: Array) -> tuple[FixedValueLocus, ...]:
    """The line (B, d) in the plane with this normal."""
    return kept_in(at.B, at.B, n), turned_across(at.d, n)


def gimbal(at: Array, turned: Array, far: Array | None, actuated: bool = False) -> VirtualJoint:
    """A U at a point that turns a direction any way: its first axis e₁ far from it, its second normal to both."""
    first = perpendicular(turned) if far is None else far
    return VirtualJoint("U", at, (first, unit(np.cross(first, turned))), actuated)


def across(at: ViewGeometry, normal: Array, out: Array, actuated: int) -> tuple[VirtualJoint, ...]:
    """U-R-P-C to the line (B, d): U at C turns the ``normal`` of a plane through C, R turns in it, P goes along ``out``
    in it, C lies along the line; the first so many of them actuated."""
    joints = (
        gimbal(at.C, normal, at.far),
        VirtualJoint("R", at.C, (normal,)),
        VirtualJoint("P", at.C, (out,)),
        VirtualJoint("C", at.foot, (at.d,)),
    )
    return tuple(replace(joint, actuated=number < actuated) for number, joint in enumerate(joints))


def stretch(p: Array, d: Array, size: float) -> Array:
    """The piece (2, 3) of a line about p."""
    return np.array([p - size * d, p + size * d])


def ring(p: Array, d: Array, r: float) -> Array:
    """A circle as a polyline (n, 3)."""
    one = perpendicular(d)
    turns = np.linspace(0, 2 * np.pi, RING + 1)
    return np.asarray(p + abs(r) * (np.outer(np.cos(turns), one) + np.outer(np.sin(turns), np.cross(d, one))))


def before_camera(points: Array) -> Array:
    """The piece of a polyline (n, 3) that is in front of the camera; of a segment that part, else whole or nothing."""
    ahead = points[:, 2] > NEAREST_SEEN
    if len(points) == 2 and ahead.sum() == 1:
        a, b = points[ahead][0], points[~ahead][0]
        return np.array([a, a + (a[2] - NEAREST_SEEN) / (a[2] - b[2]) * (b - a)])
    return points if ahead.all() else points[:0]


def depth_plane(z: Numbers) -> Array:
    """g of the planes (…, 3) parallel to the picture at depths z (…, 1)."""
    return np.asarray(np.eye(3)[2] / z)


def line_plane(p: Array, d: Array) -> Array:
    """g of the plane through a line (p, d) that is normal to that of C and the line: f/‖f‖², f the foot of C."""
    foot = p - dot(p, d)[..., None] * d
    return np.asarray(foot / dot(foot, foot)[..., None])


def on_plane(n: Array, g: Array) -> Array:
    """The point nearest to C of the line in which the plane of normal n through C meets that of g."""
    inside = g - dot(g, n)[..., None] * n
    return np.asarray(inside / dot(inside, inside)[..., None])


def apart(at: ViewGeometry, from_: Array, least: float, what: str, limit: str) -> float:
    """The distance of C from a point; raises ``BadMechanism`` where it is not larger than ``least``."""
    distance = float(np.linalg.norm(from_ - at.C))
    if not distance > least + SAME_POINT * (1 + least):
        raise BadMechanism(f"{what}: distance from the camera's centre (m)", distance, limit)
    return distance


@dataclass(frozen=True, eq=False, repr=False)
class CameraObservation(Observation):
    """A measurement by a camera, of the point ``at`` (3,) and the ``axis`` (3,) in the *link's* frame; C is the origin
    of the reference link's frame where no ``camera`` is named.

    Values are in the camera's frame. ``radius`` is that of a cylinder or circle (m), its sign says which edge is meant.
    """

    locked: ClassVar[str]
    """The wrenches that it transmits when it is held, for the table of all kinds."""
    rational: ClassVar[bool] = True
    """Whether its wrenches are polynomials of C, B, d and z."""
    whole: ClassVar[bool] = True
    """Whether its rates vanish for just those motions against which its wrenches do no work, wherever it has one."""
    along_z: ClassVar[bool] = False
    """Whether the camera's z axis matters."""
    signed: ClassVar[bool] = False
    """Whether the sign of the radius says which of two is meant."""
    images_point: ClassVar[bool] = True
    """Whether B itself is in the image, and not any point of a line."""

    at: Array = field(default_factory=lambda: frozen(np.zeros(3)), kw_only=True)
    axis: Array | None = field(default=None, kw_only=True)
    radius: float | None = field(default=None, kw_only=True)
    camera: NamedCamera | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", frozen(self.at))
        if self.axis is not None:
            try:
                object.__setattr__(self, "axis", frozen(unit(self.axis)))
            except ValueError:
                raise BadMechanism(f"{self.kind} {self.leg!r}: axis", "0 0 0", "a non-zero vector") from None
        if self.camera is not None:
            object.__setattr__(self, "seen_from", self.camera.link)

    @property
    def key(self) -> tuple[str, ...]:
        return (self.leg, self.link, self.kind, self.camera.name if self.camera else "")

    @property
    def view(self) -> Array:
        """The camera's pose (4, 4) in the reference link's frame."""
        return AT_CENTRE if self.camera is None else self.camera.pose

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        """The value (…, size) for points p (…, 3) and axes d (…, 3) in the camera's frame, radii r (…, 1)."""
        raise NotImplementedError

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        """∂value/∂p and ∂value/∂d, (…, size, 3) each, None where it is zero."""
        raise NotImplementedError

    @staticmethod
    def plane(p: Array, d: Array, r: Array) -> Array | None:
        """g (…, 3) of a plane g · x = 1 in the camera's frame in which what is seen lies: all that an image does not
        tell of its depth. None where the value tells it."""
        return None

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """The p and d of the same value that a controller takes for true which supposes the plane g."""
        return p, d

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        """:meth:`error` by formula, with its derivatives, of the coordinates of p and d in the camera's frame."""
        raise NotImplementedError

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        """The wrenches transmitted when the value is held, on the link's twist relative to the reference link."""
        raise NotImplementedError

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        """The virtual chain from the reference link to the link; raises ``BadMechanism`` where the value has no rate
        (a point in the camera's centre)."""
        raise NotImplementedError

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        """What the link's points and directions can do while the value keeps but for the sense of lines, planes and
        axes; none where that is none of these."""
        return ()

    def pointing(self, values: Array) -> Array | None:
        """Of values (n, size), what the chain's first U turns (n, 3), in the camera's frame; None where that is not
        among them."""
        return values[:, :3]

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """How it is drawn in the camera's frame, of the point p (3,), the axis d (3,) and the radius r: by default the
        ray."""
        return Drawn((np.array([0 * p, p]),))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        """What a picture shows, as polylines (n, 3) in the camera's frame: by default the point."""
        return (p[None],)

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        X = X_reference @ self.view
        found = self.outline(*self._place(X, X_link), size)
        lines, areas = ([each @ X[:3, :3].T + X[:3, 3] for each in every] for every in (found.lines, found.areas))
        return Drawn(tuple(lines), tuple(areas))

    def image(self, X_reference: Array, X_link: Array, size: float) -> list[Array]:
        every = self.polylines(*self._place(X_reference @ self.view, X_link), size)
        return [each[:, :2] / each[:, 2:] for each in map(before_camera, every) if len(each)]

    def _place(self, X_camera: Array, X_link: Array) -> tuple[Array, Array, float]:
        """p and d in the camera's frame, and r."""
        X = inverse(X_camera) @ X_link
        axis = np.zeros(3) if self.axis is None else X[:3, :3] @ self.axis
        return transform(X, self.at), axis, self.radius or 0.0

    def ahead(self, X_reference: Array, X_link: Array) -> float:
        """The sine of the angle by which the ray to B is in front of the focal plane; where the size of the picture is
        known, the least of the sines by which it is inside of its four sides."""
        p = transform(inverse(X_reference @ self.view), transform(X_link, self.at))
        camera, sides = self.camera, [np.array([0.0, 0.0, 1.0])]
        if camera is not None and camera.focal and camera.width and camera.height:
            halves = np.array([camera.width, camera.height]) / (2 * camera.focal)
            sides = [unit([*(sign * np.eye(2)[i]), half]) for i, half in enumerate(halves) for sign in (-1, 1)]
        return float(np.min(np.array(sides) @ p) / max(float(np.linalg.norm(p)), SAME_POINT))

    def plane_at(self, X_reference: Array, X_link: Array) -> Array | None:
        """:meth:`plane` where camera and link are, (3,)."""
        X = inverse(X_reference @ self.view) @ X_link
        d = X[:3, :3] @ self.axis if self.axis is not None else np.zeros(3)
        return self.plane(transform(X, self.at), d, np.array([self.radius or 0.0]))

    def pixels(self, noise: Mapping[str, float]) -> float:
        """Noise of so many pixels in the picture's plane z = 1."""
        focal = None if self.camera is None else self.camera.focal
        assert focal is not None
        return noise["px"] / focal

    def suppose_plane_rate(
        self, plane: Array, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array
    ) -> Array:
        """The rate (size, n) of the value if what is seen lay in the ``plane`` (3,), and moved as the link does."""
        return self._together((self,), X_reference, X_link[None], V_reference, V_link[None], plane[None])[1]

    def sighting(self, X_reference: Array, X_link: Array, far: Array | None = None) -> ViewGeometry:
        """Where camera and link are, in the base frame."""
        X = X_reference @ self.view
        axis = X_link[:3, :3] @ self.axis if self.axis is not None else np.zeros(3)
        return ViewGeometry(X[:3, 3], X[:3, 2], transform(X_link, self.at), axis, far)

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """The value, shape (size,), in the camera's frame (m)."""
        return self.together((self,), X_reference, X_link[None], np.zeros((6, 0)), np.zeros((1, 6, 0)))[0]

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """∂p · (velocity of B as the link carries it − as the camera would) + ∂d · ((ω − ω_c) × d), (size, n)."""
        return self.together((self,), X_reference, X_link[None], V_reference, V_link[None])[1]

    @classmethod
    def together(
        cls, observations: Sequence[Observation], X_reference: Array, X_links: Array, V_reference: Array, V_links: Array
    ) -> tuple[Array, Array]:
        return cls._together(observations, X_reference, X_links, V_reference, V_links)

    @classmethod
    def _together(
        cls,
        observations: Sequence[Observation],
        X_reference: Array,
        X_links: Array,
        V_reference: Array,
        V_links: Array,
        planes: Array | None = None,
    ) -> tuple[Array, Array]:
        """The same, where ``planes`` (k, 3) are given of what is supposed to lie in them."""
        at, axes, radii, views = _stack_observations(tuple(observations))
        X = X_reference @ views
        seen = X[:, :3, :3].transpose(0, 2, 1)
        B = (X_links[:, :3, :3] @ at)[:, :, 0] + X_links[:, :3, 3]
        p, d = ((seen @ each[:, :, None])[:, :, 0] for each in (B - X[:, :3, 3], (X_links[:, :3, :3] @ axes)[:, :, 0]))
        if planes is not None:
            p, d = cls.suppose_plane(p, d, radii, planes)
            B = (X[:, :3, :3] @ p[:, :, None])[:, :, 0] + X[:, :3, 3]
        values, (by_p, by_d) = cls.measurement(p, d, radii), cls.partials(p, d, radii)
        turn = V_links[:, 3:] - V_reference[3:]
        rates = np.zeros((len(at), cls.size, V_links.shape[2]))
        if by_p is not None:
            slip = (
                V_links[:, :3]
                - hat(B - X_links[:, :3, 3]) @ V_links[:, 3:]
                - V_reference[:3]
                + hat(B - X_reference[:3, 3]) @ V_reference[3:]
            )
            rates += (by_p @ seen) @ slip
        if by_d is not None:
            rates -= (by_d @ hat(d) @ seen) @ turn
        return values.ravel(), rates.reshape(len(at) * cls.size, V_links.shape[2])

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> Self:
        X = relative_pose(self.link, into, poses)
        return replace(
            super().carried_by(into, poses),
            at=transform(X, self.at),
            axis=None if self.axis is None else X[:3, :3] @ self.axis,
            camera=self.camera and self.camera.carried_by(into, poses),
        )

    def to_dict(self) -> ObservationRecord:
        return {
            **super().to_dict(),
            "camera": None if self.camera is None else self.camera.name,
            "at": self.at.tolist() if "at" in self.needs else None,
            "axis": None if self.axis is None else self.axis.tolist(),
        }

    def differences(self, other: Observation, tolerance: float) -> list[str]:
        if type(self) is not type(other) or (self.leg, self.link) != (other.leg, other.link):
            return [f"observation {self.leg}: {self!r} / {other!r}"]
        assert isinstance(other, CameraObservation)
        mine, theirs = ((o.camera.name if o.camera else None, o.radius) for o in (self, other))
        found = [] if mine == theirs else [f"{self.kind} {self.leg}: camera and radius {mine} / {theirs}"]
        pairs = (("point", self.at, other.at), ("axis", self.axis, other.axis), ("camera", self.view, other.view))
        return found + [
            f"{what} of {self.leg}: {a} / {b}"
            for what, a, b in pairs
            if (a is None) != (b is None) or (a is not None and b is not None and np.max(np.abs(a - b)) > tolerance)
        ]


class MetricPoint(CameraObservation):
    """What a sensor tells of a point in metres."""

    needs = ("at",)
    dimension = 1
    found_by = frozenset({"m"})

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        return value + noise["m"] * shocks[0, : self.size]


@lru_cache(maxsize=512)
def _stack_observations(observations: tuple[Observation, ...]) -> tuple[Array, Array, Array, Array]:
    """Points (k, 3, 1) and axes (k, 3, 1) of observations in their links, radii (k, 1), cameras (k, 4, 4)."""
    sights = [o for o in observations if isinstance(o, CameraObservation)]
    axes = [o.axis if o.axis is not None else np.zeros(3) for o in sights]
    return (
        frozen([o.at[:, None] for o in sights]),
        frozen([axis[:, None] for axis in axes]),
        frozen([[o.radius or 0.0] for o in sights]),
        frozen([o.view for o in sights]),
    )


def normalise_rates(w: Array) -> tuple[Array, Array]:
    """w/‖w‖ (…, 3) of vectors w, and what its rate makes of ẇ: (I − n nᵀ)/‖w‖, (…, 3, 3). Raises ``UndefinedValue``
    where a w vanishes."""
    size = np.linalg.norm(w, axis=-1, keepdims=True)
    if not np.all(size > SAME_POINT):
        raise UndefinedValue(
            "a point or line in the image: distance from the camera's centre (m)",
            float(size.min()),
            f"more than {SAME_POINT:g}",
        )
    n = w / size
    return n, (np.eye(3) - n[..., :, None] * n[..., None, :]) / size[..., None]
