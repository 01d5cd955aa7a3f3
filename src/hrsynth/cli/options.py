"""Options as data: each is declared once, the commands' tables put them together, typer reads them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from ..mechanism import Mechanism

NEEDED: Any = inspect.Parameter.empty
"""The default of what must be given."""


@dataclass(frozen=True)
class Option:
    """One option or (``argument``) one word of the command line; ``flags`` are its names, by default its own."""

    name: str
    help: str
    metavar: str | None = None
    kind: Any = str
    default: Any = None
    flags: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    argument: bool = False

    def parameter(self) -> inspect.Parameter:
        """As typer reads it from a signature."""
        kind = self.kind if self.default is not None else self.kind | None
        told: Any
        if self.argument:
            told = typer.Argument(metavar=self.metavar, help=self.help)
        else:
            flags = self.flags or (f"--{self.name.replace('_', '-')}",)
            told = typer.Option(*flags, metavar=self.metavar, help=self.help, min=self.low, max=self.high)
        return inspect.Parameter(self.name, inspect.Parameter.KEYWORD_ONLY, default=self.default,
                                 annotation=Annotated[kind, told])


def flag(name: str, help: str) -> Option:
    """An option that is given or not."""
    return Option(name, help, kind=bool, default=False)


def output(help: str, metavar: str = "FILE", default: Any = None) -> Option:
    """What is written with ``-o``."""
    return Option("output", help, metavar, default=default, flags=("-o", "--output"))


JSON = flag("json", "Print the result as one JSON object.")
OBSERVE = Option("observe", "Legs to watch (1,4), links, or all.", "LEGS", default="all")
CAMERA = Option("camera", "The link that carries the camera.", "LINK")
WATCHED = (OBSERVE, CAMERA)
SEED = Option("seed", "Seed of the random configurations.", kind=int, default=0, low=0)
SOURCE = (
    Option("robot", "A robot file in any dialect, a shipped robot's name, or example:NAME.", "ROBOT", default=NEEDED,
           argument=True),
    Option("base", "Look only at what lies between this link and the platform.", "LINK"),
    Option("platform", "The platform, where the file names none.", "LINK"),
    Option("motors", "The driven joints, where the file names none.", "JOINTS"),
    Option("close", "A closure: the frames of two links meet (default: in a point); again for more.", "A:B[:TYPE]",
           kind=list[str]),
    Option("freeze", "Joints to hold at zero.", "JOINTS", default=""),
)
"""A robot as the command line names it, with what its file does not say."""


def add_command(app: typer.Typer, name: str, help: str, options: Sequence[Option], run: Callable[..., None]) -> None:
    """Add a command: what must be given comes first, ``run`` is called with all by name."""
    parameters = sorted((each.parameter() for each in options), key=lambda each: each.default is not NEEDED)

    def called(**values: Any) -> None:
        run(**values)

    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {each.name: each.annotation for each in parameters}
    app.command(name, help=help)(called)


def robot_of(values: dict[str, Any]) -> Mechanism:
    """The mechanism that the options of ``SOURCE`` name, which are taken out of ``values``; what was guessed or solved
    goes to standard error, a line each."""
    from ..description import load

    given = {option.name: values.pop(option.name) for option in SOURCE}
    given["freeze"] = [name for name in given["freeze"].split(",") if name]
    mechanism = load(given.pop("robot"), **{**given, "close": given["close"] or ()})
    for note in mechanism.notes:
        warn(str(note))
    return mechanism


def warn(text: str) -> None:
    """Say something beside the answer."""
    typer.echo(f"hrsynth: {text}", err=True)


def listed(text: str) -> list[str]:
    """Names set apart by commas."""
    from ..errors import BadRequest

    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadRequest("--observe: an empty name", text, "labels or links with commas between them, or all")
    return names
