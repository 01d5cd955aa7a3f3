"""Results → JSON: one object a command, always with ``robot``, ``command`` and ``version``."""

from __future__ import annotations

import json
from typing import Any

from .. import __version__


def record(command: str, robot: str | None, fields: dict[str, Any]) -> str:
    """The JSON text of a command's answer (no NaN, no infinity)."""
    head: dict[str, Any] = {} if robot is None else {"robot": robot}
    return json.dumps({**head, "command": command, "version": __version__, **fields}, ensure_ascii=False, indent=2,
                      allow_nan=False)
