"""Page of a report: data for the template, which has the words."""

from __future__ import annotations

import base64
from functools import cache
from typing import Any

from ...analysis.derive import Derivation
from ...characters import name_steering
from ...tolerances import RANK_GAP_MIN, RELATION_ANGLE_TOL
from ...version import __version__
from ..drawings import svg
from ..drawings.schematic import draw_robot_svg
from ..maps import draw_error_map
from ..modes import draw_modes, explain_no_figure
from ..palette import format_css
from ..portrait import Portrait
from ..text.poses import describe_at_mode, describe_completeness, describe_proof
from ..text.robots import describe_exact, describe_zero, format_unobserved_cell, format_unobserved_rows
from ..text.runs import format_field_rows
from ..text.sentences import describe_held, describe_noise, name_set_members
from ..text.tables import label_of
from .answer import answer, is_fully_observed, set_rows
from .figures import SOURCES, list_leg_figures, list_virtual_actuators, step_figures
from .formulas import collect_symbols, format_formula, lower_indices, underline_motors
from .parts import Parts, RefusedPart, ask

REPORT_LEG_SETS_MAX = 63
"""Largest number of leg sets in the table: all of six legs."""
PORTRAIT = (420.0, 330.0)
"""Width and height of the robot's drawing (pixels)."""


def describe_robot(found: Derivation) -> dict[str, Any]:
    """Return the data of a robot and its derivation, by their names in the template."""
    name, observed = found.robot.name, [o.link for o in found.setup.observed]
    graphs = [draw_robot_svg(found.setup.decomposition, observed=observed, title=f"Scheme of the real robot {name}")]
    if found.hidden is not None:
        title = f"Scheme of the hidden robot of {name}"
        graphs.append(
            draw_robot_svg(found.hidden, observed=observed, virtual=list_virtual_actuators(found), title=title)
        )
    return {
        "found": found,
        "setup": found.setup,
        "portrait": Portrait.of(found.setup).svg(*PORTRAIT),
        "name": name,
        "graphs": graphs,
        "real": str(found.architecture),
        "hidden": found.hidden_architecture and str(found.hidden_architecture),
        "things": name_set_members(found.setup),
        "observed": ["leg " * o.is_segment_direction + label_of(o) for o in found.setup.observed],
    }


def render_report(found: Derivation, told: Parts) -> bytes:
    """Return the HTML page, self-contained, of a derivation and the other parts; a refused part shows its reason."""
    name, modes, errors = found.robot.name, told.modes, told.accuracy
    return name_steering(
        load_environment()
        .get_template("page.html.j2")
        .render(
            **describe_robot(found),
            told=told,
            answer=list(answer(found, told)),
            pairs=list_leg_figures(found),
            errors=None
            if isinstance(errors, RefusedPart)
            else (
                f"{errors.bounds.inside} of {describe_noise(errors)}"
                if errors.bounds.noise is None
                else f"{errors.bounds.inside}, {describe_noise(errors)}"
            ),
            held=describe_held(found.setup),
            scenes=step_figures(found),
            modes_picture=None
            if isinstance(modes, RefusedPart) or explain_no_figure(modes) is not None
            else _encode_png(draw_modes(modes)),
            map=errors if isinstance(errors, RefusedPart) else ask(name, lambda: _encode_png(draw_error_map(errors))),
        )
    ).encode()


@cache
def load_environment(package: str = "") -> Any:
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
    environment.tests["refused"] = lambda part: isinstance(part, RefusedPart)
    environment.globals.update(
        all_of=describe_completeness,
        at_mode=describe_at_mode,
        collected=collect_symbols,
        exact_words=describe_exact,
        lost=format_unobserved_rows,
        palette=format_css(),
        svg=svg,
        at_zero=describe_zero,
        field_rows=format_field_rows,
        formula=format_formula,
        good=is_fully_observed,
        most=REPORT_LEG_SETS_MAX,
        proved=describe_proof,
        rank_gap=RANK_GAP_MIN,
        same_relation=RELATION_ANGLE_TOL,
        sources=SOURCES,
        version=__version__,
        set_rows=set_rows,
        unseen=format_unobserved_cell,
    )
    return environment


def _encode_png(content: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(content).decode()
