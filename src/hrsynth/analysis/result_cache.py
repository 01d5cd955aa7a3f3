"""Cache of the results of analyses: calls with equal arguments and an equal robot of one file return one result."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import partial
from inspect import BoundArguments
from threading import Lock
from typing import Any

from ..errors import MissingExtra
from ..mechanism import Mechanism
from ..results import freeze_content
from .observation_inputs import list_requested_legs
from .observed import clear_robots

CACHED_RESULTS_COUNT = 64
"""Results kept in the cache."""
CACHED_GRID_RESULTS_COUNT = 2
"""Results on grids and planes kept in the cache."""


class ResultCache:
    """Results of the latest calls, up to a number."""

    def __init__(self, most: int) -> None:
        self.most, self.lock = most, Lock()
        self.kept: OrderedDict[Hashable, Any] = OrderedDict()

    def get(self, key: Hashable, compute: Callable[[], Any]) -> Any:
        """Return the cached result, or compute it; not kept if an optional package was missing, which may be installed
        later."""
        with self.lock:
            if key in self.kept:
                self.kept.move_to_end(key)
                return self.kept[key]
        missed = MissingExtra.met
        result = compute()
        if MissingExtra.met == missed:
            with self.lock:
                self.kept[key] = result
                while len(self.kept) > self.most:
                    self.kept.popitem(last=False)
        return result


_RESULTS, _GRIDS = ResultCache(CACHED_RESULTS_COUNT), ResultCache(CACHED_GRID_RESULTS_COUNT)


def clear_cache() -> None:
    """Clear all results and samples from the cache.

    Examples
    --------
    >>> hrsynth.clear_cache()
    """
    clear_results()
    clear_robots()


def clear_results() -> None:
    """Clear the results alone."""
    for cache in (_RESULTS, _GRIDS):
        cache.kept.clear()


def compute_cached(function: Callable[..., Any], bound: BoundArguments) -> Any:
    """Return the cached result of an analysis for its arguments, or compute it; never cached if it writes a file or an
    argument cannot be hashed."""
    compute = partial(function, *bound.args, **bound.kwargs)
    key = _build_key(function, bound)
    try:
        hash(key)
    except TypeError:
        return compute()
    if bound.arguments.get("into") is not None:
        return compute()
    is_large = any(bound.arguments.get(name) is not None for name in ("plane", "grid"))
    return (_GRIDS if is_large else _RESULTS).get(key, compute)


def _build_key(function: Callable[..., Any], bound: BoundArguments) -> tuple[Any, ...]:
    """Return the name of the function, the content of all arguments, the format of printed poses, and the file of the
    robot with its overrides."""
    every = BoundArguments(bound.signature, OrderedDict(bound.arguments))
    every.apply_defaults()
    values = every.arguments
    robot = values.pop("robot")
    source = robot if isinstance(robot, Mechanism) else robot.robot
    if "observe" in values:
        values["observe"] = list_requested_legs(robot, values["observe"], values.get("sensor"))
    form = None if robot is source else robot.form
    content = freeze_content(values)
    return function.__qualname__, robot, form, source.file, source.notes, source.options, source.sha256, content
