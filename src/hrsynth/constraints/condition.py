"""Type 2 condition of a pattern: rows that must lose rank, a SymPy expression that must vanish, and words.

Feasible motions of the platform have coordinates x (d of them); locked leg i allows those for which its tip's
velocity J_i x lies along its line: N_i J_i x = 0. A platform dof is unobserved where the stacked rows have a kernel
(theory.md 7).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from ..geometry.vectors import Array, hat
from ..kinematics.locked_twists import compute_interaction
from ..kinematics.velocity_relation import ObservationModel
from ..results import Value
from ..tolerances import RELATION_ANGLE_TOL
from .closed_conditions import find_closed_form
from .locked_legs import LockedLeg, compute_forbidden_projectors, compute_projectors, compute_rotation_projectors
from .named_vectors import BodyVector, NamedVector, Tangent
from .pattern import TURNING_MOTIONS, ConstraintPattern, PatternValues
from .vector_algebra import evaluate, load_products, make_vector

Values = Mapping[str, Array]


@dataclass(frozen=True, eq=False, repr=False)
class Condition(Value):
    """Condition under which a platform dof is unobserved: in words, and as an expression that vanishes there.
    ``signed``: the expression changes its sign across the locus; ``never``: it cannot vanish; ``factors``: trivial
    factors, which vanish only where a part of the robot has no length."""

    words: str
    expression: Any
    signed: bool = False
    factors: tuple[str, ...] = ()
    never: bool = False
    where: Mapping[str, str] = field(default_factory=dict)
    """Meaning of each symbol."""
    parts: tuple[tuple[Any, str], ...] = ()
    """Factors of the expression, which vanishes where one of them does, each with what that means."""

    def rows(self, here: PatternValues) -> Array:
        """Rows (n, rows, d) that have a kernel exactly where a platform dof is unobserved."""
        raise NotImplementedError

    def evaluate(self, here: PatternValues, rows: Array | None = None) -> Array:
        """The expression's value, (n,), as a first power of the distance to the locus (the root of a sum of squares).

        Here that of the determinant of a Gram matrix of the rows, unless they are known."""
        M = self.rows(here) if rows is None else rows
        return np.sqrt(np.abs(np.linalg.det(M.transpose(0, 2, 1) @ M)))


@dataclass(frozen=True, eq=False, repr=False)
class NamedCondition(Condition):
    """A condition in vectors that have names."""

    pattern: ConstraintPattern = field(kw_only=True)

    def rows(self, here: PatternValues) -> Array:
        return compute_leg_rows(self.pattern, here.values)

    def evaluate(self, here: PatternValues, rows: Array | None = None) -> Array:
        import sympy

        if isinstance(self.expression, sympy.Determinant):
            return (
                np.linalg.det(compute_normal_lines(self.pattern, here.values))
                if self.signed
                else super().evaluate(here, rows)
            )
        found = evaluate(self.expression, here.values)
        return found if self.signed else np.sqrt(np.abs(found))


@dataclass(frozen=True, eq=False, repr=False)
class General(Condition):
    """The condition of any mechanism: the interaction matrix by the screws of all joints loses rank."""

    observation_model: ObservationModel = field(kw_only=True)

    def rows(self, here: PatternValues) -> Array:
        return np.array([compute_interaction(at, self.observation_model) for at in here.configurations])


def compute_leg_rows(pattern: ConstraintPattern, values: Values) -> Array:
    """The rows of all legs, and those that keep to a plane."""
    blocks = []
    some = values[pattern.legs[0].tip.symbol]
    eye = np.broadcast_to(np.eye(3), (len(some), 3, 3))
    zero = np.zeros_like(eye)
    for leg in pattern.legs:
        match pattern.motion:
            case "translations":
                J = eye
            case "bodies":
                moves = float(leg.body in pattern.bodies[1:])
                J = np.concatenate([eye, moves * values[_make_symbol(pattern.slide)][:, :, None]], axis=2)
            case _:
                J = np.concatenate([eye, -hat(values[leg.tip.symbol])], axis=2)
        blocks.append(compute_forbidden_projectors(leg, values) @ J)
        turns = compute_rotation_projectors(leg, values) if pattern.motion in TURNING_MOTIONS else None
        if turns is not None:
            blocks.append(np.concatenate([np.zeros_like(turns), turns], axis=2))
    if pattern.motion == "planar":
        n = values[_make_symbol(pattern.plane)]
        blocks.append(np.concatenate([n[:, None, :], np.zeros((len(n), 1, 3))], axis=2))
        blocks.append(np.concatenate([zero, compute_projectors(n)], axis=2))
    return np.concatenate(blocks, axis=1)


def compute_normal_lines(pattern: ConstraintPattern, values: Values) -> Array:
    """The lines (n_i, B_i × n_i) through the tips along the legs' normals, (n, legs, 6)."""
    pairs = [(values[_make_symbol(leg.normal)], values[leg.tip.symbol]) for leg in pattern.legs]
    return np.stack([np.concatenate([n, np.cross(B, n)], axis=-1) for n, B in pairs], axis=1)


