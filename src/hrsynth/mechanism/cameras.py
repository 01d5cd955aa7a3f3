"""Cameras and their observations of a link: functions of a point B and an axis d fixed in the link, both in the frame
of a camera with its centre C on the reference link (docs/pages/observations.md).

A kind gives its value and partial derivatives, the wrenches of its locked value, and its virtual chain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import ClassVar, Self

import numpy as np

from ..errors import BadMechanism, UndefinedValue
from ..geometry.jets import Jet
from ..geometry.vectors import (
    Array,
    Numbers,
    dot,
    find_perpendicular,
    freeze_array,
    hat,
    invert_pose,
    normalise_vector,
    transform,
)
from ..results import Value
from ..tolerances import POINT_DISTANCE_TOL
from .observation import Drawn, Observation, ObservationRecord

IMAGE_DEPTH_MIN_M = 1e-3
"""Smallest depth (m) of lines drawn in an image."""

AT_CENTRE = freeze_array(np.eye(4))
CIRCLE_POLYGON_SIDES_COUNT = 48
"""Sides of a polygon by which a circle is drawn."""


@dataclass(frozen=True, eq=False, repr=False)
class NamedCamera(Value):
    """Named camera on a link: its frame's ``pose`` (4, 4) in the link's (x right, y down, z ahead, its origin the
    centre C); the focal length and the image size, in pixels, if known."""

    name: str
    link: str
    pose: Array = field(default_factory=lambda: AT_CENTRE)
    focal: float | None = None
    width: int | None = None
    height: int | None = None
    line: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", freeze_array(self.pose))

    def carried_by(self, into: Mapping[str, str], poses: Mapping[str, Array]) -> NamedCamera:
        """Return the camera where links became parts of others, as for observations."""
        return replace(self, link=into[self.link], pose=compute_relative_pose(self.link, into, poses) @ self.pose)


def compute_relative_pose(link: str, into: Mapping[str, str], poses: Mapping[str, Array]) -> Array:
    """Return the pose of a link in the frame of the one that took it in."""
    return AT_CENTRE if into[link] == link else invert_pose(poses[into[link]]) @ poses[link]


@dataclass(frozen=True, eq=False)
class VirtualJoint:
    """Joint of a virtual chain, at the zero configuration in base axes: its type's letter, centre, axes."""

    letter: str
    at: Array
    axes: tuple[Array, ...] = ()
    actuated: bool = False


@dataclass(frozen=True, eq=False)
class ViewGeometry:
    """Geometry of camera and link, in one frame: the centre C, the camera's z axis, the point B, the axis d; to build a
    chain also ``far``, a unit vector far from all directions that its first U rotates."""

    C: Numbers
    z: Numbers
    B: Numbers
    d: Numbers
    far: Array | None = None

    @property
    def ray(self) -> Array:
        """Unit vector from C to B."""
        return normalise_vector(self.B - self.C)

    @property
    def foot(self) -> Array:
        """Point of the line (B, d) that is nearest to C."""
        return np.asarray(self.B - ((self.B - self.C) @ self.d) * self.d)


@dataclass(frozen=True, eq=False)
class FixedValueLocus:
    """Locus that a fixed value leaves to a point of the link at ``place`` (3,), or with ``turns`` to a direction of it.

    A point stays in the planes ``through`` (3,) with these ``normals`` (k, 3) and, if ``radius`` is given, on the
    sphere about ``through``; a direction keeps its angles with the normals. All in the frame of the
    :class:`ViewGeometry`.
    """

    place: Array
    normals: Array
    through: Array
    radius: float | None = None
    turns: bool = False


def make_plane_locus(place: Array, through: Array, *across: Array) -> FixedValueLocus:
    """Return the locus of a point in planes with these normals, of any length: three fix it, two leave it a line."""
    return FixedValueLocus(place, np.array([normalise_vector(n) for n in across]), through)


def make_angle_locus(d: Array, *across: Array) -> FixedValueLocus:
    """Return the locus of a direction that keeps its angles with these vectors, of any length."""
    return FixedValueLocus(d, np.array([normalise_vector(n) for n in across]), np.zeros(3), turns=True)


def make_line_locus(at: ViewGeometry, n: Array) -> tuple[FixedValueLocus, ...]:
    """Return the loci of the line (B, d) in the plane with this normal."""
    return make_plane_locus(at.B, at.B, n), make_angle_locus(at.d, n)


def make_universal(at: Array, turned: Array, far: Array | None, actuated: bool = False) -> VirtualJoint:
    """Return a U at a point that rotates a direction any way: its first axis e₁ far from it, its second normal to
    both."""
    first = find_perpendicular(turned) if far is None else far
    return VirtualJoint("U", at, (first, normalise_vector(np.cross(first, turned))), actuated)


