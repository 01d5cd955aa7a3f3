"""The command line: thin. Text to standard output, progress and warnings to standard error; exit status 0, 2 or 3."""

from __future__ import annotations

import gc
import inspect
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .cli_catalog import catalog

if TYPE_CHECKING:
    from .mechanism import Mechanism

app = typer.Typer(
    name="hrsynth", invoke_without_command=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Hidden robots of parallel robots that are controlled by watching the directions of their legs.")
app.add_typer(catalog)

ROBOT = typer.Argument(metavar="ROBOT", help="A robot file in any dialect, or the name of a shipped robot.")
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]
Observe = Annotated[str, typer.Option("--observe", metavar="LEGS", help="Legs to watch (1,4), links, or all.")]
Camera = Annotated[str | None, typer.Option("--camera", metavar="LINK", help="The link that carries the camera.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random configurations.")]


@dataclass(frozen=True)
class Source:
    """A robot as the command line names it, with what its file does not say."""

    robot: str
    base: str | None = None
    platform: str | None = None
    motors: str | None = None
    close: tuple[str, ...] = ()
    freeze: str = ""

    def load(self) -> Mechanism:
        """The mechanism; what was guessed or solved goes to standard error, a line each."""
        from .description import load

        frozen = [name for name in self.freeze.split(",") if name]
        mechanism = load(self.robot, base=self.base, platform=self.platform, motors=self.motors, close=self.close,
                         freeze=frozen)
        for note in mechanism.notes:
            typer.echo(f"hrsynth: {note}", err=True)
        return mechanism


_GIVEN: dict[str, tuple[object, object]] = {
    "base": (Annotated[str | None, typer.Option(metavar="LINK", help="Look only at what lies between this link and the "
                                                "platform.")], None),
    "platform": (Annotated[str | None, typer.Option(metavar="LINK", help="The platform, where the file names none.")],
                 None),
    "motors": (Annotated[str | None, typer.Option(metavar="JOINTS", help="The driven joints, where the file names "
                                                  "none.")], None),
    "close": (Annotated[list[str] | None, typer.Option(metavar="A:B[:TYPE]", help="A closure: the frames of two links "
                                                       "meet (default: in a point); again for more.")], None),
    "freeze": (Annotated[str, typer.Option(metavar="JOINTS", help="Joints to hold at zero.")], ""),
}
"""Options of every command that takes a robot: annotation and default."""


