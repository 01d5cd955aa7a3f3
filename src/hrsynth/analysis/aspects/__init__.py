"""Aspects: whether two poses are joined by a path without Type 2 singularity, with proofs by interval arithmetic."""
