"""Check a certificate of a path: `python verify_path.py c.json`. Integers and fractions only.

The platform has *motions*: a point starts from `origin` and moves along some vectors, and the platform turns from
`home` about no axis, one, or three. Poses are written in coordinates of these motions, so no pose leaves them: a factor
for each vector; and w and a factor for each axis, the quaternion w + the sum of factors times axes, of any length. On a
path all of these go straight from pose to pose. Each leg is in closed form: its tip, a vector of the pose, decides what
it carries in its *working mode*, as long as the leg reaches (proofs.md, section 9).

*same aspect*: on each piece, the coordinates and all that follows are enclosed in intervals whose ends are rounded
outwards to multiples of 2^-96. All legs reach, in the working modes of the file, and the condition, an expression in
vectors, is nowhere zero: it keeps its sign from the first pose to the last. *separated*: at the first pose, in the
first working modes of the file, it has one sign; at the last, in each of the others, the opposite one. It is continuous
where legs pass from one working mode to another, so it is zero on every path from the first configuration to one of the
last. How many of all working modes there are among these is printed.

Not proved here: that the condition is that of the hidden robot's Type 2 singularities, that motions, legs and condition
are a robot's (`hrsynth verify --robot` compares them), joint limits. The keys robot, observed, start and goal are
for that comparison; the ends of the path are in `ends`.
"""

import hashlib
import json
import math
import sys
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Any

PATH_CERTIFICATE_MAX_BYTES = 5_000_000  # of a certificate's file
ONE = 1 << 96  # intervals are pairs of integers, in units of one over this
Interval = tuple[int, int]
Vector = list[Interval]


class PathRejection(Exception):
    """Certificate that is not accepted: the reason."""


def need(true: Any, why: str) -> None:
    if not true:
        raise PathRejection(why)


def number(text: Any) -> Fraction:
    need(isinstance(text, str) and len(text) < 300 and not set(text) - set("0123456789/.-"), "a number in words")
    return Fraction(text)


def interval(x: Fraction, y: Fraction | None = None) -> Interval:  # the least that holds one or two fractions
    low, high = sorted([x, x if y is None else y])
    return math.floor(low * ONE), math.ceil(high * ONE)


def plus(a: Interval, b: Interval) -> Interval:
    return a[0] + b[0], a[1] + b[1]


def minus(a: Interval, b: Interval) -> Interval:
    return a[0] - b[1], a[1] - b[0]


def times(a: Interval, b: Interval) -> Interval:
    products = [x * y for x in a for y in b]
    return min(products) // ONE, -(-max(products) // ONE)


