"""Equilibria of the servo loop: where they are, which are stable, and their basins of attraction."""
