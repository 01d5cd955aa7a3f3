"""Commands on poses of a robot: check, singular, modes, path."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import Camera, Json, Observe, Seed, Source, Start, listed
from .progress import Progress


def check(
    observe: Observe = "all",
    camera: Camera = None,
    at: Annotated[list[str] | None, typer.Option(metavar="POSE", help="A pose, such as x=0.02,y=0.1,z=-0.7,phi=10deg; "
                                                 "again for more (default: the zero configuration).")] = None,
    grid: Annotated[str | None, typer.Option(metavar="GRID", help="A line, plane or box of poses, such as "
                                             "x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 (from:to:count).")] = None,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the grid: map.png, "
                                               "map.csv.")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """Mobility, ranks, singularities and redundant constraints at poses, and over a grid of poses."""
    from ..analysis.check import check as run
    from ..errors import RankUndecided
    from ..present import maps, records
    from ..present.text.check import check as written
    from ..tolerances import RANK_GAP

    if output is not None:
        maps.writable(output, grid)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, at=at or (), grid=grid, seed=seed, progress=progress.tell)
    if output is not None and found.grid is not None:
        maps.write(found, output)
    typer.echo(records.record("check", found.setting.robot.name, found.to_dict()) if json else written(found))
    for posture in found.postures if at else ():
        if not posture.decided:
            raise RankUndecided(f"{found.setting.robot.name} at {posture.pose}", posture.gap, RANK_GAP)


def singular(
    observe: Observe = "all",
    camera: Camera = None,
    real: Annotated[bool, typer.Option("--real", help="The real robot with its own motors instead of the hidden one.")]
    = False,
    plane: Annotated[str | None, typer.Option(metavar="PART=VALUE", help="Plane of poses to draw, as z=-0.7.")] = None,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the locus (.png).")] = None,
    points: Annotated[int, typer.Option(min=1, help="Random poses at which the condition is checked.")] = 10_000,
    steps: Annotated[int, typer.Option(min=5, max=300, help="Poses a side of the drawn plane.")] = 51,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """Where a freedom of the platform is lost: the Type 2 condition in words, as an expression and drawn."""
    from ..analysis.singularity.singular import drawn
    from ..analysis.singularity.singular import singular as run
    from ..present import loci, records
    from ..present.text.singularity import singularity

    loci.writable(output, plane)
    mechanism = robot.load()
    with Progress() as progress:
        picture = None
        if output is not None:
            picture = drawn(mechanism, listed(observe), camera, plane=plane, steps=steps, seed=seed,
                            progress=progress.tell)
        found = run(mechanism, listed(observe), camera, real=real, points=points, seed=seed, progress=progress.tell)
        if picture is not None and output is not None:
            loci.write(found, picture, output)
    if json:
        fields = {**found.to_dict(), "locus": None if picture is None else picture.to_dict(), "file": output}
        typer.echo(records.record("singular", mechanism.name, fields))
    else:
        typer.echo(singularity(found, output))


def modes(
    at: Annotated[str | None, typer.Option("--at", metavar="POSE", help="Pose whose directions are held, as "
                                           "x=0.02,y=0.1,z=-0.7 (default: the zero configuration's).")] = None,
    observe: Observe = "all",
    camera: Camera = None,
    real: Annotated[bool, typer.Option("--real", help="The real robot with its own motors held instead.")] = False,
    as_written: Annotated[bool, typer.Option("--as-written", help="Take the file's numbers as they are: joint centres "
                                             "that coincide but for rounding stay apart.")] = False,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the modes (.png).")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """All assembly modes: every pose of the platform with the same directions, each proved."""
    from ..analysis.modes.modes import modes as run
    from ..present import modes as pictures
    from ..present import records
    from ..present.text.modes import modes

    pictures.writable(output)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, at=at, real=real, as_written=as_written,
                    seed=seed, progress=progress.tell)
    why = pictures.nothing(found)
    if output is not None and why is not None:
        typer.echo(f"hrsynth: {output} is not drawn: {why}", err=True)
        output = None
    if output is not None:
        pictures.write(found, output)
    if json:
        typer.echo(records.record("modes", found.setting.robot.name, {**found.to_dict(), "file": output}))
    else:
        typer.echo(modes(found, output))


def path(
    start: Start,
    goal: Annotated[str, typer.Option("--to", metavar="POSE", help="Where it ends.")],
    observe: Observe = "all",
    camera: Camera = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """Whether a path without Type 2 singularity joins two poses, with a proof: same aspect, separated, undecided."""
    from ..analysis.aspects.path import path as run
    from ..present import records
    from ..present.text.aspects import path as written

    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, start=start, goal=goal, seed=seed, progress=progress.tell)
    typer.echo(records.record("path", found.setting.robot.name, found.to_dict()) if json else written(found))
