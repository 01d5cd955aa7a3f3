"""XML documents: read without trust, their unknown parts kept as text."""

from __future__ import annotations

import json
import os
import re
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from lxml import etree

from ..errors import BadRequest, BadRobotFile, Defect
from ..mechanism.model import Note
from ..tolerances import ROBOT_FILE_MAX_BYTES
from .files import NotRegular, open_regular

XML_ELEMENTS_MAX = 100_000
"""Elements above which an XML document is not parsed."""
XML_ELEMENT_NAMES_MAX = 1000
"""Different names of elements above which an XML document is refused: the largest format, MJCF, has 150."""
XML_ATTRIBUTES_MAX = 200
"""Attributes of an element above which an XML document is refused: the most in any format are 50."""
XML_REPARSES_MAX = 16
"""Number of times a document is parsed again without the construct that stopped the parser."""

Element: TypeAlias = etree._Element

_CLOSED_BY = {b"<!--": b"-->", b"<?": b"?>"}
"""Ends of comments and of processing instructions: either may hold what looks like the other."""
_PREFIX = re.compile(r"Namespace prefix (?P<prefix>[A-Za-z_][\w.-]*) (?:on|for) ", re.ASCII)
_ROOT = re.compile(rb"(?:\xef\xbb\xbf)?(?:\s+|<\?.*?\?>|<!--.*?-->)*<[^\s/>]+", re.DOTALL)
_BREAK = re.compile(rb"&#0*(?:9|10|13);|&#x0*[9aAdD];")
"""Tabs and line breaks as references: they are read as spaces, like plain ones."""
_STAND_INS = (
    (
        re.compile(rb"version https://git-lfs\.github\.com/spec/"),
        "a Git LFS pointer instead of the file",
        "the file that git lfs pull fetches",
    ),
    (
        re.compile(rb"(?:\xef\xbb\xbf)?(?>\s|<\?.*?\?>|<!--.*?-->)*<(?:!doctype\s+)?html\b", re.DOTALL | re.IGNORECASE),
        "a web page, saved instead of the file",
        "the file itself, from its raw or download link",
    ),
)
"""Starts of what is downloaded instead of a file, what it is, and what is expected."""
_DECLARATION = re.compile(rb"<!\s*(DOCTYPE|ENTITY)")

_ATTRIBUTE = re.compile(r"@(?P<name>(\{[^}]*\})?[^=]*)=(?P<value>.*)", re.DOTALL)


def _make_parser() -> etree.XMLParser:
    return etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=False, remove_pis=True
    )


def make_file_error(
    file: str | Path, what: str, allowed: str | None = None, *, value: str | None = None, line: int | None = None
) -> BadRobotFile:
    """Return the error of a file with one defect, or of a file as a whole."""
    return BadRobotFile([Defect(str(file), line, what, value, allowed)])


def read_bytes(path: str | Path) -> bytes:
    """Return the bytes of a robot file. Raises :class:`BadRobotFile` for a file that cannot be read or is too large."""
    most = f"up to {ROBOT_FILE_MAX_BYTES}"
    try:
        with open_regular(path) as stream:
            if (size := os.fstat(stream.fileno()).st_size) > ROBOT_FILE_MAX_BYTES:
                raise make_file_error(path, "file too large", most, value=f"{size} bytes")
            data = stream.read(ROBOT_FILE_MAX_BYTES + 1)
    except NotRegular as error:
        raise make_file_error(path, str(error.strerror), "a robot file") from None
    except FileNotFoundError:
        raise make_file_error(path, "no such file", "the path of an existing file") from None
    except (OSError, ValueError) as error:
        raise make_file_error(
            path, "cannot be read", "a readable file", value=getattr(error, "strerror", None) or str(error)
        ) from None
    if len(data) > ROBOT_FILE_MAX_BYTES:
        raise make_file_error(path, "file too large", most, value=f"more than {ROBOT_FILE_MAX_BYTES} bytes")
    for start, what, remedy in _STAND_INS:
        if start.match(data):
            raise make_file_error(path, what, remedy)
    return data


def may_be_document(data: bytes) -> bool:
    """Return True if a file begins as XML does."""
    return data.removeprefix(BOM_UTF8).lstrip().startswith(b"<")


