"""Commands of the catalog: build, list, show, site.

Their JSON objects, besides ``command`` ("catalog build" …) and ``version``: ``build`` gives ``groups``, each with
``group``, ``keys``, ``now`` (computed), ``before`` and ``file`` (null until complete), with ``--check`` instead
``stale``, one text for each difference; ``list`` gives ``total``, ``groups`` (those searched) and ``entries``;
``show`` gives ``entry``, ``drawing`` (lines), ``note``, ``smallest`` (the smallest sets with their hidden robots) and
``file``; ``site`` as in ``catalog site --help``.
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
from .colour import print_text
from .commands import Group, add_command
from .options import JSON, warn
from .progress import Progress

if TYPE_CHECKING:
    from ..catalog import Catalog
    from ..mechanism import Mechanism

catalog = Group(
    "hrsynth catalog",
    "The catalog of architectures: which can be controlled by observing legs.",
    examples=("list --legs 3-R*RR --verdict controllable", "show Delta -o delta.urdf", "list -h"),
)
VERDICTS = ("controllable", "partially controllable", "uncontrollable")
KEPT = Option(
    "kept",
    "A folder or SQLite file; published: the shipped catalog of published robots; or all: this and the shipped "
    "catalog of architectures (default: all for list, else that of architectures).",
    "PATH",
    flags=("--catalog",),
)
WORKERS = Option("workers", "Processes that share the work.", None, int, 1, low=1)
ANEW = flag("anew", "Discard the results of an interrupted build.")
FILTER = (
    Option("legs", "Number of legs, or a pattern of the notation or of one leg's chain: 3-R*, PUS.", "LEGS"),
    Option("dof", "Platform dof.", kind=int, low=0),
    Option("motion", "Its translations and rotations, such as 3T or 2T1R."),
    Option("verdict", f"{', '.join(VERDICTS)}.", words=VERDICTS),
    Option(
        "sensor",
        "Observations of the platform instead of legs, such as 3point or 2point+image_line; add ' for one camera each.",
        "KINDS",
    ),
    Option(
        "group", "planar, mixed, pods, deltas, schoenflies, spatial, sensors; for published tables 3T0R and the like."
    ),
    Option("base_motors", "Whether all motors are on the base.", kind=bool, flags=("--base-motors/--moving-motors",)),
    Option("motors", "Kinds of all actuated joints: R, P, U, C, or several joined by +.", "KINDS"),
    Option("driven", "Whether the motors determine all platform dof.", kind=bool, flags=("--driven/--not-driven",)),
    Option(
        "parallelograms",
        "Whether a leg has a parallelogram, or two equal parallel rods.",
        kind=bool,
        flags=("--parallelograms/--no-parallelograms",),
    ),
    Option("fewest", "Fewest legs that together reach the highest rank.", kind=int, low=0),
    Option("modes", "Number of assembly modes, complex ones included.", kind=int, low=0),
    Option("text", "Text that occurs in any field, or a name: Delta."),
)
"""Criteria that select architectures."""


class MotorChoiceRecord(TypedDict):
    """A choice of motors of a published robot: the actuated joints of each leg, from 1, and the dof they determine."""

    joints: list[list[int]]
    rank: int


class Entry(TypedDict, total=False):
    """An architecture of the catalog; a refused one has only its key, group, notation and the reason."""

    key: str
    group: str
    notation: str
    refused: str
    base_motors: bool
    choices: list[MotorChoiceRecord]
    condition: str
    confirmed: int
    dof: int
    driven: bool
    exact: bool
    fewest: int
    hidden: str
    internal: int
    instances: int
    legs: int
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
    sensors: Annotated[str, "observations of the platform instead of legs"]
    steps: list[str]
    suggestion: str
    unobserved: list[str]
    verdict: Word
    attempt: int | None


class CatalogList(Head):
    """The architectures that fit, among all of these groups."""

    total: int
    groups: list[str]
    entries: list[Entry]


class SmallestSetRecord(TypedDict):
    """A smallest set of legs and its hidden robot, or the reason why none was derived."""

    legs: list[str]
    hidden: str | None
    problem: str | None
    near_matches: Annotated[int | None, "near modes found, where the entry counts the modes of this set"]


class CatalogShow(Head):
    """One architecture, drawn and in full; `smallest` is empty where nothing is observed or no geometry is at hand."""

    entry: Entry
    drawing: list[str]
    note: str | None
    smallest: list[SmallestSetRecord]
    file: str | None


class BuiltGroup(TypedDict):
    """A group: the number of its keys, of entries computed now and before; its file is null until it is complete."""

    group: str
    keys: int
    now: int
    before: int
    file: str | None


class CatalogBuild(Head):
    """Groups of a build, or with --check what is stale."""

    groups: NotRequired[list[BuiltGroup]]
    stale: NotRequired[list[str]]


class DerivationDifference(TypedDict):
    """A derivation that differs from the catalog entry."""

    key: str
    derived: str


class CatalogSite(Head):
    """A site: its size and its start page."""

    index: str
    architectures: int
    pages: int
    now: int
    differ: list[DerivationDifference]


def _print_result(command: str, fields: dict[str, Any], text: str, json: bool) -> None:
    from ..present.show import format_record

    print_text(format_record(f"catalog {command}", None, fields) if json else text)


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
    """Build the catalog, or with ``check`` compare a stored one with what would be built."""
    from ..errors import BadRequest, CatalogStale

    senseless = {"--limit": limit is not None, "--anew": anew} if check else {"--sample": sample is not None}
    for option, given in senseless.items():
        if given:
            raise BadRequest(f"{option} {'with' if check else 'without'} --check", remedy=f"Omit {option}.")
    if check:
        from ..catalog.build import check as run
        from ..catalog.store import locate_shipped_folder

        with Progress(counted=True) as progress:
            stale = run(
                output or locate_shipped_folder(),
                groups or [],
                workers=workers,
                cluster=cluster,
                sample=sample,
                seed=seed,
                tell=progress.count,
            )
        if json or not stale:
            _print_result("build", {"stale": stale}, "not stale", json)
        if stale:
            raise CatalogStale(stale)
        return
    from ..catalog.build import build as make
    from ..present.text.catalog import describe_built

    target = _choose_target(output)
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
    _print_result("build", {"groups": done}, describe_built(done), json)


def print_entries(kept: str | None, json: bool, **asked: Any) -> None:
    """List the architectures that fit."""
    from ..catalog.query import count, list_covered_groups
    from ..catalog.store import ALL
    from ..present.text.catalog import format_entries as written

    kept = kept or ALL
    found, total, groups = _select_catalog(kept, asked), count(kept, **asked), list_covered_groups(kept, **asked)
    _print_result(
        "list",
        {"total": total, "groups": groups, "entries": [dict(each) for each in found] if json else []},
        "" if json else written(found.records, total, groups),
        json,
    )


def _select_catalog(kept: str | None, asked: dict[str, Any]) -> Catalog:
    """Return the architectures that fit; raise ``BadRequest`` for an empty search or one that none can fit."""
    from ..catalog import load
    from ..errors import BadRequest

    if asked["text"] is not None and not asked["text"].strip():
        raise BadRequest("--text: empty", remedy=f"Search for a name or a text, such as {_list_names()[0]}.")
    found = load(kept, **asked)
    if not found:
        _require_known(kept, asked)
    return found


def _list_names() -> list[str]:
    """Return the names under which robots are known."""
    from ..catalog.known import list_aliases

    return sorted({name for names in list_aliases().values() for name in names.split(", ")})


def _require_known(kept: str | None, asked: dict[str, Any]) -> None:
    """Raise ``BadRequest`` for a value that no entry of the catalog has."""
    from ..catalog import load
    from ..catalog.query import list_field_values, list_groups
    from ..errors import BadRequest

    groups = list_groups(kept)
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
            known := named[name] if name in named else list_field_values(field, kept)
        ):
            raise BadRequest(f"--{name}: no such entry in the catalog", asked[name], list(map(str, sorted(known))))
    if asked["legs"] is not None and not load(kept, group=tuple(groups), legs=asked["legs"]):
        raise BadRequest(
            "--legs: no such entry in the catalog",
            asked["legs"],
            list(map(str, list_field_values("legs", kept))),
            remedy="Give a number or a pattern such as 3-R*RR, PUS, 6-*.",
        )
    if asked["text"] is not None and not load(kept, group=tuple(groups), text=asked["text"]):
        near = {name.casefold(): name for names in _list_names() for name in (names, *names.split())}
        close = get_close_matches(asked["text"].casefold(), near, cutoff=0.5)
        raise BadRequest(
            f"--text {asked['text']}: not found in any field or name of the catalog",
            remedy="Search for another text, such as "
            f"{' or '.join([near[name] for name in close] or _list_names()[:3])}.",
        )


def show(word: str, output: str | None, kept: str | None, json: bool) -> None:
    """Show one architecture."""
    from ..catalog.entry import derive_smallest_sets
    from ..description import list_save_targets, save
    from ..errors import BadRequest
    from ..present.text.catalog import format_entry

    if output is not None:
        list_save_targets(output)
    with Progress():
        found = _find_shown(word, kept)
        if output is not None:
            if "refused" in found.record:
                raise BadRequest(f"{word}: refused: {found.record['refused']}", remedy="Choose one with a verdict.")
            robot = found.mechanism()
        smallest = [] if found.studied is None else derive_smallest_sets(found.record, found.studied())
    if output is not None:
        for warning in save(robot, output):
            warn(str(warning))
    _print_result(
        "show",
        {
            "entry": dict(found.record),
            "drawing": found.drawn.splitlines(),
            "note": found.note or None,
            "smallest": smallest,
            "file": output,
        },
        format_entry(found.record, found.drawn, found.note, smallest)
        + ("" if output is None else f"\n\nThe robot is written to {output}."),
        json,
    )


@dataclass(frozen=True)
class _Shown:
    """An architecture: its entry, drawing (empty if it has no key), a note, its robot, and the robot that was
    analysed (None if its geometry is not available)."""

    record: Any
    drawn: str
    note: str
    mechanism: Callable[[], Mechanism]
    studied: Callable[[], Mechanism] | None = None


def _refuse_geometry(name: str) -> Mechanism:
    from ..errors import BadRequest

    raise BadRequest(
        f"{name}: the catalog has no geometry of published robots",
        remedy="Use python -m parroblib robot (studies/parroblib).",
    )


def _find_shown(text: str, kept: str | None) -> _Shown:
    from ..catalog import load
    from ..catalog.architecture_key import parse
    from ..catalog.drawing import draw_architecture
    from ..catalog.entry import choose_study_model
    from ..catalog.geometry import build_mechanism
    from ..catalog.store import ALL

    if text.isalnum() and text in (every := load(kept or ALL)) and "choices" in every[text]:
        return _Shown(every[text], "", "", partial(_refuse_geometry, text))
    word, others = _parse_word(text, kept)
    architecture = parse(word)
    record, note = _find_record(str(architecture), kept)
    return _Shown(
        record,
        draw_architecture(architecture),
        "; ".join(each for each in (note, others) if each),
        lambda: build_mechanism(architecture, record.get("attempt", 0)),
        lambda: build_mechanism(choose_study_model(architecture), record.get("attempt", 0)),
    )


def build_site(output: str, workers: int, anew: bool, kept: str | None, json: bool, **asked: Any) -> None:
    """Write the pages of the architectures that fit; without criteria of those with equal legs."""
    from ..catalog import Catalog
    from ..catalog.known import has_equal_legs
    from ..catalog.site import write_site as run
    from ..errors import BadRequest
    from ..present.text.catalog import describe_site

    found = _select_catalog(kept, asked)
    if all(value is None for value in asked.values()):
        found, every = Catalog([each for each in found if has_equal_legs(each["key"])]), len(found)
        if len(found) < every:
            warn(
                f"{every - len(found):,} architectures with unequal legs get no page; "
                "select them, for example by --group"
            )
    if seen := [each["key"] for each in found if "sensors" in each]:
        raise BadRequest(f"{seen[0]}: no pages for keys with sensors", remedy="Use hrsynth catalog show.")
    if published := [each["key"] for each in found if "choices" in each]:
        raise BadRequest(f"{published[0]}: no pages for published robots", remedy="Use hrsynth catalog show.")
    with Progress(counted=True) as progress:
        done = run(found, output, workers=workers, anew=anew, tell=progress.count)
    if done.differ:
        word, derived = done.differ[0]
        warn(f"{len(done.differ)} derivations differ from the catalog, the first: {word}, derived {derived}")
    _print_result("site", done.to_dict(), describe_site(done.to_dict()), json)


def _parse_word(text: str, kept: str | None) -> tuple[str, str]:
    """Return the key of an architecture, given as key, name or legs, and a note on others of that name."""
    from ..catalog.architecture_key import parse
    from ..catalog.known import find_alias
    from ..catalog.query import find_named
    from ..errors import BadRequest

    try:
        return str(parse(text)), ""
    except BadRequest:
        found = find_named(text, kept) if text.strip() and "@" not in text else []  # no name has sensors
        if not found and "(" in text:
            raise
        if not found:
            raise BadRequest(
                f"{text}: no architecture of the catalog has this name or legs",
                remedy=f"Give a key such as '3(Rz*-Rz-Rz)', or run hrsynth catalog list --text {shlex.quote(text)}.",
            ) from None
    word = found[0]["key"]
    more = [f"{len(found)} have this name: {', '.join(each['key'] for each in found[1:4])} …"] if found[1:] else []
    return word, "; ".join([*filter(None, [find_alias(word)]), *more])


def _find_record(word: str, kept: str | None) -> tuple[Any, str]:
    """Return the entry of a key, and a note if it is not from the catalog."""
    from ..catalog import load
    from ..catalog.architecture_key import parse
    from ..catalog.build import list_architectures, make_records
    from ..catalog.groups import group
    from ..catalog.query import list_groups
    from ..catalog.store import locate_shipped_folder

    own = group(parse(word))
    if kept is not None or locate_shipped_folder().groups():
        found = load(kept, group=own if own in list_groups(kept) else None)
        if word in found:
            return found[word], ""
    ((_, line),) = make_records(list_architectures().entry, own, [word])
    return javascript.loads(line), "not in the catalog, analysed now"


def _choose_target(output: str | None) -> Path:
    """Return the target of a build: the given one, or ``catalog/`` of the checkout; never an installed package."""
    from importlib import resources

    from ..errors import BadRequest

    if output is None and not (Path("catalog").is_dir() and Path("pyproject.toml").is_file()):
        raise BadRequest("build needs --output", remedy="Give -o FOLDER or -o FILE.sqlite.")
    target = Path(output or "catalog")
    package = Path(str(resources.files("hrsynth"))).resolve()
    if target.resolve().is_relative_to(package):
        raise BadRequest(f"--output {target}: inside the installed package", remedy="Choose another folder.")
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
                "Build nothing: compare a stored catalog (default: the shipped one) with what would be built; "
                "exit status 3 if it is stale.",
            ),
            Option(
                "sample",
                "With --check: compare only this many random entries of each group, and all keys.",
                "N",
                int,
                low=0,
            ),
            Option("limit", "Stop after this many new entries; the same command continues.", "N", int, low=0),
            ANEW,
            JSON,
            Option("seed", "Seed of --sample.", None, int, 0, low=0),
        ),
    ),
    ("list", "List the architectures that fit.", print_entries, (*FILTER, KEPT, JSON)),
    (
        "show",
        "Show one architecture, drawn and in full; one that is not in the catalog is analysed.",
        show,
        (
            Option(
                "word",
                "A key such as '3(Rz*-Rz-Rz)', a name or legs: Delta, 3-RPS.",
                "KEY",
                default=NEEDED,
                argument=True,
            ),
            output("Write a robot of this architecture (.urdf, or another format)."),
            KEPT,
            JSON,
        ),
    ),
    (
        "site",
        "Write web pages of the architectures that fit: a list with filters, drawings, derivations, robot files; "
        "no server needed.",
        build_site,
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
