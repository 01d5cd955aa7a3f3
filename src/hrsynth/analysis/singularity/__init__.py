"""Type 2 singularities: the condition in words, as an expression, and as a locus."""
