"""Tables, rows of names with values, and the first rows of most outputs."""

from __future__ import annotations

import csv
import io
import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from ...tolerances import FIRST_ORDER_POSE_ERROR_MAX

if TYPE_CHECKING:
    from ...analysis.observed import ObservedRobot
    from ...kinematics.joint_coordinates import FileCoordinates
    from ...mechanism import Mechanism, Observation

Rows = list[tuple[str, str | Sequence[str]]]
"""Names with values: several are printed below each other, none is no row."""
NOT_BOUNDED = "not bounded to first order"
GAP: Rows = [("", "")]
"""An empty line."""
LINE, LEAST = 100, 30
"""Width of a table, and smallest width of its last column, which is wrapped."""
TABLE_NAME_COLUMNS_MAX = 14
"""Width of the column of names, at most."""


def encode_csv(rows: Iterable[Iterable[Any]]) -> bytes:
    """Format rows, headers first, as comma-separated values."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue().encode()


def measure_width(text: str) -> int:
    """Return the width of ``text`` in columns (combining low lines have none)."""
    return sum(1 for character in text if character != "\u0332")


def format_table(rows: Sequence[Sequence[str]], heads: Sequence[str]) -> str:
    """Format columns separated by two spaces, a rule below the headers, the last column wrapped."""
    before = sum(max(measure_width(row[i]) for row in (heads, *rows)) + 2 for i in range(len(heads) - 1))
    all_samples = [list(heads)]
    for *cells, last in rows:
        first, *more = wrap_lines(last, max(LINE - before, LEAST))
        all_samples += [[*cells, first], *([*[""] * len(cells), line] for line in more)]
    columns = [max(measure_width(row[i]) for row in all_samples) for i in range(len(heads))]

    def line(row: Sequence[str]) -> str:
        cells = [cell + " " * (columns[i] - measure_width(cell)) for i, cell in enumerate(row)]
        return "  ".join(cells).rstrip()

    return "\n".join([line(heads), "  ".join("-" * size for size in columns), *map(line, all_samples[1:])])


def wrap_lines(text: str, columns: int = LINE, more: str = "") -> list[str]:
    """Wrap a text without breaking words, vectors or sets; further lines begin with ``more``."""
    whole = re.sub(r"\([-+.e\d ]+\)|\{[^}]*\}", lambda found: found[0].replace(" ", "\u00a0"), text)
    lines = textwrap.wrap(whole, columns, subsequent_indent=more, break_long_words=False, break_on_hyphens=False)
    return [line.replace("\u00a0", " ") for line in lines] or [""]


def format_listing(rows: Iterable[tuple[str, str | Sequence[str]]]) -> str:
    """Format a line per value, the values below each other, the name before the first."""
    lines = [
        (name if i == 0 else "", value)
        for name, values in rows
        for i, value in enumerate([values] if isinstance(values, str) else values)
    ]
    head = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{head}}  {value}".rstrip() for name, value in lines)


def list_words(words: Sequence[str]) -> str:
    """Join words as in a sentence: one, two and three."""
    return ", ".join(words[:-1]) + " and " * (len(words) > 1) + words[-1]


def name_all(noun: str, words: Sequence[str]) -> str:
    """Name several things of a kind: leg 1; legs 1, 2 and 4."""
    return f"{noun}{'s' * (len(words) > 1)} {list_words(words)}"


def check_bounded(error: Any, length: float = 1.0) -> Any:
    """Return True for a displacement (m, with a characteristic ``length``) or a rotation (rad) that is small enough for
    the first order."""
    return error <= FIRST_ORDER_POSE_ERROR_MAX * length


def format_known_row(name: str, value: str | None) -> Rows:
    """Return a row, none if the value is None."""
    return [] if value is None else [(name, value)]


def format_joint_rows(found: FileCoordinates | None, beyond: Sequence[str] = ()) -> Rows:
    """Return the rows of motor and joint coordinates of a configuration, and of those beyond joint limits."""
    from ...mechanism.pose import format_coordinates

    rows = [] if found is None else [("motors", found.motors), ("joints", found.joints)]
    told = [
        (name, ", ".join(f"{joint} {format_coordinates(x)}" for joint, x in each.items()))
        for name, each in rows
        if each
    ]
    if found is not None and found.line is not None:
        meaning = ": the straight line of these coordinates from zero leads here, by one continuation"
        told.append(("line", found.line + meaning * (found.line == "proved")))
    return [*told, *format_known_row("limits", f"exceeded: {', '.join(beyond)}" if beyond else None)]


def format_dropped_limits(setup: ObservedRobot) -> Rows:
    """Return the row of joints whose limits are ignored."""
    joints = ", ".join(setup.limits_ignored)
    return [("limits", f"ignored: {joints}, as they are parts of other joints")] if joints else []


def format_robot_row(robot: Mechanism, words: str = "") -> tuple[str, list[str]]:
    """Return the row of the robot, its platform and how that was chosen."""
    return "robot", [f"{robot.name}   {words}".rstrip(), f"platform: {robot.platform_words}"]


def format_head_rows(found: ObservedRobot) -> Rows:
    """Return the rows of the robot and its observations."""
    seen = ", ".join(label_of(each).replace(" ", "\u00a0") for each in found.observed)
    return [
        format_robot_row(found.robot, str(found.decomposition.architecture())),
        ("observed", wrap_lines(seen, LINE - TABLE_NAME_COLUMNS_MAX)),
    ]


def label_of(observation: Observation) -> str:
    """Return the label of an observation, with its kind."""
    what = observation.link if observation.is_segment_direction else describe_observation(observation)
    return f"{observation.leg} ({what})"


def describe_observation(observation: Observation) -> str:
    """Describe an observation: ``point of plate by hand``."""
    told = observation.to_dict()
    if "joint" in told:
        return f"encoder of {told['joint']}"
    of, by = observation.link, told["camera"] or observation.seen_from
    return (
        f"inclination of {by}"
        if told["kind"] == "inclination"
        else f"{observation.kind} of {of}" + (f" by {by}" if by else "")
    )


def describe_watched(found: ObservedRobot) -> dict[str, list[str]]:
    """Return the observed links of each leg with the axis in the link frame, and the reason of the choice."""
    from ...analysis.freedoms import format_point
    from ...analysis.setup_records import list_observed_axes

    told: dict[str, list[str]] = {}
    for o, said in zip(found.observed, list_observed_axes(found), strict=True):
        places = {"at": said["at"], "along": said["axis"]}
        where = "".join(f" {word} {format_point(at)}" for word, at in places.items() if at is not None)
        what = o.link if o.is_segment_direction else describe_observation(o)
        told.setdefault(o.leg, []).append(f"{what}{where}{' of its frame' * bool(where)}, {said['reason']}")
    return told


def format_camera_rows(found: ObservedRobot) -> Rows:
    """Return the row of the link that carries the camera, unless it is the base."""
    reference = found.mechanism.reference
    return format_known_row("camera on", reference if reference != found.mechanism.base else None)


def format_sets(found: Iterable[Iterable[str]]) -> list[str]:
    """Format sets of names in braces."""
    return ["{" + ", ".join(each) + "}" for each in found]
