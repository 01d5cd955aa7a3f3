"""What is shipped: metadata, extras, source archive, wheel, and the script that makes a release."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
import tomllib
from glob import glob
from importlib import import_module
from pathlib import Path

import pytest

import hrsynth
from hrsynth.errors import MissingExtra

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
sys.path.append(str(ROOT / "docs"))
import release  # noqa: E402
from release import Refused  # noqa: E402


def test_the_version_is_one_in_package_changelog_and_citation():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    version, date = re.search(r"^## \[(\d.*)\] - (.*)$", changes, re.MULTILINE).groups()
    assert version == hrsynth.__version__
    assert f"\nversion: {version}\ndate-released: {date}\n" in citation


def test_what_is_not_released_fits_on_a_page():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    lines = re.search(r"^## \[Unreleased\]\n.*?(?=\n## \[)", changes, re.MULTILINE | re.DOTALL)[0].splitlines()
    assert len(lines) <= 60
    assert [line for line in lines if len(line) > 120] == []


def test_the_licence_is_that_of_all_that_is_shipped():
    """The expression names the licence of the bundled three.js, whose text is the one in the bundle."""
    assert PROJECT["license"] == "BSD-3-Clause AND MIT"
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in PROJECT["license-files"]}
    assert texts["LICENSE"].startswith("BSD 3-Clause License")
    (bundle,) = (ROOT / "src").rglob("*.min.js")
    told = texts["LICENSE.three.js"]
    assert str(bundle.relative_to(ROOT)) in told
    assert told[told.index("The MIT License") :].strip() in bundle.read_text(encoding="utf-8")


def test_a_defect_of_security_is_reported_to_the_authors():
    assert PROJECT["authors"][0]["email"] in (ROOT / "SECURITY.md").read_text(encoding="utf-8")


def test_all_files_of_the_catalog_and_all_robots_are_package_data():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    told = project["tool"]["setuptools"]["package-data"]["hrsynth"]
    packed = {
        ROOT / "src" / "hrsynth" / file
        for pattern in told
        for file in glob(pattern, root_dir=ROOT / "src" / "hrsynth", recursive=True)
    }
    shipped = [*(ROOT / "catalog").rglob("*.jsonl*"), *(ROOT / "robots").glob("*.urdf")]
    assert len(shipped) > 30
    assert {file.resolve() for file in shipped if file.suffix != ".part"} <= {file.resolve() for file in packed}


def test_every_extra_that_is_named_is_there_and_all_holds_them():
    extras = PROJECT["optional-dependencies"]
    named = {
        extra
        for path in (ROOT / "src").rglob("*.py")
        for extra in re.findall(r'MissingExtra\([^()]*?"([a-z]+)"\)', path.read_text(encoding="utf-8"))
    }
    assert {"plots", "solve", "bench", "usd", "xacro"} <= named
    assert named <= extras.keys()
    (whole,) = extras["all"]
    assert set(re.search(r"\[(.*)\]", whole)[1].split(",")) == extras.keys() - {"all", "torch"}
    page = (ROOT / "docs" / "pages" / "install.md").read_text(encoding="utf-8")
    assert all(f"| `{extra}` |" in page for extra in extras)


def test_a_missing_extra_is_told_with_both_commands_in_one_line():
    (line,) = MissingExtra("drawing", "plots").lines()
    assert line.startswith(f'drawing needs an optional package. Run {sys.executable} -m pip install "hrsynth[plots]"')
    assert f'in a checkout {sys.executable} -m pip install ".[plots]"' in line


BLOCKED = """
import importlib.util, sys
whole = importlib.util.find_spec
def without(name, *rest):
    return None if name.split(".")[0] in BLOCKED else whole(name, *rest)
