"""The version, by itself so that everything may say it."""

__version__ = "0.2.0"
