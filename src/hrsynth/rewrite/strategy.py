"""Which rule is tried when: strategies over rules, every step under the certificate, every attempt on the trace."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Protocol

from ..mechanism import Mechanism
from ..mechanism.legs import LegDecomposition
from ..mechanism.observation import labels_of
from .evidence import Evidence
from .rule import Proposal, Refusal, Rule
from .rules import (
    anchor_locus,
    companion,
    direction_locus,
    end_change,
    leg_removal,
    lift,
    motors_off,
    pi_form,
    prismatic_merge,
    takeover,
)
from .state import State

RULES: tuple[Rule, ...] = (motors_off.RULE, lift.RULE, direction_locus.RULE, anchor_locus.RULE, prismatic_merge.RULE,
                           takeover.RULE, companion.RULE, pi_form.RULE, leg_removal.RULE, end_change.RULE)
"""All rules, in the order of the derivation."""

BUDGET = 400
"""The largest number of proposals a derivation may try."""


class Comparison(Protocol):
    """What a check answers: the certificate is one."""

    @property
    def passed(self) -> bool: ...
    @property
    def largest_angle(self) -> float: ...
    @property
    def reason(self) -> str: ...


Check = Callable[[Mechanism, tuple[str, ...]], Comparison]
"""Compares a rewritten mechanism with the real robot; the links named move as before too."""


@dataclass(frozen=True)
class Step:
    """One attempt: the rule, the leg (None: all), whether it was accepted, why, and the angle if it was measured;
    ``state`` is what an accepted rewriting left behind."""

    rule: str
    leg: str | None
    accepted: bool
    reason: str
    largest_angle: float | None
    state: State | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, eq=False)
class Rewriting:
    """Where a strategy came to, and how."""

    state: State
    steps: tuple[Step, ...]


@dataclass
class _Run:
    """The state so far and the trace; ``check`` None trusts every proposal."""

    state: State
    evidence: Evidence
    check: Check | None
    steps: list[Step] = field(default_factory=list)
    tried: int = 0
    progress: Callable[[str], None] | None = None

    def attempt(self, rule: Rule, leg: str | None) -> bool:
        """Try a rule's proposals in order until one is accepted."""
        for proposal in rule.propose(self.state, self.evidence, leg or "", self.check is None):
            if isinstance(proposal, Refusal):
                self.steps.append(Step(rule.name, leg, False, proposal.reason, None))
                continue
            if self._accept(rule, leg, proposal):
                return True
        return False

    def _accept(self, rule: Rule, leg: str | None, proposal: Proposal) -> bool:
        if self.progress is not None:
            self.progress(f"{rule.name} {leg or ''}")
        if self.check is None:
            self.state = proposal.state
            self.steps.append(Step(rule.name, leg, True, proposal.reason, None, proposal.state))
            return True
        self.tried += 1
        if self.tried > BUDGET:
            self.steps.append(Step(rule.name, leg, False, "the budget of attempts is used up", None))
            return False
        found = self.check(proposal.state.mechanism, proposal.bodies)
        reason = proposal.reason if found.passed else f"{proposal.reason}: refused, {found.reason}"
        self.steps.append(Step(rule.name, leg, found.passed, reason, found.largest_angle,
                               proposal.state if found.passed else None))
        if found.passed:
            self.state = proposal.state
        return found.passed

    def each(self, rules: Iterable[Rule], legs: Iterable[str]) -> None:
        """Every rule on every leg."""
        wanted = list(legs)
        for rule in rules:
            for leg in wanted:
                if rule is lift.RULE or self.state.chain(leg):
                    self.attempt(rule, leg)


def general(anatomy: LegDecomposition, evidence: Evidence, check: Check,
            progress: Callable[[str], None] | None = None) -> Rewriting:
    """The general form: sliders under every virtual actuator, all legs kept."""
    return _finished(_virtual_legs(anatomy, evidence, check, progress))


def simplified(anatomy: LegDecomposition, evidence: Evidence, check: Check,
               progress: Callable[[str], None] | None = None) -> Rewriting:
    """The form of the paper, as far as the certificate goes along with it."""
    run = _virtual_legs(anatomy, evidence, check, progress)
    run.each([pi_form.RULE], run.state.observed())
    if run.state.chains:
        _drop_legs(run)
    return _finished(run)


def trusting(anatomy: LegDecomposition, evidence: Evidence, *, change_ends: bool) -> list[Rewriting]:
    """The form that the paper's rules alone give, nothing checked: one rewriting for each choice of outer axes."""
    run = _virtual_legs(anatomy, evidence, None, None)
    run.each([pi_form.RULE], run.state.observed())
    observed = run.state.observed()
    starts = [run.state]
    if change_ends:
        tried = [p.state for p in end_change.RULE.propose(run.state, evidence, "", True) if isinstance(p, Proposal)]
        starts = tried or starts
    results = []
    for start in starts:
        each = replace(run, state=start, steps=list(run.steps))
        for label in anatomy.labels:
            if label not in observed:
                each.attempt(leg_removal.RULE, label)
        results.append(_finished(each))
    return results


def _virtual_legs(anatomy: LegDecomposition, evidence: Evidence, check: Check | None,
                  progress: Callable[[str], None] | None) -> _Run:
    start = State(anatomy, replace(anatomy.mechanism, observations=()))
    run = _Run(start, evidence, check, progress=progress)
    run.attempt(motors_off.RULE, None)
    legs = labels_of(evidence.samples.question.observations)
    run.each([lift.RULE, direction_locus.RULE, anchor_locus.RULE, prismatic_merge.RULE, takeover.RULE,
              companion.RULE], legs)
    return run


def _drop_legs(run: _Run) -> None:
    """Drop unobserved legs; where they hold the platform, change the ends of the observed legs; else keep them."""
    observed = run.state.observed()
    rest = [label for label in run.state.real.labels if label not in observed]
    left = [label for label in rest if not run.attempt(leg_removal.RULE, label)]
    if left:
        left = _change_ends(run, left)
    for label in left:
        run.steps.append(Step("keep", label, True, "nothing else restores the relation: the leg stays, passive", None))


def _change_ends(run: _Run, left: list[str]) -> list[str]:
    """Try outer axes until all legs can go; keep the try that drops most."""
    best: tuple[list[str], State, list[Step]] | None = None
    for proposal in end_change.RULE.propose(run.state, run.evidence, "", False):
        if isinstance(proposal, Refusal):
            run.steps.append(Step(end_change.RULE.name, None, False, proposal.reason, None))
            break
        trial = replace(run, steps=[])
        if not trial._accept(end_change.RULE, None, proposal):
            run.tried = trial.tried
            run.steps.extend(trial.steps)
            continue
        remaining = [label for label in left if not trial.attempt(leg_removal.RULE, label)]
        run.tried = trial.tried
        if best is None or len(remaining) < len(best[0]):
            best = remaining, trial.state, trial.steps
        if not remaining:
            break
        run.steps.extend(replace(step, accepted=False, reason=step.reason + " (taken back: legs remain)", state=None)
                         for step in trial.steps)
    if best is not None and len(best[0]) < len(left):
        run.state = best[1]
        run.steps.extend(best[2])
        return best[0]
    return left


def _finished(run: _Run) -> Rewriting:
    return Rewriting(run.state, tuple(run.steps))
