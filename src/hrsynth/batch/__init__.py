"""Batches of poses: compiled once from a mechanism, evaluated many at a time (closed forms, NumPy or numba)."""
