"""Assembly of foreign files: assumptions, loop closures, geometry repair."""
