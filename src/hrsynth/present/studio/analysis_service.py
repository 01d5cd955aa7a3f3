"""Analyses of the studio as plain data: no server, no state, each request is complete."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from ...errors import BadRequest
from ...results import Value
from . import asks
from .request import Request

Answerer = Callable[[Request], dict[str, Any]]


@dataclass(frozen=True, eq=False, repr=False)
class AnalysisService(Value):
    """Service of the analyses: the opened ``folder``, the folder of a tab's ``uploads``, and the robot of the command
    line (``given``: its name or path as ``robot``, its ``options``); None where there is none."""

    folder: Path | None = None
    uploads: Path | None = None
    given: Mapping[str, Any] | None = None

    def answer(self, asked: Any) -> dict[str, Any]:
        """Return the answer to one request, plain data; raise ``BadRequest`` and errors of the analysis."""
        if not isinstance(asked, dict):
            raise BadRequest("request", asked, "an object with a field `ask`")
        name = asked.get("ask")
        if not isinstance(name, str) or name not in list_request_names():
            raise BadRequest("ask: no such analysis", name, list_request_names())
        return load_answerer(name)(Request(asked, self.folder, self.uploads, self.given))


@cache
def list_request_names() -> tuple[str, ...]:
    """List the analyses: the modules of ``asks``."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(asks.__path__)))


@cache
def load_answerer(name: str) -> Answerer:
    """Return the function of an analysis."""
    found: Answerer = import_module(f"{asks.__name__}.{name}").answer
    return found
