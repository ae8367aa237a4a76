"""Draws the scene of first_mechanism.md to first_mechanism.svg: ``python docs/first_mechanism.py``."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from gallery import drawn_scene

DOCS = Path(__file__).resolve().parent


def picture() -> str:
    """The picture of the scene that the page has."""
    text = (DOCS / "first_mechanism.md").read_text(encoding="utf-8")
    block = re.search(r"^```toml\n# my_swing/scene\.toml\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    assert block is not None
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scene.toml").write_text(block[1], encoding="utf-8")
        return drawn_scene(folder, "my_swing")[0]


if __name__ == "__main__":
    (DOCS / "first_mechanism.svg").write_text(picture(), encoding="utf-8")
