"""Pictures by matplotlib: the same text from the same content."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import Missing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Equal contents give equal files, so no date; PNG has no such field.
_NO_DATE: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


@contextmanager
def styled(settings: Mapping[str, Any]) -> Iterator[None]:
    """Settings of matplotlib, by name, while something is drawn. Raises Missing if matplotlib is not installed."""
    try:
        import matplotlib as mpl
    except ModuleNotFoundError:
        raise Missing("drawing needs matplotlib: pip install 'proofroll[report]'") from None
    chosen: Any = {"svg.hashsalt": "proofroll", **settings}
    with mpl.rc_context(chosen):
        yield


def drawn_file(
    form: str,
    settings: Mapping[str, Any],
    drawn: Callable[[], Figure],
    dpi: float = 100,
    said: Mapping[str, str] = MappingProxyType({}),
) -> bytes:
    """The content of a file with a figure.

    Args:
        form: ``svg``, ``png`` or ``pdf``.
        settings: of matplotlib, by name.
        drawn: makes the figure.
        dpi: dots per inch of what is no line or letter.
        said: entries of the file about itself, by the names of its format.

    Raises:
        Missing: matplotlib is not installed.
    """
    out = io.BytesIO()
    with styled(settings):
        drawn().savefig(out, format=form, dpi=dpi, metadata={**said, **_NO_DATE.get(form, {})})
    return out.getvalue()


def svg_text(settings: Mapping[str, Any], drawn: Callable[[], Figure]) -> str:
    """A figure as SVG; see :func:`drawn_file`."""
    return drawn_file("svg", settings, drawn).decode()


def panels(count: int) -> tuple[Figure, list[Any], int, int]:
    """A figure with so many panels, two side by side, and how many rows and columns of them it has."""
    from matplotlib.figure import Figure

    columns = min(2, count) or 1
    rows = math.ceil(count / columns) or 1
    figure = Figure(layout="constrained")
    made = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    for panel in made[count:]:
        panel.set_visible(False)
    return figure, made[:count], rows, columns
