"""Options that several commands share: a robot, what is watched, which architectures of the catalog."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

if TYPE_CHECKING:
    from ..mechanism import Mechanism

Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]
Observe = Annotated[str, typer.Option("--observe", metavar="LEGS", help="Legs to watch (1,4), links, or all.")]
Camera = Annotated[str | None, typer.Option("--camera", metavar="LINK", help="The link that carries the camera.")]
Start = Annotated[str, typer.Option("--from", metavar="POSE", help="Where it starts, as x=0.02,y=0.1,z=-0.7.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random configurations.")]


@dataclass(frozen=True)
class Source:
    """A robot as the command line names it, with what its file does not say."""

    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A robot file in any dialect, or the name of a shipped "
                                         "robot.")]
    base: Annotated[str | None, typer.Option(metavar="LINK", help="Look only at what lies between this link and the "
                                             "platform.")] = None
    platform: Annotated[str | None, typer.Option(metavar="LINK", help="The platform, where the file names "
                                                 "none.")] = None
    motors: Annotated[str | None, typer.Option(metavar="JOINTS", help="The driven joints, where the file names "
                                               "none.")] = None
    close: Annotated[list[str] | None, typer.Option(metavar="A:B[:TYPE]", help="A closure: the frames of two links "
                                                    "meet (default: in a point); again for more.")] = None
    freeze: Annotated[str, typer.Option(metavar="JOINTS", help="Joints to hold at zero.")] = ""

    def load(self) -> Mechanism:
        """The mechanism; what was guessed or solved goes to standard error, a line each."""
        from ..description import load

        frozen = [name for name in self.freeze.split(",") if name]
        mechanism = load(self.robot, base=self.base, platform=self.platform, motors=self.motors,
                         close=self.close or (), freeze=frozen)
        for note in mechanism.notes:
            typer.echo(f"hrsynth: {note}", err=True)
        return mechanism

    def require_other(self, mechanism: Mechanism, *files: str) -> None:
        """Refuse to write over a file that is read."""
        from ..description.files import require_other

        for file in files:
            require_other(file, self.robot, mechanism.file)


@dataclass(frozen=True)
class Filter:
    """Which architectures of the catalog are asked for."""

    legs: Annotated[str | None, typer.Option(metavar="LEGS", help="Number of legs, or a pattern of the notation or of "
                                             "one leg's chain: 3-R*, PUS.")] = None
    dof: Annotated[int | None, typer.Option(help="Freedoms of the platform.")] = None
    motion: Annotated[str | None, typer.Option(help="Its translations and turns, as 3T or 2T1R.")] = None
    verdict: Annotated[str | None, typer.Option(help="controllable, partially controllable, uncontrollable.")] = None
    group: Annotated[str | None, typer.Option(help="planar, pods, deltas, spatial.")] = None
    base_motors: Annotated[bool | None, typer.Option("--base-motors/--moving-motors", help="All motors on the base, or "
                                                     "not.")] = None
    fewest: Annotated[int | None, typer.Option(help="Legs to watch to see all that can be seen.")] = None
    text: Annotated[str | None, typer.Option(help="What occurs in any field.")] = None

    def asked(self) -> dict[str, Any]:
        """As the catalog takes it."""
        return asdict(self)


def unfolded(command: Callable[..., None]) -> Callable[..., None]:
    """A command in which each parameter that is a dataclass gives way to the dataclass's fields; what must be given
    comes first."""
    signature = inspect.signature(command, eval_str=True)
    given = signature.parameters.items()
    groups: dict[str, Any] = {name: each.annotation for name, each in given if is_dataclass(each.annotation)}
    parameters = []
    for name, each in given:
        parameters += _fields(groups[name]) if name in groups else [each]
    parameters.sort(key=lambda each: each.default is not each.empty)

    def run(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{each.name: values.pop(each.name) for each in fields(group)})
        command(**values)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters])
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run


def _fields(group: Any) -> list[inspect.Parameter]:
    """The fields of a dataclass as parameters, their annotations evaluated."""
    hints = get_type_hints(group, include_extras=True)
    return [each.replace(annotation=hints[name]) for name, each in inspect.signature(group).parameters.items()]


def listed(text: str) -> list[str]:
    """Names set apart by commas."""
    from ..errors import BadRequest

    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadRequest("--observe: an empty name", text, "labels or links set apart by commas, or all")
    return names
