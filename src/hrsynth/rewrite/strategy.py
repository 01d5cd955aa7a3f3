"""Strategies: the order in which rules are tried, every step checked for equivalence and recorded.

A strategy is a function from a rewriting to a later one, as in term rewriting. ``chain`` runs strategies one after
the other; ``apply_to_each_leg`` tries the rules of some stages on legs and takes the first accepted proposal of each;
``choose_fewest_legs`` tries all proposals and continues from the one after which most legs can be removed. All share
a limit of attempts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Protocol

from ..mechanism import Mechanism
from ..mechanism.observation import list_labels
from ..progress import report
from ..records import ANGLE, Record, Recorded
from .evidence import Evidence
from .rule import Proposal, Refusal, Rule, Stage
from .rules import list_rules
from .state import State

REWRITE_PROPOSALS_MAX = 400
"""The largest number of proposals a derivation may try."""


class Comparison(Protocol):
    """Result of a check, such as the equivalence check."""

    @property
    def passed(self) -> bool: ...
    @property
    def largest_angle(self) -> float: ...
    @property
    def reason(self) -> str: ...


Check = Callable[[Mechanism, tuple[str, ...]], Comparison]
"""Compares a rewritten mechanism with the real robot; the links named move as before too."""


@dataclass(frozen=True)
class Step(Record):
    """One attempt: the rule, the leg (None: all), whether it was accepted, why, and the angle if it was measured;
    ``state`` is what an accepted rewriting left behind, ``always`` whether the rule holds for every robot, ``keeps``
    where it keeps ρ at singular configurations too, ``bodies`` the links, besides the platform, whose twists must not
    change, ``discarded`` whether it served only for a proposal that was not kept."""

    rule: Recorded[str]
    leg: Recorded[str | None]
    accepted: Recorded[bool]
    reason: Recorded[str]
    largest_angle: Annotated[float | None, ANGLE]
    state: State | None = field(default=None, compare=False, repr=False)
    always: bool = field(default=False, compare=False, repr=False)
    keeps: tuple[str, ...] = field(default=(), compare=False, repr=False)
    bodies: tuple[str, ...] = field(default=(), compare=False, repr=False)
    discarded: bool = field(default=False, repr=False)

    def measured(self, check: Check) -> Step:
        """The step with its own angle, where it was accepted unchecked."""
        if self.state is None or self.largest_angle is not None:
            return self
        found = check(self.state.mechanism, self.bodies)
        reason = self.reason if found.passed else f"{self.reason} (not equivalent by itself: {found.reason})"
        return replace(self, largest_angle=found.largest_angle, reason=reason)


@dataclass(frozen=True, eq=False)
class RewriteTrace:
    """State of a derivation and its steps. With ``check`` None every proposal is accepted and side conditions are
    waived. Proposals of ``unchecked`` stages are accepted where their side conditions hold: a later check compares the
    whole."""

    state: State
    evidence: Evidence
    check: Check | None = None
    unchecked: frozenset[Stage] = frozenset()
    steps: tuple[Step, ...] = ()
    tried: int = 0
    """Number of checked proposals."""

    @classmethod
    def of(cls, evidence: Evidence, check: Check | None = None, unchecked: Iterable[Stage] = ()) -> RewriteTrace:
        """The real robot, before any rule."""
        real = evidence.anatomy
        return cls(State(real, replace(real.mechanism, observations=())), evidence, check, frozenset(unchecked))

    @property
    def has_virtual_motors_only(self) -> bool:
        """True if the rules that always hold were accepted and the virtual actuators are the only motors: every
        observed leg then has one, or a constant direction."""
        driven = {joint.name for joint in self.state.mechanism.joints.values() if joint.is_actuated}
        return all(step.accepted for step in self.steps if step.always) and driven == self.state.actuators

    def attempt(self, rule: Rule[Any, Any], leg: str | None) -> RewriteTrace:
        """The first of a rule's proposals that is accepted, if one is."""
        at = self
        for proposal in rule.proposals(at.state, at.evidence, leg or "", waive=at.check is None):
            at = at.judged(rule, leg, proposal)
            if at.state is not self.state:
                break
        return at

    def judged(self, rule: Rule[Any, Any], leg: str | None, proposal: Proposal | Refusal) -> RewriteTrace:
        """After the check of one proposal: its state where that passes."""
        if isinstance(proposal, Refusal):
            return self._after(rule, leg, False, proposal.reason)
        report(f"{rule.name} {leg or ''}")
        if self.check is None or rule.stage in self.unchecked:
            return self._after(rule, leg, True, proposal.reason, None, proposal)
        if self.tried >= REWRITE_PROPOSALS_MAX:
            return self._after(rule, leg, False, "the limit of attempts is reached")
        found = self.check(proposal.state.mechanism, proposal.bodies)
        reason = proposal.reason if found.passed else f"{proposal.reason}: refused, {found.reason}"
        after = self._after(rule, leg, found.passed, reason, found.largest_angle, proposal)
        return replace(after, tried=self.tried + 1)

    def _after(
        self,
        rule: Rule[Any, Any],
        leg: str | None,
        accepted: bool,
        reason: str,
        angle: float | None = None,
        proposal: Proposal | None = None,
    ) -> RewriteTrace:
        state, bodies = (proposal.state, proposal.bodies) if accepted and proposal else (None, ())
        step = Step(rule.name, leg, accepted, reason, angle, state, rule.always, rule.keeps, bodies)
        return replace(self, state=state or self.state, steps=(*self.steps, step))


