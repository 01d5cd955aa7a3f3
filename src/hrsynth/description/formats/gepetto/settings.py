"""The YAML file beside a URDF: found, and read without trust."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ....budgets import LARGEST_YAML
from ... import xml
from ...dialect import RobotFile

KEYS = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")


def settings_in(path: Path) -> dict[str, Any] | None:
    """What a YAML file says, None where it is no such file as this dialect has; raises ``BadRobotFile``."""
    import yaml

    data = xml.content(path)
    try:
        if len(data) > LARGEST_YAML:
            raise xml.refusal(path, "YAML file too large", f"up to {LARGEST_YAML} bytes")
        depth = 0
        for count, event in enumerate(yaml.parse(data.decode("utf-8"), Loader=yaml.SafeLoader)):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if isinstance(event, yaml.AliasEvent) or depth > 6 or count > 20_000:
                raise xml.refusal(path, "YAML with aliases, too deep or too long", "lists of names")
        found = yaml.safe_load(data.decode("utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise xml.refusal(path, f"not YAML: {' '.join(str(error).split())[:120]}", None) from None
    if not isinstance(found, dict) or not set(KEYS) & set(found):
        return None
    return found


def settings_beside(file: RobotFile) -> tuple[Path, dict[str, Any]] | None:
    """The YAML file beside a URDF that has no loops of its own and what it says, where there is one of this dialect."""
    if file.tag != "robot" or file.has("loop"):
        return None
    own = file.path.with_suffix(".yaml").name
    for name in dict.fromkeys((own, *(("robot.yaml", "robot.yml") if file.path.stem == "robot" else ()))):
        beside = file.path.with_name(name)
        if beside != file.path and os.path.isfile(beside):
            found = settings_in(beside)
            if found is not None:
                return beside, found
    return None