def derive_condition(pattern: ConstraintPattern, observation_model: ObservationModel) -> Condition:
    """The condition of a pattern: by name where it is a known one, else by the screws of all joints."""
    if pattern.motion in ("other", "oriented"):
        return _derive_general(observation_model)
    if pattern.motion == "translations" and (fixed := [leg for leg in pattern.legs if leg.fixed]):
        what = "motion" if any(leg.turns == 0 for leg in fixed) else "translation"
        return NamedCondition(
            f"never: a locked leg leaves the platform no {what}", _convert_to_number(1), never=True, pattern=pattern
        )
    lines = [leg for leg in pattern.legs if leg.line is not None]
    if pattern.motion == "translations":
        return _derive_translations(pattern, lines)
    if pattern.motion == "spatial" and (form := find_closed_form(pattern.legs)) is not None:
        return _name_condition(pattern, form.words, form.expression, True, parts=form.parts)
    if pattern.motion in TURNING_MOTIONS and any(
        leg.virtual and (leg.turning is not None or pattern.motion == "planar") for leg in pattern.legs
    ):
        return _derive_gram(pattern)
    normals = [leg for leg in pattern.legs if leg.normal is not None]
    fixed = [leg for leg in pattern.legs if leg.fixed]
    if pattern.motion == "spatial" and len(normals) == len(pattern.legs) == 6:
        return _derive_line_complex(pattern, normals)
    if pattern.motion == "planar" and not pattern.flat:
        return _derive_gram(pattern)
    if pattern.motion == "planar" and (len(lines), len(fixed)) == (1, 1):
        return _derive_pivot(pattern, lines[0], fixed[0])
    if len(lines) == len(pattern.legs):
        if pattern.motion == "planar" and len(lines) == 3:
            return _derive_planar(pattern, lines)
        if pattern.motion == "bodies" and len(lines) == 2 and lines[0].body != lines[1].body:
            return _derive_bodies(pattern, lines)
    return _derive_gram(pattern)


def _derive_translations(pattern: ConstraintPattern, lines: Sequence[LockedLeg]) -> Condition:
    dot, cross, det = load_products()
    symbols = [make_vector(_make_symbol(leg.line)) for leg in lines]
    normals = [make_vector(_make_symbol(leg.normal)) for leg in pattern.legs if leg.normal is not None]
    names = _describe_features(leg.line for leg in lines)
    constant = all(pattern.constant(leg.line) is not None for leg in lines)
    signed = False
    if not lines:
        expression = sum(det(*triple) ** 2 for triple in combinations(normals, 3))
        words = f"{_describe_features(leg.normal for leg in pattern.legs)} are parallel to one plane"
        if len(normals) == 3:
            expression, signed = det(*normals), True
    elif not normals and len(lines) == 2 and pattern.plane is not None:
        expression, signed = det(make_vector(_make_symbol(pattern.plane)), *symbols), True
        words = f"{names} are parallel"
    elif not normals:
        expression = sum(dot(cross(a, b), cross(a, b)) for a, b in combinations(symbols, 2))
        words = f"{names} are {'all ' if len(lines) > 2 else ''}parallel"
    else:
        first = symbols[0]
        expression = sum(dot(cross(first, b), cross(first, b)) for b in symbols[1:])
        expression += sum(dot(first, n) ** 2 for n in normals)
        planes = [leg.normal.symbol for leg in pattern.legs if leg.normal is not None]
        across = f"the plane{'s' * (len(planes) > 1)} normal to {_join_words(planes)}"
        words = (
            f"{symbols[0]} is parallel to {across}"
            if len(symbols) == 1
            else f"{names} are {'all ' if len(lines) > 2 else ''}parallel, also to {across}"
        )
    if constant and not normals and len(lines) > 1:
        several = "all " if len(lines) > 2 else ""
        never = f"never: {names} are constant and not {several}parallel"
        return _name_condition(pattern, never, expression, False, never=True)
    if reason := _explain_no_translation(pattern):
        return _name_condition(pattern, f"never: {reason}", expression, False, never=True)
    return _name_condition(pattern, words, expression, signed)


