"""Rules of ``lint``: tables of rules by concept, discovered automatically."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from ..findings import LintRule


@cache
def lint_rules() -> dict[str, LintRule]:
    """Return all rules by name, in the order of their tables' names."""
    tables = sorted(each.name for each in iter_modules(__path__))
    found: list[LintRule] = [rule for name in tables for rule in import_module(f"{__name__}.{name}").RULES]
    return {rule.name: rule for rule in found}
