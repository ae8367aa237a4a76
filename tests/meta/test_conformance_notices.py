"""Each conformance check fails on some engine that is broken on purpose, and none fails on one that is not."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Callable, Mapping
from unittest import SkipTest

import pytest
from nonconforming import FAILS, Forgetful, Heavy
from tiny import Tiny

from proofroll.conformance import Check, checks, run_check
from proofroll.core.engine import Sample


@pytest.fixture(autouse=True)
def tiny_is_installed(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """The conforming engine's entry point."""
    install_engines({"tiny": "tiny:Tiny"})


def failures(engine: type[Tiny], family: str) -> list[str]:
    """Texts of the checks of one family that fail."""
    found = []
    for check in checks(engine):
        if check.name.partition("[")[0] != family:
            continue
        try:
            check()
        except AssertionError as error:
            found.append(str(error))
        except SkipTest:
            pass
    return found


@pytest.mark.parametrize("check", checks(Tiny))
def test_a_conforming_engine_passes(check: Check) -> None:
    """An engine that keeps every promise fails no check."""
    check()


class Late(Tiny):
    """Defines reactions only after a first step."""

    def sample(self) -> Sample:
        """No force at time 0."""
        right = super().sample()
        return right if self.t else dataclasses.replace(right, force=None)


def test_an_engine_without_a_force_at_time_0_conforms() -> None:
    """Reactions that begin with the first step break no promise about what is built, sampled and moved."""
    for family in (
        "certificate_holds",
        "samples_are_well_formed",
        "reading_back_changes_nothing",
        "moves_as_the_truth",
    ):
        assert failures(Late, family) == []


@pytest.mark.parametrize(("engine", "family"), FAILS.items(), ids=lambda value: getattr(value, "__name__", value))
def test_each_broken_promise_is_noticed(engine: type[Tiny], family: str) -> None:
    """The check whose business it is fails, and says how to run it alone."""
    found = failures(engine, family)
    assert found, f"{family} did not notice: {engine.__doc__}"
    for text in found:
        assert f"from nonconforming import {engine.__name__}" in text
        assert f"run_check({engine.__name__}, '{family}" in text


def test_every_check_is_known_to_be_able_to_fail() -> None:
    """There is no check without an engine that fails it."""
    assert {check.name.partition("[")[0] for check in checks(Tiny)} == set(FAILS.values())


def test_the_reproducer_runs() -> None:
    """The printed command, pasted into a shell, fails for the same reason."""
    check = next(check for check in checks(Forgetful) if check.name.startswith("advance_in_two_parts"))
    with pytest.raises(AssertionError) as caught:
        check()
    command = str(caught.value).rpartition("To reproduce:\n")[2]
    assert command.startswith('python -c "')
    done = subprocess.run(
        [sys.executable, "-c", command.removeprefix('python -c "').removesuffix('"')],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert str(caught.value).partition("\n")[0] in done.stderr


def test_a_known_failure_is_skipped_with_its_reason() -> None:
    """A check that is known to fail is skipped, and the reason is shown."""
    check = next(c for c in checks(Heavy, {"certificate_holds[*-plane]": "it is heavy"}) if c.known)
    with pytest.raises(SkipTest, match="known: it is heavy"):
        check()


def test_a_known_failure_that_passes_is_a_failure() -> None:
    """Nobody keeps an excuse that is no longer needed."""
    check = next(c for c in checks(Tiny, {"version_is_told": "no version yet"}) if c.known)
    with pytest.raises(AssertionError, match="take it off the list"):
        check()


def test_names_that_fit_nothing() -> None:
    """A misspelt check is an error rather than silence."""
    with pytest.raises(ValueError, match="no check of Tiny fits 'versoin'"):
        checks(Tiny, {"versoin": "misspelt"})
    with pytest.raises(ValueError, match="has no check"):
        run_check(Tiny, "versoin")
