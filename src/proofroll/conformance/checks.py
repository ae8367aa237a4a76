"""Checks of an engine, each a callable with a name and a command that runs it alone."""

import atexit
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache, partial
from typing import Any
from unittest import SkipTest

from proofroll.conformance import building, declarations, motion, response
from proofroll.conformance.subject import (
    Subject,
    UnlikeSceneError,
    alike_scenes,
    checked_on,
    contrasts,
    failure_message,
    scenes,
    truth_scenes,
)
from proofroll.core.engine_abilities import RunsBatches
from proofroll.core.scene import Scene
from proofroll.running.process_end import process_pool

# Outcome of a check in a separate process; these processes, one for each formulation and preset of an engine.
_PASSED, _SKIPPED, _FAILED = "passed", "skipped", "failed"
_processes: dict[str, ProcessPoolExecutor] = {}
checked: dict[str, bool] = {}
"""Name of each engine whose checks were run in this process -> True if none has failed."""
not_looked_at: dict[str, set[str]] = {}
"""Name of each such engine -> capabilities that it provides and none of its runs against the truth needed."""


# Checks that run once per engine.
_OF_ENGINES: tuple[Callable[[Any], None], ...] = (
    declarations.name_is_the_entry_point,
    declarations.version_is_told,
    declarations.provides_capabilities,
    declarations.settings_are_a_frozen_dataclass,
    declarations.presets_are_complete,
    declarations.resolution_and_order_are_told,
    declarations.precision_is_told,
    declarations.bad_settings_give_one_line,
    building.provides_what_it_says,
    building.provides_for_some_scene,
)
# Checks that run once per formulation, preset and scene whose requirements the formulation provides.
_OF_SCENES: tuple[Callable[[Subject], None], ...] = (
    building.builds_or_refuses,
    building.certificate_holds,
    building.builds_only_what_is_required,
)
# Checks that run once per formulation, preset and such a scene with a truth.
_OF_TRUTHS: tuple[Callable[[Subject], None], ...] = (response.first_steps_fit_the_scene, response.moves_as_the_truth)
# Checks that run once per formulation and preset, on the first scene that is not refused.
_OF_PRESETS: tuple[Callable[[Subject], None], ...] = (
    building.samples_are_well_formed,
    building.reading_back_changes_nothing,
    motion.advance_is_repeatable,
    motion.advance_in_two_parts,
    motion.sampling_changes_nothing,
    motion.samples_cost_the_same,
    motion.engines_do_not_disturb_each_other,
    motion.velocities_are_the_rates,
    motion.order_is_as_declared,
    motion.tolerance_has_an_effect,
)
# Checks that run once per formulation and preset of an engine that runs batches, and scenes of one structure.
_OF_BATCHES: tuple[Callable[[Subject, Sequence[Scene]], None], ...] = (
    motion.copies_move_as_runs,
    motion.a_copy_that_overflows_stays_alone,
)


@dataclass(frozen=True)
class Check:
    """One check of one engine; call it.

    Attributes:
        engine: the engine's class.
        name: e.g. ``certificate_holds[free-matched-plane]``.
        known: reason of a known failure; then the check must not pass. Empty: the check should pass.
        run: the check itself.
        needs: capabilities that a run against the truth needs; empty for other checks.
    """

    engine: Any
    name: str
    known: str
    run: Callable[[], None]
    needs: frozenset[str] = frozenset()

    @property
    def __name__(self) -> str:  # what pytest shows
        return self.name

    def __call__(self) -> None:
        """Runs the check.

        Raises:
            AssertionError: the check failed; the text says why and how to run it alone.
            SkipTest: the check does not apply, or the failure is known.
        """
        name = str(getattr(self.engine, "name", ""))
        checked.setdefault(name, True)
        left = not_looked_at.setdefault(name, set(_provided(self.engine)))
        try:
            self.run()
            left -= self.needs
        except SkipTest:
            raise
        except Exception as error:
            left -= self.needs
            checked[name] &= bool(self.known)
            if self.known:
                raise SkipTest(f"known: {self.known}") from error
            raise AssertionError(f"{failure_text(error)}\n\nTo reproduce:\n{self.reproducer}") from error
        if self.known:
            raise AssertionError(f"{self.name} passes, though it is said to fail ({self.known}); take it off the list")

    @property
    def reproducer(self) -> str:
        """Shell command that runs this check alone."""
        module, name = self.engine.__module__, self.engine.__qualname__
        imports = f"from {module} import {name}; from proofroll.conformance import run_check"
        return f"python -c \"{imports}; run_check({name}, '{self.name}')\""


def failure_text(error: Exception) -> str:
    """Text of a failed check for a person."""
    if isinstance(error, UnlikeSceneError):
        return failure_message(error)
    return str(error) if isinstance(error, AssertionError) else f"{type(error).__name__}: {error}"


