"""Searching many texts at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]
Whole = NDArray[Any]
WIDTHS = (1, 2, 4)
"""Bytes of a number."""
COPIED = 5
"""Where one in so many texts, or fewer, are searched, their letters are copied first."""
AT_ONCE = 8000
"""Texts that are compared with a pattern together."""
TOGETHER = 2
"""Letters after the first that are compared at all places; others only where these are met."""


@dataclass(frozen=True, eq=False)
class Texts:
    """Many texts in one row of ``letters``, given by their numbers: where each starts and ends, in order."""

    letters: Whole
    starts: Whole
    ends: Whole

    @classmethod
    def of(cls, every: Iterable[str]) -> Texts:
        every = list(every)
        letters = np.frombuffer("".join(every).encode("utf-32-le", "surrogatepass"), "<u4")
        return cls.ending(narrow_type(letters), np.cumsum([len(each) for each in every], dtype=np.int64))

    @classmethod
    def ending(cls, letters: Whole, ends: Whole) -> Texts:
        """Texts that follow each other, by where each ends."""
        return cls(letters, np.concatenate([np.zeros(1, np.int64), ends[:-1]])[: len(ends)], ends)

    def __len__(self) -> int:
        return len(self.ends)

    def __iter__(self) -> Iterator[str]:
        whole = self.letters.astype("<u4").tobytes().decode("utf-32-le", "surrogatepass")
        return (whole[start:end] for start, end in zip(self.starts.tolist(), self.ends.tolist(), strict=True))

    def at(self, places: Whole) -> Texts:
        """The texts at these places, which are in order."""
        starts, ends = self.starts[places], self.ends[places]
        if COPIED * len(places) > len(self):
            return Texts(self.letters, starts, ends)
        after = np.cumsum(ends - starts)
        moved = Texts.ending(self.letters[:0], after)
        copied = np.repeat(starts - moved.starts, ends - starts) + np.arange(after[-1] if len(after) else 0)
        return Texts(self.letters[copied], moved.starts, after)

    def holding(self, text: str) -> Flags:
        """In which a text occurs."""
        return self._after(self.starts, text, "") >= 0

    def matching(self, pattern: str) -> Flags:
        """Which fit a pattern as a whole: ``*`` stands for any letters, ``?`` for any one.

        Each part between two ``*`` is taken where it occurs first after the one before: if there is any way to fit the
        pattern, this is one.
        """
        return np.concatenate([each._fitting(pattern) for each in self._parts()] or [np.zeros(0, bool)])

    def _parts(self) -> Iterator[Texts]:
        """Some texts at a time, so few that what is computed of them stays in the processor's cache."""
        for i in range(0, len(self), AT_ONCE):
            starts, ends = self.starts[i : i + AT_ONCE], self.ends[i : i + AT_ONCE]
            yield Texts(self.letters[starts[0] : ends[-1]], starts - starts[0], ends - starts[0])

    def _fitting(self, pattern: str) -> Flags:
        first, *parts = pattern.split("*")
        begin = self._stands(self.starts, first)
        if not parts:
            return begin & (self.ends - self.starts == len(first))
        at = np.where(begin, self.starts + len(first), -1)
        for part in filter(None, parts[:-1]):
            at = self._after(at, part, "?")
        last = self.ends - len(parts[-1])
        return (at >= 0) & (at <= last) & self._stands(last, parts[-1])

    def _stands(self, at: Whole, part: str) -> Flags:
        """In which texts a part of a pattern stands at these places."""
        found = (at >= 0) & (at + len(part) <= self.ends)
        for i, letter in enumerate(part):
            if letter != "?":
                inside = np.flatnonzero(found)
                found[inside] = self.letters[at[inside] + i] == ord(letter)
        return found

    def _after(self, at: Whole, part: str, free: str) -> Whole:
        """Where in each text the first occurrence of a part ends that begins at a place or later; -1 where there is
        none, or where the place is negative. For letters of the part in ``free`` any others may stand."""
        fixed = [(i, ord(letter)) for i, letter in enumerate(part) if letter not in free]
        found = at >= 0
        if fixed:
            places = self._places(fixed)
            if not len(places):
                return np.full_like(at, -1)
            following = np.searchsorted(places, at)
            found &= following < len(places)
            at = places[np.minimum(following, len(places) - 1)]
        end = at + len(part)
        return np.where(found & (end <= self.ends), end, -1)

    def _places(self, fixed: list[tuple[int, int]]) -> Whole:
        """The places behind which each of these letters stands so far, in order."""
        (first, letter), *others = fixed
        count = max(0, len(self.letters) - fixed[-1][0])
        met = self.letters[first : first + count] == letter
        for i, letter in others[:TOGETHER]:
            met &= self.letters[i : i + count] == letter
        places = np.flatnonzero(met)
        for i, letter in others[TOGETHER:]:
            places = places[self.letters[places + i] == letter]
        return places


def narrow_type(numbers: Whole) -> Whole:
    """The same numbers, none negative, in as few bytes each as hold all."""
    largest = int(numbers.max()) if len(numbers) else 0
    return numbers.astype(f"<u{next(width for width in WIDTHS if largest < 256**width)}")
