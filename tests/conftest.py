"""Small matrices are fastest on one thread; the workers of pytest-xdist share the cores. Answers are asked anew in each
test: what one patches is seen."""

import os

import pytest

pytest_plugins = ["browser"]

for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(library, "1")


@pytest.fixture(autouse=True)
def nothing_answered_before():
    from hrsynth.analysis.question import forget_answers
    forget_answers()
