"""Command line. Text goes to standard output, progress and warnings to standard error; exit status 0, 1, 2 or 3."""

from __future__ import annotations

import errno
import gc
import io
import os
import sys
import warnings

from ..errors import AssumedBase, AssumedPlatform
from . import completion, files, importing, lint, schema, studio
from .analyses import QUESTIONS
from .app import app
from .catalog import catalog
from .colour import close, print_text

for question in QUESTIONS:
    question.add(app)
lint.add(app)
files.add(app)
importing.add(app)
studio.add(app)
schema.add(app)
completion.add(app)
app.commands["catalog"] = catalog


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; a failure prints one line per defect, never a traceback."""
    for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(library, "1")
    gc.set_threshold(200_000)
    sys.stdout, sys.stderr = sys.stdout or io.StringIO(), sys.stderr or io.StringIO()
    for number in range(3):  # no opened file gets the number of a closed stream
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    if not os.path.isfile(__file__):
        print_text(
            f"hrsynth: {os.path.dirname(os.path.dirname(__file__))}: cannot run from an archive. Install it with pip.",
            err=True,
        )
        sys.exit(2)
    sys.exit(run_command(arguments))


def run_command(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit status."""
    try:
        with warnings.catch_warnings():
            for kind in (AssumedBase, AssumedPlatform):
                warnings.simplefilter("ignore", kind)  # printed as a note
            app.main(sys.argv[1:] if arguments is None else arguments)
        sys.stdout.flush()
        return 0
    except SystemExit as end:
        return int(end.code or 0)
    except BrokenPipeError:
        close(sys.stdout)
        return 0
    except KeyboardInterrupt:
        return 130
    except OSError as error:
        if error.filename is not None or error.errno not in (errno.ENOSPC, errno.EIO, errno.EBADF):
            return _report_failure(error)
        close(sys.stdout)
        print_text(
            f"hrsynth: cannot write to standard output: {error.strerror}. Free space, or write elsewhere.", err=True
        )
        return 2
    except Exception as error:
        return _report_failure(error)


def _report_failure(error: Exception) -> int:
    """Print a failure and return the exit status."""
    from ..errors import HrsynthError

    if isinstance(error, HrsynthError):
        for line in error.lines():
            print_text(f"hrsynth: {line}", err=True)
        return error.exit_status
    if os.environ.get("HRSYNTH_DEBUG"):
        raise error
    what = " ".join(f"{type(error).__name__}: {error}".split())
    print_text(f"hrsynth: internal error: {what}. Report it with the command and its files.", err=True)
    return 3
