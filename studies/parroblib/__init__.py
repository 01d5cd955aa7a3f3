"""The tables of others compared with what is computed here; README.md says how."""
