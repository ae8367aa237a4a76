"""Pictures by matplotlib: the same text from the same content."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import Missing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def svg_text(settings: Mapping[str, Any], drawn: Callable[[], Figure]) -> str:
    """A figure as SVG, drawn with some of matplotlib's settings.

    Raises:
        Missing: matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
    except ModuleNotFoundError:
        raise Missing("matplotlib is not installed: pip install 'proofroll[report]'") from None
    chosen: Any = {"svg.hashsalt": "proofroll", **settings}
    with mpl.rc_context(chosen):
        out = io.StringIO()
        drawn().savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
