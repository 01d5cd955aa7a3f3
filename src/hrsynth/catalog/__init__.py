"""The catalog of architectures: words, the mechanisms they stand for, their proved verdicts, where these are kept."""

from .query import Catalog, load

__all__ = ["Catalog", "load"]