def parse_document(text: bytes | str, file: str, notes: list[Note] | None = None) -> Element:
    """Return the root element of an XML document. Raises :class:`BadRobotFile` with the line of the first error.

    With ``notes``, comments with ``--`` are left out and undeclared prefixes are read as declared; both are noted.
    """
    data = text.encode() if isinstance(text, str) else text
    if not data.strip():
        raise make_file_error(file, "empty file", "a robot file", line=1)
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise make_file_error(
            file,
            "not UTF-8 text",
            "a file in UTF-8",
            value=hex(data[error.start]),
            line=data.count(b"\n", 0, error.start) + 1,
        ) from None
    if (count := data.count(b"<") - data.count(b"</")) > XML_ELEMENTS_MAX:
        raise make_file_error(file, "too many elements", f"up to {XML_ELEMENTS_MAX}", value=str(count))
    data = _BREAK.sub(b" ", data)
    bare = _drop_comments(data, lambda comment: True)
    if declaration := _DECLARATION.search(bare):
        raise make_file_error(
            file,
            "a document type declaration is not allowed",
            line=bare.count(b"\n", 0, declaration.start()) + 1,
        )
    for _ in range(XML_REPARSES_MAX):
        try:
            root = etree.fromstring(data, _make_parser())
            _require_few_names(root, file)
            if root.getroottree().docinfo.internalDTD is None:
                return _drop_default_namespace(root)
            what, at = "a document type declaration is not allowed", 1
        except etree.XMLSyntaxError as error:
            what, at = (error.msg or "syntax error").split(", line ")[0], error.lineno or 1
        except (ValueError, LookupError) as error:
            what, at = str(error), 1
        mended = data if notes is None else _repair_document(data, what, notes)
        if mended == data:
            break
        data = mended
    # raised here, not above: libraries that send errors between processes take their context along, and the parser's
    # own error cannot be sent
    raise make_file_error(file, "malformed XML", "a whole XML document", value=what, line=at)


def _require_few_names(root: Element, file: str) -> None:
    """Raise ``BadRobotFile`` for more names than any format has: comparing names takes time."""
    names = set()
    for element in root.iter("*"):
        names.add(element.tag)
        if len(element.attrib) > XML_ATTRIBUTES_MAX:
            raise make_file_error(
                file,
                f"too many attributes of <{element.tag}>",
                f"up to {XML_ATTRIBUTES_MAX}",
                value=str(len(element.attrib)),
                line=get_line(element),
            )
    if len(names) > XML_ELEMENT_NAMES_MAX:
        raise make_file_error(
            file, "too many different elements", f"up to {XML_ELEMENT_NAMES_MAX}", value=str(len(names))
        )


def _drop_default_namespace(root: Element) -> Element:
    """Return the document without default namespaces, which mean nothing in robot files; prefixes stay."""
    bare = [element for element in root.iter("*") if element.tag.startswith("{") and not element.prefix]
    for element in bare:
        element.tag = etree.QName(element).localname
    if bare:
        etree.cleanup_namespaces(root, keep_ns_prefixes=[prefix for prefix in root.nsmap if prefix])
    return root


def _repair_document(data: bytes, what: str, notes: list[Note]) -> bytes:
    """Return a document without what stopped the parser, if that has no meaning; the lines stay."""
    prefix, root = _PREFIX.search(what), _ROOT.match(data)
    if prefix is not None and root is not None:
        notes.append(
            Note(
                "ignored",
                f"no xmlns:{prefix['prefix']} declares the prefix {prefix['prefix']!r}; its elements are read anyway",
            )
        )
        declared = f' xmlns:{prefix["prefix"]}="urn:undeclared:{prefix["prefix"]}"'.encode()
        return data[: root.end()] + declared + data[root.end() :]
    if "comment" not in what.lower():
        return data
    wrong = [start for start, end in _find_comments(data) if _is_wrong(data[start:end])]
    if wrong:
        line = data.count(b"\n", 0, wrong[0]) + 1
        notes.append(
            Note(
                "ignored",
                f"{len(wrong)} comments that hold '--', which XML does not allow, the first in line {line}"
                if wrong[1:]
                else f"a comment that holds '--', which XML does not allow, in line {line}",
            )
        )
    return _drop_comments(data, _is_wrong)


