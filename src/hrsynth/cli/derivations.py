"""Commands on what a camera sees of a robot at all: derive, legs, advise."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import Camera, Json, Observe, Seed, Source, listed
from .progress import Progress


def derive(
    observe: Observe = "all",
    camera: Camera = None,
    at: Annotated[str | None, typer.Option("--at", metavar="POSE", help="Start there instead of at the zero "
                                           "configuration, in another operation mode if need be.")] = None,
    form: Annotated[str, typer.Option(help="simplified (as in the paper) or general (sliders, all legs kept).")]
    = "simplified",
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the hidden robot.")]
    = None,
    report: Annotated[str | None, typer.Option("--report", metavar="FILE", help="Write a page (.html) with drawings, "
                                               "proof, singularities, assembly modes and accuracy.")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """The hidden robot of a robot, how it is derived, its certificate, and what the controller can see."""
    from ..analysis.derive import derive as run
    from ..description import save, targets
    from ..present import records
    from ..present.report import pages
    from ..present.text.verdicts import derivation

    if output is not None:
        targets(output)
    pages.writable(report)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, at=at, form=form, seed=seed,
                    progress=progress.tell)
        if report is not None:
            robot.require_other(found.robot, report)
            page = pages.report(found, listed(observe), camera, seed=seed, progress=progress.tell)
    written = None
    if output is not None and found.hidden is not None:
        robot.require_other(found.robot, output)
        save(found.hidden, output)
        written = output
    if report is not None:
        pages.write(page, report)
    if json:
        fields = {**found.to_dict(), "hidden_file": written, "report_file": report}
        typer.echo(records.record("derive", found.robot.name, fields))
    else:
        typer.echo(derivation(found, written, report))
    if output is not None and found.hidden is None:
        typer.echo("hrsynth: nothing was written: every leg is blind, there is no hidden robot", err=True)


def legs(
    camera: Camera = None,
    at: Annotated[str | None, typer.Option("--at", metavar="POSE", help="Start there instead of at the zero "
                                           "configuration, in another operation mode if need be.")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """Every set of observed legs: its verdict, the freedoms it loses, and the smallest sets that see most."""
    from ..analysis.controllability import legs as run
    from ..present import records
    from ..present.text.verdicts import legs as written

    with Progress() as progress:
        found = run(robot.load(), camera, at=at, seed=seed, progress=progress.tell)
    typer.echo(records.record("legs", found.robot, found.to_dict()) if json else written(found))


def advise(
    observe: Observe = "all",
    camera: Camera = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """What is missing: the smallest sets of further measurements that make a robot controllable."""
    from ..analysis.advice import advise as run
    from ..present import records
    from ..present.text.advice import advice

    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, seed=seed, progress=progress.tell)
    typer.echo(records.record("advise", found.robot, found.to_dict()) if json else advice(found))
