"""The commands of the catalog: build, list, show, site.

Their records, besides ``command`` ("catalog build" …) and ``version``: ``build`` gives ``groups``, each with
``group``, ``words``, ``now`` (made), ``before`` and ``file`` (null while it is not complete), with ``--check`` instead
``stale``, one text for each thing; ``list`` gives ``total``, ``groups`` (those that are covered) and ``entries``;
``show`` gives ``entry``, ``drawing`` (lines), ``note``, ``smallest`` (the smallest sets with their hidden robots) and
``file``; ``site`` as told by ``catalog site --help``.
"""

from __future__ import annotations

import json as javascript
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NotRequired, TypedDict

from ..options import NEEDED, Option, flag, output
from ..records import Head, Word
from .colour import say
from .commands import Group, add_command
from .options import JSON, warn
from .progress import Progress

if TYPE_CHECKING:
    from ..catalog import Catalog
    from ..mechanism import Mechanism

catalog = Group(
    "hrsynth catalog",
    "The catalog of architectures: what can be controlled by watching legs.",
    examples=("list --legs 3-R*RR --verdict controllable", "show Delta -o delta.urdf", "list -h"),
)
VERDICTS = ("controllable", "partially controllable", "uncontrollable")
KEPT = Option(
    "kept",
    "A folder or SQLite file; or published: the shipped catalog of published robots; or all: this "
    "and the shipped catalog of words (default: all for list, else that of words).",
    "PATH",
    flags=("--catalog",),
)
WORKERS = Option("workers", "Processes that share the work.", None, int, 1, low=1)
ANEW = flag("anew", "Discard the results of an interrupted build.")
FILTER = (
    Option("legs", "Number of legs, or a pattern of the notation or of one leg's chain: 3-R*, PUS.", "LEGS"),
    Option("dof", "Freedoms of the platform.", kind=int, low=0),
    Option("motion", "Its translations and rotations, such as 3T or 2T1R."),
    Option("verdict", f"{', '.join(VERDICTS)}.", words=VERDICTS),
    Option(
        "see",
        "What is seen of the platform instead of legs, such as 3point or 2point+image_line; add ' for one camera each.",
        "KINDS",
    ),
    Option(
        "group", "planar, mixed, pods, deltas, schoenflies, spatial, sensors; for published tables 3T0R and the like."
    ),
    Option("base_motors", "Whether all motors are on the base.", kind=bool, flags=("--base-motors/--moving-motors",)),
    Option("motors", "Kinds of all driven joints: R, P, U, C, or several joined by +.", "KINDS"),
    Option("driven", "Whether the motors determine all freedoms.", kind=bool, flags=("--driven/--not-driven",)),
    Option(
        "parallelograms",
        "Whether a leg has a parallelogram, or two equal parallel rods.",
        kind=bool,
        flags=("--parallelograms/--no-parallelograms",),
    ),
    Option("fewest", "Number of legs that must be watched.", kind=int, low=0),
    Option("modes", "Number of assembly modes, complex ones too.", kind=int, low=0),
    Option("text", "Text that occurs in any field, or a name: Delta."),
)
"""Which architectures are asked for."""


class MotorChoiceRecord(TypedDict):
    """A choice of motors of a published robot: the joints driven in each leg, from 1, and the freedoms they see."""

    joints: list[list[int]]
    rank: int


class Entry(TypedDict, total=False):
    """An architecture of the catalog; a refused one has only its word, group, notation and the reason."""

    word: str
    group: str
    notation: str
    refused: str
    base_motors: bool
    choices: list[MotorChoiceRecord]
    condition: str
    confirmed: int
    cure: str
    dof: int
    driven: bool
    exact: bool
    fewest: int
    hidden: str
    idle: int
    instances: int
    legs: int
    lost: list[str]
    minimal: list[list[str]]
    mobility: int
    modes_bound: int
    modes_legs: list[str]
    modes_proof: str
    modes_seen: int
    motion: str
    motor_rank: int
    motors: int
    rank: int
    sensor: Annotated[str, "what is seen of the platform instead of legs"]
    steps: list[str]
    verdict: Word
    attempt: int | None


class CatalogList(Head):
    """The architectures that fit, among all of these groups."""

    total: int
    groups: list[str]
    entries: list[Entry]


class SmallestSetRecord(TypedDict):
    """A smallest set of legs and its hidden robot; what went wrong where none was derived."""

    legs: list[str]
    hidden: str | None
    problem: str | None
    near: Annotated[int | None, "near modes found, where the entry counts the modes of this set"]


