"""A page in headless Chromium without network: its requests, its messages, and its content as a reader sees it.

A page answers when it comes to it, which a busy machine delays: after an action a test waits for the state that it
wants (:meth:`Visit.wait`, :meth:`Visit.until`) and reads nothing before. The environment variable
``PROOFROLL_SLOW_BROWSER=20`` makes pages compute twenty times slower, so that a test that reads too early fails.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SCRIPT = Path(__file__).with_suffix(".js")  # defines ``reading``: functions that read a page
# A script for ``visiting`` with which no figure or replay is drawn, as nothing ever comes into view.
UNDRAWN = "window.IntersectionObserver = class { observe() {} unobserve() {} disconnect() {} };"
WIDE = {"width": 1280, "height": 900}
PATIENCE = 120  # [s]: a busy machine must not meet it


@dataclass
class Visit:
    """An open page.

    Attributes:
        page: playwright's page.
        requested: addresses that were requested; the page's own is the first.
        messages: lines on the console, uncaught errors, and dialogs.
    """

    page: Any
    requested: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)

    def unfold(self) -> None:
        """Opens every ``<details>``, as a reader does who asks for all and scrolls to the end."""
        self.page.evaluate("folds.all()")
        self.wait("!document.querySelector('[data-fold], details:not([open])')")

    def wait(self, condition: str, again: Callable[[], object] | None = None) -> None:
        """Waits until an expression is true, for two minutes at most.

        Args:
            condition: expression in JavaScript.
            again: action repeated each second, where a busy page may miss a single one.

        Raises:
            AssertionError: the expression stays false.
        """
        # Playwright's own way needs ``eval`` in the page, which the page's policy forbids.
        self.until(lambda: self.page.evaluate(condition), again, condition)

    def until(self, met: Callable[[], object], again: Callable[[], object] | None = None, what: str = "") -> None:
        """Waits until a question that is asked from here is answered with yes, for two minutes at most.

        Args:
            met: question that is answered with yes once the state is there.
            again: action repeated each second, where a busy page may miss a single one.
            what: the state in words, for the error.

        Raises:
            AssertionError: the state never comes.
        """
        end, tries = time.monotonic() + PATIENCE, 0
        while True:
            if again is not None and tries % 100 == 0:
                again()
            if met():
                return
            assert time.monotonic() < end, f"never: {what or met}"
            self.page.wait_for_timeout(10)
            tries += 1

    def near(self, selector: str, condition: str) -> None:
        """Scrolls to an element until an expression is true: what lies above it may grow and push it out of sight."""
        scroll = "(which) => document.querySelector(which).scrollIntoView({ behavior: 'instant' })"
        self.wait(condition, again=lambda: self.page.evaluate(scroll, selector))

    def draw(self, which: str = "figure", *, patience: float = 120.0) -> list[str]:
        """Scrolls to figures and waits for their pictures.

        Args:
            which: selector of figures; folded ones are left out.
            patience: longest wait for each [s].

        Returns:
            Captions of figures that stay empty.
        """
        return self.page.evaluate("([which, patience]) => reading.undrawn(which, patience)", [which, 1000 * patience])


@dataclass
class Drawn:
    """A page with everything unfolded and every figure drawn, shared by tests.

    Attributes:
        seen: the page.
        at_first: number of pictures in its last figure before that.
        empty: captions of figures that stayed empty.
    """

    seen: Visit
    at_first: int
    empty: list[str]


@dataclass
class Browser:
    """A browser with idle tabs, which are reused because a page opens there in half of the time.

    Attributes:
        program: playwright's browser.
        tabs: options of a tab, as text -> idle tabs with these options.
    """

    program: Any
    tabs: dict[str, list[Any]] = field(default_factory=dict)

    @contextmanager
    def tab(self, before: str, color_scheme: str, **options: Any) -> Iterator[Any]:
        """Lends an empty tab in the state of a new one; after an error the tab is closed, not reused."""
        idle = self.tabs.setdefault(repr((before, sorted(options.items()))), [])
        if idle:
            page = idle.pop()
        else:
            context = self.program.new_context(**{"offline": True, "service_workers": "block"} | options)
            context.set_default_timeout(1000 * PATIENCE)
            context.add_init_script(path=SCRIPT)
            if before:
                context.add_init_script(before)
            page = context.new_page()
            if rate := os.environ.get("PROOFROLL_SLOW_BROWSER"):
                context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": float(rate)})
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
    """Starts the system's headless Chromium; skips the test if there is none."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # WebGL without a graphics card.
        browser = playwright.chromium.launch(
            executable_path=program, args=["--enable-unsafe-swiftshader"], timeout=1000 * PATIENCE
        )
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
    """Opens a file; other requests of the page are recorded and refused.

    Args:
        browser: from :func:`launched`.
        file: path of the page.
        fragment: anchor in the page, with ``#``.
        before: script that runs before those of the page.
        viewport: size of the screen [CSS px].
        color_scheme: scheme that the reader prefers, ``light`` or ``dark``.
        options: arguments of playwright's ``new_context``, e.g. ``is_mobile=True``.
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
