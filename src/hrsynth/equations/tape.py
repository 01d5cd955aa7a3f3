"""Formulas written down: run once on symbols, a function on components becomes straight-line code.

The same expression is found once and constants are folded, so that the code of a robot holds only what its geometry
leaves. It is printed as Python: for rows of a table in NumPy, or for poses side by side (lanes), which numba compiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

TAPE_LANES_COUNT = 16
"""Poses that run through compiled code side by side; constant strides let the compiler use vector instructions."""
UFUNCS = {
    "+": "add",
    "-": "subtract",
    "*": "multiply",
    "/": "divide",
    "<": "less",
    "<=": "less_equal",
    "&": "logical_and",
    "sqrt": "sqrt",
    "abs": "absolute",
    "sin": "sin",
    "cos": "cos",
    "atan2": "arctan2",
}
LOGICAL = ("<", "<=", "&")
"""Operations whose result is a condition."""
Store = tuple[int, Any]
"""A place of the table, and the symbol or constant that is put there."""


class Symbol:
    """A number of which only the way it is computed is known: an operation of a tape."""

    __slots__ = ("number", "tape")
    __array_ufunc__ = None

    def __init__(self, tape: Tape, number: int) -> None:
        self.tape, self.number = tape, number

    def __add__(self, other: Any) -> Any:
        return self if _is_constant(other, 0.0) else self.tape.make("+", self, other)

    def __sub__(self, other: Any) -> Any:
        return self if _is_constant(other, 0.0) else self.tape.make("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return self.tape.make("-", other, self)

    def __mul__(self, other: Any) -> Any:
        if _is_constant(other, 0.0):
            return 0.0
        return self if _is_constant(other, 1.0) else self.tape.make("*", self, other)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> Any:
        return self * (1.0 / other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.tape.make("/", 1.0, self) * other

    def __neg__(self) -> Any:
        return self.tape.make("-", 0.0, self)

    def __abs__(self) -> Any:
        return self.tape.make("abs", self)

    def __lt__(self, other: Any) -> Any:
        return self.tape.make("<", self, other)

    def __gt__(self, other: Any) -> Any:
        return self.tape.make("<", other, self)

    def __le__(self, other: Any) -> Any:
        return self.tape.make("<=", self, other)

    def __ge__(self, other: Any) -> Any:
        return self.tape.make("<=", other, self)

    def __and__(self, other: Any) -> Any:
        return self.tape.make("&", self, other)

    def sqrt(self) -> Any:
        """Its square root."""
        return self.tape.make("sqrt", self)

    def sin(self) -> Any:
        """Its sine."""
        return self.tape.make("sin", self)

    def cos(self) -> Any:
        """Its cosine."""
        return self.tape.make("cos", self)

    def atan2(self, other: Any) -> Any:
        """The angle whose sine and cosine are as this and another."""
        return self.tape.make("atan2", self, other)

    def select(self, yes: Any, no: Any) -> Any:
        """``yes`` where this condition holds, ``no`` elsewhere."""
        return self.tape.make("?", self, yes, no)


def _is_constant(value: Any, constant: float) -> bool:
    return isinstance(value, float | int) and value == constant


@dataclass(eq=False)
class Tape:
    """Straight-line code: operations in order, each with its arguments, the number of an earlier one (int) or a
    constant (float). ``load`` reads a place of a table, ``number`` one of the robot's ``numbers``."""

    numbers: list[float]
    code: list[tuple[Any, ...]] = field(default_factory=list)
    known: dict[tuple[Any, ...], Symbol] = field(default_factory=dict)

    def make(self, name: str, *arguments: Any) -> Symbol:
        """Return an operation on symbols and constants; equal ones are shared."""
        operation = (name, *(each.number if isinstance(each, Symbol) else float(each) for each in arguments))
        return self._find(operation)

    def load(self, place: int) -> Symbol:
        """Return the symbol at a place."""
        return self._find(("load", place))

    def place(self, value: Any) -> int | None:
        """The place of which a symbol is the load."""
        operation = self.code[value.number] if isinstance(value, Symbol) else ("",)
        return operation[1] if operation[0] == "load" else None

    def number(self, value: float) -> Any:
        """A number of the robot, which the code reads when it runs; 0 and 1 become part of the code."""
        if value in (0.0, 1.0):
            return float(value)
        self.numbers.append(float(value))
        return self._find(("number", len(self.numbers) - 1))

    def _find(self, operation: tuple[Any, ...]) -> Symbol:
        key = tuple(map(repr, operation))
        if key not in self.known:
            self.known[key] = Symbol(self, len(self.code))
            self.code.append(operation)
        return self.known[key]

    def arguments(self, operation: tuple[Any, ...]) -> list[int]:
        """The earlier operations that one needs."""
        if operation[0] in ("load", "number"):
            return []
        return [each for each in operation[1:] if isinstance(each, int)]

    def are_constant(self) -> list[bool]:
        """Return True for operations on the robot's numbers alone: the same at all poses."""
        found: list[bool] = []
        for operation in self.code:
            found.append(operation[0] != "load" and all(found[each] for each in self.arguments(operation)))
        return found

    def needed_operations(self, stores: Sequence[Store]) -> set[int]:
        """The operations that the stored symbols need."""
        found: set[int] = set()
        queue = [each.number for _, each in stores if isinstance(each, Symbol)]
        while queue:
            number = queue.pop()
            if number not in found:
                found.add(number)
                queue += self.arguments(self.code[number])
        return found

    def rows(self, stores: Sequence[Store]) -> tuple[list[str], int]:
        """Lines on rows of ``m`` (places, n), with intermediate results in rows of ``r``; how many these are."""
        used = self.needed_operations(stores)
        last = {each: number for number in sorted(used) for each in self.arguments(self.code[number])}
        last |= {each.number: len(self.code) for _, each in stores if isinstance(each, Symbol)}
        names: list[str] = []
        free: list[str] = []
        lines, count = [], 0
        for number, (operation, fixed) in enumerate(zip(self.code, self.are_constant(), strict=True)):
            name, earlier = operation[0], self.arguments(operation)
            inputs = [names[each] if isinstance(each, int) else repr(each) for each in operation[1:]] if earlier else []
            if number not in used:
                names.append("")
            elif name == "load":
                names.append(f"m[{operation[1]}]")
            elif fixed:
                names.append(f"t{number}")
                lines.append(f"t{number} = {_write_scalar(operation, inputs)}")
            elif name in LOGICAL:
                names.append(f"t{number}")
                lines.append(f"t{number} = {UFUNCS[name]}({', '.join(inputs)})")
            else:
                if not free:
                    free, count = [f"r[{count}]"], count + 1
                names.append(result := free.pop())
                lines += (
                    [f"copyto({result}, {inputs[2]})", f"copyto({result}, {inputs[1]}, where={inputs[0]})"]
                    if (name == "?")
                    else [f"{UFUNCS[name]}({', '.join(inputs)}, {result})"]
                )
            free += [names[each] for each in {*earlier} if last.get(each) == number and names[each].startswith("r")]
        values = [names[each.number] if isinstance(each, Symbol) else repr(each) for _, each in stores]
        lines += [f"m[{place}] = {value}" for (place, _), value in zip(stores, values, strict=True)]
        return lines, count

    def statements(self, stores: Sequence[Store], places: Sequence[str]) -> list[tuple[str, str]]:
        """Names and what they are set to, in the order of the operations, then of what is stored: for one pose, in any
        language that writes sums and products as C does. ``places`` names what is loaded."""
        found = []
        for number in sorted(self.needed_operations(stores)):
            operation = self.code[number]
            inputs = [f"t{each}" if isinstance(each, int) else repr(each) for each in operation[1:]]
            text = places[operation[1]] if operation[0] == "load" else _write_scalar(operation, inputs)
            found.append((f"t{number}", text))
        return found

    def lanes(self, stores: Sequence[Store], live: int | None = None) -> list[str]:
        """Lines on ``TAPE_LANES_COUNT`` poses side by side: place p of lane i is ``m[LANES p + i]``. A lane in which
        place ``live`` is not positive keeps what it has."""
        before: list[str] = []
        inside = [] if live is None else [f"live = m[i + {TAPE_LANES_COUNT * live}] > 0.0"]
        fixed = self.are_constant()
        for number in sorted(self.needed_operations(stores)):
            operation = self.code[number]
            inputs = [f"t{each}" if isinstance(each, int) else repr(each) for each in operation[1:]]
            text = (
                f"m[i + {TAPE_LANES_COUNT * operation[1]}]"
                if operation[0] == "load"
                else _write_scalar(operation, inputs)
            )
            (before if fixed[number] else inside).append(f"t{number} = {text}")
        for place, each in stores:
            value = f"t{each.number}" if isinstance(each, Symbol) else repr(each)
            if isinstance(each, Symbol) and self.code[each.number][0] in LOGICAL:
                value = f"1.0 if {value} else 0.0"
            target = f"m[i + {TAPE_LANES_COUNT * place}]"
            inside.append(f"{target} = {value}" if live is None else f"{target} = ({value}) if live else {target}")
        return [*before, f"for i in range({TAPE_LANES_COUNT}):", *(f"    {line}" for line in inside)]


def _write_scalar(operation: tuple[Any, ...], inputs: Sequence[str]) -> str:
    """An operation on single numbers, in Python."""
    name = operation[0]
    if name == "number":
        return f"c[{operation[1]}]"
    if name == "?":
        return f"{inputs[1]} if {inputs[0]} else {inputs[2]}"
    if name.isalnum():
        return f"{name}({', '.join(inputs)})"
    return f"{inputs[0]} {name} {inputs[1]}"
