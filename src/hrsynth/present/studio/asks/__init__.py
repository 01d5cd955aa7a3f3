"""Analyses of the studio, one module each: ``answer`` takes the request and returns plain data."""
