"""Kinds of observations: one file each, discovered automatically."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ..observation import Observation


@cache
def list_kinds() -> dict[str, type[Observation]]:
    """Return all kinds by name, in the order of their files' names."""
    found = (import_module(f"{__name__}.{module.name}").KIND for module in iter_modules(__path__))
    return {kind.kind: kind for kind in found}
