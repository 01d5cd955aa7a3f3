"""Error maxima over a grid of any size, written to a file part by part; an interrupted sweep is continued."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...description.files import add_checksum, convert_to_path, open_kept, require_alone, require_writable, unseal_line
from ...errors import BadRequest, BuildInterruption, NoReachablePose
from ...geometry.vectors import Array
from ...mechanism.pose import Grid
from ...progress import report
from ...records import DEG, FLAT, MM, As, Shown, recorded
from ...results import Value, freeze_content
from ...tolerances import FIRST_ORDER_POSE_ERROR_MAX
from ...version import __version__
from .error_map import ERROR_MAP_CHECKED_POSES_COUNT, ErrorField, Mapper, SpotChecks
from .ranges import ErrorRange, Tally

SWEEP_PART = 1 << 16
"""Poses of a sweep evaluated at a time."""
ERROR_SWEEP_SAMPLES_COUNT = 10_000
"""Random poses of a sweep among which those are chosen that are compared with Pinocchio."""

ENDING, PART, JOURNAL = ".npy", ".part", ".journal"
ROW = np.dtype([("position", "<f8"), ("orientation", "<f8")])
"""Content of the file for a pose: errors (m, rad), NaN if it is not reached, infinite if a platform dof is
unobserved."""


class SweptCounts(NamedTuple):
    """Poses whose errors are in the file, how many of them are reached, and how many were there before from an
    interrupted sweep."""

    poses: int
    reached: int
    before: int
    position_mm: Annotated[ErrorRange, As(scale=MM)]
    orientation_deg: Annotated[ErrorRange, As(scale=DEG)]


@dataclass(frozen=True, eq=False, repr=False)
class SweptErrors(Value):
    """The error maxima over a grid in a file: an array of ``ROW`` in the grid's shape. ``before`` poses of it were
    there from a sweep that was broken off."""

    grid: Annotated[Grid, FLAT]
    file: Path
    tally: Tally
    spots: Annotated[SpotChecks, SpotChecks | None, As("checked")]
    before: int

    gap = Shown(float, lambda self: self.tally.gap)

    @property
    @recorded(As("swept"))
    def counts(self) -> SweptCounts:
        """File to which the errors are written."""
        tally = self.tally
        return SweptCounts(self.grid.size, tally.reached, self.before, tally.position, tally.orientation)


def sweep_to(path: str | Path, mapper: Mapper, grid: Grid, seed: int) -> SweptErrors:
    """Write the error maxima over a grid to ``path``, whole or not at all, and continue an interrupted sweep.

    The memory is that of one part.

    Raises
    ------
    BadRequest
        For another suffix than .npy, poses that are solved one by one, a disk that is too small, or another sweep to
        that file, running or interrupted.
    BuildInterruption
        If the disk is full; what was written is kept.
    NoReachablePose
        If no pose of the grid is reached.
    """
    name, target = mapper.setup.robot.name, require_file(path)
    if mapper.batch is None or grid.joints:
        raise BadRequest(
            f"{path}: the poses of {name} are solved one by one, not in parts", remedy="Write a table, such as map.csv."
        )
    cones = mapper.blur.cones
    asked = hashlib.sha256(
        repr(
            freeze_content((mapper.setup.mechanism, mapper.setup.observed, mapper.blur, grid, SWEEP_PART, __version__))
        ).encode()
    ).hexdigest()
    with _SweepDraft(target, grid, asked, mapper.may_use_numba(grid.size, cones)) as draft:
        tally = draft.tally
        limits = [FIRST_ORDER_POSE_ERROR_MAX * mapper.setup.all_samples.model.length, FIRST_ORDER_POSE_ERROR_MAX]
        for start in range(tally.done, grid.size, SWEEP_PART):
            places = grid.places(start, start + SWEEP_PART)
            reached, *errors, gap = mapper.errors(*mapper.part(grid, places, cones, draft.compiled))
            rows = np.stack(errors, axis=1)
            position, orientation = map(ErrorRange.of, errors, limits)
            tally = tally.with_part(len(rows), int(reached.sum()), position, orientation, gap)
            draft.add(rows, tally)
            report(f"poses, {100 * tally.done // grid.size} % of {grid.size}")
        if not tally.reached:
            draft.discard()
            raise NoReachablePose(name, f"the grid {grid}", f"none of {grid.size} is")
        spots = _check_spots(mapper, grid, draft, tally, seed)
        before = draft.tally.done
        draft.finish()
    return SweptErrors(grid, Path(path), tally, spots, before)


def _check_spots(mapper: Mapper, grid: Grid, draft: _SweepDraft, tally: Tally, seed: int) -> SpotChecks:
    """Check the file against Pinocchio at random poses; if few of these are reached, at those of the part that is
    reached most."""
    rng = np.random.default_rng(seed)
    start = tally.fullest[1]
    for low, high in ((0, grid.size), (start, min(start + SWEEP_PART, grid.size))):
        cells = (
            np.arange(low, high)
            if high - low <= ERROR_SWEEP_SAMPLES_COUNT
            else np.sort(rng.integers(low, high, ERROR_SWEEP_SAMPLES_COUNT))
        )
        rows = draft.rows(cells)
        reached = ~np.isnan(rows[:, 0])
        if reached.sum() >= ERROR_MAP_CHECKED_POSES_COUNT:
            break
    position, orientation = rows.T
    seen = ErrorField(reached, position, orientation, lambda: None, lambda: position, tally.gap)
    return mapper.spots(grid, seen, seed, cells=cells)


def require_file(path: str | Path) -> Path:
    """Return the path of the file; raises ``BadRequest``."""
    if convert_to_path(path).suffix.lower() != ENDING:
        raise BadRequest("array of errors: name of the file", str(path), f"*{ENDING}")
    return require_writable(path)


class _SweepDraft:
    """Array of a grid that is being written, and its journal: the request, then a line per part. Both are on the disk
    when a part counts as done; a truncated last line is cut off, and a damaged one (by its checksum) does not count."""

    def __init__(self, target: Path, grid: Grid, asked: str, compiled: bool) -> None:
        self.target = target
        self.part, self.journal = (target.with_name(target.name + each) for each in (PART, JOURNAL))
        head = io.BytesIO()
        np.lib.format.write_array_header_1_0(
            head, {"descr": np.lib.format.dtype_to_descr(ROW), "fortran_order": False, "shape": grid.shape}
        )
        self._head, self._whole = head.getvalue(), grid.size * ROW.itemsize
        self._files = ExitStack()
        with _stop_on_disk_error(self.journal), ExitStack() as files:
            self._lines = files.enter_context(open(open_kept(self.journal), "r+b"))
            require_alone(self._lines.fileno(), "another sweep writes this file", self.journal, "one sweep at a time")
            self.compiled, self.tally = self._resume(asked, compiled)
            self._rows = files.enter_context(open(open_kept(self.part), "r+b"))
            self._begin(asked)
            self._files = files.pop_all()

    def __enter__(self) -> _SweepDraft:
        return self

    def __exit__(self, *_: object) -> None:
        self._files.close()

    def _resume(self, asked: str, compiled: bool) -> tuple[bool, Tally]:
        """Return True if numba is used, and the progress so far; raises ``BadRequest`` for the journal of another
        request."""
        content = self._lines.read()
        lines = content[: content.rfind(b"\n") + 1].splitlines()
        if not lines:
            return compiled, Tally()
        first, *parts = map(unseal_line, lines)
        try:
            told = json.loads(first or "")
            if told["asked"] != asked:
                raise BadRequest(
                    f"{self.journal}: journal of an interrupted sweep with other options",
                    remedy="Repeat that command, write another file, or remove the journal.",
                )
            done = next((Tally.parse(each) for each in reversed(parts) if each is not None), Tally())
            there = self.part.stat().st_size if self.part.exists() else 0
        except (ValueError, KeyError, TypeError, RecursionError):
            raise BadRequest(
                f"{self.journal}: not the journal of a sweep", remedy="Write another file, or remove this one."
            ) from None
        return told["compiled"], done if there >= self._place(done.done) else Tally()

    def _begin(self, asked: str) -> None:
        """Write the heads of both, or cut off what is no whole part; raises ``BadRequest`` for a disk too small."""
        free, need = shutil.disk_usage(self.target.parent).free, self._whole - self.tally.done * ROW.itemsize
        if need > free:
            raise BadRequest(
                f"{self.part}: size of the file in bytes",
                need,
                f"at most {free}",
                remedy="Free disk space, or use fewer poses.",
            )
        if not self.tally.done:
            self._rows.truncate(0)
            self._rows.write(self._head)
            self._lines.truncate(0)
            self._lines.seek(0)
            self._line(json.dumps({"asked": asked, "compiled": self.compiled}))
        else:
            self._lines.seek(0)
            self._lines.truncate(self._lines.read().rfind(b"\n") + 1)
            self._lines.seek(0, os.SEEK_END)

    def _place(self, done: int) -> int:
        """Return the offset of a cell's row."""
        return len(self._head) + done * ROW.itemsize

    def _line(self, text: str) -> None:
        self._lines.write(add_checksum(text).encode("ascii") + b"\n")
        self._lines.flush()
        os.fsync(self._lines.fileno())

    def add(self, rows: Array, tally: Tally) -> None:
        """Write the next rows, and what they came to with all before them."""
        with _stop_on_disk_error(self.journal):
            self._rows.seek(self._place(tally.done - len(rows)))
            self._rows.write(rows.tobytes())
            self._rows.flush()
            os.fsync(self._rows.fileno())
            self._line(tally.to_line())

    def rows(self, cells: NDArray[np.int64]) -> Array:
        """The rows (n, 2) of some cells."""
        handle = self._rows.fileno()  # a memory map would keep what the system reads ahead
        return np.frombuffer(
            b"".join(os.pread(handle, ROW.itemsize, self._place(cell)) for cell in cells.tolist())
        ).reshape(-1, 2)

    def finish(self) -> None:
        """Give the array its name."""
        os.replace(self.part, self.target)
        self.journal.unlink()

    def discard(self) -> None:
        """Leave nothing."""
        self.part.unlink()
        self.journal.unlink()


@contextmanager
def _stop_on_disk_error(journal: Path) -> Iterator[None]:
    """Raise ``BuildInterruption`` where the disk refuses."""
    try:
        yield
    except OSError as error:
        raise BuildInterruption(f"{error.filename or journal}: {error.strerror}", str(journal), "sweep") from None
