"""The top of a report as a browser shows it: ``python docs/screenshot.py out/report.html docs/report.png``."""

from __future__ import annotations

import io
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from PIL import Image
from PIL.PngImagePlugin import PngInfo
from playwright.sync_api import sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# In CSS pixels, drawn with two device pixels to each, so that the numbers can be read.
WIDTH, MOST_HEIGHT, DENSITY = 1400, 980, 2
# A page of text and flat cells has few colours; a palette makes the file a third as large.
COLOURS = 64
# The end of the picture, and the first table of verdicts, which is folded below it.
CARDS, FOLDED, VERDICTS = ".kinds-of-scene >> nth=0", "#verdicts details", ".matrix"
# Row for row: what the comparison file calls it, and its verdict.
ROWS = """(table) => [...document.querySelector(table).querySelectorAll("tbody tr:not(.group, .note)")].map((row) =>
  [row.querySelector("th").title, row.querySelector(".v").textContent.trim().split(" ")[1]])"""


def screenshot(report: Path, picture: Path) -> None:
    """Photographs the first screen of a report: chips, facts and cards.

    The verdicts of its first comparison are in the picture as text, under ``verdicts``: a test reads them there.

    Args:
        report: the page.
        picture: a PNG file to write.
    """
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        sys.exit(f"the picture of the report needs one of {', '.join(BROWSERS)}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program)
        page = browser.new_page(
            viewport={"width": WIDTH, "height": MOST_HEIGHT}, device_scale_factor=DENSITY, color_scheme="light"
        )
        page.goto(report.resolve().as_uri())
        end = page.locator(CARDS).evaluate("(cards) => cards.getBoundingClientRect().bottom + 16")
        area: Any = {"x": 0, "y": 0, "width": WIDTH, "height": min(end, MOST_HEIGHT)}
        image = Image.open(io.BytesIO(page.screenshot(clip=area)))
        page.locator(FOLDED).first.evaluate("(fold) => { fold.open = true; }")
        page.locator(VERDICTS).first.wait_for()
        said = PngInfo()
        said.add_text("verdicts", json.dumps(page.evaluate(ROWS, VERDICTS)))
        browser.close()
    image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True, pnginfo=said)


if __name__ == "__main__":
    screenshot(*map(Path, sys.argv[1:]))
