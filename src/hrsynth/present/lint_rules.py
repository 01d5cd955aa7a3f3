"""The table of the rules of ``lint``, on the page docs/pages/lint.md."""

from __future__ import annotations

from ..linting.rules import lint_rules

START = "<!-- generated: rules -->"


def table() -> str:
    """The Markdown table of all rules, as they say it themselves."""
    lines = ["| rule | severity | what it finds | why it matters | what to do |", "| --- | --- | --- | --- | --- |"]
    for rule in lint_rules().values():
        advice = f"{rule.advice} (`--fix`)" if rule.mends else rule.advice
        cells = (f"`{rule.name}`", rule.severity, rule.title, rule.explanation, advice)
        lines.append("| " + " | ".join(each.replace("|", "\\|").replace("<", "&lt;") for each in cells) + " |")
    return "\n".join(lines) + "\n"
