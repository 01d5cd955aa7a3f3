"""Verdicts on two poses and the paths between them."""

SAME, SEPARATED, UNDECIDED = "same aspect", "separated", "undecided"
