"""A setting that is wrong, or would do nothing, is refused by each engine in one line; an engine has a summary."""

from __future__ import annotations

import pytest

from proofroll.core.errors import InputError, Missing
from proofroll.core.plugins import engine_names, load_engine
from proofroll.running.identity import resolve
from proofroll.running.simulation import simulate

# Scene -> engine -> options and pattern of the line.
WRONG = {
    "sphere_in_cylinder": {
        "mujoco": [
            ("dt=0", "dt"),
            ("dt=nan", "dt"),
            ("dt=3e-4", "dt"),  # misses the samples
            ("time_constant=1", "time_constant"),
            ("impedance=1", "impedance"),
            ("impedance=1e-300", "impedance"),
            ("formulation=geoms,preset=tuned,impedance=0.5", "impedance"),
            ("formulation=geoms,preset=tuned,impedance=0.4", "impedance"),
            ("curvature=true", "curvature"),
            ("damping_armature=true", "damping_armature.*chart does not use it here; leave it out"),
            ("formulation=geoms,curvature=true,integrator=RK4", "integrator"),
            ("formulation=geoms,curvature=true,integrator=implicitfast", "integrator"),
            ("formulation=geoms,curvature=true,cone=pyramidal", "cone"),
            ("formulation=geoms,preset=tuned,cone=pyramidal", "cone"),
            ("formulation=geoms,preset=matched,cone_correction=true,integrator=RK4", "integrator"),
            ("formulation=geoms,preset=matched,cone_correction=true,cone=pyramidal", "cone"),
            ("formulation=geoms,condim=6", "condim.*geoms does not use it; leave it out"),
            ("condim=5", "condim.*it must be 3, 4 or 6"),
            ("cone=pyramidal", "friction"),
            ("cone_correction=true", "cone_correction"),
            ("preset=tuned", "preset"),
        ],
        "exudyn": [
            ("dt=0", "dt"),
            ("dt=fast", "dt"),
            ("dt=3e-3", "divides the interval"),
            ("formulation=mesh", "choose one of carrier, rolling_disc"),
            ("formulation=rolling_disc,preset=tuned", "rolling_disc has default, matched"),
            ("spectral_radius=1.5", "spectral_radius"),
            ("integrator=euler", "integrator"),
            ("newton_tolerance=2", "newton_tolerance"),
            ("step=1e-3", "no such setting"),
            ("stiffness=5", "stiffness = 5.*carrier does not use it; set formulation=spheres"),
            ("formulation=carrier,friction_zone=1e-5", "carrier does not use it"),
            ("formulation=rolling_disc,halvings=0", "rolling_disc does not use it"),
            ("spectral_radius=0.9", "trapezoidal rule has no damping; set integrator=generalized_alpha"),
            ("formulation=spheres,stiffness=null", "stiffness"),
            ("formulation=spheres,stiffness=0", "stiffness"),
            ("formulation=spheres,friction_zone=-1", "friction_zone"),
            ("formulation=spheres,halvings=-1", "halvings"),
        ],
        "pinocchio": [
            ("dt=1e-3", "dt.*preset=default"),
            ("preset=default,rtol=1e-8", "rtol.*fixed step"),
            ("preset=default,integrator=dop853", "dt.*set rtol"),
            ("integrator=rk4", "rtol.*preset=default"),
            ("rtol=1e-16", "rtol.*greater than or equal"),
            ("preset=default,dt=0", "dt.*greater than 0"),
            ("preset=default,dt=0.003", "dt.*no whole number of steps"),
            ("formulation=rigid", "formulation.*composite"),
            ("integrator=euler", "integrator.*'rk4'"),
            ("preset=default,integrator=midpoint", "integrator.*only impulses"),
            ("formulation=impulses,projection=true", "projection.*leave it out"),
            ("formulation=impulses,preset=matched,integrator=rk4", "pinocchio: integrator"),
            ("formulation=impulses,solver=newton", "solver.*'admm'"),
            ("formulation=impulses,solver_tolerance=0", "solver_tolerance.*greater than 0"),
            ("solver=pgs", "solver.*formulation=impulses"),
            ("formulation=composite,solver=admm", "solver.*no contact solver; leave it out"),
            ("preset=default,solver_tolerance=1e-6", "solver_tolerance.*leave it out"),
        ],
        "projection": [
            ("dt=1e-4", "projection: dt = 0.0001: dop853 chooses its own steps; set rtol, or add integrator=rk4"),
            ("preset=default,dt=3e-3", "dt"),
            ("preset=default,rtol=1e-9", "rk4 has a fixed step; set dt, or add integrator=dop853"),
            ("rtol=1e-16", "double precision allows no less than 2.22e-14"),
            ("integrator=rk4,dt=0", "projection: dt"),
            ("integrator=euler", "projection: integrator"),
            ("preset=best", "euler has default, matched, tuned"),
        ],
        "reduced": [
            ("formulation=closed_form,rtol=1e-6", "reduced: rtol"),
            ("formulation=closed_form,integrator=dop853", "reduced: integrator"),
            ("rtol=1e-15", "reduced: rtol"),
            ("integrator=taylor,rtol=1e-17", "reduced: rtol"),
        ],
    },
    "pendulum": {
        "mujoco": [("formulation=joints,cone=pyramidal", "mujoco: cone"), ("formulation=joints,condim=6", "condim")],
        "exudyn": [
            ("formulation=tree,integrator=generalized_alpha", "exudyn: integrator"),
            ("formulation=redundant,integrator=rk44", "exudyn: integrator"),
            ("formulation=redundant,stiffness=1e6", "exudyn: stiffness"),
        ],
        "pinocchio": [
            ("formulation=null_space,proximal=1e-8", "pinocchio: proximal"),
            ("formulation=null_space,orientation=true", "pinocchio: orientation"),
            ("formulation=null_space,integrator=semi_implicit_euler", "pinocchio: integrator"),
            ("formulation=constraint_dynamics,solver=pgs", "pinocchio: solver"),
        ],
        "projection": [
            ("formulation=dependent,integrator=taylor", "projection: integrator"),
            ("formulation=dependent,singularity=stop", "projection: singularity"),
            ("dt=1e-3", "projection: dt = '1e-3': dependent does not use it here; leave it out"),
        ],
    },
}


@pytest.mark.parametrize(
    ("scene", "setting", "words"),
    [
        (scene, f"{engine}[{options}]", words)
        for scene, engines in WRONG.items()
        for engine, rows in engines.items()
        for options, words in rows
    ],
)
def test_a_wrong_setting_gives_one_clear_line(scene: str, setting: str, words: str) -> None:
    """The line names the setting and, where there is one, the remedy."""
    with pytest.raises(InputError, match=words) as caught:
        simulate(scene, setting, until=0.01, every=0.01)
    assert "\n" not in str(caught.value)


def test_an_unused_setting_is_refused_before_a_case_is_planned() -> None:
    """What is stored of a run has no setting without effect, so each is refused where settings are resolved."""
    asked = {"mujoco": {"formulation": "joints", "impratio": 2.0}, "projection": {"dt": 1e-3}}
    for engine, options in asked.items():
        with pytest.raises(InputError, match="does not use it here; leave it out"):
            resolve(engine, options)


@pytest.mark.parametrize("name", engine_names())
def test_a_summary_is_one_sentence(name: str) -> None:
    """What is shown of an engine says what it is, in the first line of its docstring."""
    try:
        engine = load_engine(name)
    except Missing as reason:
        pytest.skip(str(reason))
    first, *others = (engine.__doc__ or "").strip().splitlines()
    assert first.endswith(".")
    assert not "".join(others[:1])
