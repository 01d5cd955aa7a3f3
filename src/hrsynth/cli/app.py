"""Root of the commands; each module of this folder adds its own."""

from .commands import Group


def _print_version() -> str:
    from ..version import __version__

    return __version__


app = Group(
    "hrsynth",
    "Hidden robots of parallel robots that are controlled by observing the directions of their legs.",
    _print_version,
)
