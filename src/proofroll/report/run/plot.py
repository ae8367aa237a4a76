"""Pictures of a run: every variable over time, with its unit, for any kind of element."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.errors import InputError, Missing, require_known

if TYPE_CHECKING:
    import xarray as xr

ENDINGS = (".html", ".svg", ".png", ".pdf")
_COLUMNS = 2
# As in all pages: no external resource is loaded, whatever text the file contains.
_POLICY = (
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:\">"
)


def require_ending(path: Path, option: str = "--out") -> None:
    """Raises InputError unless the ending of a file is that of a kind of picture."""
    require_known(option, path.suffix.lower(), ENDINGS, "end the name of the file in one of", path)


def read_run(path: Path) -> xr.Dataset:
    """Run stored in a file. Raises InputError if there is no such file, or it holds no run."""
    from proofroll.files.trajectory_file import read

    try:
        dataset = read(path)
    except FileNotFoundError:
        raise InputError("run", path, "there is no such file; proofroll run … --out writes one") from None
    except (OSError, ValueError, TypeError, KeyError):
        raise InputError("run", path, "no run in netCDF or npz; proofroll run … --out writes one") from None
    if not curves(dataset):
        raise InputError("run", path, "it has no variable over time; proofroll run … --out writes a file that has")
    return dataset


def curves(dataset: xr.Dataset) -> list[str]:
    """Names of the variables with one number for each time and a unit, without those that are never finite."""
    return [str(name) for name, item in dataset.data_vars.items() if item.dims == ("time",) and _is_number(item)]


def _is_number(item: xr.DataArray) -> bool:
    if "units" not in item.attrs or not np.issubdtype(item.dtype, np.number):
        return False
    return bool(np.any(np.isfinite(item.to_numpy())))


def draw_run(dataset: xr.Dataset, path: Path) -> None:
    """Draws every curve of a run in a panel of its own over time, in the format of the file's ending.

    Raises:
        Missing: matplotlib or plotly is not installed.
    """
    try:
        (_page if path.suffix.lower() == ".html" else _picture)(dataset, path)
    except ModuleNotFoundError as error:
        raise Missing(f"{error.name} is missing, which draws it: pip install 'proofroll[report]'") from None


def _title(dataset: xr.Dataset) -> str:
    parts = (str(dataset.attrs.get(key, "")) for key in ("scene", "engine", "status"))
    return ", ".join(filter(None, parts))


def _picture(dataset: xr.Dataset, path: Path) -> None:
    from matplotlib.figure import Figure

    names = curves(dataset)
    rows = -(-len(names) // _COLUMNS)
    figure = Figure(figsize=(9, 1.7 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, sharex=True, squeeze=False).ravel()
    for name, panel in zip(names, panels, strict=False):
        panel.plot(dataset["time"], dataset[name], lw=1)
        panel.set_title(f"{name} [{dataset[name].attrs['units']}]", fontsize=9, loc="left")
        panel.tick_params(labelsize=7)
    for panel in panels[len(names) :]:
        panel.set_axis_off()
    for panel in panels[-_COLUMNS:]:
        panel.set_xlabel("time [s]", fontsize=8)
    figure.suptitle(_title(dataset), fontsize=10)
    figure.savefig(path)


def _page(dataset: xr.Dataset, path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    names = curves(dataset)
    rows = -(-len(names) // _COLUMNS)
    titles = [f"{name} [{dataset[name].attrs['units']}]" for name in names]
    figure = make_subplots(
        rows=rows, cols=_COLUMNS, subplot_titles=titles, shared_xaxes="all", vertical_spacing=min(0.06, 0.5 / rows)
    )
    time = dataset["time"].to_numpy()
    for index, name in enumerate(names):
        curve = go.Scatter(x=time, y=dataset[name].to_numpy(), name=name, mode="lines", hovertemplate="%{x} s: %{y}")
        figure.add_trace(curve, row=index // _COLUMNS + 1, col=index % _COLUMNS + 1)
    figure.update_xaxes(title_text="time [s]", row=rows)
    figure.update_layout(title=_title(dataset), height=220 * rows + 120, showlegend=False, template="simple_white")
    text = figure.to_html(include_plotlyjs=True)  # in the file, which then needs no network
    path.write_text(text.replace("<head>", f"<head>{_POLICY}", 1), encoding="utf-8")