def make_ray_chain(at: ViewGeometry, what: str, far: Array | None, *actuated: bool) -> tuple[VirtualJoint, ...]:
    """Return U-P-S to the point B: U at C, with its first axis ``far`` from the ray, P along the ray;
    ``actuated``: U is, P is. Raises ``BadMechanism`` if B is C."""
    require_distance(at, at.B, 0.0, what, "a point outside of it")
    slide = VirtualJoint("P", at.C, (at.ray,), actuated[1])
    return make_universal(at.C, at.ray, far, actuated[0]), slide, VirtualJoint("S", at.B)


def make_line_chain(at: ViewGeometry, normal: Array, out: Array, actuated: int) -> tuple[VirtualJoint, ...]:
    """Return U-R-P-C to the line (B, d): U at C rotates the ``normal`` of a plane through C, R rotates in it, P
    translates along ``out`` in it, C lies along the line; the first so many of them actuated."""
    joints = (
        make_universal(at.C, normal, at.far),
        VirtualJoint("R", at.C, (normal,)),
        VirtualJoint("P", at.C, (out,)),
        VirtualJoint("C", at.foot, (at.d,)),
    )
    return tuple(replace(joint, actuated=number < actuated) for number, joint in enumerate(joints))


def draw_line_piece(p: Array, d: Array, size: float) -> Array:
    """Return a segment (2, 3) of a line about p."""
    return np.array([p - size * d, p + size * d])


def draw_circle(p: Array, d: Array, r: float) -> Array:
    """Return a circle as a polyline (n, 3)."""
    one = find_perpendicular(d)
    turns = np.linspace(0, 2 * np.pi, CIRCLE_POLYGON_SIDES_COUNT + 1)
    return np.asarray(p + abs(r) * (np.outer(np.cos(turns), one) + np.outer(np.sin(turns), np.cross(d, one))))


def cut_at_camera(points: Array) -> Array:
    """Return the part of a polyline (n, 3) in front of the camera; of a segment that part, else all or nothing."""
    ahead = points[:, 2] > IMAGE_DEPTH_MIN_M
    if len(points) == 2 and ahead.sum() == 1:
        a, b = points[ahead][0], points[~ahead][0]
        return np.array([a, a + (a[2] - IMAGE_DEPTH_MIN_M) / (a[2] - b[2]) * (b - a)])
    return points if ahead.all() else points[:0]


def make_depth_plane(z: Numbers) -> Array:
    """Return g of the planes (…, 3) parallel to the image plane at depths z (…, 1)."""
    return np.asarray(np.eye(3)[2] / z)


def make_line_plane(p: Array, d: Array) -> Array:
    """Return g of the plane through a line (p, d) that is normal to that of C and the line: f/‖f‖², f the point of the
    line nearest to C."""
    foot = p - dot(p, d)[..., None] * d
    return np.asarray(foot / dot(foot, foot)[..., None])


def find_nearest_on_line(n: Array, g: Array) -> Array:
    """Return the point nearest to C of the line in which the plane of normal n through C meets that of g."""
    inside = g - dot(g, n)[..., None] * n
    return np.asarray(inside / dot(inside, inside)[..., None])


def require_distance(at: ViewGeometry, from_: Array, least: float, what: str, limit: str) -> float:
    """Return the distance of C from a point. Raises ``BadMechanism`` if it is not larger than ``least``."""
    distance = float(np.linalg.norm(from_ - at.C))
    if not distance > least + POINT_DISTANCE_TOL * (1 + least):
        raise BadMechanism(f"{what}: distance from the camera centre (m)", distance, limit)
    return distance


