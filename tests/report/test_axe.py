"""The page as axe-core, the accessibility checker, sees it: light and dark, wide and narrow, unfolded."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.base import AXE_FILE_PATH
from browsing import Visit

Visiting = Callable[..., AbstractContextManager[Visit]]
RUN = "(where) => axe.run(where || document, {resultTypes: ['violations']}).then((found) => found.violations)"


def grave(visit: Visit, where: str = "") -> list[str]:
    """Violations that are serious, critical or moderate, of the page or of a place, each with the first element."""
    # colours and places of two frames before would be those of another medium
    visit.page.evaluate("new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))")
    found: list[dict[str, Any]] = visit.page.evaluate(RUN, where)
    return [
        f"{item['impact']} {item['id']}: {item['nodes'][0]['html'][:200]} ({len(item['nodes'])})"
        for item in found
        if item["impact"] in {"moderate", "serious", "critical"}
    ]


@pytest.mark.drill
def test_several_comparisons_share_no_name(everything: Any, tmp_path: Path, visit: Visiting) -> None:
    """With two comparisons that have the same points and settings, axe finds nothing either."""
    first = everything.content.comparisons[0]
    content = replace(everything.content, comparisons=[first, replace(first, name="again", title="Again")])
    both = replace(everything, content=content, curves=2 * everything.curves)
    with visit(both.write(tmp_path / "report.html")) as opened:
        opened.page.add_script_tag(content=Path(AXE_FILE_PATH).read_text(encoding="utf-8"))
        assert grave(opened) == []


@pytest.mark.nightly_of("900-dark", "400-light")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("width", "scheme"),
    [(1400, "light"), *(pytest.param(*look, marks=pytest.mark.drill) for look in [(900, "dark"), (400, "light")])],
)
def test_axe_finds_nothing_of_weight(report_page: Path, visit: Visiting, width: int, scheme: str) -> None:
    """No violation that is serious or moderate, folded, printed, unfolded, with tables that sort; a planted one is."""
    with visit(report_page, viewport={"width": width, "height": 900}) as opened:
        opened.page.emulate_media(color_scheme=scheme)
        opened.page.add_script_tag(content=Path(AXE_FILE_PATH).read_text(encoding="utf-8"))
        assert grave(opened) == []
        opened.page.emulate_media(media="print")
        assert grave(opened) == []
        opened.page.emulate_media(media="screen")
        opened.unfold()
        opened.near("#verdicts", "document.querySelectorAll('.scroll[data-sorts]').length > 0")
        assert grave(opened) == []
        opened.page.evaluate("document.querySelector('main').append(document.createElement('button'))")
        assert any("button-name" in text for text in grave(opened, "main > button:last-child"))
        opened.page.evaluate("document.querySelector('main').lastChild.remove()")
