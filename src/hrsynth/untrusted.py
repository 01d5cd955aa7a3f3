"""Untrusted content: limits of unpacked size, and of the programs that read it."""

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

from .errors import BadRequest

UNPACKED_MAX_BYTES = 200_000_000
"""Largest unpacked size of a file, an archive or a robot's meshes (bytes)."""
ARCHIVE_FILES_MAX = 1000
"""Files that an archive may hold."""
PROCESS_BYTES = 1_700_000_000
"""Address space of a process that reads an untrusted file (bytes)."""

START = "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from {} import start; start(*sys.argv[2:])"
REFUSED = "refused: "
"""Start of a line by which such a program refuses its input."""


def unpack_gzip(content: bytes, file: object, most: int) -> bytes:
    """Unpack gzip; raises ``BadRequest`` for other, truncated or too much content."""
    parts, size = [], 0
    try:
        while content:
            inflate = zlib.decompressobj(wbits=31)
            parts.append(inflate.decompress(content, most - size + 1))
            size += len(parts[-1])
            if size > most:
                raise BadRequest(f"{file}: unpacks to more than {most} bytes", remedy="Use a smaller file.")
            if not inflate.eof:
                raise zlib.error
            content = inflate.unused_data.lstrip(b"\0")
    except zlib.error:
        raise BadRequest(f"{file}: truncated or not gzip", remedy="Copy the file again.") from None
    return b"".join(parts)


def find_packing_defect(content: bytes) -> str | None:
    """Return the defect of a zip archive by its list of files, before unpacking; None for other content."""
    if not content.startswith(b"PK"):
        return None
    try:
        files = zipfile.ZipFile(io.BytesIO(content)).infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError):
        return "a zip archive that cannot be read"
    size = sum(each.file_size for each in files)
    if len(files) > ARCHIVE_FILES_MAX:
        return f"an archive of {len(files)} files, more than {ARCHIVE_FILES_MAX}"
    if size > UNPACKED_MAX_BYTES:
        return f"an archive that unpacks to {size} bytes, more than {UNPACKED_MAX_BYTES}"
    names = [each.filename.replace("\\", "/") for each in files]
    if any(name.startswith("/") or ".." in name.split("/") for name in names):
        return "an archive with names that lead out of it"
    return None


def refuse(what: str) -> None:
    """End such a program with the defect of its input."""
    print(REFUSED + " ".join(what.split()), file=sys.stderr, flush=True)
    os._exit(2)


def run_program(program: Path, *arguments: str, seconds: int, given: str = "") -> bytes:
    """Return the output of a program's ``main``, run in a process of limited time, memory and output; ``given``: its
    standard input. Raises ``BadRequest`` if it refuses its input or does not finish."""
    command = [
        sys.executable,
        "-I",
        "-c",
        START.format(__name__),
        json.dumps(sys.path),
        str(program),
        str(seconds),
        str(UNPACKED_MAX_BYTES),
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
            lines = errors.read(UNPACKED_MAX_BYTES).decode("utf-8", "replace").splitlines()
    except (subprocess.TimeoutExpired, ValueError):
        raise BadRequest(f"not read within {seconds} s") from None
    except OSError as error:
        raise BadRequest(f"{tempfile.gettempdir()}: {error.strerror}", remedy="Set TMPDIR to another folder.") from None
    last = [line.removeprefix(REFUSED) for line in lines if line.startswith(REFUSED)]
    raise BadRequest(last[-1][:400] if last else "memory or time limit exceeded, or the reader crashed")


def start(program: str, seconds: str, most: str, *arguments: str) -> None:
    """Run ``main`` of a program within the limits; called in that process."""
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
        refuse(f"reading needs more than {PROCESS_BYTES} bytes of memory")
    except OSError as error:
        refuse(f"not readable, or unpacks to more than {most} bytes: {error.strerror}")
    os._exit(0)
