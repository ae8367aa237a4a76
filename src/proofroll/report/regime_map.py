"""The regime maps as a picture and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.report.content import plain
from proofroll.truth.regimes import Regime

if TYPE_CHECKING:
    import xarray as xr

_WORDS = {Regime.NEVER_SLIPS: "never slips", Regime.RECOVERS: "slips and recovers", Regime.FALLS: "falls"}
_COLOURS = {Regime.NEVER_SLIPS: "#2f7f5f", Regime.RECOVERS: "#e8b64c", Regime.FALLS: "#b5473c"}


def regime_content(maps: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Counts, axes and the maps themselves."""
    content = {
        "maps": [
            {
                "rolling_resistance": item.attrs["rolling_resistance"],
                "until": item.attrs["until"],
                "runs": int(item["regime"].size),
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
    """How many runs without resistance contradict the analytic boundaries; None where there are none."""
    if item.attrs["rolling_resistance"] > 0 or "mu_falls" not in item:
        return None
    mu = item["mu_static"].to_numpy()
    falls, slips = item["mu_falls"].to_numpy()[:, None], item["mu_slips"].to_numpy()[:, None]
    expected = np.where(mu < falls, Regime.FALLS, np.where(mu < slips, Regime.RECOVERS, Regime.NEVER_SLIPS))
    return int(np.sum(expected != item["regime"].to_numpy()))


def draw(maps: Sequence[xr.Dataset], path: Path) -> None:
    """Writes the maps side by side as an SVG file.

    Raises:
        Missing: matplotlib is not installed.
    """
    from proofroll.errors import Missing

    try:
        import matplotlib as mpl
        from matplotlib.colors import ListedColormap
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch
    except ImportError:
        raise Missing("drawing needs matplotlib: pip install 'proofroll[report]'") from None
    with mpl.rc_context({"svg.hashsalt": "proofroll", "font.size": 9}):
        figure = Figure(figsize=(5.2 * len(maps), 4.2), layout="constrained")
        colours = ListedColormap([_COLOURS[regime] for regime in Regime])
        for index, item in enumerate(maps):
            axes = figure.add_subplot(1, len(maps), index + 1)
            axes.pcolormesh(
                item["speed"], item["mu_static"], item["regime"].T, cmap=colours, vmin=0, vmax=2, rasterized=True
            )
            for name, style in (("mu_falls", "--"), ("mu_slips", "-")):
                if name in item:
                    axes.plot(item["speed"], item[name], color="black", ls=style, lw=1)
            axes.set(
                xlim=(float(item["speed"].min()), float(item["speed"].max())),
                ylim=(float(item["mu_static"].min()), float(item["mu_static"].max())),
                xlabel="initial speed [m/s]",
                ylabel="static friction [-]",
                title=f"rolling resistance f = {item.attrs['rolling_resistance']:g} m, {item.attrs['until']:g} s",
            )
        handles = [Patch(color=_COLOURS[regime], label=word) for regime, word in _WORDS.items()]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
        figure.savefig(path, metadata={"Date": None})
