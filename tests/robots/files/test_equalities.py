"""Equality constraints of an MJCF are loops and couplings of its scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.truth.smooth.smooth_truth import find_truth

TIMES = np.array([0.0, 0.1, 0.2])
BAR = (
    '<body name="{name}" pos="{at}" euler="{turn}"><joint name="h_{name}" axis="0 1 0"/>'
    '<inertial pos="{middle}" mass="{mass}" diaginertia="0.1 0.2 0.3"/>'
)
FOUR_BAR = (
    "<mujoco><compiler angle='radian'/><worldbody>"
    + BAR.format(name="crank", at="0 0 0", turn="0 0 0", middle="0.5 0 0", mass=1)
    + BAR.format(name="coupler", at="1 0 0", turn="0 0.3 0", middle="1 0 0", mass=2)
    + BAR.format(name="rocker", at="2 0 0", turn="0 -0.2 0", middle="0 0 -1", mass=2)
    + "</body></body></body></worldbody><equality>{held}</equality></mujoco>"
)
DIFFERENTIAL = (
    "<mujoco><worldbody>"
    + "".join(
        BAR.format(name=name, at=at, turn="0 0 0", middle="0.1 0 0.2", mass=mass) + "</body>"
        for name, at, mass in (("m1", "0 0 0", 1), ("m2", "0 1 0", 2), ("out", "0 2 0", 3))
    )
    + "</worldbody><tendon>"
    '<fixed name="in"><joint joint="h_m1" coef="0.5"/><joint joint="h_m2" coef="0.5"/></fixed>'
    '<fixed name="out"><joint joint="h_out" coef="2"/></fixed></tendon>'
    '<equality><tendon tendon1="in" tendon2="out" polycoef="0 1 0 0 0"/></equality></mujoco>'
)


def written(folder: Path, text: str) -> Path:
    """The text as a file."""
    path = folder / "robot.xml"
    path.write_text(text)
    return path


def held_apart(path: Path, mechanism: Any, q: np.ndarray) -> float:
    """Largest residual of MuJoCo's own equality rows at a pose of the scene."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for joint, at in zip(mechanism.joints, mechanism.q_slices, strict=True):
        data.joint(joint.name).qpos[:] = q[at]
    mujoco.mj_forward(model, data)
    assert data.ne
    return float(np.abs(data.efc_pos[: data.ne]).max())


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    "text",
    [
        FOUR_BAR.format(held='<connect body1="rocker" anchor="0 0 -2"/>'),
        FOUR_BAR.format(held='<connect body1="crank" body2="rocker" anchor="0.4 0 -0.5"/>'),
        FOUR_BAR.format(held='<joint joint1="h_coupler" joint2="h_crank" polycoef="0 2 0 0 0"/>'),
        DIFFERENTIAL,
    ],
    ids=["connect to the world", "connect of two bodies", "joint", "tendons"],
)
def test_the_truth_keeps_what_mujoco_holds(tmp_path: Path, text: str) -> None:
    """Poses of the truth meet the equality constraints of the file as MuJoCo itself evaluates them."""
    path = written(tmp_path, text)
    scene = load_scene(path)
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # of a mechanism
    truth = find_truth(mechanism, TIMES)
    assert np.ptp(truth.record.q, axis=0).max() > 1e-3, "it moves"
    for q in truth.record.q:
        assert held_apart(path, mechanism, q) < 1e-9
    run = simulate(scene, "mujoco[formulation=joints]", until=0.2, every=0.1)
    assert np.abs(run.p_WB.to_numpy() - truth.record.p_WB).max() < 1e-4


@pytest.mark.parametrize("flag", ["equality", "constraint"])
def test_constraints_that_the_file_switches_off_do_not_act(tmp_path: Path, flag: str) -> None:
    """With a flag of the file that disables them, joints that an equality would couple and loops move freely."""
    held = '<joint joint1="h_coupler" joint2="h_crank" polycoef="0 1 0 0 0"/><connect body1="rocker" anchor="0 0 -2"/>'
    off = f'<option><flag {flag}="disable"/></option><equality>'
    scene = load_scene(written(tmp_path, FOUR_BAR.format(held=held).replace("<equality>", off)))
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # of a mechanism
    assert (mechanism.loops, mechanism.couplings) == ((), ())


