"""Setup of an analysis: the robot in normal form, its legs, its observations, and samples of its motion."""

from __future__ import annotations

import os
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..description import load
from ..errors import BadMechanism, BadRequest, SamplingFailure
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.pinocchio_model import PinocchioModel
from ..kinematics.platform_motion import PlatformMotion
from ..kinematics.sampling import Samples, sample
from ..kinematics.velocity_relation import ObservationModel
from ..mechanism import Mechanism, Observation
from ..mechanism.legs import LegDecomposition, decompose
from ..mechanism.normal import NormalForm, reduce_to_normal_form
from ..mechanism.observation import list_labels
from ..mechanism.observations.direction import Direction
from ..mechanism.pose import RADIANS, AskedPose, PoseForm
from ..mechanism.sensors import (
    list_default_segments,
)
from ..progress import report
from ..records import As, Record, Recorded, Shown
from ..results import Value, freeze_content
from ..tolerances import CACHED_OBSERVED_ROBOTS_COUNT
from .observation_choice import add_sensors, choose_observations, list_encoders
from .observation_inputs import CameraLike, LegsLike, SensorLike, list_requested_legs, normalise_texts

if TYPE_CHECKING:
    from ..batch.configuration_builder import ConfigurationBuilder
    from ..batch.engine import Batch

GENERIC_SAMPLES_COUNT = 20
"""Number of samples of an equivalence check and of a generic verdict."""


@dataclass(frozen=True)
class Mobility(Record, all_recorded=True):
    """Mobility of a mechanism: total, and of internal motions, which move neither the platform nor any default
    segment."""

    total: int
    internal: int


