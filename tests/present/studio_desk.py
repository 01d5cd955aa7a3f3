"""A desk for tests of the studio's server: it answers with its process, sleeps, eats memory, ends."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from hrsynth.errors import BadRequest


class StandIn:
    """Answers as asked."""

    def __init__(self, folder: Path | None, uploads: Path | None, given: dict[str, Any] | None) -> None:
        self.about = {"folder": folder and str(folder), "uploads": str(uploads), "given": given}

    def answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        """By the name of the ask."""
        match asked["ask"]:
            case "sleep":
                time.sleep(asked["seconds"])
            case "busy":  # a library that never gives the interpreter back is as deaf
                sum(1 for _ in range(10**12))
            case "start":
                child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
                return {"child": child.pid}
            case "eat":
                return {"size": len(bytearray(asked["bytes"]))}
            case "end":
                os._exit(3)
            case "refuse":
                raise BadRequest("nothing fits", 7, "less")
            case "defect":
                raise ZeroDivisionError("by zero")
            case "nan":
                return {"value": float("nan")}
            case "read":
                return {"text": Path(self.about["uploads"] or "", asked["name"]).read_text()}
            case "echo":
                return {"text": asked["text"] * asked.get("times", 1)}
        return {"process": os.getpid(), **self.about}
