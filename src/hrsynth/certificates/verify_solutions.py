"""Check a certificate of all real solutions of a robot's equations: `python verify_solutions.py c.json`.

Fractions only. The unknowns x are points of links and images of directions that their joints use. Equations have degree
two at most, and a bound of their error.

* Rounds: sums of equations that are an unknown, plus others, plus a small remainder. The unknown is replaced by the
  others; what is neglected is bounded by the sums' errors and the remainder, within the bounds of the unknowns.
* Cases: a sum of equations, a y^2 + b y + c but for a small remainder, in one unknown. Its values at the ends of the
  given intervals show that no y outside of them is a solution.
* Algebra: with a list b of monomials, 1 first, sums of multiples of the equations show that y_i b_j = C b, but for
  a bound. M, that of a random sum r of the unknowns, has eigenvectors V: with W about their inverse, c = W b is nearly
  zero but where its eigenvalue is near r. So a real solution is near what one eigenvector gives.
* Each box that is left is near one of the listed poses, or an equation is nowhere zero in it.

Trusted: that the equations, their errors and the bounds of the unknowns are those of a robot (`hrsynth verify --robot`
compares them with its file).
"""

import hashlib
import json
import sys
from fractions import Fraction

UNIT = 1 << 64  # to whose parts intermediate results are rounded
LENGTH, UNKNOWNS, FIT = 5_000_000, 300, Fraction(1, 10**9)


class SolutionsRejection(Exception):
    """Certificate that is not accepted: the reason."""


def require(true, why):
    if not true:
        raise SolutionsRejection(why)


def read_number(value):
    require(isinstance(value, str) and len(value) < 700 and not set(value) - set("0123456789/-"), "a number in words")
    return Fraction(value)


def read_numbers(values):
    return [read_number(value) for value in values]


