"""Figures by matplotlib, reproducible byte for byte."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import Missing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Equal contents must give equal files, hence no date; PNG has no such field.
_NO_DATE: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


@contextmanager
def styled(settings: Mapping[str, Any]) -> Iterator[None]:
    """Context with settings of matplotlib, by name. Raises Missing if matplotlib is not installed."""
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
    metadata: Mapping[str, str] = MappingProxyType({}),
) -> bytes:
    """Content of a file with a figure.

    Args:
        form: ``svg``, ``png`` or ``pdf``.
        settings: of matplotlib, by name.
        drawn: function that returns the figure.
        dpi: dots per inch of parts that are no vectors.
        metadata: entries of the file, by the names of its format.

    Raises:
        Missing: matplotlib is not installed.
    """
    out = io.BytesIO()
    with styled(settings):
        drawn().savefig(out, format=form, dpi=dpi, metadata={**metadata, **_NO_DATE.get(form, {})})
    return out.getvalue()
