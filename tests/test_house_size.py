"""No folder of the package has more lines than ``house.toml`` allows; ``python tests/test_house_size.py`` lowers it.

Counted are lines of Python that hold code (no blank lines, comments, docstrings), and all lines of templates, pages,
style sheets and tables. Numbers fall: one is raised by hand, in the commit that says why.
"""

from __future__ import annotations

import io
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "hrsynth"
ALLOWED = Path(__file__).with_name("house.toml")
OTHER = {".j2", ".js", ".css", ".html", ".toml", ".hpp", ".mplstyle"}
SHIPPED = {"robots", "shipped", "three.min.js"}
LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
LOOSE = 1.01


def statements(text: str) -> Iterator[list[tokenize.TokenInfo]]:
    """The tokens of each logical line, without layout."""
    statement: list[tokenize.TokenInfo] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.NEWLINE, tokenize.ENDMARKER):
            yield statement
            statement = []
        elif token.type not in LAYOUT:
            statement.append(token)


def code_lines(text: str) -> int:
    """Lines that hold a token of a statement other than a text alone."""
    return len(
        {
            line
            for statement in statements(text)
            if any(token.type != tokenize.STRING for token in statement)
            for token in statement
            for line in range(token.start[0], token.end[0] + 1)
        }
    )


@cache
def counted() -> dict[str, Counter[str]]:
    """Lines of code and of other files by folder; the modules beside the folders are the folder ``top``."""
    found: dict[str, Counter[str]] = {"code": Counter(), "other": Counter()}
    for path in sorted(PACKAGE.rglob("*")):
        parts = path.relative_to(PACKAGE).parts
        if not path.is_file() or SHIPPED & {*parts}:
            continue
        folder = parts[0] if len(parts) > 1 else "top"
        if path.suffix == ".py":
            found["code"][folder] += code_lines(path.read_text(encoding="utf-8"))
        elif path.suffix in OTHER:
            found["other"][folder] += path.read_text(encoding="utf-8").count("\n")
    return found


def allowed() -> dict[str, dict[str, int]]:
    return tomllib.loads(ALLOWED.read_text(encoding="utf-8"))


def test_no_folder_has_more_lines_than_allowed():
    limits = allowed()
    over = [
        f"{kind} of {folder}: {lines}: expected {limits[kind].get(folder, 0)}"
        for kind, folders in counted().items()
        for folder, lines in folders.items()
        if lines > limits[kind].get(folder, 0)
    ]
    assert not over, "\n".join(["folders with more lines than tests/house.toml allows:", *over])


def test_what_is_allowed_follows_what_is_there():
    for kind, folders in counted().items():
        assert sum(allowed()[kind].values()) <= LOOSE * sum(folders.values()), "run python tests/test_house_size.py"


def test_docstrings_comments_and_blank_lines_are_not_code():
    text = '"""Title.\n\nMore.\n"""\n\n# note\nA = (\n    1,  # one\n\n    2,\n)\n"""What A is."""\nT = """a\n\nb"""\n'
    assert code_lines(text) == 4 + 3


def lowered() -> str:
    """The file with each number lowered to what is there."""
    limits = allowed() if ALLOWED.exists() and ALLOWED.stat().st_size else {}
    lines = ["# Lines that each folder of src/hrsynth may have: tests/test_house_size.py says how they are counted."]
    for kind, folders in counted().items():
        rows = {folder: min(n, limits.get(kind, {}).get(folder, n)) for folder, n in sorted(folders.items())}
        lines += ["", f"[{kind}]  # {sum(rows.values())}", *[f"{folder} = {n}" for folder, n in rows.items()]]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    ALLOWED.write_text(lowered(), encoding="utf-8")
