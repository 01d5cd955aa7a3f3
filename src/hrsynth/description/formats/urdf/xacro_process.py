"""Program: expand the named xacro file to standard output: a line of JSON with the file and the line of each element,
then the document. It writes no files and reads none elsewhere. An error is one line of JSON on standard error.

Expressions are Python's in syntax only: a walker over the syntax tree computes them from an allow-list. Its values are
numbers, texts, truth values, None, and lists and dictionaries of these; functions can be called but are not values, and
nothing has attributes. The package's own ``eval`` is removed.

``$(find PACKAGE)`` is a package of that name: a folder above the file, up to the one with a manifest, or one beside
that, or one that is installed (:func:`list_installed_packages`). For a file without a manifest above it, a copy, its
files may lie beside the file: an assumption. No other file is read. Environment variables are empty.
"""

from __future__ import annotations

import ast
import json
import math
import operator
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, TypeAlias
from xml.dom import expatbuilder, minidom
from xml.parsers.expat import ExpatError

LIMITS = {"AS": 900_000_000, "CPU": 4, "FSIZE": 0, "NOFILE": 64, "CORE": 0, "NPROC": 0}
"""Limits of the process by the names of ``resource``: bytes, seconds, numbers. That of processes (NPROC) does not hold
for root."""
PACKAGE_FOLDER_LEVELS_MAX = 4
"""Number of folders above the file that are searched for its package's manifest."""
PACKAGES_BESIDE_MAX = 1000
"""Number of folders beside the file's package that are searched for another package."""
MANIFEST_BYTES_MAX = 100_000
"""Bytes of a package's manifest that are read for its name."""
MANIFESTS = ("package.xml", "model.config")
XACRO_POWER_BITS_MAX = 10_000
"""Largest number of bits of a power of integers."""
MARK = "/find:"
"""Start of a path in a package: the package's name and the path in it follow."""

VALUES = (bool, int, float, str, list, tuple, dict, type(None))
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda one, many: one in many,
    ast.NotIn: lambda one, many: one not in many,
}
CONSTANTS = {name: value for name, value in vars(math).items() if isinstance(value, float)}
TEXT_METHODS = ("lower", "upper", "strip", "split", "replace", "startswith", "endswith")


def list_results(call: Callable[..., Any]) -> Callable[..., list[Any]]:
    """Return a function that returns a list of an iterator's values."""
    return lambda *arguments: list(call(*arguments))


Functions: TypeAlias = dict[str, Callable[..., Any]]
MATH: Functions = {name: call for name, call in vars(math).items() if callable(call) and not name.startswith("_")}
PYTHON: Functions = {
    "abs": abs,
    "all": all,
    "any": any,
    "bool": bool,
    "dict": dict,
    "divmod": divmod,
    "float": float,
    "int": int,
    "len": len,
    "list": list,
    "max": max,
    "min": min,
    "round": round,
    "sorted": sorted,
    "str": str,
    "sum": sum,
    "tuple": tuple,
    "range": list_results(range),
    "reversed": list_results(reversed),
    "zip": list_results(zip),
    "enumerate": list_results(enumerate),
}


def raise_power(base: Any, exponent: Any) -> Any:
    """Return a power, in floats if the integer would be long."""
    if isinstance(base, int) and isinstance(exponent, int) and abs(base).bit_length() * exponent > XACRO_POWER_BITS_MAX:
        return float(base) ** float(exponent)
    return base**exponent


