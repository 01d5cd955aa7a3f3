"""What the catalog says of published robots; ``python -m parroblib.says`` writes the tables of README.md between their
marks (from ``studies/``, with ``docs/`` on the path of Python)."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from hrsynth.analysis.verdict import CONTROLLABLE
from hrsynth.catalog.query import Catalog, load
from tables.architectures import VERDICTS, share, studied, written
from tables.markdown import table

from .tables import ROBOT

PAGE = Path(__file__).with_name("README.md")
BASES = (
    "z up",
    "tangential",
    "radial",
    "on a cone",
    "z up, in pairs",
    "tangential, in pairs",
    "radial, in pairs",
    "on a cone, in pairs",
    "all along one line of the base's plane",
    "all normal to the base's plane",
)
"""Couplings to the base, from G1 on, by where the axes of the legs' first joints lie."""


def published(catalog: Catalog) -> str:
    """Verdicts of published robots by the motion that their tables state, and how many of them are not exact."""
    rows = []
    for (group,) in catalog.count("group"):
        every = list(catalog.where(group=group))
        found = studied(Catalog(tuple(every)))
        legs = Counter(each["fewest"] for each in found if each["verdict"] == CONTROLLABLE)
        rows.append(
            (
                group,
                f"{len(every):,}",
                *(f"{sum(each['verdict'] == v for each in found):,}" for v in VERDICTS),
                f"{len(every) - len(found):,}",
                f"{sum(not each['exact'] for each in found):,}",
                ", ".join(f"{n}: {count:,}" for n, count in sorted(legs.items())),
                f"{sum('modes_bound' in each for each in found):,}",
            )
        )
    return table(
        (
            "group",
            "robots",
            *VERDICTS,
            "refused",
            "not exact",
            "legs to watch: controllable robots",
            "with a list of modes",
        ),
        rows,
        1,
    )


def couplings(catalog: Catalog) -> str:
    """Verdicts of published robots that move in all ways, by how the first joints of their legs lie on the base."""
    counts: dict[int, Counter[str]] = {}
    for each in studied(catalog.where(group="3T3R")):
        if match := ROBOT.match(each["key"]):
            counts.setdefault(int(match[4]), Counter())[each["verdict"]] += 1
    rows = [
        (BASES[number - 1], f"{sum(found.values()):,}", *(f"{found[v]:,}" for v in VERDICTS), share(found))
        for number, found in sorted(counts.items())
    ]
    return table(("first joints", "robots", *VERDICTS, "% controllable"), rows, 1)


TABLES = {"published": published, "couplings": couplings}


def page() -> str:
    """The page with its tables."""
    return written(PAGE.read_text(encoding="utf-8"), load("published"), TABLES)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
