"""The folder of a site: a draft beside it that one build at a time fills, and that takes its place when it is whole."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ...description.files import require_alone, require_folder
from ...errors import BadRequest
from ..store import require_writable

STAMP = "site.json"
"""File that marks a folder as a site, with a digest of its sources."""
FOLDERS = ("p", "r", "d")
"""Folders of the pages, of the robot files and of the small drawings."""
OWN = frozenset({STAMP, *FOLDERS, "index.html", "data.js", "index.js", "page.js", "turn.js", "site.css", "report.css"})
"""All that lies in a site."""


@contextlib.contextmanager
def open_draft(target: str | Path, stamp: dict[str, str], *, anew: bool = False) -> Iterator[Path]:
    """The folder ``.NAME.part`` beside a target, with what a build of the same stamp left there; when the block ends
    without an error it takes the target's place.

    Raises ``BadRequest`` for a target that is no site and not empty, or cannot be written, and while another build is
    at work; ``BuildInterruption`` for a full disk.
    """
    site = Path(os.path.realpath(target))
    require_replaceable(site, str(target))
    folder = site.with_name(f".{site.name}.part")
    with require_writable(folder, "site"), _lock(folder):
        _prepare(folder, stamp, anew)
        yield folder
        require_replaceable(site, str(target))
        _replace(folder, site)


def require_replaceable(site: Path, said: str) -> None:
    """Raise ``BadRequest`` unless a site can be written here: nothing, an empty folder, or a site and nothing else."""
    require_folder(site)
    if not site.exists():
        return
    if not site.is_dir():
        raise BadRequest(f"--output {said}: not a folder", remedy="Name a new folder or an older site.")
    with require_writable(site, "site"):
        found = {each.name for each in site.iterdir()}
    if found and (STAMP not in found or found - OWN):
        other = sorted(found - OWN) or sorted(found)
        raise BadRequest(
            f"--output {said}: the folder holds other files ({other[0]} …)",
            remedy="Name a new or empty folder or an older site.",
        )


@contextlib.contextmanager
def _lock(folder: Path) -> Iterator[None]:
    folder.mkdir(exist_ok=True)
    handle = os.open(folder, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    try:
        require_alone(handle, "another build is writing this site", folder)
        yield
    finally:
        os.close(handle)


def _prepare(folder: Path, stamp: dict[str, str], anew: bool) -> None:
    """Empty a draft of another stamp; drafts of single files that a killed build left go in any case."""
    file = folder / STAMP
    with contextlib.suppress(OSError, ValueError):
        if not anew and json.loads(file.read_text(encoding="utf-8")) == stamp:
            for torn in folder.glob("*/.*.tmp"):
                torn.unlink()
            return
    other = sorted({each.name for each in folder.iterdir()} - OWN)
    if other:
        raise BadRequest(f"{folder}: holds other files ({other[0]} …)", remedy="Move the folder away.")
    for each in folder.iterdir():
        shutil.rmtree(each) if each.is_dir() else each.unlink()
    for name in FOLDERS:
        (folder / name).mkdir()
    file.write_text(json.dumps(stamp) + "\n", encoding="utf-8")


def _replace(folder: Path, site: Path) -> None:
    """Put the draft in the place of the site; the site that was there goes when the new one stands."""
    old = site.with_name(f".{site.name}.{os.getpid()}.old")
    if site.exists():
        os.rename(site, old)
    try:
        os.rename(folder, site)
    except OSError:
        if old.exists():
            os.rename(old, site)
        raise
    shutil.rmtree(old, ignore_errors=True)