class Expression:
    """Value of an expression of the allowed syntax, with the names and functions it may use."""

    def __init__(self, names: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]]) -> None:
        self.names, self.functions = names, functions

    def evaluate(self, text: str) -> Any:
        """Return the value. Raises ``ValueError`` for expressions that are not allowed, and the errors of the
        operations."""
        return self.value(ast.parse(text.strip(), mode="eval").body)

    def value(self, node: ast.AST | None) -> Any:
        """Return the value of a part, which is one of ``VALUES``."""
        method = getattr(self, f"value_of_{type(node).__name__}", None)
        if method is None:
            raise ValueError(f"{type(node).__name__} is not allowed in an expression")
        found = method(node)
        if not isinstance(found, VALUES):
            raise ValueError(f"a value of type {type(found).__name__} is not allowed in an expression")
        return found

    def value_of_NoneType(self, node: None) -> Any:
        return None

    def value_of_Constant(self, node: ast.Constant) -> Any:
        return node.value

    def value_of_Name(self, node: ast.Name) -> Any:
        if node.id not in self.names:
            raise NameError(f"name {node.id!r} is not defined")
        return self.names[node.id]

    def value_of_List(self, node: ast.List | ast.Tuple) -> Any:
        return [self.value(part) for part in node.elts]

    def value_of_Tuple(self, node: ast.Tuple) -> Any:
        return tuple(self.value_of_List(node))

    def value_of_Dict(self, node: ast.Dict) -> Any:
        return {self.value(key): self.value(part) for key, part in zip(node.keys, node.values, strict=True)}

    def value_of_UnaryOp(self, node: ast.UnaryOp) -> Any:
        return OPERATORS[type(node.op)](self.value(node.operand))

    def value_of_BinOp(self, node: ast.BinOp) -> Any:
        left, right = self.value(node.left), self.value(node.right)
        return raise_power(left, right) if isinstance(node.op, ast.Pow) else OPERATORS[type(node.op)](left, right)

    def value_of_BoolOp(self, node: ast.BoolOp) -> Any:
        found = self.value(node.values[0])
        for part in node.values[1:]:
            if bool(found) == isinstance(node.op, ast.Or):
                return found
            found = self.value(part)
        return found

    def value_of_Compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        for op, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            if not OPERATORS[type(op)](left, right):
                return False
            left = right
        return True

    def value_of_IfExp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def value_of_Subscript(self, node: ast.Subscript) -> Any:
        if isinstance(node.slice, ast.Slice):
            ends = node.slice.lower, node.slice.upper, node.slice.step
            return self.value(node.value)[slice(*map(self.value, ends))]
        return self.value(node.value)[self.value(node.slice)]

    def value_of_Attribute(self, node: ast.Attribute) -> Any:
        """Return the constant of a namespace (``math.pi``), or the item of a dictionary (``legs.length``)."""
        if isinstance(node.value, ast.Name) and node.value.id == "math" and "math" not in self.names:
            return CONSTANTS[node.attr]
        holder = self.value(node.value)
        if not isinstance(holder, dict):
            raise ValueError(f".{node.attr} follows a value that is not a dictionary")
        return holder[node.attr]

    def value_of_Call(self, node: ast.Call) -> Any:
        name, first = ast.unparse(node.func), "".join(map(ast.unparse, node.args[:1]))
        if name in ("map", "python.map") and first in self.functions:
            return list(map(self.functions[first], *map(self.value, node.args[1:])))
        arguments = [self.value(part) for part in node.args]
        if any(part.arg is None for part in node.keywords):
            raise ValueError("** is not allowed in an expression")
        options = {str(part.arg): self.value(part.value) for part in node.keywords}
        if name in self.functions:
            return self.functions[name](*arguments, **options)
        if isinstance(node.func, ast.Attribute) and node.func.attr in TEXT_METHODS:
            holder = self.value(node.func.value)
            if isinstance(holder, str):
                return getattr(holder, node.func.attr)(*arguments)
        raise NameError(
            f"name {name!r} is not defined"
            if isinstance(node.func, ast.Name)
            else f"{name!r} is not an allowed function"
        )


def restrict(xacro: Any, substitution: Any, folder: Path, assumed: dict[str, str]) -> None:
    """Make the package evaluate its expressions here, and read files of the folder, or of its package, and of the
    packages that it finds, only; record the ``assumed`` folders of packages."""
    package = list_package_folders(folder)[-1]
    homes, extend = [package if has_manifest(package) else folder], xacro.abs_filename_spec

    def locate(spec: str) -> str:
        if any(letter in spec for letter in "*?["):
            raise ValueError(f"{spec} is a pattern of files")
        if MARK not in spec:
            return str(extend(spec))
        name, _, rest = spec.rpartition(MARK)[2].partition("/")
        home, path = locate_in_package(name, rest.lstrip("/"), folder, xacro.filestack)
        homes.append(home)
        if read_package_name(home) != name:
            assumed[name] = f"{home.name}/"
        return str(path)

    def read(name: str) -> Any:
        path = Path(name).resolve()
        if not any(map(path.is_relative_to, homes)):
            raise ValueError(f"{name} lies outside of the file's package and of those that it names with $(find …)")
        return open(path, encoding="utf-8")

    def fail(*texts: Any) -> None:
        raise ValueError(" ".join(map(str, texts)))

    def forbidden(*arguments: Any) -> None:
        raise ValueError("this version of the package xacro has an unexpected evaluation")

    given = xacro.substitution_args_context
    files: Functions = {"load_yaml": xacro.load_yaml, "abs_filename": locate, "dotify": dict}
    more: Functions = {**files, "tokenize": xacro.tokenize, "fatal": fail, "arg": lambda name: given["arg"][name]}
    functions = {**MATH, **PYTHON, **files}
    for space, calls in (("math", MATH), ("python", PYTHON), ("xacro", more)):
        functions |= {f"{space}.{name}": call for name, call in calls.items()}

    def evaluate(text: str, names: Any, local: Any = None) -> Any:
        return Expression(names, functions).evaluate(text)

    def evaluate_argument(text: str, context: Any) -> str:
        typed = {name: substitution.convert_value(value, "auto") for name, value in context.get("arg", {}).items()}
        names = {**CONSTANTS, "true": True, "false": False, **typed}
        own: Functions = {
            "arg": lambda name: typed[name],
            "find": lambda package: MARK + package,
            "dirname": lambda: substitution._eval_dirname(context.get("filename")),
        }
        return str(Expression(names, {**functions, **own}).evaluate(text))

    for module, names in (
        (xacro, ("safe_eval", "_global_symbols", "abs_filename_spec")),
        (substitution, ("_eval", "_eval_find", "_eval_env", "_eval_optenv")),
    ):
        if not all(hasattr(module, name) for name in names):
            forbidden()
        module.eval = module.exec = module.compile = forbidden
    xacro.open = read
    xacro.safe_eval, xacro._global_symbols, xacro.abs_filename_spec = evaluate, dict(CONSTANTS), locate
    substitution._eval, substitution._eval_find = evaluate_argument, lambda package: MARK + package
    substitution._eval_env, substitution._eval_optenv = lambda variable: "", lambda variable, default="": default


