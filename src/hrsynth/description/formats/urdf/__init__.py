"""URDF as the world writes it, with the closures of many tools; it is read, and written as the native dialect."""

from __future__ import annotations

from ...dialect import Dialect

DIALECT = Dialect("urdf", lambda file: file.tag == "robot", rank=2)
