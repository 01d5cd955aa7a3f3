"""The rules: one file each, with its drawing, its source and its side condition. What lies here is found by itself."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from ..rule import Rule, Stage


@cache
def list_rules(*stages: Stage) -> tuple[Rule[Any, Any], ...]:
    """Return the rules of some stages (default: all), stage by stage, in each by ``rank`` and name."""
    found = sorted(_find_rules(), key=lambda rule: (rule.rank, rule.name))
    return tuple(rule for stage in stages or Stage for rule in found if rule.stage is stage)


def _find_rules() -> Iterator[Rule[Any, Any]]:
    for module in iter_modules(__path__):
        yield import_module(f"{__name__}.{module.name}").RULE
