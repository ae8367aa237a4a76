"""The engine keeps every promise of the protocol, but for what its friction and its defaults are known to do."""

import pytest
from proofroll_rapier.engine import Rapier

from proofroll.conformance import checks

FEET = "where three feet slide, friction is some degrees off the slip"
DAMPED = "by default every coordinate of a multibody is damped by 0.1 N m s/rad"
STEP = "1/60 s is long for this motion"
INSTANT = "no whole number of steps of 1/60 s ends at the instants of the targets"
THROWN = "in a step of 1/60 s the rebound begins from a speed with the step's own fall"
KNOWN = {
    "moves_as_the_truth[*-sled]": FEET,
    "moves_as_the_truth[multibody-default-slider_crank]": STEP,
    "moves_as_the_truth[multibody-default-heavy_top]": STEP,
    "moves_as_the_truth[*-default-oscillators]": STEP,
    "moves_as_the_truth[multibody-default-slow_top]": DAMPED,
    "moves_as_the_truth[multibody-default-double_pendulum]": DAMPED,
    "moves_as_the_truth[multibody-default-double_pendulum-torque]": DAMPED,
    "moves_as_the_truth[multibody-default-double_pendulum-limit]": DAMPED,
    "moves_as_the_truth[multibody-default-double_pendulum-target]": DAMPED,
    "moves_as_the_truth[*-default-two_spheres]": STEP,
    "law_acts[*-default-held_targets]": INSTANT,
    "law_acts[*-default-restitution]": THROWN,
}


@pytest.mark.parametrize("check", checks(Rapier, KNOWN), ids=lambda check: check.name)
def test_engine(check):
    check()
