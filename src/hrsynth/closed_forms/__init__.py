"""Closed forms of legs, each once: what the pose of the platform decides in a leg, for numbers, balls and symbols."""
