"""Closed Type 2 conditions of a platform of six dof under six independent wrenches, by kind of constraint.

A *ray* lets a tip B move along a line r: an image point, a leg whose direction is observed. A *plane* lets B move
in a plane of normal n, and the platform rotate about the normals of an axis e: a line in the image. An *axis* u lets
the platform rotate about it alone: a direction, an inclination. Each condition is the determinant of the wrenches,
up to a constant (docs/pages/proofs.md has the derivations).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from .locked_legs import LockedLeg
from .named_vectors import CrossProduct, NamedVector
from .vector_algebra import load_products, make_vector


@dataclass(frozen=True)
class ClosedForm:
    """A condition in words, the expression that vanishes just there, and its factors, each with what it means."""

    words: str
    expression: Any
    parts: tuple[tuple[Any, str], ...] = ()


def find_closed_form(legs: Sequence[LockedLeg]) -> ClosedForm | None:
    """The condition of a mixture that has one, None else."""
    rays = [leg for leg in legs if leg.line is not None and leg.turning is None]
    planes = [leg for leg in legs if leg.normal is not None and leg.upright is not None]
    axes = [leg for leg in legs if leg.is_tip_free and leg.about is not None]
    known: dict[tuple[int, int, int], Callable[..., ClosedForm]] = {
        (3, 0, 0): _derive_three_rays,
        (2, 1, 0): _derive_two_rays_plane,
        (1, 2, 0): _derive_ray_two_planes,
        (0, 3, 0): _derive_three_planes,
        (2, 0, 1): _derive_two_rays_axis,
        (1, 1, 1): _derive_ray_plane_axis,
    }
    if len(legs) != 3 or (form := known.get((len(rays), len(planes), len(axes)))) is None:
        return None
    return form(*rays, *planes, *axes)


def _derive_three_rays(*rays: LockedLeg) -> ClosedForm:
    """The tips' speeds along their lines that keep |B_i B_j|: a 3 × 3 determinant."""
    dot, _, _ = load_products()
    line, tips = [_name_of(leg.line) for leg in rays], [_name_of(leg.tip) for leg in rays]
    sides = [tips[(i + 1) % 3] - tips[i] for i in range(3)]
    forth = dot(line[0], sides[0]) * dot(line[1], sides[1]) * dot(line[2], sides[2])
    back = dot(line[1], sides[0]) * dot(line[2], sides[1]) * dot(line[0], sides[2])
    if (eye := _find_common_camera(rays)) is not None:
        return _derive_danger_cylinder(eye, rays, forth - back)
    names = [leg.tip.symbol for leg in rays]
    normals = ", ".join(str(each) for each in line)
    words = (
        f"the planes through {', '.join(names)} normal to {normals}, and the plane {''.join(names)}, meet in a "
        "point (which may lie at infinity)"
    )
    return ClosedForm(words, forth - back)


def _derive_danger_cylinder(eye: str, rays: Sequence[LockedLeg], expression: Any) -> ClosedForm:
    """forth − back = |n|² (ρ² − R²) / (λ₁ λ₂ λ₃) where the lines meet in C: λ_i = ‖CB_i‖, n = B₁B₂ × B₁B₃, R the
    radius of the circle through the points, ρ the distance of C from its axis."""
    dot, cross, det = load_products()
    one, two, three = (leg.tip.symbol for leg in rays)
    tips = [_name_of(leg.tip) for leg in rays]
    b, c, x = tips[1] - tips[0], tips[2] - tips[0], make_vector(eye) - tips[0]
    n = cross(b, c)
    square = dot(cross(n, x), cross(n, x)) + dot(b, b) * det(x, n, c) - dot(c, c) * det(x, n, b)
    points = f"{one}, {two}, {three}"
    words = f"{eye} lies on the danger cylinder, the circular cylinder over the circle through {points}"
    means = (
        f"|n|² (ρ² - R²), n = {one}{two} × {one}{three}, R the radius of the circle through {points}, ρ the "
        f"distance of {eye} from its axis: |{eye}{one}| |{eye}{two}| |{eye}{three}| times the expression, "
        "a proved identity"
    )
    return ClosedForm(words, expression, ((square, means),))


def _derive_three_planes(*planes: LockedLeg) -> ClosedForm:
    """Forces n_i at B_i and moments e_i: a block triangular matrix, so det(n₁, n₂, n₃) det(e₁, e₂, e₃)."""
    _, _, det = load_products()
    normals, uprights = [_name_of(leg.normal) for leg in planes], [_name_of(leg.upright) for leg in planes]
    n, e = (", ".join(map(str, each)) for each in (normals, uprights))
    eye, lines = _find_common_camera(planes), ", ".join(leg.label for leg in planes)
    if eye is None:
        meet = f"the planes of the cameras and their lines ({n}) are parallel to one line"
    else:
        meet = f"the planes of {eye} and the lines ({n}) have a line in common: the images of the lines meet in a point"
    feet = f"the perpendiculars from the cameras to their lines ({e}) are parallel to one plane"
    feet = (
        feet if eye is None else f"{eye} and the footpoints of its perpendiculars on the lines ({e}) lie in one plane"
    )
    fixed = eye is not None and all(isinstance(leg.normal, CrossProduct) for leg in planes)
    more = f"; {eye} is on the ruled quadric of the lines that meet {lines}" if fixed else ""
    both = det(*normals), det(*uprights)
    return ClosedForm(f"{meet}, or {feet}", both[0] * both[1], ((both[0], meet + more), (both[1], feet)))


