"""``python -m tables``, from ``docs/``: every table of the pages, each between its marks."""

from __future__ import annotations

from hrsynth.catalog.query import load

from . import catalog, catalog_says, claims, lint_rules, observation_kinds, printed, replays, robots
from .markdown import rewrite

PAGES = catalog_says.PAGE.parent

rewrite(PAGES.parents[1] / "robots" / "README.md", {robots.START: robots.table})
rewrite(
    PAGES / "papers.md",
    {
        printed.START: printed.table,
        printed.FORMS_START: printed.forms_table,
        replays.START: replays.table,
    },
)
rewrite(PAGES / "lint.md", {lint_rules.START: lint_rules.table})
rewrite(PAGES / "observations.md", {observation_kinds.START: observation_kinds.table})
rewrite(PAGES / "find_an_architecture.md", {catalog.START: catalog.table})
says = catalog_says.PAGE.read_text(encoding="utf-8")
catalog_says.PAGE.write_text(catalog_says.written(says, load()), encoding="utf-8", newline="\n")
(PAGES / "claims.md").write_text(claims.page(), encoding="utf-8", newline="\n")
