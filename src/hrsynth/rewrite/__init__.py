"""Rewriting a mechanism into its hidden robot: rules, strategy, derivation. The certificate is an argument."""
