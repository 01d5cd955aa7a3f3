"""Answers as they are shown: text, JSON, HTML for notebooks, pictures."""

from __future__ import annotations

import html as markup
import io
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..characters import name_steering
from ..errors import BadRequest, MissingExtra
from ..options import require_range
from ..results import Result, with_spelling
from ..version import __version__
from .outputs import FIGURES, OUTPUTS, File, function, outputs_of

if TYPE_CHECKING:
    from pathlib import Path

    from ..mechanism.model import Mechanism
    from ..mechanism.pose import Pose

PICTURES = (*FIGURES, ".gif")
"""Endings of pictures."""


@dataclass(frozen=True, repr=False)
class Picture:
    """A picture, as a notebook shows it where it is ``png`` or ``svg``."""

    content: bytes
    words: str
    kind: str
    draws: Callable[[str], bytes]
    """Draws it in a file with another of the ``endings``."""
    endings: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.words}>"

    def _repr_png_(self) -> bytes | None:
        return self.content if self.kind == "png" else None

    def _repr_svg_(self) -> str | None:
        return self.content.decode() if self.kind == "svg" else None

    def save(self, file: str | Path) -> None:
        """Write it, whole or not at all, drawn again for the ending of another kind; raises ``BadRequest`` for an
        ending that is none of its kinds."""
        from ..description.files import write_whole

        ending = _ending(file, self.endings)
        write_whole(file, self.content if ending == f".{self.kind}" else self.draws(ending))


def text(result: Result) -> str:
    """The text that the command line prints of a result.

    >>> print(hrsynth.text(hrsynth.legs("rrrrr_m1")).splitlines()[0])
    rrrrr_m1   R*RRRR*   2 dof
    """
    shown: str = function(outputs_of(result.shown_as).text)(result)
    return shown


def record(command: str, robot: Mechanism | None, fields: dict[str, Any]) -> str:
    """The JSON text of a command's answer: one object, always with ``command`` and ``version``, with the name of the
    ``robot`` and its platform where it is about one (no NaN, no infinity)."""
    head: dict[str, Any] = {}
    if robot is not None:
        chosen = None if robot.choice is None else {"chosen": robot.choice.chosen, "reason": robot.choice.reason}
        link = None if robot.open_platform else robot.platform
        head = {"robot": robot.name, "platform": {"link": link, **(chosen or {})}}
    text = io.StringIO()  # json.dumps keeps all small pieces of the text at once
    json.dump(
        {**head, "command": command, "version": __version__, **fields},
        text,
        ensure_ascii=False,
        indent=2,
        allow_nan=False,
    )
    return text.getvalue()


def html(result: Result) -> str:
    """What a notebook shows: a view that moves; otherwise the same text in columns, without line breaks, motors
    underlined by markup, which works in any font.

    >>> hrsynth.html(hrsynth.derive("3rrr_m1"))[:4]
    '<pre'
    """
    said, inline = text(result), outputs_of(result.shown_as).inline
    if inline is not None:
        try:
            return str(function(inline)(result))
        except MissingExtra as error:
            said = f"{said}\n\n{error}"
    shown = re.sub("(.)\u0332", r"<u>\1</u>", markup.escape(name_steering(said)))
    return f'<pre style="white-space: pre; overflow-x: auto">{shown}</pre>'


@with_spelling
def draw(
    result: Result,
    file: str | Path | None = None,
    *,
    plane: Pose | str | None = None,
    steps: int = 51,
    width: str | None = None,
    font: str | None = None,
) -> Picture:
    """A picture of a result, written to ``file`` (.png, .pdf or .svg; for a servo run also .gif) if one is given: the
    kinematic schemes of a derivation's robots (.svg) and, as with ``-o``, assembly modes, an atlas, a servo run,
    checked or accuracy poses over a grid, and where a freedom is lost over a ``plane`` of poses (``steps`` a side).
    ``width`` (``"88mm"``) and ``font`` (``"serif 8pt"``) are as on the command line.

    >>> picture = hrsynth.draw(hrsynth.modes("3rrr_m1"), width="88mm")
    >>> picture
    <Picture: 3rrr_m1, watching 1, 2, 3: 2 real of 6 complex (hidden robot) at x=0.01,y=-0.015,z=0,phi=0deg>

    Raises ``BadRequest`` for a result that has no picture.
    """
    require_range("steps", steps, "an integer", 5, 300)
    asked = {"plane": plane, "steps": steps, "seed": 0, "width": width, "font": font}
    if not isinstance(result, Result):
        raise BadRequest("a picture of", repr(result), "what a function of hrsynth answers")
    for drawn in outputs_of(result.shown_as).files:
        endings = tuple(each for each in PICTURES if each in drawn.makers)
        if not endings or (drawn.part is not None and getattr(result, drawn.part) is None):
            continue
        if plane is not None and "plane" not in drawn.takes:
            raise BadRequest("a plane is drawn", type(result).__name__, "only of the result of singular")
        if not drawn.drawn and (width is not None or font is not None):
            raise BadRequest("width and font are of a figure", type(result).__name__, "what is drawn with axes")
        draws = partial(_content, drawn, result, asked)
        ending = endings[0] if file is None else _ending(file, endings)
        picture = Picture(draws(ending), result.headline(), ending[1:], draws, endings)
        if file is not None:
            picture.save(file)
        return picture
    raise BadRequest(
        "there is no picture of",
        repr(result),
        [
            f"{name} with {each.words}" if each.words else name
            for name, outputs in OUTPUTS.items()
            for each in outputs.files
            if any(ending in each.makers for ending in PICTURES)
        ],
    )


def _ending(file: str | Path, endings: tuple[str, ...]) -> str:
    """The ending of a file that a picture can be written to; raises ``BadRequest``."""
    from ..description.files import as_path, require_writable

    ending = as_path(file).suffix.lower()
    if ending not in endings:
        raise BadRequest("cannot write the picture: unknown extension", str(file), endings)
    require_writable(file)
    return ending


def _content(drawn: File, result: Result, asked: dict[str, Any], ending: str) -> bytes:
    content, _ = drawn.content(result, ending, asked)
    return b"".join([content] if isinstance(content, bytes) else content)
