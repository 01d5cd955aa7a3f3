"""How two answers differ: numbers by more than a tolerance, lists but for their order, texts but for their numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

RELATIVE, ABSOLUTE, HUGE = 1e-5, 1e-7, 1e8
"""Numbers that differ by no more are equal; what is larger is infinite but for rounding."""
GREY = 4.0
"""Mean difference of the pixels of equal pictures, of 255."""
NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e[+-]?\d+)?\b")
MOVING = {"seconds", "version", "generated", "sha256"}
"""Fields that are others at each run or in each version."""

Json = Any


def masked(text: str) -> list[str]:
    """The lines of a text, numbers, widths of columns and progress, which depends on the machine, left out."""
    lines = [" ".join(NUMBER.sub("#", line).replace("─", "-").split()) for line in text.splitlines()]
    return [line for line in lines if ", step #" not in line]


def inlined(schema: Json, parts: Json, inside: tuple[str, ...] = ()) -> Json:
    """A schema with its parts in their places, without what is said of them; of what holds itself the name."""
    if isinstance(schema, list):
        return [inlined(each, parts, inside) for each in schema]
    if not isinstance(schema, dict):
        return schema
    name = str(schema.get("$ref", "")).rpartition("/")[2]
    if name:
        return name if name in inside else inlined(parts[name], parts, (*inside, name))
    return {
        key: inlined(each, parts, inside)
        for key, each in schema.items()
        if key not in ("$defs", "$schema", "title") and not (key == "description" and isinstance(each, str))
    }


def renamed(value: Json, names: dict[str, str], words: dict[str, str]) -> Json:
    """The same with other names of fields, and other words in texts: those that were changed on purpose."""
    if isinstance(value, dict):
        return {names.get(key, key): renamed(part, names, words) for key, part in value.items()}
    if isinstance(value, str):
        for old, new in words.items():
            value = value.replace(old, new)
    return [renamed(part, names, words) for part in value] if isinstance(value, list) else value


def without(value: Json, names: list[str], lines: list[str]) -> Json:
    """The same without fields of these names, and without lines of text that begin so."""
    if isinstance(value, dict):
        return {key: without(part, names, lines) for key, part in value.items() if key not in names}
    if isinstance(value, list):
        return [without(part, names, lines) for part in value if part not in names]
    if isinstance(value, str) and "\n" in value:
        return "\n".join(line for line in value.splitlines() if not line.lstrip().startswith(tuple(lines)))
    return value


def differences(old: Json, new: Json, at: str = "") -> Iterator[str]:
    """Where two values differ, a line each."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new} - MOVING):
            if key not in old or key not in new:
                yield f"{at}.{key}: {'new' if key in new else 'gone'}"
            else:
                yield from differences(old[key], new[key], f"{at}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        yield from _of_lists(old, new, at)
    elif isinstance(old, bool) or isinstance(new, bool) or not all(isinstance(x, (int, float)) for x in (old, new)):
        if isinstance(old, str) and isinstance(new, str):
            before, after = masked(old), masked(new)
            if before != after:
                line = next(
                    (k for k, (a, b) in enumerate(zip(before, after, strict=False)) if a != b),
                    min(len(before), len(after)),
                )
                yield f"{at}: line {line + 1}: {before[line : line + 1]} is now {after[line : line + 1]}"
        elif old != new:
            yield f"{at}: {str(old)[:80]} is now {str(new)[:80]}"
    elif abs(old - new) > ABSOLUTE + RELATIVE * abs(old) and not min(abs(old), abs(new)) > HUGE:
        yield f"{at}: {old!r} is now {new!r}"


def _of_lists(old: list[Json], new: list[Json], at: str) -> Iterator[str]:
    """Lists of vectors and numbers in order; of texts and records in any order."""
    if len(old) != len(new):
        yield f"{at}: {len(old)} items are now {len(new)}"
        return
    left = list(enumerate(new))
    for place, part in enumerate(old):
        left.sort(key=lambda each, place=place: each[0] != place)  # type: ignore[misc]
        free = left[:1] if isinstance(part, (int, float)) else left
        same = next((each for each in free if next(differences(part, each[1]), None) is None), None)
        if same is None:
            yield from differences(part, new[place], f"{at}[{place}]")
            return
        left.remove(same)


def of_pictures(old: list[list[int]], new: list[list[int]]) -> float:
    """The mean difference of the pixels of two pictures."""
    pairs = [(a, b) for one, two in zip(old, new, strict=True) for a, b in zip(one, two, strict=True)]
    return sum(abs(a - b) for a, b in pairs) / len(pairs)


def values_of(value: Json) -> list[float]:
    """Return the numbers of JSON, truth values and nulls as numbers too, in ascending order; without those of texts."""
    if isinstance(value, dict):
        return sorted(number for key, each in value.items() if key not in MOVING for number in values_of(each))
    if isinstance(value, list):
        return sorted(number for each in value for number in values_of(each))
    return [] if isinstance(value, str) else [-HUGE if value is None else max(-HUGE, min(HUGE, float(value)))]


def numbers_differ(old: Json, new: Json) -> Iterator[str]:
    """Yield how two answers differ in the numbers of their JSON, and in those that their texts show."""
    before, after = values_of(old.get("json", old)), values_of(new.get("json", new))
    if len(before) != len(after):
        yield f"{len(before)} values are now {len(after)}"
    elif apart := [(a, b) for a, b in zip(before, after, strict=True) if abs(a - b) > ABSOLUTE + RELATIVE * abs(a)]:
        yield f"values differ: {apart[:3]}"
    shown = [Counter(NUMBER.findall(str(each.get("text", "")))) for each in (old, new)]
    if shown[0] != shown[1]:
        yield f"numbers in text: gone {dict(shown[0] - shown[1])}, new {dict(shown[1] - shown[0])}"[:300]
