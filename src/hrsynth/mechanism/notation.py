"""Architecture notation: ``4-R̲-{2-SS}``, ``R̲RR+2-P̲RR``, ``{RR|Π-U̲R}-S``; printed and parsed.

Letters are joint types, Π a planar parallelogram; a bar under a letter (``*`` after it in ASCII) is a motor. Braces
hold parallel parts: ``{2-SS}`` two equal parallel rods, ``{a|b}`` chains side by side, ``{R-PP}`` a chain R whose end
carries a link that only translates on PP (MMT Fig. 4(b)).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ..errors import BadRequest


class Style(Enum):
    """Style of a written architecture."""

    UNICODE = "unicode"
    ASCII = "ascii"
    LATEX = "latex"


@dataclass(frozen=True)
class Letter:
    """One joint: its letter (``Pi`` for a planar parallelogram) and whether it is actuated."""

    letter: str
    actuated: bool = False

    def text(self, style: Style) -> str:
        if style is Style.ASCII:
            return self.letter + ("*" if self.actuated else "")
        if style is Style.LATEX:
            letter = r"\Pi" if self.letter == "Pi" else rf"\mathrm{{{self.letter}}}"
            return rf"\underline{{{letter}}}" if self.actuated else letter
        return self.letter.replace("Pi", "Π") + ("\u0332" if self.actuated else "")

    def reversed(self) -> Letter:
        return self


@dataclass(frozen=True)
class Rods:
    """``count`` equal parallel rods side by side."""

    count: int
    word: Word

    def text(self, style: Style) -> str:
        return _wrap_in_braces(f"{self.count}-{self.word.text(style)}", style)

    def reversed(self) -> Rods:
        return Rods(self.count, self.word.reversed())


@dataclass(frozen=True)
class Bar:
    """Chains in parallel that no rule could merge."""

    branches: tuple[Word, ...]

    def text(self, style: Style) -> str:
        return _wrap_in_braces("|".join(branch.text(style, spaced=True) for branch in self.branches), style)

    def reversed(self) -> Bar:
        return Bar(tuple(branch.reversed() for branch in self.branches))


@dataclass(frozen=True)
class Carrier:
    """Chain whose end carries a link that only translates, guided by P joints: ``{R-PP}``."""

    chain: Word
    sliders: Word

    def text(self, style: Style) -> str:
        return _wrap_in_braces(f"{self.chain.text(style)}-{self.sliders.text(style)}", style)

    def reversed(self) -> Carrier:
        return self


Item = Letter | Rods | Bar | Carrier


@dataclass(frozen=True)
class Word:
    """Joints in series, from the base to the platform."""

    items: tuple[Item, ...]

    def text(self, style: Style = Style.UNICODE, *, spaced: bool = False) -> str:
        """Return the text; groups are separated by ``-``, inside a bar (``spaced``) also a Π."""
        text = ""
        for index, item in enumerate(self.items):
            if index:
                before = self.items[index - 1]
                loose = not isinstance(item, Letter) or not isinstance(before, Letter)
                if loose or (spaced and isinstance(before, Letter) and before.letter == "Pi"):
                    text += "-"
            text += item.text(style)
        return text

    def reversed(self) -> Word:
        return Word(tuple(item.reversed() for item in reversed(self.items)))

    def __add__(self, other: Word) -> Word:
        return Word(self.items + other.items)

    def __str__(self) -> str:
        return self.text()


@dataclass(frozen=True)
class Architecture:
    """Sum of equal legs: (count, notation) in the order of first appearance."""

    terms: tuple[tuple[int, Word], ...]

    @classmethod
    def of(cls, words: Sequence[Word]) -> Architecture:
        """Return the architecture of a sequence of legs."""
        counts: dict[Word, int] = {}
        for word in words:
            counts[word] = counts.get(word, 0) + 1
        return cls(tuple((count, word) for word, count in counts.items()))

    def text(self, style: Style = Style.UNICODE) -> str:
        return "+".join(word.text(style) if count == 1 else f"{count}-{word.text(style)}" for count, word in self.terms)

    @property
    def unicode(self) -> str:
        """Text with combining low lines under motors."""
        return self.text(Style.UNICODE)

    @property
    def ascii(self) -> str:
        """Text with ``*`` after motors and ``Pi``."""
        return self.text(Style.ASCII)

    @property
    def latex(self) -> str:
        """Text for math mode."""
        return self.text(Style.LATEX)

    def __str__(self) -> str:
        return self.unicode


def _wrap_in_braces(text: str, style: Style) -> str:
    return rf"\{{{text}\}}" if style is Style.LATEX else f"{{{text}}}"


_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?<![^+{\s])[0-9]+)(?=-)|(?P<letter>Pi|Π|[RPUSCEF6])(?P<motor>\*|\u0332|_)?|(?P<sign>[-+{}|]))"
)


def parse(text: str) -> Architecture:
    """Return the architecture of ``text`` (Unicode or ASCII). Raises ``BadRequest`` with the place of the error."""
    return _Parser(text).architecture()


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens: list[tuple[str, str, bool]] = []
        place = 0
        stripped = text.rstrip()
        while place < len(stripped):
            match = _TOKEN.match(stripped, place)
            if match is None:
                raise self._fault(stripped[place:])
            kind = match.lastgroup if match.lastgroup != "motor" else "letter"
            self.tokens.append((str(kind), match["letter"] or match["number"] or match["sign"], bool(match["motor"])))
            place = match.end()
        self.place = 0

    def _fault(self, rest: str) -> BadRequest:
        return BadRequest(
            f"architecture {self.text!r}: cannot be read from {rest!r} on",
            None,
            "letters R P U S C E Pi, * after a motor, counts such as 3-, groups {2-SS}, {a|b}, {R-PP}",
        )

    def _peek(self) -> str | None:
        if self.place >= len(self.tokens):
            return None
        kind, value, _ = self.tokens[self.place]
        return value if kind == "sign" else kind

    def _fail(self) -> BadRequest:
        return self._fault("".join(value for _, value, _ in self.tokens[self.place :]) or "its end")

    def architecture(self) -> Architecture:
        terms = []
        while True:
            count = 1
            if self._peek() == "number":
                count = int(self.tokens[self.place][1])
                self.place += 1
                self._take("-")
                if count < 1:
                    raise self._fail()
            terms.append((count, self._word()))
            if self._peek() is None:
                return Architecture(tuple(terms))
            self._take("+")

    def _take(self, sign: str) -> None:
        if self._peek() != sign:
            raise self._fail()
        self.place += 1

    def _word(self) -> Word:
        items: list[Item] = []
        while True:
            head = self._peek()
            if head == "letter":
                _, letter, actuated = self.tokens[self.place]
                self.place += 1
                items.append(Letter("Pi" if letter == "Π" else letter, actuated))
            elif head == "{":
                items.append(self._group())
            elif head == "-" and items:
                self.place += 1
                if self._peek() not in ("letter", "{"):
                    raise self._fail()
            else:
                break
        if not items:
            raise self._fail()
        return Word(tuple(items))

    def _group(self) -> Item:
        self._take("{")
        if self._peek() == "number":
            count = int(self.tokens[self.place][1])
            self.place += 1
            self._take("-")
            group: Item = Rods(count, self._word())
        else:
            branches = [self._branch()]
            while self._peek() == "|":
                self.place += 1
                branches.append(self._branch())
            if len(branches) == 1:
                chain, sliders = self._split(branches[0])
                group = Carrier(chain, sliders)
            else:
                group = Bar(tuple(word for word, _ in branches))
        self._take("}")
        return group

    def _branch(self) -> tuple[Word, list[int]]:
        start = self.place
        word = self._word()
        dashes, letters = [], 0
        depth = 0
        for kind, value, _ in self.tokens[start : self.place]:
            depth += (value == "{") - (value == "}")
            if depth == 0 and kind == "sign" and value == "-":
                dashes.append(letters)
            elif depth == 0:
                letters += 1
        return word, dashes

    def _split(self, branch: tuple[Word, list[int]]) -> tuple[Word, Word]:
        word, dashes = branch
        sliders = dashes[-1] if dashes else 0
        if not 0 < sliders < len(word.items):
            raise self._fail()
        return Word(word.items[:sliders]), Word(word.items[sliders:])
