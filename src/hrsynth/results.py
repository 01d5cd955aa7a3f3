"""What every question is answered with: one line at a prompt, the command line's text in print and in a notebook."""

from __future__ import annotations


class Result:
    """An answer: its ``repr`` is one line, its ``str`` the text of the command line, in a notebook the same as HTML.

    How an answer looks is not its own matter: it asks the package for ``hrsynth.text`` and ``hrsynth.html``, public
    names of the folder that renders, which is loaded when something is shown.
    """

    def headline(self) -> str:
        """What is said in one line."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.headline()}>"

    def __str__(self) -> str:
        import hrsynth

        return hrsynth.text(self)

    def _repr_html_(self) -> str:
        import hrsynth

        return hrsynth.html(self)
