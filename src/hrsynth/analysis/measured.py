"""What is measured of a robot, what it sees of the platform, and where it loses a freedom: watched legs or motors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

from ..budgets import REMEMBERED
from ..constraints.condition import Condition, condition
from ..constraints.excluded_poses import unexamined_poses
from ..constraints.pattern import ConstraintPattern, moving, recognise
from ..geometry.vectors import Array
from ..kinematics.sampling import Samples
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism.observation import labels_of
from ..results import Value
from .observed import ObservedRobot, motors
from .verdict import Verdict, verdict_of


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredRobot(Value):
    """A robot with samples for what is measured; verdict, pattern and condition are found when they are asked for."""

    setup: ObservedRobot
    samples: Samples

    @classmethod
    @lru_cache(maxsize=REMEMBERED)
    def of_directions(cls, setup: ObservedRobot) -> MeasuredRobot:
        """The observed directions: the hidden robot."""
        return cls(setup, setup.samples)

    @classmethod
    @lru_cache(maxsize=REMEMBERED)
    def of_motors(cls, setup: ObservedRobot) -> MeasuredRobot:
        """The motors' coordinates: the real robot. Raises ``BadRequest`` where it has no motor."""
        return cls(setup, setup.measuring(motors(setup).observations))

    @classmethod
    def of(cls, setup: ObservedRobot, real: bool) -> MeasuredRobot:
        """The ``real`` robot or the hidden one."""
        return cls.of_motors(setup) if real else cls.of_directions(setup)

    @property
    def observation_model(self) -> ObservationModel:
        """What is asked at each configuration."""
        return self.samples.observation_model

    @property
    def rank(self) -> int:
        """Freedoms of the platform that are seen at the best sample, whatever the gap."""
        return max(member.relation.rank for member in self.samples.members)

    @cached_property
    def verdict(self) -> Verdict:
        """What is seen generically; raises ``RankUndecided``."""
        return verdict_of(self.setup, labels_of(self.observation_model.observations), self.samples)

    @cached_property
    def pattern(self) -> ConstraintPattern:
        """The pattern of the legs with their measurements held, the same at all poses."""
        return recognise(self.setup.decomposition, self.observation_model, self.setup.configurations)

    @cached_property
    def generic_pattern(self) -> ConstraintPattern:
        """The same at generic poses: at special ones a held leg may leave its end more."""
        if self.pattern.motion != "other":
            return self.pattern
        return recognise(self.setup.decomposition, self.observation_model, self.setup.configurations, everywhere=False)

    @cached_property
    def moving(self) -> tuple[str, Array | None]:
        """How the platform, one body, moves with nothing held, and the normal where that is in a plane."""
        return moving(self.setup.decomposition, self.observation_model, self.setup.configurations)

    @cached_property
    def condition(self) -> Condition:
        """When a freedom is lost that is seen generically."""
        return condition(self.pattern, self.observation_model)

    @cached_property
    def unexamined(self) -> tuple[str, ...]:
        """Poses to which the condition does not apply, in words."""
        return unexamined_poses(self.setup.decomposition, self.pattern, self.condition, self.setup.configurations)
