"""Branch of the zero configuration as a function of the motors, proved over cells (docs/pages/prove_a_branch.md)."""
