"""Lint: defects, doubts and losses in robot files; rules by name, each with its fix."""
