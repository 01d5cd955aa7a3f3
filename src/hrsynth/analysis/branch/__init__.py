"""From motors to joints: the branch of the zero configuration, proved over cells of motor coordinates
(docs/pages/prove_a_branch.md)."""
