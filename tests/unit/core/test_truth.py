"""What the harness asks of truths, whichever cover a scene."""

from __future__ import annotations

import pytest

from proofroll.core import truth
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene


def test_an_edge_of_a_scene_whose_truth_finds_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A truth that only knows runs is asked for no edge; one line says to give a number."""

    class OnlyRuns:
        """Covers everything."""

        covers = staticmethod(lambda _: True)

    monkeypatch.setattr(truth, "load_truths", lambda: (OnlyRuns,))
    with pytest.raises(InputError, match=r"speed.*finds edges; give a number"):
        truth.edge_between(load_scene("sphere_in_cylinder"), "speed", 1.0, 2.0, 1.0)
