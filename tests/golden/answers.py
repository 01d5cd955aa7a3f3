"""The questions whose answers are kept, and how each is asked."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import hrsynth
from hrsynth.analysis.pose_requests import observe
from hrsynth.catalog.entry import build_entry
from hrsynth.catalog.query import load as catalog
from hrsynth.cli import run_command
from hrsynth.description import list_robots
from hrsynth.errors import HrsynthError

MODELS = Path(os.environ.get("HRSYNTH_MODELS") or Path(__file__).resolve().parents[3] / "shared" / "models")
ENDINGS = (".urdf", ".sdf", ".xml", ".xacro")
COMMANDS = (
    "derive",
    "legs",
    "check",
    "singularities",
    "advise",
    "branch",
    "modes",
    "aspects",
    "path",
    "servo",
    "equilibria",
    "basins",
    "accuracy",
    "select",
    "export",
    "view",
    "lint",
    "verify",
    "robots",
    "convert",
    "import",
    "studio",
    "schema",
    "completion",
    "catalog",
)
ABOUT_ROBOTS: dict[str, tuple[str, ...]] = {
    "derive": (),
    "legs": (),
    "check": (),
    "singularities": (),
    "advise": (),
    "modes": (),
    "modes --real": (),
    "aspects": (),
    "accuracy": ("--cone", "0.1deg"),
    "equilibria": (),
    "path": ("--start", "{far}", "--goal", "{home}"),
    "servo": ("--start", "{near}", "--goal", "{home}"),
    "select": ("--start", "{near}", "--goal", "{home}"),
    "lint": (),
}
"""Commands about one robot, with what else they are given: its pose, one beside it, and one at random."""
FROM_PYTHON = ("derive", "legs", "check", "singularities", "advise", "modes", "aspects")
BRANCHES = {"rrrrr_m1": ("--box", "shoulder_1=-0.1:0.1,shoulder_2=-0.1:0.1")}
DIALECTS = {"urdf": ".urdf", "mjcf": ".xml", "sdf": ".sdf", "gepetto": ".yaml", "usd": ".usda"}
PICTURES = {
    "derive": ("derive", "quattro", "--observe", "1,4"),
    "check": ("check", "quattro", "--grid", "x=-0.3:0.3:9,z=-0.7"),
    "singularities": ("singularities", "quattro", "--observe", "1,4", "--plane", "z=-0.7,phi=0"),
    "singularities of a plane": ("singularities", "3rrr_m1", "--plane", "phi=0"),
    "modes": ("modes", "3rrr_m1", "--real"),
    "modes in space": ("modes", "quattro", "--observe", "1,3"),
    "aspects": ("aspects", "3rrr_m1"),
    "servo": ("servo", "delta", "--start", "x=0", "--goal", "x=0.05"),
    "servo in a plane": ("servo", "3rrr_m1", "--start", "x=0", "--goal", "x=0.03"),
    "equilibria": ("equilibria", "3rrr_m1"),
    "basins": ("basins", "rrrrr_m1", "--goal", "x=0", "--grid", "x=-0.05:0.05:5,y=0.2"),
    "accuracy": ("accuracy", "delta", "--cone", "0.1deg", "--plane", "z=-0.6"),
}
ENTRIES, SEED, PIXELS = 500, 7, 48

MOST = 60
"""Records of a list of which all are kept; of more their number is."""
LONG = {"equilibria of stewart-sdf-ritwik/stewart_sdf.sdf"}
"""Cases that take more than half an hour."""

Json = Any


@dataclass(frozen=True)
class Case:
    """A kind of answer (help, answer, convert, code, picture, entry, schema), and of what."""

    kind: str
    name: str
    argv: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """What it is filed under."""
        return f"{self.kind}: {self.name}"


def files() -> dict[str, str]:
    """The shipped robots by name, and the files of others that are here by their place in the folder."""
    found = {name: name for name in list_robots()}
    if MODELS.is_dir():
        found |= {
            str(path.relative_to(MODELS)): str(path)
            for path in sorted(MODELS.rglob("*"))
            if path.suffix in ENDINGS and path.is_file()
        }
    return found


def cases() -> Iterator[Case]:
    """All cases, those of one robot in a row."""
    yield Case("help", "hrsynth", ("-h",))
    yield Case("answer", "robots", ("robots",))
    for command in COMMANDS:
        yield Case("help", command, (command, "-h"))
        yield Case("schema", command, ("schema", command))
    for name, file in files().items():
        for command, rest in ABOUT_ROBOTS.items():
            first, *more = command.split()
            if f"{command} of {name}" not in LONG:
                yield Case("answer", f"{command} of {name}", (first, file, *more, *rest))
        for dialect, ending in DIALECTS.items():
            yield Case("convert", f"{name} to {dialect}", ("convert", file, "-o", "{folder}/robot" + ending))
    for name, rest in BRANCHES.items():
        yield Case("answer", f"branch of {name}", ("branch", name, *rest))
        for what, ending, argv in (
            ("export", ".hpp", ()),
            ("export with cells", ".hpp", (*rest, "--jumps")),
            ("export in Python", ".py", (*rest, "--lang", "python")),
        ):
            yield Case("convert", f"{what} of {name}", ("export", name, *argv, "-o", "{folder}/code" + ending))
    for name, argv in PICTURES.items():
        yield Case("picture", name, (*argv, "-o", "{folder}/picture.png"))
    words = sorted(each["key"] for each in catalog() if "refused" not in each)
    for word in random.Random(SEED).sample(words, ENTRIES):
        yield Case("entry", word)


def shortened(value: Json) -> Json:
    """The same, of long lists of records their number alone."""
    if isinstance(value, dict):
        return {key: shortened(each) for key, each in value.items()}
    if not isinstance(value, list):
        return value
    records = len(value) > MOST and isinstance(value[0], dict | list)
    return {"items": len(value)} if records else [shortened(each) for each in value]


def run(argv: Sequence[str]) -> tuple[int, str, str]:
    """The exit status of a command and what it prints."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = run_command([*argv])
    return status, out.getvalue(), err.getvalue()


