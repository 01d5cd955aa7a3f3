"""SDFormat, the format of Gazebo: the joint graph itself."""

from __future__ import annotations

from ...file_format import FileFormat

DIALECT = FileFormat("sdf", lambda file: file.tag in ("sdf", "gazebo"), (".sdf",), reread=False)
