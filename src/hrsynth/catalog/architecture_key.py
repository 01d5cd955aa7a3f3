"""Architecture keys: legs as chains of joints with named axes, robots as multisets of legs on a platform.

A key has the incidences that hold at all poses, and no lengths::

    robot    = [platform ":"] legs ["|" legs] ["@" sensors]
    platform = "point" (all legs end on one R axis) or "bar" / "slide" (two plates, joined by two parallel
               bars on R joints, or by a P; "|" separates the legs of the two plates)
    legs     = [count] "(" joint ("-" joint)* ")", several joined by "+"
    joint    = letter axes ["*"] ["!"]
    letter   = R P C (one axis), U (two, at right angles), S (none), Pi (the normal of a parallelogram), 2SS (two equal
               parallel rods between S joints, the axis along their distance), 2US (the same with U at the upper ends)

    sensors  = [count] kind ["'"], several joined by "+": observations of the platform by cameras on the base, or IMUs,
               instead of the legs; ``'`` gives each its own camera, the others share one

``*`` marks a motor, ``!`` the joint after which the observed link follows (of two rods, the first of them), where it is
not the default segment. Axes are directions at the zero configuration, named by

=======  ==============================================================================================================
x y z    the base's axes: the same direction for all legs; z is the normal of a planar robot
t r      the tangent and the radius at the leg's end on the base
k        some direction of the leg's own normal to t
h j m    directions of the leg's own normal to z
a b c    directions of the leg's own, in general position
l        along the line from the centre before to the centre after
o        through a point that all legs share
n q      in a U: normal to its other axis, and (n) to the line of centres next to it; n of a Pi: normal to the axis of
         the joint before it and to its rods
=======  ==============================================================================================================

The canonical key has its legs sorted, first as if they had no motors (a motor changes no leg's label), names letters
of the same kind in the order of the leg, and drops the ``!`` of a default segment. It is stable: a new
meaning changes ``ARCHITECTURE_KEY_VERSION``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

from ..errors import BadRequest
from ..mechanism.observations import list_kinds
from ..mechanism.observations.encoder import Encoder

ARCHITECTURE_KEY_LEGS_MAX = 12
"""Largest number of legs of an architecture key."""

ARCHITECTURE_KEY_VERSION = 1
"""Version of the words and of the mechanisms they stand for."""

AXES = {"R": 1, "P": 1, "C": 1, "U": 2, "S": 0, "Pi": 1, "2SS": 1, "2US": 1}
"""How many axes each letter has."""
FREEDOMS = {"R": 1, "P": 1, "C": 2, "U": 2, "S": 3, "Pi": 1, "2SS": 4, "2US": 4}
"""Dof of each letter without internal motion."""
COMPOSITE = ("Pi", "2SS", "2US")
MOVED = ("R", "P", "C", "U")
"""Letters that can have a motor."""
NAMES = "xyztrkhjmabclonq"
"""Names of directions."""
ALIKE = ("hjm", "abc")
"""Names that stand for the same kind of direction, in the order in which a leg uses them."""
SENSORS = "sensors"
"""Group of keys with sensors; all others observe legs."""
PLATFORMS = {"": 1, "point": 1, "bar": 2, "slide": 2}
"""Platforms, and the bodies on which legs end."""

_JOINT = re.compile(r"(?P<letter>2SS|2US|Pi|[RPCUS])(?P<axes>[a-z]*)(?P<motor>\*?)(?P<watched>!?)")
CACHED_LEG_KEYS_COUNT = 10_000
"""Legs that were read and are kept."""
LONGEST_COUNT = 9
"""Digits of a number of legs that are read: more than any robot has."""
_LEGS = re.compile(r"(?P<count>[0-9]*)\((?P<leg>[^()]*)\)")
_SIGHTS = re.compile(r"(?P<count>[0-9]*)(?P<kind>[a-z_]+)(?P<own>'?)")


@dataclass(frozen=True, order=True)
class JointSymbol:
    """A joint of a leg: its letter, the names of its axes, whether it has a motor, whether the link after it is
    observed."""

    letter: str
    axes: str = ""
    motor: bool = False
    watched: bool = False

    def __str__(self) -> str:
        return f"{self.letter}{self.axes}{'*' * self.motor}{'!' * self.watched}"


@dataclass(frozen=True, order=True)
class LegKey:
    """A leg from the base to the platform."""

    joints: tuple[JointSymbol, ...]

    def __str__(self) -> str:
        return self._text

    @cached_property
    def _text(self) -> str:
        return f"({'-'.join(map(str, self.joints))})"

    @property
    def freedoms(self) -> int:
        """Dof of the leg's end."""
        return sum(FREEDOMS[joint.letter] for joint in self.joints)

    @cached_property
    def unmoved(self) -> LegKey:
        """The leg without its motors."""
        return LegKey(tuple(replace(joint, motor=False) for joint in self.joints))

    @cached_property
    def unmarked(self) -> LegKey:
        """The leg of which the default segment is observed."""
        return LegKey(tuple(replace(joint, watched=False) for joint in self.joints))

    @cached_property
    def chain(self) -> LegKey:
        """The joints alone, in canonical names: nothing is driven, the default segment is observed."""
        return self.unmoved.unmarked.canonical

    @property
    def driven(self) -> LegKey:
        """The leg with one motor, on its first R or P."""
        first = next((i for i, joint in enumerate(self.joints) if joint.letter in ("R", "P")), None)
        return LegKey(tuple(replace(joint, motor=i == first) for i, joint in enumerate(self.joints)))

    @property
    def observed(self) -> int | None:
        """The joint after which the observed link follows; None for the default segment."""
        return next((i for i, joint in enumerate(self.joints) if joint.watched), None)

    @cached_property
    def canonical(self) -> LegKey:
        """The leg with names in order and without the mark of a default segment."""
        names: dict[str, str] = {}
        for name in "".join(joint.axes for joint in self.joints):
            for kind in ALIKE:
                if name in kind and name not in names:
                    names[name] = kind[sum(known in kind for known in names)]
        axes = ["".join(names.get(name, name) for name in joint.axes) for joint in self.joints]
        mark = self.observed
        if mark is not None:
            inside = self.joints[mark].letter in COMPOSITE and mark + 1 < len(self.joints)
            mark = mark if inside else self._along(mark)
            mark = None if mark == self._default() and not inside else mark
        return LegKey(
            tuple(
                replace(joint, axes=own, watched=i == mark)
                for i, (joint, own) in enumerate(zip(self.joints, axes, strict=True))
            )
        )

    def _along(self, mark: int) -> int:
        """The last link that turns as this one: P joints do not change a direction."""
        while mark + 2 < len(self.joints) and self.joints[mark + 1].letter == "P":
            mark += 1
        return mark

    def _default(self) -> int:
        """The joint before the default segment: the axis of a P between two moving links, else the last segment."""
        inner = range(1, len(self.joints) - 1)
        slide = next((i for i in inner if self.joints[i].letter == "P"), None)
        if slide is not None:
            return self._along(slide - 1)
        return len(self.joints) - (1 if self.joints[-1].letter in COMPOSITE else 2)

    @cached_property
    def order(self) -> tuple[tuple[object, ...], ...]:
        """Its place among others: as it is without motors, then by its motors."""
        return (
            tuple((joint.letter, joint.axes, False, joint.watched) for joint in self.joints),
            tuple((joint.letter, joint.axes, joint.motor, joint.watched) for joint in self.joints),
        )


