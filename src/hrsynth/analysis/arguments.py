"""Arguments of analyses: bound to the parameters and checked, the robot read from its name or path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from inspect import BoundArguments, signature
from numbers import Integral, Real
from typing import Any

import numpy as np

from ..errors import BadRequest
from ..mechanism import Mechanism
from ..options import list_options, list_parameter_types, require_range
from ..results import require_keywords
from .observed import read_robot

KINDS: dict[str, tuple[Any, str]] = {
    "int": (Integral, "an integer"),
    "float": (Real, "a number"),
    "str": (str, "a text"),
    "bool": ((bool, np.bool_), "True or False"),
}
"""Check and name of the arguments of each type."""


class ArgumentBinder:
    """Check of the arguments of an analysis; with ``formations`` it accepts several platform links."""

    def __init__(self, function: Callable[..., Any], formations: bool) -> None:
        self.function, self.formations = function, formations
        self.signature = signature(function)
        self.kinds = list_parameter_types(function)
        self.options = {option.name: option for option in list_options(function)}

    def bind(self, args: Sequence[Any], given: Mapping[str, Any]) -> BoundArguments:
        """Return the bound arguments; raises ``TypeError`` or ``BadRequest`` for wrong ones."""
        require_keywords(self.function, given)
        try:
            bound = self.signature.bind(*args, **given)
        except TypeError as error:
            known = ", ".join(self.signature.parameters)
            raise TypeError(f"{self.function.__name__}: {error}; it takes {known}") from None
        for name, value in bound.arguments.items():
            self._require_kind(name, value)
        robot = bound.arguments["robot"] = read_robot(bound.arguments["robot"])
        source = robot if isinstance(robot, Mechanism) else robot.robot
        if source.formation and not self.formations:
            raise BadRequest(
                f"{source.name}: {self.function.__name__} needs one platform, and this is a formation",
                ", ".join(source.bodies),
                remedy="Name a <platform> in the file, or use derive, legs or check.",
            )
        return bound

    def _require_kind(self, name: str, value: Any) -> None:
        """Raise ``BadRequest`` for an argument that is not a number, text or truth value where the signature needs one,
        or a number out of its range."""
        kind, *none = self.kinds[name]
        if kind not in KINDS or none not in ([], ["None"]) or (none and value is None):
            return
        right, word = KINDS[kind]
        if not isinstance(value, right) or (isinstance(value, bool) and kind != "bool"):
            raise BadRequest(name, value, word)
        if (option := self.options.get(name)) is not None:
            require_range(name, value, word, option.low, option.high)
