"""Index of the public functions, from their declarations: ``make index`` writes ``index.json`` and ``__init__.pyi``.

``import hrsynth`` and the help of the command line read it instead of loading the analyses.
"""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from .options import NEEDED, Option

PACKAGE = Path(__file__).parent
INDEX, STUB = PACKAGE / "index.json", PACKAGE / "__init__.pyi"
MARK = "\n@analysis("
KINDS: dict[str, Any] = {"str": str, "int": int, "float": float, "bool": bool, "several": list[str]}
HELPERS = {
    "analysis.result_cache": ("clear_cache",),
    "analysis.parallel_map": ("map_robots",),
    "analysis.pose_requests": ("observe",),
    "certificates": ("certificate", "verify"),
    "description": ("list_examples", "list_robots", "load", "save", "to_mujoco", "to_urdf"),
    "kinematics.pinocchio_export": ("to_pinocchio",),
    "linting.lint": ("lint",),
    "mechanism.builder": ("build",),
    "present.show": ("draw", "html", "text", "to_json", "to_pandas"),
    "present.studio.server": ("studio",),
    "progress": ("on_progress",),
}
"""Public functions other than analyses of a robot, by module."""


@cache
def list_analyses() -> dict[str, dict[str, Any]]:
    """Return the declaration of each analysis by name, in the order of lists."""
    if not PACKAGE.is_dir():  # in an archive, which the command line refuses
        return {}
    found: dict[str, dict[str, Any]] = json.loads(INDEX.read_text(encoding="utf-8"))
    return found


@cache
def list_public_modules() -> dict[str, str]:
    """Return the module of each public function, below the package."""
    helpers = {name: module for module, names in HELPERS.items() for name in names}
    return helpers | {name: each["module"] for name, each in list_analyses().items()}


def list_analysis_options(name: str) -> list[Option]:
    """Return the options of an analysis."""
    return [_read(each) for each in list_analyses()[name]["options"]]


def _describe_option(option: Option) -> dict[str, Any]:
    """Encode an option for the index: the fields that differ from the defaults."""
    default = {each.name: each.default for each in fields(Option)}
    told = {name: value for name, value in asdict(option).items() if value != default[name]}
    kind = next(name for name, each in KINDS.items() if each == option.kind)
    needed = {"needed": True} if told.get("default") is NEEDED else {}
    return {**{name: value for name, value in told.items() if value is not NEEDED}, "kind": kind, **needed}


def _read(told: dict[str, Any]) -> Option:
    """Decode an option of the index."""
    given: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in told.items()}
    given["kind"] = KINDS[given["kind"]]
    if given.pop("needed", False):
        given["default"] = NEEDED
    return Option(**given)


def collect_declared() -> dict[str, dict[str, Any]]:
    """Collect the declarations from the modules, all of which are loaded."""
    found: dict[int, tuple[str, dict[str, Any]]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        if MARK not in path.read_text(encoding="utf-8"):
            continue
        place = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        for name, value in vars(import_module(f"hrsynth.{place}")).items():
            declaration = getattr(value, "declaration", None)
            if declaration is not None and value.__module__ == f"hrsynth.{place}":
                found[declaration.place] = (
                    name,
                    {
                        "module": place,
                        "help": declaration.help,
                        "seeded": declaration.seeded,
                        "examples": list(declaration.examples),
                        "options": [_describe_option(each) for each in declaration.options],
                    },
                )
    return dict(found[place] for place in sorted(found))


def format_index() -> str:
    """Return the content of ``index.json``."""
    rows = [f'"{name}": {json.dumps(each, ensure_ascii=False)}' for name, each in collect_declared().items()]
    return "{\n" + ",\n".join(rows) + "\n}\n"


def format_stub() -> str:
    """Return the content of ``__init__.pyi``: public functions with types, for editors and type checkers."""
    places = list_public_modules()
    lines = ['"""Made by make index."""', "", "from . import catalog as catalog"]
    lines += [
        f"from .{place} import {name} as {name}" for place, name in sorted((places[name], name) for name in places)
    ]
    public = "".join(f'    "{name}",\n' for name in sorted([*places, "__version__", "catalog"]))
    return "\n".join([*lines, "from .version import __version__ as __version__", "", f"__all__ = [\n{public}]", ""])


def write() -> None:
    """Write both files."""
    INDEX.write_text(format_index(), encoding="utf-8")
    list_analyses.cache_clear()
    list_public_modules.cache_clear()
    STUB.write_text(format_stub(), encoding="utf-8")
