"""The mechanism of a structure and its derivation, in the dimensions for which the catalog has its record."""

from __future__ import annotations

from dataclasses import dataclass

from ...analysis.derive import Derivation, derived
from ...analysis.observed import prepare
from ...errors import HrsynthError
from ...mechanism.model import Mechanism
from ..entry import SAMPLES, model
from ..geometry import mechanism
from ..jsonl import Record
from ..words import parse


@dataclass(frozen=True, eq=False)
class Study:
    """The number of the dimensions, the derivation in these (None: there is none), and what it ends in or why there is
    none, where the record says otherwise."""

    attempt: int
    derivation: Derivation | None = None
    differs: str = ""

    @property
    def observed(self) -> tuple[str, ...] | None:
        """The observed links; None where nothing is known of them."""
        return None if self.derivation is None else tuple(each.link for each in self.derivation.setting.observed)

    def real(self, word: str) -> Mechanism:
        """The robot of an architecture of this structure."""
        return mechanism(parse(word), self.attempt)


def study(record: Record) -> Study:
    """Derive the hidden robot of a record in its dimensions; none where it is refused."""
    attempt = record.get("attempt", 0)
    if "refused" in record:
        return Study(attempt)
    try:
        setting = prepare(mechanism(model(parse(record["word"])), attempt), samples=SAMPLES)
        found = derived(setting, beside=False)
    except HrsynthError as error:
        return Study(attempt, differs=str(error).splitlines()[0])
    return Study(attempt, found, _difference(found, record))


def _difference(found: Derivation, record: Record) -> str:
    """What a derivation ends in, where that is not what the record says."""
    hidden = found.hidden_architecture and found.hidden_architecture.ascii
    same = (hidden, found.verdict.verdict, found.verdict.rank) == (record.get("hidden"), record["verdict"],
                                                                   record["rank"])
    return "" if same else f"{hidden or 'no hidden robot'}, {found.verdict.verdict}, rank {found.verdict.rank}"
