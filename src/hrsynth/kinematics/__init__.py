"""Pinocchio model, closed configurations, velocity relation of platform and observations, equivalence check."""
