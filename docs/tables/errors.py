"""The page of all errors, made while the site is built: exit statuses, and each class with its first sentence."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import TypeVar

from hrsynth import errors
from hrsynth.errors import HrsynthError

from .markdown import table

Kind = TypeVar("Kind", bound=Exception)

INTRODUCTION = """\
# Errors and exit status

| exit status | meaning |
| ---: | --- |
| 0 | There is a result. A verdict such as *uncontrollable* or *not found* is a result too. |
| 1 | `lint` found errors in a file. |
| 2 | The file or the request is wrong. Correct it. |
| 3 | File and request are right, but there is no result. The message names the reason. |
| 130 | The command was interrupted (Ctrl-C). |

Messages go to standard error, one line per defect; each begins with `hrsynth:`. A message about a file names the file
and, where it is known, the line. A message about a request names the option or argument and the values that it takes.

An error that is a defect of hrsynth itself is reported as such, with exit status 3. Set `HRSYNTH_DEBUG=1` to print its
traceback, and report it.

In Python the same errors are exceptions in `hrsynth.errors`. Each has `exit_status` and `lines()`, and keeps its facts
as attributes:

```python
import hrsynth

try:
    hrsynth.check("quattro", at="x=5")
except hrsynth.errors.PoseReachFailure as error:
    print(error.exit_status)  # → 3
    print(error.leg is None)  # → False
```
"""
SECTIONS = {
    2: "The file or the request is wrong (exit status 2)",
    3: "There is no result (exit status 3)",
}
WARNINGS = """\
## Warnings

In Python an assumption about a file is a warning at the line that loads it. The command line prints it as a message,
and the exit status does not change."""


def build_page() -> str:
    """Return the page in Markdown."""
    parts = [INTRODUCTION]
    for status, title in SECTIONS.items():
        kinds = [kind for kind in list_classes(HrsynthError) if kind.exit_status == status]
        parts.append(f"## {title}\n\n" + write_table(kinds))
    parts.append(f"{WARNINGS}\n\n" + write_table(list_classes(Warning)))
    return "\n".join(parts)


def write_table(kinds: Sequence[type[Exception]]) -> str:
    """Return the Markdown table of classes, each with the first sentence of its docstring."""
    return table(("class", "meaning"), ((f"`{kind.__name__}`", first_sentence(kind)) for kind in kinds))


def list_classes(base: type[Kind]) -> list[type[Kind]]:
    """Return the classes of ``hrsynth.errors`` below a base, in the order of the file."""
    return [
        kind
        for kind in vars(errors).values()
        if inspect.isclass(kind) and issubclass(kind, base) and kind.__module__ == errors.__name__
    ]


def first_sentence(kind: type) -> str:
    """Return the first sentence of a class's docstring, on one line, ended by a full stop."""
    text = " ".join((inspect.getdoc(kind) or "").split()).replace("``", "`")
    return text.partition(". ")[0].rstrip(".") + "."