@dataclass(frozen=True, eq=False, repr=False)
class CameraObservation(Observation):
    """Measurement by a camera, of the point ``at`` (3,) and the ``axis`` (3,) in the *link's* frame; C is the origin of
    the reference link's frame if no ``camera`` is named.

    Values are in the camera's frame. ``radius`` is that of a cylinder or circle (m); its sign selects an edge.
    """

    locked: ClassVar[str]
    """Wrenches that it transmits when its value is fixed, for the table of all kinds."""
    rational: ClassVar[bool] = True
    """Its wrenches are polynomials of C, B, d and z."""
    whole: ClassVar[bool] = True
    """Its rates vanish exactly for the motions against which its wrenches do no work, if it has a rate."""
    along_z: ClassVar[bool] = False
    """The camera's z axis matters."""
    signed: ClassVar[bool] = False
    """The sign of the radius selects one of two edges."""
    images_point: ClassVar[bool] = True
    """B itself is in the image, not any point of a line."""

    at: Array = field(default_factory=lambda: freeze_array(np.zeros(3)), kw_only=True)
    axis: Array | None = field(default=None, kw_only=True)
    radius: float | None = field(default=None, kw_only=True)
    camera: NamedCamera | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", freeze_array(self.at))
        if self.axis is not None:
            try:
                object.__setattr__(self, "axis", freeze_array(normalise_vector(self.axis)))
            except ValueError:
                raise BadMechanism(f"{self.text}: axis", "0 0 0", "a non-zero vector") from None
        if self.camera is not None:
            object.__setattr__(self, "seen_from", self.camera.link)

    @property
    def key(self) -> tuple[str, ...]:
        return (self.leg, self.link, self.kind, self.camera.name if self.camera else "")

    @property
    def view(self) -> Array:
        """Pose of the camera (4, 4) in the reference link's frame."""
        return AT_CENTRE if self.camera is None else self.camera.pose

    @staticmethod
    def measurement(p: Array, d: Array, r: Array) -> Array:
        """Return the value (…, size) for points p (…, 3) and axes d (…, 3) in the camera's frame, radii r (…, 1)."""
        raise NotImplementedError

    @staticmethod
    def partials(p: Array, d: Array, r: Array) -> tuple[Array | None, Array | None]:
        """Return ∂value/∂p and ∂value/∂d, (…, size, 3) each, None if zero."""
        raise NotImplementedError

    @staticmethod
    def plane(p: Array, d: Array, r: Array) -> Array | None:
        """Return g (…, 3) of a plane g · x = 1 in the camera's frame that contains the observed geometry: its depth,
        which an image does not give. None if the value gives it."""
        return None

    @staticmethod
    def suppose_plane(p: Array, d: Array, r: Array, g: Array) -> tuple[Array, Array]:
        """Return the p and d of the same value that a controller assumes with the plane g."""
        return p, d

    @staticmethod
    def error_jets(p: Sequence[Jet], d: Sequence[Jet], r: Jet, wanted: Array) -> list[Jet]:
        """Return :meth:`describe_pose_error` by formula, with its derivatives by the coordinates of p and d in the
        camera's frame."""
        raise NotImplementedError

    def wrenches(self, at: ViewGeometry) -> list[Numbers]:
        """Return the wrenches transmitted when the value is fixed, on the link's twist relative to the reference
        link."""
        raise NotImplementedError

    def chain(self, at: ViewGeometry) -> tuple[VirtualJoint, ...]:
        """Return the virtual chain from the reference link to the link. Raises ``BadMechanism`` if the value has no
        rate (a point in the camera centre)."""
        raise NotImplementedError

    def loci(self, at: ViewGeometry) -> tuple[FixedValueLocus, ...]:
        """Return the loci of the link's points and directions with a fixed value (but for the sense of lines, planes
        and axes); none if they have another form."""
        return ()

    def pointing(self, values: Array) -> Array | None:
        """Return the part (n, 3) of values (n, size) that the chain's first U rotates, in the camera's frame; None if
        it is not among them."""
        return values[:, :3]

    @staticmethod
    def outline(p: Array, d: Array, r: float, size: float) -> Drawn:
        """Return the drawing in the camera's frame, for the point p (3,), the axis d (3,) and the radius r: by default
        the ray."""
        return Drawn((np.array([0 * p, p]),))

    @staticmethod
    def polylines(p: Array, d: Array, r: float, size: float) -> tuple[Array, ...]:
        """Return the image as polylines (n, 3) in the camera's frame: by default the point."""
        return (p[None],)

    def draw(self, X_reference: Array, X_link: Array, size: float) -> Drawn:
        X = X_reference @ self.view
        found = self.outline(*self._place(X, X_link), size)
        lines, areas = ([each @ X[:3, :3].T + X[:3, 3] for each in every] for every in (found.lines, found.areas))
        return Drawn(tuple(lines), tuple(areas))

    def image(self, X_reference: Array, X_link: Array, size: float) -> list[Array]:
        every = self.polylines(*self._place(X_reference @ self.view, X_link), size)
        return [each[:, :2] / each[:, 2:] for each in map(cut_at_camera, every) if len(each)]

    def _place(self, X_camera: Array, X_link: Array) -> tuple[Array, Array, float]:
        """Return p and d in the camera's frame, and r."""
        X = invert_pose(X_camera) @ X_link
        axis = np.zeros(3) if self.axis is None else X[:3, :3] @ self.axis
        return transform(X, self.at), axis, self.radius or 0.0

    def ahead(self, X_reference: Array, X_link: Array) -> float:
        """Return the sine of the angle by which the ray to B is in front of the focal plane; if the image size is
        known, the least of the sines by which it is inside of its four sides."""
        p = transform(invert_pose(X_reference @ self.view), transform(X_link, self.at))
        camera, sides = self.camera, [np.array([0.0, 0.0, 1.0])]
        if camera is not None and camera.focal and camera.width and camera.height:
            halves = np.array([camera.width, camera.height]) / (2 * camera.focal)
            sides = [
                normalise_vector([*(sign * np.eye(2)[i]), half]) for i, half in enumerate(halves) for sign in (-1, 1)
            ]
        return float(np.min(np.array(sides) @ p) / max(float(np.linalg.norm(p)), POINT_DISTANCE_TOL))

    def in_front(self, X_reference: Array, X_link: Array) -> float:
        is_visible = self.camera is None or not self.images_point
        return np.inf if is_visible else self.ahead(X_reference, X_link)

    def plane_at(self, X_reference: Array, X_link: Array) -> Array | None:
        """Return :meth:`plane` at these poses of camera and link, (3,)."""
        X = invert_pose(X_reference @ self.view) @ X_link
        d = X[:3, :3] @ self.axis if self.axis is not None else np.zeros(3)
        return self.plane(transform(X, self.at), d, np.array([self.radius or 0.0]))

    def pixels(self, noise: Mapping[str, float]) -> float:
        """Return noise in pixels in the image plane z = 1."""
        focal = None if self.camera is None else self.camera.focal
        assert focal is not None
        return noise["px"] / focal

    def suppose_plane_rate(
        self, plane: Array, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array
    ) -> Array:
        """Return the rate (size, n) of the value if the observed geometry was in the ``plane`` (3,) and moved like the
        link."""
        return self._together((self,), X_reference, X_link[None], V_reference, V_link[None], plane[None])[1]

    def sighting(self, X_reference: Array, X_link: Array, far: Array | None = None) -> ViewGeometry:
        """Return the geometry of camera and link in the base frame."""
        X = X_reference @ self.view
        axis = X_link[:3, :3] @ self.axis if self.axis is not None else np.zeros(3)
        return ViewGeometry(X[:3, 3], X[:3, 2], transform(X_link, self.at), axis, far)

    def value(self, X_reference: Array, X_link: Array) -> Array:
        """Return the value, shape (size,), in the camera's frame (m)."""
        return self.together((self,), X_reference, X_link[None], np.zeros((6, 0)), np.zeros((1, 6, 0)))[0]

    def rate(self, X_reference: Array, X_link: Array, V_reference: Array, V_link: Array) -> Array:
        """Return ∂p · (velocity of B on the link − on the camera's link) + ∂d · ((ω − ω_c) × d), (size, n)."""
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
        """Return values and rates, with ``planes`` (k, 3) that are assumed to contain the observed geometry."""
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
        X = compute_relative_pose(self.link, into, poses)
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
        found = [] if mine == theirs else [f"{self.text}: camera and radius {mine} / {theirs}"]
        pairs = (("point", self.at, other.at), ("axis", self.axis, other.axis), ("camera", self.view, other.view))
        return found + [
            f"{what} of {self.leg}: {a} / {b}"
            for what, a, b in pairs
            if (a is None) != (b is None) or (a is not None and b is not None and np.max(np.abs(a - b)) > tolerance)
        ]


