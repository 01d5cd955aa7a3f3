"""The commands that ask one question about a robot: their options, and the outputs of their answers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..budgets import BRANCH_CELLS, COVER_BOXES, EFFORT
from ..options import NEEDED, OUTPUT, Option, flag, output
from ..present.outputs import OUTPUTS
from ..progress import following
from ..tolerances import MEASUREMENT_BOUND
from .colour import paint, say
from .commands import Group, add_command
from .options import JSON, OFFER, SEE, SEED, SOURCE, WATCHED, robot_of, split_names, told_radians, told_turns, warn
from .progress import Progress
from .studio import PORT, serve


@dataclass(frozen=True)
class Question:
    """A command: the public function of its ``name``, what it says of itself, its own options, named as the function's
    parameters and those of the files, and examples. ``after`` gets the answer and the options at the end; ``shows``
    does so instead of printing the text where nothing was written, and ``needs`` says before the work what it lacks.
    ``seeded``: whether anything is random."""

    name: str
    help: str
    options: tuple[Option, ...]
    examples: tuple[str, ...] = ()
    shows: Callable[..., None] | None = None
    needs: Callable[[], object] | None = None
    after: Callable[..., None] | None = None
    seeded: bool = True

    def add(self, app: Group) -> None:
        """Make it a command."""
        drawn = FIGURE if any(each.drawn for each in OUTPUTS[self.name].files) else ()
        options = SOURCE[0], *self.options, *[SEED] * self.seeded, *drawn, JSON, *SOURCE[1:]
        add_command(app, self.name, self.help, [each.ranged(self.name) for each in options], self.answer, self.examples)

    def answer(self, *, json: bool, **values: Any) -> None:
        """Ask, write the files that are asked for, print."""
        import hrsynth

        from ..description.files import require_other
        from ..present.show import record, text

        files = {each: values.pop(each.option) for each in OUTPUTS[self.name].files if each.option is not None}
        for each, path in files.items():
            each.require(path, values)
        if self.needs is not None and not json and not any(files.values()):
            self.needs()
        source = {each.name: values[each.name] for each in SOURCE}
        more = {each.record: None for each in files if each.record is not None}
        writers = []
        with Progress() as progress, following(progress.tell):
            mechanism = robot_of(values)
            function = getattr(hrsynth, self.name)
            given = self._given_options(function, values)
            for each, path in files.items():
                given |= each.question_fields(path)
                if path is not None:
                    require_other(path, source["robot"], mechanism.file)
                each.require_drawable(path, mechanism, values | given)
            for option in ("at", "start", "goal"):
                told_turns(option, values.get(option))
            found = function(mechanism, **given)
            for option in ("cone", "noise"):
                told_radians(option, values.get(option))
            for each, path in files.items():
                if path is None:
                    continue
                why = each.unwritten(found, path)
                if why is not None:
                    warn(why)
                    files[each] = None
                    continue
                writer, told = each.writer(found, path, values)
                writers.append(writer)
                more |= told
        for write in writers:
            write()
        written = {each.field: path for each, path in files.items() if each.field is not None}
        if json:
            say(record(self.name, mechanism, {**found.to_dict(), **more, **written}))
        elif self.shows is not None and not any(written.values()):
            self.shows(found, source=source, **values)
        else:
            say(text(found), paint=paint)
            for each, path in files.items():
                if path is not None:
                    say(each.sentence(path))
        if self.after is not None:
            self.after(found, **values)

    def _given_options(self, function: Callable[..., Any], values: dict[str, Any]) -> dict[str, Any]:
        """The options that a function takes and that are given."""
        known = inspect.signature(function).parameters
        given = {name: value for name, value in values.items() if name in known and value is not None}
        if "observe" in given:
            given["observe"] = split_names(given["observe"])
        if len(given.get("camera", ())) == 1:
            (given["camera"],) = given["camera"]
        return given


def _require_decided(found: Any, at: list[str] | None, **_: Any) -> None:
    """Raise ``RankUndecided`` and ``PoseNotReached`` at poses that were asked for."""
    from ..errors import PoseNotReached, RankUndecided
    from ..tolerances import RANK_GAP

    for posture in found.postures if at else ():
        if not posture.decided:
            raise RankUndecided(f"{found.setting.robot.name} at {posture.pose}", posture.gap, RANK_GAP)
    if found.unreached:
        raise PoseNotReached.of_all(found.unreached)


def _warn_deprecated(_: Any, seconds: float | None, **__: Any) -> None:
    if seconds is not None:
        warn("--seconds is deprecated, what it leaves out depends on the machine: try --examine")


def _servable() -> None:
    """Raise ``MissingExtra`` where a library that serves pages is missing."""
    from ..present.studio.server import require_libraries

    require_libraries()


def _serve_view(found: Any, source: dict[str, Any], port: int, open_: bool, **_: Any) -> None:
    """Serve a view until Ctrl-C, and open its page in the browser."""
    from ..present.show import text
    from ..present.studio.server import view_server

    serve(view_server(found, port, open_, source), f"{text(found)}\nThe view")


def _file(command: str, option: str = "output") -> Option:
    """The option of a file that a command's answer can be written to."""
    (found,) = (each for each in OUTPUTS[command].files if each.option == option)
    return output(found.help) if option == "output" else Option(option, found.help, "FILE", group=OUTPUT)


