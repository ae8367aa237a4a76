"""Springs of ball joints and free bodies: what a file may say, closed forms in turned axes, and who runs them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from one_body_scenes import one_body, refusal
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.engines.mujoco.smooth.mechanism_model import write
from proofroll.truth.plug_in import MechanismTruth

TIMES = np.linspace(0.0, 2.0, 9)
STIFFNESS, DAMPING, SPIN = 3.0, 0.4, 0.8
TURN = Rotation.from_rotvec([0.5, -0.4, 0.9])
AXIS = np.array([0.6, 0.0, 0.8])


@pytest.mark.parametrize(
    ("kind", "lines", "words"),
    [
        ("spherical", "stiffness = [1, 2]", "joints.j.stiffness = (1.0, 2.0): give 3 numbers"),
        ("spherical", "stiffness = -1", "must be at least 0"),
        ("spherical", "rest = [4, 0, 0]", "a rotation vector is shorter than 3 rad; turn the joint"),
        ("spherical", 'stiffness = "3 N/m"', "this number is in N m/rad, and not in N/m"),
        ("spherical", "stiffness = 3\naxis = [0, 0, 1]", "joints.0.axis"),
        ("free", "stiffness = 3", "joints.j.stiffness = 3.0: give 6 numbers"),
        ("free", "damping = [1, 2, 3]", "joints.j.damping"),
        ("planar", "stiffness = 3", "a planar joint has none"),
    ],
)
def test_a_wrong_spring_of_a_joint_gets_one_line(tmp_path: Path, kind: str, lines: str, words: str) -> None:
    """A wrong law is refused by one line that names the field that the file has."""
    assert words in refusal(tmp_path, kind, lines)


def sprung(folder: Path, kind: str, laws: str, q: Rotation, spin: np.ndarray, place: str = "") -> Mechanism:
    """A round body of 1 kg m² on a joint whose frame is turned."""
    roll, pitch, yaw = TURN.as_euler("xyz").tolist()
    turn = ", ".join(map(str, q.as_quat(scalar_first=True).tolist()))
    speed = ", ".join(map(str, spin.tolist()))
    q0, v0 = (f"[{place}{turn}]", f"[0, 0, 0, {speed}]") if place else (f"[{turn}]", f"[{speed}]")
    return one_body(folder, kind, f"orientation = [{roll}, {pitch}, {yaw}]\nq0 = {q0}\nv0 = {v0}\n{laws}")


@pytest.mark.drill
def test_a_round_body_swings_about_one_axis(tmp_path: Path) -> None:
    """From where its spring is at rest a round body of a ball joint swings about its axis of spin, with decay."""
    rest = Rotation.from_rotvec([0.2, 0.3, -0.1])
    laws = f"stiffness = {STIFFNESS}\ndamping = {DAMPING}\nrest = [0.2, 0.3, -0.1]"
    truth = MechanismTruth.truth(MechanismElement(sprung(tmp_path, "spherical", laws, rest, SPIN * AXIS)), TIMES, ())
    rate = np.sqrt(STIFFNESS - DAMPING**2 / 4)
    angle = SPIN / rate * np.exp(-DAMPING / 2 * TIMES) * np.sin(rate * TIMES)
    turned = Rotation.from_quat(truth["q_WB"].values[:, 0], scalar_first=True)
    expected = TURN * rest * Rotation.from_rotvec(np.outer(angle, AXIS))
    assert (expected.inv() * turned).magnitude().max() < 1e-13
    moment = -(TURN * rest).apply(np.outer(STIFFNESS * angle, AXIS))
    assert np.abs(truth["bushing_torques"].values[:, 0] - moment).max() < 1e-12


@pytest.mark.drill
def test_a_symmetrical_top_on_a_spring_spins_on(tmp_path: Path) -> None:
    """A round body that spins about the axis of its turn keeps its energy, ½ k θ² + ½ I w², and its plane of motion."""
    start = Rotation.from_rotvec(0.7 * AXIS)
    mechanism = sprung(tmp_path, "free", f"stiffness = [2, 2, 2, {STIFFNESS}, {STIFFNESS}, {STIFFNESS}]\n"
                       "rest = [0.1, 0.2, 0.3, 0, 0, 0]", start, SPIN * AXIS, "0.4, 0.2, 0.3, ")  # fmt: skip
    truth = MechanismTruth.truth(MechanismElement(mechanism), TIMES, ())
    rate = np.sqrt(STIFFNESS)
    angle = 0.7 * np.cos(rate * TIMES) + SPIN / rate * np.sin(rate * TIMES)
    turned = Rotation.from_quat(truth["q_WB"].values[:, 0], scalar_first=True)
    assert ((TURN * Rotation.from_rotvec(np.outer(angle, AXIS))).inv() * turned).magnitude().max() < 1e-13
    frame = TURN.as_matrix()
    away = truth["p_WB"].values[:, 0] - frame @ [0.1, 0.2, 0.3]
    # the joint's place is along the axes of the world, its rest along those of the child there
    assert np.abs(away - np.cos(np.sqrt(2) * TIMES)[:, None] * away[0]).max() < 1e-12
    energy = truth["energy"].values
    assert np.abs(energy - energy[0]).max() < 1e-12


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "engine",
    [
        "mujoco[formulation=joints,integrator=RK4,dt=1e-3]",
        "exudyn[formulation=redundant,dt=1e-3]",
        "pinocchio[formulation=null_space]",
        pytest.param("projection[formulation=dependent]", marks=pytest.mark.drill),
    ],
)
@pytest.mark.parametrize("rest", ["", "\nrest = [0.2, 0.3, -0.1]"])
def test_engines_agree_on_a_spring_of_a_ball_joint(tmp_path: Path, engine: str, rest: str) -> None:
    """A body with three moments turns on an elastic ball joint as the truth says, wherever its spring is at rest."""
    laws = f"stiffness = {STIFFNESS}\ndamping = {DAMPING}{rest}"
    mechanism = sprung(tmp_path, "spherical", laws, Rotation.from_rotvec([0.4, 0.1, 0.9]), np.array([0.3, 0.6, -0.5]))
    scene = Scene("sprung", "", (MechanismElement(mechanism),))
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.2, every=0.1), scene)
    assert found.agrees, str(found)


def test_a_ball_joint_of_mujoco_has_its_spring_itself(tmp_path: Path) -> None:
    """A spring that is the same in all directions and at rest at q = 0 is the stiffness of MuJoCo's own joint."""
    still = Rotation.identity()
    own = sprung(tmp_path, "spherical", f"stiffness = {STIFFNESS}", still, np.zeros(3))
    applied = sprung(tmp_path, "spherical", f"stiffness = [{STIFFNESS}, 1, 1]", still, np.zeros(3))
    settings = load_engine("mujoco").presets["joints"]["matched"]
    stiffness = [np.max(write(each, settings).compile().jnt_stiffness) for each in (own, applied)]
    assert stiffness == [STIFFNESS, 0.0]
    assert mujoco.mjtJoint.mjJNT_BALL in write(own, settings).compile().jnt_type
