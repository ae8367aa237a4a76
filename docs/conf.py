"""How the documentation is built: ``make docs``."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import proofroll

sys.path.insert(0, str(Path(__file__).parent))

import module_map

from proofroll.vocabulary import document as vocabulary

project = "proofroll"
author = "the proofroll authors"
copyright = author  # noqa: A001 -- the name is Sphinx's
release = proofroll.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "formulas", "sphinx.ext.viewcode"]
html_math_renderer = "pictures"
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "examples/*.md"]
suppress_warnings = ["myst.header"]
html_theme = "furo"
html_title = "proofroll"
html_static_path = ["_static"]
html_search_scorer = str(Path(__file__).parent / "_static" / "scorer.js")
html_css_files = ["proofroll.css"]
html_show_sourcelink = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_class_signature = "separated"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
nitpicky = False


def _links(_: Any, __: str, source: list[str]) -> None:
    """Files outside ``docs`` are named, not linked: an installed documentation has them not beside it."""
    source[0] = re.sub(r"\[([^]]+)\]\(\.\./[^)]*\)", r"\1", source[0])


def setup(app: Any) -> None:
    """Called by Sphinx: writes the pages that are made from the source, and names links of other pages."""
    module_map.FILE.write_text(module_map.document(), encoding="utf-8")
    (Path(__file__).parent / "vocabulary.md").write_text(vocabulary.document(), encoding="utf-8")
    app.connect("source-read", _links)