def round_fraction(value, up=False):
    """Return a fraction as whole numbers of 2**-64, to the nearest or upwards."""
    scaled = value * UNIT
    return Fraction(-((-scaled.numerator) // scaled.denominator) if up else round(scaled), UNIT)


def read_quadratic(terms, n):
    """Read an equation: {(i, j): coefficient} of x_i x_j, x_0 = 1."""
    result = {}
    for i, j, c in terms:
        require(
            type(i) is int and type(j) is int and 0 <= i <= j <= n and (i, j) not in result, "a term twice, or unknown"
        )
        result[i, j] = read_number(c)
    return result


def read_exponents(exponents, m):
    """Read a monomial: only whole powers that are not negative are bounded by those of the unknowns' bounds."""
    require(len(exponents) == m and all(type(k) is int and k >= 0 for k in exponents), "no monomial")
    return tuple(exponents)


def add_polynomials(weights, polynomials):
    """Return the sum of weights (number of the polynomial, weight) times polynomials."""
    result = {}
    for k, w in weights:
        require(type(k) is int and 0 <= k < len(polynomials), "an equation that there is not")
        for term, c in polynomials[k].items():
            result[term] = result.get(term, 0) + read_number(w) * c
    return result


def weigh_errors(weights, errors):
    return sum((abs(read_number(w)) * errors[k] for k, w in weights), Fraction(0))


def bound_polynomial(polynomial, reach):
    """Return a bound of a quadratic polynomial for unknowns within their reach."""
    return sum((abs(c) * reach[i] * reach[j] for (i, j), c in polynomial.items()), Fraction(0))


def substitute(equation, T):
    """Return an equation with x_i = sum_a T[i][a] y_a."""
    result = {}
    for (i, j), c in equation.items():
        for a, s in T[i].items():
            for b, t in T[j].items():
                term = (a, b) if a <= b else (b, a)
                result[term] = result.get(term, 0) + c * s * t
    return result


class Elimination:
    """Equations in unknowns of which some were replaced: x is within slack of T y."""

    def __init__(self, equations, errors, reach):
        self.equations, self.errors, self.bounds = equations, errors, reach
        self.T = [{i: Fraction(1)} for i in range(len(reach))]
        self.slack, self.reach = [Fraction(0)] * len(reach), list(reach)

    def build_table(self):
        """Return the equations in y, with bounds of their values at solutions."""
        missed = []
        for equation, error in zip(self.equations, self.errors, strict=True):
            for (i, j), c in equation.items():
                s, t, x, y = self.slack[i], self.slack[j], self.bounds[i], self.bounds[j]
                error += abs(c) * (s * y + x * t + s * t)
            missed.append(error)
        table, smaller = [substitute(equation, self.T) for equation in self.equations], []
        for k, whole in enumerate(table):
            smaller.append({term: round_fraction(c) for term, c in whole.items()})
            remaining = bound_polynomial({term: c - smaller[k][term] for term, c in whole.items()}, self.reach)
            missed[k] = round_fraction(missed[k] + remaining, up=True)
        return smaller, missed

    def eliminate(self, outs):
        """Replace unknowns; ``outs``: {number: weights}."""
        table, missed = self.build_table()
        shift, remainders = {}, {}
        for k, weights in outs.items():
            require(0 < k < len(self.reach), "an unknown that there is not")
            row = add_polynomials(weights, table)
            shift[k] = {
                a: -round_fraction(row.get((0, a), Fraction(0))) for a in range(len(self.reach)) if a not in outs
            }
            remainder = dict(row)
            remainder[0, k] = remainder.get((0, k), Fraction(0)) - 1
            for a, c in shift[k].items():
                remainder[0, a] = remainder.get((0, a), Fraction(0)) + c
            remainders[k] = bound_polynomial(remainder, self.reach)
        names = {a: k for k, a in enumerate(a for a in range(len(self.reach)) if a not in outs)}
        reach = [self.reach[a] for a in names]
        for i, row in enumerate(self.T):
            used, new, off = {}, {a: c for a, c in row.items() if a not in outs}, Fraction(0)
            for k in row.keys() & outs.keys():
                off += abs(row[k]) * remainders[k]
                for e, w in outs[k]:
                    used[e] = used.get(e, 0) + row[k] * read_number(w)
                for a, c in shift[k].items():
                    new[a] = new.get(a, 0) + row[k] * c
            off += sum(abs(w) * missed[e] for e, w in used.items())
            self.T[i] = {names[a]: round_fraction(c) for a, c in new.items() if c}
            off += sum(abs(c - self.T[i][names[a]]) * self.reach[a] for a, c in new.items() if c)
            self.slack[i] = round_fraction(self.slack[i] + off, up=True)
        self.reach = reach


def solve(node, equations, errors, reach):
    """Return boxes (middle, radius) of all real solutions x, x_0 = 1 first."""
    require(len(reach) <= UNKNOWNS, "too many unknowns")
    stage = Elimination(equations, errors, reach)
    for outs in node["rounds"]:
        stage.eliminate({k: weights for k, weights in outs})
    table, missed = stage.build_table()
    m, kind = len(stage.reach), node["kind"]
    if kind == "none":
        row = add_polynomials(node["weights"], table)
        constant = abs(row.pop((0, 0), Fraction(0)))
        require(
            constant > bound_polynomial(row, stage.reach) + weigh_errors(node["weights"], missed),
            "a case that may have solutions",
        )
        return []
    require(kind in ("one", "cases", "algebra"), "a step of another kind")
    require(kind != "one" or m == 1, "unknowns that are left")
    result = [([Fraction(1)], [Fraction(0)])]
    if kind == "cases":
        result = solve_cases(node, table, missed, stage.reach)
    elif kind == "algebra":
        result = solve_algebra(node, table, missed, stage.reach)
    return [
        (
            [sum(c * y[a] for a, c in row.items()) for row in stage.T],
            [s + sum(abs(c) * r[a] for a, c in row.items()) for row, s in zip(stage.T, stage.slack, strict=True)],
        )
        for y, r in result
    ]


def solve_cases(node, table, missed, reach):
    """Return the boxes of all cases of an unknown."""
    k, row = node["unknown"], add_polynomials(node["weights"], table)
    require(0 < k < len(reach), "an unknown that there is not")
    c, b, a = (row.pop(term, Fraction(0)) for term in ((0, 0), (0, k), (k, k)))
    off = bound_polynomial(row, reach) + weigh_errors(node["weights"], missed)
    sign = 1 if a > 0 else -1
    require(a != 0, "no square")

    def evaluate(y):
        return sign * (a * y * y + b * y + c)

    ends = [read_numbers(step["interval"]) for step in node["cases"]]
    if not ends:
        require(evaluate(-b / (2 * a)) > off, "a case that may have solutions")
    elif len(ends) == 1:
        require(
            ends[0][0] < -b / (2 * a) < ends[0][1] and min(map(evaluate, ends[0])) > off,
            "solutions outside of the cases",
        )
    else:
        (low, low_end), (high_start, high) = ends
        require(len(ends) == 2 and low < low_end < high_start < high, "intervals that are not in order")
        require(
            min(evaluate(low), evaluate(high)) > off and max(evaluate(low_end), evaluate(high_start)) < -off,
            "solutions outside of the cases",
        )
    boxes = []
    for (low, high), step in zip(ends, node["cases"], strict=True):
        fixed = {(0, 0): -(low + high) / 2, (0, k): Fraction(1)}
        boxes += solve(step["node"], [*table, fixed], [*missed, (high - low) / 2], reach)
    return boxes


def solve_algebra(node, table, missed, reach):
    """Return a box for each eigenvalue that may be real."""
    m = len(reach) - 1
    basis = [read_exponents(e, m) for e in node["basis"]]
    K = len(basis)
    require(basis[0] == (0,) * m, "no list of monomials that begins with 1")

    def measure_size(e):
        result = Fraction(1)
        for x, k in zip(reach[1:], e, strict=True):
            result *= x**k
        return result

    def raise_exponent(e, i):
        return tuple(k + (j == i) for j, k in enumerate(e))

    equations = [{raise_exponent(raise_exponent((0,) * m, i - 1), j - 1): c for (i, j), c in p.items()} for p in table]
    targets = [raise_exponent(b, i) for i in range(m) for b in basis] + [raise_exponent((0,) * m, i) for i in range(m)]
    C, off = [read_numbers(row) for row in node["C"]], []
    require(
        len(C) == len(targets) == len(node["multiples"]) and all(len(row) == K for row in C), "a table of another size"
    )
    for target, row, multiples in zip(targets, C, node["multiples"], strict=True):
        remaining, error = {target: Fraction(-1)}, Fraction(0)
        for b, c in zip(basis, row, strict=True):
            remaining[b] = remaining.get(b, 0) + c
        for k, e, w in multiples:
            require(type(k) is int and 0 <= k < len(equations), "a multiple of no equation")
            w, e = read_number(w), read_exponents(e, m)
            error += abs(w) * missed[k] * measure_size(e)
            for term, c in equations[k].items():
                product = tuple(x + y for x, y in zip(e, term, strict=True))
                remaining[product] = remaining.get(product, 0) + w * c
        off.append(error + sum(abs(c) * measure_size(e) for e, c in remaining.items()))
    sizes, r = [measure_size(e) for e in basis], read_numbers(node["sum"])
    require(len(r) == m, "a sum of other unknowns")
    M = [[sum(r[i] * C[i * K + j][k] for i in range(m)) for k in range(K)] for j in range(K)]
    within = [sum(abs(r[i]) * off[i * K + j] for i in range(m)) for j in range(K)]
    V, W = ([[tuple(read_numbers(z)) for z in row] for row in node[name]] for name in ("V", "W"))
    roots = [tuple(read_numbers(z)) for z in node["eigenvalues"]]
    require(
        all(len(X) == K and all(len(row) == K for row in X) for X in (V, W)) and len(roots) == K, "no square matrix"
    )

    def multiply(x, y):
        return x[0] * y[0] - x[1] * y[1], x[0] * y[1] + x[1] * y[0]

    def bound_modulus(z):
        return abs(z[0]) + abs(z[1])

    def bound_modulus_below(z):
        return max(abs(z[0]), abs(z[1]))

    def add_complex(terms):
        terms = list(terms)
        return sum(z[0] for z in terms), sum(z[1] for z in terms)

    eta, lost = [], []
    for k in range(K):
        misses = (
            bound_modulus(
                add_complex(
                    [
                        *(multiply(W[k][i], (M[i][j], 0)) for i in range(K)),
                        multiply((-1, 0), multiply(roots[k], W[k][j])),
                    ]
                )
            )
            for j in range(K)
        )
        eta.append(
            sum(bound_modulus(W[k][j]) * within[j] for j in range(K))
            + sum(x * s for x, s in zip(misses, sizes, strict=True))
        )
        lost.append(
            sum(
                bound_modulus(
                    add_complex(
                        [(Fraction(k == j), 0), *(multiply((-1, 0), multiply(V[k][i], W[i][j])) for i in range(K))]
                    )
                )
                * sizes[j]
                for j in range(K)
            )
        )
    require(lost[0] < Fraction(1, 2), "eigenvectors that are nearly dependent")
    rho = [K * bound_modulus(V[0][k]) * eta[k] / (1 - lost[0]) for k in range(K)]
    result = []
    for k in range(K):
        if abs(roots[k][1]) > rho[k]:
            continue
        first, small = V[0][k], []
        for j in range(K):
            gap = bound_modulus_below((roots[j][0] - roots[k][0], roots[j][1] - roots[k][1])) - rho[k]
            require(j == k or gap > 0, "two eigenvalues that are not apart")
            small.append(Fraction(0) if j == k else eta[j] / gap)
        part = sum(bound_modulus(V[0][j]) * small[j] for j in range(K)) + lost[0]
        square = first[0] ** 2 + first[1] ** 2
        require(square > 0, "an eigenvector without its first part")
        b = [multiply(V[i][k], (first[0] / square, -first[1] / square)) for i in range(K)]
        spread = [
            abs(b[i][1])
            + bound_modulus(b[i]) * part
            + sum(bound_modulus(V[i][j]) * small[j] for j in range(K))
            + lost[i]
            for i in range(K)
        ]
        values = C[m * K :]
        y = [Fraction(1), *(sum(c * b[j][0] for j, c in enumerate(row)) for row in values)]
        radius = [Fraction(0)]
        for row, error in zip(values, off[m * K :], strict=True):
            radius.append(error + sum(abs(c) * spread[j] for j, c in enumerate(row)))
        box = [round_fraction(v) for v in y], [round_fraction(v, up=True) + Fraction(1, UNIT) for v in radius]
        if reject_box(table, missed, *box):
            continue
        near = [step for step in node["inverses"] if step["eigenvalue"] == k]
        result.append(reduce_box(*box, near[0], table, missed) if near else box)
    return result


def reduce_box(middle, radius, step, table, missed):
    """Return a smaller box: x - m is within |1 - C J(X)| r + |C| (|F(m)| + errors) of the whole, m near the middle."""
    m, C = len(middle) - 1, [read_numbers(row) for row in step["inverse"]]
    x = [Fraction(1), *read_numbers(step["middle"])]
    require(len(x) == m + 1 and len(C) == m and all(len(row) == len(table) for row in C), "an inverse of another size")
    values = [abs(sum(c * x[i] * x[j] for (i, j), c in p.items())) + e for p, e in zip(table, missed, strict=True)]
    slopes = [[Fraction(0)] * (m + 1) for _ in table]
    bends = [[{} for _ in range(m + 1)] for _ in table]
    for p, slope, bend in zip(table, slopes, bends, strict=True):
        for (i, j), c in p.items():
            for a, b in ((i, j), (j, i)):
                slope[a] += c * x[b]
                bend[a][b] = bend[a].get(b, 0) + c
    first = [
        [(a == b) - sum(C[a][e] * slopes[e][b + 1] for e in range(len(table))) for b in range(m)] for a in range(m)
    ]
    off = [sum(abs(c) * v for c, v in zip(row, values, strict=True)) for row in C]
    r = [abs(a - b) + s for a, b, s in zip(middle[1:], x[1:], radius[1:], strict=True)]
    for _ in range(3):
        bent = [
            [sum((abs(c) * r[b - 1] for b, c in row.items() if b), Fraction(0)) for row in bend[1:]] for bend in bends
        ]
        new = []
        for a in range(m):
            spread = sum(
                (abs(first[a][b]) + sum(abs(C[a][e]) * bent[e][b] for e in range(len(table)))) * r[b] for b in range(m)
            )
            new.append(round_fraction(min(r[a], spread + off[a]), up=True))
        r = new
    return x, [Fraction(0), *r]


def check_solutions(record):
    """Check that all boxes are near listed poses, and return the claim."""
    system, n = record["system"], len(record["system"]["farthest"])
    equations = [read_quadratic(terms, n) for terms in system["equations"]]
    errors, reach = read_numbers(system["errors"]), [Fraction(1), *read_numbers(system["farthest"])]
    require(len(errors) == len(equations) and min(errors) >= 0 and min(reach) >= 0, "a bound for each equation")
    rows = [[(k, read_number(c)) for k, c in row] for row in system["pose"]]
    require(len(rows) >= 3 and all(0 <= k <= n for row in rows for k, _ in row), "no pose")
    digits, listed = record["digits"], [[Fraction(1), *read_numbers(x)] for x in record["solutions"]]
    require(digits in range(4, 13) and listed and all(len(x) == n + 1 for x in listed), "no solutions")
    within = Fraction(1, 10**digits)
    for x in listed:
        values = (abs(sum(c * x[i] * x[j] for (i, j), c in p.items())) for p in equations)
        require(max(values) <= FIT, "a listed pose at which an equation does not hold")
    poses = [[sum(c * x[k] for k, c in row) for row in rows] for x in listed]
    for k, pose in enumerate(poses):
        for earlier in poses[:k]:
            require(
                max(abs(a - b) for a, b in zip(pose, earlier, strict=True)) > 2 * within, "a pose that is listed twice"
            )
    for middle, radius in solve(record["proof"], equations, errors, reach):
        at = [sum(c * middle[k] for k, c in row) for row in rows]
        off = [sum(abs(c) * radius[k] for k, c in row) for row in rows]
        near = any(max(abs(a - p) + d for a, p, d in zip(at, pose, off, strict=True)) <= within for pose in poses)
        require(near or reject_box(equations, errors, middle, radius), "a box that is near no listed pose")
    count, among = len(poses), record.get("within", "those of its equations")
    require(isinstance(among, str) and len(among) < 200 and among.isprintable(), "poses without a name")
    return (
        f"{count} real pose{'s' * (count != 1)}, and no other among {among} within the bounds of the unknowns, "
        f"to 1e-{digits}; "
        f"the equations hold at {'it' if count == 1 else 'them'} to 1e-9"
    )


def reject_box(equations, errors, middle, radius):
    """Return whether an equation is nowhere zero in a box."""
    for equation, error in zip(equations, errors, strict=True):
        value, spread = Fraction(0), Fraction(0)
        for (i, j), c in equation.items():
            x, y, r, s = middle[i], middle[j], radius[i], radius[j]
            value += c * x * y
            spread += abs(c) * (abs(x) * s + abs(y) * r + r * s)
        if abs(value) > error + spread:
            return True
    return False


def digest(record):
    plain = {key: value for key, value in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(plain, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def reject_duplicates(pairs):
    require(len(dict(pairs)) == len(pairs), "a duplicate key")
    return dict(pairs)


def verify(record):
    """Return what a certificate proves, in words; raises SolutionsRejection."""
    try:
        require(isinstance(record, dict) and record.get("format") == "hrsynth-certificate-1", "this is no certificate")
        require(record["sha256"] == digest(record), "the file was changed: its digest differs")
        require(
            record["claim"] == "solutions",
            "it is for another claim: verify_certificate.py, verify_path.py and verify_ranks.py check those",
        )
        return check_solutions(record)
    except SolutionsRejection:
        raise
    except Exception as error:
        raise SolutionsRejection(f"no certificate: {error!r}") from None


def main(name):
    try:
        with open(name, encoding="utf-8") as file:
            text = file.read(LENGTH + 1)
        require(len(text) <= LENGTH, f"a file of more than {LENGTH} characters")
        print("accepted:", verify(json.loads(text, object_pairs_hook=reject_duplicates)))
    except (SolutionsRejection, OSError, ValueError, RecursionError) as error:
        return print("refused:", error) or 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else print("usage: python verify_solutions.py FILE") or 2)
