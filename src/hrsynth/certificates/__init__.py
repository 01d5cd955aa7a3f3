"""Certificates: what was proved, as files that a checker of plain Python accepts or refuses without this package."""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from ..analysis.aspects.path import PathAnswer
from ..analysis.derive import Derivation
from ..analysis.modes.modes import AssemblyModes
from ..description import load
from ..description.files import convert_to_path, open_regular
from ..errors import BadRequest, InvalidCertificate, NoCertificate, PoseReachFailure
from ..mechanism import Mechanism
from ..tolerances import RELATION_ANGLE_TOL
from ..untrusted import run_program
from . import modes, paths, ranks, verify_certificate, verify_path, verify_ranks, verify_solutions
from .verify_certificate import CertificateRejection, once, rational
from .verify_path import PathRejection
from .verify_ranks import RankRejection
from .verify_solutions import SolutionsRejection

VERIFY_TIMEOUT_S = 40
"""Seconds of one core after which checking a certificate file is given up."""


def certificate(found: AssemblyModes | Derivation | PathAnswer) -> dict[str, Any]:
    """Return the certificate of a result, as data that a checker accepts without this package.

    Parameters
    ----------
    found
        Result of ``modes`` with a complete list, of ``derive`` with a verdict in exact arithmetic, or of ``path`` with
        a certified verdict.

    Returns
    -------
    dict
        Content of a JSON file for ``verify``, or for one of the checkers ``verify_*.py``. Lengths are in characteristic
        lengths, numbers are fractions as text.

    Raises
    ------
    NoCertificate
        If the result has no proof that the checkers accept.
    BadRequest
        If the result is of another kind.

    Examples
    --------
    >>> hrsynth.certificate(hrsynth.modes("3rrr_m1"))["claim"]
    'solutions'
    """
    if isinstance(found, AssemblyModes):
        return modes.certificate(found)
    if isinstance(found, Derivation):
        return ranks.certificate(found)
    if isinstance(found, PathAnswer):
        return paths.certificate(found)
    raise BadRequest(
        f"{type(found).__name__}: a result without certificates", remedy="Use a result of modes, derive or path."
    )


def write_certificate(found: AssemblyModes | Derivation | PathAnswer) -> bytes:
    """Return a certificate as the content of a file."""
    return (json.dumps(certificate(found), indent=1) + "\n").encode()


def verify(source: Mapping[str, Any] | str | Path, robot: Mechanism | str | Path | None = None) -> str:
    """Verify a certificate by the checker's own computation, and return what it proves.

    Parameters
    ----------
    source
        Certificate, or path of its file.
    robot
        Robot whose geometry must be that of the certificate, to ``RELATION_ANGLE_TOL`` characteristic lengths.

    Returns
    -------
    str
        Claim that is proved.

    Raises
    ------
    InvalidCertificate
        If the certificate is not accepted.
    BadRequest
        If the file is not readable.

    Examples
    --------
    >>> proved = hrsynth.verify(hrsynth.certificate(hrsynth.modes("3rrr_m1")))
    >>> proved.partition(" within")[0]
    '2 real poses, and no other among poses in the plane of motion'
    """
    if isinstance(source, Mapping):
        record, name, file = dict(source), "the certificate", None
    else:
        name = str(file := convert_to_path(source))
        try:
            with open_regular(file) as content:
                text = content.read(verify_certificate.LENGTH + 1).decode()
            if len(text) > verify_certificate.LENGTH:
                raise BadRequest(
                    f"{name}: the certificate is longer than {verify_certificate.LENGTH} characters",
                    remedy="Use a file that --certificate wrote.",
                )
            record = json.loads(text, object_pairs_hook=once)
        except CertificateRejection as reason:
            raise InvalidCertificate(name, str(reason)) from None
        except (OSError, ValueError, RecursionError) as error:
            why = getattr(error, "strerror", None) or "not JSON"
            raise BadRequest(
                f"{name}: the certificate cannot be read: {why}",
                remedy="Use a file that modes, derive or path wrote with --certificate.",
            ) from None
    try:
        if not isinstance(record, dict):
            raise CertificateRejection("it is not a JSON object")
        checkers = {"path": verify_path, "ranks": verify_ranks, "solutions": verify_solutions}
        checker = checkers.get(str(record.get("claim")), verify_certificate)
        proved = checker.verify(record) if file is None else _within_limits(Path(str(checker.__file__)), file)
    except (CertificateRejection, PathRejection, RankRejection, SolutionsRejection, BadRequest) as reason:
        raise InvalidCertificate(name, str(reason)) from None
    if robot is not None:
        robot = load(robot)
        try:
            own = {"modes": modes, "solutions": modes, "ranks": ranks, "path": paths}[record["claim"]].again(
                record, robot
            )
        except (BadRequest, NoCertificate, PoseReachFailure) as error:
            raise InvalidCertificate(name, _compare_names(record, robot, str(error))) from None
        except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise InvalidCertificate(name, f"it does not name the legs and pose of its claim ({error!r})") from None
        if not _is_same_geometry(record, own):
            raise InvalidCertificate(name, _compare_names(record, robot, "other geometry, legs or pose"))
    return f"{proved}{ranks.describe_ranks(record)}" if record["claim"] == "ranks" else proved


def _compare_names(record: dict[str, Any], robot: Mechanism, reason: str) -> str:
    """Return why a certificate is not for a robot: it names another one, or else a reason."""
    known = str(record.get("robot"))
    return f"it is not for {robot.name}" + (f": {reason}" if known == robot.name else f", but for {known}")


def _within_limits(checker: Path, file: Path) -> str:
    """Run the checker on a file, in a process of its own; raises ``CertificateRejection``, ``BadRequest``."""
    verdict, _, said = run_program(checker, str(file), seconds=VERIFY_TIMEOUT_S).decode().strip().partition(": ")
    if verdict != "accepted":
        raise CertificateRejection(said)
    return said


def _is_same_geometry(one: Any, other: Any) -> bool:
    """Return True if two records of geometry agree, and the real solutions that they list; proofs are left out."""
    if isinstance(one, dict) and isinstance(other, dict):
        left_out = {"robot", "boxes", "bound", "sha256", "stacks", "path", "digits", "proof"}
        return one.keys() - left_out == other.keys() - left_out and all(
            _is_same_geometry(one[key], other[key]) for key in one.keys() - left_out
        )
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_is_same_geometry, one, other))
    try:
        if one == other:
            return True
        x, y = (rational(each) if isinstance(each, str) else Fraction(each) for each in (one, other))
        return abs(x - y) < RELATION_ANGLE_TOL
    except (TypeError, ValueError, ArithmeticError, CertificateRejection):
        return False
