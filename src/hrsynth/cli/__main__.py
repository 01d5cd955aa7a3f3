"""``python -m hrsynth.cli``."""

from . import main

main()
