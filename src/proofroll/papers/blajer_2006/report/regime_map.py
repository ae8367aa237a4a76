"""Regime maps as a picture and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.files.json_data import plain
from proofroll.papers.blajer_2006.truth.regimes import Regime
from proofroll.report.figure import drawn_file
from proofroll.report.pages import element
from proofroll.running.store import write_text

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Width of an entry of the legend [inch].
_ENTRY = 3.4
_WORDS = {Regime.NEVER_SLIPS: "never slips", Regime.RECOVERS: "slips and recovers", Regime.FALLS: "falls"}
# From light to dark, so that they differ in grey, too.
_COLOURS = {Regime.NEVER_SLIPS: "#d5e8de", Regime.RECOVERS: "#e8b64c", Regime.FALLS: "#a63c33"}
# Analytic boundaries: style of the line, and its meaning.
_LINES = {"mu_falls": ("--", "below it falls (f = 0)"), "mu_slips": ("-", "above it never slips (f = 0)")}


def regime_content(maps: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Plain data of the maps: axes, regimes, first slips, and counts."""
    content = {
        "maps": [
            {
                "rolling_resistance": item.attrs["rolling_resistance"],
                "until": item.attrs["until"],
                "runs": int(item["regime"].size),
                "ran_on": item.attrs.get("ran_on", ""),
                "counts": {word: int((item["regime"] == regime.value).sum()) for regime, word in _WORDS.items()},
                "outside_boundaries": _outside(item),
                "speed": item["speed"].to_numpy().tolist(),
                "mu_static": item["mu_static"].to_numpy().tolist(),
                "regime": item["regime"].to_numpy().tolist(),
                "first_slip": item["first_slip"].to_numpy().tolist(),
            }
            for item in maps
        ],
        "regimes": {str(regime.value): word for regime, word in _WORDS.items()},
    }
    return dict(plain(content))


def _outside(item: xr.Dataset) -> int | None:
    """Count of runs that contradict the analytic boundaries; None without boundaries or with rolling resistance."""
    if item.attrs["rolling_resistance"] > 0 or "mu_falls" not in item:
        return None
    mu = item["mu_static"].to_numpy()
    falls, slips = item["mu_falls"].to_numpy()[:, None], item["mu_slips"].to_numpy()[:, None]
    expected = np.where(mu < falls, Regime.FALLS, np.where(mu < slips, Regime.RECOVERS, Regime.NEVER_SLIPS))
    return int(np.sum(expected != item["regime"].to_numpy()))


def counts(maps: Sequence[xr.Dataset]) -> list[dict[str, Any]]:
    """Summary of the maps for a report: counts of runs by regime, axes, and the analytic boundaries."""
    kept = ("rolling_resistance", "until", "runs", "counts", "outside_boundaries")
    summaries = [{key: item[key] for key in kept} for item in regime_content(maps)["maps"]]
    for entry, item in zip(summaries, maps, strict=True):
        entry["axes"] = {
            name: {"low": float(item[name].min()), "high": float(item[name].max()), "count": item.sizes[name]}
            for name in ("speed", "mu_static")
        }
        entry["boundaries"] = boundaries(item)
    return list(plain(summaries))


def boundaries(item: xr.Dataset) -> dict[str, str]:
    """Formulas of a map's analytic boundaries; empty without any."""
    if "mu_falls" not in item:
        return {}
    factor = Fraction(float(item["mu_slips"][0] / item["mu_falls"][0])).limit_denominator(1000)
    return {"mu_falls": "μ = g c / V0²", "mu_slips": f"μ = ({factor}) g c / V0²"}


def draw(maps: Sequence[xr.Dataset], path: Path) -> None:
    """Writes the maps side by side as an SVG file; raises Missing if matplotlib is not installed."""
    write_text(path, _svg(maps))


def inline(maps: Sequence[xr.Dataset], prefix: str) -> str:
    """SVG element of the maps for a page: its ids begin with ``prefix``, and its styles are removed.

    Raises:
        Missing: matplotlib is not installed.
    """
    return element(_svg(maps), prefix)


def _svg(maps: Sequence[xr.Dataset]) -> str:
    return picture(maps, "svg", {"font.size": 9}, (5.2 * len(maps), 4.2)).decode()


def picture(maps: Sequence[xr.Dataset], form: str, style: Any, size: tuple[float, float]) -> bytes:
    """File content with the maps side by side.

    Args:
        maps: one for each rolling resistance.
        form: ``svg``, ``png`` or ``pdf``.
        style: matplotlib's settings for text and lines, by name.
        size: width and height [inch].

    Raises:
        Missing: matplotlib is not installed.
    """
    settings = {"svg.fonttype": "none", **style, "axes.grid": False}
    return drawn_file(form, settings, lambda: _drawn(maps, size), dpi=300)


def _drawn(maps: Sequence[xr.Dataset], size: tuple[float, float]) -> Figure:
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = Figure(figsize=size, layout="constrained")
    colours = ListedColormap([_COLOURS[regime] for regime in Regime])
    for index, item in enumerate(maps):
        axes = figure.add_subplot(1, len(maps), index + 1)
        axes.pcolormesh(
            item["speed"], item["mu_static"], item["regime"].T, cmap=colours, vmin=0, vmax=2, rasterized=True
        )
        for name, (dashes, _) in _LINES.items():
            if name in item:
                axes.plot(item["speed"], item[name], color="black", ls=dashes, lw=1)
        axes.set(
            xlim=(float(item["speed"].min()), float(item["speed"].max())),
            ylim=(float(item["mu_static"].min()), float(item["mu_static"].max())),
            xlabel="initial speed [m/s]",
            ylabel="static friction [1]",
            title=f"rolling resistance f = {item.attrs['rolling_resistance']:g} m, {item.attrs['until']:g} s",
        )
    handles: list[Any] = [Patch(color=_COLOURS[regime], label=word) for regime, word in _WORDS.items()]
    for name, formula in next((formulas for item in maps if (formulas := boundaries(item))), {}).items():
        dashes, meaning = _LINES[name]
        handles.append(Line2D([], [], color="black", ls=dashes, lw=1, label=f"{formula}: {meaning}"))
    figure.legend(handles=handles, loc="outside lower center", ncols=max(1, int(size[0] / _ENTRY)), frameon=False)
    return figure
