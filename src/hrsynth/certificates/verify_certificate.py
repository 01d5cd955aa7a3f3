"""Check a certificate of all poses of platforms: `python verify_certificate.py c.json`. Integers and fractions only.

* At least: Krawczyk. Each solution has a complex box |x_k - m_k| <= r. With any matrix Y, the derivatives J at m and
  H what they change by in the box, |Y F(m)| + (|1 - Y J| + |Y| H) r < r makes x - Y F(x) a contraction of the box: it
  holds one solution and no other. Where m is real the box is its own conjugate, and so is the solution.
* At most, *rank*: columns are monomials, B below the caps, S at and H above them; rows multiples of the equations.
  Where they annul f independent vectors on H (zeros at infinity), rank H <= |H| - f. If the rank of H and S is no less
  than |H| - f + |S|, B spans all modulo the equations: |B| + |S| + |H| - f - rank zeros; modulo a prime ranks are no
  larger. The tangent of half an angle has its own cap, no H: a pose where it is infinite would be such a vector on S.
* At most, *poses*: conditions *on a sphere*, *on a plane* on points of a rigid body are linear in 17 coordinates in
  which poses have dimension 6 and degree 40 (Gallet, Nawratil, Schicho, J. Geom. 106, 2015): of six at most 40 zeros,
  at infinity too, and no curve besides 40. A fixed tip, or six planes, leave three quadrics: 8; rods in a ball: 16.
* A real pose puts each tip where its box does, to the given distance. With more legs, or loops, than needed, others
  miss one, poses fit to 1e-9. Systems (leg solutions) are counted one by one. The robot *closes* where poses of its
  links are given: its joints fit, tips are in place, and measured values are those given once for all poses.
"""

import hashlib
import json
import math
import sys
from fractions import Fraction
from itertools import combinations, product

PRIME, FIT, WITHIN, FAR, TERMS, LENGTH = 2147483647, Fraction(1, 10**9), Fraction(1, 10**6), 10**7, 20_000, 5_000_000


class CertificateRejection(Exception):
    """Certificate that is not accepted: the reason."""


def need(true, why):
    if not true:
        raise CertificateRejection(why)


def add(*terms):  # a sum of polynomials {exponents: coefficient}
    total = {}
    for p in terms:
        for e, c in p.items():
            total[e] = total.get(e, 0) + c
    return {e: c for e, c in total.items() if c}


def mul(p, q):
    return need(len(p) * len(q) <= TERMS, f"more than {TERMS} terms") or add(
        *({tuple(map(sum, zip(e, f))): c * d for f, d in q.items()} for e, c in p.items())
    )


def times(c, p):
    return {e: c * d for e, d in p.items() if c * d}


def minus(p, q):
    return add(p, times(-1, q))


def term(c, n, k=None):
    return {tuple(int(i == k) for i in range(n)): Fraction(c)} if c else {}  # c, or c x_k


def inner(u, v):
    return add(*(mul(a, b) for a, b in zip(u, v)))


def dot(u, v):
    return sum((a * b for a, b in zip(u, v, strict=True)), Fraction(0))


def sub(u, v):
    return [a - b for a, b in zip(u, v, strict=True)]


def size(z):
    return abs(z[0]) + abs(z[1])  # at least |z|, at most twice that


def formal(p, w):
    return dict.fromkeys(w, Fraction(0)) | p  # p times w: w has its degree in half-angle tangents


def slope(p, k):
    return {(*e[:k], e[k] - 1, *e[k + 1 :]): c * e[k] for e, c in p.items() if e[k]}


def integral(p):  # with integer coefficients that have no common divisor
    need(any(p.values()), "an equation vanishes")
    common = Fraction(math.gcd(*(c.numerator for c in p.values())), math.lcm(*(c.denominator for c in p.values())))
    return {e: int(c / common) for e, c in p.items()}


def cross(u, v, mul=lambda a, b: a * b, minus=lambda a, b: a - b):
    return [minus(mul(u[i], v[j]), mul(u[j], v[i])) for i, j in ((1, 2), (2, 0), (0, 1))]


