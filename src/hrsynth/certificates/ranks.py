"""The certificate of a verdict in exact arithmetic: the ranks at one rational instance (docs/pages/proofs.md, 12)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..analysis.derive import Derivation, derive
from ..analysis.exact import get_architecture
from ..analysis.instances import RecognitionFailure
from ..errors import NoCertificate
from ..mechanism import Mechanism
from .verify_ranks import PRIME, digest, verify


def certificate(found: Derivation) -> dict[str, Any]:
    """A: the constraints of all joints and loops on the joints' rates, X: the platform's twist (of a formation the
    twists of all bodies), Y: the rates of what is observed, at one random rational instance of the architecture, and
    the ranks of A, [A; X], [A; Y], [A; Y; X].

    The legs observe rank [A; X] + rank [A; Y] − rank [A; Y; X] − rank A of the platform's dof. Raises
    ``NoCertificate`` if there are no instances."""
    exact, name = get_architecture(found.setup), found.robot.name
    try:
        at = exact.instance(0)
    except RecognitionFailure as reason:
        raise NoCertificate(name, str(reason)) from None
    places = [i for i, o in enumerate(exact.observations) if o.key in {each.key for each in found.setup.observed}]
    if len(places) < len(found.setup.observed):
        raise NoCertificate(name, "not all observations are rational")
    matrices = {"A": at.loops, "X": at.rows[0], "Y": np.vstack([at.rows[1 + i] for i in places])}
    whole = {key: [[int(c) for c in row] for row in rows] for key, rows in matrices.items()}
    record = {
        "format": "hrsynth-certificate-1",
        "claim": "ranks",
        "robot": name,
        "observed": [[o.leg, o.link] for o in found.setup.observed],
        "matrices": whole,
        "stacks": [
            _stack(of, whole)
            for of in (["A"], ["A", "X"], ["A", "Y"], ["A", "Y", "X"])
            if any(whole[key] for key in of)
        ],
    }
    record["sha256"] = digest(record)
    verify(record)
    return record


def describe_ranks(record: dict[str, Any]) -> str:
    """Return the platform dof that proved ranks show; empty if ranks are missing."""
    found = {"".join(sorted(each["of"])): int(each["rank"]) for each in record["stacks"]}
    needed = {"AX", "AXY", "AY"} | ({"A"} if record["matrices"].get("A") else set())
    if not needed <= found.keys():
        return ""
    freedoms = found["AX"] - found.get("A", 0)
    return f": the legs observe {freedoms - found['AXY'] + found['AY']} of {freedoms} dof at this instance"


def again(record: dict[str, Any], robot: Mechanism) -> dict[str, Any]:
    """Return the certificate of the same claim about a robot."""
    others = {each.leg for each in robot.observations if not each.is_segment_direction}
    return certificate(derive(robot, [leg if leg in others else link for leg, link in record["observed"]]))


def _stack(of: Sequence[str], matrices: dict[str, list[list[int]]]) -> dict[str, Any]:
    """The rank of a stack of matrices, its minor and its kernel."""
    from flint import fmpz_mat, nmod_mat

    rows = [row for key in of for row in matrices[key]]
    columns = len(rows[0])
    exact = fmpz_mat(rows)
    kernel, nullity = exact.nullspace()
    rank = columns - int(nullity)
    vectors = [[int(kernel[i, j]) for i in range(columns)] for j in range(int(nullity))]
    modular = nmod_mat(len(rows), columns, [c % PRIME for row in rows for c in row], PRIME)
    chosen = _pivots(modular.transpose())
    own = _pivots(nmod_mat(len(chosen), columns, [rows[i][j] % PRIME for i in chosen for j in range(columns)], PRIME))
    return {"of": list(of), "rank": rank, "rows": chosen, "columns": own, "kernel": vectors}


def _pivots(matrix: Any) -> list[int]:
    """The columns of a matrix that do not depend on those before."""
    reduced, rank = matrix.rref()
    return [next(j for j in range(reduced.ncols()) if int(reduced[i, j])) for i in range(rank)]