def poses(file: str) -> dict[str, str]:
    """The robot's pose, one beside it, and that of a sample; the first for all where there is no other."""
    try:
        setup = observe(hrsynth.load(file))
    except HrsynthError:
        return dict.fromkeys(("home", "near", "far"), "x=0")
    home = setup.motion.pose(setup.robot.links[setup.motion.link].pose)
    far = setup.motion.pose(setup.configurations[0].pose(setup.motion.link))
    near = next(
        (
            f"{part}={getattr(home, part) + 0.01!r}"
            for part in ("x", "z", "phi")
            if isinstance(getattr(home, part), float) and getattr(home, part) != getattr(far, part)
        ),
        str(home),
    )
    return {"home": str(home), "near": near, "far": str(far)}


def answer(case: Case) -> Json:
    """What is kept of a case."""
    hrsynth.clear_cache()
    if case.kind == "entry":
        return {"record": build_entry(case.name)}
    with tempfile.TemporaryDirectory() as folder:
        given = {"folder": folder}
        if any("{home}" in word for word in case.argv):
            given |= poses(case.argv[1])
        argv = [word.format(**given) if word.startswith("{") else word for word in case.argv]

        def plain(text: str) -> str:
            for path, name in (
                (folder, "FOLDER"),
                (str(Path(hrsynth.__file__).parent), "PACKAGE"),
                (str(MODELS), "MODELS"),
                (str(MODELS.parents[1]), "ROOT"),
            ):
                text = text.replace(path, name)
            return text

        status, out, err = run(argv)
        found: dict[str, Json] = {"status": status, "text": plain(out), "errors": plain(err)}
        if case.kind == "picture":
            found["pixels"] = pixels(Path(folder) / "picture.png") if status == 0 else None
        elif case.kind == "convert":
            found["files"] = {path.name: plain(path.read_text()) for path in sorted(Path(folder).iterdir())}
        elif case.kind == "schema":
            found["text"], found["json"] = "", json.loads(out) if status == 0 else None
        elif case.kind == "answer":
            out = run([*argv, "--json"])[1]
            found["json"] = shortened(json.loads(plain(out))) if out else None
            if argv[0] in FROM_PYTHON and len(argv) == 2:
                found["repr"] = plain(described(argv[0], argv[1]))
    return found


def asked(case: Case) -> tuple[str, Any]:
    """A case's key and its answer; a defect is an answer too."""
    try:
        return case.key, answer(case)
    except Exception as error:
        return case.key, {"defect": f"{type(error).__name__}: {error}"}


def described(command: str, file: str) -> str:
    """What Python shows of an answer."""
    try:
        return repr(getattr(hrsynth, command)(file))
    except HrsynthError as error:
        return f"{type(error).__name__}: {error}"


def pixels(path: Path) -> list[list[int]]:
    """A picture in few grey pixels."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("L").resize((PIXELS, PIXELS), Image.Resampling.BOX)).tolist()
