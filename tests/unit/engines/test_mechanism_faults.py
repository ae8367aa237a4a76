"""Mistakes that no run shows are shown by what is read back of the model; settings that do nothing are told."""

import importlib
from dataclasses import replace

import mechanism_examples as examples
import mechanism_runs as runs
import numpy as np
import pytest

from proofroll.core.certificate import certify, first_difference
from proofroll.core.errors import Diverged, Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.loop_points import held_points, is_planar
from proofroll.engines.pinocchio.settings import PROXIMAL
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree
from proofroll.engines.pinocchio.smooth.null_space import LoopRows
from proofroll.engines.projection.smooth.dependent import DependentCoordinates
from proofroll.files.scene_file import load_scene


@pytest.mark.parametrize(
    ("formulation", "module"),
    [("joints", "mujoco.smooth.mechanism_model"), ("constraint_dynamics", "pinocchio.smooth.constraint_dynamics")],
)
def test_one_point_for_a_revolute_loop_in_space_shows_in_the_mobility(formulation, module, monkeypatch):
    """Closed by one point, Bricard's ring has a mobility too many; its violation would never tell."""
    mechanism = runs.model("bricard")
    assert runs.build(formulation, mechanism).built().mobility == 1
    monkeypatch.setattr(importlib.import_module(f"proofroll.engines.{module}"), "held_points", lambda *_: (0.0,))
    run = runs.build(formulation, mechanism)
    assert run.built().mobility > analyse(mechanism).mobility


def test_a_revolute_loop_needs_a_second_point_only_in_space():
    """A planar mechanism is recognised by the axes of its joints; a turn of one axis makes it spatial."""
    planar, spatial = runs.model("slider_crank"), runs.model("bricard")
    assert is_planar(planar)
    assert not is_planar(spatial)
    assert held_points(planar, planar.loops[0]) == (0.0,)
    assert len(held_points(spatial, spatial.loops[0])) == 2
    sliding = replace(planar.loops[0], kind="prismatic", axis_a=(0, 1, 0))
    assert is_planar(replace(planar, loops=(sliding,)))
    assert not is_planar(replace(planar, loops=(replace(planar.loops[0], kind="universal"),)))
    tilted = replace(planar.joints[2], axis=(1, 0, 0.1))
    assert not is_planar(replace(planar, joints=(*planar.joints[:2], tilted)))


def test_a_tree_in_another_order_shows_in_the_mass_matrix():
    """Joints added to Pinocchio in another than depth-first order make crba wrong, and what is read back tells it."""
    mechanism = replace(examples.every_kind(), loops=())
    assert runs.build("null_space", mechanism).built().mass_matrix_error < 1e-12
    names = [joint.name for joint in mechanism.joints]
    # b5 hangs on b1, of which b2, b3 and b4 are another branch: put between them it parts b2 from what it carries
    order = [names.index(name) for name in ("j0", "j1", "j2", "j5", "j6", "j3", "j4", "j7")]
    object.__setattr__(mechanism, "joints", tuple(mechanism.joints[i] for i in order))
    for cached in ("q_slices", "v_slices"):
        mechanism.__dict__.pop(cached, None)
    assert runs.build("null_space", mechanism).built().mass_matrix_error > 1e-2


def flat_parallelogram():
    """Four-bar linkage whose links all lie on one line at the start, a pose where its rank is smaller."""
    rod = {"mass": 1.0, "com": (0.5, 0, 0), "inertia": (0.01, 0.1, 0.1)}
    joints = (
        Joint("a", "revolute", "world", "crank", v0=(1.0,)),
        Joint("b", "revolute", "crank", "coupler", (1, 0, 0), v0=(-1.0,)),
        Joint("c", "revolute", "world", "rocker", (1, 0, 0), v0=(1.0,)),
    )
    loop = Loop("d", "revolute", "coupler", "rocker", (1, 0, 0), (1, 0, 0))
    return Mechanism(tuple(Body(name, **rod) for name in ("crank", "coupler", "rocker")), joints, (loop,))


def test_the_rank_of_a_singular_start_is_that_of_poses_nearby():
    """Both formulations with a fixed rank find it near the start, where all links on one line hide one row."""
    mechanism = flat_parallelogram()
    found = analyse(mechanism)
    assert found.singular_start
    assert LoopRows(JointTree(mechanism)).rank == found.rank
    equations = DependentCoordinates(mechanism)
    assert 6 * len(mechanism.bodies) - equations.rank == found.mobility