Strategy = Callable[[RewriteTrace], RewriteTrace]
"""Function that continues a rewriting."""


def run_in_order(*strategies: Strategy) -> Strategy:
    """Run one strategy after the other."""

    def run(at: RewriteTrace) -> RewriteTrace:
        for strategy in strategies:
            at = strategy(at)
        return at

    return run


def apply_to_each_leg(legs: Callable[[RewriteTrace], Iterable[str]], *stages: Stage) -> Strategy:
    """The rules of some stages, each on all legs that have a place for it."""

    def run(at: RewriteTrace) -> RewriteTrace:
        wanted = list(legs(at))
        for rule in list_rules(*stages):
            for leg in wanted:
                if rule.places(at.state, leg):
                    at = at.attempt(rule, leg)
        return at

    return run


def apply_to_robot(stage: Stage) -> Strategy:
    """The rules of a stage, each on the robot as a whole."""

    def run(at: RewriteTrace) -> RewriteTrace:
        for rule in list_rules(stage):
            at = at.attempt(rule, None)
        return at

    return run


def choose_fewest_legs(stage: Stage, after: Strategy, left: Callable[[RewriteTrace], Iterable[str]]) -> Strategy:
    """Take the proposal of a stage's rules from which another strategy leaves the fewest legs; none if none leaves
    fewer than before. The first that leaves no leg ends the search; the others are marked as discarded."""

    def run(start: RewriteTrace) -> RewriteTrace:
        least, found, trace, tried = len(list(left(start))), start, start.steps, start.tried
        for rule in list_rules(stage):
            for proposal in rule.proposals(start.state, start.evidence) if least else ():
                trial = replace(start, steps=(), tried=tried).judged(rule, None, proposal)
                accepted = trial.state is not start.state
                trial = after(trial) if accepted else trial
                tried, rest = trial.tried, len(list(left(trial)))
                if accepted and rest < least:
                    least, found = rest, trial
                if accepted and not rest:
                    break
                trace += tuple(_discard_step(step) for step in trial.steps) if accepted else trial.steps
        return replace(found, steps=trace if found is start else trace + found.steps, tried=tried)

    return run


def _discard_step(step: Step) -> Step:
    return replace(step, accepted=False, reason=f"{step.reason} (discarded: legs remain)", state=None, discarded=True)


def list_observed_legs(at: RewriteTrace) -> tuple[str, ...]:
    """The legs that are observed."""
    return list_labels(at.evidence.samples.observation_model.observations)


def list_unobserved_legs(at: RewriteTrace) -> tuple[str, ...]:
    """The legs that have no virtual chain and have not gone."""
    known = {*at.state.observed_labels(), *at.state.removed}
    return tuple(label for label in at.state.real.labels if label not in known)


def keep_unobserved(at: RewriteTrace) -> RewriteTrace:
    """Record why the remaining legs stay."""
    reason = "without the leg the velocity relation changes: it stays, passive"
    return replace(
        at, steps=at.steps + tuple(Step("keep", leg, True, reason, None) for leg in list_unobserved_legs(at))
    )


def require_informative_leg(strategy: Strategy) -> Strategy:
    """Restrict a strategy to robots with a leg whose direction is not constant."""
    return lambda at: strategy(at) if at.state.actuators else at


OBSERVED_STAGES = frozenset(Stage) - {Stage.LEG, Stage.ENDS}
"""Stages of the observed legs: with a complete hidden robot, the velocity relation of all steps together decides."""

LIFTED = run_in_order(apply_to_robot(Stage.MOTORS), apply_to_each_leg(list_observed_legs, Stage.LIFT))
"""The exact lift, of which the relation is that of the real robot for every robot."""

GENERAL = run_in_order(
    LIFTED, apply_to_each_leg(list_observed_legs, Stage.DIRECTION, Stage.ANCHOR, Stage.JOINT, Stage.BESIDE)
)
"""The general form: sliders under every virtual actuator, all legs kept."""

DROPPED = apply_to_each_leg(list_unobserved_legs, Stage.LEG)
"""Removal of unobserved legs, each tried."""

SIMPLIFIED = run_in_order(
    GENERAL,
    apply_to_each_leg(list_observed_legs, Stage.FORM),
    require_informative_leg(
        run_in_order(DROPPED, choose_fewest_legs(Stage.ENDS, DROPPED, list_unobserved_legs), keep_unobserved)
    ),
)
"""Simplified form, as far as the equivalence check passes: where unobserved legs constrain the platform, the ends of
the observed legs are changed; legs that still cannot be removed stay."""


FORMS = {"simplified": SIMPLIFIED, "general": GENERAL}
"""Forms of a hidden robot, by name."""


def apply_unchecked(evidence: Evidence, *, change_ends: bool) -> list[RewriteTrace]:
    """The forms that the rules give when no condition is checked; with ``change_ends`` one for each choice of outer
    axes besides."""
    start = run_in_order(GENERAL, apply_to_each_leg(list_observed_legs, Stage.FORM))(RewriteTrace.of(evidence))
    starts = [start]
    for rule in list_rules(Stage.ENDS) if change_ends else ():
        starts += [
            start.judged(rule, None, each)
            for each in rule.proposals(start.state, evidence, waive=True)
            if isinstance(each, Proposal)
        ]
    return [DROPPED(each) for each in starts]
