"""Add the README as long description, its links made absolute, which pyproject.toml cannot express."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
IMAGES = (".png", ".svg", ".gif")


def long_description() -> str:
    """Return the README with links to the repository at this version's tag; figures link to their raw files."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module = (ROOT / "src" / "hrsynth" / "version.py").read_text(encoding="utf-8")
    version = re.search(r'^__version__ = "(.*)"', module, re.MULTILINE)[1]

    def absolute(link: re.Match[str]) -> str:
        kind = "raw" if link[1].endswith(IMAGES) else "blob"
        return f"]({project['urls']['Repository']}/{kind}/v{version}/{link[1]})"

    return re.sub(r"\]\((?!https?://|mailto:|#)([^)\s]+)\)", absolute, (ROOT / "README.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    setup(long_description=long_description(), long_description_content_type="text/markdown")
