"""The text of a program in each language: templates filled with the formulas and cells of a branch."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..characters import name_steering
from ..tolerances import GENERATED_LAST_STEP_MAX
from .branch_cells import GENERATED_CLOSURE_TOL
from .inverse import trace_inverse
from .source import Source
from .trace import TracedFunction
from .tracker import Tracker

if TYPE_CHECKING:
    from jinja2 import Environment

GENERATED_NEWTON_STEP_TOL = 1e-7
"""Newton step (characteristic lengths, radians) after which generated code makes its last one."""
GENERATED_NEWTON_STEPS_MAX = 8
"""Largest number of Newton steps of generated code per part of the loops."""
GENERATED_POSE_TOL = 1e-12
"""Difference from a pose at which generated code has reached it (rad; lengths as above)."""
GENERATED_PIVOT_MIN_FRACTION = 1e-14
"""Relative pivot of the normal equations below which generated code reports singular rates."""
GENERATED_INVERSE_STEPS_MAX = 20
"""Largest number of steps of generated code from motors to motors toward a pose."""
GENERATED_ROUNDING_UNITS_COUNT = 64
"""Least tolerance of generated Python code, in rounding units of its arrays; it counts in single precision."""

GENERATED_BATCH_STEPS_COUNT = 5
"""Steps of Newton's method of generated Python code from the middle of a tube, tested at its corners."""
GENERATED_TUBE_RADIUS_MIN = 1e-12
"""Smallest radius of a tube that a tracker proves (characteristic lengths, radians)."""
GENERATED_ERROR_MAX = 1e-9
"""Largest error of an answer that a tracker continues (characteristic lengths, radians)."""

TEMPLATES = {"c++": "header.hpp.j2", "python": "module.py.j2"}
"""The languages."""
TAKEN = frozenset(
    re.findall(
        r"\w+",
        """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t class compl const
    const_cast constexpr continue decltype default delete do double dynamic_cast else enum explicit export extern false
    float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private
    protected public register reinterpret_cast return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename union unsigned using virtual void volatile wchar_t
    while xor xor_eq Eigen detail main std
    BUFSIZ EDOM EOF FILE ERANGE HUGE_VAL INFINITY M_E M_PI NAN NDEBUG NULL RAND_MAX errno linux stderr stdin stdout unix
    Branch DIRECTIONS DIRECTION_NAMES
    Jacobians LOWER MOTORS MOTOR_NAMES Motors PASSIVE PASSIVE_NAMES Passive Solution
    Status UPPER forward inverse jacobians unique""",
    )
)
"""Keywords of C++17, names from included headers, macros, and the header's own names (ambiguous where the namespace is
used)."""
RESERVED = re.compile(
    r"[a-z]\w*_t|(CHAR|CLOCK|DBL|EIGEN|FE|FLT|FP|INT\d*|LC|LONG|M|SEEK|SHRT|SIZE|UINT\d*)_[A-Z0-9_]+"
    r"|(pthread|sched|posix|fmaximum|fminimum)_\w+|\w+_unlocked|__\w+__|_[A-Z]\w*"
)
"""Types, macros and function families of the C library, and names of the compiler (``__linux__``)."""


def make_namespace(name: str) -> str:
    """Return the name of a robot as a namespace of C++."""
    found = re.sub(r"[^0-9A-Za-z_]|^(?=\d)", "_", name) or "robot"
    taken = found in TAKEN or found in _list_c_names() or RESERVED.fullmatch(found)
    return f"{found}_" if taken else found


@cache
def _list_c_names() -> frozenset[str]:
    """Return the names of the C library's functions."""
    text = Path(__file__).with_name("c_names.toml").read_text(encoding="utf-8")
    return frozenset(tomllib.loads(text)["names"].split())


def _format_comment(text: str) -> str:
    """Return a text that is safe in a comment: it neither ends nor continues it, and selects no encoding."""
    line = "".join(each if each.isprintable() and each != "\\" else "_" for each in text)
    return re.sub(r"coding(?=[:=])", "coding ", line)


