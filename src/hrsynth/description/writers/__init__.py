"""Writers of foreign dialects: a mechanism in joints that the dialect can say, then its text."""
