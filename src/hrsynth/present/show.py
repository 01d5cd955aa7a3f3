"""Answers as they are shown: text, JSON, HTML for notebooks, pictures."""

from __future__ import annotations

import html as markup
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import BadRequest, MissingExtra
from ..results import Result
from .outputs import OUTPUTS, function

if TYPE_CHECKING:
    from ..mechanism.pose import Pose


@dataclass(frozen=True, repr=False)
class Picture:
    """A picture, ``png`` or ``svg``; a notebook shows it."""

    content: bytes
    words: str
    kind: str = "png"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.words}>"

    def _repr_png_(self) -> bytes | None:
        return self.content if self.kind == "png" else None

    def _repr_svg_(self) -> str | None:
        return self.content.decode() if self.kind == "svg" else None

    def save(self, file: str | Path) -> None:
        """Write it, whole or not at all; raises ``BadRequest`` for another ending than its kind's."""
        from ..description.files import require_folder, write_whole

        if Path(file).suffix.lower() != f".{self.kind}":
            raise BadRequest("cannot write the picture: its ending is not its kind", str(file), f".{self.kind}")
        require_folder(file)
        write_whole(file, self.content)


def text(result: Result) -> str:
    """The text that the command line prints of a result."""
    shown: str = function(OUTPUTS[result.shown_as].text)(result)
    return shown


def record(command: str, robot: str | None, fields: dict[str, Any]) -> str:
    """The JSON text of a command's answer: one object, always with ``command`` and ``version`` (no NaN, no
    infinity)."""
    head: dict[str, Any] = {} if robot is None else {"robot": robot}
    return json.dumps({**head, "command": command, "version": __version__, **fields}, ensure_ascii=False, indent=2,
                      allow_nan=False)


def html(result: Result) -> str:
    """What a notebook shows: a view as it moves; else the same text in columns, with lines that are not broken, motors
    underlined by markup, which any font can."""
    said, inline = text(result), OUTPUTS[result.shown_as].inline
    if inline is not None:
        try:
            return str(function(inline)(result))
        except MissingExtra as error:
            said = f"{said}\n\n{error}"
    shown = re.sub("(.)\u0332", r"<u>\1</u>", markup.escape(said))
    return f'<pre style="white-space: pre; overflow-x: auto">{shown}</pre>'


def draw(result: Result, *, plane: Pose | str | None = None, steps: int = 51) -> Picture:
    """A picture of a result: the kinematic schemes of a derivation's robots, and as ``-o`` draws them assembly modes, a
    servo run, checked or accuracy poses over a grid, and where a freedom is lost over a ``plane`` of poses (``steps`` a
    side).

    Raises ``BadRequest`` for a result that has no picture.
    """
    asked = {"plane": plane, "steps": steps, "seed": 0}
    drawn = [(file, ending) for file in OUTPUTS[result.shown_as].files for ending in (".png", ".svg")
             if ending in file.makers and (file.part is None or getattr(result, file.part) is not None)]
    if plane is not None and not any("plane" in file.takes for file, _ in drawn):
        raise BadRequest("a plane is drawn", type(result).__name__, "only of the result of singular")
    for file, ending in drawn:
        content, _ = file.content(result, ending, asked)
        return Picture(b"".join([content] if isinstance(content, bytes) else content), result.headline(), ending[1:])
    raise BadRequest("there is no picture of", repr(result),
                     "derive, modes, servo, singular; check with a grid; accuracy with a plane or grid")
