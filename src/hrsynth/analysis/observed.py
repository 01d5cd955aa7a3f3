"""Setup of an analysis: the robot in normal form, its legs, its observations, and samples of its motion."""

from __future__ import annotations

import os
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from ..budgets import CACHED_OBSERVED_ROBOTS_COUNT
from ..description import load
from ..description.observation_text import CAMERA, SENSOR, ObservationSpec, add_observations, parse_camera, parse_sensor
from ..errors import BadMechanism, BadRequest, HrsynthError, NoSegment, SamplingFailure
from ..geometry.ranks import compute_range_bases
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.pinocchio_model import PinocchioModel
from ..kinematics.platform_motion import PlatformMotion
from ..kinematics.sampling import Sample, Samples, sample
from ..kinematics.velocity_relation import ObservationModel, VelocityRelation, compute_relation
from ..mechanism import Mechanism, Observation
from ..mechanism.legs import LegDecomposition, decompose
from ..mechanism.noise import Noise
from ..mechanism.normal import NormalForm, reduce_to_normal_form
from ..mechanism.observation import ObservationRecord, list_labels
from ..mechanism.observations.direction import Direction
from ..mechanism.pose import RADIANS, AskedPose, Pose, PoseForm, PoseLike
from ..mechanism.sensors import (
    choose_default_segment,
    explain_default,
    list_default_segments,
    make_encoders,
    observe_segment,
)
from ..options import OBSERVATION, option
from ..progress import report
from ..records import As, Record, Recorded, Shown
from ..results import Value, freeze_content

if TYPE_CHECKING:
    from ..batch.configuration_builder import ConfigurationBuilder
    from ..batch.engine import Batch

GENERIC_SAMPLES_COUNT = 20
"""Number of samples of an equivalence check and of a generic verdict."""


UNLIMITED = "joints whose limits are ignored because they are parts of composite joints"
"""Description of ``limits_ignored`` in records."""
LegsLike = Annotated[
    str | int | Iterable[str | int] | None,
    option(
        "Legs to observe (1,4), links, or all (default: what the file observes, else all; none with --sensor).",
        "LEGS",
        group=OBSERVATION,
    ),
]
"""Legs by their labels, or links, as a user gives them: one, several, a text with commas, ``all``; None: all."""


@dataclass(frozen=True)
class Mobility(Record, all_recorded=True):
    """Mobility of a mechanism: total, and of internal motions, which move neither the platform nor any default
    segment."""

    total: int
    internal: int


class MobilityWritten(NamedTuple):
    """Mobility in normal form and as the file describes the mechanism."""

    total: int
    internal: int
    as_written: Annotated[Mobility | None, "null if the mechanism of the file could not be sampled"]


class ObservedAxis(ObservationRecord):
    """Observation, its axis in the frame of its link, and the reason for the choice."""

    reason: str


class OperationModeRecord(NamedTuple):
    """Motion of the platform in an operation mode."""

    dof: int
    motion: str
    mobility: int