def rational(x):
    short = isinstance(x, str) and len(x) < 300 and not set(x) - set("0123456789/.-")
    need(short or isinstance(x, list), "a number in words")
    return Fraction(x) if short else list(map(rational, x))


def reach_of(record):  # a kind, its centre; direction, normal, spokes of a circle, squared radius
    ((kind, values),) = record.items()
    lengths = {"point": [3], "line": [3] * 2, "circle": [3] * 3, "plane": [3] * 2, "sphere": [3, 1]}
    _, *rest = vectors = rational(values)
    need(kind in lengths and [len(v) for v in vectors] == lengths[kind], f"{kind!r} is not a curve or surface")
    need(kind != "circle" or dot(*rest) == 0 == dot(rest[0], rest[0]) - dot(rest[1], rest[1]), "the spokes of a circle")
    need(kind == "point" or (any(rest[0]) and (kind != "sphere" or rest[0][0] > 0)), f"a {kind} without extent")
    return kind, vectors


def running(reach, k, n):  # N / w, a curve's point, Q / w its square, at x_k: t of c + t d, or a half-angle tangent
    kind, (c, *rest) = reach
    one, t = term(1, n), term(1, n, k)
    if kind == "circle":
        (a, b), tt = rest, mul(t, t)
        w, u = add(one, tt), minus(one, tt)
        N = [add(times(x, w), times(y, u), times(2 * z, t)) for x, y, z in zip(c, a, b)]
        return N, add(times(dot(c, c) + dot(a, a), w), times(2 * dot(c, a), u), times(4 * dot(c, b), t)), w
    N = [add(term(x, n), times(d, t)) for x, d in zip(c, rest[0] if rest else [0] * len(c))]
    return N, inner(N, N), one


def apart(one, other, squared):  # |P1 - P2|^2 = squared
    (N, Q, w), (M, P, v) = one, other
    return formal(add(mul(Q, v), mul(P, w), times(-2, inner(N, M)), times(-squared, mul(w, v))), mul(w, v))


def conditions(point, reach):  # planes and spheres that a point is on: (equation, normal or squared radius)
    (N, Q, w), (kind, (c, *rest)) = point, reach
    axes = [[Fraction(int(i == k)) for i in range(3)] for k in range(3)]
    if kind == "sphere":
        return [(add(Q, *(times(-2 * x, p) for x, p in zip(c, N)), times(dot(c, c) - rest[0][0], w)), rest[0])]
    if kind == "circle":
        return conditions(point, ("plane", [c, cross(*rest)])) + conditions(
            point, ("sphere", [c, [dot(*rest[:1] * 2)]])
        )
    if kind == "line":
        rest = [first := cross(rest[0], min(axes, key=lambda axis: abs(dot(rest[0], axis)))), cross(rest[0], first)]
    return [(add(*map(times, n, N), times(-dot(n, c), w)), n) for n in rest or axes]


def misfits(equations):  # by how much lengths miss: over a plane's normal, over the squared radius of small spheres
    return [times(1 / (max(map(abs, n)) if len(n) > 1 else min(n[0], Fraction(1))), p) for p, n in equations]


