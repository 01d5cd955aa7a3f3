"""Check a certificate of ranks: `python verify_ranks.py c.json`. Integers only.

A stack of integer matrices has the rank told: a minor of it is not zero modulo a prime, and as many independent vectors
as it has columns besides are annulled by it.
"""

import hashlib
import json
import sys

PRIME = 2147483647
class RanksNotAccepted(Exception):
    """Why a certificate is not accepted."""
def need(true, why):
    if not true:
        raise RanksNotAccepted(why)

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
    need(record["stacks"] and record["matrices"].keys() <= {"A", "X", "Y"}, "no stack, or a matrix of another name")
    for each in record["stacks"]:
        rows, kernel = [row for name in each["of"] for row in record["matrices"][name]], each["kernel"]
        need(rows and all(type(c) is int for row in [*rows, *kernel, [each["rank"]]] for c in row)
             and len(set(each["of"])) == len(each["of"]), "matrices of integers, each once")
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
def verify(record):  # what a certificate proves, in words; raises RanksNotAccepted
    try:
        need(isinstance(record, dict) and record.get("format") == "hrsynth-certificate-1", "this is no certificate")
        need(record["sha256"] == digest(record), "the file was changed: its digest differs")
        need(record["claim"] == "ranks", "it is for another claim: verify_certificate.py, verify_path.py check those")
        return ranks(record)
    except Exception as error:
        raise error if isinstance(error, RanksNotAccepted) else RanksNotAccepted(f"no certificate: {error!r}") from None

if __name__ == "__main__":
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            print("accepted:", verify(json.load(file, object_pairs_hook=once)))
    except (RanksNotAccepted, OSError, ValueError, IndexError, RecursionError) as error:
        print("refused:", error)
        sys.exit(3)
