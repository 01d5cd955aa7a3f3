"""Ways to make a certificate false, or at least no proof, and random changes of its text."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from hrsynth.certificates.verify_certificate import digest

Record = dict[str, Any]


def moved(text: str, by: Fraction) -> str:
    return str(Fraction(text) + by)


def amount(rng: random.Random) -> Fraction:
    """A change that is far larger than the boxes, of either sign."""
    return rng.choice((-1, 1)) * Fraction(1, 2 ** rng.randint(0, 60))


def a_box(record: Record, rng: random.Random) -> tuple[Record, Record]:
    system = rng.choice(record["systems"])
    return system, rng.choice(system["boxes"])


def drop_box(record: Record, rng: random.Random) -> None:
    system, box = a_box(record, rng)
    system["boxes"].remove(box)


def double_box(record: Record, rng: random.Random) -> None:
    system, box = a_box(record, rng)
    system["boxes"].append(copy.deepcopy(box))


def repeat_box(record: Record, rng: random.Random) -> None:
    """One box told in the place of another."""
    system, box = a_box(record, rng)
    k = rng.randrange(len(system["boxes"]))
    if system["boxes"][k] is box:
        return wrong_count(record, rng)
    system["boxes"][k] = copy.deepcopy(box)
    return None


def move_box(record: Record, rng: random.Random) -> None:
    _, box = a_box(record, rng)
    part = rng.choice(box["middle"])
    part[0] = moved(part[0], amount(rng))


def turn_complex(record: Record, rng: random.Random) -> None:
    _, box = a_box(record, rng)
    part = rng.choice(box["middle"])
    part[1] = moved(part[1], amount(rng))


def wrong_radius(record: Record, rng: random.Random) -> None:
    """No radius, too large, or too small to hold the solution, where that is not the middle itself."""
    _, box = a_box(record, rng)
    exact = all(Fraction(x).denominator == 1 for part in box["middle"] for x in part)
    box["radius"] = rng.choice(["0", "-1/1208925819614629174706176", "1000", "1000" if exact else f"1/{2**600}"])


def wrong_inverse(record: Record, rng: random.Random) -> None:
    _, box = a_box(record, rng)
    for row in box["inverse"]:
        for entry in row:
            entry[0] = str(3 * Fraction(entry[0]) + 1)


def wrong_count(record: Record, rng: random.Random) -> None:
    record[rng.choice(("real", "complex"))] += rng.choice((-2, -1, 1, 2))


def uncounted(record: Record, rng: random.Random) -> None:
    """A pose that says besides that it misses a leg, and is left out of the count of complex ones."""
    _, box = a_box(record, rng)
    if "pose" not in box:
        return wrong_count(record, rng)
    box["misses"] = 0
    record["complex"] -= 1
    return None


def wrong_pose(record: Record, rng: random.Random) -> None:
    _, box = a_box(record, rng)
    if "pose" not in box:
        return wrong_count(record, rng)
    row = rng.choice(box["pose"])
    row[-1] = moved(row[-1], rng.choice((-1, 1)) * Fraction(1, 10 ** rng.randint(0, 5)))
    return None


def forget_pose(record: Record, rng: random.Random) -> None:
    """A real solution told as if it were complex, and counted so."""
    _, box = a_box(record, rng)
    if "pose" not in box:
        return wrong_count(record, rng)
    del box["pose"]
    record["real"] -= 1
    return None


def wrong_caps(record: Record, rng: random.Random) -> None:
    bound = rng.choice(record["systems"])["bound"]
    if bound["kind"] == "degrees":
        return wrong_groups(bound["groups"], rng)
    if bound["kind"] != "rank":
        return wrong_count(record, rng)
    for group in bound["groups"]:
        group[1] = rng.choice([cap for cap in (0, 1, 13, -1, 2.5, "3") if cap != group[1]])
    return None


def wrong_groups(groups: list[list[int]], rng: random.Random) -> None:
    """An unknown in no group, in two, or one that there is not."""
    group = rng.choice(groups)
    match rng.randrange(3):
        case 0:
            group.pop()
        case 1:
            group.append(rng.choice(rng.choice(groups)))
        case 2:
            group[0] = sum(map(len, groups))


def other_far(record: Record, rng: random.Random) -> None:
    """Another vector above the caps, one less, or one twice."""
    bounds = [system["bound"] for system in record["systems"] if system["bound"].get("far")]
    if not bounds:
        return wrong_count(record, rng)
    far = rng.choice(bounds)["far"]
    k = rng.randrange(len(far))
    match rng.randrange(3):
        case 0:
            far.pop(k)
        case 1:
            far.append(far[k])
        case 2:
            used = [j for j, c in enumerate(far[k]) if int(c, 16)]
            j = rng.choice(used)
            far[k][j] = hex(int(far[k][j], 16) + rng.choice((-1, 1)))
    return None


def other_geometry(record: Record, rng: random.Random) -> None:
    """A curve of another size, or a tip elsewhere."""
    system = rng.choice(record["systems"])
    reach = rng.choice(system["reaches"][: system.get("square", len(system.get("joints", [])) or None)])
    ((kind, vectors),) = reach.items()
    if kind == "circle":
        factor = 1 + amount(rng)
        vectors[1:] = [[str(Fraction(x) * factor) for x in each] for each in vectors[1:]]
    elif kind == "sphere":
        vectors[1][0] = str(Fraction(vectors[1][0]) * (1 + amount(rng)))
    else:
        across = vectors[1] if kind == "plane" else other(vectors[1]) if kind == "line" else ["1"] * len(vectors[0])
        by = amount(rng)
        vectors[0] = [moved(x, by * Fraction(d)) for x, d in zip(vectors[0], across, strict=True)]
    return None


def other(direction: list[str]) -> list[str]:
    """A vector that is not along a direction."""
    return (
        ["1" if Fraction(x) == 0 else "0" for x in direction]
        if any(Fraction(x) == 0 for x in direction)
        else ["1", *["0"] * (len(direction) - 1)]
    )


def closed(record: Record) -> list[Record]:
    """The boxes at which the robot is told to close."""
    return [box for system in record["systems"] for box in system["boxes"] if "links" in box]


def open_joint(record: Record, rng: random.Random) -> None:
    """A link elsewhere."""
    if not closed(record):
        return wrong_count(record, rng)
    row = rng.choice(rng.choice(list(rng.choice(closed(record))["links"].values())))
    k = rng.randrange(4)
    row[k] = moved(row[k], rng.choice((-1, 1)) * Fraction(1, 10 ** rng.randint(0, 5)))
    return None


def lost_link(record: Record, rng: random.Random) -> None:
    if not closed(record):
        return wrong_count(record, rng)
    links = rng.choice(closed(record))["links"]
    del links[rng.choice(list(links))]
    return None


def other_measurement(record: Record, rng: random.Random) -> None:
    """A direction or place that is held, told otherwise."""
    if not closed(record):
        return wrong_count(record, rng)
    seen = rng.choice(record["assembly"]["held"])[3]
    k = rng.randrange(3)
    seen[k] = moved(seen[k], rng.choice((-1, 1)) * Fraction(1, 10 ** rng.randint(0, 8)))
    return None


def other_place(record: Record, rng: random.Random) -> None:
    """A tip at another point of its link, or in another frame."""
    places = [system["places"] for system in record["systems"] if "places" in system]
    if not places:
        return wrong_count(record, rng)
    told = rng.choice(places)
    if rng.random() < 0.5:
        vector = rng.choice(told["frame"][1:])
        vector[0] = moved(vector[0], rng.choice((-1, 1)) * Fraction(1, 10 ** rng.randint(0, 4)))
    else:
        rng.choice(told["tips"])[1][3] = rng.choice(("2", "-1", "1/2"))
    return None


def other_joint(record: Record, rng: random.Random) -> None:
    """A joint of no kind, with other axes, or at an axis of no length."""
    if "assembly" not in record:
        return wrong_count(record, rng)
    joint = rng.choice(record["assembly"]["joints"])
    if rng.random() < 0.5:
        joint[0] = rng.choice(("X", "", None, "RU"))
    else:
        joint.append(["1", "0", "0", "0"])
        if joint[0] == "R":
            joint[-2:] = [["0", "0", "1/1000", "0"]]
    return None


def missing_key(record: Record, rng: random.Random) -> None:
    holder = rng.choice([record["systems"][0], record["systems"][0]["boxes"][0]])
    del holder[rng.choice([key for key in holder if key not in ("pose", "within", "links")])]


def wrong_type(record: Record, rng: random.Random) -> None:
    system = rng.choice(record["systems"])
    key = rng.choice(["kind", "reaches", "tips", "boxes", "bound"])
    system[key] = rng.choice([None, 3, "x", *([[], {}] if system[key] else [])])


FALSE: tuple[Callable[[Record, random.Random], None], ...] = (
    drop_box,
    double_box,
    repeat_box,
    move_box,
    turn_complex,
    wrong_radius,
    wrong_inverse,
    wrong_count,
    wrong_pose,
    uncounted,
    forget_pose,
    wrong_caps,
    other_far,
    other_geometry,
    open_joint,
    lost_link,
    other_measurement,
    other_place,
    other_joint,
    missing_key,
    wrong_type,
)


def false(record: Record, rng: random.Random) -> tuple[str, Record]:
    """The name of a change, and the changed certificate with a digest that fits."""
    changed = copy.deepcopy(record)
    change = rng.choice(FALSE)
    change(changed, rng)
    changed["sha256"] = digest(changed)
    return change.__name__, changed


def scribbled(text: str, rng: random.Random) -> str:
    """A certificate's text with one character changed, left out or doubled."""
    k = rng.randrange(len(text))
    return text[:k] + rng.choice(["", text[k] * 2, rng.choice('0123456789-./{}[]",x')]) + text[k + 1 :]


def means_the_same(one: str, other: str) -> bool:
    """Whether two texts are one record: blanks do not count."""
    try:
        return bool(json.loads(one) == json.loads(other))
    except ValueError:
        return False
