"""The table of the catalog; ``python -m hrsynth.catalog.readme docs/pages/catalog.md`` writes it between its marks."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from ..analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from ..present.markdown import rewrite
from ..present.markdown import table as markdown
from .query import Catalog, load
from .store import shipped_folder
from .words import SENSORS

START = "<!-- generated: catalog -->"
VERDICTS = (CONTROLLABLE, PARTIAL, BLIND, None)
HEADS = ("group", "architectures", "controllable", "partially controllable", "uncontrollable", "refused")


def table(catalog: Catalog | None = None) -> str:
    """The Markdown table of how many architectures of each group have which verdict (default: of what is shipped)."""
    if catalog is None:
        catalog = Catalog((*load(), *load(group=SENSORS))) if shipped_folder().groups() else Catalog(())
    counts, total = catalog.count("group", "verdict"), catalog.count("verdict")
    rows = [_row(name, [counts.get((name, verdict), 0) for verdict in VERDICTS]) for name in catalog.values("group")]
    return markdown(HEADS, [*rows, _row("all", [total.get((verdict,), 0) for verdict in VERDICTS])], 1)


def _row(name: str, counts: Sequence[int]) -> list[str]:
    return [name, f"{sum(counts):,}", *(f"{count:,}" for count in counts)]


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        rewrite(argument, {START: table})
