"""``python -m hrsynth``."""

from .cli import main

main()