def spatial(system, tips):
    """Three tips of a rigid body on curves, their distances; others are b1 + i u + j v + k u x v, u, v between tips."""
    reaches = [reach_of(each) for each in system["reaches"]]
    u, v = sub(tips[1], tips[0]), sub(tips[2], tips[0])
    up = cross(u, v)
    need(
        system["square"] == 3 <= len(tips) == len(reaches)
        and any(up)
        and {kind for kind, _ in reaches[:3]} <= {"point", "line", "circle"},
        "three tips that are not on one line; tips on surfaces need another kind",
    )
    moving = [k for k in range(3) if reaches[k][0] != "point"]  # the tips with an unknown, a half-angle tangent or not
    points = [running(reaches[k], moving.index(k) if k in moving else None, len(moving)) for k in range(3)]
    legs, halves = [], [reaches[k][0] == "circle" for k in moving]
    found = [apart(points[i], points[j], dot(w, w)) for i, j, w in ((0, 1, u), (1, 2, sub(v, u)), (2, 0, v))]
    (N, _, w), (M, _, x), (L, _, y) = points
    U, V = ([minus(mul(b, w), mul(a, z)) for a, b in zip(N, other)] for other, z in ((M, x), (L, y)))
    W, wxy = cross(U, V, mul, minus), mul(mul(w, w), mul(x, y))
    for b, reach in zip((sub(tip, tips[0]) for tip in tips[3:]), reaches[3:]):
        i, j, k = (dot(b, each) / dot(up, up) for each in (cross(v, up), cross(up, u), up))
        P = [
            add(mul(a, mul(w, mul(x, y))), times(i, mul(c, mul(w, y))), times(j, mul(d, mul(w, x))), times(k, e))
            for a, c, d, e in zip(N, U, V, W)
        ]
        legs.append(misfits(conditions(([mul(p, wxy) for p in P], inner(P, P), mul(wxy, wxy)), reach)))
    return found, halves, points, legs


def shifting(system, tips):
    """Bodies that translate: x, y, z of the first, the second on ``slide`` about it. Of spheres, and of
    parallel planes, all but the first are replaced by their difference from it."""
    slide = reach_of(system["slide"]) if "slide" in system else None
    bodies, n = system["bodies"], 4 if slide else 3
    need(set(bodies) <= ({0, 1} if slide and slide[0] in ("circle", "line") else {0}), "the bodies of the tips")
    S, SS, v = running(slide, 3, n) if slide else ([], {}, {})
    one, points, found, kept, all_ = term(1, n), [], [], [], []
    for b, body, reach in zip(tips, bodies, map(reach_of, system["reaches"]), strict=True):
        p, w = [add(term(1, n, k), term(b[k], n)) for k in range(3)], v if body else one
        N = [add(mul(x, w), S[k] if body else {}) for k, x in enumerate(p)]
        points.append((N, add(mul(inner(p, p), w), *((times(2, inner(p, S)), SS) if body else ())), w))
        all_.append(misfits(conditions(points[-1], reach)))
        for equation, normal in conditions(points[-1], reach) if len(points) <= system["square"] else ():
            first, n1, w1, other = next(
                (
                    each
                    for each in kept
                    if len(normal) == len(each[1]) and (len(normal) == 1 or not any(cross(normal, each[1])))
                ),
                ({}, normal, one, 2),
            )
            kept = [(equation, normal, w, body)] * (other != body) + kept  # the last body first
            mine, its = (one, one) if w == w1 else (w1, w)
            ratio = dot(normal, n1) / dot(n1, n1) if len(n1) > 1 else 1
            found.append(formal(minus(mul(equation, mine), times(ratio, mul(first, its))), mul(w, mine)))
    return found, [False] * 3 + [slide[0] == "circle" for _ in range(3, n)], points, all_[system["square"] :]


def turned(u, v):  # the product of quaternions
    rest = zip(u[1:], v[1:], cross(u[1:], v[1:], mul, minus))
    return [minus(mul(u[0], v[0]), inner(u[1:], v[1:])), *(add(mul(u[0], y), mul(v[0], x), z) for x, y, z in rest)]


def placed(e, g, b, kappa):  # |e|^2 R b; |e|^2 tip = that + 2 vec(g e*), its square over |e|^2, and |e|^2
    back, w, gg = [e[0], *(times(-1, p) for p in e[1:])], inner(e, e), minus(inner(g, g), kappa)
    arrow = turned(turned(e, [{}, *({tuple(0 * k for k in next(iter(w))): c} for c in b)]), back)[1:]
    Q = add(times(4, gg), *(times(4 * c, p) for c, p in zip(b, turned(back, g)[1:])), times(dot(b, b), w))
    return arrow, ([add(p, times(2, q)) for p, q in zip(arrow, turned(g, back)[1:])], Q, w)


