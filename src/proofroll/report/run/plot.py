"""Pictures and pages of a run, for any kind of element."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from proofroll.core.errors import InputError, Missing, require_known
from proofroll.report.run.curves import names_of_curves

if TYPE_CHECKING:
    import xarray as xr

ENDINGS = (".html", ".svg", ".png", ".pdf")
_COLUMNS = 2


def require_ending(path: Path, option: str = "--out") -> None:
    """Raises InputError unless the ending of a file is that of a kind of picture."""
    require_known(option, path.suffix.lower(), ENDINGS, "end the name of the file in one of", path)


def read_run(path: Path) -> xr.Dataset:
    """Run stored in a file. Raises InputError if there is no such file, or it holds no run."""
    from proofroll.files.trajectory_file import read

    try:
        dataset = read(path)
    except FileNotFoundError:
        raise InputError("run", path, "no such file or kept run; proofroll replay lists these") from None
    except (OSError, ValueError, TypeError, KeyError):
        raise InputError("run", path, "no run in netCDF or npz; proofroll run … --out writes one") from None
    if not names_of_curves(dataset):
        raise InputError("run", path, "it has no variable over time; proofroll run … --out writes a file that has")
    return dataset


def draw_run(dataset: xr.Dataset, path: Path) -> None:
    """Draws a run in the format of the file's ending.

    A page shows it in motion with its curves beside the truth's, a picture every curve in a panel of its own.

    Raises:
        Missing: matplotlib or jinja2 is not installed.
    """
    if path.suffix.lower() == ".html":
        from proofroll.report.run.replay import run_page

        path.write_text(run_page(path, dataset), encoding="utf-8")
        return
    try:
        _picture(dataset, path)
    except ModuleNotFoundError as error:
        raise Missing(f"{error.name} is missing, which draws it: pip install 'proofroll[report]'") from None


def _title(dataset: xr.Dataset) -> str:
    parts = (str(dataset.attrs.get(key, "")) for key in ("scene", "engine", "status"))
    return ", ".join(filter(None, parts))


def _picture(dataset: xr.Dataset, path: Path) -> None:
    from matplotlib.figure import Figure

    names = names_of_curves(dataset)
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
