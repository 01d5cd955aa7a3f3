"""Entry of an architecture: its hidden robot and verdict, exact and confirmed at samples."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, groupby
from typing import Any

from ..analysis.advice import Advice, advise
from ..analysis.derive import derive
from ..analysis.exact import ExactArchitecture, get_architecture
from ..analysis.measured import MeasuredRobot
from ..analysis.modes.modes import modes
from ..analysis.modes.tip_modes import bound_modes
from ..analysis.modes.tip_modes import count_modes as counted_modes
from ..analysis.observed import ObservedRobot
from ..analysis.pose_requests import observe
from ..analysis.verdict import CONTROLLABLE, Verdict, compute_verdict
from ..errors import (
    BadRequest,
    ConfirmationFailure,
    ExternalSolverFailure,
    HrsynthError,
    MissingExtra,
    UnsupportedLocus,
)
from ..geometry.ranks import compute_range_basis
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.sampling import Samples
from ..kinematics.velocity_relation import VelocityRelation, compute_relation
from ..mechanism import Observation
from ..mechanism.legs import decompose
from ..mechanism.model import Mechanism
from ..mechanism.normal import reduce_to_normal_form
from ..mechanism.sensors import make_encoders
from ..rewrite.strategy import Step
from ..solving.platform.solve import SystemModes
from .architecture_key import ArchitectureKey, count_equal, parse
from .geometry import build_mechanism
from .groups import group

PROVED_ENTRY_ERROR_CHANCE_MAX = 1e-9
"""Largest probability of error of a proved catalog entry."""

VERDICT_SAMPLES_COUNT = 10
"""Closed configurations at which an exact verdict is confirmed."""
DIMENSION_CHOICES_MAX = 3
"""Choices of dimensions, of which the first that can be studied is taken."""
MODE_LIST_SAMPLES_COUNT = 5
"""Configurations at which assembly modes are listed."""
SEARCHED_MODE_SAMPLES_COUNT = 2
"""Configurations at which modes are listed that no resultant gives."""
MULTI_SAMPLE_MODES_MAX = 8
"""Modes, complex ones too, above which those are listed at one configuration."""
OTHER_SMALLEST_SETS_COUNT = 3
"""Smallest sets, besides the first, of which modes are looked for."""


def build_entry(text: str) -> dict[str, Any]:
    """Compute the entry of a key: its verdict, exact and confirmed at samples, or the reason of refusal.

    It depends on the key alone. Raises ``BadRequest`` for a text that is not a key.
    """
    word = parse(text)
    record: dict[str, Any] = {"key": str(word), "group": group(word), "sensors": count_equal(word.seen) or None}
    found = _choose_studied_dimensions(str(choose_study_model(word)))
    if isinstance(found, str):
        return {**record, "refused": found}
    drawn = build_mechanism(word, found.attempt)
    return {**record, **found.record(drawn, [joint.name for joint in drawn.joints.values() if joint.is_actuated])}


def choose_study_model(word: ArchitectureKey) -> ArchitectureKey:
    """The architecture that is studied for all that differ from it by their motors alone.

    It has a motor on the first R or P of each leg; but it is the word itself where that makes other links, since
    passive joints become one: three R that meet in a point an S.
    """
    driven = word.driven
    return driven if word == driven or _list_links(str(word)) == _list_links(str(driven)) else word


@lru_cache(maxsize=128)
def _list_links(text: str) -> frozenset[str]:
    """The links of a word's normal form; none where its mechanism cannot be made."""
    try:
        return frozenset(reduce_to_normal_form(build_mechanism(parse(text), 0)).mechanism.links)
    except HrsynthError:
        return frozenset()


