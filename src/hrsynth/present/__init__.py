"""Results → text, JSON."""
