"""MJCF, the format of MuJoCo: bodies and joints as a tree, equalities that close its loops."""

from __future__ import annotations

from ...file_format import FileFormat

DIALECT = FileFormat(
    "mjcf", lambda file: file.tag == "mujoco", (".xml", ".mjcf"), meshes=(".stl", ".obj", ".msh"), reread=False
)