@dataclass(frozen=True, eq=False)
class ArchitectureStudy:
    """Facts that do not depend on the motors, for all architectures of one model."""

    facts: dict[str, Any]
    attempt: int
    encoders: VelocityRelation
    joints: tuple[str, ...]
    """The joint of each observation of ``encoders``."""

    def motor_rank(self, names: Sequence[str]) -> int:
        """Return the rank of motors on these joints: the platform dof that they determine."""
        return self.encoders.select([i for i, name in enumerate(self.joints) if name in names]).rank

    def record(self, drawn: Mechanism, motors: Sequence[str]) -> dict[str, Any]:
        """The fields of a record, of a mechanism with motors on these joints."""
        rank = self.motor_rank(motors)
        return {
            "notation": decompose(reduce_to_normal_form(drawn).mechanism).architecture().ascii,
            **self.facts,
            "attempt": self.attempt or None,
            "motors": len(motors),
            "motor_rank": rank,
            "driven": rank == self.facts["dof"],
            "base_motors": all(drawn.base in drawn.joints[name].links for name in motors),
        }


@lru_cache(maxsize=128)
def _choose_studied_dimensions(text: str) -> ArchitectureStudy | str:
    """The study of a model, or why there is none, with the first dimensions that can be studied."""
    word, reason = parse(text), ""
    for attempt in range(DIMENSION_CHOICES_MAX):
        try:
            return _analyze_dimensions(word, attempt)
        except HrsynthError as error:
            reason = reason or str(error).splitlines()[0].removeprefix(f"{word}: ")
    return reason


def _analyze_dimensions(word: ArchitectureKey, attempt: int) -> ArchitectureStudy:
    kinds = _list_leg_kinds(word)
    return analyze_mechanism(build_mechanism(word, attempt), lambda size: _list_choices(kinds, size), attempt)


def analyze_mechanism(
    drawn: Mechanism, sets: Callable[[int], Iterable[tuple[int, ...]]], attempt: int = 0, *, proved: bool = True
) -> ArchitectureStudy:
    """Study a mechanism regardless of motors. ``sets`` gives the sets of a number of legs (indices), one of those
    equal by symmetry. Raises ``ConfirmationFailure`` if the verdict is not exact, unless ``proved`` is False.
    """
    setup = observe(drawn, samples=VERDICT_SAMPLES_COUNT)
    if not setup.dof:
        raise ConfirmationFailure(setup.robot.name, "its platform does not move")
    derivation = derive(setup, unchecked=False)
    exact = get_architecture(setup) if proved or derivation.exact.exact else None
    if exact is not None:
        _require_agreement(exact, setup.samples, derivation.verdict)
    fewest = _find_smallest_sets(setup, exact, sets, derivation.verdict)
    facts = {
        "hidden": derivation.hidden_architecture and derivation.hidden_architecture.ascii,
        "steps": _describe_steps(derivation.taken),
        "legs": len(setup.segments),
        "dof": setup.dof,
        "motion": _describe_motion(setup),
        "mobility": setup.mobility.total,
        "internal": setup.mobility.internal,
        "verdict": derivation.verdict.verdict,
        "rank": derivation.verdict.rank,
        "exact": derivation.exact.exact,
        "instances": derivation.exact.instances,
        "confirmed": len(setup.configurations),
        "unobserved": [_strip_dimensions(freedom.name) for freedom in derivation.verdict.unobserved],
        "minimal": [list(each) for each in fewest],
        "fewest": len(fewest[0]) if fewest else 0,
        "condition": None,
        "modes_legs": None,
        "modes_bound": None,
        "modes_seen": None,
        "modes_proof": None,
        "suggestion": None,
    }
    if derivation.verdict.verdict == CONTROLLABLE:
        facts.update(_describe_singularities(setup), **_count_modes(setup, fewest))
    else:
        facts["suggestion"] = _propose_measurements(advise(setup, most=1))
    return ArchitectureStudy(facts, attempt, *_observe_encoders(setup))