@dataclass(frozen=True, order=True)
class SightWord:
    """Observation of the platform: its kind, and True for its own camera."""

    kind: str
    own: bool = False

    def __str__(self) -> str:
        return self.kind + "'" * self.own


@dataclass(frozen=True)
class ArchitectureKey:
    """Architecture: a platform, the sorted legs that end on each of its links, and its sorted sensors."""

    platform: str
    bodies: tuple[tuple[LegKey, ...], ...]
    seen: tuple[SightWord, ...] = ()

    @classmethod
    def of(
        cls, legs: list[LegKey], *more: list[LegKey], platform: str = "", seen: Iterable[SightWord] = ()
    ) -> ArchitectureKey:
        """The canonical word of these legs; ``more``: those of a second body."""
        bodies = (tuple(sorted((leg.canonical for leg in body), key=lambda leg: leg.order)) for body in (legs, *more))
        return cls(
            platform,
            tuple(sorted(bodies, key=lambda body: [*zip(*(leg.order for leg in body), strict=True)])),
            tuple(sorted(seen)),
        )

    @property
    def legs(self) -> tuple[LegKey, ...]:
        """All legs, in the order of their labels 1, 2, …"""
        return tuple(leg for body in self.bodies for leg in body)

    @property
    def unmoved(self) -> ArchitectureKey:
        """The architecture without its motors: what the hidden robot is found from."""
        return ArchitectureKey.of(
            *[[leg.unmoved for leg in body] for body in self.bodies], platform=self.platform, seen=self.seen
        )

    @property
    def driven(self) -> ArchitectureKey:
        """The architecture with a motor on the first R or P of each leg: three R that meet in a point are no S then."""
        return ArchitectureKey.of(
            *[[leg.driven for leg in body] for body in self.bodies], platform=self.platform, seen=self.seen
        )

    @property
    def unmarked(self) -> ArchitectureKey:
        """The architecture of which the default segment of each leg is observed, and nothing else."""
        return ArchitectureKey.of(*[[leg.unmarked for leg in body] for body in self.bodies], platform=self.platform)

    @property
    def unseen(self) -> ArchitectureKey:
        """The architecture without its sensors."""
        return replace(self, seen=())

    def __str__(self) -> str:
        bodies = [count_equal(body) for body in self.bodies]
        seen = f"@{count_equal(self.seen)}" if self.seen else ""
        return (f"{self.platform}:{'|'.join(bodies)}" if self.platform else bodies[0]) + seen


def count_equal(symbols: Iterable[LegKey | SightWord]) -> str:
    """Equal ones once with their number, joined by +."""
    return "+".join(f"{count if count > 1 else ''}{each}" for each, count in Counter(map(str, symbols)).items())


