"""Small matrices are fastest on one thread; the workers of pytest-xdist share the cores."""

import os

pytest_plugins = ["browser"]

for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(library, "1")
