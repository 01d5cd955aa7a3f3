"""USD with the schemas of UsdPhysics: bodies, joints and drives, as simulators on GPUs use them."""

from __future__ import annotations

from pathlib import Path

from ...file_format import FileFormat

EXCLUDED = "physics:excludeFromArticulation"
"""Attribute of a joint that closes a loop: the articulation of the others is a tree."""
_TEXT, _BINARY = (b"#usda", b"#sdf"), (b"PXR-USDC", b"PK\x03\x04")


def _pack(text: str, path: Path) -> bytes:
    """Return the content of a file: ``.usdc`` is binary."""
    if path.suffix.lower() != ".usdc":
        return text.encode()
    from .stage import convert_to_binary

    return convert_to_binary(text, path)


DIALECT = FileFormat(
    "usd",
    lambda file: file.data.startswith((*_TEXT, *_BINARY)),
    (".usda", ".usd", ".usdc"),
    rank=-2,
    packed=_pack,
    meshes=None,
    reread=False,
)
