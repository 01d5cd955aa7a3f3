"""Generate pages while the site is built: README, executed notebooks, gallery, reference; set formulas as SVG."""

from __future__ import annotations

import ast
import base64
import hashlib
import html
import io
import os
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
import lessons
import pictures
from tables import commands, errors

ROOT = lessons.ROOT
PACKAGE = ROOT / "src" / "hrsynth"
LINKS = {
    "docs/pictures/": "pictures/",
    "docs/pages/": "",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "notebooks/README.md": "notebooks/index.md",
    "robots/README.md": "robots.md",
}
"""Links of the README, and their targets in the site."""
QUICK = "HRSYNTH_DOCS_QUICK"
"""Environment variable: notebooks without a stored executed copy are shown without outputs."""
FOLDERS = (
    "geometry",
    "mechanism",
    "description",
    "linting",
    "families",
    "kinematics",
    "closed_forms",
    "batch",
    "rewrite",
    "constraints",
    "analysis",
    "simulation",
    "selection",
    "present",
    "catalog",
)


def on_files(files: Any, config: Any) -> Any:
    """Add pages of other folders and generated pages."""
    from mkdocs.structure.files import File

    for name, content in made():
        files.append(File.generated(config, name, content=content))
    return files


def made() -> Iterator[tuple[str, str | bytes]]:
    """Yield name and content of each generated page and figure."""
    for name, source in (
        ("readme.md", "README.md"),
        ("contributing.md", "CONTRIBUTING.md"),
        ("changelog.md", "CHANGELOG.md"),
        ("robots.md", "robots/README.md"),
    ):
        yield name, relinked((ROOT / source).read_text(encoding="utf-8"))
    overview = (lessons.FOLDER / "README.md").read_text(encoding="utf-8")
    yield "notebooks/index.md", underlined(overview.replace(".ipynb)", ".md)"))
    for picture in sorted((ROOT / "docs" / "pictures").iterdir()):
        yield f"pictures/{picture.name}", picture.read_bytes()
    yield "gallery.md", gallery()
    for script in lessons.scripts():
        yield from lesson(script)
    yield "json.md", records()
    yield from build_reference()
    yield "reference/index.md", public()
    for folder in FOLDERS:
        if (PACKAGE / folder).is_dir():
            yield f"reference/{folder}.md", modules(folder)


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Return a page of ``docs/pages`` with the site's links of figures and with formulas as SVG."""
    return typeset(markdown.replace("](../pictures/", "](pictures/"))


def typeset(markdown: str) -> str:
    """Replace formulas between dollars by SVG, outside of code: ``$$…$$`` on lines of their own, ``$…$`` in a line."""
    parts = re.split(r"(^ *```.*?^ *```$|`[^`\n]*`|<pre>.*?</pre>)", markdown, flags=re.MULTILINE | re.DOTALL)
    for place in range(0, len(parts), 2):
        found = re.sub(
            r"^\$\$\s*(.+?)\s*\$\$$",
            lambda m: f'<p class="formula">{drawn(m[1])}</p>',
            parts[place],
            flags=re.MULTILINE | re.DOTALL,
        )
        parts[place] = re.sub(r"(?<![\\$\w])\$(?! )([^$\n]+?)(?<! )\$(?![\d$])", lambda m: drawn(m[1]), found)
    return "".join(parts)


@cache
def drawn(formula: str) -> str:
    """Return a formula (in the LaTeX subset of matplotlib) as SVG, aligned with its line of text."""
    from matplotlib import mathtext, rc_context

    stream = io.StringIO()
    with rc_context({"mathtext.fontset": "stix", "svg.fonttype": "path", "svg.hashsalt": formula}):
        depth = mathtext.math_to_image(f"${' '.join(formula.split())}$", stream, format="svg", dpi=72)
    text = stream.getvalue()
    text = re.sub(
        r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>|<path[^>]*fill: #ffffff[^>]*/>",
        "",
        text[text.index("<svg") :],
        flags=re.DOTALL,
    )
    prefix = f"f{hashlib.sha256(formula.encode()).hexdigest()[:8]}"
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{prefix}", text)
    width, height = (float(value) / 10 for value in re.findall(r'(?:width|height)="([0-9.]+)pt"', text)[:2])
    text = re.sub(r'width="[0-9.]+pt"', f'width="{width:.3f}em"', text, count=1)
    text = re.sub(r'height="[0-9.]+pt"', f'height="{height:.3f}em"', text, count=1)
    label = html.escape(formula, quote=True)
    text = text.replace(
        "<svg ", f'<svg class="math" role="img" aria-label="{label}" style="vertical-align: {-depth / 10:.3f}em" ', 1
    )
    return re.sub(r"\s*\n\s*", " ", text).strip()


