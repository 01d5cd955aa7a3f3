"""Modules of generated Python, whose compiled functions numba keeps in a folder of the user's."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any


@lru_cache(maxsize=64)
def load_compiled_module(text: str) -> Any:
    """The module of a text, compiled or from numba's cache, which goes by the file that holds the text."""
    import importlib.util

    from ..description.files import open_replacement

    file = locate_module_file(text)
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        with open_replacement(file) as draft:
            draft.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.stem] = module  # where numba looks for it when it reads its cache
    spec.loader.exec_module(module)
    return module


def locate_module_file(text: str) -> Path:
    """Return the path of a module's text."""
    return _choose_cache_folder() / f"kernels_{hashlib.sha256(text.encode()).hexdigest()[:24]}.py"


@lru_cache(maxsize=1)
def _choose_cache_folder() -> Path:
    """A folder of the user's for compiled kernels; one of this run where that cannot be written."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hrsynth" / "kernels"
    try:
        home.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="hrsynth-"))
    return home if os.access(home, os.W_OK) else Path(tempfile.mkdtemp(prefix="hrsynth-"))
