"""Run as a program: expand the xacro file that is named, to standard output: a line of JSON that tells the file and the
line of each element, then the document; no files are written, none read elsewhere. What is wrong is one line of JSON
on standard error.

``$(find PACKAGE)`` stands for the folder, the file's own or one above it, that has what follows.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.dom import expatbuilder, minidom

MEMORY = 900_000_000
SECONDS = 4
LEVELS = 4
"""Folders above the file in which a package's files are looked for."""
MARK = "/find:package"


def located(spec: str, folder: Path) -> str:
    """The file that an include names; raises ``ValueError`` for what lies outside of the folder (of the package)."""
    if MARK in spec:
        rest = Path(spec.split(MARK)[-1].lstrip("/"))
        if ".." in rest.parts:
            raise ValueError(f"{rest} leaves the package")
        for home in (folder, *list(folder.parents)[:LEVELS]):
            for start in range(len(rest.parts)):
                candidate = home.joinpath(*rest.parts[start:])
                if candidate.is_file():
                    return str(candidate)
        raise ValueError(f"no folder above the file has {rest}")
    path = Path(spec) if Path(spec).is_absolute() else folder / spec
    if not path.resolve().is_relative_to(folder):
        raise ValueError(f"{spec} lies outside of the file's folder")
    return str(path)


class PlacedBuilder(expatbuilder.ExpatBuilderNS):
    """Builds a document whose elements know their ``place``: file and line."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file = file

    def start_element_handler(self, name: Any, attributes: Any) -> None:
        """Begin an element."""
        super().start_element_handler(name, attributes)
        begun: Any = self.curNode
        begun.place = (self.file, self.getParser().CurrentLineNumber)


def watched(xacro: Any) -> list[Any]:
    """Have the package keep the places of elements; the element that it has in hand is the one in the list."""
    at: list[Any] = []

    def telling(call: Callable[..., Any]) -> Callable[..., Any]:
        def told(node: Any, *args: Any, **options: Any) -> Any:
            at[:] = [node]
            return call(node, *args, **options)

        return told

    def cloned(node: Any, *args: Any) -> Any:
        made = clone(node, *args)
        if hasattr(node, "place"):
            made.place = node.place
        return made

    for name in ("check_attrs", "reqd_attrs", "handle_macro_call", "grab_property", "grab_macro", "process_include"):
        if hasattr(xacro, name):
            setattr(xacro, name, telling(getattr(xacro, name)))
    dom: Any = minidom
    clone = dom._clone_node
    dom._clone_node = cloned
    dom.parse = lambda stream: PlacedBuilder(stream.name).parseFile(stream)
    return at


def wrong(xacro: Any, error: Exception, at: list[Any]) -> dict[str, Any]:
    """What an error says, with file and line."""
    files = [each for each in getattr(xacro, "filestack", None) or [] if each]
    file, line = getattr(at[0], "place", (None, None)) if at else (None, None)
    if hasattr(error, "lineno"):  # no XML
        file, line = files[-1] if files else None, error.lineno
    said = str(error) or type(error).__name__
    macros = [each.body.getAttribute("name") for each in getattr(xacro, "macrostack", None) or []]
    told = " ".join(said.split()) + (f" (in macro {macros[-1]!r})" if macros else "")
    return {"file": file, "line": line, "said": told}


def main(name: str) -> None:
    """Expand one file under limits of time, memory and writing."""
    for limit, amount in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, SECONDS)):
        resource.setrlimit(limit, (amount, amount))
    import xacro
    from xacro import substitution_args

    folder = Path(name).resolve().parent
    substitution_args._eval_find = lambda package: MARK
    substitution_args._eval_env = lambda variable: ""
    xacro.abs_filename_spec = lambda spec: located(spec, folder)
    at = watched(xacro)
    try:
        made = xacro.process_file(name)
        places = [getattr(each, "place", None) for each in made.getElementsByTagName("*")]
        text = made.toxml()
    except Exception as error:
        sys.exit(json.dumps(wrong(xacro, error, at)))
    sys.stdout.write(json.dumps(places) + "\n" + text)


if __name__ == "__main__":
    main(sys.argv[1])