def checks(engine: Any, accepted: Mapping[str, str] | None = None, *, apart: bool = False) -> list[Check]:
    """All checks of an engine: those of each formulation on all scenes whose requirements it provides.

    Args:
        engine: the engine's class.
        accepted: names of checks that are known to fail -> reason; ``*`` stands for any text, as in
            ``order_is_as_declared[free-*]``. A name that fits no check, or whose check passes, is an error.
        apart: True to run the checks of each formulation and preset in a separate process, for an engine that changes
            settings of its whole process, as JAX its precision; the class must be importable by its name.

    Raises:
        ValueError: a name in ``accepted`` fits no check.
    """
    patterns = dict(accepted or {})
    selected = [
        Check(
            engine=engine,
            name=name,
            known=next((why for pattern, why in patterns.items() if _fits(name, pattern)), ""),
            run=partial(_run_apart, engine, name) if apart else run,
            needs=_needs(run),
        )
        for name, run in runs(engine)
    ]
    for pattern in patterns:
        if not any(_fits(check.name, pattern) for check in selected):
            raise ValueError(f"no check of {engine.__name__} fits {pattern!r}")
    return selected


def _needs(run: partial[None]) -> frozenset[str]:
    """Capabilities that a run against the truth needs; empty for another check."""
    return run.args[0].scene.requires if run.func in (response.moves_as_the_truth, response.law_acts) else frozenset()


def _provided(engine: Any) -> frozenset[str]:
    provides = getattr(engine, "provides", None)
    return frozenset(itertools.chain(*provides.values())) if isinstance(provides, Mapping) else frozenset()


def _run_apart(engine: Any, name: str) -> None:
    """Runs the check of this name in the process of its formulation and preset, which is kept for the next check."""
    key = f"{engine.__module__}.{engine.__qualname__}: {_of_one_process(engine, name)}"
    if key not in _processes:
        _processes[key] = process_pool(1)
        atexit.register(_processes[key].shutdown, wait=False, cancel_futures=True)
    try:
        how, text = _processes[key].submit(_outcome, engine, name).result()
    except BrokenProcessPool:
        del _processes[key]
        raise AssertionError("its process ended without a message, as after a crash of the engine") from None
    if how == _SKIPPED:
        raise SkipTest(text)
    if how == _FAILED:
        raise AssertionError(text)


def _outcome(engine: Any, name: str) -> tuple[str, str]:
    """Outcome of a check and its text; runs in the separate process."""
    try:
        dict(runs(engine))[name]()
    except SkipTest as why:
        return _SKIPPED, str(why)
    except Exception as error:
        return _FAILED, failure_text(error)
    return _PASSED, ""


def _fits(name: str, pattern: str) -> bool:
    return fnmatchcase(name, pattern.replace("[", "[[]"))


def run_check(engine: Any, name: str) -> None:
    """Runs the check of this name alone. Raises ValueError if there is none."""
    for check in checks(engine):
        if check.name == name:
            check()
            return
    raise ValueError(f"{engine.__name__} has no check {name!r}")


def _of_one_process(engine: Any, name: str) -> str:
    """Formulation and preset of a check; empty for a check of the whole engine."""
    keys = (f"{formulation}-{preset}" for formulation, presets in engine.presets.items() for preset in presets)
    return next((key for key in keys if name.partition("[")[2].removesuffix("]").startswith(key)), "")


def runs(engine: Any) -> Iterator[tuple[str, partial[None]]]:
    """Name and callable of every check of an engine."""
    for check in _OF_ENGINES:
        yield check.__name__, partial(check, engine)
    for formulation, presets in engine.presets.items():
        for preset, settings in presets.items():
            # Checks of the adapter come first: their failures may cause those of the motion.
            start = cache(partial(_first, engine, settings))
            for check in _OF_PRESETS:
                yield f"{check.__name__}[{formulation}-{preset}]", partial(_on_first, start, check)
            for own_scenes, of_found in ((scenes(), _OF_SCENES), (truth_scenes(), _OF_TRUTHS)):
                for (name, scene), check in itertools.product(own_scenes.items(), of_found):
                    if not checked_on(engine, formulation, scene):
                        continue  # `provides_for_some_scene` checks that some scene is left
                    subject = Subject(engine, settings, scene)
                    yield f"{check.__name__}[{formulation}-{preset}-{name}]", partial(check, subject)
            for name, (scene, without) in contrasts().items():
                if checked_on(engine, formulation, scene):
                    subject = Subject(engine, settings, scene)
                    yield f"law_acts[{formulation}-{preset}-{name}]", partial(response.law_acts, subject, without)
            for name, alike in alike_scenes().items() if isinstance(engine, RunsBatches) else ():
                if checked_on(engine, formulation, alike[0]):
                    subject = Subject(engine, settings, alike[0])
                    for of_copies in _OF_BATCHES:
                        key = f"{of_copies.__name__}[{formulation}-{preset}-{name}]"
                        yield key, partial(of_copies, subject, alike)


def _first(engine: Any, settings: Any) -> Subject | None:
    """The engine on the most demanding scene that it builds with these settings, or None."""
    for scene in scenes().values():
        if not checked_on(engine, settings.formulation, scene):
            continue
        subject = Subject(engine, settings, scene)
        with suppress(SkipTest):
            subject.build()
            return subject
    return None


def _on_first(start: Callable[[], Subject | None], check: Callable[[Subject], None]) -> None:
    subject = start()
    if subject is None:
        raise SkipTest("every scene is refused")
    check(subject)
