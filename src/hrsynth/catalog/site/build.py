"""Building the site: pages by an executor into a draft, which goes on where it was broken off, then the index."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from importlib import resources
from pathlib import Path
from typing import Any

from ...errors import BadRequest, BuildInterruption
from ...version import __version__
from ..build import Tell
from ..executors import Executor, Made, WorkInterruption, open_executor
from ..jsonl import format_line
from ..query import Catalog
from . import index
from .folder import FOLDERS, open_draft
from .pages import write_pages
from .structures import Structure, group_structures

SITE_PAGES_CHUNK_COUNT = 4
"""Pages that a worker is given at a time."""


@dataclass(frozen=True)
class Site:
    """A site that was written: its first page, how many architectures on how many pages, those made now."""

    index: Path
    architectures: int
    pages: int
    now: int
    differ: tuple[tuple[str, str], ...]
    """Keys with a derivation that differs from the entry, and its result."""

    def to_dict(self) -> dict[str, Any]:
        return {
            "index": str(self.index),
            "architectures": self.architectures,
            "pages": self.pages,
            "now": self.now,
            "differ": [{"key": word, "derived": found} for word, found in self.differ],
        }


def write_site(
    catalog: Catalog, target: str | Path, *, workers: int = 1, anew: bool = False, tell: Tell | None = None
) -> Site:
    """Write a catalog as a static site into a folder: new, empty, or of an older site, which it replaces as a whole.

    ``workers`` processes share the pages. A build that was broken off goes on where it was, unless ``anew``.

    Raises
    ------
    BadRequest
        For a catalog without records, a folder of other files or that cannot be written, another build at work.
    BuildInterruption
        For a full disk or a worker that died; the pages that were made are kept.
    MissingExtra
        Where joblib is not installed.
    """
    if not len(catalog):
        raise BadRequest("no architecture fits", remedy="Widen the search.")
    team, tell = open_executor(workers), tell or (lambda *_: None)
    every = group_structures(catalog)
    differ: list[tuple[str, str]] = []
    with open_draft(target, _compute_stamp(every), anew=anew) as folder:
        wanted = [each for each in every if not (folder / FOLDERS[0] / f"{each.name}.html").exists()]
        done = len(every) - len(wanted)
        tell("pages", done, len(every))
        for made in _make_pages(team, folder, wanted):
            done += len(made)
            tell("pages", done, len(every))
            differ += [(word, found) for word, found in made if found]
        index.write(folder, every)
    return Site(Path(target) / "index.html", len(catalog), len(every), len(wanted), tuple(sorted(differ)))


def _make_pages(team: Executor, folder: Path, wanted: Sequence[Structure]) -> Iterator[Made]:
    packed = [each.pack() for each in wanted]
    try:
        yield from team(
            partial(write_pages, str(folder)),
            (packed[i : i + SITE_PAGES_CHUNK_COUNT] for i in range(0, len(packed), SITE_PAGES_CHUNK_COUNT)),
        )
    except WorkInterruption as stopped:
        raise BuildInterruption(str(stopped), str(folder)) from stopped


def _compute_stamp(every: Iterable[Structure]) -> dict[str, str]:
    """Return a digest of a site's sources: version, templates, entries."""
    digest = sha256()
    for kind in ("assets", "templates"):
        files = resources.files("hrsynth.catalog.site").joinpath(kind).iterdir()
        for file in sorted(files, key=lambda file: file.name):
            digest.update(file.read_bytes())
    for each in every:
        digest.update("\n".join(format_line(record) for record in each.records).encode())
    return {"site": "hrsynth catalog", "version": __version__, "made_from": digest.hexdigest()}