def derive_smallest_sets(record: Mapping[str, Any], drawn: Mechanism) -> list[dict[str, Any]]:
    """The smallest sets of a record, each with its ``legs`` and its ``hidden`` robot, derived now for the mechanism
    that was studied; ``problem`` is what went wrong. ``near`` is the number of near modes found for the set whose modes
    the record counts, None for the others."""
    if not record.get("minimal"):
        return []
    setup, found = observe(drawn, samples=VERDICT_SAMPLES_COUNT), []
    for legs in record["minimal"]:
        hidden, problem, near = record.get("hidden"), None, None
        if len(legs) < len(_choose_observations(setup)):
            try:
                form = derive(_observe_legs(setup, legs), unchecked=False).hidden_architecture
                hidden = None if form is None else form.ascii
            except HrsynthError as error:
                hidden, problem = None, str(error).splitlines()[0]
        if legs == record.get("modes_legs"):
            with suppress(HrsynthError):
                near = len(modes(_observe_legs(setup, legs)).near_modes)
        found.append({"legs": list(legs), "hidden": hidden, "problem": problem, "near_matches": near})
    return found


def _require_agreement(exact: ExactArchitecture, samples: Samples, found: Verdict) -> None:
    """Raise ``ConfirmationFailure`` unless the exact verdict is that of the closed configurations."""
    generic = exact.verdict(samples.observation_model.observations)
    if not generic.exact or (generic.basis and generic.basis.sampled) or generic.chance > PROVED_ENTRY_ERROR_CHANCE_MAX:
        raise ConfirmationFailure(exact.mechanism.name, generic.reason)
    if generic.rank != found.rank:
        raise ConfirmationFailure(
            exact.mechanism.name,
            f"legs {', '.join(found.legs)}: rank {generic.rank} of {found.dof} "
            f"in exact arithmetic, {found.rank} at samples",
        )


def _choose_observations(setup: ObservedRobot) -> tuple[Observation, ...]:
    """The segments of all legs, or what is seen instead."""
    return setup.segments if all(each.is_segment_direction for each in setup.observed) else setup.observed


def _observe_legs(setup: ObservedRobot, legs: Sequence[str]) -> ObservedRobot:
    """The robot of which these legs are observed, or these of what is observed instead."""
    return replace(setup, observed=tuple(each for each in _choose_observations(setup) if each.leg in legs))


def _list_leg_kinds(word: ArchitectureKey) -> list[str]:
    """Return the kind of each leg in the order of labels, or the sensors; equal legs of one link can be exchanged."""
    return [str(each) for each in word.seen] or [
        f"{body}{leg}" for body, legs in enumerate(word.bodies) for leg in legs
    ]


def _find_smallest_sets(
    setup: ObservedRobot,
    exact: ExactArchitecture | None,
    sets: Callable[[int], Iterable[tuple[int, ...]]],
    best: Verdict,
) -> list[tuple[str, ...]]:
    """Return the smallest sets of legs with the rank of all legs, one of those that differ by equal legs; each rank is
    confirmed, and exact if ``exact`` is given."""
    if not best.rank:
        return []
    for size in range(1, len(_choose_observations(setup)) + 1):
        found = []
        for places in sets(size):
            seen = [_choose_observations(setup)[i] for i in places]
            samples = setup.all_samples.restrict(seen, ways=False)
            verdict = compute_verdict(setup, [o.leg for o in seen], samples)
            if exact is not None:
                _require_agreement(exact, samples, verdict)
            if verdict.rank == best.rank:
                found.append(verdict.legs)
        if found:
            return found
    raise AssertionError("all legs together see what all legs see")


def _list_choices(kinds: Sequence[str], size: int) -> Iterator[tuple[int, ...]]:
    """Sets of places, the first of each that holds the same kinds."""
    known: set[tuple[str, ...]] = set()
    for places in combinations(range(len(kinds)), size):
        key = tuple(kinds[i] for i in places)
        if key not in known:
            known.add(key)
            yield places


def _describe_steps(steps: Sequence[Step]) -> list[str]:
    """The rules that were applied, in order, each with its legs: "lift 1,2,3"."""
    taken = [(step.rule, step.leg) for step in steps if step.accepted]
    return [
        " ".join([rule, ",".join(str(leg) for _, leg in part if leg)]).strip()
        for rule, part in ((rule, list(part)) for rule, part in groupby(taken, key=lambda step: step[0]))
    ]


