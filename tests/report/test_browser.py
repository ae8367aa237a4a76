"""The report in a real browser with its network cut. Skipped where there is none."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from proofroll.report.html import page, report_content
from proofroll.report.plots import point_curves


@pytest.fixture
def browse(tmp_path: Path) -> Callable[[Path, str], tuple[str, str, list[str]]]:
    """Opens a page in headless Chromium: its elements after some seconds, the console, and what was requested."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium here: apt-get install chromium")

    def once(file: Path, fragment: str, budget: int) -> tuple[str, str, list[str]]:
        log = tmp_path / "net.json"
        done = subprocess.run(
            [
                browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                "--disable-background-networking", "--disable-component-update", "--disable-sync",
                "--host-resolver-rules=MAP * ~NOTFOUND",
                f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1280,6000", f"--virtual-time-budget={budget}",
                "--run-all-compositor-stages-before-draw",
                "--enable-logging=stderr", f"--log-net-log={log}", "--dump-dom", file.as_uri() + fragment,
            ],
            capture_output=True, text=True, timeout=120, check=True,
        )  # fmt: skip
        console = "\n".join(line for line in done.stderr.splitlines() if "CONSOLE" in line)
        events = [event.get("params", {}) for event in json.loads(log.read_text(encoding="utf-8"))["events"]]
        # The browser asks for updates of its own; what a page asks for has the page as its initiator.
        asked = {event["url"] for event in events if event.get("initiator", "not an origin") != "not an origin"}
        return done.stdout, console, sorted(url for url in asked if not url.startswith(("file:", "data:", "blob:")))

    def run(file: Path, fragment: str = "", shows: str = "", least: int = 1) -> tuple[str, str, list[str]]:
        # Virtual time can run out before a busy machine has painted a frame, and what is not painted is not drawn.
        for budget in (8_000, 60_000, 400_000):
            found = once(file, fragment, budget)
            if found[0].count(shows) >= least or found[1]:
                break
        return found

    return run


def test_a_browser_draws_the_figures_and_asks_for_nothing(
    written: tuple[dict[str, Any], Path], browse: Callable[..., tuple[str, str, list[str]]]
) -> None:
    """No message on the console, no request, and figures where they should be."""
    dom, console, requested = browse(written[1] / "report.html", shows='class="main-svg"', least=6)
    assert console == ""
    assert requested == []
    assert dom.count('class="main-svg"') >= 6, "the figures of the first point"


def test_a_link_opens_the_evidence_it_leads_to(
    written: tuple[dict[str, Any], Path], browse: Callable[..., tuple[str, str, list[str]]], parse: Any
) -> None:
    """A link into a folded section unfolds it."""
    dom, console, _ = browse(written[1] / "report.html", "#c0-r1-p1")
    assert console == ""
    tag = next(attributes for _, attributes in parse(dom).tags if attributes.get("id") == "c0-r1-p1")
    assert "open" in tag


def test_requests_would_be_seen(tmp_path: Path, browse: Callable[..., tuple[str, str, list[str]]]) -> None:
    """The check above can fail: a page that loads an image and raises an error is caught at both."""
    file = tmp_path / "page.html"
    file.write_text("<!doctype html><img src='http://proofroll.invalid/a.png'><script>nothing()</script>")
    _, console, requested = browse(file)
    assert "nothing is not defined" in console
    assert requested == ["http://proofroll.invalid/a.png"]


ACTING = """<script>addEventListener("load", async () => {
  const drawn = [...document.querySelectorAll('figure[data-p="0"] .canvas')];
  const wait = () => new Promise((resolve) => setTimeout(resolve, 300));
  while (!drawn.every((element) => element.on)) await wait();
  let told = 0;
  drawn.forEach((element) => element.on("plotly_relayout", () => told++));
  await Plotly.relayout(drawn[0], {"xaxis.range": [0.25, 0.5]});
  await wait();
  const ranges = drawn.map((element) => element.layout.xaxis.range.join(" "));
  drawn[0].parentNode.matches = () => true;  // as if the pointer were there
  drawn[0].emit("plotly_hover", {points: [{x: 0.4}]});
  await wait();
  const labels = drawn.slice(1).map((element) => element.querySelectorAll(".hovertext").length);
  document.querySelector('.legend [data-row="1"]').click();
  const off = drawn[0].data.filter((trace) => trace.visible === false).length;
  document.body.dataset.found = JSON.stringify({told, ranges, labels, off});
})</script>"""


def test_figures_of_a_section_act_together(
    written: tuple[dict[str, Any], Path], tmp_path: Path, browse: Callable[..., tuple[str, str, list[str]]], parse: Any
) -> None:
    """Zoom and pointer are passed on once and not back; a row is switched off in every figure."""
    file = tmp_path / "acting.html"
    file.write_text((written[1] / "report.html").read_text(encoding="utf-8") + ACTING, encoding="utf-8")
    dom, console, _ = browse(file, shows="data-found=")
    assert console == ""
    found = json.loads(next(attributes["data-found"] for tag, attributes in parse(dom).tags if tag == "body"))
    assert found == {"told": 6, "ranges": ["0.25 0.5"] * 6, "labels": [1] * 5, "off": 2}


COUNTING = """<script>addEventListener("load", async () => {
  const slips = () => [...document.querySelectorAll(".canvas")].flatMap((element) => element.data ?? [])
    .filter((trace) => trace.name === "first slip").length;
  while (!slips()) await new Promise((resolve) => setTimeout(resolve, 300));
  document.body.dataset.slips = slips();
})</script>"""


def test_first_slips_and_bounds_of_friction_are_drawn(
    made: Any, tmp_path: Path, browse: Callable[..., tuple[str, str, list[str]]]
) -> None:
    """A line with its name for each bound, and a marker for each first slip, switched with its row."""
    content = report_content([made[0]], made[1], "proofroll report invented")
    comparison = content["comparisons"][0]
    event = {"kind": "slip", "time": 0.5, "time_low": 0.5, "time_high": 0.51}
    comparison["truths"][0] |= {"events": [event], "mu_static": 0.3, "mu_kinetic": 0.2}
    known = dict.fromkeys(("by_mu", "by_f", "edge_below", "edge_above", "distance", "earliest", "latest"))
    comparison["truths"][0]["onset"] = {**known, "time": 0.5, "uncertainty": 1e-3, "verdict": "well-posed"}
    for run in comparison["runs"]:
        run |= {"events": [event], "onset_verdict": "agree"}
    file = tmp_path / "slips.html"
    file.write_text(page(content, [point_curves(*made)]) + COUNTING, encoding="utf-8")
    dom, console, _ = browse(file, shows="data-slips=")
    assert console == ""
    assert "μ static = 0.3" in dom
    assert "μ kinetic = 0.2" in dom
    assert 'data-slips="5"' in dom, "of the truth and of four runs"
