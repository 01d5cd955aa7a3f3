"""hrsynth: hidden robots of parallel robots that are controlled by watching the directions of their legs."""

__version__ = "0.1.0"