def parse(text: str) -> ArchitectureKey:
    """Parse a key into canonical form; raises ``BadRequest``."""
    robot, at, seen = text.strip().partition("@")
    platform, colon, rest = robot.rpartition(":")
    if platform not in PLATFORMS or bool(colon) != bool(platform):
        raise BadRequest(f"key {text!r}: unknown platform", platform, [name for name in PLATFORMS if name])
    bodies = [_parse_legs(text, part) for part in rest.split("|")]
    if len(bodies) != PLATFORMS[platform]:
        raise BadRequest(f"key {text!r}: number of platform links", len(bodies), str(PLATFORMS[platform]))
    word = ArchitectureKey.of(*bodies, platform=platform, seen=parse_observations(seen) if at else ())
    if at and any(leg.observed is not None for leg in word.legs):
        raise BadRequest(f"key {text!r}: sensors replace observed links", remedy="Omit ! or the part after @.")
    if not 2 <= len(word.legs) <= ARCHITECTURE_KEY_LEGS_MAX:
        raise BadRequest(f"key {text!r}: number of legs", len(word.legs), f"2 to {ARCHITECTURE_KEY_LEGS_MAX}")
    return word


def parse_observations(text: str) -> tuple[SightWord, ...]:
    """Parse sensors, in canonical order; raises ``BadRequest``."""
    known, found = [name for name, kind in list_kinds().items() if not issubclass(kind, Encoder)], list[SightWord]()
    for term in text.split("+"):
        match = _SIGHTS.fullmatch(term.strip())
        count = int(match["count"][:LONGEST_COUNT] or 1) if match else 0
        if match is None or match["kind"] not in known or not 1 <= count <= ARCHITECTURE_KEY_LEGS_MAX:
            raise BadRequest(
                f"sensors {text!r}: unknown term",
                term,
                known,
                remedy=f"Write 1 to {ARCHITECTURE_KEY_LEGS_MAX} of a kind, such as 3point, and join kinds by +.",
            )
        found += [SightWord(match["kind"], bool(match["own"]))] * count
    return tuple(sorted(found))


def _parse_legs(text: str, part: str) -> list[LegKey]:
    found: list[LegKey] = []
    for term in part.split("+"):
        match = _LEGS.fullmatch(term.strip())
        if match is None:
            raise BadRequest(f"key {text!r}: no legs", term, remedy="Write legs such as 3(Rz*-Rz-Rz), joined by +.")
        count = int(match["count"][:LONGEST_COUNT] or 1)
        if not 1 <= count <= ARCHITECTURE_KEY_LEGS_MAX:
            raise BadRequest(f"key {text!r}: number of equal legs", count, f"1 to {ARCHITECTURE_KEY_LEGS_MAX}")
        try:
            leg = _get_leg(match["leg"])
        except BadRequest:
            leg = _parse_leg(text, match["leg"])  # in words that name all of it
        found += [leg] * count
    return found


@lru_cache(CACHED_LEG_KEYS_COUNT)
def _get_leg(chain: str) -> LegKey:
    """Words have few different legs: what follows from one is found once."""
    return _parse_leg(chain, chain)


def _parse_leg(text: str, chain: str) -> LegKey:
    joints = tuple(_parse_joint(text, part) for part in chain.split("-"))
    if joints[0].letter == "Pi" and joints[0].axes == "n":
        raise BadRequest(f"key {text!r}: axis n of the first joint", chain, remedy="Put a joint before Pin.")
    if sum(joint.watched for joint in joints) > 1:
        raise BadRequest(f"key {text!r}: observed links of one leg", sum(joint.watched for joint in joints), "1")
    if joints[-1].watched and joints[-1].letter not in COMPOSITE:
        raise BadRequest(f"key {text!r}: the platform is observed", chain, remedy="Put ! after another joint.")
    if len(joints) == 1 and joints[0].letter not in COMPOSITE:
        raise BadRequest(f"key {text!r}: a leg of one joint has no segment", chain, remedy="Use two joints or more.")
    return LegKey(joints)


def _parse_joint(text: str, part: str) -> JointSymbol:
    match = _JOINT.fullmatch(part)
    if match is None:
        raise BadRequest(f"key {text!r}: unknown joint", part, f"{', '.join(AXES)} with axes, * and !")
    letter, axes = match["letter"], match["axes"]
    if len(axes) != AXES[letter]:
        raise BadRequest(f"key {text!r}: axes of {part!r}", len(axes), f"{AXES[letter]} for {letter}")
    unknown = sorted(set(axes) - set(NAMES))
    if unknown:
        raise BadRequest(f"key {text!r}: unknown axis in {part!r}", unknown[0], " ".join(NAMES))
    if letter != "U" and set(axes) & {"n", "q"} and (letter, axes) != ("Pi", "n"):
        raise BadRequest(f"key {text!r}: axis n or q of {part!r}", letter, "U")
    if match["motor"] and letter not in MOVED:
        raise BadRequest(f"key {text!r}: motor on {part!r}", letter, MOVED)
    return JointSymbol(letter, axes, bool(match["motor"]), bool(match["watched"]))
