"""Results as they are shown outside the command line: text, HTML for notebooks, pictures."""

from __future__ import annotations

import html as markup
import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import BadRequest
from ..results import Result

if TYPE_CHECKING:
    from ..mechanism.pose import Pose

_TEXTS = {
    "Accuracy": "accuracy.accuracy", "Advice": "advice.advice", "AssemblyModes": "modes.modes",
    "Certificate": "verdicts.certificate", "Check": "check.check", "Derivation": "verdicts.derivation",
    "Legs": "verdicts.legs", "Mechanism": "robot.robot", "PathAnswer": "aspects.path",
    "Selection": "selection.selection", "Servo": "servo.servo", "Singularity": "singularity.singularity",
    "Verdict": "verdicts.verdict",
}
"""What writes each kind of result, in ``present.text``."""
_DRAWN = {"AssemblyModes": "modes.picture", "Servo": "runs.picture"}
"""What draws each kind of result that needs no more, in ``present``."""


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
    module, name = _TEXTS[type(result).__name__].split(".")
    written: str = getattr(import_module(f".text.{module}", __package__), name)(result)
    return written


def html(result: Result) -> str:
    """The same text for a notebook: in columns, with lines that are not broken; motors underlined by markup, which any
    font can."""
    shown = re.sub("(.)\u0332", r"<u>\1</u>", markup.escape(text(result)))
    return f'<pre style="white-space: pre; overflow-x: auto">{shown}</pre>'


def draw(result: Result, *, plane: Pose | str | None = None, steps: int = 51) -> Picture:
    """A picture of a result: the kinematic schemes of a derivation's robots, and as ``-o`` draws them assembly modes, a
    servo run, checked or accuracy poses over a grid, and where a freedom is lost over a ``plane`` of poses (``steps`` a
    side).

    Raises ``BadRequest`` for a result that has no picture.
    """
    kind = type(result).__name__
    if kind != "Singularity" and plane is not None:
        raise BadRequest("a plane is drawn", kind, "only of the result of singular")
    if kind == "Derivation":
        return Picture(_schemes(result).encode(), result.headline(), "svg")
    if kind == "Singularity":
        return Picture(_locus(result, plane, steps), result.headline())
    if kind in _DRAWN:
        module, name = _DRAWN[kind].split(".")
        return Picture(getattr(import_module(f".{module}", __package__), name)(result), result.headline())
    return Picture(_grid(result), result.headline())


def _schemes(result: Any) -> str:
    from .drawings.derived import derivation_svg

    return derivation_svg(result)


def _locus(result: Any, plane: Pose | str | None, steps: int) -> bytes:
    from ..analysis.singularity.singular import locus_of
    from .loci import locus_map

    return locus_map(result, locus_of(result.setting, plane=plane, steps=steps))


def _grid(result: Any) -> bytes:
    from .accuracy import error_map
    from .plots import distance_map

    if getattr(result, "field", None) is not None:
        return error_map(result)
    if getattr(result, "grid", None) is not None:
        return distance_map(result)
    raise BadRequest("there is no picture of", repr(result),
                     "derive, modes, servo, singular; check with a grid; accuracy with a plane or grid")