def _describe_motion(setup: ObservedRobot) -> str:
    """Translations and other motions of the platform at a generic configuration: 3T, 2T1R, 1T2R, 3T3R …"""
    twists = setup.all_samples.members[0].relation.twists
    turns = compute_range_basis(twists[3:], 1.0)[1].value if twists.shape[0] > 3 else 0
    return "".join(f"{count}{letter}" for count, letter in ((setup.dof - turns, "T"), (turns, "R")) if count)


def _strip_dimensions(name: str) -> str:
    """Return the name of a twist without the dimensions of the mechanism."""
    name = re.sub(r" \(with the platform at .*\)", "", name)
    return re.split(r" of pitch| (?:along|about the line through|about) \(", name)[0]


def _describe_singularities(setup: ObservedRobot) -> dict[str, Any]:
    """Return the Type 2 condition in words, None if there is none."""
    return {"condition": MeasuredRobot.of(setup).condition.words}


def _count_modes(setup: ObservedRobot, fewest: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Complex assembly modes of a smallest set of legs, by what there are no more if not by a resultant, and the most
    real ones of some configurations: of the first set, or else of that of which fewest can be expected."""
    robots = [MeasuredRobot.of(_observe_legs(setup, legs)) for legs in fewest]
    at = setup.configurations[0]

    def tried() -> Iterator[int]:
        yield 0
        yield from sorted(range(1, len(fewest)), key=lambda k: bound_modes(robots[k], at))[:OTHER_SMALLEST_SETS_COUNT]

    for k in tried():
        found = [
            each
            for each in _list_modes(robots[k], setup.configurations)
            if each.complete and not each.continuous_family
        ]
        bounds = [each.complex for each in found if each.complex is not None]
        if bounds:
            return {
                "modes_legs": list(fewest[k]),
                "modes_bound": max(bounds),
                "modes_seen": max(sum(mode.multiplicity for mode in each.modes) for each in found),
                "modes_proof": next((each.bound for each in found if each.bound != "resultant"), None),
            }
    return {}


def _list_modes(measured: MeasuredRobot, configurations: Sequence[ClosedConfiguration]) -> Iterator[SystemModes]:
    """The modes at some configurations, at fewer where they are more than a resultant lists; none from where there is
    no list on."""
    count = MODE_LIST_SAMPLES_COUNT
    for k, at in enumerate(configurations[:MODE_LIST_SAMPLES_COUNT]):
        if k >= count:
            return
        try:
            found = counted_modes(measured, at)
        except (UnsupportedLocus, ExternalSolverFailure, MissingExtra, BadRequest):
            return
        yield found
        if found.open or found.continuous_family is not None:  # for the architecture: the configuration is a random one
            return
        if found.bound != "resultant":
            count = (
                1
                if found.bound == "rank" or (found.complex or 0) > MULTI_SAMPLE_MODES_MAX
                else SEARCHED_MODE_SAMPLES_COUNT
            )


def _propose_measurements(found: Advice) -> str:
    """Return the first of the smallest sets of further measurements that observe the unobserved twists."""
    if not found.sets:
        return "none of up to four measurements"
    first = " and ".join(
        f"{each.kind} {each.of}" + (f" ({each.axis})" if each.axis else "") for each in found.sets[0].measurements
    )
    return first if found.has_sufficient_sets else f"not all by {first}"


def _observe_encoders(setup: ObservedRobot) -> tuple[VelocityRelation, tuple[str, ...]]:
    """Return the velocity relation of encoders on all joints at a configuration, and the joint of each."""
    every = [
        (joint.name, each)
        for joint in setup.mechanism.joints.values()
        for each in make_encoders(setup.mechanism, joint, "")
    ]
    question = replace(setup.all_samples.observation_model, observations=tuple(each for _, each in every))
    return compute_relation(setup.configurations[0], question), tuple(name for name, _ in every)
