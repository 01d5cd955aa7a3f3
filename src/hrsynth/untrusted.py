"""Content that is not trusted: what it unpacks to, and what a program makes of it, stays within limits."""

from __future__ import annotations

import io
import json
import os
import runpy
import subprocess
import sys
import tempfile
import zipfile
import zlib
from pathlib import Path

from .budgets import LARGEST_UNPACKED, MOST_UNPACKED, PROCESS_BYTES
from .errors import BadRequest

START = "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from {} import start; start(*sys.argv[2:])"
REFUSED = "refused: "
"""What the last line of such a program begins with where it refuses what it reads."""


def gunzip(content: bytes, file: object, most: int) -> bytes:
    """What bytes of gzip unpack to; raises ``BadRequest`` where they are none, cut off, or unpack to too much."""
    parts, size = [], 0
    try:
        while content:
            inflate = zlib.decompressobj(wbits=31)
            parts.append(inflate.decompress(content, most - size + 1))
            size += len(parts[-1])
            if size > most:
                raise BadRequest(f"{file}: unpacks to", f"more than {most} bytes", f"up to {most}")
            if not inflate.eof:
                raise zlib.error
            content = inflate.unused_data.lstrip(b"\0")
    except zlib.error:
        raise BadRequest(f"{file}: truncated, or not compressed with gzip") from None
    return b"".join(parts)


def packing_defect(content: bytes) -> str | None:
    """What is wrong with a zip archive by its list of files, before any is unpacked; None for other content."""
    if not content.startswith(b"PK"):
        return None
    try:
        files = zipfile.ZipFile(io.BytesIO(content)).infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError):
        return "a zip archive that cannot be read"
    size = sum(each.file_size for each in files)
    if len(files) > MOST_UNPACKED:
        return f"an archive of {len(files)} files, allowed: up to {MOST_UNPACKED}"
    if size > LARGEST_UNPACKED:
        return f"an archive that unpacks to {size} bytes, allowed: up to {LARGEST_UNPACKED}"
    names = [each.filename.replace("\\", "/") for each in files]
    if any(name.startswith("/") or ".." in name.split("/") for name in names):
        return "an archive with names that lead out of it"
    return None


def refuse(what: str) -> None:
    """End such a program with what is wrong with what it reads."""
    print(REFUSED + " ".join(what.split()), file=sys.stderr, flush=True)
    os._exit(2)


def output(program: Path, *arguments: str, seconds: int, given: str = "") -> bytes:
    """What ``main`` of a program prints, run in a process of its own, of limited time, memory and output, with a text
    on its standard input; raises ``BadRequest`` with what it refuses, or that it came to no end."""
    command = [
        sys.executable,
        "-I",
        "-c",
        START.format(__name__),
        json.dumps(sys.path),
        str(program),
        str(seconds),
        str(LARGEST_UNPACKED),
        *arguments,
    ]
    own = {key: value for key, value in os.environ.items() if key != "PXR_AR_DEFAULT_SEARCH_PATH"}
    own |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        with tempfile.TemporaryFile() as told, tempfile.TemporaryFile() as errors:
            run = subprocess.run(
                command, input=given.encode(), stdout=told, stderr=errors, timeout=3 * seconds, check=False, env=own
            )
            told.seek(0)
            if run.returncode == 0:
                return told.read()
            errors.seek(0)
            lines = errors.read(LARGEST_UNPACKED).decode("utf-8", "replace").splitlines()
    except (subprocess.TimeoutExpired, ValueError):
        raise BadRequest("it did not finish", None, f"{seconds} seconds") from None
    except OSError as error:
        raise BadRequest(f"cannot write a temporary file: {error.strerror}", tempfile.gettempdir()) from None
    last = [line.removeprefix(REFUSED) for line in lines if line.startswith(REFUSED)]
    raise BadRequest(last[-1][:400] if last else "it needs more memory or time than is allowed, or breaks its reader")


def start(program: str, seconds: str, most: str, *arguments: str) -> None:
    """Run ``main`` of a program within the limits (called in that process)."""
    import resource

    for limit, amount in (
        (resource.RLIMIT_AS, PROCESS_BYTES),
        (resource.RLIMIT_CPU, int(seconds)),
        (resource.RLIMIT_FSIZE, int(most)),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(limit)[1]
        amount = amount if hard == resource.RLIM_INFINITY else min(amount, hard)
        resource.setrlimit(limit, (amount, amount))
    try:
        runpy.run_path(program)["main"](*arguments)
        sys.stdout.flush()
    except (MemoryError, RecursionError):
        refuse(f"it needs more memory than {PROCESS_BYTES} bytes")
    except OSError as error:
        refuse(f"it cannot be read, or unpacks to more than {most} bytes: {error.strerror}")
    os._exit(0)
