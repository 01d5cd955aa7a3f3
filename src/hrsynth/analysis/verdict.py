"""The words of a verdict (docs/pages/theory.md, section 6)."""

from __future__ import annotations

CONTROLLABLE, PARTIAL, BLIND = "controllable", "partially controllable", "uncontrollable"


def word(rank: int, dof: int) -> str:
    """The verdict where ``rank`` of the platform's ``dof`` freedoms are seen."""
    return CONTROLLABLE if rank == dof else PARTIAL if rank else BLIND