def _explain_no_translation(pattern: ConstraintPattern) -> str | None:
    """Reason why locked legs allow no common translation x at any pose, None if this is not known: x would have to lie
    along each line that is constant, and be normal to each constant axis about which a tip rotates and to each constant
    normal of a tip's plane; no x does where these rows have rank 3."""
    rows, reasons = [], []
    for leg in pattern.legs:
        line, axis = leg.line, leg.line.axis if isinstance(leg.line, Tangent) else leg.normal
        if (u := pattern.constant(line)) is not None:
            rows.append(np.eye(3) - np.outer(u, u))
            reasons.append(f"along {_make_symbol(line)}")
        elif axis is not None and (n := pattern.constant(axis)) is not None:
            rows.append(n[None])
            reasons.append(f"normal to the {axis.meaning}")
    if not rows or np.linalg.svd(np.vstack(rows), compute_uv=False)[2:].sum() <= RELATION_ANGLE_TOL:
        return None
    return (
        f"a translation that all locked legs allow would be {_join_words(reasons)}; "
        "these are constant, and there is none"
    )


def _derive_planar(pattern: ConstraintPattern, lines: Sequence[LockedLeg]) -> Condition:
    """det of the tips' normals s_i = (n × τ_i; B_i·τ_i) as lines of the plane: s1·(s2 × s3)."""
    dot, _, det = load_products()
    n = make_vector(_make_symbol(pattern.plane))
    tau = [make_vector(_make_symbol(leg.line)) for leg in lines]
    tips = [make_vector(leg.tip.symbol) for leg in lines]
    expression = sum(dot(tips[i], tau[i]) * det(n, tau[(i + 1) % 3], tau[(i + 2) % 3]) for i in range(3))
    at = ", ".join(leg.tip.symbol for leg in lines)
    kinds = _describe_kinds(lines, "normal to")
    words = f"the lines through {at}, {kinds}, meet in a point or are parallel"
    return _name_condition(pattern, words, expression, True)


def _derive_pivot(pattern: ConstraintPattern, line: LockedLeg, fixed: LockedLeg) -> Condition:
    """One tip is fixed: the platform rotates about it where the other tip's line is the path of that rotation."""
    dot, _, _ = load_products()
    one, other, along = fixed.tip.symbol, line.tip.symbol, _make_symbol(line.line)
    words = f"the line {one}{other} is normal to {along}"
    return _name_condition(pattern, words, dot(make_vector(other) - make_vector(one), make_vector(along)), True)


def _derive_line_complex(pattern: ConstraintPattern, legs: Sequence[LockedLeg]) -> Condition:
    """Six forces along lines through the tips: their Plücker coordinates are dependent."""
    import sympy

    lines = [f"({_make_symbol(leg.normal)}, {leg.tip.symbol} x {_make_symbol(leg.normal)})" for leg in legs]
    words = (
        f"the lines through {', '.join(leg.tip.symbol for leg in legs)} along "
        f"{', '.join(_make_symbol(leg.normal) for leg in legs)} belong to one linear complex"
    )
    expression = sympy.Determinant(sympy.MatrixSymbol("L", 6, 6))
    return _name_condition(pattern, words, expression, True, matrices={"L": "rows " + ", ".join(lines)})


def _derive_bodies(pattern: ConstraintPattern, lines: Sequence[LockedLeg]) -> Condition:
    _, _, det = load_products()
    slide = make_vector(_make_symbol(pattern.slide))
    expression = det(*(make_vector(_make_symbol(leg.line)) for leg in lines), slide)
    words = (
        f"{_describe_features(leg.line for leg in lines)} and the direction {slide}, "
        "in which the platform's halves move on each other, are parallel to one plane"
    )
    return _name_condition(pattern, words, expression, True)


