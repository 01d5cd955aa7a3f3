"""Commands on files: robots, convert, verify."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NotRequired, TypedDict

from ..options import NEEDED, OUTPUT, Option, flag, output
from ..records import Head, OfRobot, Platform
from . import options
from .colour import print_text
from .commands import Group, add_command
from .options import EXPLAIN, JSON, SOURCE, load_robot, warn
from .progress import Progress

if TYPE_CHECKING:
    from ..geometry.vectors import Array
    from ..mechanism.model import Mechanism

KEYFRAME = "start"
"""Name of the keyframe that ``convert --at`` writes."""


class ShippedRobotRecord(TypedDict):
    """A robot; for a shipped one also its architecture, source and dimensions."""

    name: str
    file: str
    architecture_ascii: NotRequired[str]
    dof: NotRequired[int]
    section: NotRequired[str]
    dimensions: NotRequired[str]


class Robots(Head):
    """Robots that come with the package."""

    robots: list[ShippedRobotRecord]


class Convert(OfRobot):
    """A robot that was written in another format, with warnings of content left out."""

    file: str
    files: list[str]
    links: int
    joints: int
    warnings: list[str]


class Verify(Head):
    """An accepted certificate, and what it proves."""

    robot: NotRequired[str]
    platform: NotRequired[Platform]
    notes: NotRequired[list[str]]
    file: str
    accepted: bool
    proved: str


def list_format_names() -> list[str]:
    """Return the names of the formats that are written."""
    from ..description.formats import list_writable_formats

    return [each.name for each in list_writable_formats()]


def _describe_formats() -> str:
    """Return the formats that are written, with the extensions of their files."""
    from ..description.formats import list_writable_formats

    words = [f"{each.name} ({' '.join(each.endings)})" for each in list_writable_formats()]
    return f"Format, whatever the extension: {', '.join(words)}."


def print_robots(examples: bool, json: bool) -> None:
    """Print a table of the shipped robots, or of those of the package example-robot-data."""
    from ..description import list_examples as found
    from ..description import list_robots
    from ..families.table import ROBOTS
    from ..mechanism.notation import parse
    from ..present.show import format_record
    from ..present.text.tables import format_table

    if examples:
        if json:
            print_text(
                format_record(
                    "robots",
                    None,
                    {"robots": [{"name": f"example:{name}", "file": str(file)} for name, file in found().items()]},
                )
            )
        else:
            print_text(
                format_table(
                    [(f"example:{name}", file.suffix[1:], file.parts[-3]) for name, file in found().items()],
                    ("name", "format", "from example-robot-data"),
                )
            )
        return
    files = list_robots()
    if json:
        rows = [
            {
                "name": each.name,
                "file": str(files.get(each.name, "")),
                "architecture_ascii": each.architecture,
                "dof": each.dof,
                "section": each.section,
                "dimensions": each.provenance,
            }
            for each in ROBOTS
        ]
        print_text(format_record("robots", None, {"robots": rows}))
    else:
        print_text(
            format_table(
                [(each.name, str(parse(each.architecture)), str(each.dof), each.section) for each in ROBOTS],
                ("name", "architecture", "dof", "source"),
            )
        )


def convert(
    target: str | None, output: str | None, to: str | None, meshes: str, at: str | None, json: bool, **source: Any
) -> None:
    """Write a robot in another format."""
    from ..description import list_save_targets, save
    from ..description.files import require_other
    from ..errors import BadRequest
    from ..present.show import format_record

    if (target is None) is (output is None):
        problem = f"convert: two outputs, {target} and {output}" if target else "convert: OUT missing"
        raise BadRequest(problem, remedy="Give OUT or -o OUT.")
    target = str(target or output)
    files, name = [str(file) for file in list_save_targets(target, to, keyframes=at is not None)], source["robot"]
    with Progress():
        mechanism = load_robot(source)
        for file in files:
            require_other(file, name, mechanism.file, beside=target)
        keyframes = None if at is None else {KEYFRAME: _solve_link_poses(mechanism, at)}
        lost = [str(warning) for warning in save(mechanism, target, to, meshes=meshes, keyframes=keyframes)]
    for warning in lost:
        warn(warning)
    fields = {
        "file": target,
        "files": files,
        "links": len(mechanism.links),
        "joints": len(mechanism.joints),
        "warnings": lost,
    }
    print_text(
        format_record("convert", mechanism, fields)
        if json
        else f"{mechanism.name} with {fields['links']} links and {fields['joints']} joints, platform "
        f"{mechanism.platform_words}, is written to {' and '.join(files)}."
    )


def _solve_link_poses(mechanism: Mechanism, at: str) -> dict[str, Array]:
    """Return the poses of the links at a requested pose."""
    from ..analysis.observed import ObservedRobot
    from ..analysis.pose_requests import solve_configurations
    from ..errors import BadRequest
    from ..kinematics.joint_coordinates import collect_link_poses
    from ..mechanism.pose import parse_pose

    (configuration,) = solve_configurations(ObservedRobot.of(mechanism), [parse_pose(at)])
    link_poses = collect_link_poses(configuration)
    if link_poses is None:
        raise BadRequest(f"{mechanism.name}: the joints of the file do not fit this configuration", at)
    return link_poses


def verify(certificate: str, robot: str | None, json: bool) -> None:
    """Check a certificate with integers and fractions only."""
    from ..certificates import verify as checked
    from ..description import load
    from ..present.show import format_record

    mechanism = None if robot is None else load(robot)
    proved = checked(certificate, mechanism)
    fields = {"file": certificate, "accepted": True, "proved": proved}
    print_text(format_record("verify", mechanism, fields) if json else f"accepted: {proved}")


def add(app: Group) -> None:
    """Register the commands."""
    add_command(
        app,
        "verify",
        "Check a certificate of modes, derive or path, using only integers and fractions.",
        (
            Option("certificate", "Certificate file.", "FILE", default=NEEDED, argument=True),
            Option(
                "robot", "Check that its geometry is that of this robot.", "ROBOT", words=options.list_shipped_names
            ),
            JSON,
        ),
        verify,
        ("c.json", "c.json --robot quattro"),
        Verify,
    )
    add_command(
        app,
        "robots",
        "List the shipped robots.",
        (
            flag("examples", "List the robots of the package example-robot-data instead: legged robots, arms, hands."),
            JSON,
        ),
        print_robots,
        ("", "--examples"),
        Robots,
    )
    add_command(
        app,
        "convert",
        "Read a robot in any format and write it in another.",
        (
            *SOURCE,
            Option("target", "The file to write; its extension selects the format.", "[OUT]", argument=True),
            output("The file to write, given as an option."),
            Option(
                "meshes",
                "keep: meshes stay where they are, and the new file refers to them; copy: into meshes/ next to it.",
                default="keep",
                words=("keep", "copy"),
                group=OUTPUT,
            ),
            Option(
                "to",
                _describe_formats,
                "FORMAT",
                words=list_format_names,
            ),
            Option(
                "at",
                f"Write the robot at this pose as keyframe {KEYFRAME!r}: MJCF, or URDF with an SRDF file.",
                "POSE",
                group=OUTPUT,
            ),
            JSON,
            EXPLAIN,
        ),
        convert,
        ("quattro quattro.xml", "leg.urdf -o robot.usda --meshes copy", "leg.urdf robot.yaml --to gepetto"),
        Convert,
    )
