"""Formulas and names for a browser: MathML, indices, underlined motors."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from functools import cache
from typing import Any
from xml.sax.saxutils import escape

_INDEXED = re.compile(r"\b(tau|[BJNnpu]|τ)(\d+|i)\b")
_NUMBERED = re.compile(r"(.*?\D)(\d+)")
_BARRED = re.compile("(.)\u0332")
_LOW = "\u1d62"
"""Stands for the index of names in which an i would be read as a letter: tip1, tip2."""

_FORMULA = ("I", "T", "x", "e")
"""Letters in formulas that have no meaning listed: the identity, transposed, the cross product's matrix."""


@cache
def _make_printer() -> Any:
    """SymPy's printer of presentation MathML, taught the products of vectors."""
    from sympy.printing.mathml import MathMLPresentationPrinter
    from sympy.printing.precedence import PRECEDENCE

    class Printer(MathMLPresentationPrinter):
        def _print_dot(self, expression: Any) -> Any:
            return self._join(expression, "·")

        def _print_cross(self, expression: Any) -> Any:
            return self._join(expression, "×")

        def _print_Transpose(self, expression: Any) -> Any:
            base, mark = self._print(expression.arg), self.dom.createElement("mi")
            mark.appendChild(self.dom.createTextNode("T"))
            low = base.nodeName == "msub"
            found = self.dom.createElement("msubsup" if low else "msup")
            for part in (*(base.childNodes[:] if low else [base]), mark):
                found.appendChild(part)
            return found

        def _join(self, expression: Any, sign: str) -> Any:
            row = self.dom.createElement("mrow")
            for number, each in enumerate(expression.args):
                if number:
                    mark = self.dom.createElement("mo")
                    mark.appendChild(self.dom.createTextNode(sign))
                    row.appendChild(mark)
                row.appendChild(self.parenthesize(each, PRECEDENCE["Mul"], strict=True))
            return row

        def parenthesize(self, item: Any, level: int, strict: bool = False) -> Any:
            """As SymPy does, which holds every function to be bracketed already; the signs · and × are not."""
            product = type(item).__name__ in ("dot", "cross")
            return super().parenthesize(item, PRECEDENCE["Atom"] if product else level, strict and not product)

    return Printer()


def format_formula(expression: Any, said: str, zero: bool = True) -> str:
    """Format an expression (SymPy) as MathML; ``said`` is read where MathML is not supported."""
    found = _make_printer().doprint(expression).replace("&InvisibleTimes;", "\u2062")
    equals = "<mo>=</mo><mn>0</mn>" if zero else ""
    label = escape(said, {'"': "&quot;"})
    return (
        f'<math xmlns="http://www.w3.org/1998/Math/MathML" display="block" aria-label="{label}">'
        f"<mrow>{found}{equals}</mrow></math>"
    )


def lower_indices(text: str) -> str:
    """Format words with the indices of points and directions as subscripts, as HTML."""
    found = _INDEXED.sub(lambda m: f"{'τ' if m[1] == 'tau' else m[1]}<sub>{m[2]}</sub>", escape(text))
    return found.replace(_LOW, "<sub>i</sub>").replace("]x", "]<sub>×</sub>").replace("^T", "<sup>T</sup>")


def collect_symbols(where: Mapping[str, str]) -> list[tuple[str, str]]:
    """Collect the meanings of symbols; those that differ only in their index are one: ``Bi``, with i = 1, 2, 3."""
    kinds: dict[tuple[str, str], list[str]] = {}
    for symbol, meaning in where.items():
        match = _NUMBERED.fullmatch(symbol)
        head, number = (match[1], match[2]) if match else (symbol, "")
        pattern = _insert_indices(meaning, number, set(where)) if number else meaning
        kinds.setdefault((head, pattern), []).append(number)
    return [
        (f"{head}i", f"{pattern} (i = {', '.join(numbers)})")
        if len(numbers) > 1
        else (head + numbers[0], pattern if not numbers[0] else where[head + numbers[0]])
        for (head, pattern), numbers in kinds.items()
    ]


def _insert_indices(meaning: str, number: str, symbols: Collection[str]) -> str:
    """Replace the number in a meaning by the index: a letter if it stands alone or in a formula, else a subscript."""
    formula = set(re.findall(r"[^\W\d_]\w*", meaning)) <= {*symbols, *_FORMULA}
    return re.sub(
        rf"(?<!\d){number}(?!\d)", lambda m: "i" if formula or meaning[m.start() - 1] in " _" else _LOW, meaning
    )


def underline_motors(text: str) -> str:
    """Format an architecture with its actuated joints underlined, as HTML."""
    return _BARRED.sub(r"<u>\1</u>", escape(text))
