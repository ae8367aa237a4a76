"""Worker processes that tests share."""

from __future__ import annotations

import pytest
from warm_workers import WarmWorkers

from proofroll.running import process
from proofroll.running.idle_workers import Workers


def test_a_worker_is_lent_again_in_the_environment_in_which_it_began(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker whose environment changed between the search for an idle one and its start serves no other test."""
    shared, asked = WarmWorkers(), []

    class Started:
        """A worker that has not ended."""

        def _ended(self) -> bool:
            return False

        def close(self) -> None:
            """Nothing to end."""

    def start(*_: object) -> Started:
        monkeypatch.delenv("PYTHONPATH")  # as the end of a test does, while a thread of it goes on
        asked.append(process.safe_environment())
        return Started()

    monkeypatch.setattr("proofroll.running.idle_workers.start", start)
    monkeypatch.setenv("PYTHONPATH", "engines")
    with shared.lent():
        workers = Workers()
        with workers.lend("oracle"):
            pass
        workers.close()
        monkeypatch.setenv("PYTHONPATH", "engines")
        with workers.lend("oracle"):
            pass
    assert len(asked) == 2
