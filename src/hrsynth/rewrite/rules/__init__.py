"""The table of rules: one file a rule, each with its drawing, its source, its side condition."""