def _derive_two_rays_plane(one: LockedLeg, two: LockedLeg, plane: LockedLeg) -> ClosedForm:
    """Speeds (r₂·b, r₁·b) along the rays keep |B₁B₂|, b = B₂ − B₁; then ω = (b × δ)/b² + t b, δ the difference of
    velocities, with e·ω = 0 and n·v(B₃) = 0."""
    dot, cross, det = load_products()
    r1, r2, n, e = _name_of(one.line), _name_of(two.line), _name_of(plane.normal), _name_of(plane.upright)
    b, c = _name_of(two.tip) - _name_of(one.tip), _name_of(plane.tip) - _name_of(one.tip)
    turn = dot(r1, b) * det(e, b, r2) - dot(r2, b) * det(e, b, r1)
    slip = (
        dot(b, b) * dot(r2, b) * dot(n, r1)
        + dot(r1, b) * dot(n, cross(cross(b, r2), c))
        - dot(r2, b) * dot(n, cross(cross(b, r1), c))
    )
    expression = (turn * det(n, b, c) - dot(e, b) * slip) / dot(b, b)
    words = (
        f"some motion of the platform moves {one.tip.symbol} along {r1}, {two.tip.symbol} along {r2} and "
        f"{plane.tip.symbol} normal to {n}, and rotates it about a normal of {e}"
    )
    return ClosedForm(words, expression)


def _derive_ray_two_planes(ray: LockedLeg, one: LockedLeg, two: LockedLeg) -> ClosedForm:
    """ω = s w, w = e₂ × e₃, and v(B₁) = μ r: two equations n_i·v(B_i) = 0 in (μ, s)."""
    dot, cross, det = load_products()
    r, w = _name_of(ray.line), cross(_name_of(one.upright), _name_of(two.upright))
    arms = [det(_name_of(leg.normal), w, _name_of(leg.tip) - _name_of(ray.tip)) for leg in (one, two)]
    expression = dot(_name_of(one.normal), r) * arms[1] - dot(_name_of(two.normal), r) * arms[0]
    words = (
        f"some motion of the platform moves {ray.tip.symbol} along {r}, {one.tip.symbol} normal to "
        f"{_name_of(one.normal)}, {two.tip.symbol} normal to {_name_of(two.normal)}, and rotates it about the "
        f"normal of {_name_of(one.upright)}, {_name_of(two.upright)}"
    )
    return ClosedForm(words, expression)


def _derive_two_rays_axis(one: LockedLeg, two: LockedLeg, axis: LockedLeg) -> ClosedForm:
    """μ₂ r₂ − μ₁ r₁ = s u × b, b = B₂ − B₁; with one centre C of both, r₁ × r₂ is along CB₁ × b, and C is in a plane
    that depends on u and the points alone."""
    dot, cross, det = load_products()
    r1, r2, u, b = _name_of(one.line), _name_of(two.line), _name_of(axis.about), _name_of(two.tip) - _name_of(one.tip)
    names, eye, expression = (
        f"{one.tip.symbol}{two.tip.symbol}",
        _find_common_camera([one, two]),
        det(r1, r2, cross(u, b)),
    )
    if eye is None:
        return ClosedForm(f"{r1}, {r2} and {u} × {names} are parallel to one plane", expression)
    words = f"{eye} lies in the plane through {one.tip.symbol}, {two.tip.symbol} that is parallel to {u} × {names}"
    means = (
        f"that plane: |{eye}{one.tip.symbol}| |{eye}{two.tip.symbol}| times the expression up to sign, a "
        "proved identity"
    )
    return ClosedForm(words, expression, ((dot(cross(b, cross(u, b)), make_vector(eye) - _name_of(one.tip)), means),))


def _derive_ray_plane_axis(ray: LockedLeg, plane: LockedLeg, axis: LockedLeg) -> ClosedForm:
    """ω = s u with s e·u = 0, and v = μ r with μ n·r = 0."""
    dot, _, _ = load_products()
    r, n, e, u = _name_of(ray.line), _name_of(plane.normal), _name_of(plane.upright), _name_of(axis.about)
    along, turn = f"{r} lies in the plane normal to {n}", f"{u} is normal to {e}"
    if _find_common_camera([ray, plane]) is not None:
        along = f"the image of {ray.label} lies on that of {plane.label} ({r} is normal to {n})"
    both = dot(n, r), dot(e, u)
    return ClosedForm(f"{along}, or {turn}", both[0] * both[1], ((both[0], along), (both[1], turn)))


def _find_common_camera(legs: Sequence[LockedLeg]) -> str | None:
    """The symbol of the one camera's centre that all have, None where they have several or none."""
    eyes = {leg.eye.symbol if leg.eye is not None else None for leg in legs}
    return eyes.pop() if len(eyes) == 1 else None


def _name_of(feature: NamedVector | None) -> Any:
    assert feature is not None
    return make_vector(feature.symbol)
