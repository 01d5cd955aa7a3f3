"""The mechanism of a structure and its derivation, in the dimensions for which the catalog has its record."""

from __future__ import annotations

from dataclasses import dataclass

from ...analysis.derive import Derivation, derived
from ...analysis.setting import prepare
from ...errors import HrsynthError
from ...mechanism.model import Mechanism
from ..entry import ATTEMPTS, SAMPLES
from ..geometry import mechanism
from ..lines import Record
from ..words import parse


@dataclass(frozen=True, eq=False)
class Study:
    """The number of the dimensions, the derivation in these (None: there is none), and how it differs from the
    record, if it does."""

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


def study(word: str, record: Record) -> Study:
    """Derive the hidden robot of a word without motors in the first dimensions in which it is that of the record; if
    there are none, in the first in which there is one."""
    if "refused" in record:
        return Study(0)
    first: Study | None = None
    for attempt in range(ATTEMPTS):
        try:
            setting = prepare(mechanism(parse(word).driven, attempt), samples=SAMPLES)
            found = derived(setting, beside=False)
        except HrsynthError:
            continue
        differs = _difference(found, record)
        if not differs:
            return Study(attempt, found)
        first = first or Study(attempt, found, differs)
    return first or Study(0, differs="no hidden robot is derived")


def _difference(found: Derivation, record: Record) -> str:
    """What a derivation ends in, where it is not what the record says."""
    hidden = found.hidden_architecture and found.hidden_architecture.ascii
    same = (hidden, found.verdict.verdict, found.verdict.rank) == (record.get("hidden"), record["verdict"],
                                                                   record["rank"])
    return "" if same else f"{hidden or 'no hidden robot'}, {found.verdict.verdict}, rank {found.verdict.rank}"