class OtherMode(NamedTuple):
    """Another operation mode that was found, the observed rank there, and a pose in it."""

    dof: int
    motion: str
    mobility: int
    words: str
    pose: Pose


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
    form: PoseForm = RADIANS
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
        """Return the setup of the same robot with the same observations and samples."""
        if not isinstance(other, ObservedRobot):
            return NotImplemented
        return self is other or self._said() == other._said()

    def __hash__(self) -> int:
        return hash((self.robot, self.labels, *self.configurations[0].q.tolist()))

    def _said(self) -> tuple[Any, ...]:
        at = [each.q for each in (self.all_samples.start, *self.configurations)]
        return self.robot, self.form, freeze_content(self.observed), freeze_content(at)

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
                    f"{each.kind} {each.leg}",
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
        return replace(PlatformMotion.of(self.configurations, self.all_samples.observation_model), form=self.form)

    def telling(self, poses: Iterable[AskedPose]) -> ObservedRobot:
        """Return the setup, with all its computed values, that prints poses in the format of these."""
        form = PoseForm.of(poses)
        if form == self.form:
            return self
        other: ObservedRobot = object.__new__(ObservedRobot)
        other.__dict__.update(self.__dict__, form=form, motion=replace(self.motion, form=form))
        return other

    @cached_property
    def samples(self) -> Samples:
        """The samples, for the observed segments alone."""
        return restrict_samples(self.all_samples, self.observed)

    def beside(self) -> tuple[str, ...]:
        """Other operation modes that were found: motion of the platform, observed rank, and a pose."""
        drawn = self.all_samples
        labels = [o.leg for o in drawn.observation_model.observations]
        return tuple(
            f"{mode.beside(drawn.signature, labels)}, at {Pose.of(mode.at.pose(drawn.observation_model.platform))}"
            for mode in drawn.other_modes
        )

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
        places = [every.index(each) for each in self.telling_idle]
        return Mobility(first.mobility, first.mobility - select_relation(first, places).dimension)

    @property
    def telling_idle(self) -> tuple[Observation, ...]:
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
    def mobility_if_written(self) -> Mobility | None:
        """Mobility as the file describes the mechanism; None if no samples of it can be computed."""
        try:
            return self.mobility_as_written
        except HrsynthError:
            return None

    @property
    def mobilities(self) -> MobilityWritten:
        """Mobility in normal form and as written."""
        return MobilityWritten(self.mobility.total, self.mobility.internal, self.mobility_if_written)

    @property
    def limits_ignored(self) -> tuple[str, ...]:
        """Joints whose limits are ignored, since the normal form joins them into others."""
        return tuple(name for name in self.robot.joint_ranges if name not in self.mechanism.stops)

    def measuring(self, observations: tuple[Observation, ...]) -> Samples:
        """Return the samples with ρ for other observations (and without paths)."""
        drawn = self.all_samples
        observation_model = replace(drawn.observation_model, observations=observations)
        members = tuple(Sample(at, (), compute_relation(at, observation_model)) for at in self.configurations)
        return replace(drawn, observation_model=observation_model, members=members)

    camera_record = Shown(
        str, lambda self: self.mechanism.reference, As("camera"), "the link from which it is observed"
    )

    def observed_axes(self) -> tuple[tuple[Observation, str], ...]:
        """Observations, and the reasons for them."""
        return tuple((each, explain_default(self.decomposition, each)) for each in self.observed)

    @property
    def observed_record(self) -> list[ObservedAxis]:
        """Observations as in JSON."""
        return [{**each.to_dict(), "reason": why} for each, why in self.observed_axes()]

    @property
    def operation_mode(self) -> OperationModeRecord:
        """The samples' operation mode."""
        own = self.all_samples.signature
        return OperationModeRecord(own.dof, own.motion, own.mobility)

    @property
    def other_modes(self) -> list[OtherMode]:
        """Other operation modes that were found."""
        drawn = self.all_samples
        labels = [o.leg for o in drawn.observation_model.observations]
        return [
            OtherMode(
                mode.signature.dof,
                mode.signature.motion,
                mode.signature.mobility,
                mode.beside(drawn.signature, labels),
                Pose.of(mode.at.pose(drawn.observation_model.platform)),
            )
            for mode in drawn.other_modes
        ]


CameraLike = Annotated[
    str | Iterable[str] | None,
    option(
        "The link that carries the camera; or a further camera with a name and its pose on a link "
        "(metres; radians or deg; focal length, width and height in pixels); repeat for more.",
        "LINK|NAME=LINK@x,y,z/r,p,y/f,w,h",
        kind=list[str],
        group=OBSERVATION,
    ),
]
"""The link that carries the camera, or ``NAME=LINK@x,y,z/r,p,y``, or several of them."""
SensorLike = Annotated[
    str | Iterable[str] | None,
    option(
        "What else is observed: circle, depth, direction, distance, edge, edges, encoder, image_circle, "
        "image_line, inclination, line, point or position, with a point, an axis and a radius where the kind "
        "needs them (world: the base; for an encoder, its joint); repeat for more.",
        "[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius",
        kind=list[str],
        group=OBSERVATION,
    ),
]
"""``[CAMERA=]KIND:LINK@x,y,z/dx,dy,dz/radius``, or several of them."""
Seed = Annotated[int, option("Seed of the random configurations.", "NUMBER", low=0)]
BeginPose = Annotated[
    PoseLike | None,
    option(
        "Pose to start from instead of the zero configuration, perhaps in another operation mode; or mode:2.", "POSE"
    ),
]
StartPose = Annotated[
    PoseLike,
    option(
        "Start pose, such as x=0.02,y=0.1,z=-0.7; mode:2 is a mode with the directions at the goal.",
        "POSE",
    ),
]
NoiseLike = Annotated[
    str | Noise | None,
    option(
        "Largest errors of what else is observed, such as 0.3px (in images), 0.1deg or 1mm; separate several by "
        "commas.",
        "AMOUNT",
    ),
]
Jobs = Annotated[int | None, option("Processes (default: one per core).", low=1)]
"""Common options of analyses."""
POSES = (
    "or motors:0.1,0.2, or joints:NAME=0.3, or mode:2 as listed by modes; repeat for more "
    "(default: the zero configuration)."
)
POINTS = (
    "--camera eye=base@0.3,0.1,0 --sensor point:platform@0.1,0,0 --sensor point:platform@-0.1,0.1,0 "
    "--sensor point:platform@0,0.1,0.1"
)
"""Three image points by a camera beside the robot: an example."""
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