importlib.util.find_spec = without
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Finder())
from hrsynth.cli import run_command
sys.exit(run_command(sys.argv[1:]))
"""


def without(packages: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command line where some packages are not installed."""
    code = f"BLOCKED = {packages.split()!r}{BLOCKED}"
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="x" value="1"/></robot>'
SERVO = ["servo", "3rrr_m1", "--start", "x=0,y=0,phi=0", "--goal", "x=0.01,y=0,phi=0"]
NEEDING = [
    ("matplotlib", "plots", ["modes", "3rrr_m1", "-o", "modes.png"]),
    ("matplotlib", "plots", ["derive", "3rrr_m1", "--report", "report.html"]),
    ("mujoco", "bench", [*SERVO, "--dynamics"]),
    ("mujoco", "bench", [*SERVO, "-o", "servo.gif"]),
    ("xacro", "xacro", ["check", XACRO]),
    ("xacro", "xacro", ["convert", XACRO, "robot.xml"]),
    ("pxr", "usd", ["convert", "3rrr_m1", "robot.usdc"]),
    ("distributed", "cluster", ["catalog", "build", "--check", "--cluster", "tcp://127.0.0.1:1", "planar"]),
    *((package, "studio", ["view", "3rrr_m1"]) for package in ("h11", "starlette", "uvicorn", "websockets")),
]


def test_every_extra_of_a_command_or_function_is_tried():
    """``view`` brings what ``studio`` does; what ``docs``, ``jax`` and ``torch`` bring no command needs."""
    assert {extra for _, extra, _ in NEEDING} | {*CALLS} == PROJECT["optional-dependencies"].keys() - {
        "all",
        "docs",
        "jax",
        "torch",
        "view",
    }


CALLS = {
    "fast": lambda: compiled_pose(),
    "solve": lambda: import_module("hrsynth.solving.platform.msolve").find_executable(),
}
"""What needs a package in Python alone, or where another way is left to the command."""


def compiled_pose() -> object:
    """A pose evaluated by numba."""
    batch = hrsynth.observe("delta").batch
    return batch.evaluate(batch.home[None], compiled=True)


@pytest.mark.parametrize("extra", CALLS)
def test_a_function_tells_the_extra_that_it_needs(extra: str, monkeypatch: pytest.MonkeyPatch):
    def missing(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr("hrsynth.batch.engine.find_spec", lambda name: None)
    monkeypatch.setattr("importlib.metadata.files", missing)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingExtra, match=rf'pip install "hrsynth\[{extra}\]"') as caught:
        CALLS[extra]()
    assert caught.value.exit_status == 3