class CatalogShow(Head):
    """One architecture, drawn and in full; `smallest` is empty where nothing is observed or no geometry is at hand."""

    entry: Entry
    drawing: list[str]
    note: str | None
    smallest: list[SmallestSetRecord]
    file: str | None


class BuiltGroup(TypedDict):
    """A group: how many words it has, how many were made now and before; its file is null until it is complete."""

    group: str
    words: int
    now: int
    before: int
    file: str | None


class CatalogBuild(Head):
    """What a build made, or with --check what is stale."""

    groups: NotRequired[list[BuiltGroup]]
    stale: NotRequired[list[str]]


class Differing(TypedDict):
    """A derivation that does not end in what the catalog says."""

    word: str
    derived: str


class CatalogSite(Head):
    """What a site holds, and where it starts."""

    index: str
    architectures: int
    pages: int
    now: int
    differ: list[Differing]


def _say(command: str, fields: dict[str, Any], text: str, json: bool) -> None:
    from ..present.show import record

    say(record(f"catalog {command}", None, fields) if json else text)


def build(
    groups: list[str] | None,
    output: str | None,
    workers: int,
    cluster: str | None,
    check: bool,
    sample: int | None,
    limit: int | None,
    anew: bool,
    json: bool,
    seed: int,
) -> None:
    """Build the catalog or (``check``) compare what is stored with what would be built."""
    from ..errors import BadRequest, CatalogStale

    senseless = {"--limit": limit is not None, "--anew": anew} if check else {"--sample": sample is not None}
    for option, given in senseless.items():
        if given:
            raise BadRequest(f"{option} {'with' if check else 'without'} --check", None)
    if check:
        from ..catalog.build import check as run
        from ..catalog.store import shipped_folder

        with Progress(counted=True) as progress:
            stale = run(
                output or shipped_folder(),
                groups or [],
                workers=workers,
                cluster=cluster,
                sample=sample,
                seed=seed,
                tell=progress.count,
            )
        if json or not stale:
            _say("build", {"stale": stale}, "not stale", json)
        if stale:
            raise CatalogStale(stale)
        return
    from ..catalog.build import build as make
    from ..present.text.catalog import describe_built

    target = _target(output)
    with Progress(counted=True) as progress:
        done = [
            each.to_dict()
            for each in make(
                target,
                groups or [],
                workers=workers,
                cluster=cluster,
                limit=limit,
                anew=anew,
                tell=progress.count,
            )
        ]
    _say("build", {"groups": done}, describe_built(done), json)


def entries(kept: str | None, json: bool, **asked: Any) -> None:
    """List the architectures that fit."""
    from ..catalog.query import count, covered
    from ..catalog.store import ALL
    from ..present.text.catalog import entries as written

    kept = kept or ALL
    found, total, groups = _asked(kept, asked), count(kept, **asked), covered(kept, **asked)
    _say(
        "list",
        {"total": total, "groups": groups, "entries": [dict(each) for each in found] if json else []},
        "" if json else written(found.records, total, groups),
        json,
    )


def _asked(kept: str | None, asked: dict[str, Any]) -> Catalog:
    """The architectures that fit; raises ``BadRequest`` for a search that none can fit, or that says nothing."""
    from ..catalog import load
    from ..errors import BadRequest

    if asked["text"] is not None and not asked["text"].strip():
        raise BadRequest("--text: nothing to look for", asked["text"], f"a name or a text: {', '.join(_names()[:3])} …")
    found = load(kept, **asked)
    if not found:
        _require_known(kept, asked)
    return found


def _names() -> list[str]:
    """The names under which robots are known."""
    from ..catalog.known import aliases

    return sorted({name for names in aliases().values() for name in names.split(", ")})


def _require_known(kept: str | None, asked: dict[str, Any]) -> None:
    """Raise ``BadRequest`` for what is asked and no record of the catalog has at all: why none fits."""
    from ..catalog import load
    from ..catalog.query import groups_of, values
    from ..errors import BadRequest

    groups = groups_of(kept)
    named = {"group": groups, "verdict": VERDICTS}
    for name, field in (
        ("group", ""),
        ("verdict", ""),
        ("motion", "motion"),
        ("dof", "dof"),
        ("fewest", "fewest"),
        ("modes", "modes_bound"),
    ):
        if asked[name] is not None and asked[name] not in (
            known := named[name] if name in named else values(field, kept)
        ):
            raise BadRequest(
                f"no architecture of the catalog has this --{name}", asked[name], list(map(str, sorted(known)))
            )
    if asked["legs"] is not None and not load(kept, group=tuple(groups), legs=asked["legs"]):
        raise BadRequest(
            "no architecture of the catalog has such legs",
            asked["legs"],
            "their number, "
            f"{', '.join(map(str, values('legs', kept)))}, or a pattern in which * and ? stand for "
            "letters: 3-R*RR, PUS, 6-*",
        )
    if asked["text"] is not None and not load(kept, group=tuple(groups), text=asked["text"]):
        near = {name.casefold(): name for names in _names() for name in (names, *names.split())}
        close = get_close_matches(asked["text"].casefold(), near, cutoff=0.5)
        raise BadRequest(
            "no architecture of the catalog has this --text in a field or a name",
            asked["text"],
            ", ".join([near[name] for name in close] or _names()[:3]) + " …",
        )