def locate_in_package(name: str, rest: str, folder: Path, opened: Sequence[str]) -> tuple[Path, Path]:
    """Return the folder of a package, and a path in it: one above the file, up to that of its own package, or else one
    beside that, or one that is installed. Its manifest names it, or it has that name. For a file without a manifest
    above, the file's folder also counts, with the end of a path that is a file not ``opened``. Raises ``ValueError`` if
    there is none."""
    for package in chain(list_packages(folder), list_installed_packages(name)):
        if read_package_name(package) == name:
            return package, package / rest
    package = list_package_folders(folder)[-1]
    if not has_manifest(package):
        parts = Path(rest).parts
        for path in (folder.joinpath(*parts[k:]) for k in range(len(parts))):
            if path.is_file() and str(path) not in opened:
                return folder, path
    raise ValueError(
        f"no package {name!r}: got none above the file up to {package.name}/, nor beside that, nor in ROS_PACKAGE_PATH "
        f"and AMENT_PREFIX_PATH, expected its folder there (named {name}, or by its package.xml)"
    )


def list_packages(folder: Path) -> Iterator[Path]:
    """Yield the folders that may be packages, those with a manifest first: above the file, and beside the last of
    these; in a shared folder only with a manifest."""
    above = list_package_folders(folder)
    yield from sorted(above, key=has_manifest, reverse=True)
    most = above[-1].parent if has_manifest(above[-1]) else above[-1]
    beside = sorted(Path(each) for each in islice(os.scandir(most), PACKAGES_BESIDE_MAX))
    yield from filter(has_manifest, beside)
    yield from () if is_shared(most) else beside


def list_installed_packages(name: str) -> Iterator[Path]:
    """Yield the folders of a package in ``AMENT_PREFIX_PATH``, in ``ROS_PACKAGE_PATH`` and in the repositories that
    robot_descriptions has on this disk, at most two levels below these."""
    if not name or set(name) & set("/\\*?[") or name in (".", ".."):
        return
    prefixes, roots = (
        [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]
        for variable in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH")
    )
    cloned = os.environ.get("ROBOT_DESCRIPTIONS_CACHE") or Path.home() / ".cache" / "robot_descriptions"
    folders = [prefix / "share" / name for prefix in prefixes]
    for root in (*roots, *sorted(Path(cloned).glob("*"))):
        folders += [root] if root.name == name else [root / name, *sorted(root.glob(f"*/{name}"))]
    yield from filter(Path.is_dir, folders)


def list_package_folders(folder: Path) -> list[Path]:
    """Return the folders in which a package's files may lie: the file's own, and those up to the one with the package's
    manifest; without one, the folder above, unless that is a root or a user's."""
    above = [folder, *folder.parents]
    for k, each in enumerate(above[: PACKAGE_FOLDER_LEVELS_MAX + 1]):
        if has_manifest(each):
            return above[: k + 1]
    return above[:1] if is_shared(folder.parent) else above[:2]


def has_manifest(folder: Path) -> bool:
    """Return True for the folder of a package of ROS or a model of Gazebo."""
    return any((folder / name).is_file() for name in MANIFESTS)


def is_shared(folder: Path) -> bool:
    """Return True for a root and for the folders of a user and of temporary files."""
    return folder in (Path(folder.anchor), Path.home(), Path(os.environ.get("TMPDIR", "/tmp")))


