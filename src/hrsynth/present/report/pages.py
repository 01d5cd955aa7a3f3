"""Page of a report: data for the template, which has the words."""

from __future__ import annotations

import base64
from functools import cache
from typing import Any

from ...analysis.derive import Derivation
from ...characters import name_steering
from ...tolerances import RANK_GAP, SAME_RELATION
from ...version import __version__
from ..drawings import svg
from ..drawings.schematic import robot_svg
from ..maps import error_map
from ..modes import picture, why_undrawn
from ..palette import css
from ..portrait import Portrait
from ..text.poses import all_of, at_mode, proof_words
from ..text.robots import at_zero, exact_words, lost_rows, unseen
from ..text.runs import field_rows
from ..text.sentences import describe_held, noise_words, things
from ..text.tables import label_of
from .answer import answer, good, set_rows
from .figures import SOURCES, actuators, pairs, step_figures
from .formulas import collect_symbols, formula, lower_indices, underline_motors
from .parts import Parts, Refused, ask

LARGEST_LIST = 63
"""Largest number of leg sets in the table: all of six legs."""
PORTRAIT = (420.0, 330.0)
"""Width and height of the robot's drawing (pixels)."""


def robots(found: Derivation) -> dict[str, Any]:
    """Return the data of a robot and its derivation, by their names in the template."""
    name, observed = found.robot.name, [o.link for o in found.setup.observed]
    graphs = [robot_svg(found.setup.decomposition, observed=observed, title=f"Scheme of the real robot {name}")]
    if found.hidden is not None:
        title = f"Scheme of the hidden robot of {name}"
        graphs.append(robot_svg(found.hidden, observed=observed, virtual=actuators(found), title=title))
    return {
        "found": found,
        "setup": found.setup,
        "portrait": Portrait.of(found.setup).svg(*PORTRAIT),
        "name": name,
        "graphs": graphs,
        "real": str(found.architecture),
        "hidden": found.hidden_architecture and str(found.hidden_architecture),
        "things": things(found.setup),
        "observed": ["leg " * o.by_segment + label_of(o) for o in found.setup.observed],
    }


def page(found: Derivation, told: Parts) -> bytes:
    """Return the HTML page, self-contained, of a derivation and the other parts; a refused part shows its reason."""
    name, modes, errors = found.robot.name, told.modes, told.accuracy
    return name_steering(
        environment()
        .get_template("page.html.j2")
        .render(
            **robots(found),
            told=told,
            answer=list(answer(found, told)),
            pairs=pairs(found),
            errors=None
            if isinstance(errors, Refused)
            else (
                f"{errors.bounds.inside} of {noise_words(errors)}"
                if errors.bounds.noise is None
                else f"{errors.bounds.inside}, {noise_words(errors)}"
            ),
            held=describe_held(found.setup),
            scenes=step_figures(found),
            modes_picture=None
            if isinstance(modes, Refused) or why_undrawn(modes) is not None
            else _png(picture(modes)),
            map=errors if isinstance(errors, Refused) else ask(name, lambda: _png(error_map(errors))),
        )
    ).encode()


@cache
def environment(package: str = "") -> Any:
    """Load the templates of the report, and before them those of a ``package`` that extends them."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    own = [PackageLoader(package)] if package else []
    environment = Environment(
        loader=ChoiceLoader([*own, PackageLoader("hrsynth.present.report", ".")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "barred": lambda text: Markup(underline_motors(text)),
        "indexed": lambda text: Markup(lower_indices(text)),
        "sentence": lambda text: text[:1].upper() + text[1:].rstrip(".") + ".",
        "pose": lambda pose: str(pose).replace(",", ", "),
        "angle": lambda value: "" if value is None else f"{value:.1e}",
    }
    environment.tests["refused"] = lambda part: isinstance(part, Refused)
    environment.globals.update(
        all_of=all_of,
        at_mode=at_mode,
        collected=collect_symbols,
        exact_words=exact_words,
        lost=lost_rows,
        palette=css(),
        svg=svg,
        at_zero=at_zero,
        field_rows=field_rows,
        formula=formula,
        good=good,
        most=LARGEST_LIST,
        proved=proof_words,
        rank_gap=RANK_GAP,
        same_relation=SAME_RELATION,
        sources=SOURCES,
        version=__version__,
        set_rows=set_rows,
        unseen=unseen,
    )
    return environment


def _png(content: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(content).decode()
