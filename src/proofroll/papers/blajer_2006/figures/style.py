"""Style of figures: fonts, labels with units, and lines that differ in colour, in grey and in dashes."""

from typing import Any

# Colours after Okabe and Ito (2008), distinct for every common kind of colour vision: here from dark to light
# (L* = 33, 54 and 70), so that they also differ in grey; dashes distinguish the lines where even that is lost.
LINES: tuple[dict[str, Any], ...] = (
    {"color": "#00518a", "linestyle": "-"},
    {"color": "#d55e00", "linestyle": (0, (5, 1.5))},
    {"color": "#56b4e9", "linestyle": (0, (4, 1.2, 1, 1.2))},
    {"color": "#000000", "linestyle": (0, (1, 1.2))},
)
TRUTH: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 2.6, "markerfacecolor": "white", "markeredgecolor": "black",
    "markeredgewidth": 0.6,
}  # fmt: skip
LEVEL: dict[str, Any] = {"color": "0.25", "linestyle": (0, (6, 2)), "linewidth": 0.8}
SLIPPING: dict[str, Any] = {"facecolor": "0.88", "edgecolor": "none"}
EVENT: dict[str, Any] = {"color": "0.35", "linewidth": 0.6}
# Width of a figure of two columns in a journal [inch]: 180 mm.
WIDTH = 7.09
PIXELS_PER_INCH = 300

SETTINGS: Any = {  # Any: matplotlib has a Literal type for names of settings, which a dictionary literal loses
    "font.family": "STIXGeneral",  # comes with matplotlib, and matches the font of its mathematics
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.xmargin": 0.0,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.handlelength": 2.0,
    "lines.linewidth": 1.1,
    "svg.fonttype": "path",  # the same picture wherever it is opened; each text is also there as a comment
    "pdf.fonttype": 42,
}


def axis_label(symbol: str, unit: str) -> str:
    """Label of an axis, ``$z$ [m]``; a dimensionless quantity has a dash for its unit."""
    powers = unit.replace("^2", "²").replace("^3", "³")
    return f"{symbol} [{'–' if unit == '1' else powers}]"
