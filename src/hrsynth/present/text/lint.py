"""Findings of ``lint``: as text, as annotations of GitHub, as SARIF 2.1.0."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ...linting.findings import Finding
from ...version import __version__

if TYPE_CHECKING:
    from ...errors import Defect
    from ...linting.lint import Lint

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
LEVELS = {"error": "error", "warning": "warning", "note": "notice"}
"""Names of the severities on GitHub."""


def lint(found: Lint) -> str:
    """Return a line per finding, the advice below the first of its rule in each file, the counts last."""
    lines, told = [], set[tuple[str, str, str | None]]()
    for each in found.findings:
        lines.append(f"{each.where}: {each.severity}: {each.message} [{each.rule}]")
        advice = (each.file, each.rule, each.advice)
        if each.advice is not None and advice not in told:
            told.add(advice)
            lines.append(f"    → {each.advice}{' (--fix applies it)' if each.fixable else ''}")
    lines += [f"{each.where}: fixed: {each.message} [{each.rule}]" for each in found.fixed]
    if found.written is not None:
        lines.append(f"The fixed file is written to {found.written}.")
    return "\n".join([*lines, found.headline()])


def format_github(found: Lint) -> str:
    """Return a workflow command of GitHub per finding."""
    unread = [Finding("unread", "error", each.file, each.line, each.text) for each in found.unread]
    return "\n".join(_format_command(each) for each in (*unread, *found.findings))


def _format_command(finding: Finding) -> str:
    place: dict[str, object] = {"file": finding.file, "line": finding.line, "title": finding.rule}
    properties = ",".join(
        f"{key}={_escape(str(value), {':': '%3A', ',': '%2C'})}" for key, value in place.items() if value is not None
    )
    text = finding.message if finding.advice is None else f"{finding.message} → {finding.advice}"
    return f"::{LEVELS[finding.severity]} {properties}::{_escape(text)}"


def _escape(text: str, more: Mapping[str, str] | None = None) -> str:
    for character, code in {"%": "%25", "\r": "%0D", "\n": "%0A", **(more or {})}.items():
        text = text.replace(character, code)
    return text


def format_sarif(found: Lint) -> str:
    """Return a log in the Static Analysis Results Interchange Format, version 2.1.0."""
    from ...linting.rules import lint_rules

    rules = [rule for rule in lint_rules().values() if rule.name in found.rules]
    place = {rule.name: number for number, rule in enumerate(rules)}
    driver = {
        "name": "hrsynth",
        "version": __version__,
        "semanticVersion": __version__,
        "rules": [
            {
                "id": rule.name,
                "shortDescription": {"text": rule.title},
                "fullDescription": {"text": rule.explanation},
                "help": {"text": rule.advice},
                "defaultConfiguration": {"level": rule.severity},
            }
            for rule in rules
        ],
    }
    results = [
        {
            "ruleId": each.rule,
            "ruleIndex": place[each.rule],
            "level": each.severity,
            "message": {"text": each.message},
            "locations": [{"physicalLocation": _format_location(each)}],
        }
        for each in found.findings
    ]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    if found.unread:
        told = [
            {
                "level": "error",
                "message": {"text": each.text},
                "locations": [{"physicalLocation": _format_location(each)}],
            }
            for each in found.unread
        ]
        run["invocations"] = [{"executionSuccessful": False, "toolExecutionNotifications": told}]
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, ensure_ascii=False, indent=2)


def _format_location(finding: Finding | Defect) -> dict[str, Any]:
    path = Path(finding.file)
    uri = path.as_uri() if path.is_absolute() else quote(path.as_posix().replace(os.sep, "/"))
    region = {} if finding.line is None else {"region": {"startLine": int(finding.line)}}
    return {"artifactLocation": {"uri": uri}, **region}