def show(word: str, output: str | None, kept: str | None, json: bool) -> None:
    """Show one architecture."""
    from ..catalog.entry import smallest_sets
    from ..description import save, targets
    from ..errors import BadRequest
    from ..present.text.catalog import entry

    if output is not None:
        targets(output)
    with Progress():
        found = _of_word(word, kept)
        if output is not None:
            if "refused" in found.record:
                raise BadRequest(
                    f"no robot of a refused architecture is written: {found.record['refused']}",
                    word,
                    "an architecture with a verdict: hrsynth catalog list",
                )
            robot = found.mechanism()
        smallest = [] if found.studied is None else smallest_sets(found.record, found.studied())
    if output is not None:
        for warning in save(robot, output):
            warn(str(warning))
    _say(
        "show",
        {
            "entry": dict(found.record),
            "drawing": found.drawn.splitlines(),
            "note": found.note or None,
            "smallest": smallest,
            "file": output,
        },
        entry(found.record, found.drawn, found.note, smallest)
        + ("" if output is None else f"\n\nThe robot is written to {output}."),
        json,
    )


@dataclass(frozen=True)
class _Shown:
    """An architecture: its record, how it is drawn (nothing where it is no word), what else is to be said, a robot
    of it, and the one that was studied (None where its geometry is not at hand)."""

    record: Any
    drawn: str
    note: str
    mechanism: Callable[[], Mechanism]
    studied: Callable[[], Mechanism] | None = None


def _no_geometry(name: str) -> Mechanism:
    from ..errors import BadRequest

    raise BadRequest(
        "a published robot's chain is in its tables", name, "python -m parroblib robot (studies/parroblib)"
    )


def _of_word(text: str, kept: str | None) -> _Shown:
    from ..catalog import load
    from ..catalog.architecture_key import parse
    from ..catalog.drawing import drawing
    from ..catalog.entry import model
    from ..catalog.geometry import mechanism
    from ..catalog.store import ALL

    if text.isalnum() and text in (every := load(kept or ALL)) and "choices" in every[text]:
        return _Shown(every[text], "", "", partial(_no_geometry, text))
    word, others = _word(text, kept)
    architecture = parse(word)
    record, note = _known_record(str(architecture), kept)
    return _Shown(
        record,
        drawing(architecture),
        "; ".join(each for each in (note, others) if each),
        lambda: mechanism(architecture, record.get("attempt", 0)),
        lambda: mechanism(model(architecture), record.get("attempt", 0)),
    )


def site(output: str, workers: int, anew: bool, kept: str | None, json: bool, **asked: Any) -> None:
    """Write the pages of the architectures that fit; of those with equal legs, where nothing is asked for."""
    from ..catalog import Catalog
    from ..catalog.known import equal_legs
    from ..catalog.site import site as run
    from ..errors import BadRequest
    from ..present.text.catalog import describe_site

    found = _asked(kept, asked)
    if all(value is None for value in asked.values()):
        found, every = Catalog([each for each in found if equal_legs(each["word"])]), len(found)
        if len(found) < every:
            warn(
                f"{every - len(found):,} architectures with unequal legs get no page; "
                "select them, for example by --group"
            )
    if seen := [each["word"] for each in found if "see" in each]:
        raise BadRequest("no pages are made for words with sensors", seen[0], "hrsynth catalog show, list")
    if published := [each["word"] for each in found if "choices" in each]:
        raise BadRequest("no pages are made for published robots", published[0], "hrsynth catalog show, list")
    with Progress(counted=True) as progress:
        done = run(found, output, workers=workers, anew=anew, tell=progress.count)
    if done.differ:
        word, derived = done.differ[0]
        warn(
            f"{len(done.differ)} derivations do not end in what the catalog says, the first: {word}, derived {derived}"
        )
    _say("site", done.to_dict(), describe_site(done.to_dict()), json)


