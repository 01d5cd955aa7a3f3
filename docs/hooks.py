"""Pages of the site that are made while it is built: the README, the executed notebooks, the reference."""

from __future__ import annotations

import ast
import base64
import html
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
import lessons

ROOT = lessons.ROOT
PACKAGE = ROOT / "src" / "hrsynth"
LINKS = {"docs/pictures/": "pictures/", "docs/pages/": "", "CONTRIBUTING.md": "contributing.md",
         "CHANGELOG.md": "changelog.md", "notebooks/README.md": "notebooks/index.md", "robots/README.md": "robots.md"}
"""Where what the README links to lies in the site."""
QUICK = "HRSYNTH_DOCS_QUICK"
"""Environment variable: notebooks of which no executed copy is kept are shown without outputs."""
FOLDERS = ("geometry", "mechanism", "description", "families", "kinematics", "closed_forms", "batch", "rewrite",
           "constraints", "analysis", "simulation", "selection", "present", "catalog")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that lie elsewhere or are made."""
    from mkdocs.structure.files import File

    for name, content in made():
        files.append(File.generated(config, name, content=content))
    return files


def made() -> Iterator[tuple[str, str | bytes]]:
    """Name and content of each page and picture that is made."""
    for name, source in (("index.md", "README.md"), ("contributing.md", "CONTRIBUTING.md"),
                         ("changelog.md", "CHANGELOG.md"), ("robots.md", "robots/README.md")):
        yield name, relinked((ROOT / source).read_text(encoding="utf-8"))
    overview = (lessons.FOLDER / "README.md").read_text(encoding="utf-8")
    yield "notebooks/index.md", underlined(overview.replace(".ipynb)", ".md)"))
    for picture in sorted((ROOT / "docs" / "pictures").iterdir()):
        yield f"pictures/{picture.name}", picture.read_bytes()
    for script in lessons.scripts():
        yield from lesson(script)
    yield "reference/index.md", public()
    for folder in FOLDERS:
        if (PACKAGE / folder).is_dir():
            yield f"reference/{folder}.md", modules(folder)


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """A page of ``docs/pages`` with its pictures where the site has them."""
    return markdown.replace("](../pictures/", "](pictures/")


def relinked(text: str) -> str:
    """A page of the project's own folder with its links turned to the site's."""
    for old, new in LINKS.items():
        text = text.replace(f"]({old}", f"]({new}")
    return underlined(text)


def underlined(text: str) -> str:
    """Motors underlined by markup, outside of blocks of code: not every font has the combining line."""
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if place % 2 else _underlined(part) for place, part in enumerate(parts))


def _underlined(text: str) -> str:
    text = re.sub(r"`([^`\n]*\u0332[^`\n]*)`", lambda found: f"<code>{html.escape(found[1])}</code>", text)
    return re.sub("(.)\u0332", r"<u>\1</u>", text)


def lesson(script: Path) -> Iterator[tuple[str, str | bytes]]:
    """The page of a notebook with its outputs, and its pictures."""
    page, pictures = [], 0
    run = lessons.kept(script).exists() or os.environ.get(QUICK) is None
    for cell in (lessons.executed(script) if run else lessons.notebook(script)).cells:
        if cell.cell_type == "markdown":
            page.append(underlined(cell.source))
            continue
        shown = [f"```python\n{cell.source}\n```"]
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "image/png" in data:
                pictures += 1
                name = f"{script.stem}_{pictures}.png"
                yield f"notebooks/{name}", base64.b64decode(data["image/png"])
                shown.append(f"![Picture {pictures} of this notebook: {caption(data)}]({name})")
            elif "image/svg+xml" in data:
                pictures += 1
                name = f"{script.stem}_{pictures}.svg"
                yield f"notebooks/{name}", data["image/svg+xml"]
                shown.append(f"![Picture {pictures} of this notebook: {caption(data)}]({name})")
            elif "text/html" in data:
                shown.append(f'<div class="output">{data["text/html"]}</div>')
            elif text := output.get("text") or data.get("text/plain"):
                shown.append(f'<div class="output"><pre>{_underlined(html.escape(text))}</pre></div>')
        page.append(folded(shown) if "solution" in cell.metadata.get("tags", []) else "\n\n".join(shown))
    yield f"notebooks/{script.stem}.md", "\n\n".join(page) + "\n"


def caption(data: Any) -> str:
    """The words under a picture: those of a result, else that it is a plot."""
    text = re.sub(r"^<Picture: (.*)>$", r"\1", data.get("text/plain", ""))
    return "a plot" if text.startswith("<Figure") else text.replace("[", "(").replace("]", ")")


def folded(parts: list[str]) -> str:
    """A block that opens when it is asked for."""
    inside = "\n\n".join(parts)
    return '??? success "Solution"\n\n' + "\n".join(f"    {line}" if line else "" for line in inside.splitlines())


def public() -> str:
    """What ``import hrsynth`` offers, in the order of its table of names."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    table = next(node.value for node in tree.body
                 if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_HOME")
    home: dict[str, str] = ast.literal_eval(table)
    head = "# Public functions\n\n`import hrsynth` offers these names; each is imported when it is first used."
    return "\n\n".join([head, *(f"::: hrsynth{module}.{name}" for name, module in home.items())])


def modules(folder: str) -> str:
    """Every module of a folder of the package."""
    names = [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in
             sorted((PACKAGE / folder).rglob("*.py")) if path.name != "__init__.py"]
    return f"# {folder}\n\n" + "\n\n".join(f"::: {name}\n    options:\n      heading_level: 2" for name in names)