def test_a_weld_is_a_fixed_loop(tmp_path: Path) -> None:
    """A weld with a given pose holds place and orientation of two bodies as MuJoCo evaluates them."""
    weld = '<weld body1="crank" body2="rocker" relpose="0 0 0 0 0 0 0" anchor="0.1 0 0.2"/>'
    path = written(tmp_path, FOUR_BAR.format(held=weld))
    scene = load_scene(path)
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # of a mechanism
    (loop,) = mechanism.loops
    assert loop.kind == "fixed"
    assert held_apart(path, mechanism, mechanism.start()[0]) < 1e-9


def test_what_is_not_represented_is_named(tmp_path: Path) -> None:
    """A quartic relation of joints is named as not represented, and nothing is said of an engine."""
    quartic = '<joint joint1="h_coupler" joint2="h_crank" polycoef="0 2 0.5 0 0"/>'
    scene = load_scene(written(tmp_path, FOUR_BAR.format(held=quartic)))
    with pytest.raises(Refused, match=r"the equality constraint joint joint0 \(couplings=0 leaves it out\)"):
        simulate(scene, "mujoco[formulation=joints]", until=0.1)


BOX = """<mujoco><worldbody>
<site name="w1" pos=".5 .5 5"/><site name="w2" pos=".5 -.5 5"/><site name="w3" pos="-.5 0 5"/>
<body name="box" pos="0 0 2"><freejoint name="root"/><geom type="box" mass="5" size=".5 .5 .5"/>
<site name="a1" pos=".5 .5 .5"/><site name="a2" pos=".5 -.5 .5"/><site name="a3" pos="-.5 0 .5"/></body></worldbody>
<default><tendon limited="true" range="0 2.5"/></default><tendon>
<spatial name="root"><site site="w1"/><site site="a1"/></spatial>
<spatial name="t2"><site site="w2"/><site site="a2"/></spatial>
<spatial name="t3"><site site="w3"/><site site="a3"/></spatial></tendon></mujoco>"""
RANGES = DIFFERENTIAL.replace('<fixed name="in">', '<fixed name="in" limited="true" range="-0.1 0.1">').partition(
    "<eq"
)[0]


@pytest.mark.drill
def test_a_limited_tendon_between_two_sites_is_a_cable(tmp_path: Path) -> None:
    """A box that hangs on three limited tendons starts as in its file and stays, in MuJoCo too; none falls freely."""
    scene = load_scene(str(written(tmp_path, BOX)))
    assert [pair.name for pair in scene.elements[0].mechanism.pairs] == ["root_cord", "t2", "t3"]  # type: ignore[attr-defined]
    true = find(scene)
    run = simulate(scene, "mujoco[formulation=geoms]", until=0.1, every=0.1)
    for pulled, share in (("root_cord", 0.25), ("t2", 0.25), ("t3", 0.5)):
        weight = share * 5 * 9.81
        assert float(true[f"force.{pulled}.z"][-1]) == pytest.approx(weight, rel=1e-12)
        assert float(run[f"force.{pulled}.z"][-1]) == pytest.approx(weight, rel=1e-3)  # softness at rest
    assert np.abs(run.p_WB.to_numpy() - [0, 0, 2]).max() < 1e-6


def find(scene: Any) -> Any:
    """Truth of a scene to 0.1 s."""
    from proofroll.core.truth import truth

    return truth(scene, np.array([0.0, 0.1]))


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (RANGES + "</mujoco>", "the range of the tendon fixed in"),
        (BOX.replace('range="0 2.5"', 'range="1 2.5"'), "the range of the tendon spatial root"),
    ],
    ids=["of joints", "least length"],
)
def test_other_limits_of_tendons_are_refused_by_name(tmp_path: Path, text: str, named: str) -> None:
    """Limits that no scene has are named where they are asked for, and where couplings=0 leaves them out."""
    path = str(written(tmp_path, text))
    with pytest.raises(Refused, match=rf"{named} \(couplings=0 leaves it out\)"):
        find(load_scene(path))
    assert any("(couplings=1)" in clause for clause in load_scene(path, couplings=0).omitted)