def normalise_names(given: LegsLike) -> tuple[str, ...] | None:
    """The legs or links that are given, ``("all",)`` for all legs, None where nothing is; raises ``BadRequest``."""
    if given is None:
        return None
    every: Any = given.split(",") if isinstance(given, str) else given if isinstance(given, Iterable) else [given]
    every = sorted(every, key=str) if isinstance(every, set | frozenset) else list(every)
    if not all(isinstance(each, str | Integral) and not isinstance(each, bool) for each in every):
        raise BadRequest(
            "--observe",
            given,
            "a label or a link such as 1 or 'rod_1a', several in a list or in a text with commas, or 'all'",
        )
    return tuple(str(each).strip() for each in every)


def list_requested_legs(
    robot: Mechanism | ObservedRobot, observe: LegsLike, sensor: SensorLike = None
) -> tuple[str, ...] | None:
    """Return :func:`normalise_names`, but None for all legs if only segments are observed: the same request in one
    form."""
    names = normalise_names(observe)
    other = sensor is not None or (isinstance(robot, Mechanism) and bool(robot.observations))
    return None if names == ("all",) and not other else names


def normalise_texts(given: str | Iterable[str] | None) -> tuple[str, ...]:
    """One text or several; raises ``BadRequest`` for what is none."""
    every = (
        ()
        if given is None
        else tuple(given)
        if isinstance(given, Iterable) and not isinstance(given, str)
        else (given,)
    )
    if not all(isinstance(each, str) for each in every):
        raise BadRequest("--camera, --sensor", given, f"texts such as {SENSOR}, or {CAMERA}")
    return every


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
    robot, asked, possible = _add_sensors(robot, cameras, sensor, candidate_sensor)
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
            _list_encoders(decomposition)
            if driven and not defaults
            else ()
            if blind and not defaults
            else _choose_observations(decomposition, normal, defaults, observe, given)
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


def _add_sensors(
    robot: Mechanism, cameras: tuple[str, ...], sensor: tuple[str, ...], candidate_sensor: tuple[str, ...]
) -> tuple[Mechanism, set[str], set[str]]:
    """Add the requested and candidate cameras and observations to a robot; also return their labels."""
    named = [parse_camera(text) for text in cameras if "=" in text]
    links = [text for text in cameras if "=" not in text]
    if len(links) > 1:
        raise BadRequest(
            f"--camera {', '.join(links)}: several links carry the camera",
            remedy="Name one; give others as NAME=LINK@x,y,z.",
        )
    for link in links:
        if link not in robot.links:
            raise BadRequest(f"--camera: link of {robot.name}", link, sorted(robot.links))
        robot = replace(robot, camera=link)
    eyes = [each.name for each in named or robot.cameras]
    every = [("--sensor", text) for text in sensor] + [("--candidate-sensor", text) for text in candidate_sensor]
    specs = [_parse_spec(flag, text, eyes) for flag, text in every]
    used = {each.camera for each in specs} & set(eyes)
    for camera in named:
        if camera.name not in used and (used or not specs):  # an inclination or an encoder alone needs none
            raise BadRequest(
                f"--camera {camera.name}: no observation uses this camera of {robot.name}",
                remedy=f"Add --sensor {camera.name}=KIND:LINK…, or use --camera LINK for a camera that observes legs.",
            )
    robot = add_observations(robot, (), named)
    labels: list[set[str]] = [{o.leg for o in robot.observations}]
    for (flag, text), spec in zip(every, specs, strict=True):
        try:
            robot = add_observations(robot, [spec])
        except BadRequest as error:
            raise BadRequest(
                f"{flag} {text}: {error.problem}", error.got, error.expected, remedy=error.remedy
            ) from None
        labels.append({o.leg for o in robot.observations}.difference(*labels))
    return robot, set().union(*labels[1 : len(sensor) + 1]), set().union(*labels[len(sensor) + 1 :])


