"""Hidden robots of parallel robots that are controlled by watching the directions of their legs.

    import hrsynth

    found = hrsynth.derive("quattro", [1, 4])           # a name, a path, what load() gave; legs
    found.verdict == "controllable"
    hrsynth.check("quattro", at=[0.02, 0.1, -0.7])      # a pose: text, dict, numbers, 4 x 4 matrix, pinocchio.SE3
    hrsynth.view("quattro", [1, 4])                     # in a notebook: the robot, which moves
    hrsynth.map_robots("check", ["quattro", "delta"], poses=[[0, 0, -0.7], [0.1, 0, -0.7]])    # in several processes

An answer is one line at a prompt; ``print`` shows it in full, ``to_dict()`` is its JSON, ``hrsynth.draw`` its picture.
"""

from .index import homes
from .results import Result
from .version import __version__ as __version__

__all__ = sorted([*homes(), "__version__", "catalog"])


def __getattr__(name: str) -> object:
    """The public functions, imported when they are first asked for (``import hrsynth`` alone stays light)."""
    from importlib import import_module

    if name == "catalog":
        return import_module(".catalog", __name__)
    if name not in homes():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = globals().setdefault(name, getattr(import_module(f".{homes()[name]}", __name__), name))
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


Result.public = staticmethod(__getattr__)
"""How results find what shows them, without an import of what stands above them."""
