"""Accuracy: how far the platform can be off when the observed directions are off by up to given angles (theory 6)."""
