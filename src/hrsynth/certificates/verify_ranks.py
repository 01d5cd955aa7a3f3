"""Check a certificate of ranks: `python verify_ranks.py c.json`. Integers only.

A stack of integer matrices has the given rank: a minor of it is not zero modulo a prime, and as many independent
vectors as it has columns besides are annulled by it.
"""

import hashlib
import json
import sys

PRIME, LENGTH, MOST = 2147483647, 5_000_000, 300  # of a file; of rows and columns


class RankRejection(Exception):
    """Certificate that is not accepted: the reason."""


def need(true, why):
    if not true:
        raise RankRejection(why)


def modular(rows, first):  # the ranks modulo the prime of the first columns and of all: where echelons begin
    echelon = {}
    for row in ([c % PRIME for c in row] for row in rows):
        for k in range(len(row)):
            if row[k] and k not in echelon:
                over = pow(row[k], -1, PRIME)
                echelon[k] = [c * over % PRIME for c in row]
                break
            row = [(a - row[k] * b) % PRIME for a, b in zip(row, echelon[k], strict=True)] if row[k] else row
    return sum(k < first for k in echelon), len(echelon)


def ranks(record):
    need(
        0 < len(record["stacks"]) < 8 and record["matrices"].keys() <= {"A", "X", "Y"},
        "no stack, more than 7, or a matrix of another name",
    )
    for each in record["stacks"]:
        rows, kernel = [row for name in each["of"] for row in record["matrices"][name]], each["kernel"]
        need(
            rows
            and all(type(c) is int for row in [*rows, *kernel, [each["rank"]]] for c in row)
            and len(set(each["of"])) == len(each["of"]),
            "matrices of integers, each once",
        )
        sizes = map(len, (rows, rows[0], kernel, each["rows"], each["columns"]))
        need(max(sizes) <= MOST, f"more than {MOST} rows or columns")
        minor = [[rows[i][j] % PRIME for j in each["columns"]] for i in each["rows"]]
        need(len(set(each["columns"])) == len(minor) == modular(minor, 0)[1] == each["rank"], "a minor that is zero")
        need(all(sum(map(int.__mul__, row, v)) == 0 for row in rows for v in kernel), "a vector that is not annulled")
        need({len(row) for row in rows + kernel} == {each["rank"] + len(kernel)}, "too few vectors that are annulled")
        need(modular([[c % PRIME for c in v] for v in kernel], 0)[1] == len(kernel), "vectors that are dependent")
    return "; ".join(f"rank [{'; '.join(each['of'])}] = {each['rank']}" for each in record["stacks"])


def digest(record):
    rest = {key: each for key, each in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def once(pairs):  # an object of JSON; of two keys a reader may see one, Python the other
    need(len(dict(pairs)) == len(pairs), "a duplicate key")
    return dict(pairs)


def verify(record):  # what a certificate proves, in words; raises RankRejection
    try:
        need(isinstance(record, dict) and record.get("format") == "hrsynth-certificate-1", "this is no certificate")
        need(record["sha256"] == digest(record), "the file was changed: its digest differs")
        need(
            record["claim"] == "ranks",
            "it is for another claim: verify_certificate.py, verify_solutions.py and verify_path.py check those",
        )
        return ranks(record)
    except Exception as error:
        raise error if isinstance(error, RankRejection) else RankRejection(f"no certificate: {error!r}") from None


def main(name):  # prints the answer
    try:
        with open(name, encoding="utf-8") as file:
            need(len(text := file.read(LENGTH + 1)) <= LENGTH, f"a file of more than {LENGTH} characters")
        print("accepted:", verify(json.loads(text, object_pairs_hook=once)))
    except (RankRejection, OSError, ValueError, RecursionError) as error:
        return print("refused:", error) or 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else print("usage: python verify_ranks.py FILE") or 2)
