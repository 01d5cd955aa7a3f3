"""A headless Chromium that opens pages of this project, hears their complaints and takes pictures of them.

In tests: the fixture ``tab`` (mark them ``browser``). It fails a test whose page logged an error or asked for anything
that it did not get. From the shell: ``python tests/browser.py PAGE PICTURE.png [WIDTH HEIGHT]``.
"""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
"""WebGL without a graphics card."""
READY = 90_000
"""Longest time that a page may take to be ready (ms)."""
AT_REST = 500
"""Pause before the shell's picture (ms)."""
LOCAL = ("file:", "data:", "blob:", "about:", "http://127.0.0.1:", "http://localhost:")
"""What a page may ask for."""
LEFT = "net::ERR_ABORTED"
"""What becomes of a request whose page is left before it is answered."""


@dataclass
class Tab:
    """A page of the browser; ``page`` is Playwright's."""

    page: Any
    complaints: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, page: Any) -> Tab:
        """A tab that listens to its page."""
        tab = cls(page)
        page.on("console", lambda said: said.type == "error" and tab.complaints.append(f"console: {said.text}"))
        page.on("pageerror", lambda error: tab.complaints.append(f"uncaught: {error}"))
        page.on(
            "requestfailed",
            lambda asked: asked.failure == LEFT or tab.complaints.append(f"not loaded: {asked.url[:200]}"),
        )
        page.on(
            "request",
            lambda asked: (
                asked.url.startswith(LOCAL) or tab.complaints.append(f"asks the network for {asked.url[:200]}")
            ),
        )
        return tab

    def open(self, page: str | Path, ready: str | None = None) -> None:
        """Open a file or a local address; ``ready`` is a JavaScript expression that becomes true when it is shown."""
        address = page.resolve().as_uri() if isinstance(page, Path) else page
        self.page.goto(address, timeout=READY)
        if ready is not None:
            self.page.wait_for_function(ready, timeout=READY)

    def picture(self, file: str | Path | None = None) -> np.ndarray:
        """What is seen, (height, width, 3) bytes; written to ``file`` (.png) as well."""
        from PIL import Image

        png = self.page.screenshot(path=None if file is None else str(file))
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def executable() -> str | None:
    """The system's Chromium."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def running() -> Iterator[Any]:
    """Playwright's browser, the system's Chromium without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable(), args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """The browser; tests that need it are skipped where there is none."""
    pytest.importorskip("playwright")
    if executable() is None:
        pytest.skip("Chromium is not installed (make setup-browser)")
    with running() as found:
        yield found


@pytest.fixture
def tab(browser: Any) -> Iterator[Tab]:
    """An empty tab; in the end its page must not have complained."""
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    found = Tab.of(page)
    yield found
    page.close()
    assert not found.complaints, "\n".join(found.complaints)


def main(page: str, picture: str, width: str = "1200", height: str = "800") -> None:
    """Take a picture of a page; one whose body says ``data-ready="no"`` is waited for until it says something else."""
    with running() as browser:
        tab = Tab.of(browser.new_page(viewport={"width": int(width), "height": int(height)}))
        tab.open(page if "://" in page else Path(page), "document.body.dataset.ready != 'no'")
        tab.page.wait_for_timeout(AT_REST)
        tab.picture(picture)
        sys.exit("\n".join(tab.complaints) or None)


if __name__ == "__main__":
    main(*sys.argv[1:])