def over(a: Interval, b: Interval) -> Interval:
    need(b[0] * b[1] > 0, "a denominator that may be zero")
    quotients = [(x * ONE, y) for x in a for y in b]
    return min(x // y for x, y in quotients), max(-(-x // y) for x, y in quotients)


def square(a: Interval) -> Interval:
    low, high = sorted(map(abs, a))
    return 0 if a[0] * a[1] <= 0 else low * low // ONE, -(-high * high // ONE)


def root(a: Interval) -> Interval:
    need(a[0] > 0, "a leg that may not reach, or a vector that may be zero")
    return math.isqrt(a[0] * ONE), math.isqrt(a[1] * ONE) + 1


def total(values: Iterable[Interval]) -> Interval:
    found: Interval = (0, 0)
    for each in values:
        found = plus(found, each)
    return found


def add(u: Vector, v: Vector) -> Vector:
    return [plus(a, b) for a, b in zip(u, v, strict=True)]


def sub(u: Vector, v: Vector) -> Vector:
    return [minus(a, b) for a, b in zip(u, v, strict=True)]


def scaled(c: Interval, u: Vector) -> Vector:
    return [times(c, a) for a in u]


def dot(u: Vector, v: Vector) -> Interval:
    return total(times(a, b) for a, b in zip(u, v, strict=True))


def norm2(u: Vector) -> Interval:
    return total(map(square, u))


def cross(u: Vector, v: Vector) -> Vector:
    return [minus(times(u[i], v[j]), times(u[j], v[i])) for i, j in ((1, 2), (2, 0), (0, 1))]


def unit(u: Vector) -> Vector:
    size = root(norm2(u))
    return [over(a, size) for a in u]


def vector(texts: Any) -> Vector:
    need(isinstance(texts, list) and len(texts) == 3, "a vector of another length")
    return [interval(number(x)) for x in texts]


def rotation(q: Vector) -> list[Vector]:  # of the quaternions in a box; shape (3, 3)
    w, *v = q
    size, c = norm2(q), total([square(w), *(minus((0, 0), square(x)) for x in v)])
    need(size[0] > 0, "a quaternion that may be zero")
    R = [[times((2 * ONE, 2 * ONE), times(a, b)) for b in v] for a in v]
    for i in range(3):
        R[i][i] = plus(times((2 * ONE, 2 * ONE), square(v[i])), c)
        j, k = (i + 1) % 3, (i + 2) % 3
        twist = times((2 * ONE, 2 * ONE), times(w, v[k]))
        R[i][j], R[j][i] = minus(R[i][j], twist), plus(R[j][i], twist)
    return [[over(x, size) for x in row] for row in R]


def point(rule: Any, p: Vector, R: list[Vector]) -> Vector:  # follows p + R turned + constant
    follows, turned, constant = rule
    need(follows in (True, False), "a vector that follows the pose, or does not")
    turned = vector(turned)
    found = add([dot(row, turned) for row in R], vector(constant))
    return add(found, p) if follows else found


def plainly(text: Any) -> Interval:  # a number of a leg
    return interval(number(text))


def crank(leg: Any, D: Vector, side: Interval) -> Vector:
    """B on a circle about ``axis``, |D - B| = rod: D' B = (|D|^2 + radius^2 - rod^2) / 2 with D' normal to the axis."""
    axis, radius, rod = vector(leg["axis"]), plainly(leg["radius"]), plainly(leg["rod"])
    flat = sub(D, scaled(over(dot(D, axis), norm2(axis)), axis))
    far = norm2(flat)
    share = times(minus(plus(norm2(D), square(radius)), square(rod)), interval(Fraction(1, 2)))
    margin = root(minus(times(square(radius), far), square(share)))
    spoke = add(scaled(share, flat), scaled(times(margin, side), cross(unit(axis), flat)))
    return [over(x, far) for x in spoke]


def rail(leg: Any, D: Vector, side: Interval) -> Vector:
    """B along ``axis``, |D - B| = rod."""
    axis, rod = unit(vector(leg["axis"])), plainly(leg["rod"])
    along = dot(D, axis)
    margin = root(minus(square(rod), norm2(sub(D, scaled(along, axis)))))
    return scaled(plus(along, times(side, margin)), axis)


def slide(leg: Any, D: Vector, side: Interval) -> Vector:
    """The direction of a rod through D, at the distance ``aside`` from the base point on the side of axis x u."""
    if leg["axis"] is None:
        return scaled(side, unit(D))
    axis, aside = unit(vector(leg["axis"])), plainly(leg["aside"])
    flat = sub(D, scaled(dot(D, axis), axis))
    far = norm2(flat)
    drawn = times(side, root(minus(far, square(aside))))
    return [over(x, far) for x in sub(scaled(drawn, flat), scaled(aside, cross(axis, flat)))]


LEGS: dict[str, Any] = {"crank": (crank, True), "rail": (rail, True), "slide": (slide, False)}


def carried(leg: Any, mode: Any, p: Vector, R: list[Vector]) -> Vector:  # what a leg carries at poses
    solve, placed = LEGS[leg["kind"]]
    need(type(mode) is int and mode in (1, -1), "a working mode")
    centre = vector(leg["centre"])
    found = solve(leg, sub(point(leg["tip"], p, R), centre), (mode * ONE,) * 2)
    return add(centre, found) if placed else found


def valued(each: Any, p: Vector, R: list[Vector], legs: list[Vector]) -> Vector:
    """A vector: by a rule, a leg's, or the unit vector from one to another, turned about a third."""
    kind, *rest = each
    if kind == "point":
        return point(rest, p, R)
    if kind == "leg":
        k, sense, offset = rest
        need(type(sense) is int and sense in (1, -1) and k in range(len(legs)), "a leg that does not exist")
        return add(scaled((sense * ONE,) * 2, legs[k]), vector(offset))
    need(kind == "unit" and len(rest) == 3, "a vector of another kind")
    start, end, axis = rest
    along = sub(valued(end, p, R, legs), valued(start, p, R, legs))
    return unit(along if axis is None else cross(valued(axis, p, R, legs), along))


def evaluated(tree: Any, values: Any) -> Any:  # an expression: a number, a symbol, or an operation and its operands
    if isinstance(tree, str):
        return values[tree] if tree in values else plainly(tree)
    name, *parts = tree
    found: list[Any] = [evaluated(each, values) for each in parts]
    if name in ("dot", "cross", "det"):
        return dot(*found) if name == "dot" else cross(*found) if name == "cross" else dot(found[0], cross(*found[1:]))
    need(name in ("+", "*") and found, "an operation of another name")
    result, *others = sorted(found, key=lambda each: isinstance(each, tuple))
    for each in others:
        need(name == "+" or isinstance(each, tuple), "a product of vectors")
        if name == "*":
            result = scaled(each, result) if isinstance(result, list) else times(each, result)
        else:
            result = add(result, each) if isinstance(result, list) else plus(result, each)
    return result


def condition(record: Any, modes: Any, p: Vector, q: Vector) -> Interval:  # its value at all poses in boxes
    R = rotation(q)
    held = [carried(leg, mode, p, R) for leg, mode in zip(record["legs"], modes, strict=True)]
    values = {symbol: valued(each, p, R, held) for symbol, each in record["vectors"].items()}
    values |= {symbol: sub(values[symbol], values[record["points"][0]]) for symbol in record["points"]}
    found = evaluated(record["condition"], values)
    need(isinstance(found, tuple), "a condition that is not a number")
    return found


def sign(found: Interval) -> int:
    need(found[0] * found[1] > 0, "the condition may be zero")
    return 1 if found[0] > 0 else -1


def node(record: Any, motion: Any) -> list[list[Fraction]]:  # a pose in the platform's coordinates
    need(isinstance(record, list) and len(record) == 2, "a pose of another form")
    need(len(record[0]) == len(motion["along"]), "a shift that the platform does not have")
    need(len(record[1]) == len(motion["about"]) + 1, "a turn that the platform does not have")
    return [[number(x) for x in part] for part in record]


def combined(factors: list[Interval], vectors: Any) -> Vector:  # the sum of factors times vectors
    found: Vector = [(0, 0)] * 3
    for factor, each in zip(factors, vectors, strict=True):
        found = add(found, scaled(factor, vector(each)))
    return found


def place(motion: Any, one: Any, other: Any) -> tuple[Vector, Vector]:  # p and q between two poses
    shift, (w, *turn) = ([interval(x, y) for x, y in zip(*ends, strict=True)] for ends in zip(one, other, strict=True))
    p = add(vector(motion["origin"]), combined(shift, motion["along"]))
    v = combined(turn, motion["about"])
    W, *V = (interval(number(x)) for x in motion["home"])
    return p, [minus(times(w, W), dot(v, V)), *add(add(scaled(w, V), scaled(W, v)), cross(v, V))]


def path(record: Any) -> str:
    need("motion" in record, "the motions of the platform are missing")
    motion, modes = record["motion"], record["modes"]
    nodes = [node(each, motion) for each in record["path"]]
    need(record["verdict"] in ("same aspect", "separated") and len(nodes) > 1, "another verdict, or too few poses")
    need(record["ends"] == [record["path"][0], record["path"][-1]], "the ends of another path")
    of = f"(platform: translations {len(motion['along'])}, rotations {len(motion['about'])})"
    if record["verdict"] == "separated":
        need(len(nodes) == 2 and len({tuple(each) for each in modes[1:]}) == len(modes) - 1 > 0, "two poses, and modes")
        first, *last = (
            sign(condition(record, each, *place(motion, nodes[k > 0], nodes[k > 0]))) for k, each in enumerate(modes)
        )
        need(first not in last, "the condition has one sign at both poses")
        return (
            f"separated: the condition has opposite signs at two poses, at the second one in {len(last)} of "
            f"{2 ** len(record['legs'])} working modes {of}"
        )
    need(len(modes) == 1, "one set of working modes")
    signs = {sign(condition(record, modes[0], *place(motion, *piece))) for piece in pairwise(nodes)}
    need(len(signs) == 1, "the condition changes its sign")
    return f"same aspect: on {len(nodes) - 1} pieces of a path all legs reach and the condition is nowhere zero {of}"


def digest(record: Any) -> str:
    rest = {key: each for key, each in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def once(pairs: Any) -> Any:  # an object of JSON; of two keys a reader may see one, Python the other
    need(len(dict(pairs)) == len(pairs), "a duplicate key")
    return dict(pairs)


def verify(record: Any) -> str:  # what a certificate proves, in words; raises PathRejection
    try:
        need(isinstance(record, dict) and record.get("format") == "hrsynth-certificate-1", "this is no certificate")
        need(
            record["claim"] == "path",
            "it is for another claim: verify_certificate.py, verify_solutions.py and verify_ranks.py check those",
        )
        need(record["sha256"] == digest(record), "the file was changed: its digest differs")
        return path(record)
    except Exception as error:
        raise error if isinstance(error, PathRejection) else PathRejection(f"no certificate: {error!r}") from None


def main(name: str) -> int:  # prints the answer
    try:
        with open(name, encoding="utf-8") as file:
            need(
                len(text := file.read(PATH_CERTIFICATE_MAX_BYTES + 1)) <= PATH_CERTIFICATE_MAX_BYTES,
                f"a file of more than {PATH_CERTIFICATE_MAX_BYTES} characters",
            )
        print("accepted:", verify(json.loads(text, object_pairs_hook=once)))
        return 0
    except (PathRejection, OSError, ValueError, RecursionError) as error:
        print("refused:", error)
        return 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else print("usage: python verify_path.py FILE") or 2)
