"""The page: everything that is shown, as text and drawings, set by a template."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from ... import __version__
from ...analysis.accuracy.accuracy import Accuracy
from ...analysis.controllability import Legs
from ...analysis.derive import Derivation
from ...analysis.modes.modes import AssemblyModes
from ...analysis.singularity.singular import Singularity
from ...errors import BadRequest
from ...tolerances import RANK_GAP, SAME_RELATION
from ..drawings.graph import graph_svg
from ..maps import error_map
from ..modes import nothing
from ..modes import picture as modes_picture
from ..text.poses import all_of, at_mode, proved
from ..text.robots import exact_cell, exact_words
from ..text.runs import field_rows
from .formulas import barred, collected, formula, indexed
from .legs import actuators, pairs
from .parts import Parts, Refused, parts, reason
from .steps import SOURCES, scenes

LARGEST_LIST = 63
"""Sets of legs in the table at most: all of six legs; of more, the smallest sets."""


def report(found: Derivation, *, seed: int = 0) -> str:
    """The report of a derivation as a page of HTML without references to anything outside; ``seed`` is the one that the
    derivation was asked with. The other parts are computed here (seconds to a minute)."""
    return page(found, parts(found, seed)).decode()


def page(found: Derivation, told: Parts) -> bytes:
    """The page that says a derivation and the other parts; what is refused is told with its reason."""
    return str(_template().render(version=__version__, **_robot(found), **_derivation(found), **_rest(told))).encode()


@cache
def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(loader=PackageLoader("hrsynth.present.report", "."), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["barred"] = lambda text: Markup(barred(text))
    environment.filters["indexed"] = lambda text: Markup(indexed(text))
    environment.filters["sentence"] = lambda text: text[:1].upper() + text[1:].rstrip(".") + "."
    environment.filters["pose"] = lambda text: text.replace(",", ", ")
    environment.filters["angle"] = lambda value: "" if value is None else f"{value:.1e}"
    return environment.get_template("page.html.j2")


def _robot(found: Derivation) -> dict[str, Any]:
    """The heading, what is asked, and both robots side by side."""
    setting, hidden = found.setting, found.hidden_architecture
    mobility, reference = found.mobility, setting.mechanism.reference
    observed = [o.link for o in setting.observed]
    facts = [
        ("Degrees of freedom", f"{found.dof} (mobility {mobility.total}, of which {mobility.idle} idle)"),
        ("Observed", ", ".join(f"leg {o.leg} ({o.link})" for o in setting.observed)),
        ("Verdict", found.verdict.verdict),
        ("Architecture", exact_words(found.exact, found.verdict.rank)),
    ]
    if reference != setting.mechanism.base:
        facts.insert(2, ("Camera on", reference))
    if setting.anatomy.point is not None:
        facts.insert(1, ("Platform", "a point: its velocity is what is controlled, its turn is idle"))
    if found.verdict.lost:
        facts.append(("Lost at the zero configuration", "; ".join(each.name for each in found.verdict.lost)))
    if not found.verdict.graph:
        facts.append(("Interaction matrix", "there is none: observed links move while the platform rests"))
    return {
        "name": found.robot.name, "facts": facts, "real": str(found.architecture), "hidden": hidden and str(hidden),
        "real_graph": _drawing(graph_svg(setting.anatomy, observed=observed,
                                         title=f"Joint graph of the real robot {found.robot.name}")),
        "hidden_graph": None if found.hidden is None else _drawing(
            graph_svg(found.hidden, observed=observed, virtual=actuators(found),
                      title=f"Joint graph of the hidden robot of {found.robot.name}")),
        "pairs": pairs(found),
    }


def _derivation(found: Derivation) -> dict[str, Any]:
    """The steps and the proof."""
    certificate, paper = found.certificate, found.paper
    proof = [
        ("Result", ("passed" if certificate.passed else "failed") + (f": {certificate.reason}" if certificate.reason
                                                                     else "")),
        ("Configurations", f"{certificate.samples} ({certificate.discarded} discarded)"),
        ("Largest angle between the relations",
         f"{certificate.largest_angle:.1e} rad (allowed {SAME_RELATION:.0e})"),
        ("Smallest rank gap", f"{certificate.smallest_gap:.1e} (needed {RANK_GAP:.0e})"),
        ("Follows the real robot to", f"{certificate.residual:.1e} (characteristic lengths, radians)"),
    ]
    if paper is not None:
        proof.append(("The form that the paper's rules alone give",
                      f"{paper.hidden}: {'equivalent' if paper.equivalent else 'not equivalent'} ({paper.reason})"))
        proof += [("It gains", each.name) for each in paper.gains] + [("It loses", each.name) for each in paper.loses]
    return {"steps": found.steps, "sources": SOURCES, "scenes": scenes(found), "proof": proof, "form": found.form}


def _rest(found: Parts) -> dict[str, Any]:
    return {"legs": _part(found.legs, _legs), "singularity": _part(found.singularity, _singularity),
            "modes": _part(found.modes, _modes), "accuracy": _part(found.accuracy, _accuracy)}


def _part(found: Any, told: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
    """A part's content, with ``refused`` None or the reason."""
    return {"refused": found.reason} if isinstance(found, Refused) else {"refused": None, **told(found)}


