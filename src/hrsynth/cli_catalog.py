"""The commands of the catalog: build, list, show."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Annotated, Any

import typer

catalog = typer.Typer(name="catalog", no_args_is_help=True, rich_markup_mode=None,
                      help="The catalog of architectures: what can be controlled by watching legs.")

Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]
Kept = Annotated[str | None, typer.Option("--catalog", metavar="PATH", help="A folder or SQLite file (default: what is "
                                          "shipped).")]


@catalog.command()
def build(
    groups: Annotated[list[str] | None, typer.Argument(metavar="[GROUP]...", help="Groups (default: all).")] = None,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="PATH", help="A folder, or a file that ends "
                                               "in .sqlite (default: catalog/ of the checkout).")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes that share the work.")] = 1,
    cluster: Annotated[str | None, typer.Option(metavar="ADDRESS", help="A dask cluster that shares it.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Build nothing: compare what is stored (default: what is "
                                        "shipped) with what would be built; exit 3 if it is stale.")] = False,
    sample: Annotated[int | None, typer.Option(min=0, metavar="N", help="With --check: compare so many records of each "
                                               "group, drawn at random, and all words.")] = None,
    limit: Annotated[int | None, typer.Option(min=0, metavar="N", help="Make so many new records and stop; the same "
                                              "command goes on.")] = None,
    anew: Annotated[bool, typer.Option("--anew", help="Forget what a build that was broken off has made.")] = False,
    json: Json = False,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of --sample.")] = 0,
) -> None:
    """Build the catalog, or go on where a build was broken off; the bytes do not depend on who builds."""
    if check:
        _check(groups or [], output, workers, cluster, sample, seed, json)
        return
    from .catalog.build import build as run
    from .present import records
    from .present.text.catalog import built

    target = _target(output)
    with Meter() as meter:
        done = [each.to_dict() for each in run(target, groups or [], workers=workers, cluster=cluster, limit=limit,
                                               anew=anew, tell=meter.tell)]
    typer.echo(records.record("catalog build", None, {"groups": done}) if json else built(done))


def _check(groups: list[str], target: str | None, workers: int, cluster: str | None, sample: int | None, seed: int,
           json: bool) -> None:
    from .catalog.check import check
    from .catalog.store import shipped
    from .errors import CatalogStale
    from .present import records

    with Meter() as meter:
        stale = check(target or shipped(), groups, workers=workers, cluster=cluster, sample=sample, seed=seed,
                      tell=meter.tell)
    if json:
        typer.echo(records.record("catalog build", None, {"stale": stale}))
    if stale:
        raise CatalogStale(stale)
    if not json:
        typer.echo("not stale")


@catalog.command("list")
def list_(
    legs: Annotated[str | None, typer.Option(metavar="LEGS", help="Number of legs, or a pattern of the notation or of "
                                             "one leg's chain: 3-R*, PUS.")] = None,
    dof: Annotated[int | None, typer.Option(help="Freedoms of the platform.")] = None,
    motion: Annotated[str | None, typer.Option(help="Its translations and turns, as 3T or 2T1R.")] = None,
    verdict: Annotated[str | None, typer.Option(help="controllable, partially controllable, uncontrollable.")] = None,
    group: Annotated[str | None, typer.Option(help="planar, pods, deltas, spatial.")] = None,
    base_motors: Annotated[bool | None, typer.Option("--base-motors/--moving-motors", help="All motors on the base, or "
                                                     "not.")] = None,
    fewest: Annotated[int | None, typer.Option(help="Legs to watch to see all that can be seen.")] = None,
    text: Annotated[str | None, typer.Option(help="What occurs in any field.")] = None,
    kept: Kept = None,
    json: Json = False,
) -> None:
    """The architectures that fit."""
    from .catalog import load
    from .present import records
    from .present.text.catalog import entries

    asked = {"legs": legs, "dof": dof, "motion": motion, "verdict": verdict, "group": group, "base_motors": base_motors,
             "fewest": fewest, "text": text}
    every = load(kept)
    found = every.where(**asked)
    if json:
        fields = {"total": len(every), "entries": [dict(each) for each in found]}
        typer.echo(records.record("catalog list", None, fields))
    else:
        typer.echo(entries(found.records, len(every)))


@catalog.command()
def show(
    word: Annotated[str, typer.Argument(metavar="WORD", help="An architecture, as '3(Rz*-Rz-Rz)'.")],
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write a robot of this "
                                               "architecture (.urdf, or another dialect).")] = None,
    kept: Kept = None,
    json: Json = False,
) -> None:
    """One architecture, drawn and in full; one that is not in the catalog is studied now."""
    from .catalog.drawing import drawing
    from .catalog.words import parse
    from .description import save, targets
    from .present import records
    from .present.text.catalog import entry

    architecture = parse(word)
    if output is not None:
        targets(output)
    record, note = _known(str(architecture), kept)
    if output is not None:
        from .catalog.geometry import mechanism

        for warning in save(mechanism(architecture, record.get("attempt", 0)), output):
            typer.echo(f"hrsynth: {warning}", err=True)
    drawn = drawing(architecture)
    if json:
        fields = {"entry": dict(record), "drawing": drawn.splitlines(), "note": note or None, "file": output}
        typer.echo(records.record("catalog show", None, fields))
    else:
        typer.echo(entry(record, drawn, note, output))


def _known(word: str, kept: str | None) -> tuple[Any, str]:
    """The record of a word, and where it comes from if not from the catalog."""
    from .catalog import load
    from .catalog.groups import group
    from .catalog.source import architectures, made
    from .catalog.store import shipped
    from .catalog.words import parse

    if kept is not None or shipped().groups():
        found = load(kept)
        if word in found:
            return found[word], ""
    import json

    source = architectures()
    ((_, line),) = made(source.entry, group(parse(word)), [word])
    return json.loads(line), "not in the catalog, studied now"


def _target(output: str | None) -> Path:
    """Where to build: what was named, or ``catalog/`` of the checkout; never an installed package."""
    from importlib import resources

    from .errors import BadRequest

    if output is None and not (Path("catalog").is_dir() and Path("pyproject.toml").is_file()):
        raise BadRequest("nowhere to build", None, "-o FOLDER or -o FILE.sqlite")
    target = Path(output or "catalog")
    package = Path(str(resources.files("hrsynth"))).resolve()
    if target.resolve().is_relative_to(package):
        raise BadRequest("cannot build into the package", str(target), "another folder")
    return target


class Meter:
    """A bar with the time left on standard error once a build has taken a second; nothing where that is no terminal."""

    SPEED_OVER = 600.0
    """Seconds over which the speed is averaged: words differ much."""

    def __init__(self, wait: float = 1.0) -> None:
        self._start = time.monotonic() + wait
        self._bar: Any = None
        self._groups: dict[str, tuple[int, int]] = {}

    def __enter__(self) -> Meter:
        return self

    def tell(self, group: str, done: int, total: int) -> None:
        """So many records of a group are there."""
        self._groups[group] = done, total
        if self._bar is None and time.monotonic() > self._start and sys.stderr.isatty():
            self._bar = self._started()
        if self._bar is not None:
            there, every = map(sum, zip(*self._groups.values(), strict=True))
            self._bar.update(self._bar.task_ids[0], description=group, completed=there, total=every)

    def _started(self) -> Any:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        bar = Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
                       TextColumn("left"), console=Console(stderr=True), transient=True,
                       speed_estimate_period=self.SPEED_OVER)
        bar.start()
        bar.add_task("", total=None, completed=sum(done for done, _ in self._groups.values()))
        return bar

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()
