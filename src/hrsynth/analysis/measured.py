"""Measured values of a robot (observed legs or motors), their rank, and the condition under which a platform dof is
unobserved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

from ..constraints.condition import Condition, derive_condition
from ..constraints.excluded_poses import describe_excluded_poses
from ..constraints.pattern import ConstraintPattern, describe_platform_motion, recognise
from ..geometry.vectors import Array
from ..kinematics.sampling import Samples
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism.observation import list_labels
from ..mechanism.pose import PoseForm
from ..results import Value
from ..tolerances import CACHED_OBSERVED_ROBOTS_COUNT
from .observation_choice import list_encoders
from .observed import ObservedRobot
from .verdict import Verdict, compute_verdict


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredRobot(Value):
    """Robot with samples of its measured values; verdict, pattern and condition are computed on demand."""

    setup: ObservedRobot
    samples: Samples

    @classmethod
    def of(cls, setup: ObservedRobot, real: bool = False) -> MeasuredRobot:
        """Return the hidden robot, whose measured values are the observations, or the ``real`` robot, whose are the
        motors' coordinates; raises ``BadRequest`` for a real robot without motors."""
        return _measure(setup, real, setup.form)

    @property
    def observation_model(self) -> ObservationModel:
        """Observation model that is evaluated at each configuration."""
        return self.samples.observation_model

    @property
    def rank(self) -> int:
        """Largest observed rank of the platform over the samples, whatever the gap."""
        return max(member.relation.rank for member in self.samples.members)

    @cached_property
    def verdict(self) -> Verdict:
        """Generic verdict; raises ``UndecidedRank``."""
        return compute_verdict(self.setup, list_labels(self.observation_model.observations), self.samples)

    @cached_property
    def pattern(self) -> ConstraintPattern:
        """Pattern of the locked legs, the same at all poses."""
        return recognise(self.setup.decomposition, self.observation_model, self.setup.configurations)

    @cached_property
    def generic_pattern(self) -> ConstraintPattern:
        """Pattern at generic poses: at special ones a locked leg may allow its end more."""
        if self.pattern.motion != "other":
            return self.pattern
        return recognise(self.setup.decomposition, self.observation_model, self.setup.configurations, everywhere=False)

    @cached_property
    def moving(self) -> tuple[str, Array | None]:
        """Motion of the platform, one link, with nothing locked, and the normal if that is in a plane."""
        return describe_platform_motion(self.setup.decomposition, self.observation_model, self.setup.configurations)

    @cached_property
    def condition(self) -> Condition:
        """Condition under which a generically observed dof is unobserved."""
        return derive_condition(self.pattern, self.observation_model)

    @cached_property
    def unexamined(self) -> tuple[str, ...]:
        """Poses to which the condition does not apply, in words."""
        return describe_excluded_poses(
            self.setup.decomposition, self.pattern, self.condition, self.setup.configurations
        )


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def _measure(setup: ObservedRobot, real: bool, form: PoseForm) -> MeasuredRobot:
    """Return one value for equal setups that print poses in one ``form``."""
    if real:
        return MeasuredRobot(setup, setup.all_samples.measure(list_encoders(setup.decomposition)))
    return MeasuredRobot(setup, setup.samples)
