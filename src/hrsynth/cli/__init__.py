"""The command line: thin. Text to standard output, progress and warnings to standard error; exit status 0, 2 or 3."""

from __future__ import annotations

import errno
import gc
import io
import os
import sys
from typing import Annotated

import typer

from . import completion, files, importing, lint, schema, studio
from .catalog import catalog
from .commands import HELP, WholeGroup
from .questions import QUESTIONS

app = typer.Typer(
    name="hrsynth", cls=WholeGroup, invoke_without_command=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, context_settings=HELP,
    help="Hidden robots of parallel robots that are controlled by watching the directions of their legs.")
for question in QUESTIONS:
    question.add(app)
lint.add(app)
files.add(app)
importing.add(app)
studio.add(app)
app.add_typer(catalog)
schema.add(app)
completion.add(app)


def _version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        typer.echo(f"hrsynth {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")]
    = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; every failure is one line a defect, never a traceback."""
    for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(library, "1")
    gc.set_threshold(50_000)
    sys.stdout, sys.stderr = sys.stdout or io.StringIO(), sys.stderr or io.StringIO()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    sys.exit(execute(arguments))


def execute(arguments: list[str] | None = None) -> int:
    """Run a command; the exit status."""
    try:
        status = app(args=arguments, prog_name="hrsynth", standalone_mode=False)
        sys.stdout.flush()
        return int(status or 0)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return 130
    except OSError as error:
        if error.filename is not None or error.errno not in (errno.ENOSPC, errno.EIO, errno.EBADF):
            return _report_failure(error)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        typer.echo(f"hrsynth: cannot write to standard output: {error.strerror}", err=True)
        return 2
    except Exception as error:
        return _report_failure(error)


def _report_failure(error: Exception) -> int:
    """Say what went wrong; the exit status."""
    from ..errors import HrsynthError

    if isinstance(error, HrsynthError):
        for line in error.lines():
            typer.echo(f"hrsynth: {line}", err=True)
        return error.exit_status
    usage = getattr(error, "format_message", None)
    if usage is not None:
        message = " ".join(str(usage()).split())
        if message:
            typer.echo(f"hrsynth: {message}", err=True)
        return 2
    if os.environ.get("HRSYNTH_DEBUG"):
        raise error
    what = " ".join(f"{type(error).__name__}: {error}".split())
    typer.echo(f"hrsynth: a defect of hrsynth itself, please report it: {what}", err=True)
    return 3