def _parse_spec(option: str, text: str, eyes: Sequence[str]) -> ObservationSpec:
    try:
        return parse_sensor(text, eyes)
    except BadRequest as error:
        raise BadRequest(
            error.problem.replace("--sensor", option, 1), error.got, error.expected, remedy=error.remedy
        ) from None


def _choose_observations(
    decomposition: LegDecomposition,
    normal: NormalForm,
    defaults: dict[str, Observation],
    observe: Sequence[str] | None,
    given_too: Sequence[Observation],
) -> tuple[Observation, ...]:
    if observe is not None and not observe:
        raise BadRequest("--observe: nothing is observed", remedy="Give leg labels, links, or all.")
    if observe is None or list(observe) == ["all"]:
        for leg in decomposition.legs:
            if leg.label not in defaults:
                try:
                    choose_default_segment(decomposition, leg)
                except NoSegment:
                    if not defaults:
                        raise
        observe = tuple(defaults)
    chosen: dict[tuple[str, ...], Observation] = {}
    for name in observe:
        others = [o for o in given_too if o.leg == name]
        chosen |= {o.key: o for o in others}
        if others and name not in decomposition.labels:
            continue
        if name in decomposition.labels:
            observation = defaults.get(name) or choose_default_segment(decomposition, decomposition.leg(name))
            chosen |= {
                o.key: o for o in decomposition.mechanism.observations if o.is_segment_direction and o.leg == name
            }
        elif name in normal.into:
            link = normal.into[name]
            if link not in decomposition.mechanism.links:
                raise BadRequest(
                    f"--observe {name}: the link is part of a joint and has no direction", remedy="Name another link."
                )
            given = next(
                (o for o in decomposition.mechanism.observations if o.link == link and o.is_segment_direction), None
            )
            observation = given or observe_segment(decomposition, link)
        else:
            raise BadRequest(
                f"--observe: unknown leg or link of {decomposition.mechanism.name}",
                name,
                "legs "
                + ", ".join([*decomposition.labels, *list_labels(given_too)])
                + "; links "
                + ", ".join(n for leg in decomposition.legs for n in leg.links),
            )
        chosen[observation.key] = observation
    return tuple(chosen.values())


def build_motor_model(setup: ObservedRobot) -> ObservationModel:
    """Return the observation model of the robot's motors: their coordinates, as encoders measure them."""
    return replace(setup.all_samples.observation_model, observations=_list_encoders(setup.decomposition))


def _list_encoders(decomposition: LegDecomposition) -> tuple[Observation, ...]:
    mechanism = decomposition.mechanism
    of = {name: leg.label for leg in decomposition.legs for name in leg.joints}
    mechanism.require_motors()
    driven = [joint for joint in mechanism.joints.values() if joint.is_actuated]
    return tuple(each for joint in driven for each in make_encoders(mechanism, joint, of.get(joint.name, "")))


def restrict_samples(samples: Samples, observations: Iterable[Observation], *, ways: bool = True) -> Samples:
    """Return the samples for fewer observations (all of them among the samples' own), with or without their
    ``ways``."""
    wanted = tuple(observations)
    all_of = samples.observation_model.observations
    keys = [o.key for o in all_of]
    places = [keys.index(o.key) for o in wanted]
    observation_model = replace(samples.observation_model, observations=tuple(all_of[i] for i in places))
    found = _select_relations([member.relation for member in samples.members], places)
    members = tuple(
        Sample(
            m.configuration,
            tuple(replace(t, measured=tuple(t.measured[i] for i in places)) for t in m.way) if ways else (),
            each,
        )
        for m, each in zip(samples.members, found, strict=True)
    )
    return replace(samples, observation_model=observation_model, members=members)


def select_relation(relation: VelocityRelation, places: Sequence[int]) -> VelocityRelation:
    """ρ for some of the observations: the projection of ρ for all."""
    return _select_relations([relation], places)[0]


def _select_relations(relations: Sequence[VelocityRelation], places: Sequence[int]) -> list[VelocityRelation]:
    rows = [np.vstack([each.twist_part, *(each.basis[each.rows_of(place)] for place in places)]) for each in relations]
    return [
        VelocityRelation(
            basis, each.twist_rows, tuple(each.sizes[i] for i in places), each.mobility, min(each.gap, rank.gap)
        )
        for each, (basis, rank) in zip(relations, compute_range_bases(rows, 1.0), strict=True)
    ]
