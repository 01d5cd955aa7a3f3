"""Parametric constructors of the papers' robots, one module a family; the files in ``robots/`` are made from them."""

from .table import ROBOTS, ShippedRobot

__all__ = ["ROBOTS", "ShippedRobot"]
