"""Terms of MuJoCo's model that a setting switches on and off."""

from __future__ import annotations

from proofroll.core.engine_abilities import Term
from proofroll.engines.mujoco.settings import ROLLS, SLIDES, TURNS

TERMS = (
    Term(
        "friction against turning (condim 4)",
        ("chart", "free"),
        {"condim": TURNS},
        {"condim": SLIDES},
        "resists the spin about the normal, on which the ball's motion on a curved wall hangs",
        rung=True,
    ),
    Term(
        "friction against turning and rolling (condim 6)",
        ("chart", "free"),
        {"condim": ROLLS},
        {"condim": SLIDES},
        "looks like rolling resistance, but sliding, turning and rolling share one cone",
        rung=True,
    ),
    Term(
        "settled start",
        ("chart", "free"),
        {"start": "settled"},
        {"start": "touching"},
        "starts the soft contact at the depth at which it already bends the path as the wall does",
    ),
    Term(
        "curvature (J̇v)",
        ("free",),
        {"curvature": True},
        {"curvature": False},
        "adds to the contact's rows the turning of the normal, which MuJoCo leaves out",
    ),
    Term(
        "damping of the slip",
        ("free",),
        {"friction_damping": 1.9},
        {"friction_damping": None},
        "lets the creep of the step cancel that of the missing J̇v",
    ),
    Term(
        "correction of the cone",
        ("chart", "free"),
        {"cone_correction": True},
        {"cone_correction": False},
        "takes away the lift that MuJoCo's convex cone gives a slipping ball",
    ),
)
