"""``python -m tables``, from ``docs/``: every table of the pages, each between its marks."""

from __future__ import annotations

from hrsynth.catalog.query import load

from . import architectures, catalog, claims, closures, lint_rules, observation_kinds, printed, replays, robots
from .markdown import rewrite

PAGES = architectures.PAGE.parent

rewrite(PAGES.parents[1] / "robots" / "README.md", {robots.START: robots.table})
rewrite(
    PAGES / "papers.md",
    {
        printed.START: printed.table,
        printed.FORMS_START: printed.forms_table,
        replays.START: replays.table,
    },
)
rewrite(PAGES / "lint_rules.md", {lint_rules.START: lint_rules.table})
rewrite(PAGES / "closures.md", {closures.START: closures.table, closures.WRITTEN_START: closures.written_table})
rewrite(PAGES / "observations.md", {observation_kinds.START: observation_kinds.table})
rewrite(PAGES / "find_an_architecture.md", {catalog.START: catalog.table})
shown = architectures.PAGE.read_text(encoding="utf-8")
architectures.PAGE.write_text(architectures.written(shown, load()), encoding="utf-8", newline="\n")
(PAGES / "claims.md").write_text(claims.page(), encoding="utf-8", newline="\n")
