"""The table of the rules of ``lint``, on the page docs/pages/lint_rules.md."""

from __future__ import annotations

from hrsynth.linting.rules import lint_rules

from .markdown import table as markdown

START = "<!-- generated: rules -->"


def table() -> str:
    """Return the Markdown table of all rules, by their own descriptions."""
    rows = []
    for rule in lint_rules().values():
        advice = f"{rule.advice} (`--fix`)" if rule.fixable else rule.advice
        cells = (f"`{rule.name}`", rule.severity, rule.title, rule.explanation, advice)
        rows.append([each.replace("<", "&lt;") for each in cells])
    return markdown(("rule", "severity", "what it finds", "why it matters", "what to do"), rows)