@dataclass(frozen=True, eq=False, repr=False)
class ObservedRobot(Value):
    """Robot with observations; made by :func:`hrsynth.observe`, accepted by every analysis.

    Parameters
    ----------
    robot
        Mechanism as read.
    normal
        Its normal form.
    decomposition
        Its legs and platform.
    observed
        Observations.
    all_samples
        Samples with all default segments, the observations, and the segments that the file names.
    defaults
        Number of default segments among the observations of ``all_samples``; they come first.
    form
        Format of printed poses.
    offered
        Candidate observations, also among those of ``all_samples``.
    """

    robot: Mechanism
    normal: NormalForm
    decomposition: LegDecomposition
    observed: Recorded[tuple[Observation, ...]]
    all_samples: Samples
    """Samples with all default segments, the observations, and the segments that the file names."""
    defaults: int
    """Number of default segments among the observations of ``all_samples``; they come first."""
    form: PoseForm = field(default=RADIANS, compare=False)
    """Format of printed poses."""
    offered: tuple[Observation, ...] = ()
    """Candidate observations; among the observations of ``all_samples`` too."""

    @classmethod
    def of(
        cls,
        robot: RobotLike,
        observe: LegsLike = None,
        camera: CameraLike = None,
        *,
        sensor: SensorLike = None,
        candidate_sensor: SensorLike = None,
        samples: int = GENERIC_SAMPLES_COUNT,
        seed: int = 0,
        driven: bool = False,
        blind: bool = False,
    ) -> ObservedRobot:
        """Return the setup of an analysis: an observed robot itself, or a robot with observations as for
        :func:`.pose_requests.observe`, and ``candidate_sensor`` in the form of ``sensor``. Analyses of ``driven``
        motors need no segments: without any, the motor coordinates are observed; with ``blind``, and neither of them,
        nothing is."""
        robot = read_robot(robot)
        names = list_requested_legs(robot, observe, sensor)
        if isinstance(robot, ObservedRobot):
            if (observe, camera, sensor, candidate_sensor) != (None,) * 4:
                raise BadRequest(
                    f"{robot.headline()}: the observations are given twice",
                    observe or camera or sensor or candidate_sensor,
                    remedy="Omit them: an observed robot already has its own.",
                )
            return robot
        robot.require_platform()
        report("sampling")
        try:
            return _build_observed_robot(
                robot,
                (robot.file, robot.notes),
                names,
                normalise_texts(camera),
                normalise_texts(sensor),
                normalise_texts(candidate_sensor),
                samples,
                seed,
                driven or (blind and any(joint.is_actuated for joint in robot.joints.values())),
                blind,
            )
        except (BadMechanism, SamplingFailure) as error:
            error.file = robot.file
            raise

    def __eq__(self, other: object) -> bool:
        """Return True for a setup of the same robot with the same observations and samples."""
        if not isinstance(other, ObservedRobot):
            return NotImplemented
        return self is other or self._content() == other._content()

    def __hash__(self) -> int:
        return hash((self.robot, self.labels, *self.configurations[0].q.tolist()))

    def _content(self) -> tuple[Any, ...]:
        at = [each.q for each in (self.all_samples.start, *self.configurations)]
        return self.robot, freeze_content(self.observed), freeze_content(at)

    def headline(self) -> str:
        """The robot and the observed legs."""
        return f"{self.robot.name}, observing {', '.join(self.labels)}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.headline()}>"

    def by_segments(self, what: str) -> ObservedRobot:
        """Return the setup; raises ``BadRequest`` if something other than directions of segments in the reference link
        is observed, which is all that ``what`` supports."""
        for each in self.observed:
            if not each.is_segment_direction:
                raise BadRequest(
                    f"{self.robot.name}: {what} supports directions of segments only",
                    each.text,
                    remedy="Observe legs by the directions of their segments.",
                )
        return self

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in normal form."""
        return self.decomposition.mechanism

    @property
    def labels(self) -> tuple[str, ...]:
        """The observed legs."""
        return list_labels(self.observed)

    @property
    def segments(self) -> tuple[Observation, ...]:
        """The default segments of all legs."""
        return self.all_samples.observation_model.observations[: self.defaults]

    @property
    def all_legs(self) -> tuple[Observation, ...]:
        """Segments of all legs: the default ones, and others that the file names."""
        named = (
            o for o in self.mechanism.observations if o.is_segment_direction and o.leg in self.decomposition.labels
        )
        return tuple({o.key: o for o in (*self.segments, *named)}.values())

    @property
    def configurations(self) -> tuple[ClosedConfiguration, ...]:
        """The configurations of the samples, without the zero configuration."""
        return tuple(member.configuration for member in self.all_samples.members)

    @cached_property
    def motion(self) -> PlatformMotion:
        """Generic motion of the platform."""
        return replace(self.all_samples.motion, form=self.form)

    def printing_like(self, poses: Iterable[AskedPose]) -> ObservedRobot:
        """Return an equal setup that prints poses in the format of these."""
        form = PoseForm.of(poses)
        return self if form == self.form else replace(self, form=form)

    @cached_property
    def samples(self) -> Samples:
        """The samples, for the observations alone."""
        return self.all_samples.restrict(self.observed)

    @property
    def dof(self) -> int:
        """The robot's dof: the dimension of its platform's twists."""
        return self.all_samples.members[0].relation.dof.decided("the robot's dof")

    @cached_property
    def batch(self) -> Batch | None:
        """The robot compiled for many poses, with the default segment of each leg; None where it cannot be."""
        from ..batch.engine import Batch

        return Batch.of(self.decomposition, self.segments, self.motion, (self.all_samples.start, *self.configurations))

    @cached_property
    def placer(self) -> ConfigurationBuilder | None:
        """Builder of closed configurations for many platform poses; None unless every leg is a known subproblem."""
        from ..batch.configuration_builder import ConfigurationBuilder

        defaults = [o for o in self.segments if isinstance(o, Direction)]
        return (
            None
            if self.batch is None
            else ConfigurationBuilder.of(self.batch, self.all_samples.model, self.decomposition, defaults)
        )

    @cached_property
    def mobility(self) -> Mobility:
        """Mobility of the normal form, with its internal motions."""
        first, every = self.all_samples.members[0].relation, self.all_samples.observation_model.observations
        places = [every.index(each) for each in self.internal_motion_invariants]
        return Mobility(first.mobility, first.mobility - first.select(places).dimension)

    @property
    def internal_motion_invariants(self) -> tuple[Observation, ...]:
        """Values that an internal motion does not change: the default segments of all legs, and other observations that
        are no segments."""
        more = self.all_samples.observation_model.observations[self.defaults :]
        return *self.segments, *(each for each in more if not each.is_segment_direction)

    @cached_property
    def mobility_as_written(self) -> Mobility:
        """Mobility of the file's own links and joints."""
        if (len(self.robot.links), len(self.robot.joints)) == (len(self.mechanism.links), len(self.mechanism.joints)):
            return self.mobility
        observation_model = replace(
            self.all_samples.observation_model,
            observations=tuple(o for o in self.segments if o.link in self.robot.links),
        )
        written = sample(PinocchioModel(self.robot, self.mechanism.length), observation_model, 3, seed=1)
        total = written.mobility
        return Mobility(total, total - (self.mobility.total - self.mobility.internal))

    @property
    def limits_ignored(self) -> tuple[str, ...]:
        """Joints whose limits are ignored, since the normal form joins them into others."""
        return tuple(name for name in self.robot.joint_ranges if name not in self.mechanism.stops)

    camera_record = Shown(
        str, lambda self: self.mechanism.reference, As("camera"), "the link from which it is observed"
    )