def _derive_gram(pattern: ConstraintPattern) -> Condition:
    """det Σ J_iᵀ N_i J_i: more rows than dof, they must lose rank together."""
    import sympy

    size = 4 if pattern.motion == "bodies" else 6
    total = sympy.ZeroMatrix(size, size)
    matrices = []
    for leg in pattern.legs:
        label, moving = leg.tip.symbol[1:], leg.line or leg.normal
        if leg.turning is not None and pattern.motion in TURNING_MOTIONS:
            P, name = sympy.MatrixSymbol(f"P{label}", 6, 6), _make_symbol(leg.turning)
            total += P
            across = f"I - {name} {name}^T" if leg.about is not None else f"{name} {name}^T"
            matrices.append((P.name, f"diag(0, {across})"))
        if leg.is_tip_free:
            continue
        J, N = sympy.MatrixSymbol(f"J{label}", 3, size), sympy.MatrixSymbol(f"N{label}", 3, 3)
        total += J.T * N * J
        slides = "[I, e]" if leg.body in pattern.bodies[1:] else "[I, 0]"
        matrices.append((J.name, slides if pattern.motion == "bodies" else f"[I, -[{leg.tip.symbol}]x]"))
        name = "" if moving is None else _make_symbol(moving)
        across = "I" if leg.fixed else f"I - {name} {name}^T" if leg.line is not None else f"{name} {name}^T"
        matrices.append((N.name, across))
    if pattern.motion == "planar":
        total += sympy.MatrixSymbol("P", 6, 6)
        n = _make_symbol(pattern.plane)
        matrices.append(("P", f"diag({n} {n}^T, I - {n} {n}^T)"))
    moves = _describe_motion(pattern.legs)
    if pattern.motion == "bodies":
        halves = "the platform's halves can translate, one along e relative to the other"
        words = f"{halves}, and {moves.replace('moves', 'move', 1)}"
    else:
        words = f"some motion of the platform {moves}{_describe_cylinders(pattern.legs)}"
    return _name_condition(pattern, words, sympy.Determinant(total), False, matrices=dict(matrices))


def _name_condition(
    pattern: ConstraintPattern,
    words: str,
    expression: Any,
    signed: bool,
    *,
    never: bool = False,
    matrices: Mapping[str, str] | None = None,
    parts: tuple[tuple[Any, str], ...] = (),
) -> NamedCondition:
    """A condition with the meaning of its symbols and the factors that were split off."""
    import sympy

    expression = sympy.sympify(expression, strict=True)  # texts are no formulas
    used = {str(symbol) for each in (expression, *(part for part, _ in parts)) for symbol in each.free_symbols}
    used |= {leg.eye.symbol for leg in pattern.legs if leg.eye is not None}
    named = {f.symbol: f.meaning for f in pattern.features if f.symbol in used or matrices}
    return NamedCondition(
        words.replace("tau", "τ"),
        expression,
        signed,
        tuple(_list_length_factors(pattern.legs)),
        never,
        {**(matrices or {}), **dict(sorted(named.items()))},
        parts,
        pattern=pattern,
    )


def _derive_general(observation_model: ObservationModel) -> General:
    import sympy

    size = sympy.Symbol("d", integer=True, positive=True)
    M = sympy.MatrixSymbol("M", sum(observation_model.sizes), size)
    where = {
        "M": "rates of what is observed for a basis of the platform's motions: M = Y K (X K)^+",
        "K": "basis of the links' motions on which no wrench that a joint transmits does work",
        "X": "twist of the platform",
        "Y": "rates of what is observed",
    }
    words = "the legs, with their measured values fixed, transmit no wrench against some motion of the platform"
    return General(words, sympy.Determinant(M.T * M), where=where, observation_model=observation_model)


def describe_permanent_loss(pattern: ConstraintPattern, lost: str) -> str:
    """Return the words for a robot with dof unobserved everywhere; ``lost`` names them."""
    text = f"always: {lost}"
    lines = [leg for leg in pattern.legs if leg.line is not None]
    if pattern.motion == "spatial" and (names := _describe_common_line(pattern.legs)):
        return f"{text}, because {names} are on one line, about which the platform can rotate"
    if pattern.motion != "planar" and len(lines) == len(pattern.legs) > 0:
        vectors = [u for leg in lines if (u := pattern.constant(leg.line)) is not None]
        if len(vectors) == len(lines) > 1 and all(
            np.linalg.norm(np.cross(u, vectors[0])) < RELATION_ANGLE_TOL for u in vectors
        ):
            return f"{text}, because {_describe_features(leg.line for leg in lines)} are parallel"
    return text


