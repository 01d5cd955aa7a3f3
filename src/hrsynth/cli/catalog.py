"""The commands of the catalog: build, list, show, site.

Their records, besides ``command`` ("catalog build" …) and ``version``: ``build`` gives ``groups``, each with
``group``, ``words``, ``now`` (made), ``before`` and ``file`` (null while it is not complete), with ``--check`` instead
``stale``, one text for each thing; ``list`` gives ``total`` and ``entries``; ``show`` gives ``entry``, ``drawing``
(lines), ``note`` and ``file``; ``site`` as told by ``catalog site --help``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .options import Filter, Json, unfolded
from .progress import Meter

catalog = typer.Typer(name="catalog", invoke_without_command=True, rich_markup_mode=None,
                      help="The catalog of architectures: what can be controlled by watching legs.")

Kept = Annotated[str | None, typer.Option("--catalog", metavar="PATH", help="A folder or SQLite file (default: what is "
                                          "shipped).")]

Workers = Annotated[int, typer.Option(min=1, help="Processes that share the work.")]


@catalog.callback()
def _alone(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@catalog.command()
def build(
    groups: Annotated[list[str] | None, typer.Argument(metavar="[GROUP]...", help="Groups (default: all).")] = None,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="PATH", help="A folder, or a file that ends "
                                               "in .sqlite (default: catalog/ of the checkout).")] = None,
    workers: Workers = 1,
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
    _require_together(check, {"--sample": sample is not None}, {"--limit": limit is not None, "--anew": anew})
    if check:
        _check(groups or [], output, workers, cluster, sample, seed, json)
        return
    from ..catalog.build import build as run
    from ..present import records
    from ..present.text.catalog import built

    target = _target(output)
    with Meter() as meter:
        done = [each.to_dict() for each in run(target, groups or [], workers=workers, cluster=cluster, limit=limit,
                                               anew=anew, tell=meter.tell)]
    typer.echo(records.record("catalog build", None, {"groups": done}) if json else built(done))


def _require_together(check: bool, with_it: dict[str, bool], without: dict[str, bool]) -> None:
    """Raise ``BadRequest`` for options that mean nothing with, or without, ``--check``."""
    from ..errors import BadRequest

    for option, given in (without if check else with_it).items():
        if given:
            raise BadRequest(f"{option} {'with' if check else 'without'} --check", None)


def _check(groups: list[str], target: str | None, workers: int, cluster: str | None, sample: int | None, seed: int,
           json: bool) -> None:
    from ..catalog.check import check
    from ..catalog.store import shipped
    from ..errors import CatalogStale
    from ..present import records

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
@unfolded
def list_(
    fits: Filter,
    kept: Kept = None,
    json: Json = False,
) -> None:
    """The architectures that fit."""
    from ..catalog import load
    from ..present import records
    from ..present.text.catalog import entries

    every = load(kept)
    found = every.where(**fits.asked())
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
    from ..catalog.drawing import drawing
    from ..catalog.words import parse
    from ..description import save, targets
    from ..present import records
    from ..present.text.catalog import entry

    architecture = parse(word)
    if output is not None:
        targets(output)
    record, note = _known(str(architecture), kept)
    if output is not None:
        from ..catalog.geometry import mechanism

        for warning in save(mechanism(architecture, record.get("attempt", 0)), output):
            typer.echo(f"hrsynth: {warning}", err=True)
    drawn = drawing(architecture)
    if json:
        fields = {"entry": dict(record), "drawing": drawn.splitlines(), "note": note or None, "file": output}
        typer.echo(records.record("catalog show", None, fields))
    else:
        typer.echo(entry(record, drawn, note, output))


@catalog.command()
@unfolded
def site(
    output: Annotated[str, typer.Option("-o", "--output", metavar="DIR", help="A new or empty folder, or an older "
                                        "site, which is replaced.")],
    fits: Filter,
    workers: Workers = 1,
    anew: Annotated[bool, typer.Option("--anew", help="Forget what a build that was broken off has made.")] = False,
    kept: Kept = None,
    json: Json = False,
) -> None:
    """Pages of the architectures that fit: a list that filters, drawings, derivations, robot files; needs no server."""
    from ..catalog import load
    from ..catalog.site import site as run
    from ..present import records
    from ..present.text.catalog import sited

    found = load(kept, **fits.asked())
    with Meter() as meter:
        done = run(found, output, workers=workers, anew=anew, tell=meter.tell)
    if done.differ:
        word, derived = done.differ[0]
        typer.echo(f"hrsynth: {len(done.differ)} derivations do not end in what the catalog says, the first: {word}, "
                   f"derived {derived}", err=True)
    typer.echo(records.record("catalog site", None, done.to_dict()) if json else sited(done.to_dict()))


def _known(word: str, kept: str | None) -> tuple[Any, str]:
    """The record of a word, and where it comes from if not from the catalog."""
    from ..catalog import load
    from ..catalog.groups import group
    from ..catalog.source import architectures, made
    from ..catalog.store import shipped
    from ..catalog.words import parse

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

    from ..errors import BadRequest

    if output is None and not (Path("catalog").is_dir() and Path("pyproject.toml").is_file()):
        raise BadRequest("nowhere to build", None, "-o FOLDER or -o FILE.sqlite")
    target = Path(output or "catalog")
    package = Path(str(resources.files("hrsynth"))).resolve()
    if target.resolve().is_relative_to(package):
        raise BadRequest("cannot build into the package", str(target), "another folder")
    return target
