"""Process run by :func:`untrusted.run_program`: read the meshes named on standard input; for each write a line of JSON
that counts points and triangles, then their bytes."""

from __future__ import annotations

import io
import json
import resource
import sys
from pathlib import Path
from typing import Any

from hrsynth.untrusted import PROCESS_BYTES, find_packing_defect, refuse


class Beside:
    """Resolver of the buffers that a mesh names: files of limited size in its folder and below, nothing else."""

    def __init__(self, path: Path, largest: int) -> None:
        self.folder, self.largest = path.resolve().parent, largest

    def __getitem__(self, name: str) -> bytes:
        path = (self.folder / name).resolve()
        if not (path.suffix == ".bin" and path.is_relative_to(self.folder) and path.is_file()):
            raise FileNotFoundError(name)
        with path.open("rb") as file:
            content = file.read(self.largest + 1)
        if len(content) > self.largest:
            raise FileNotFoundError(name)
        return content

    get = __getitem__


def read_mesh(path: Path, text: str | None, largest: int) -> tuple[Any, Any] | None:
    """Return the points (n, 3), all of them corners, and triangles (m, 3) of a mesh from a file or text; None if it
    cannot be read."""
    import numpy as np
    import trimesh

    content = b"" if text is None else text.encode()
    if text is None:
        with path.open("rb") as file:
            content = file.read(largest + 1)
        if len(content) > largest:
            return None
    if wrong := find_packing_defect(content):
        refuse(f"{path.name}: {wrong}")
    kind = path.suffix.lower().lstrip(".")
    try:
        beside: Any = Beside(path, largest) if kind == "gltf" else None
        solid: Any = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", process=False, resolver=beside)
        used, faces = np.unique(np.array(solid.faces, dtype=np.int64).reshape(-1, 3), return_inverse=True)
        points, faces = np.array(solid.vertices, dtype=float)[used], faces.reshape(-1, 3).astype(np.int64)
    except Exception as error:  # readers of many formats, each with errors of its own
        if isinstance(error, MemoryError) or 2048 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss > PROCESS_BYTES:
            refuse(f"{path.name}: it needs more memory than {PROCESS_BYTES} bytes")
        return None
    return (points, faces) if len(faces) and np.all(np.isfinite(points)) else None


def main(largest: str) -> None:
    """Write all requested meshes, in order."""
    out = sys.stdout.buffer
    for name, text in json.load(sys.stdin):
        found = read_mesh(Path(name), text, int(largest))
        out.write(json.dumps(None if found is None else [len(each) for each in found]).encode() + b"\n")
        for each in found or ():
            out.write(each.tobytes())
    out.flush()
