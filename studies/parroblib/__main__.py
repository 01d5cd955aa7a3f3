"""``python -m parroblib``, from ``studies/``: compare published tables with what is computed (``audit``), build entries
of the catalog from them (``build``), or write one of their robots to a file (``robot``)."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from hrsynth.catalog.build import build, check
from hrsynth.cli.progress import Progress
from hrsynth.description import save
from hrsynth.errors import BadRequest, CatalogStale, HrsynthError
from hrsynth.present.text.catalog import describe_built

from .entries import mechanism, published_robot, published_words
from .report import describe_audit
from .run import audit


def compare(asked: argparse.Namespace) -> None:
    """Compare tables with what is computed, and print what differs."""
    if asked.output is not None and Path(asked.output).suffix != ".jsonl":
        raise BadRequest("records are kept one per line", asked.output, "a file that ends in .jsonl")
    with Progress(counted=True) as progress:
        found = audit(
            asked.tables,
            only=asked.only,
            sample=asked.sample,
            seed=asked.seed,
            kept=asked.output,
            tell=lambda _, done, total: progress.count("robots", done, total),
        ).to_dict()
    for defect in found["defects"]:
        print(f"parroblib: {defect}", file=sys.stderr)
    print(json.dumps(found, ensure_ascii=False, indent=2) if asked.json else describe_audit(found))


def make_entries(asked: argparse.Namespace) -> None:
    """Build entries of the catalog, or compare those that are stored with what would be built."""
    source = published_words(asked.tables)
    with Progress(counted=True) as progress:
        if asked.check:
            stale = check(
                asked.output,
                asked.groups,
                source=source,
                workers=asked.workers,
                sample=asked.sample,
                seed=asked.seed,
                tell=progress.count,
            )
        else:
            built = build(asked.output, asked.groups, source=source, workers=asked.workers, tell=progress.count)
    if asked.check and stale:
        raise CatalogStale(stale)
    print("not stale" if asked.check else describe_built([each.to_dict() for each in built]))


def write_robot(asked: argparse.Namespace) -> None:
    """Write a robot of the tables, with the dimensions of its entry."""
    for warning in save(mechanism(published_robot(asked.tables, asked.name)), asked.output):
        print(f"parroblib: {warning}", file=sys.stderr)


def parser() -> argparse.ArgumentParser:
    """The command line of the study."""
    found = argparse.ArgumentParser("parroblib", description=__doc__)
    commands = found.add_subparsers(required=True)
    one = commands.add_parser("audit", help="compare tables with what is computed")
    one.set_defaults(run=compare)
    one.add_argument("tables", help="a folder with chains/, robots/ and synthesis/")
    one.add_argument("-o", "--output", help="keep the records in this .jsonl, and go on from them")
    one.add_argument("--only", help="one group of the tables, such as 3T1R")
    one.add_argument("--json", action="store_true")
    two = commands.add_parser("build", help="build entries of the catalog")
    two.set_defaults(run=make_entries)
    two.add_argument("tables")
    two.add_argument("groups", nargs="*", help="groups (default: all)")
    two.add_argument("-o", "--output", required=True, help="a folder, or a file that ends in .sqlite")
    two.add_argument("--workers", type=int, default=1)
    two.add_argument("--check", action="store_true", help="build nothing: exit 3 if what is stored is stale")
    for each in (one, two):
        each.add_argument("--sample", type=int, help="only so many robots of each group, drawn at random")
        each.add_argument("--seed", type=int, default=0)
    three = commands.add_parser("robot", help="write one robot to a file")
    three.set_defaults(run=write_robot)
    three.add_argument("tables")
    three.add_argument("name", help="such as P4RPRRR8V1G1P3")
    three.add_argument("-o", "--output", required=True, help=".urdf, or another format")
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; the exit status."""
    asked = parser().parse_args(arguments)
    try:
        asked.run(asked)
    except HrsynthError as error:
        print(*(f"parroblib: {line}" for line in error.lines()), sep="\n", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