def _goal(help: str) -> Option:
    return Option("goal", help, "POSE", default=NEEDED, old=("--to",))


POINTS = (
    "--camera eye=base@0.3,0.1,0 --see point:platform@0.1,0,0 --see point:platform@-0.1,0.1,0 "
    "--see point:platform@0,0.1,0.1"
)
"""Three image points by a camera beside the robot: an example."""
FIGURE = (
    Option(
        "width", "Width of a figure, such as 88mm or 3.5in, laid out for that with text of 8pt.", "LENGTH", group=OUTPUT
    ),
    Option("font", "Font of a figure, its size, or both: serif, 8pt, 'DejaVu Sans 8pt'.", group=OUTPUT),
)
POSES = "or mode:2 of the list that modes gives; repeat for more (default: the zero configuration)."
NOISE = Option(
    "noise",
    "Largest errors of what else is observed, such as 0.3px (in images), 0.1deg or 1mm; separate several by commas.",
    "AMOUNT",
)
BEGIN = Option(
    "at", "Pose to start from instead of the zero configuration, perhaps in another operation mode; or mode:2.", "POSE"
)
START = Option(
    "start",
    "Start pose, such as x=0.02,y=0.1,z=-0.7; mode:2 is a mode with the directions at the goal.",
    "POSE",
    default=NEEDED,
    old=("--from",),
)
JOBS = Option("jobs", "Processes (default: one per core).", None, int)
DEPTH = Option(
    "depth",
    "Depths in images that the control law uses: exact, desired (those at the goal) or constant:METRES.",
    default="exact",
)
BOX = Option(
    "box",
    "Intervals of motors (m, rad), such as hip=-1:1,slide=0:0.2 (default: the file's limits, else a "
    "whole turn, or a characteristic length either way).",
    "INTERVALS",
)
CELLS = Option("effort", "Most cells to try for each part of the loops.", "COUNT", int, BRANCH_CELLS)
QUESTIONS = (
    Question(
        "derive",
        "The hidden robot of a robot, how it is derived, its certificate, and what the controller can see.",
        (
            *WATCHED,
            SEE,
            BEGIN,
            Option(
                "form",
                "simplified (by all rules) or general (sliders, all legs kept).",
                default="simplified",
                words=("simplified", "general"),
            ),
            _file("derive"),
            _file("derive", "report"),
            _file("derive", "certificate"),
        ),
        (
            "quattro --observe 1,4",
            "quattro --observe 1,4 -o hidden.urdf --report quattro.html",
            "robot.urdf --platform plate --motors hip_1,hip_2,hip_3",
            f"gough_stewart {POINTS}",
        ),
    ),
    Question(
        "legs",
        "Sets of observed legs: their verdicts, the freedoms they lose, and the smallest sets that see the most.",
        (*WATCHED, SEE, BEGIN),
        (
            "quattro",
            "quattro --observe arm_1,arm_2,rod_3a",
            "quattro --camera platform",
            "delta --observe 1,2 --see inclination:rod_1a",
        ),
    ),
    Question(
        "check",
        "Mobility, ranks, singularities and redundant constraints at poses, and over a grid of poses.",
        (
            *WATCHED,
            SEE,
            Option("at", f"A pose, such as x=0.02,y=0.1,z=-0.7,phi=10deg; {POSES}", "POSE", list[str]),
            Option(
                "grid",
                "A line, plane or box of poses, such as x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 (from:to:count).",
                "GRID",
            ),
            _file("check"),
        ),
        (
            "quattro --at x=0.02,phi=30deg",
            "quattro --grid x=-0.3:0.3:21,y=-0.3:0.3:21,z=-0.7 -o map.png",
            f"gough_stewart {POINTS} --at x=0.02",
        ),
        after=_require_decided,
    ),
    Question(
        "singular",
        "Where a freedom of the platform is lost: the Type 2 condition in words, as an expression and drawn.",
        (
            *WATCHED,
            SEE,
            flag("real", "Ask about the real robot with its own motors instead of the hidden one."),
            Option("plane", "Plane of poses to draw, such as z=-0.7.", "PART=VALUE"),
            _file("singular"),
            Option("points", "Number of random poses at which the condition is checked.", None, int, 10_000),
            Option("steps", "Poses along each side of the plane.", None, int, 51),
        ),
        ("quattro --observe 1,4", "quattro --observe 1,4 --plane z=-0.7,phi=0 -o locus.png", f"gough_stewart {POINTS}"),
    ),
    Question(
        "advise",
        "What is missing: the smallest sets of further measurements that make a robot controllable.",
        (
            *WATCHED,
            SEE,
            OFFER,
            Option(
                "price",
                "Prices by kind, such as encoder=0.5,point=3 (default: 1 each); the cheapest sets are "
                "sought. Kinds: leg, direction, line, encoder and what is offered.",
                "KIND=NUMBER",
                default="",
            ),
        ),
        (
            "uranesx",
            "quattro --observe 1",
            "quattro --observe 1 --offer point:platform,inclination",
            "uranesx --offer point:platform --price point=3",
            "gough_stewart --camera eye=base@0.3,0.1,0 --see point:platform@0.1,0,0 --offer point:platform",
        ),
    ),
    Question(
        "branch",
        "Where the joints are proved to be one function of the motors, on the branch of the zero "
        "configuration, and where that ends.",
        (BOX, CELLS),
        ("rrrrr_m1 --box shoulder_1=-0.2:0.2,shoulder_2=-0.2:0.2",),
        seeded=False,
    ),
    Question(
        "modes",
        "Assembly modes: poses of the platform with the same measurements, and whether they are proved to be all.",
        (
            Option(
                "at",
                "Pose whose measurements are held, such as x=0.02,y=0.1,z=-0.7; or mode:2 of the list "
                "printed without --at (default: the zero configuration).",
                "POSE",
            ),
            *WATCHED,
            SEE,
            flag("real", "Hold the real robot's own motors instead."),
            Option(
                "cone",
                "Error of a measurement: poses that differ by no more are near modes; 0 for none.",
                "ANGLE",
                default=MEASUREMENT_BOUND,
            ),
            Option(
                "effort",
                "Time limit for a list (estimated seconds on one core); what needs more is left out, and reported.",
                "SECONDS",
                float,
                EFFORT,
            ),
            _file("modes"),
            _file("modes", "certificate"),
        ),
        (
            "quattro --observe 1,3 --at x=0.05,y=0.1,z=-0.7",
            "3rrr_m1 --real -o modes.png",
            "quattro --observe 1,4 --certificate c.json",
            f"gough_stewart {POINTS}",
        ),
    ),
    Question(
        "atlas",
        "Which modes with the same directions can be reached from each other without a Type 2 "
        "singularity, mode by mode.",
        (
            Option(
                "at",
                "Pose whose directions are held, such as x=0.02,y=0.1,z=-0.7 (default: the zero configuration).",
                "POSE",
            ),
            *WATCHED,
            SEE,
            _file("atlas"),
        ),
        ("quattro --observe 1,4", "3rrr_m1 --observe 2,1,3 -o atlas.png"),
    ),
    Question(
        "path",
        "Whether a path without Type 2 singularity joins two poses, with a proof: same aspect, separated, undecided.",
        (
            START,
            _goal("Goal pose; mode:2 is a mode with the directions at the start."),
            *WATCHED,
            SEE,
            _file("path", "certificate"),
        ),
        (
            "quattro --observe 1,4 --start x=0.05 --goal x=-0.05,phi=20deg",
            "3rrr_m1 --start x=0,y=0 --goal mode:2 --certificate c.json",
        ),
    ),
    Question(
        "servo",
        "A simulated servo run on what is observed: where it ends, and what it passes on the way.",
        (
            START,
            _goal("Pose whose measurements are desired."),
            *WATCHED,
            SEE,
            Option("gain", "λ of the control law (1/s).", None, float, 0.8),
            Option("noise", "Errors of measurements, such as 0.1deg, 0.3px (in images) or 1mm.", "AMOUNT"),
            flag("bias", "Keep the error of each measurement constant."),
            DEPTH,
            Option(
                "duration",
                "Move the desired measurements along the straight line in this time (default: at once).",
                "SECONDS",
                float,
            ),
            Option("time", "Longest duration of the run.", "SECONDS", float),
            flag("physics", "Drive a simulated mock-up with rods, masses and velocity servos."),
            Option(
                "sense",
                "How directions are sensed: exact, edges (of the legs in a camera's image) or pictures (rendered).",
                "SENSE",
                default="exact",
                words=("exact", "edges", "pictures"),
            ),
            _file("servo"),
        ),
        (
            "quattro --observe 1,4 --start x=0.1 --goal x=-0.05 -o run.png",
            "delta --start x=0 --goal x=0.05 --noise 0.1deg --json",
            f"gough_stewart {POINTS} --start x=0.02 --goal x=0",
        ),
    ),
    Question(
        "endings",
        "Poses at which the servo loop can rest, and which of them attract: the goal, modes, "
        "antipodal poses, critical poses of the error.",
        (
            Option(
                "at",
                "The goal: pose whose measurements are desired, such as x=0.02,y=0.1,z=-0.7; or mode:2 "
                "(default: the zero configuration).",
                "POSE",
            ),
            *WATCHED,
            SEE,
            DEPTH,
            flag("complete", "Try to prove that the list is complete, by boxes of platform poses."),
            Option(
                "effort", "Most boxes of poses to look at (10,000 to 40,000 take a second).", "COUNT", int, COVER_BOXES
            ),
            JOBS,
            _file("endings"),
        ),
        ("3rrr_m1 --at x=0.02,y=0,phi=10deg", "quattro --observe 1,4 --at x=0.05,y=0.1,z=-0.7 -o endings.png"),
    ),
    Question(
        "basins",
        "Where the servo loop to a goal ends, from each start of a line, plane or box of poses.",
        (
            Option("to", "Pose whose measurements are desired.", "POSE", default=NEEDED),
            *WATCHED,
            SEE,
            DEPTH,
            Option(
                "plane",
                "Plane of starts, such as z=-0.7, as far as it is reached (default: one through the goal).",
                "PART=VALUE",
            ),
            Option(
                "grid",
                "A line, plane or box of starts, such as x=-0.3:0.3:50,y=-0.3:0.3:50,z=-0.7 (from:to:count).",
                "GRID",
            ),
            Option(
                "steps",
                "Starts along each side of the plane (default: 100; 15 if each is simulated separately).",
                None,
                int,
            ),
            JOBS,
            _file("basins"),
        ),
        (
            "quattro --observe 1,4 --to z=-0.7 --plane z=-0.7,phi=0 -o basins.png",
            "3rrr_m1 --to x=0,y=0,phi=0 --grid x=-0.1:0.1:50,y=0,phi=0",
        ),
    ),
    Question(
        "accuracy",
        "How far the platform can be off if what is observed is off by given amounts.",
        (
            Option(
                "cone",
                "Half-angle of the cone about each observed direction, such as 0.1deg; or one per leg: "
                "1=0.1deg,2=0.2deg.",
                "ANGLE",
            ),
            NOISE,
            *WATCHED,
            SEE,
            Option("at", f"A pose, such as x=0.02,y=0.1,z=-0.7; {POSES}", "POSE", list[str]),
            Option("plane", "Plane of poses, such as z=-0.7, as far as it is reached.", "PART=VALUE"),
            Option("grid", "A line, plane or box of poses, such as x=-0.3:0.3:21,y=0,z=-0.7 (from:to:count).", "GRID"),
            Option("steps", "Poses along each side of the plane.", None, int),
            Option(
                "nonlinear",
                "Try this many errors (at least the worst to first order) at each pose; on a "
                "plane or grid, at its worst poses.",
                "COUNT",
                int,
                0,
            ),
            _file("accuracy"),
        ),
        ("delta --cone 0.1deg --at x=0.1", "delta --cone 0.1deg --plane z=-0.6 -o map.png"),
    ),
    Question(
        "select",
        "Which legs to watch for a motion from start to goal: all sets, ranked by where else the loop "
        "may end and by accuracy, and why the others are discarded.",
        (
            START,
            _goal("Goal pose."),
            Option(
                "cone",
                "Half-angle of the cone about each direction, or one per leg: 1=0.1deg,2=0.2deg,… (default: 0.1deg).",
                "ANGLE",
            ),
            NOISE,
            *WATCHED,
            SEE,
            Option("size", "Largest number of legs in a set.", None, int, 4),
            Option("runs", "How many sets, best first, must pass a simulated run.", None, int, 3),
            Option(
                "endings",
                "For how many of the examined sets, the most accurate first, to compute where else the loop may end.",
                None,
                int,
                20,
            ),
            Option(
                "sight",
                "Pose of the camera on the link that carries it (x right, y down, z ahead), such as "
                "x=0,y=0,z=0.5,rpy=180deg/0/0; or auto.",
                "POSE",
            ),
            Option("focal", "Focal length of the camera, for pictures of 640 × 480 pixels.", "PIXELS", float, 800.0),
            Option(
                "examine",
                "For how many sets, the most accurate first, to compute modes, aspects and runs.",
                None,
                int,
                20,
            ),
            Option(
                "seconds",
                "Deprecated, because the answer then depends on the machine: time after which no "
                "further set is examined.",
                None,
                float,
            ),
        ),
        ("quattro --start x=0.1 --goal x=-0.05,phi=20deg",),
        after=_warn_deprecated,
    ),
    Question(
        "export",
        "Code for a controller: motors to passive joints and platform, Jacobians, and back, on the "
        "branch of the zero configuration.",
        (
            *WATCHED,
            Option(
                "lang", "c++ (one header, C++17, Eigen) or numpy (one module).", default="c++", words=("c++", "numpy")
            ),
            BOX,
            CELLS,
            _file("export"),
        ),
        (
            "rrrrr_m1 --box shoulder_1=-0.1:0.1,shoulder_2=-0.1:0.1 -o five_bar.hpp",
            "robot.urdf --lang numpy -o robot.py",
        ),
        seeded=False,
    ),
    Question(
        "view",
        "A 3D view in the browser: sliders that keep the loops closed, what is observed, assembly modes.",
        (
            *WATCHED,
            SEE,
            flag("hidden", "Show the hidden robot too, its virtual actuators highlighted."),
            _file("view", "static"),
            PORT,
            Option("open_", "Open the page in the browser.", None, bool, True, ("--open/--no-open",)),
        ),
        (
            "quattro --observe 1,4 --hidden",
            "quattro --observe 1,4 --static quattro.html",
            f"gough_stewart {POINTS} --static points.html",
        ),
        shows=_serve_view,
        needs=_servable,
    ),
)
"""The commands in the order of the help."""
