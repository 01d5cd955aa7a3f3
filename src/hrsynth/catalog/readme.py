"""The table of the catalog; ``python -m hrsynth.catalog.readme docs/pages/catalog.md`` writes it between its marks."""

from __future__ import annotations

import sys
from pathlib import Path

from ..analysis.verdict import BLIND, CONTROLLABLE, PARTIAL
from ..present.readme import replaced
from .query import Catalog, load
from .store import shipped
from .words import SENSORS

START = "<!-- generated: catalog -->"
VERDICTS = (CONTROLLABLE, PARTIAL, BLIND, None)
HEADS = ("group", "architectures", "controllable", "partially controllable", "uncontrollable", "refused")


def table(catalog: Catalog | None = None) -> str:
    """The Markdown table of how many architectures of each group have which verdict (default: of what is shipped)."""
    if catalog is None:
        catalog = Catalog((*load(), *load(group=SENSORS))) if shipped().groups() else Catalog(())
    lines = [_line(HEADS), "|".join(["", " --- ", *(" ---: " for _ in HEADS[1:]), ""])]
    for group, in catalog.count("group"):
        lines.append(_row(str(group), catalog.where(group=group)))
    return "\n".join([*lines, _row("all", catalog)]) + "\n"


def _row(name: str, catalog: Catalog) -> str:
    counts = catalog.count("verdict")
    return _line([name, f"{len(catalog):,}", *(f"{counts.get((verdict,), 0):,}" for verdict in VERDICTS)])


def _line(cells: tuple[str, ...] | list[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        file = Path(argument)
        text = replaced(file.read_text(encoding="utf-8"), table(), START)
        file.write_text(text, encoding="utf-8", newline="\n")