def gallery() -> str:
    """Return the page of all figures, each with the command that draws it."""
    head = (
        "---\nhide: [toc]\n---\n\n# Gallery\n\nThe command below each figure draws it; "
        '`make pictures` draws all.\n\n<div class="gallery" markdown>\n'
    )
    cells = []
    for name in pictures.PICTURES:
        typed = pictures.command(name)
        if (pictures.FOLDER / name).exists():
            cells.append(
                f"<figure markdown>\n[![{typed}](pictures/{name})](pictures/{name})\n"
                f"<figcaption markdown>`{typed}`</figcaption>\n</figure>\n"
            )
    return "\n".join([head, *cells, "</div>\n"])


def relinked(text: str) -> str:
    """Return a page of the root folder with the links of the site."""
    for old, new in LINKS.items():
        text = text.replace(f"]({old}", f"]({new}")
    return underlined(text)


def underlined(text: str) -> str:
    """Underline motors by markup, outside of code blocks: not every font has the combining line."""
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if place % 2 else _underlined(part) for place, part in enumerate(parts))


def _underlined(text: str) -> str:
    text = re.sub(r"`([^`\n]*\u0332[^`\n]*)`", lambda found: f"<code>{html.escape(found[1])}</code>", text)
    return re.sub("(.)\u0332", r"<u>\1</u>", text)


def lesson(script: Path) -> Iterator[tuple[str, str | bytes]]:
    """Yield the page of a notebook with its outputs, and its figures."""
    page, figures = [], 0
    run = lessons.kept(script).exists() or os.environ.get(QUICK) is None
    for cell in (lessons.executed(script) if run else lessons.notebook(script)).cells:
        if cell.cell_type == "markdown":
            page.append(underlined(cell.source))
            continue
        shown = [f"```python\n{cell.source}\n```"]
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "image/png" in data:
                figures += 1
                name = f"{script.stem}_{figures}.png"
                yield f"notebooks/{name}", base64.b64decode(data["image/png"])
                shown.append(f"![Figure {figures} of this notebook: {caption(data)}]({name})")
            elif "image/svg+xml" in data:
                figures += 1
                name = f"{script.stem}_{figures}.svg"
                yield f"notebooks/{name}", data["image/svg+xml"]
                shown.append(f"![Figure {figures} of this notebook: {caption(data)}]({name})")
            elif "text/html" in data:
                shown.append(f'<div class="output">{data["text/html"]}</div>')
            elif text := output.get("text") or data.get("text/plain"):
                shown.append(f'<div class="output"><pre>{_underlined(html.escape(text))}</pre></div>')
        page.append(folded(shown) if "solution" in cell.metadata.get("tags", []) else "\n\n".join(shown))
    yield f"notebooks/{script.stem}.md", "\n\n".join(page) + "\n"


def caption(data: Any) -> str:
    """Return the caption of a figure: that of a result, else 'a plot'."""
    text = re.sub(r"^<(?:Picture|Drawing): (.*)>$", r"\1", data.get("text/plain", ""))
    return "a plot" if text.startswith("<Figure") else text.replace("[", "(").replace("]", ")")


def folded(parts: list[str]) -> str:
    """Return a block that opens on click."""
    inside = "\n\n".join(parts)
    return '??? success "Solution"\n\n' + "\n".join(f"    {line}" if line else "" for line in inside.splitlines())


def public() -> str:
    """Return the page of public names, in the order of the index."""
    from hrsynth.index import list_public_modules

    head = "# Public functions\n\n`import hrsynth` provides these names; each is imported at its first use."
    return "\n\n".join([head, *(f"::: hrsynth.{module}.{name}" for name, module in list_public_modules().items())])


def records() -> str:
    """Return the page of JSON schemas of all commands."""
    from hrsynth.cli.schema import format_schema_page

    return format_schema_page()


def build_reference() -> Iterator[tuple[str, str]]:
    """Yield name and content of the pages of commands and of errors."""
    yield "commands.md", commands.build_page()
    yield "errors.md", errors.build_page()


def modules(folder: str) -> str:
    """Return the page of a folder of the package: public names, then modules, those with public names first."""
    from hrsynth.index import list_public_modules

    names = [
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        for path in (PACKAGE / folder).rglob("*.py")
        if path.name != "__init__.py"
    ]
    called: dict[str, list[str]] = {}
    for name, module in list_public_modules().items():
        if f"{module}.".startswith(f"{folder}."):
            called.setdefault(f"hrsynth.{module}", []).append(name)
    order = sorted(names, key=lambda name: (name not in called, name))
    lines = [
        f"- [`hrsynth.{name}`](index.md#{module}.{name}): {first_line(module, name)}"
        for module, each in sorted(called.items())
        for name in each
    ]
    head = "\n".join([f"# {folder}", "", *(["Public names of this folder:", "", *lines, ""] if lines else [])])
    return head + "\n\n" + "\n\n".join(f"::: {name}\n    options:\n      heading_level: 2" for name in order)


def first_line(module: str, name: str) -> str:
    """Return the first paragraph of the docstring of a public name."""
    base = PACKAGE.parent.joinpath(*module.split("."))
    source = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
    for node in ast.parse(source.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return (ast.get_docstring(node) or "").split("\n\n")[0].replace("\n", " ")
    return ""
