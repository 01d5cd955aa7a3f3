"""Accuracy: how far off the platform can be when the observed directions are wrong by given angles (proofs.md 10)."""
