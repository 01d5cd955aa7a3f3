"""Parametric constructors of the papers' robots, one module a family; the files in ``robots/`` are made from them."""

from .table import ROBOTS, Shipped

__all__ = ["ROBOTS", "Shipped"]
