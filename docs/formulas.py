"""Formulas of the documentation as pictures, made when it is built: a page needs no network to show them."""

from __future__ import annotations

import html
import io
import re
from functools import cache
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser

from proofroll.report.pages import element

# What TeX has and matplotlib's formulas write otherwise.
_SPELT = (
    (re.compile(r"\\t?frac\s*(\d)(\d)"), r"\\frac{\1}{\2}"),
    (re.compile(r"\\tfrac"), r"\\frac"),
    (re.compile(r"\\big[lr]"), ""),
    (re.compile(r"\\(ge|le)\b"), r"\\\1q"),
    (re.compile(r"\\(mathsf|mathbf|boldsymbol)\s*(\\?\w+)(?!\w|\{)"), r"\\\1{\2}"),
)
_SIZE, _EDGE = 11.0, 1.0  # of letters, and around a formula [pt]
_LOOK = {"mathtext.fontset": "stix", "svg.fonttype": "path", "svg.hashsalt": "proofroll", "font.size": _SIZE}


@cache
def drawn(tex: str) -> tuple[str, float, float, float]:
    """A formula as SVG, its width and height, and how far it reaches below the line, in parts of the size of letters.

    Raises:
        ValueError: it has what matplotlib's formulas have not.
    """
    text = " ".join(tex.split())
    for pattern, instead in _SPELT:
        text = pattern.sub(instead, text)
    with rc_context(_LOOK):
        wide, high, deep, *_ = MathTextParser("path").parse(f"${text}$", dpi=72)
        width, height, depth = wide + 2 * _EDGE, high + 2 * _EDGE, deep + _EDGE
        figure = Figure(figsize=(width / 72, height / 72))
        figure.text(_EDGE / width, depth / height, f"${text}$")
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    return buffer.getvalue(), width / _SIZE, height / _SIZE, depth / _SIZE


def markup(tex: str, number: int) -> str:
    """A formula as an element of a page; ``number``: no other on the page has it."""
    svg, width, height, depth = drawn(tex)
    look = f"width:{width:.3f}em;height:{height:.3f}em;vertical-align:{-depth:.3f}em"
    picture = element(svg.strip(), f"m{number}-").replace("<svg ", f'<svg style="{look}" fill="currentColor" ', 1)
    return f'<span class="formula" role="math" aria-label="{html.escape(" ".join(tex.split()))}">{picture}</span>'


def _inline(writer: Any, node: Any) -> None:
    from docutils import nodes

    writer.formulas = getattr(writer, "formulas", 0) + 1
    writer.body.append(markup(node.astext(), writer.formulas))
    raise nodes.SkipNode


def _display(writer: Any, node: Any) -> None:
    from docutils import nodes

    writer.formulas = getattr(writer, "formulas", 0) + 1
    tall = node.astext().replace("\\frac", "\\dfrac")
    writer.body.append(f'<div class="formula">{markup(tall, writer.formulas)}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_html_math_renderer("pictures", inline_renderers=(_inline, None), block_renderers=(_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
