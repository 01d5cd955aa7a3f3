"""Hidden robots of parallel robots that are controlled by watching the directions of their legs.

    import hrsynth

    found = hrsynth.derive("quattro", [1, 4])           # a name, a path, what load() gave; legs
    found.verdict == "controllable"
    hrsynth.check("quattro", at=[0.02, 0.1, -0.7])      # a pose: text, dict, numbers, 4 x 4 matrix, pinocchio.SE3
    hrsynth.view("quattro", [1, 4])                     # in a notebook: the robot, which moves
    hrsynth.map("check", ["quattro", "delta"], poses=[[0, 0, -0.7], [0.1, 0, -0.7]])    # in several processes

An answer is one line at a prompt; ``print`` shows it in full, ``to_dict()`` is its JSON, ``hrsynth.draw`` its picture.
"""

from typing import TYPE_CHECKING

from .results import Result
from .version import __version__

if TYPE_CHECKING:
    from . import catalog
    from .analysis.accuracy.accuracy import accuracy
    from .analysis.advice import advise
    from .analysis.asked import observe
    from .analysis.aspects.atlas import atlas
    from .analysis.aspects.path import path
    from .analysis.branch.proof import branch
    from .analysis.check import check
    from .analysis.controllability import legs
    from .analysis.derive import derive
    from .analysis.modes.modes import modes
    from .analysis.question import forget
    from .analysis.singularity.singular import singular
    from .analysis.study import map
    from .certificates import certificate, verify
    from .codegen.export import export
    from .description import examples, load, save, shipped
    from .linting.lint import lint
    from .present.show import draw, html, text
    from .present.studio.server import studio
    from .present.view.view import view
    from .progress import following
    from .selection.select import select
    from .simulation.endings.basins import basins
    from .simulation.endings.endings import endings
    from .simulation.servo import servo

__all__ = [
    "__version__",
    "accuracy",
    "advise",
    "atlas",
    "basins",
    "branch",
    "catalog",
    "certificate",
    "check",
    "derive",
    "draw",
    "endings",
    "examples",
    "export",
    "following",
    "forget",
    "html",
    "legs",
    "lint",
    "load",
    "map",
    "modes",
    "observe",
    "path",
    "save",
    "select",
    "servo",
    "shipped",
    "singular",
    "studio",
    "text",
    "verify",
    "view",
]

_HOME = {
    "accuracy": ".analysis.accuracy.accuracy",
    "advise": ".analysis.advice",
    "atlas": ".analysis.aspects.atlas",
    "basins": ".simulation.endings.basins",
    "branch": ".analysis.branch.proof",
    "certificate": ".certificates",
    "check": ".analysis.check",
    "derive": ".analysis.derive",
    "draw": ".present.show",
    "examples": ".description",
    "export": ".codegen.export",
    "following": ".progress",
    "forget": ".analysis.question",
    "html": ".present.show",
    "legs": ".analysis.controllability",
    "lint": ".linting.lint",
    "load": ".description",
    "map": ".analysis.study",
    "modes": ".analysis.modes.modes",
    "observe": ".analysis.asked",
    "path": ".analysis.aspects.path",
    "save": ".description",
    "select": ".selection.select",
    "servo": ".simulation.servo",
    "endings": ".simulation.endings.endings",
    "shipped": ".description",
    "singular": ".analysis.singularity.singular",
    "studio": ".present.studio.server",
    "text": ".present.show",
    "verify": ".certificates",
    "view": ".present.view.view",
}


def __getattr__(name: str) -> object:
    """The public functions, imported when they are first asked for (``import hrsynth`` alone stays light)."""
    from importlib import import_module

    if name == "catalog":
        return import_module(".catalog", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = globals().setdefault(name, getattr(import_module(_HOME[name], __name__), name))
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


Result.public = staticmethod(__getattr__)
"""How results find what shows them, without an import of what stands above them."""
