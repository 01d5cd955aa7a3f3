"""Each checker is a file that a reviewer reads in an evening and runs with Python alone."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

from hrsynth.certificates import verify_certificate, verify_path, verify_ranks, verify_solutions


@pytest.mark.parametrize("checker", [verify_certificate, verify_path, verify_ranks, verify_solutions])
def test_a_checker_is_one_short_file_that_needs_python_alone(checker):
    text = Path(checker.__file__).read_text(encoding="utf-8")
    tree = ast.parse(text)
    imports = {
        name.split(".")[0]
        for node in ast.walk(tree)
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    assert imports <= set(sys.stdlib_module_names)
    assert sum(isinstance(node, ast.stmt) for node in ast.walk(tree)) <= 400
    assert not [
        node
        for node in ast.walk(tree)
        if (isinstance(node, ast.Constant) and isinstance(node.value, float))
        or (isinstance(node, ast.Name) and node.id == "float")
    ]
