"""The catalog as a static site: an index that filters, a page for each structure, a file for each robot."""

from .build import Site, write_site

__all__ = ["Site", "write_site"]