RobotLike = Mechanism | ObservedRobot | str | Path
"""A robot as a user gives it: as it was read or observed, the path of its file, the name of a shipped one."""


def read_robot(given: RobotLike) -> Mechanism | ObservedRobot:
    """The robot that is given; raises ``BadRequest``, and what ``load`` raises."""
    if isinstance(given, Mechanism | ObservedRobot):
        return given
    if isinstance(given, str | os.PathLike):
        return load(given)
    raise BadRequest(
        "robot",
        given,
        "a result of hrsynth.load or hrsynth.observe, the path of a robot file, the name "
        "of a shipped robot, example:NAME",
    )


def clear_robots() -> None:
    """Clear the cached samples."""
    _build_observed_robot.cache_clear()


@lru_cache(maxsize=CACHED_OBSERVED_ROBOTS_COUNT)
def _build_observed_robot(
    robot: Mechanism,
    source: Hashable,
    observe: tuple[str, ...] | None,
    cameras: tuple[str, ...],
    sensor: tuple[str, ...],
    candidate_sensor: tuple[str, ...],
    samples: int,
    seed: int,
    driven: bool,
    blind: bool,
) -> ObservedRobot:
    """Return the same value for equal arguments and an equal robot from one ``source``: samples are computed once."""
    robot, asked, possible = add_sensors(robot, cameras, sensor, candidate_sensor)
    normal = reduce_to_normal_form(robot)
    decomposition = decompose(normal.mechanism)
    defaults = list_default_segments(decomposition)
    own = tuple(o for o in decomposition.mechanism.observations if o.leg not in asked | possible)
    given = tuple(o for o in own if not o.is_segment_direction)
    chosen = (
        ()
        if observe is None and asked
        else own
        if observe is None and own
        else (
            list_encoders(decomposition)
            if driven and not defaults
            else ()
            if blind and not defaults
            else choose_observations(decomposition, normal, defaults, observe, given)
        )
    )
    observed = (*chosen, *(o for o in decomposition.mechanism.observations if o.leg in asked))
    offered = tuple(o for o in decomposition.mechanism.observations if o.leg in possible)
    known = {o.key for o in defaults.values()}
    named = tuple(
        o for o in own if o.is_segment_direction
    )  # of legs that are not requested too: another set may contain them
    extra = tuple({o.key: o for o in (*observed, *offered, *named) if o.key not in known}.values())
    first, *others = normal.mechanism.bodies
    observation_model = ObservationModel(
        first,
        None if others else decomposition.point,
        normal.mechanism.reference,
        (*defaults.values(), *extra),
        others=tuple(others),
    )
    drawn = sample(PinocchioModel(normal.mechanism), observation_model, samples, seed, led_by=observed)
    return ObservedRobot(robot, normal, decomposition, observed, drawn, len(defaults), offered=offered)


def build_motor_model(setup: ObservedRobot) -> ObservationModel:
    """Return the observation model of the robot's motors: their coordinates, as encoders measure them."""
    return replace(setup.all_samples.observation_model, observations=list_encoders(setup.decomposition))
