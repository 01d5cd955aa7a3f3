"""Templates, filled in; what stands in them is made safe."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

from .structures import named

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


def rendered(template: str, **values: Any) -> str:
    """The text of a template with these values."""
    return _environment().get_template(template).render(values)


def notation(text: str) -> Markup:
    """An architecture with lines under its motors, as HTML."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"(.)\*", r"<u>\1</u>", str(escape(text.replace("Pi", "Π")))))


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(loader=PackageLoader("hrsynth.catalog.site"), autoescape=True, trim_blocks=True,
                       lstrip_blocks=True, undefined=StrictUndefined)
    made.filters.update(notation=notation, named=named)
    return made
