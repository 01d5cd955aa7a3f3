"""Results → plain text for a terminal: one module a analysis."""
