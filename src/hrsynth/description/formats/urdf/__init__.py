"""URDF with the closures of many tools; it is read, and written as the native format."""

from __future__ import annotations

from ...file_format import FileFormat

DIALECT = FileFormat("urdf", lambda file: file.tag == "robot", rank=2)