@pytest.mark.some(4)
@pytest.mark.parametrize(("packages", "extra", "arguments"), NEEDING)
def test_what_needs_a_package_that_is_missing_says_so_in_one_line(packages, extra, arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = without(packages, *arguments)
    (line,) = (line for line in run.stderr.splitlines() if "pip install" in line)
    assert f'pip install "hrsynth[{extra}]"' in line
    assert run.returncode == 3
    assert "Traceback" not in run.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_core_answers_without_any_extra(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    every = "matplotlib mujoco cv2 numba jax dask distributed xacro mkdocs nbclient IPython"
    for arguments in (
        ["derive", "3rrr_m1"],
        ["check", "3rrr_m1", "--grid", "x=0:0.01:3,y=0,phi=0"],
        ["modes", "3rrr_m1"],
        ["view", "3rrr_m1", "--static", "view.html"],
        ["derive", "3rrr_m1", "-o", "hidden.urdf"],
    ):
        run = without(every, *arguments)
        assert (run.returncode, run.stderr) == (0, ""), arguments
        assert run.stdout


def test_the_long_description_has_no_link_that_needs_the_repository():
    import runpy

    text = runpy.run_path(str(ROOT / "setup.py"))["long_description"]()
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert len(links) > 20
    assert all(link.startswith("https://") for link in links)
    assert f"/raw/v{hrsynth.__version__}/docs/pictures/derivation_quattro.svg)" in text
    for field in ("Homepage", "Repository", "Documentation", "Changelog", "Issues"):
        assert field in PROJECT["urls"]
    assert PROJECT["authors"][0]["email"]


def test_reserved_addresses_stand_only_where_a_publisher_writes_their_own():
    assert {each.partition(":")[0] for each in release.placeholders()} == {*release.ADDRESSES}
    others = [
        path
        for folder in ("src", "docs", "robots", "catalog", "notebooks", "studies", "benchmarks", "requirements")
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and path.suffix in (".py", ".md", ".toml", ".js", ".html", ".j2", ".urdf", ".txt")
    ] + [path for path in ROOT.iterdir() if path.is_file() and path.name not in (*release.ADDRESSES, "CHANGELOG.md")]
    assert [path for path in others if release.RESERVED.search(path.read_text(encoding="utf-8", errors="ignore"))] == []


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A clone of the repository as it is, with addresses of its own, for the script to work on."""
    files = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, capture_output=True, text=True
    )
    if files.returncode:
        pytest.skip("no repository")
    copy = tmp_path / "copy"
    for name in filter(None, files.stdout.split("\0")):
        source, target = ROOT / name, copy / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_symlink():
            target.symlink_to(source.readlink())
        elif source.is_file():
            target.write_bytes(source.read_bytes())
    for name in release.ADDRESSES:
        told = (copy / name).read_text(encoding="utf-8").replace("hrsynth.example", "robots.test")
        (copy / name).write_text(told, encoding="utf-8")
    log = copy / "CHANGELOG.md"
    if "- " not in log.read_text(encoding="utf-8").split("## [")[1]:
        log.write_text(
            log.read_text(encoding="utf-8").replace("## [Unreleased]\n", "## [Unreleased]\n\n- New.\n"),
            encoding="utf-8",
        )
    monkeypatch.setattr(release, "ROOT", copy)
    for name in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{name}_NAME", "one")
        monkeypatch.setenv(f"GIT_{name}_EMAIL", "one@robots.test")
    release.git("init", "--quiet")
    release.git("add", "--all")
    release.git("commit", "--quiet", "--message", "all")
    return copy


@pytest.mark.slow
def test_a_release_is_built_checked_and_tagged(checkout, capsys):
    release.main("99.0.0")
    assert "nothing is uploaded" in capsys.readouterr().out
    assert {path.name for path in (checkout / "dist").iterdir()} == {
        "hrsynth-99.0.0.tar.gz",
        "hrsynth-99.0.0-py3-none-any.whl",
    }
    assert release.git("tag") == "v99.0.0"
    assert release.git("log", "-1", "--format=%s") == "Version 99.0.0"
    assert not release.git("status", "--porcelain", "--untracked-files=no")
    log = (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"## \[Unreleased\]\n\n## \[99.0.0\] - 20\d\d-\d\d-\d\d\n\n", log)
    assert "version: 99.0.0\n" in (checkout / "CITATION.cff").read_text(encoding="utf-8")
    with pytest.raises(Refused, match=r"after 99\.0\.0"):
        release.main("99.0.0")


@pytest.mark.slow
def test_a_release_that_fails_leaves_nothing(checkout):
    (checkout / "MANIFEST.in").write_text("prune tests\n", encoding="utf-8")
    release.git("commit", "--quiet", "--all", "--message", "less")
    head = release.git("rev-parse", "HEAD")
    with pytest.raises(Refused, match=r"lacks tests/oracle\.py"):
        release.main("99.0.0")
    assert (release.git("rev-parse", "HEAD"), release.git("tag")) == (head, "")
    assert not release.git("status", "--porcelain", "--untracked-files=no")


def test_a_release_is_refused_with_the_reason(checkout):
    for version in ("", "1", "0.0.1", hrsynth.__version__, "v99.0.0"):
        with pytest.raises(Refused, match="a version such as"):
            release.main(version)
    (checkout / "README.md").write_text("changed", encoding="utf-8")
    with pytest.raises(Refused, match="not committed"):
        release.main("99.0.0")
    release.git("checkout", "--quiet", "README.md")
    told = (checkout / "pyproject.toml").read_text(encoding="utf-8").replace("robots.test", "hrsynth.example")
    (checkout / "pyproject.toml").write_text(told, encoding="utf-8")
    release.git("commit", "--quiet", "--all", "--message", "addresses")
    with pytest.raises(Refused, match=r"addresses(?s:.*)pyproject\.toml:\d+: Homepage"):
        release.main("99.0.0")
    log = checkout / "CHANGELOG.md"
    log.write_text(
        re.sub(
            r"(## \[Unreleased\]\n).*?(?=## \[)", r"\1\n", log.read_text(encoding="utf-8"), count=1, flags=re.DOTALL
        ),
        encoding="utf-8",
    )
    with pytest.raises(Refused, match="Unreleased"):
        release.main("99.0.0")