def _of_robot(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that complete a robot file; it receives them with the name as one ``Source``."""
    signature = inspect.signature(command, eval_str=True)
    parameters = [each.replace(annotation=Annotated[str, ROBOT]) if name == "robot" else each
                  for name, each in signature.parameters.items()]
    parameters += [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
                   for name, (annotation, default) in _GIVEN.items()]

    def run(*, robot: str, close: list[str] | None, **rest: Any) -> None:
        given = {name: rest.pop(name) for name in _GIVEN if name != "close"}
        command(robot=Source(robot, close=tuple(close or ()), **given), **rest)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run


def _version(wanted: bool) -> None:
    if wanted:
        from . import __version__

        typer.echo(f"hrsynth {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")]
    = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command()
@_of_robot
def derive(
    robot: Source,
    observe: Observe = "all",
    camera: Camera = None,
    form: Annotated[str, typer.Option(help="simplified (as in the paper) or general (sliders, all legs kept).")]
    = "simplified",
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the hidden robot.")]
    = None,
    report: Annotated[str | None, typer.Option("--report", metavar="FILE", help="Write a page (.html) with drawings, "
                                               "proof, singularities, assembly modes and accuracy.")] = None,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """The hidden robot of a robot, how it is derived, its certificate, and what the controller can see."""
    from .analysis.derive import derive as run
    from .description import save, targets
    from .present import records
    from .present.report import pages
    from .present.text.verdicts import derivation

    if output is not None:
        targets(output)
    pages.writable(report)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, form=form, seed=seed, progress=progress.tell)
        if report is not None:
            _other_than(robot, found.robot, report)
            page = pages.report(found, _list(observe), camera, seed=seed, progress=progress.tell)
    written = None
    if output is not None and found.hidden is not None:
        _other_than(robot, found.robot, output)
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


@app.command()
@_of_robot
def legs(robot: Source, camera: Camera = None, json: Json = False, seed: Seed = 0) -> None:
    """Every set of observed legs: its verdict, the freedoms it loses, and the smallest sets that see most."""
    from .analysis.controllability import legs as run
    from .present import records
    from .present.text.verdicts import legs as written

    with Progress() as progress:
        found = run(robot.load(), camera, seed=seed, progress=progress.tell)
    typer.echo(records.record("legs", found.robot, found.to_dict()) if json else written(found))


@app.command()
@_of_robot
def check(
    robot: Source,
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
) -> None:
    """Mobility, ranks, singularities and redundant constraints at poses, and over a grid of poses."""
    from .analysis.check import check as run
    from .errors import RankUndecided
    from .present import maps, records
    from .present.text.check import check as written
    from .tolerances import RANK_GAP

    if output is not None:
        maps.writable(output, grid)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, at=at or (), grid=grid, seed=seed, progress=progress.tell)
    if output is not None and found.grid is not None:
        maps.write(found, output)
    typer.echo(records.record("check", found.setting.robot.name, found.to_dict()) if json else written(found))
    for posture in found.postures if at else ():
        if not posture.decided:
            raise RankUndecided(f"{found.setting.robot.name} at {posture.pose}", posture.gap, RANK_GAP)


@app.command()
@_of_robot
def singular(
    robot: Source,
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
) -> None:
    """Where a freedom of the platform is lost: the Type 2 condition in words, as an expression and drawn."""
    from .analysis.singularity.singular import drawn
    from .analysis.singularity.singular import singular as run
    from .present import loci, records
    from .present.text.singularity import singularity

    loci.writable(output, plane)
    mechanism = robot.load()
    with Progress() as progress:
        picture = None
        if output is not None:
            picture = drawn(mechanism, _list(observe), camera, plane=plane, steps=steps, seed=seed,
                            progress=progress.tell)
        found = run(mechanism, _list(observe), camera, real=real, points=points, seed=seed, progress=progress.tell)
        if picture is not None and output is not None:
            loci.write(found, picture, output)
    if json:
        fields = {**found.to_dict(), "locus": None if picture is None else picture.to_dict(), "file": output}
        typer.echo(records.record("singular", mechanism.name, fields))
    else:
        typer.echo(singularity(found, output))


@app.command()
@_of_robot
def advise(
    robot: Source,
    observe: Observe = "all",
    camera: Camera = None,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """What is missing: the smallest sets of further measurements that make a robot controllable."""
    from .analysis.advice import advise as run
    from .present import records
    from .present.text.advice import advice

    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, seed=seed, progress=progress.tell)
    typer.echo(records.record("advise", found.robot, found.to_dict()) if json else advice(found))


@app.command()
@_of_robot
def modes(
    robot: Source,
    at: Annotated[str | None, typer.Option("--at", metavar="POSE", help="Pose whose directions are held, as "
                                           "x=0.02,y=0.1,z=-0.7 (default: the zero configuration's).")] = None,
    observe: Observe = "all",
    camera: Camera = None,
    real: Annotated[bool, typer.Option("--real", help="The real robot with its own motors held instead.")] = False,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the modes (.png).")] = None,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """All assembly modes: every pose of the platform with the same directions, each proved."""
    from .analysis.modes.modes import modes as run
    from .present import modes as pictures
    from .present import records
    from .present.text.modes import modes

    pictures.writable(output)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, at=at, real=real, seed=seed, progress=progress.tell)
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


@app.command()
@_of_robot
def path(
    robot: Source,
    start: Annotated[str, typer.Option("--from", metavar="POSE", help="Where it starts, as x=0.02,y=0.1,z=-0.7.")],
    goal: Annotated[str, typer.Option("--to", metavar="POSE", help="Where it ends.")],
    observe: Observe = "all",
    camera: Camera = None,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """Whether a path without Type 2 singularity joins two poses, with a proof: same aspect, separated, undecided."""
    from .analysis.aspects.path import path as run
    from .present import records
    from .present.text.aspects import path as written

    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, start=start, goal=goal, seed=seed, progress=progress.tell)
    typer.echo(records.record("path", found.setting.robot.name, found.to_dict()) if json else written(found))


@app.command()
@_of_robot
def servo(
    robot: Source,
    start: Annotated[str, typer.Option("--from", metavar="POSE", help="Where it starts, as x=0.02,y=0.1,z=-0.7.")],
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
) -> None:
    """A servo run on the directions of legs, simulated: where it ends, and what it passes on the way."""
    from .present import records, runs
    from .present.text.servo import servo as written
    from .servo.servo import servo as run

    runs.writable(output)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, start=start, goal=goal, gain=gain, noise=noise,
                    bias=bias, physics=physics, sense=sense, duration=duration, time=time, seed=seed,
                    progress=progress.tell)
    if output is not None:
        runs.write(found, output)
    if json:
        typer.echo(records.record("servo", found.setting.robot.name, {**found.to_dict(), "file": output}))
    else:
        typer.echo(written(found, output))


@app.command()
@_of_robot
def accuracy(
    robot: Source,
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
    samples: Annotated[int, typer.Option("--nonlinear", min=0, metavar="COUNT", help="Try so many true errors at each "
                                         "pose, of a plane or grid at its worst ones.")] = 0,
    output: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write the plane or grid: "
                                               "map.png, map.csv.")] = None,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """How far the platform can be off where the observed directions are off by up to given angles."""
    from .analysis.accuracy.accuracy import accuracy as run
    from .present import accuracy as pictures
    from .present import records
    from .present.text.accuracy import accuracy as written

    pictures.writable(output, plane or grid)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, cones=cone, at=at or (), plane=plane, grid=grid, steps=steps,
                    samples=samples, seed=seed, progress=progress.tell)
        if output is not None:
            pictures.write(found, output)
    if json:
        typer.echo(records.record("accuracy", found.setting.robot.name, {**found.to_dict(), "file": output}))
    else:
        typer.echo(written(found, output))


@app.command()
@_of_robot
def select(
    robot: Source,
    start: Annotated[str, typer.Option("--from", metavar="POSE", help="Where it starts, as x=0.02,y=0.1,z=-0.7.")],
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
    seconds: Annotated[float, typer.Option(help="Time after which nothing more is asked.")] = 45.0,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """Which legs to watch for a displacement: all sets, ranked by accuracy, and why the others are discarded."""
    from .present import records
    from .present.text.selection import selection as written
    from .selection.select import select as run

    with Progress() as progress:
        found = run(robot.load(), camera, start=start, goal=goal, cones=cone, size=size, runs=runs, sight=sight,
                    focal=focal, seconds=seconds, seed=seed, progress=progress.tell)
    typer.echo(records.record("select", found.setting.robot.name, found.to_dict()) if json else written(found))


@app.command()
@_of_robot
def view(
    robot: Source,
    observe: Observe = "all",
    camera: Camera = None,
    hidden: Annotated[bool, typer.Option("--hidden", help="The hidden robot too, its virtual actuators highlighted.")]
    = False,
    static: Annotated[str | None, typer.Option(metavar="FILE", help="Write a page that needs no server (.html).")]
    = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the server (default: any that is free).")] = 0,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = True,
    json: Json = False,
    seed: Seed = 0,
) -> None:
    """A 3D view in the browser: sliders that keep the loops closed, what is observed, assembly modes."""
    from .present import records
    from .present.text.view import view as written
    from .present.view import page
    from .present.view.view import view as run

    page.writable(static)
    with Progress() as progress:
        found = run(robot.load(), _list(observe), camera, hidden=hidden, seed=seed, progress=progress.tell)
    if static is not None:
        page.write(found, static)
    if json:
        typer.echo(records.record("view", found.setting.robot.name, {**found.to_dict(), "file": static}))
    elif static is None:
        from .present.view.server import serve

        serve(found, port, lambda _, address: _shown(written(found, address), address if open_ else None))
    else:
        typer.echo(written(found, static))


def _shown(text: str, address: str | None) -> None:
    """Tell what is served, and open the page if there is an ``address``."""
    typer.echo(f"{text}   (Ctrl-C ends it)")
    sys.stdout.flush()
    if address is not None:
        import threading
        import webbrowser

        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


@app.command()
def robots(json: Json = False) -> None:
    """The shipped robots."""
    from .description import shipped
    from .families.table import ROBOTS
    from .mechanism.notation import parse
    from .present import records
    from .present.text.tables import table

    files = shipped()
    rows = [{"name": each.name, "file": str(files.get(each.name, "")), "architecture_ascii": each.architecture,
             "dof": each.dof, "section": each.section, "dimensions": each.provenance} for each in ROBOTS]
    if json:
        typer.echo(records.record("robots", None, {"robots": rows}))
    else:
        typer.echo(table([(str(r["name"]), str(parse(str(r["architecture_ascii"]))), str(r["dof"]),
                                str(r["section"])) for r in rows], ("name", "architecture", "dof", "source")))


@app.command()
@_of_robot
def convert(
    robot: Source,
    target: Annotated[str, typer.Argument(metavar="OUT", help="The file to write; its ending says the dialect.")],
    to: Annotated[str | None, typer.Option(metavar="DIALECT", help="native, gepetto, mjcf or sdf, whatever the "
                                           "ending.")] = None,
    json: Json = False,
) -> None:
    """Read a robot in any dialect and write it in another: .urdf native, .yaml Gepetto, .xml MJCF, .sdf SDFormat."""
    from .description import save, targets
    from .present import records

    files = [str(file) for file in targets(target, to)]
    mechanism = robot.load()
    _other_than(robot, mechanism, *files)
    lost = save(mechanism, target, to)
    for warning in lost:
        typer.echo(f"hrsynth: {warning}", err=True)
    fields: dict[str, Any] = {"file": target, "files": files, "links": len(mechanism.links),
                              "joints": len(mechanism.joints), "warnings": [str(warning) for warning in lost]}
    typer.echo(records.record("convert", mechanism.name, fields) if json
               else f"{mechanism.name}: {fields['links']} links, {fields['joints']} joints, "
                    f"written to {' and '.join(files)}")


def _other_than(robot: Source, mechanism: Mechanism, *files: str) -> None:
    """Refuse to write over a file that is read."""
    from .description.files import require_other

    for file in files:
        require_other(file, robot.robot, mechanism.file)


def _list(text: str) -> list[str]:
    from .errors import BadRequest

    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadRequest("--observe: an empty name", text, "labels or links set apart by commas, or all")
    return names


class Progress:
    """A line on standard error once a command has taken more than a second; nothing where that is no terminal."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._bar: Any = None
        self._steps = 0

    def __enter__(self) -> Progress:
        return self

    def tell(self, what: str = "sets of legs") -> None:
        """One more step done."""
        self._steps += 1
        if self._bar is None and time.monotonic() - self._start > 1.0 and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            self._bar = Bar(TextColumn("{task.description}"), BarColumn(), TextColumn("step {task.completed:.0f}"),
                            TimeElapsedColumn(), console=Console(stderr=True), transient=True)
            self._bar.start()
            self._bar.add_task(what, total=None)
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], description=what, completed=self._steps)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; every failure is one line a defect, never a traceback."""
    for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(library, "1")
    gc.set_threshold(50_000)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    sys.exit(_run(arguments))


def _run(arguments: list[str] | None) -> int:
    try:
        status = app(args=arguments, standalone_mode=False)
        sys.stdout.flush()
        return int(status or 0)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return 130
    except Exception as error:
        return _told(error)


def _told(error: Exception) -> int:
    """Say what went wrong; the exit status."""
    from .errors import HrsynthError

    if isinstance(error, HrsynthError):
        for line in error.lines():
            typer.echo(f"hrsynth: {line}", err=True)
        return error.exit_status
    usage = getattr(error, "format_message", None)
    if usage is not None:
        message = " ".join(str(usage()).split())
        if message:
            typer.echo(f"hrsynth: {message}", err=True)
        return 2
    if os.environ.get("HRSYNTH_DEBUG"):
        raise error
    what = " ".join(f"{type(error).__name__}: {error}".split())
    typer.echo(f"hrsynth: a defect of hrsynth itself, please report it: {what}", err=True)
    return 3


if __name__ == "__main__":
    main()