def pose(system, tips):
    """Study's coordinates: a quaternion e = E (1, x1, x2, x3), g = E (0, x5, x6, x7), |e|^2 x4 = (e.g)^2. The last
    ``arrows`` of the tips only turn, about ``hub``."""
    n, E, arrows = 7, [[int(c) for c in row] for row in system["chart"]], system["arrows"]
    x, hub = [term(1, n), *(term(1, n, k) for k in range(n))], rational(system["hub"])
    e, g = [add(*map(times, row, x)) for row in E], [add(*map(times, row, ({}, *x[5:]))) for row in E]
    need(
        [*map(len, E)] == [4] * 4
        and modular([[c % PRIME for c in row] for row in E], 4)[1] == 4 == len(hub) + 1
        and arrows in range(len(tips)),
        "a chart with dependent rows, no hub, or tips that are all arrows",
    )
    w, points, found = inner(e, e), [], [minus(mul(x[4], inner(e, e)), mul(inner(e, g), inner(e, g)))]
    for k, (b, reach) in enumerate(zip(tips, map(reach_of, system["reaches"]), strict=True)):
        arrow, point = placed(e, g, b, x[4])
        need(k < len(tips) - arrows or reach[0] == "plane", "an arrow keeps to a plane")
        points.append(point if k < len(tips) - arrows else ([add(p, times(c, w)) for p, c in zip(arrow, hub)], {}, w))
        found += [equation for equation, _ in conditions(points[-1], reach)]
    return found, [False] * n, points, []


KINDS = {
    "spatial": (spatial, "square"),
    "shifting": (shifting, "square bodies slide"),
    "pose": (pose, "chart arrows hub"),
}


