"""Where a controller loses a freedom: the Type 2 condition in words, as an expression, and as a locus."""
