"""Commands on the servo loop: servo, accuracy, select."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import Camera, Json, Observe, Seed, Source, Start, listed
from .progress import Progress


def servo(
    start: Start,
    goal: Annotated[str, typer.Option("--to", metavar="POSE", help="Pose whose directions are desired.")],
    observe: Observe = "all",
    camera: Camera = None,
    gain: Annotated[float, typer.Option(help="λ of the control law (1/s).")] = 0.8,
    noise: Annotated[str | None, typer.Option(metavar="AMOUNT", help="Error of measured directions, as 0.1deg; of "
                                              "edges, as 0.3px.")] = None,
    bias: Annotated[bool, typer.Option("--bias", help="The error of each direction or edge stays the same all along.")]
    = False,
    duration: Annotated[float | None, typer.Option(metavar="SECONDS", help="Lead the desired directions along the "
                                                   "straight way in this time (default: at once).")] = None,
    time: Annotated[float | None, typer.Option(metavar="SECONDS", help="Longest run.")] = None,
    physics: Annotated[bool, typer.Option("--physics", help="Drive a mock-up with rods, masses and velocity servos.")]
    = False,
    sense: Annotated[str, typer.Option(metavar="SENSE", help="exact, edges (of the legs before a camera) or pictures "
                                       "(rendered).")] = "exact",
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the run: curves (.png) or "
                                               "an animation (.gif).")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """A servo run on the directions of legs, simulated: where it ends, and what it passes on the way."""
    from ..present import records, runs
    from ..present.text.servo import servo as written
    from ..simulation.servo import servo as run

    runs.writable(output)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, start=start, goal=goal, gain=gain, noise=noise,
                    bias=bias, physics=physics, sense=sense, duration=duration, time=time, seed=seed,
                    progress=progress.tell)
    if output is not None:
        runs.write(found, output)
    if json:
        typer.echo(records.record("servo", found.setting.robot.name, {**found.to_dict(), "file": output}))
    else:
        typer.echo(written(found, output))


def accuracy(
    cone: Annotated[str, typer.Option(metavar="ANGLE", help="Half-angle of the cone about each observed direction, "
                                      "as 0.1deg; or one a leg: 1=0.1deg,2=0.2deg.")],
    observe: Observe = "all",
    camera: Camera = None,
    at: Annotated[list[str] | None, typer.Option(metavar="POSE", help="A pose, as x=0.02,y=0.1,z=-0.7; again for more "
                                                 "(default: the zero configuration).")] = None,
    plane: Annotated[str | None, typer.Option(metavar="PART=VALUE", help="Plane of poses, as z=-0.7: all of it that is "
                                              "reached.")] = None,
    grid: Annotated[str | None, typer.Option(metavar="GRID", help="A line, plane or box of poses, such as "
                                             "x=-0.3:0.3:21,y=0,z=-0.7 (from:to:count).")] = None,
    steps: Annotated[int | None, typer.Option(min=5, max=300, help="Poses a side of the plane.")] = None,
    samples: Annotated[int, typer.Option("--nonlinear", min=0, metavar="COUNT", help="Try so many true errors (four "
                                         "at least) at each pose, of a plane or grid at its worst ones.")] = 0,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the plane or grid: "
                                               "map.png, map.csv.")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """How far the platform can be off where the observed directions are off by up to given angles."""
    from ..analysis.accuracy.accuracy import accuracy as run
    from ..present import accuracy as pictures
    from ..present import records
    from ..present.text.accuracy import accuracy as written

    pictures.writable(output, plane or grid)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, cones=cone, at=at or (), plane=plane, grid=grid, steps=steps,
                    samples=samples, seed=seed, progress=progress.tell)
        if output is not None:
            pictures.write(found, output)
    if json:
        typer.echo(records.record("accuracy", found.setting.robot.name, {**found.to_dict(), "file": output}))
    else:
        typer.echo(written(found, output))


def select(
    start: Start,
    goal: Annotated[str, typer.Option("--to", metavar="POSE", help="Where it is to end.")],
    cone: Annotated[str, typer.Option(metavar="ANGLE", help="Half-angle of the cone about each direction, or one a "
                                      "leg: 1=0.1deg,2=0.2deg,…")] = "0.1deg",
    camera: Camera = None,
    size: Annotated[int, typer.Option(min=1, help="Legs of the largest sets.")] = 4,
    runs: Annotated[int, typer.Option(min=0, help="Sets that a simulated run is to lead to the goal, best first.")] = 3,
    sight: Annotated[str | None, typer.Option(metavar="POSE", help="Pose of the camera on the link that carries it (x "
                                              "right, y down, z ahead), as x=0,y=0,z=0.5,rpy=180deg/0/0; or auto.")]
    = None,
    focal: Annotated[float, typer.Option(metavar="PIXELS", help="Focal length of the camera, of 640 by 480 pixels.")]
    = 800.0,
    examine: Annotated[int, typer.Option(min=1, help="Sets, the most accurate first, whose modes, aspects and runs are "
                                         "asked for.")] = 20,
    seconds: Annotated[float | None, typer.Option(help="Deprecated, as the answer then depends on the machine: time "
                                                  "after which no further set is examined.")] = None,
    json: Json = False,
    seed: Seed = 0,
    *,
    robot: Source,
) -> None:
    """Which legs to watch for a displacement: all sets, ranked by accuracy, and why the others are discarded."""
    from ..present import records
    from ..present.text.selection import selection as written
    from ..selection.select import select as run

    with Progress() as progress:
        found = run(robot.load(), camera, start=start, goal=goal, cones=cone, size=size, runs=runs, sight=sight,
                    focal=focal, examine=examine, seconds=seconds, seed=seed, progress=progress.tell)
    if seconds is not None:
        typer.echo("hrsynth: --seconds is deprecated, what it leaves out depends on the machine: try --examine",
                   err=True)
    typer.echo(records.record("select", found.setting.robot.name, found.to_dict()) if json else written(found))