def _word(text: str, kept: str | None) -> tuple[str, str]:
    """The word of an architecture that is given by it, by a name or by its legs, and what else is called so."""
    from ..catalog.architecture_key import parse
    from ..catalog.known import alias
    from ..catalog.query import find_named
    from ..errors import BadRequest

    try:
        return str(parse(text)), ""
    except BadRequest:
        found = find_named(text, kept) if text.strip() and "@" not in text else []  # no name has what is seen
        if not found and "(" in text:
            raise
        if not found:
            raise BadRequest(
                "no architecture of the catalog has this name or such legs",
                text,
                f"a word such as '3(Rz*-Rz-Rz)'; hrsynth catalog list --text {shlex.quote(text)} searches all fields",
            ) from None
    word = found[0]["word"]
    more = [f"{len(found)} have this name: {', '.join(each['word'] for each in found[1:4])} …"] if found[1:] else []
    return word, "; ".join([*filter(None, [alias(word)]), *more])


def _known_record(word: str, kept: str | None) -> tuple[Any, str]:
    """The record of a word, and where it comes from if not from the catalog."""
    from ..catalog import load
    from ..catalog.architecture_key import parse
    from ..catalog.build import architectures, make_records
    from ..catalog.groups import group
    from ..catalog.query import groups_of
    from ..catalog.store import shipped_folder

    own = group(parse(word))
    if kept is not None or shipped_folder().groups():
        found = load(kept, group=own if own in groups_of(kept) else None)
        if word in found:
            return found[word], ""
    ((_, line),) = make_records(architectures().entry, own, [word])
    return javascript.loads(line), "not in the catalog, studied now"


def _target(output: str | None) -> Path:
    """Where to build: what was named, or ``catalog/`` of the checkout; never an installed package."""
    from importlib import resources

    from ..errors import BadRequest

    if output is None and not (Path("catalog").is_dir() and Path("pyproject.toml").is_file()):
        raise BadRequest("nowhere to build", None, "-o FOLDER or -o FILE.sqlite")
    target = Path(output or "catalog")
    package = Path(str(resources.files("hrsynth"))).resolve()
    if target.resolve().is_relative_to(package):
        raise BadRequest("cannot build into the package", str(target), "another folder")
    return target


COMMANDS = (
    (
        "build",
        "Build the catalog, or continue an interrupted build; the bytes are the same whoever builds it.",
        build,
        (
            Option("groups", "Groups (default: all).", "[GROUP]...", list[str], argument=True),
            output("A folder, or a file that ends in .sqlite (default: catalog/ of the checkout).", "PATH"),
            WORKERS,
            Option("cluster", "A dask cluster that shares the work.", "ADDRESS"),
            flag(
                "check",
                "Build nothing: compare what is stored (default: what is shipped) with what would be built; exit 3 "
                "if it is stale.",
            ),
            Option(
                "sample",
                "With --check: compare only this many records of each group, drawn at random, and all words.",
                "N",
                int,
                low=0,
            ),
            Option("limit", "Stop after this many new records; the same command continues.", "N", int, low=0),
            ANEW,
            JSON,
            Option("seed", "Seed of --sample.", None, int, 0, low=0),
        ),
    ),
    ("list", "The architectures that fit.", entries, (*FILTER, KEPT, JSON)),
    (
        "show",
        "One architecture, drawn and in full; one that is not in the catalog is analysed on request.",
        show,
        (
            Option(
                "word",
                "An architecture, such as '3(Rz*-Rz-Rz)', or a name or legs: Delta, 3-RPS.",
                "WORD",
                default=NEEDED,
                argument=True,
            ),
            output("Write a robot of this architecture (.urdf, or another dialect)."),
            KEPT,
            JSON,
        ),
    ),
    (
        "site",
        "Web pages of the architectures that fit: a list with filters, drawings, derivations, robot files; they "
        "need no server.",
        site,
        (
            output("A new or empty folder, or an older site, which is replaced.", "DIR", NEEDED),
            *FILTER,
            WORKERS,
            ANEW,
            KEPT,
            JSON,
        ),
    ),
)
EXAMPLES = {
    "build": ("planar -o mine.sqlite", "--check --sample 20"),
    "list": ("--legs 3-R*RR --verdict controllable", "--motion 2T1R --base-motors --modes 6", "--text Hexaglide"),
    "show": ("'3(Rz*-Rz-Rz)'", "Delta -o delta.urdf"),
    "site": ("-o pages --group planar",),
}
RECORDS = {"build": CatalogBuild, "list": CatalogList, "show": CatalogShow, "site": CatalogSite}
for name, words, run, options in COMMANDS:
    add_command(catalog, name, words, options, run, EXAMPLES[name], RECORDS[name])