@pytest.mark.arithmetic
@pytest.mark.parametrize("formulation", ["constraint_dynamics", "null_space", "joints"])
def test_the_world_may_be_either_end_of_a_loop(formulation):
    """Turning a loop round turns the sign of its wrench and nothing else.

    The ring can stress itself, along (1, 1, 1) at this hinge, which moves nothing: a solver with a term μ in the place
    of a stiffness finds that part of the force to some ε/μ, as the processor rounds.
    """
    mechanism = runs.model("bricard")
    loop = mechanism.loops[0]
    turned = Loop("hinge5", "revolute", "rod4", "world", loop.position_b, loop.position_a, loop.axis_b, loop.axis_a)
    options = {"dt": 1e-3} if formulation == "joints" else {}
    samples = []
    for each in (mechanism, replace(mechanism, loops=(turned,))):
        run = runs.build(formulation, each, **options)
        run.advance(0.05)
        samples.append(run.sample())
    np.testing.assert_allclose(samples[0].p_WB, samples[1].p_WB, atol=1e-11)
    known = 100 * np.finfo(float).eps / PROXIMAL if formulation == "constraint_dynamics" else 1e-12
    one, other = (sample.joint_force[-1] for sample in samples)
    np.testing.assert_allclose(one, -other, rtol=0, atol=known * np.abs(one).max())


def test_elimination_keeps_loops_closed():
    """Without it the violation of a loop grows with time; with it, round-off is left."""
    mechanism = runs.model("slider_crank")
    gaps = {}
    for projection in (True, False):
        run = runs.build("null_space", mechanism, integrator="rk4", dt=5e-3, rtol=None, projection=projection)
        run.advance(0.2)
        q, v = run.motion.x[:3], run.motion.x[3:]
        gaps[projection] = np.abs(LoopRows(run.tree).at(run.tree.model.createData(), q, v).residual).max()
    assert gaps[True] < 1e-12
    assert gaps[False] > 1e-8


@pytest.mark.parametrize("scene", ["bricard", "spatial_slider_crank", "slider_crank"])
def test_rows_without_velocities_are_those_of_the_pose(scene):
    """What elimination reads of loops is what the accelerations read, but for the drifts, which are zero at rest."""
    tree = JointTree(runs.model(scene))
    rows, data, q = LoopRows(tree), tree.model.createData(), tree.q0
    moving, still = rows.at(data, q, tree.v0 + 1.0), rows.at(data, q, None)
    for name in ("residual", "C", "force", "torque"):
        np.testing.assert_array_equal(getattr(moving, name), getattr(still, name))
    assert np.abs(moving.drift).max() > 0.1
    at_rest = rows.at(data, q, 0.0 * tree.v0)
    np.testing.assert_array_equal(still.drift[: len(still.loop)], at_rest.drift[: len(at_rest.loop)])


@pytest.mark.parametrize(("engine", "formulation"), [("projection", "dependent"), ("pinocchio", "null_space")])
def test_a_step_that_is_far_too_long_is_told(engine, formulation):
    """A spinning body that a fixed step cannot follow ends with Diverged, not with a state that is not finite."""
    kind = load_engine(engine)
    run = kind.build(runs.model("heavy_top"), replace(kind.presets[formulation]["default"], dt=0.5))
    with pytest.raises(Diverged):
        run.advance(500.0)


def test_what_only_some_models_need_is_refused_in_words():
    """A universal joint with a spring meets the model that cannot hold it; a fixed body without mass moves with all."""
    bodies = (Body("base", 1.0, inertia=(0.1, 0.1, 0.1)), Body("tip", 0.0))
    joints = (Joint("a", "universal", "world", "base", stiffness=3.0), Joint("b", "fixed", "base", "tip", (1, 0, 0)))
    mechanism = Mechanism(bodies, joints)
    with pytest.raises(Refused, match="two angles of a"):
        runs.build("redundant", Mechanism(bodies[:1], joints[:1]))
    for formulation in ("joints", "null_space", "dependent"):
        assert runs.build(formulation, mechanism).sample().p_WB[1, 0] == pytest.approx(1.0)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("formulation", ["joints", "redundant", "null_space", "dependent"])
def test_a_missing_spring_shows_in_the_first_reactions(formulation):
    """Andrews' spring pulls at a dead centre and accelerates nothing at the start; bearings and loops feel it."""
    scene = load_scene("andrews_squeezer")
    engine, settings = runs.settings(formulation)
    without = replace(runs.model("andrews_squeezer"), springs=())
    found = first_difference(certify(engine.build(without, settings), scene))
    assert found is not None
    assert "forces" in found
