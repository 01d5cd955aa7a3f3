"""Commands on robots and their files: view, robots, convert."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from .options import Camera, Json, Observe, Seed, Source, listed
from .progress import Progress


def view(
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
    *,
    robot: Source,
) -> None:
    """A 3D view in the browser: sliders that keep the loops closed, what is observed, assembly modes."""
    from ..present import records
    from ..present.text.view import view as written
    from ..present.view import page
    from ..present.view.view import view as run

    page.writable(static)
    with Progress() as progress:
        found = run(robot.load(), listed(observe), camera, hidden=hidden, seed=seed, progress=progress.tell)
    if static is not None:
        page.write(found, static)
    if json:
        typer.echo(records.record("view", found.setting.robot.name, {**found.to_dict(), "file": static}))
    elif static is None:
        from ..present.view.server import serve

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


def robots(json: Json = False) -> None:
    """The shipped robots."""
    from ..description import shipped
    from ..families.table import ROBOTS
    from ..mechanism.notation import parse
    from ..present import records
    from ..present.text.tables import table

    files = shipped()
    rows = [{"name": each.name, "file": str(files.get(each.name, "")), "architecture_ascii": each.architecture,
             "dof": each.dof, "section": each.section, "dimensions": each.provenance} for each in ROBOTS]
    if json:
        typer.echo(records.record("robots", None, {"robots": rows}))
    else:
        typer.echo(table([(str(r["name"]), str(parse(str(r["architecture_ascii"]))), str(r["dof"]),
                                str(r["section"])) for r in rows], ("name", "architecture", "dof", "source")))


def convert(
    robot: Source,
    target: Annotated[str, typer.Argument(metavar="OUT", help="The file to write; its ending says the dialect.")],
    to: Annotated[str | None, typer.Option(metavar="DIALECT", help="native, gepetto, mjcf or sdf, whatever the "
                                           "ending.")] = None,
    json: Json = False,
) -> None:
    """Read a robot in any dialect and write it in another: .urdf native, .yaml Gepetto, .xml MJCF, .sdf SDFormat."""
    from ..description import save, targets
    from ..present import records

    files = [str(file) for file in targets(target, to)]
    mechanism = robot.load()
    robot.require_other(mechanism, *files)
    lost = save(mechanism, target, to)
    for warning in lost:
        typer.echo(f"hrsynth: {warning}", err=True)
    fields: dict[str, Any] = {"file": target, "files": files, "links": len(mechanism.links),
                              "joints": len(mechanism.joints), "warnings": [str(warning) for warning in lost]}
    typer.echo(records.record("convert", mechanism.name, fields) if json
               else f"{mechanism.name}: {fields['links']} links, {fields['joints']} joints, "
                    f"written to {' and '.join(files)}")
