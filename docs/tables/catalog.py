"""The table of the catalog, on the page docs/pages/find_an_architecture.md."""

from __future__ import annotations

from collections.abc import Sequence

from hrsynth.analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from hrsynth.catalog.architecture_key import SENSORS
from hrsynth.catalog.query import Catalog, load
from hrsynth.catalog.store import locate_shipped_folder

from .markdown import table as markdown

START = "<!-- generated: catalog -->"
VERDICTS = (CONTROLLABLE, PARTIAL, BLIND, None)
HEADS = ("group", "architectures", "controllable", "partially controllable", "uncontrollable", "refused")


def table(catalog: Catalog | None = None) -> str:
    """Return the Markdown table of architectures by group and verdict (default: of the shipped catalog)."""
    if catalog is None:
        catalog = Catalog((*load(), *load(group=SENSORS))) if locate_shipped_folder().groups() else Catalog(())
    counts, total = catalog.count("group", "verdict"), catalog.count("verdict")
    rows = [_row(name, [counts.get((name, verdict), 0) for verdict in VERDICTS]) for name in catalog.values("group")]
    return markdown(HEADS, [*rows, _row("all", [total.get((verdict,), 0) for verdict in VERDICTS])], 1)


def _row(name: str, counts: Sequence[int]) -> list[str]:
    return [name, f"{sum(counts):,}", *(f"{count:,}" for count in counts)]
