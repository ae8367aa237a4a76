"""What every page is made with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
import pytest

from proofroll.cli import options
from proofroll.cli.report import report
from proofroll.core.errors import InputError
from proofroll.report.page import html
from proofroll.report.pages import environment, rendered, unbroken


def test_templates_are_those_of_the_start(tmp_path: Path) -> None:
    """What changes in a folder of templates while a report runs, also what nothing has used yet, changes no page."""
    own = tmp_path / "own.html"
    own.write_text("{{ a }}", encoding="utf-8")
    (tmp_path / "common.html").write_text("not ours", encoding="utf-8")
    made = environment(tmp_path)
    own.write_text("{{ b }}", encoding="utf-8")
    assert rendered(made, "own.html", a="told") == "told"
    assert made.loader is not None
    assert made.loader.get_source(made, "common.html")[0] != "not ours"


def test_a_report_reads_its_templates_before_its_cases(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The report command has all templates before the first case is begun."""
    html._templates.cache_clear()

    def begin(*_: object) -> None:
        raise InputError("templates", html._templates.cache_info().currsize, "are read")

    monkeypatch.setattr(options, "new_runner", begin)
    with pytest.raises(InputError, match="templates = 1"):
        report(["stick_slip"], out=tmp_path)


def test_a_template_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pages of a process share what was compiled for the first."""
    compiled = []
    compile_ = jinja2.Environment.compile

    def counted(self: jinja2.Environment, *arguments: Any, **more: Any) -> Any:
        compiled.append(arguments)
        return compile_(self, *arguments, **more)

    monkeypatch.setattr(jinja2.Environment, "compile", counted)
    html._templates.cache_clear()
    for _ in range(2):
        html.templates().get_template("common.html")
    assert len(compiled) == 1


def test_words_are_escaped(tmp_path: Path) -> None:
    """What a page is told is text, and a name that nobody gave is an error."""
    (tmp_path / "said.html").write_text("{{ word }}")
    assert rendered(environment(tmp_path), "said.html", word="<One") == "&lt;One"
    with pytest.raises(jinja2.UndefinedError):
        rendered(environment(tmp_path), "said.html")


def test_numbers_in_running_text_are_kept_whole() -> None:
    """In sentences, lists and labels, with their unit; one alone in a cell, attributes, scripts and pictures stay."""
    whole = '<span class="whole">1e-4</span>'
    assert unbroken("<td>0, 1e-4, 0</td>") == f"<td>0, {whole}, 0</td>"
    assert unbroken("<b>tuned, dt 0.05 s</b>") == '<b>tuned, <span class="whole">dt 0.05 s</span></b>'
    assert unbroken("<b>a, rtol 1e-6</b>") == '<b>a, <span class="whole">rtol 1e-6</span></b>'
    assert unbroken("<b>to 1e-4</b> and 1e-4.<i></i>") == f"<b>to {whole}</b> and {whole}.<i></i>"
    assert unbroken("<i><svg></svg>to 1e-4 so</i>") == f"<i><svg></svg>to {whole} so</i>"
    for unit in ("s", "s/s", "m", "N"):
        assert unbroken(f"<p>at 1e-4 {unit} for</p>") == f'<p>at <span class="whole">1e-4 {unit}</span> for</p>'
    for same in (
        "<td>1e-4</td>",
        '<td title="to 1e-4 m">to</td>',
        "<script>a > 1e-4 && b < 1</script>",
        "<svg><text>dt 1e-4 s</text></svg>",
        "<option>dt 1e-4 s</option>",
        "<p>the e-4 of 1e4</p>",
    ):
        assert unbroken(same) == same
