"""Closed forms of legs and vectors, read from the mechanism and its configurations, never from names.

A pose determines whether each leg reaches it in its working mode, whether joints are within their limits, and the
vectors that the condition names. Lengths in characteristic lengths, base axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...closed_forms.legs import ClosedFormLeg
from ...constraints.named_vectors import BodyPoint, NamedVector, collect_poses
from ...geometry.balls import Field
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...mechanism.legs import LegDecomposition
from ...tolerances import RELATION_ANGLE_TOL
from .joint_limits import JointLimit, list_joint_limits
from .path_segments import PathCoordinates
from .sampled_mechanism import SampledMechanism
from .vector_expressions import JointRules, NoLegForm, VectorExpression, evaluate_expression


@dataclass(frozen=True, eq=False)
class LegStates:
    """Reach margins (n, subchains + bounds) and the condition's vectors by symbol, (n, 3), at poses; points relative to
    the first leg's tip."""

    reach_margins: Field
    values: Mapping[str, Field]


@dataclass(frozen=True, eq=False)
class LegForms:
    """Closed forms of all legs in their working modes, and how the condition's vectors follow from them."""

    subchains: tuple[ClosedFormLeg, ...]
    vectors: Mapping[str, VectorExpression]
    points: tuple[str, ...] = ()
    """Symbols of points; the first is their origin."""
    bounds: tuple[JointLimit, ...] = ()
    """Limits of joints; each has a margin too."""

    @property
    def modes(self) -> tuple[float, ...]:
        """Working mode of each subchain, ±1."""
        return tuple(limb.mode for limb in self.subchains)

    def flipped(self, limb: int) -> LegForms:
        """Return the forms with one subchain in its other working mode."""
        other = replace(self.subchains[limb], mode=-self.subchains[limb].mode)
        return replace(self, subchains=(*self.subchains[:limb], other, *self.subchains[limb + 1 :]))

    def beyond(self, p: Array, R: Array) -> tuple[str, ...]:
        """Return the joints that are not within their limits at one pose (3,), (3, 3)."""
        within = self.at(p[None], R[None]).reach_margins[0, len(self.subchains) :][: len(self.bounds)] > 0
        return tuple(bound.joint for bound, held in zip(self.bounds, within, strict=True) if not held)

    def at(self, p: Field, R: Field, leading: tuple[int, Field] | None = None) -> LegStates:
        """Evaluate poses (n, 3), (n, 3, 3), as numbers or balls; for a subchain that leads, the vector that it carries
        is given."""
        with np.errstate(invalid="ignore"):
            solved = [
                (0 * p[:, 0] + 1.0, leading[1])
                if leading is not None and leading[0] == number
                else limb.solve(limb.tip.value(p, R), limb.mode)
                for number, limb in enumerate(self.subchains)
            ]
            carried = [vector for _, vector in solved]
            values = {symbol: evaluate_expression(each, p, R, carried) for symbol, each in self.vectors.items()}
            within = [
                bound.reach_margin(lambda each: evaluate_expression(each, p, R, carried)) for bound in self.bounds
            ]
        values.update({symbol: values[symbol] - values[self.points[0]] for symbol in self.points[::-1]})
        free = [0 * p[:, 0] + 1.0] * (not solved and not within)
        return LegStates(np.stack([*(margin for margin, _ in solved), *within, *free], axis=1), values)


@dataclass(frozen=True, eq=False)
class LegPattern:
    """Closed forms without a working mode, the vector that each carries, and how the required vectors follow."""

    coordinates: PathCoordinates
    subchains: tuple[ClosedFormLeg, ...]
    carried: tuple[NamedVector, ...]
    vectors: Mapping[str, VectorExpression]
    points: tuple[str, ...]
    bounds: tuple[JointLimit, ...] = ()
    """Limits of joints that are kept."""
    loose: tuple[str, ...] = ()
    """Labels of legs with inner loops that the forms do not prove to close."""

    @property
    def fitted(self) -> tuple[str, ...]:
        """Parts that were fitted to samples and not read from the joints: legs, vectors by their symbols, and legs
        whose inner loops close at samples only."""
        legs = dict.fromkeys(f"leg {limb.label}" for limb in self.subchains if limb.fitted)
        loops = (f"the loops inside leg {label}" for label in self.loose)
        return (*legs, *(symbol for symbol, source in self.vectors.items() if source.fitted), *loops)

    def forms(self, at: ClosedConfiguration) -> LegForms:
        """Return the forms in a configuration's working mode; raises ``NoLegForm`` where a leg does not follow its
        form."""
        p, R = self.coordinates.of([at])
        limbs = []
        for limb, feature in zip(self.subchains, self.carried, strict=True):
            tip = limb.tip.value(p, R)
            actual = feature.value(collect_poses([at], feature.links))
            mode = limb.modes(tip, actual)
            if not np.linalg.norm(limb.solve(tip, mode)[1] - actual) < RELATION_ANGLE_TOL:
                raise NoLegForm(f"leg {limb.label} does not follow its form")
            limbs.append(replace(limb, mode=float(mode[0])))
        return LegForms(tuple(limbs), self.vectors, self.points, self.bounds)


def build_leg_pattern(
    decomposition: LegDecomposition,
    features: Sequence[NamedVector],
    coordinates: PathCoordinates,
    configurations: Sequence[ClosedConfiguration],
) -> LegPattern:
    """Return the forms of all legs and of the required features; raises ``NoLegForm`` if one of them has no known
    form."""
    rules = JointRules.of(decomposition, coordinates, configurations)
    sight = SampledMechanism(decomposition.mechanism, coordinates, configurations, rules)
    found: list[tuple[ClosedFormLeg, NamedVector]] = []
    for leg in decomposition.legs:
        if len(leg.joints) == 1 and decomposition.mechanism.joints[leg.joints[0]].type.freedoms == 6:
            continue
        of_leg = list(sight.subchains(leg))
        if not of_leg:
            raise NoLegForm(f"leg {leg.label} has no known closed form (rod on a crank or rail, or sliding rod)")
        found += of_leg
    limbs, carried = (tuple(part) for part in zip(*found, strict=True)) if found else ((), ())
    loose = tuple(leg.label for leg in decomposition.legs if not sight.has_closed_inner_loops(leg, carried))
    vectors = {f.symbol: sight.source(f, carried) for f in features}
    points = tuple(f.symbol for f in features if isinstance(f, BodyPoint))
    kept = tuple(list_joint_limits(sight, lambda feature: sight.source(feature, carried)))
    return LegPattern(coordinates, limbs, carried, vectors, points, kept, loose)