def whole(x):  # complex numbers, pairs of fractions, as integers, and what they are over
    q = math.lcm(*(u.denominator for z in x for u in z))
    return [[u.numerator * (q // u.denominator) for u in z] for z in x], q


def value(p, x):  # at complex numbers, pairs of fractions
    (z, q), d, total = whole(x), max(map(sum, p), default=0), [0, 0]
    below = math.lcm(*(c.denominator for c in p.values()))
    for e, c in p.items():
        a, b = c.numerator * (below // c.denominator) * q ** (d - sum(e)), 0
        for u, v in (y for y, k in zip(z, e) for _ in range(k)):
            a, b = a * u - b * v, a * v + b * u
        total = [total[0] + a, total[1] + b]
    return [Fraction(t, below * q**d) for t in total]


def most(p, far):
    return sum(abs(c) * math.prod(x**k for x, k in zip(far, e) if k) for e, c in p.items())  # of |p|


def change(p, m, r):  # in a box; distances rounded upwards
    far = [Fraction(1 + int((size(z) + r) * 2**64), 2**64) for z in m]
    return r * sum(most(slope(p, k), far) for k in range(len(m)))


def most_of(p, m, r):
    return size(value(p, m)) + change(p, m, r)


def least(p, m, r):
    return size(value(p, m)) / 2 - change(p, m, r)  # of |p| in the box


def along(y, z):
    (y, q), (z, s) = whole(y), whole(z)
    return [Fraction(sum(x), q * s) for x in zip(*((a * c - b * d, a * d + b * c) for (a, b), (c, d) in zip(y, z)))]


def enclosed(equations, m, r, Y):  # Krawczyk's condition; see above
    n, slopes = len(m), [[slope(p, k) for k in range(len(m))] for p in equations]
    need(r > 0 and len(Y) == n and all(len(row) == n for row in Y), "a box without radius or inverse")
    F, J = [value(p, m) for p in equations], [[value(d, m) for d in row] for row in slopes]
    H = [sum(change(d, m, r) for d in row) for row in slopes]
    for i, y in enumerate(Y):
        wide = sum(size(sub(along(y, [J[k][j] for k in range(n)]), [int(i == j), 0])) for j in range(n))
        wide += sum(size(z) * h for z, h in zip(y, H))
        need(size(along(y, F)) + wide * r < r, "a box in which no solution is proved")


def multiples(equations, halves, groups):  # monomials above, at, below the caps, how many; all multiples within
    need(len(halves) < 5 and sorted(k for group, _, _ in groups for k in group) == [*range(len(halves))], "each once")
    need(
        all(
            group
            and cap in range(1, 13)
            and more in range(13)
            and (not any(halves[k] for k in group) or (len(group) == 1 and more == 0))
            for group, cap, more in groups
        ),
        "caps of 1 to 12, one for each half-angle",
    )
    below = {
        e: min(cap - sum(e[k] for k in group) for group, cap, _ in groups)
        for e in product(range(13), repeat=len(halves))
        if all(sum(e[k] for k in group) <= cap + more for group, cap, more in groups)
    }
    columns = sorted(below, key=lambda e: min(max(below[e], -1), 1))
    need(len(columns) <= 300, "more than 300 monomials")
    moved = [{tuple(map(sum, zip(e, shift))): c for e, c in p.items()} for p in equations for shift in columns]
    rows = [[row.get(e, 0) for e in columns] for row in moved if all(e in below for e in row)]
    return rows, *(sum(below[e] < least for e in columns) for least in (0, 1, 99))


def rank(equations, halves, system, ranks_of=None):
    rows, above, edge, every = multiples(equations, halves, system["bound"]["groups"])
    far = [[int(c, 16) for c in v] for v in system["bound"].get("far", ())]
    need(
        all(len(v) == above and not any(sum(map(int.__mul__, row, v)) for row in rows) for v in far)
        and modular(far, 0)[1] == len(far),
        "vectors above the caps that depend on others, or are not annulled",
    )
    sharp, whole = (ranks_of or modular)(rows, edge)
    need(sharp == edge - len(far), "monomials at the caps are not those of lower ones")
    return every - whole - len(far)


def modular(rows, first):  # the ranks modulo the prime of the first columns and of all: where echelons begin
    echelon = {}
    for row in ([c % PRIME for c in row] for row in rows):
        for k in range(len(row)):
            if row[k] and k not in echelon:
                over = pow(row[k], -1, PRIME)
                echelon[k] = [c * over % PRIME for c in row]
                break
            row = [(a - row[k] * b) % PRIME for a, b in zip(row, echelon[k])] if row[k] else row
    return sum(k < first for k in echelon), len(echelon)


def poses(equations, halves, system):
    need(system["kind"] == "pose" and len(equations) == 7, "six conditions on a pose")
    reaches, tips = [reach_of(each) for each in system["reaches"]], rational(system["tips"])
    kinds = {kind for kind, _ in reaches}
    together = max(each.count(b) for each in (tips, [v[0] for _, v in reaches]) for b in each)
    return 8 if "point" in kinds or kinds <= {"line", "plane"} else 16 if kinds == {"sphere"} and together > 2 else 40


def modes(record):
    seen, proofs, real, complex_, closed, apart = [], [], 0, 0, 0, 0
    for system in record["systems"]:
        far = FAR * fair(system, tips := rational(system["tips"]))
        equations, halves, points, legs = KINDS[system["kind"]][0](system, tips)
        equations = [integral(p) for p in equations]
        need(len(equations) == len(halves), f"{len(equations)} equations in {len(halves)} unknowns")
        need((equations, legs) not in seen, "a system that is given twice")
        boxes, seen = [], [*seen, (equations, legs)]
        flat = [times(Fraction(1, 2 ** max(map(abs, p.values())).bit_length()), p) for p in equations]
        bound = {"rank": rank, "poses": poses}[system["bound"]["kind"]](equations, halves, system)
        need(len(system["boxes"]) == bound, f"{len(system['boxes'])} boxes, but there may be {bound} solutions")
        for each in system["boxes"]:
            m, r = rational(each["middle"]), rational(each["radius"])
            need(len(m) == len(halves) and all(len(z) == 2 for z in m), "a box without its unknowns")
            one = "misses" if "misses" in each else "pose within links"  # the keys of a box, and no other
            need(each.keys() <= {*f"middle radius inverse {one}".split()}, "another key of a box")
            boxes, proofs = [*boxes, (m, r)], [*proofs, (flat, m, r, rational(each["inverse"]))]
            finite = all(least(w, m, r) > 0 for _, _, w in points)
            away = far > 0 and any(least(p, m, r) > far * most_of(w, m, r) for N, _, w in points for p in N)
            if "pose" in each:
                need(all(most_of(p, m, r) < FIT for leg in legs for p in leg), "a leg that misses")
                need(finite and not away and all(v == 0 for _, v in m), "a real pose with a complex or far box")
                told(system, each, points, tips, m, r)
                closed += "links" in each and closes(record["assembly"], each["links"])
            elif "misses" in each:
                need(any(least(p, m, r) > 0 for p in legs[each["misses"]]), "a leg that may not miss")
            elif away:
                need(finite or bound == 40 or system["kind"] != "pose", "a box that may be given twice")
                apart += any(map(any, (value(p, m) for p in equations))) or all(any(value(w, m)) for _, _, w in points)
            else:
                need(any(abs(v) > r for _, v in m), "a box that may be real has no pose")
                need(finite and not legs, "a box that may or may not be a pose")
            real, complex_ = real + ("pose" in each), complex_ + (not away and "misses" not in each)
        for (m, r), (k, s) in combinations(boxes, 2):
            need(any(max(abs(a - c), abs(b - d)) > r + s for (a, b), (c, d) in zip(m, k)), "two boxes touch")
    need(seen and record["real"] == real and record["complex"] == complex_, f"{real} real of {complex_} are proved")
    need(all(enclosed(*each) is None for each in proofs), "boxes without a solution")
    more = " (more than needed fits)" * any(legs for _, legs in seen) + f" ({len(seen)} systems)" * (len(seen) > 1)
    more += f" nearer than 10^7 of its sizes ({apart} solutions are farther)" * (apart > 0)
    more += f"; the robot closes at {closed} of the real ones, to 1e-9" * ("assembly" in record)
    return f"{real} real of {complex_} complex poses, and no other among {name_poses(record)}{more}"


def name_poses(record):  # the poses of which these are all, as the writer names them: not checked
    text = record.get("within", "those of its equations")
    need(isinstance(text, str) and len(text) < 200 and text.isprintable(), "poses without a name")
    return text


def fair(system, tips):  # has its kind's keys; lengths in units of about its size (translation along planes: any)
    need(system.keys() <= {*f"kind reaches tips boxes bound places {KINDS[system['kind']][1]}".split()}, "another key")
    need(len(tips) < 50 and all(len(b) == 3 for b in tips), "tips of another dimension, or too many")
    reaches = [reach_of(each) for each in system["reaches"]]
    radii = [v[1] for kind, v in reaches if kind in ("circle", "sphere")]
    spans = [sub(b, places[0]) for places in (tips, [v[0] for _, v in reaches]) for b in places]
    extent = max(abs(x) for span in radii + spans for x in span)
    need(extent > Fraction(1, 1000) or not reaches or (system["kind"] == "shifting" and not radii), "another unit")
    return extent


def moved(D, x):
    return [dot(row, x) for row in D]  # a point (x, y, z, 1) or direction (x, y, z, 0) of a link


def turn_of(P):  # the rotation of a pose
    turn = [row[:3] for row in P]
    need(
        [*map(len, P)] == [4] * 3
        and dot(cross(*turn[:2]), turn[2]) > 0
        and all(abs(dot(u, v) - (u is v)) < FIT for u in turn for v in turn),
        "no pose",
    )
    return turn


def closes(robot, links):  # its joints fit to 1e-9 with links displaced since zero, and fixed values are those given
    D, off = {name: rational(rows) for name, rows in links.items()}, []
    turns = {name: turn_of(rows) for name, rows in D.items()}
    for kind, one, other, *vectors in robot["joints"]:  # the point, then axes
        x = rational(vectors)
        (p, *u), (q, *v) = ([moved(D[link], y) for y in x] for link in (one, other))
        need(
            len(u) == {"R": 1, "P": 1, "C": 1, "E": 1, "U": 2, "S": 0, "F": 0}[kind]
            and x[0][3] == 1
            and all(y[3] == 0 and dot(y, y) > Fraction(1, 2) for y in x[1:]),
            "a joint of another kind",
        )
        off += sub(p, q) if kind in "RUSF" else [dot(sub(p, q), u[0])] if kind == "E" else cross(sub(p, q), u[0])
        off += (
            sub(u[0], v[0])
            if kind in "RCE"
            else [dot(u[0], v[1]) - dot(*x[1:])]
            if kind == "U"
            else [z for rows in zip(turns[one], turns[other]) for z in sub(*rows)]
            if kind in "PF"
            else []
        )
    for one, other, vector, seen in robot["held"]:  # a direction or point of a link, seen from another
        at = sub(moved(D[one], rational(vector)), [row[3] * rational(vector)[3] for row in D[other]])
        off += sub([dot(column, at) for column in zip(*turns[other])], rational(seen))
    need(robot["held"] and robot["joints"] and all(abs(x) < FIT for x in off), "an open joint, or another measurement")
    return True


def told(system, each, points, tips, m, r):  # whether the pose puts the tips where the box does
    turn, P, within = turn_of(rational(each["pose"])), rational(each["pose"]), rational(each["within"])
    need(within <= WITHIN and (system["kind"] != "shifting" or all(turn[i][i] == 1 for i in range(3))), "another pose")
    arrows, bodies = system.get("arrows", 0), system.get("bodies", [0] * 50)
    for k, (b, (N, _, w), body) in enumerate(zip(tips, points, bodies)):
        start = rational(system["hub"]) if k >= len(tips) - arrows else [row[3] for row in P]
        at = [value(p, m)[0] / value(w, m)[0] for p in N]
        off = max(change(minus(p, times(x, w)), m, r) / least(w, m, r) for p, x in zip(N, at))
        need(
            body or all(abs(x - start[i] - dot(turn[i], b)) + off <= within for i, x in enumerate(at)),
            "a tip that is not where its box is",
        )
        if "links" in each:
            (origin, *rows, (unit,)), (link, x) = rational(system["places"]["frame"]), system["places"]["tips"][k]
            there = sub(moved(rational(each["links"][link]), rational(x)), [int(x[3]) * c for c in origin])
            need(
                x[3] in ("0", "1")
                and all(abs(dot(u, v) - (u is v)) < FIT for u in rows for v in rows)
                and all(
                    abs(v - dot(row, there) / unit - (x[3] == "0") * c) + off <= WITHIN
                    for v, row, c in zip(at, rows, start, strict=True)
                ),
                "a tip that is not on its link",
            )


def digest(record):
    return hashlib.sha256(
        json.dumps(
            {key: each for key, each in record.items() if key != "sha256"}, sort_keys=True, separators=(",", ":")
        ).encode()
    ).hexdigest()


def once(pairs):
    return need(len(dict(pairs)) == len(pairs), "a duplicate key") or dict(pairs)  # of JSON: read as one


def verify(record):  # what a certificate proves, in words; raises CertificateRejection
    try:
        need(isinstance(record, dict) and record.get("format") == "hrsynth-certificate-1", "this is no certificate")
        need(record["sha256"] == digest(record), "the file was changed: its digest differs")
        need(
            record["claim"] == "modes",
            "it is for another claim: verify_solutions.py, verify_path.py and verify_ranks.py check those",
        )
        return modes(record)
    except Exception as error:
        raise (
            error if isinstance(error, CertificateRejection) else CertificateRejection(f"no certificate: {error!r}")
        ) from None


def main(name):  # prints the answer
    try:
        with open(name, encoding="utf-8") as file:
            need(len(text := file.read(LENGTH + 1)) <= LENGTH, f"a file of more than {LENGTH} characters")
        print("accepted:", verify(json.loads(text, object_pairs_hook=once)))
    except (CertificateRejection, OSError, ValueError, RecursionError) as error:
        return print("refused:", error) or 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else print("usage: python verify_certificate.py FILE") or 2)
