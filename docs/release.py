"""Make a release: set version, changelog and citation, build and test source archive and wheel, commit and tag.

    make release VERSION=0.3.0

Nothing is uploaded or pushed; the last lines print how. A failure leaves neither commit nor tag.
"""

from __future__ import annotations

import datetime
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NEEDED = (
    "Makefile",
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "LICENSE",
    "LICENSE.three.js",
    "README.md",
    "SECURITY.md",
    "mkdocs.yml",
    "requirements/main.txt",
    "robots/quattro.urdf",
    "catalog/mixed.jsonl.gz",
    "notebooks/1_the_idea.ipynb",
    "docs/pages/theory.md",
    "tests/oracle.py",
    "benchmarks/table.py",
    "studies/parroblib/README.md",
)
"""Files that a source archive must contain, of each kind one."""
ADDRESSES = ("pyproject.toml", "SECURITY.md")
"""Files with addresses of the project."""
RESERVED = re.compile(r"\bhrsynth\.example\b")
"""Name reserved by RFC 2606."""
PACKAGED = ("hrsynth/robots/quattro.urdf", "hrsynth/catalog/shipped/mixed.jsonl.gz")
"""Files that a wheel must contain besides those of the package: targets of links."""


class Refused(Exception):
    """Reason why there is no release."""


def main(version: str) -> None:
    """Make the release."""
    changed = release_texts(version)
    if git("status", "--porcelain"):
        raise Refused("the tree has changes that are not committed: commit or stash them")
    if git("tag", "--list", f"v{version}"):
        raise Refused(f"the tag v{version} is there already")
    require_addresses()
    before = {path: path.read_text(encoding="utf-8") for path in changed}
    try:
        for path, text in changed.items():
            path.write_text(text, encoding="utf-8")
        archive, wheel = build(ROOT, ROOT / "dist")
        complaints = [*archive_complaints(archive), *wheel_complaints(wheel, version)]
        if complaints:
            raise Refused("; ".join(complaints))
        tried(wheel, version)
    except BaseException:
        for path, text in before.items():
            path.write_text(text, encoding="utf-8")
        raise
    git("commit", "--quiet", "--message", f"Version {version}", "--", *map(str, changed))
    git("tag", "--annotate", f"v{version}", "--message", f"hrsynth {version}")
    print(f"dist/{archive.name} and dist/{wheel.name} are checked, v{version} is tagged; nothing is uploaded.")
    print(f"To publish: git push origin HEAD v{version}, then upload both files of dist/.")


def release_texts(version: str) -> dict[Path, str]:
    """Return the files that name the version, with the new one; raise ``Refused`` if it is not valid."""
    package, changes, citation = ROOT / "src" / "hrsynth" / "version.py", ROOT / "CHANGELOG.md", ROOT / "CITATION.cff"
    code, log, cite = (path.read_text(encoding="utf-8") for path in (package, changes, citation))
    present = re.search(r'^__version__ = "(.*)"$', code, re.MULTILINE)[1]
    if not re.fullmatch(r"\d+\.\d+\.\d+", version) or numbers(version) <= numbers(present):
        raise Refused(f"VERSION={version or 'none'}: a version such as 0.3.0 that comes after {present}")
    unreleased = re.search(r"^## \[Unreleased\]\n(.*?)(?=^## \[)", log, re.MULTILINE | re.DOTALL)
    if unreleased is None or not re.search(r"^- ", unreleased[1], re.MULTILINE):
        raise Refused("CHANGELOG.md: nothing stands under [Unreleased]")
    today = datetime.date.today().isoformat()
    return {
        package: code.replace(f'__version__ = "{present}"', f'__version__ = "{version}"'),
        changes: log.replace("## [Unreleased]\n", f"## [Unreleased]\n\n## [{version}] - {today}\n", 1),
        citation: re.sub(
            r"^version: .*$",
            f"version: {version}",
            re.sub(r"^date-released: .*$", f"date-released: {today}", cite, flags=re.MULTILINE),
            count=1,
            flags=re.MULTILINE,
        ),
    }


def numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a version, for comparisons."""
    return tuple(map(int, version.split(".")))


def placeholders() -> list[str]:
    """Return file and line of each reserved address, to be replaced before a release."""
    return [
        f"{name}:{number}: {line.strip()}"
        for name in ADDRESSES
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").splitlines(), 1)
        if RESERVED.search(line)
    ]


def require_addresses() -> None:
    """Raise ``Refused`` while some of the project's addresses are the reserved ones."""
    if left := placeholders():
        raise Refused("\n  ".join(["write the project's own addresses in place of these, which are nobody's:", *left]))


def build(source: Path, target: Path) -> tuple[Path, Path]:
    """Build the source archive, and the wheel from it alone."""
    target.mkdir(exist_ok=True)
    archive = target / built(source, "build_sdist", target)
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(archive) as file:
            file.extractall(folder, filter="data")
        (unpacked,) = Path(folder).iterdir()
        return archive, target / built(unpacked, "build_wheel", target)


def built(source: Path, what: str, target: Path) -> str:
    """Run a build step of setuptools in a folder; return the name of its file."""
    code = "import sys, setuptools.build_meta as b; sys.stderr.write('\\n' + getattr(b, sys.argv[1])(sys.argv[2]))"
    done = subprocess.run([sys.executable, "-c", code, what, str(target)], cwd=source, capture_output=True, text=True)
    if done.returncode:
        raise Refused(f"{what} failed: {' '.join(done.stderr.split())[-400:]}")
    return done.stderr.splitlines()[-1]


def archive_complaints(archive: Path) -> Iterator[str]:
    """Yield the files that a source archive lacks."""
    with tarfile.open(archive) as file:
        held = {name.partition("/")[2] for name in file.getnames()}
    yield from (f"{archive.name} lacks {name}" for name in NEEDED if name not in held)


def wheel_complaints(wheel: Path, version: str) -> Iterator[str]:
    """Yield defects of a wheel's files and metadata: as ``twine check``, and links without a target."""
    with zipfile.ZipFile(wheel) as file:
        held = set(file.namelist())
        (name,) = (each for each in held if each.endswith(".dist-info/METADATA"))
        metadata = message_from_bytes(file.read(name))
    source = ROOT / "src"
    own = [
        path.relative_to(source).as_posix()
        for path in sorted((source / "hrsynth").rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ]
    yield from (f"{wheel.name} lacks {name}" for name in (*PACKAGED, *own) if name not in held)
    yield from (f"{wheel.name} holds {name}" for name in sorted(held) if name.startswith("tests/"))
    text = str(metadata.get_payload())
    for field in ("Name", "Summary", "Author-email", "License-Expression", "Requires-Python", "Project-URL"):
        if not metadata[field]:
            yield f"the metadata has no {field}"
    if metadata["Version"] != version:
        yield f"the metadata has version {metadata['Version']}"
    if metadata["Description-Content-Type"] != "text/markdown" or "# hrsynth" not in text:
        yield "the metadata has no long description in Markdown"
    yield from (
        f"the long description has a link that leads nowhere: {link}"
        for link in re.findall(r"\]\(([^)]*)\)", text)
        if not link.startswith(("https://", "#"))
    )


def tried(wheel: Path, version: str) -> None:
    """Raise ``Refused`` if the wheel, installed in a new environment with the packages of this one, does not run."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder) / "env"
        venv.create(here, with_pip=False)
        site = next((here / "lib").glob("python*/site-packages"))
        with zipfile.ZipFile(wheel) as file:
            file.extractall(site)
        packages = [each for each in sys.path if each.endswith("site-packages")]
        (site / "here.pth").write_text("\n".join(packages), encoding="utf-8")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        commands = {f"hrsynth {version}": ["--version"], "controllable": ["derive", "quattro", "--observe", "1,4"]}
        for expected, command in commands.items():
            code = (
                "import sys; sys.path.insert(0, sys.argv.pop(1)); import hrsynth, hrsynth.cli as cli; "
                "assert hrsynth.__file__.startswith(sys.path[0]), hrsynth.__file__; cli.main()"
            )
            done = subprocess.run(
                [here / "bin" / "python", "-c", code, site, *command],
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
            )
            if done.returncode or expected not in done.stdout:
                raise Refused(f"the installed wheel does not answer to {' '.join(command)}: {done.stderr[-400:]}")


def git(*arguments: str) -> str:
    """Run git and return its output."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise Refused(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "")
    except Refused as why:
        sys.exit(f"no release: {why}")
