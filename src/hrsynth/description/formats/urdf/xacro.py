"""Xacro files, where the package of that name is installed: it expands them in a process that can do nothing else."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

from ....budgets import XACRO_SECONDS
from ... import xml


def is_needed(root: xml.Element) -> bool:
    """Whether a URDF document uses elements of xacro."""
    tags = (element.tag for element in root.iter()) if root.tag == "robot" else ()
    return any(isinstance(tag, str) and "xacro}" in tag for tag in tags)


def expand(path: Path) -> xml.Element:
    """The document that a xacro file stands for; raises ``BadRobotFile``."""
    import subprocess

    if importlib.util.find_spec("xacro") is None:
        raise xml.refusal(path, "a xacro file, and the package xacro is not installed",
                          "the extra hrsynth[xacro], or the URDF that it expands to")
    command = [sys.executable, "-P", str(Path(__file__).with_name("xacro_process.py")), str(path.resolve())]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=XACRO_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise xml.refusal(path, "xacro did not finish", f"{XACRO_SECONDS} seconds") from None
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if line.strip()]
        raise xml.refusal(path, "xacro refuses it: " + " ".join(lines[-1:])[:200],
                          "a file that xacro expands")
    return xml.document(run.stdout, str(path))