def _legs(found: Legs) -> dict[str, Any]:
    rows = [{"legs": ", ".join(each.legs), "verdict": each.verdict, "rank": f"{each.rank} of {each.dof}",
             "exact": exact_cell(exact, each.rank), "lost": "; ".join(freedom.name for freedom in each.lost),
             "smallest": each.legs in found.minimal}
            for each, exact in zip(found.sets, found.exact, strict=True)]
    return {"rows": rows[:LARGEST_LIST], "left": max(len(rows) - LARGEST_LIST, 0), "complete": found.complete,
            "minimal": ["{" + ", ".join(each) + "}" for each in found.minimal]}


def _singularity(found: Singularity) -> dict[str, Any]:
    condition, checked = found.condition, found.checked
    told: dict[str, Any] = {"words": found.words, "formula": None, "where": [], "checked": None, "examples": [],
                            "never": condition is not None and condition.never}
    if condition is not None and not condition.never:
        told["formula"] = _drawing(formula(condition.expression, f"{condition.expression} = 0"))
        told["where"] = collected(condition.where)
    if checked is not None:
        told["checked"] = (f"Compared with the rank at {checked.points} random poses and {len(checked.on_locus)} poses "
                           f"on the locus: {checked.disagreements} disagreements.")
    told["examples"] = [(str(each.pose), f"{each.sigma:.1e}", "; ".join(freedom.name for freedom in each.lost))
                        for each in found.examples]
    return told


def _modes(found: AssemblyModes) -> dict[str, Any]:
    count, why = found.found, nothing(found)
    rows = [{"number": number, "pose": str(mode.pose) + (" (the pose itself)" if mode.goal else ""),
             "proved": proved(mode), "there": "; ".join(at_mode(mode, found.kind))}
            for number, mode in enumerate(found.modes, 1)]
    words = None
    if count.continuum is None:
        words = f"{len(found.modes)} real of {count.complex} complex, {all_of(found)}."
    return {"pose": str(found.pose), "words": words, "proof": words and count.proof, "special": count.degenerate,
            "rows": rows, "near": [(str(mode.pose), f"{mode.residual:.2e}") for mode in found.near],
            "picture": None if why is not None else _png(modes_picture(found)),
            "alt": "On the left the curves whose meeting points are the modes, on the right "
                   f"{found.setting.robot.name} at each of its {len(found.modes)} assembly modes, numbered as in the "
                   "table."}


def _accuracy(found: Accuracy) -> dict[str, Any]:
    assert found.field is not None
    try:
        picture = _png(error_map(found))
    except BadRequest as error:
        return {"refused": reason(error, found.setting.robot.name)}
    rows = field_rows(found.field)
    return {"rows": [(key.capitalize() or "Also", value) for key, value in rows], "picture": picture,
            "cone": f"{np.degrees(found.cones[0]):.3g}°",
            "alt": "Map of the largest errors: " + "; ".join(f"{key} {value}" for key, value in rows if key)}


def _png(content: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(content).decode()


def _drawing(text: str) -> Any:
    """SVG or MathML that the template takes as it is."""
    from markupsafe import Markup

    return Markup(text)