class MetricPoint(CameraObservation):
    """Measurement of a point in metres."""

    needs = ("at",)
    dimension = 1
    found_by = frozenset({"m"})

    def sense(self, value: Array, shocks: Array, noise: Mapping[str, float]) -> Array:
        return value + noise["m"] * shocks[0, : self.size]


@lru_cache(maxsize=512)
def _stack_observations(observations: tuple[Observation, ...]) -> tuple[Array, Array, Array, Array]:
    """Return points (k, 3, 1) and axes (k, 3, 1) of observations in their links, radii (k, 1), cameras (k, 4, 4)."""
    sights = [o for o in observations if isinstance(o, CameraObservation)]
    axes = [o.axis if o.axis is not None else np.zeros(3) for o in sights]
    return (
        freeze_array([o.at[:, None] for o in sights]),
        freeze_array([axis[:, None] for axis in axes]),
        freeze_array([[o.radius or 0.0] for o in sights]),
        freeze_array([o.view for o in sights]),
    )


def normalise_rates(w: Array) -> tuple[Array, Array]:
    """Return w/‖w‖ (…, 3) of vectors w, and the factor of its rate on ẇ: (I − n nᵀ)/‖w‖, (…, 3, 3). Raises
    ``UndefinedValue`` if a w vanishes."""
    size = np.linalg.norm(w, axis=-1, keepdims=True)
    if not np.all(size > POINT_DISTANCE_TOL):
        raise UndefinedValue(
            "a point or line in the image: distance from the camera centre (m)",
            float(size.min()),
            f"more than {POINT_DISTANCE_TOL:g}",
        )
    n = w / size
    return n, (np.eye(3) - n[..., :, None] * n[..., None, :]) / size[..., None]
