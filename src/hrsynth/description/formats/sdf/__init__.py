"""SDFormat, the dialect of Gazebo: the joint graph itself."""

from __future__ import annotations

from ...dialect import Dialect

DIALECT = Dialect("sdf", lambda file: file.tag in ("sdf", "gazebo"), (".sdf",))
