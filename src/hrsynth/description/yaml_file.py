"""YAML files: read without trust, each text with its line. Imported where a YAML file is read, not before."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from ..geometry.vectors import Array
from . import xml
from .elements import FileReader

YAML_FILE_MAX_BYTES = 1_000_000
"""Bytes of a YAML file above which it is not read."""
YAML_EVENTS_MAX = 20_000
"""Values, starts and ends of a YAML file above which it is not read."""
YAML_DEPTH_MAX = 6
"""Number of mappings and lists in each other above which a YAML file is not read."""
YAML_NAME_CHARACTERS_MAX = 200
"""Letters above which a text is no name."""


class YamlText(str):
    """Text of a YAML file, a key or a value, with its line."""

    line: int


class _Loader(yaml.BaseLoader):
    """Loader that takes all scalars as text and refuses aliases, tags, depth and length as soon as they occur."""

    count = depth = 0

    def get_event(self) -> Any:
        event = super().get_event()
        self.count += 1
        self.depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if (
            isinstance(event, yaml.AliasEvent)
            or getattr(event, "tag", None)
            or self.depth > YAML_DEPTH_MAX
            or self.count > YAML_EVENTS_MAX
        ):
            what = "YAML with aliases, tags, deep nesting or too many entries"
            raise xml.make_file_error(
                self.name, what, "plain texts, lists and mappings", line=event.start_mark.line + 1
            )
        return event

    def construct_scalar(self, node: Any) -> YamlText:
        text = YamlText(super().construct_scalar(node))
        text.line = node.start_mark.line + 1
        return text

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        mapping = super().construct_mapping(node, deep)
        if len(mapping) < len(node.value):
            raise xml.make_file_error(self.name, "a key that is given twice", line=node.start_mark.line + 1)
        return mapping


def read_yaml(path: Path) -> Any:
    """Return the content of a YAML file: texts with their lines (:class:`YamlText`), lists, mappings. Raises
    ``BadRobotFile``."""
    data = xml.read_bytes(path)
    if len(data) > YAML_FILE_MAX_BYTES:
        raise xml.make_file_error(path, "YAML file too large", f"up to {YAML_FILE_MAX_BYTES} bytes")
    try:
        loader = _Loader(data.decode("utf-8"))
        loader.name = str(path)
        return loader.get_single_data()
    except (yaml.YAMLError, RecursionError, ValueError, ArithmeticError, LookupError) as error:
        what, mark = getattr(error, "problem", None) or str(error), getattr(error, "problem_mark", None)
        line = None if mark is None else mark.line + 1
    raise xml.make_file_error(path, f"not YAML: {' '.join(what.split())[:120]}", "a whole YAML file", line=line)


def get_line(value: Any) -> int | None:
    """Return the line of a text, or of the first text in a list or mapping."""
    if isinstance(value, YamlText):
        return value.line
    return next((line for each in value or () if (line := get_line(each)) is not None), None)


@dataclass
class YamlReader(FileReader):
    """YAML file and its defects; base of the readers of all YAML formats. Absent values are None."""

    def mapping(self, value: Any, what: str, keys: Collection[str] = ()) -> dict[str, Any]:
        """Return a mapping; anything else, and a key that is not one of ``keys`` (none: any), is a defect."""
        if not isinstance(value, dict):
            self.defect(get_line(value), f"{what}: not a mapping", None, "KEY: VALUE")
            return {}
        for key in value if keys else ():
            if key not in keys:
                self.defect(get_line(key), f"{what}: unknown key", key, ", ".join(keys))
        return {str(key): each for key, each in value.items()}

    def sequence(self, value: Any, what: str) -> list[Any]:
        """Return a list, empty if absent; anything else is a defect."""
        if value is not None and not isinstance(value, list):
            self.defect(get_line(value), f"{what}: not a list", None, "a list")
        return value if isinstance(value, list) else []

    def name(self, value: Any, what: str, line: int | None = None) -> str | None:
        """Return a name; anything else is a defect and None. ``line`` is that of an absent one."""
        if isinstance(value, str) and 0 < len(value) <= YAML_NAME_CHARACTERS_MAX:
            return str(value)
        problem = f"{what} without a name" if value is None else f"{what}: {str(value)[:60]!r} is not a name"
        self.defect(get_line(value) or line, problem, None, "a name")
        return None

    def numbers(self, value: Any, default: Iterable[float], what: str) -> Array:
        """Return the numbers of a list, as many as the default has; the default if absent or wrong."""
        text = " ".join(map(str, value)) if isinstance(value, list) else value
        return self.values(text, default, get_line(value), what)