def _find_comments(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield start and end of comments and processing instructions; each byte is read a bounded number of times."""
    starts, done = dict.fromkeys(_CLOSED_BY, 0), 0
    while starts:
        for opening in list(starts):
            if starts[opening] < done or not data.startswith(opening, starts[opening]):
                starts[opening] = data.find(opening, done)
        starts = {opening: start for opening, start in starts.items() if start >= 0}
        if not starts:
            return
        start, opening = min((start, opening) for opening, start in starts.items())
        end = data.find(_CLOSED_BY[opening], start + len(opening))
        if end < 0:  # nor is a later one closed
            del starts[opening]
            continue
        done = end + len(_CLOSED_BY[opening])
        yield start, done


def _drop_comments(data: bytes, left_out: Callable[[bytes], bool]) -> bytes:
    """Return a document without some of its comments; the lines stay."""
    parts, at = [], 0
    for start, end in _find_comments(data):
        comment = data[start:end]
        if left_out(comment):
            parts += [data[at:start], b"\n" * comment.count(b"\n")]
            at = end
    return b"".join([*parts, data[at:]])


def _is_wrong(comment: bytes) -> bool:
    """Return True if two hyphens follow each other in a comment, the last of them perhaps the first of its end."""
    return comment.startswith(b"<!--") and b"--" in comment[4:-2]


PLACES = "{urn:hrsynth}places"
"""Attribute of a root element with the files and lines of a generated document; the elements' own lines are indices of
it."""
XML_LINE_MAX = 65535
"""Number of lines that an element can have."""


def shorten_path(main: Path, file: str) -> str:
    """Return the name of a file relative to the ``main`` one if it lies in its folder or below."""
    folder, own = main.resolve().parent, Path(file).resolve()
    return str(main.parent / own.relative_to(folder)) if own.is_relative_to(folder) else file


def give_places(root: Element, main: Path, places: Sequence[tuple[str, int] | None]) -> None:
    """Give the elements of a document, in its order, their sources: file (None for ``main``) and line."""
    table: dict[tuple[str | None, int] | None, int] = {}
    names = {str(main.resolve()): None}
    for element, place in zip(root.iter("*"), places, strict=True):
        own = None
        if place is not None:
            file, line = place
            own = names.get(file, file) and shorten_path(main, file), line
        number = table.setdefault(own, len(table) + 1)
        element.sourceline = number if number <= XML_LINE_MAX else 0  # type: ignore[assignment]
    root.set(PLACES, json.dumps(list(table)))


@lru_cache(maxsize=8)
def _locate_elements(text: str) -> list[list[Any] | None]:
    found: list[list[Any] | None] = json.loads(text)
    return found


class SourceLine(int):
    """Line of an included file."""

    file: str


def get_line(element: Element) -> int | None:
    """Return the line of its file in which an element starts; a :class:`SourceLine` for an included file."""
    number: object = element.sourceline
    table = element.getroottree().getroot().get(PLACES)
    if table is not None:
        place = _locate_elements(table)[number - 1] if isinstance(number, int) and number else None
        if place is None:
            return None
        own = SourceLine(place[1])
        own.file = place[0]
        return int(own) if own.file is None else own
    if not isinstance(number, int) or element.base is None:
        return number if isinstance(number, int) else None
    found = SourceLine(number)
    found.file = element.base
    return found


def list_children(element: Element) -> list[Element]:
    """Return the child elements, without comments."""
    return [child for child in element if isinstance(child.tag, str)]


def format_canonical(element: Element) -> str:
    """Return an element as one line of text with the same meaning; stable when written and read again."""
    copy = etree.fromstring(etree.tostring(element, with_tail=False, encoding="utf-8"), _make_parser())
    for part in copy.iter():
        if part.text is not None and not part.text.strip():
            part.text = None
        if part.tail is not None and not part.tail.strip():
            part.tail = None
    etree.cleanup_namespaces(copy)
    return etree.tostring(copy, encoding="unicode")


def create_element(tag: str, *children: Element, **attributes: str) -> Element:
    """Return an element with its attributes and child elements."""
    element = etree.Element(tag, attributes)
    element.extend(children)
    return element


def list_unknown(element: Element, attributes: Iterable[str], tags: Iterable[str]) -> tuple[str, ...]:
    """Return the unknown parts of an element: ``@name=value`` for attributes, then child elements."""
    known_attributes, known_tags = set(attributes), set(tags)
    given = sorted((str(name), str(value)) for name, value in element.attrib.items() if name != PLACES)
    found = [f"@{name}={value}" for name, value in given if name not in known_attributes]
    return (*found, *(format_canonical(child) for child in list_children(element) if child.tag not in known_tags))


def restore(element: Element, fragments: Iterable[str]) -> None:
    """Put back the parts that :func:`list_unknown` returned."""
    for fragment in fragments:
        if attribute := _ATTRIBUTE.fullmatch(fragment):
            element.set(attribute["name"], attribute["value"])
        else:
            element.append(parse_fragment(fragment))


def parse_fragment(fragment: str) -> Element:
    """Return the element of a kept fragment. Raises :class:`BadRequest` if it is not XML."""
    try:
        return etree.fromstring(fragment.encode(), _make_parser())
    except etree.XMLSyntaxError as error:
        raise BadRequest("a kept fragment is not XML", fragment, error.msg) from None


def format_document(root: Element) -> str:
    """Return a document as text, indented by two spaces."""
    etree.indent(root, "  ")
    return '<?xml version="1.0" encoding="utf-8"?>\n' + etree.tostring(root, encoding="unicode") + "\n"
