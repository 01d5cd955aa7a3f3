"""The maximum of two cones is the best end of an ascent from everywhere, for all kinds of forms, in NumPy and numba."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.batch.cones import trace_two
from hrsynth.batch.error_bounds import compute_largest_errors
from hrsynth.batch.program import Program
from hrsynth.geometry.vectors import Array

KINDS = ("any", "nearly alike", "long axes across", "one axis each", "one of them nothing", "round")
COUNT = 300


def forms(kind: str, rng: np.random.Generator) -> tuple[Array, Array]:
    """Pairs of symmetric matrices A Aᵀ, (n, 3, 3) each; those with long axes across have two local maxima."""
    A, C = rng.normal(size=(2, COUNT, 3, 3))
    if kind == "nearly alike":
        C = A + 1e-3 * C
    elif kind == "long axes across":
        A, C = (np.eye(3)[[k, 1 - k, 2]] * [3.0, 1.0, 1e-6] + 0.05 * each for k, each in enumerate((A, C)))
    elif kind == "one axis each":
        A[..., 1:], C[..., 1:] = 0.0, 0.0
    elif kind == "one of them nothing":
        C *= 0.0
    elif kind == "round":
        A, C = np.broadcast_to(np.eye(3), A.shape), np.broadcast_to(2 * np.eye(3), C.shape)
    return A @ A.transpose(0, 2, 1), C @ C.transpose(0, 2, 1)


def climbed(B: Array, C: Array, rng: np.random.Generator) -> Array:
    """The best end (n,) of w ← Bw / √(wᵀBw) + Cw / √(wᵀCw), normalised, from 40 random starts."""
    w = rng.normal(size=(40, len(B), 3)).transpose(1, 0, 2)

    def sizes() -> list[tuple[Array, Array]]:
        """Fw and √(wᵀFw) of both forms F."""
        pulls = [w @ form for form in (B, C)]
        return [(pull, np.sqrt(np.maximum(np.einsum("nsi,nsi->ns", w, pull), 1e-300))) for pull in pulls]

    for _ in range(600):
        pull = sum(there / size[..., None] for there, size in sizes())
        w = pull / np.sqrt(np.einsum("nsi,nsi->ns", pull, pull))[..., None]
    return np.max(sum(size for _, size in sizes()), axis=1)


def entries(B: Array) -> Array:
    return np.stack([B[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])


def dual_bound(B: Array, C: Array) -> Array:
    """The least upper bound over the weights, whatever Newton's method says."""
    program = Program.of(B=6, C=6)
    program.apply(lambda: {"always": [1.0]}, state=["always"])
    trace_two(program, ["B", "C"], "always", "maximum", direct=False)
    return program.run(np.vstack([B, C]).T, ["maximum"])[0]


@pytest.mark.some(1)
@pytest.mark.parametrize("kind", KINDS)
def test_no_ascent_ends_higher_and_one_ends_there(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    B, C = forms(kind, rng)
    found, lower = compute_largest_errors([entries(B), entries(C)])
    best = climbed(B, C, rng)
    assert np.array_equal(found, lower)
    assert np.all(best <= found * (1 + 1e-12))
    assert np.max(1 - best / found) < 1e-7
    assert found == pytest.approx(dual_bound(entries(B), entries(C)), rel=1e-12)


@pytest.mark.some(0, 2)
@pytest.mark.parametrize("kind", KINDS)
def test_numba_finds_the_same(kind: str) -> None:
    pytest.importorskip("numba")
    forms_ = [entries(each) for each in forms(kind, np.random.default_rng(KINDS.index(kind)))]
    plain, quick = (compute_largest_errors(forms_, compiled=compiled)[0] for compiled in (False, True))
    assert quick == pytest.approx(plain, rel=1e-12)