def read_package_name(folder: Path) -> str:
    """Return the name in a package's manifest, else that of the folder."""
    try:
        with open(folder / MANIFESTS[0], "rb") as stream:
            manifest: Any = PlacedBuilder(MANIFESTS[0]).parseString(stream.read(MANIFEST_BYTES_MAX))
        return str(manifest.getElementsByTagName("name")[0].firstChild.data).strip()
    except (OSError, ValueError, ExpatError, IndexError, AttributeError):
        return folder.name


class PlacedBuilder(expatbuilder.ExpatBuilderNS):
    """Builder of a document whose elements know their ``place``: file and line."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file = file

    def start_element_handler(self, name: Any, attributes: Any) -> None:
        """Begin an element."""
        super().start_element_handler(name, attributes)
        begun: Any = self.curNode
        begun.place = (self.file, self.getParser().CurrentLineNumber)

    def start_doctype_decl_handler(self, *parts: Any) -> None:
        """Refuse entities."""
        raise ValueError("a document type declaration is not allowed")


def track_places(xacro: Any) -> list[Any]:
    """Make the package keep the places of elements; the list holds the element that it currently processes."""
    at: list[Any] = []

    def telling(call: Callable[..., Any]) -> Callable[..., Any]:
        def told(node: Any, *args: Any, **options: Any) -> Any:
            at[:] = [node]
            return call(node, *args, **options)

        return told

    def cloned(node: Any, *args: Any) -> Any:
        made = clone(node, *args)
        if hasattr(node, "place"):
            made.place = node.place
        return made

    for name in ("check_attrs", "reqd_attrs", "handle_macro_call", "grab_property", "grab_macro", "process_include"):
        if hasattr(xacro, name):
            setattr(xacro, name, telling(getattr(xacro, name)))
    dom: Any = minidom
    clone = dom._clone_node
    dom._clone_node = cloned
    dom.parse = lambda stream: PlacedBuilder(stream.name).parseFile(stream)
    return at


def describe_error(xacro: Any, error: Exception, at: list[Any]) -> dict[str, Any]:
    """Return the text of an error, with file and line."""
    files = [each for each in getattr(xacro, "filestack", None) or [] if each]
    file, line = getattr(at[0], "place", (None, None)) if at else (None, None)
    if hasattr(error, "lineno"):  # no XML
        file, line = files[-1] if files else None, error.lineno
    said = str(error) or type(error).__name__
    macros = [each.body.getAttribute("name") for each in getattr(xacro, "macrostack", None) or []]
    told = " ".join(said.split()) + (f" (in macro {macros[-1]!r})" if macros else "")
    return {"file": file, "line": line, "said": told}


def limit() -> None:
    """Set the limits of this process that the system has."""
    try:
        import resource
    except ImportError:
        return
    for name, amount in LIMITS.items():
        if hasattr(resource, f"RLIMIT_{name}"):
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (amount, amount))


def list_declared(xacro: Any) -> list[str]:
    """Return the list to which the package adds the names of the arguments that a file declares."""
    declared: list[str] = []
    call = xacro.check_attrs

    def checked(tag: Any, *attributes: Any) -> Any:
        values = call(tag, *attributes)
        declared.extend(values[:1] if tag.tagName == "xacro:arg" else ())
        return values

    xacro.check_attrs = checked
    return declared


def main(name: str, largest: str, most: str, *given: str) -> None:
    """Expand one file to at most so many characters and elements, with the ``given`` arguments ``name:=value``."""
    limit()
    import xacro
    from xacro import substitution_args

    folder = Path(name).resolve().parent
    at, declared, errors = track_places(xacro), list_declared(xacro), sys.stderr
    assumed: dict[str, str] = {}
    values = {name: value for name, _, value in (text.partition(":=") for text in given)}
    try:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115 (what the package warns of, without a limit)
        restrict(xacro, substitution_args, folder, assumed)
        made = xacro.process_file(name, verbosity=0, mappings=values)
        places = [getattr(each, "place", None) for each in made.getElementsByTagName("*")]
        text = made.toxml()
        if len(text) > int(largest):
            raise ValueError(f"too long when expanded: got {len(text)} characters, expected up to {largest}")
        if len(places) > int(most):
            raise ValueError(f"too large when expanded: got {len(places)} elements, expected up to {most}")
    except Exception as error:
        errors.write(json.dumps(describe_error(xacro, error, at)))
        sys.exit(1)
    arguments = {argument: str(values[argument]) for argument in declared}
    sys.stdout.write(json.dumps({"places": places, "arguments": arguments, "assumed": assumed}) + "\n" + text)


if __name__ == "__main__":
    main(*sys.argv[1:])