def _describe_common_line(legs: Sequence[LockedLeg]) -> str:
    """Tips, if these (two at least) are on one line in one link, and nothing else is locked; else empty."""
    if len(legs) < 2 or len({leg.tip.link for leg in legs}) > 1 or any(leg.turning is not None for leg in legs):
        return ""
    arms = np.array([leg.tip.place - legs[0].tip.place for leg in legs[1:]])
    flat = np.linalg.svd(arms, compute_uv=False)
    return ", ".join(leg.tip.symbol for leg in legs) if flat[1:].sum() <= RELATION_ANGLE_TOL * flat[0] else ""


def _describe_features(features: Iterable[NamedVector | None]) -> str:
    """``the tangents tau1, tau2`` and the like, by what the vectors are."""
    groups: dict[str, list[str]] = {}
    for feature in features:
        symbol = _make_symbol(feature)
        groups.setdefault(_KINDS[symbol[0]], []).append(symbol)
    return " and ".join(f"the {kind} {', '.join(names)}" for kind, names in groups.items())


_KINDS = {
    "u": "observed directions",
    "p": "P axes",
    "t": "tangents",
    "a": "axes",
    "r": "directions",
    "n": "normals",
    "z": "z axes",
    "d": "axes",
    "e": "directions",
}


def _describe_motion(legs: Sequence[LockedLeg]) -> str:
    """Motion of all tips and of the platform in words: ``moves every tip Bi along ui (i = 1, 2, 3)`` if they are
    alike."""
    tips = [leg for leg in legs if not leg.is_tip_free]
    alike = {(leg.tip.symbol[0], _describe_allowed(leg).replace(leg.tip.symbol[1:], "i")) for leg in tips}
    parts = []
    if len(alike) > 1 or len(tips) == 1:
        still = [leg.tip.symbol for leg in tips if leg.fixed]
        moved = [f"{leg.tip.symbol} {_describe_allowed(leg)}" for leg in tips if not leg.fixed]
        parts = [
            *([f"leaves {_join_words(still)} fixed"] if still else []),
            *([f"moves {_join_words(moved)}"] if moved else []),
        ]
    elif alike:
        tip, allowed = next(iter(alike))
        parts = [f"moves every tip {tip}i {allowed} (i = {', '.join(leg.tip.symbol[1:] for leg in tips)})"]
    turns = [
        f"about {'' if leg.about is not None else 'a normal of '}{_make_symbol(leg.turning)}"
        for leg in legs
        if leg.turning is not None
    ]
    return " and ".join([*parts, *([f"rotates it {_join_words(turns)}"] if turns else [])])


def _describe_cylinders(legs: Sequence[LockedLeg]) -> str:
    """Return what also holds where more than three image points of one camera leave a dof unobserved."""
    rays = [leg for leg in legs if leg.eye is not None and leg.line is not None and leg.turning is None]
    eyes = {leg.eye.symbol for leg in rays if leg.eye is not None}
    if len(rays) < 4 or len(eyes) > 1:
        return ""
    return f"; {eyes.pop()} is then on the danger cylinders of all threes of points that are not on one line"


def _describe_allowed(leg: LockedLeg) -> str:
    if leg.fixed:
        return "fixed"
    return f"along {_make_symbol(leg.line)}" if leg.line is not None else f"normal to {_make_symbol(leg.normal)}"


def _join_words(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _describe_kinds(lines: Sequence[LockedLeg], relation: str) -> str:
    return f"{relation} {', '.join(_make_symbol(leg.line) for leg in lines)}"


def _list_length_factors(lines: Sequence[LockedLeg]) -> list[str]:
    """Factors that vanish only where a crank has no length: none for unit vectors that are fixed in a link."""
    return [
        f"|{leg.line.meaning.removeprefix('tangent ')}|"
        for leg in lines
        if leg.line is not None and not isinstance(leg.line, BodyVector) and not leg.virtual
    ]


def _make_symbol(feature: NamedVector | None) -> str:
    assert feature is not None
    return feature.symbol


def _convert_to_number(value: int) -> Any:
    import sympy

    return sympy.Integer(value)
