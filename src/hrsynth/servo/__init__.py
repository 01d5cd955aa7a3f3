"""The servo loop: control law, simulated runs, the physics bench and the camera bench.

The folder has the name of the function in it: ``hrsynth.servo(...)`` is that function, whatever was imported before.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """This module, which calls the function of its name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        from .servo import servo

        return servo(*arguments, **options)


sys.modules[__name__].__class__ = _Callable