def _list_unused_arguments(arguments: str, function: TracedFunction) -> str:
    """Return the arguments that a C++ function may not use, as written after ``(void)``."""
    stored = {array for array, _, _ in function.stores}
    names = re.findall(r"& (\w+)", arguments)
    return ", (void)".join(name for name in names if name not in stored)


def render_program(source: Source, language: str, told: Sequence[str]) -> str:
    """Render the program in a language, with header lines ``told``; deterministic."""
    branch, mechanism = source.branch, source.branch.system.mechanism
    arguments = "const Motors& q, const Unknowns& x, "
    functions = [("platform", f"{arguments}Eigen::Matrix3d& R, Eigen::Vector3d& p", source.platform)]
    if source.cut:
        functions += [
            ("cut", f"{arguments}Eigen::Matrix<double, CUT, 1>& O", source.cut_values),
            ("cut_slopes", f"{arguments}Eigen::Matrix<double, CUT, MOTORS + UNKNOWNS>& C", source.cut_slopes),
        ]
    d = len(source.observed)
    moving = "Eigen::Matrix<double, 6, MOTORS + UNKNOWNS>& V"
    if d:
        moving += (
            ", Eigen::Matrix<double, 3 * DIRECTIONS, 1>& u, Eigen::Matrix<double, 3 * DIRECTIONS, MOTORS + UNKNOWNS>& W"
        )
    functions.append(("rates", arguments + moving, source.rates))
    values: dict[str, Any] = {
        "robot": mechanism.name,
        "told": told,
        "name": make_namespace(mechanism.name),
        "source": source,
        "m": len(branch.motors),
        "p": len(branch.passive),
        "c": len(source.cut),
        "d": d,
        "inverse": GENERATED_INVERSE_STEPS_MAX,
        "parts": source.parts,
        "functions": functions,
        "lower": [float(x) for x in branch.lower],
        "upper": [float(x) for x in branch.upper],
        "back": [[float(x) for x in end] for end in branch.injective_box or ()],
        "motor_names": source.names(branch.motors),
        "passive_names": [*source.names(branch.passive), *source.cut],
        "direction_names": [observation.leg for observation in source.observed],
        "turning": [int(not branch.system.coordinates[i].slides) for i in branch.motors],
        "length": repr(float(mechanism.length)),
        "near": GENERATED_NEWTON_STEP_TOL,
        "newton": GENERATED_NEWTON_STEPS_MAX,
        "steps": GENERATED_BATCH_STEPS_COUNT,
        "closing": GENERATED_CLOSURE_TOL,
        "single": GENERATED_ROUNDING_UNITS_COUNT,
        "last_step": GENERATED_LAST_STEP_MAX,
        "legs": source.legs and trace_inverse(source.legs),
        "far": repr(branch.far),
        "reached": GENERATED_POSE_TOL,
        "turn": repr(2 * math.pi),
        "singular": GENERATED_PIVOT_MIN_FRACTION,
        **(_describe_tracker(source, source.tracker) if source.tracker else {}),
    }
    return name_steering(_load_templates().get_template(TEMPLATES[language]).render(**values))


def _describe_tracker(source: Source, tracker: Tracker) -> dict[str, Any]:
    """Return the values of a tracker's template."""
    zero, units = tracker.system.zero, tracker.system.units
    variables = {"q": list(source.branch.motors), "x": list(source.branch.passive)}
    return {
        "tracked": tracker.parts,
        "checked": tracker.checked,
        "checked_count": tracker.checked_count,
        "closed": GENERATED_CLOSURE_TOL,
        "limits": tracker.limits(source.branch, source.cut),
        "thinnest": GENERATED_TUBE_RADIUS_MIN,
        "error": GENERATED_ERROR_MAX,
        **{f"zero_{name}": zero[places].tolist() for name, places in variables.items()},
        **{f"unit_{name}": units[places].tolist() for name, places in variables.items()},
    }


@cache
def _load_templates() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("hrsynth.codegen", ""), undefined=StrictUndefined, keep_trailing_newline=True
    )
    made.filters["quoted"] = lambda names: ", ".join(json.dumps(name, ensure_ascii=False) for name in names)
    made.filters["comment"] = _format_comment
    made.filters["unused"] = _list_unused_arguments
    made.filters["name_of"] = lambda place, names: names[place]
    return made
