"""The checks, each with the share of robots on which it is made."""

from __future__ import annotations

from collections.abc import Callable

from adversary.case import Case
from adversary.claims import lists, verdicts

CLAIMS: dict[str, tuple[Callable[[Case], None], float]] = {
    "verdicts": (verdicts.verdicts, 1.0),
    "hidden modes": (lists.hidden, 0.6),
    "real modes": (lists.real, 0.6),
    "cures": (verdicts.cures, 0.3),
}
