"""Hidden robots of parallel robots that are controlled by observing the directions of their legs.

    import hrsynth

    found = hrsynth.derive("quattro", [1, 4])           # a name, a path or a loaded robot; legs
    found.verdict == "controllable"
    hrsynth.check("quattro", at=[0.02, 0.1, -0.7])      # a pose: text, dict, numbers, 4 x 4 matrix, pinocchio.SE3
    hrsynth.view("quattro", [1, 4])                     # in a notebook: the robot, which moves
    hrsynth.map_robots("check", ["quattro", "delta"], poses=[[0, 0, -0.7], [0.1, 0, -0.7]])    # in several processes

A result is one line at a prompt; ``print`` shows it in full, ``to_dict()`` is its JSON, ``hrsynth.draw`` its figure.
"""

from .index import list_public_modules
from .results import Result
from .version import __version__ as __version__

__all__ = sorted([*list_public_modules(), "__version__", "catalog"])


def __getattr__(name: str) -> object:
    """Import a public function at its first use, so that ``import hrsynth`` stays light."""
    from importlib import import_module

    if name == "catalog":
        return import_module(".catalog", __name__)
    if name not in list_public_modules():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = globals().setdefault(
        name, getattr(import_module(f".{list_public_modules()[name]}", __name__), name)
    )
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


Result.public = staticmethod(__getattr__)
"""Access of results to the functions that show them, which are in a higher layer."""
