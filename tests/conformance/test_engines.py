"""Every installed engine, ours and others', conforms to the protocol."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from proofroll.conformance import Check, checks
from proofroll.conformance.subject import contrasts, scenes, truth_scenes
from proofroll.core.errors import Missing
from proofroll.core.plugins import engine_names, load_engine

# Engine -> pattern of checks -> why they are known to fail.
KNOWN: Mapping[str, Mapping[str, str]] = {
    "exudyn": {
        "advance_in_two_parts[discs-default]": "each half begins with a new Jacobian, and Exudyn's own tolerance of "
        "Newton's method leaves 3e-7 of the coin's size",
    },
    "mujoco": {
        "order_is_as_declared[chart-default]": "at 2e-3 s the fourth-order error of the soft contact hides the "
        "second-order one of the resistance torque",
        "moves_as_the_truth[chart-default-fast]": "with MuJoCo's default solimp a tenth of the load is missing, "
        "and the contact gives way",
        "moves_as_the_truth[chart-default-slow]": "as the fast one, by a hundredth of its force",
        "first_steps_fit_the_scene[joints-tuned-slider_crank]": "at a time constant of two steps a loop's force is off "
        "by a thousandth at every step, at ten steps by a hundred-thousandth",
        "moves_as_the_truth[joints-tuned-slider_crank]": "as its first steps",
        "first_steps_fit_the_scene[joints-tuned-spatial_slider_crank]": "as the slider-crank's",
        "moves_as_the_truth[joints-default-double_pendulum-friction]": "with MuJoCo's default solref friction comes up "
        "over 0.02 s at every step, and the presets with hard rows pass",
        "moves_as_the_truth[geoms-default-sled]": "the pyramid brakes more along its edges than across, at every step",
        "moves_as_the_truth[geoms-default-two_spheres]": "an impact takes the part of the speed that MuJoCo's default "
        "impedance leaves it",
        "law_acts[geoms-default-restitution]": "an impact takes the part of the speed that MuJoCo's default impedance "
        "leaves it",
        "moves_as_the_truth[geoms-matched-sled]": "MuJoCo's cone is convex: what slides hops, at every step",
        "order_is_as_declared[geoms-matched]": "as moves_as_the_truth: a hop has no order",
    },
}


# What a formulation builds hangs on no preset: it is asked of one.
OF_BUILDING = ("builds_or_refuses", "builds_only_what_is_required")
# Of what hangs on a formulation's model or adapter, not on its step, and of what is held against truths, one preset is
# asked on every scene: of its certificate in every run of the tests, of its first steps, of how it moves and whether a
# law acts on a third of them, in turns, and at night on all. In the drills each scene is asked of one other preset, in
# turns, too: of how it moves, or of its certificate and its first steps; a twenty-fourth of them before a change lands,
# another by each check, and all else of other presets at night alone. What is known to fail is asked wherever it is.
OF_MODELS = (
    "certificate_holds",
    "first_steps_fit_the_scene",
    "law_acts",
    "samples_cost_the_same",
    "engines_do_not_disturb_each_other",
    "moves_as_the_truth",
    "samples_are_well_formed",
    "reading_back_changes_nothing",
    "advance_is_repeatable",
    "advance_in_two_parts",
    "sampling_changes_nothing",
    "velocities_are_the_rates",
)
# Each preset's order and the effect of its tolerance: of one in every run, of all others at night.
OF_PRESETS = ("order_is_as_declared", "tolerance_has_an_effect")
# Those of a formulation's model that run for long: each is asked of a third of the scenes before a change lands.
OF_RUNS = ("first_steps_fit_the_scene", "moves_as_the_truth", "law_acts")
_SHARE = 3


TURNS = [*scenes(), *truth_scenes()]


def first_marks(engine: Any, check: Check, name: str, formulation: str, scene: str) -> tuple[pytest.MarkDecorator, ...]:
    """The mark of a check of a formulation's first preset; ``scene`` is empty for one without."""
    if name not in OF_RUNS or check.known:
        return ()
    places = [*TURNS, *contrasts()].index(scene), sorted(engine.presets).index(formulation), OF_RUNS.index(name)
    return (pytest.mark.nightly,) if sum(places) % _SHARE else ()


def further_mark(engine: Any, name: str, formulation: str, preset: str, scene: str) -> pytest.MarkDecorator | None:
    """The mark of a check of another preset than the first one; None: it is left to a third preset, or to no one."""
    if name in OF_BUILDING:
        return None
    if name in OF_PRESETS:
        return pytest.mark.nightly
    number = turn = OF_MODELS.index(name)
    nightly = True
    if scene in TURNS:
        turn, odd = divmod(TURNS.index(scene), 2)
        if odd == (name == "moves_as_the_truth"):
            return None
        nightly = (turn + number) % (8 * _SHARE) > 0
    _, *others = _presets(engine, formulation)
    if preset != others[turn % len(others)]:
        return None
    return pytest.mark.nightly if nightly else pytest.mark.drill


def _presets(engine: Any, formulation: str) -> list[str]:
    """The presets of a formulation; first the one of which everything is asked: ``matched``, where there is one."""
    return sorted(engine.presets[formulation], key=lambda preset: preset != "matched")


def marks(engine: Any, check: Check) -> tuple[pytest.MarkDecorator, ...] | None:
    """The mark of a check that repeats another preset's or another scene's; none at all: nobody asks it."""
    name, _, about = check.name.removesuffix("]").partition("[")
    if name not in {*OF_BUILDING, *OF_MODELS, *OF_PRESETS}:
        return ()
    formulation, preset, *scene = about.split("-", 2)
    of_scene = scene[0] if scene else ""
    if preset == _presets(engine, formulation)[0]:
        return first_marks(engine, check, name, formulation, of_scene)
    if check.known:
        return (pytest.mark.drill,)
    mark = further_mark(engine, name, formulation, preset, of_scene)
    return mark and (mark,)


def all_checks() -> list[Any]:
    """The checks of all engines; one that is skipped for each engine that is not installed."""
    found: list[Any] = []
    for name in engine_names():
        try:
            engine = load_engine(name)
        except Missing as reason:
            found.append(pytest.param(None, id=name, marks=pytest.mark.skip(reason=str(reason))))
            continue
        found += [
            pytest.param(check, id=f"{name}-{check.name}", marks=asked)
            for check in checks(engine, KNOWN.get(name))
            if (asked := marks(engine, check)) is not None
        ]
    return found


@pytest.mark.parametrize("check", all_checks())
def test_engine(check: Check) -> None:
    """The engine keeps a promise of the protocol."""
    check()
