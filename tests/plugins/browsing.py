"""A page in headless Chromium with its network cut: what it asks for, what it complains of, what a reader meets."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SCRIPT = Path(__file__).with_suffix(".js")  # ``reading``: what one can ask a page
# A script for ``visiting``: figures and replay are drawn when they come into view, and with it nothing ever does.
UNDRAWN = "window.IntersectionObserver = class { observe() {} unobserve() {} disconnect() {} };"
WIDE = {"width": 1280, "height": 900}


@dataclass
class Visit:
    """A page that is open.

    Attributes:
        page: playwright's page.
        requested: every address that was asked for; the page's own is the first.
        messages: every line on the console, every uncaught error, and every dialog.
    """

    page: Any
    requested: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)

    def unfold(self) -> None:
        """Opens every ``<details>``, as a reader does."""
        self.page.locator("#unfold").click()
        self.wait("!document.querySelector('[data-fold], details:not([open])')")

    def wait(self, condition: str, again: Callable[[], object] | None = None) -> None:
        """Until an expression is true.

        Args:
            condition: the expression.
            again: what a reader does each second until then, where the page may be too busy to notice it once.

        Raises:
            AssertionError: it does not become so.
        """
        # Playwright's own way needs ``eval`` in the page, which the page's policy forbids.
        end, tries = time.monotonic() + 120, 0
        while True:
            if again is not None and tries % 100 == 0:
                again()
            if self.page.evaluate(condition):
                return
            assert time.monotonic() < end, f"never: {condition}"
            self.page.wait_for_timeout(10)
            tries += 1

    def draw(self, which: str = "figure", *, patience: float = 120.0) -> list[str]:
        """Scrolls to figures and waits for their pictures.

        Args:
            which: selects them; those that are folded away are left out.
            patience: how long to wait for each [s].

        Returns:
            the captions of those that stay empty.
        """
        return self.page.evaluate("([which, patience]) => reading.undrawn(which, patience)", [which, 1000 * patience])


@dataclass
class Drawn:
    """A page in which everything was unfolded and every figure was drawn, once for all tests.

    Attributes:
        seen: the page.
        at_first: how many pictures its last figure had before.
        empty: captions of figures that stayed empty.
    """

    seen: Visit
    at_first: int
    empty: list[str]


@dataclass
class Browser:
    """A browser and its empty tabs: another page in the process of an earlier one opens in half of the time.

    Attributes:
        program: playwright's browser.
        tabs: those that no page is open in, by what they were made with.
    """

    program: Any
    tabs: dict[str, list[Any]] = field(default_factory=dict)

    @contextmanager
    def tab(self, before: str, color_scheme: str, **options: Any) -> Iterator[Any]:
        """One that is empty and looks as a new one does; what failed in it takes it along."""
        idle = self.tabs.setdefault(repr((before, sorted(options.items()))), [])
        if idle:
            page = idle.pop()
        else:
            context = self.program.new_context(**{"offline": True, "service_workers": "block"} | options)
            context.set_default_timeout(120_000)  # [ms]: a busy machine must not meet it
            context.add_init_script(path=SCRIPT)
            if before:
                context.add_init_script(before)
            page = context.new_page()
        try:
            page.emulate_media(media="null", color_scheme=color_scheme, reduced_motion="no-preference")
            yield page
            page.goto("about:blank")
            page.mouse.move(0, 0)
        except BaseException:
            page.context.close()
            raise
        idle.append(page)


@contextmanager
def launched() -> Iterator[Browser]:
    """Headless Chromium of the system; the test is skipped where there is none."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # WebGL without a graphics card.
        browser = playwright.chromium.launch(executable_path=program, args=["--enable-unsafe-swiftshader"])
        yield Browser(browser)
        browser.close()


@contextmanager
def visiting(
    browser: Browser,
    file: Path,
    fragment: str = "",
    before: str = "",
    viewport: Mapping[str, int] = WIDE,
    color_scheme: str = "light",
    **options: Any,
) -> Iterator[Visit]:
    """Opens a file; whatever else it asks for is noted and refused.

    Args:
        browser: from :func:`launched`.
        file: the page.
        fragment: with ``#``, where to go in it.
        before: a script that runs before those of the page.
        viewport: size of the screen [CSS px].
        color_scheme: that a reader prefers, ``light`` or ``dark``.
        options: of playwright's ``new_context``, e.g. ``is_mobile=True``.
    """
    address = file.resolve().as_uri()

    def other(url: str) -> bool:
        return url.partition("#")[0] != address

    with browser.tab(before, color_scheme, **options) as page:
        page.set_viewport_size(viewport)
        visit = Visit(page)

        def hear(message: Any) -> None:
            # Without a graphics card the browser complains to itself that it reads WebGL's picture back.
            if "GL Driver Message" not in message.text:
                visit.messages.append(f"{message.type}: {message.text}")

        def dismiss(dialog: Any) -> None:
            visit.messages.append(f"{dialog.type}: {dialog.message}")
            dialog.dismiss()

        heard = {
            "request": lambda request: visit.requested.append(request.url),
            "console": hear,
            "weberror": lambda error: visit.messages.append(str(error.error)),
            "dialog": dismiss,
        }
        page.context.route(other, lambda route: route.abort())
        for event, listener in heard.items():
            page.context.on(event, listener)
        try:
            page.goto(address + fragment)
            yield visit
        finally:
            for event, listener in heard.items():
                page.context.remove_listener(event, listener)
            page.context.unroute(other)
