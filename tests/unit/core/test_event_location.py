import numpy as np
import pytest

from proofroll.core.dop853 import controlled_step, solver_from
from proofroll.core.event_location import first_rise, locate_rise, locate_rise_within, stays_negative


def functions(times):
    """A crest of height 1e-3 within the step, one just below zero, and a function far below."""
    crest = 1 - 40 * (times - 0.37) ** 2
    return np.stack([crest - 0.999, crest - 1.001, np.cos(3 * times) - 2], axis=1)


def test_a_rise_within_a_step_is_never_taken_for_none():
    """A function that rises and falls within a step is not called negative; one far below zero is."""
    crest, _, far = stays_negative(functions, 0.0, 1.0)
    assert not crest
    assert far
    assert first_rise(lambda t: functions(t)[:, 0], 0.0, 1.0) == pytest.approx(0.37 - 0.005)
    assert first_rise(lambda t: functions(t)[:, 1], 0.0, 1.0) is None


@pytest.mark.one_in(4)
@pytest.mark.parametrize("frequency", np.linspace(0.1, 12, 60))
def test_an_oscillation_is_left_to_more_points(frequency):
    """An oscillation of up to two periods a step, many times what an integrator resolves, is never called negative."""
    for phase in np.linspace(0, 6, 25):
        times = np.linspace(0, 1, 1001)
        rises = (np.sin(frequency * times + phase) > 0.5).any()
        stays = stays_negative(lambda t, at=phase: np.sin(frequency * t + at)[:, None] - 0.5, 0.0, 1.0)
        assert not (rises and stays)


@pytest.mark.arithmetic
@pytest.mark.parametrize(("level", "rises"), [(0.0, 0.0), (0.16, 0.2)])
def test_a_rise_is_known_to_a_bracket_that_is_not_empty(level: float, rises: float) -> None:
    """Where a parabola of time passes a level lies in a bracket of some width."""
    solver = solver_from(lambda t, _: np.array([1.0 - 2.0 * t]), 0.0, np.zeros(1), 1e-13, 1e-13, 1.0)
    controlled_step(solver, None, 1.0)
    rise = locate_rise(solver, lambda y: np.array([y[0] - level]))
    assert rise is not None
    assert rise.width > 0
    assert abs(rise.time - rises) <= 4 * max(rise.width, float(np.spacing(0.5)))


@pytest.mark.parametrize("shift", [-1e-17, 0.0, 1e-17])
def test_a_rise_at_the_start_of_a_step_is_in_it(shift: float) -> None:
    """A function that is zero at the start but for round-off, and rises, has its rise there, whatever its sign."""
    for slope in (1.0, 0.3, 7.0):
        assert first_rise(lambda t, a=slope: a * t * (1 - t) + shift, 0.0, 0.7) == pytest.approx(0.0, abs=1e-15)


def test_a_crest_after_a_rise_in_the_same_step_is_no_graze() -> None:
    """What another guard would have reached after the first one rose does not happen; before it, it does."""
    start = np.array([0.0, 1.0])
    solver = solver_from(lambda _, y: np.array([1.0, 0.0 * y[1]]), 0.0, start, 1e-13, 1e-13)
    solver.h_abs = 1.0
    controlled_step(solver, None, 1.0)
    assert (solver.t_old, solver.t) == (0.0, 1.0)
    for hit, seen in ((0.4, 0), (0.8, 1)):
        grazes: list[float] = []
        rise = locate_rise(
            solver, lambda y, hit=hit: np.array([y[0] - hit, -((y[0] - 0.6) ** 2)]), near=1e-9, grazes=grazes
        )
        assert rise is not None
        assert rise.time == pytest.approx(hit, abs=1e-12)
        assert len(grazes) == seen


@pytest.mark.parametrize("above", [1e-12, 1e-6])
def test_a_narrow_crest_between_the_points_is_found(above: float) -> None:
    """A guard that rises above zero by little between two of its points, far below zero at others, has risen."""
    for crest in np.linspace(0.11, 0.93, 40):
        rise = locate_rise_within(lambda t, crest=crest: (above - (t - crest) ** 2 * (1 + t))[:, None], 0.0, 1.0)
        assert rise is not None
        assert rise[0] == pytest.approx(crest - np.sqrt(above / (1 + crest)), abs=1e-6)
    grazes: list[float] = []
    below = locate_rise_within(lambda t: (-above - (t - 0.5) ** 2)[:, None], 0.0, 1.0, near=2 * above, grazes=grazes)
    assert below is None
    assert grazes == pytest.approx([0.5], abs=1e-6)


def test_no_rise_is_seen_in_a_guard_that_its_points_do_not_resolve() -> None:
    """A guard that leaves zero with a cube, and is no polynomial in a long step, does not rise there."""

    def guards(times):
        return (1 - np.sqrt(1 + times**6 / (1 + times**2)))[:, None]

    assert locate_rise_within(guards, 0.0, 10.0, 1e-14, leaving=True) is None
    unresolved = locate_rise_within(guards, 0.0, 10.0, 1e-14, leaving=True, halvings=0)
    assert unresolved is not None
