"""The checks that an engine's author runs, in three lines of their own repository:

    import pytest
    from proofroll.conformance import checks

    @pytest.mark.parametrize("check", checks(MyEngine))
    def test_engine(check):
        check()

A failing check says what is wrong and prints the command that runs it alone. pytest is not needed: each check is a
plain callable that raises ``AssertionError``, or ``unittest.SkipTest`` if it does not apply.
"""  # noqa: D415 -- the code is part of the sentence

from proofroll.conformance.checks import Check, checks, run_check

__all__ = ["Check", "checks", "run_check"]
