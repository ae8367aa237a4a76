"""Actuators of an MJCF in a robot's scene, against MuJoCo's own reading of the file."""

import numpy as np
import pytest
from robot_templates import mjcf

from proofroll import simulate
from proofroll.core.errors import Refused
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.files.scene_file import load_scene

mujoco = pytest.importorskip("mujoco")

DEFAULTS = (
    '<default><position kp="7" kv="0.5"/><default class="weak"><position forcerange="-0.1 0.1"/></default></default>'
)
ACTUATORS = {
    "motor": '<motor name="m" joint="k1" gear="3"/>',
    "position": '<position name="m" joint="k1" kp="20" kv="2" gear="-3"/>',
    "position of a class": '<position name="m" joint="k2"/>',
    "limited by its class": '<position name="m" joint="k2" class="weak" gear="2"/>',
    "limited, but not": '<position name="m" joint="k2" class="weak" forcelimited="false"/>',
    "velocity": '<velocity name="m" joint="k2" kv="4" gear="2"/>',
    "general": '<general name="m" joint="k2" gainprm="30" biastype="affine" biasprm="0 -30 -2"/>',
    "control in a range": '<position name="m" joint="k2" ctrlrange="0.3 1"/>',
    "two": '<position name="m" joint="k1" kp="20" kv="0"/><velocity name="v" joint="k1" kv="3"/>',
    "general, by the default of positions": '<general name="m" joint="k2"/>',
    "motor, by the limit of positions": '<motor name="m" joint="k2" class="weak" ctrlrange="0.5 1"/>',
    "effort of the joint": '<position name="m" joint="k1" kp="2000"/>',
}


@pytest.mark.parametrize("keyframe", [0, 1])
@pytest.mark.parametrize("actuators", ACTUATORS.values(), ids=ACTUATORS)
def test_efforts_are_those_of_the_file(tmp_path, actuators, keyframe):
    """Each actuator has the effort that MuJoCo gives it in the pose of release, at zero and at a keyframe's control."""
    text = mjcf(actuator=actuators, joint='actuatorfrcrange="-50 50"').replace("<worldbody>", DEFAULTS + "<worldbody>")
    controls = " ".join(["0.7", "0"][: actuators.count("joint=")])
    text = text.replace("</mujoco>", f'<keyframe><key ctrl="{controls}"/></keyframe></mujoco>')
    path = tmp_path / "arm.xml"
    path.write_text(text)
    made = load_scene(str(path), actuators=1, keyframe=keyframe).elements[0].mechanism
    q, v = made.start()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    data.ctrl[:] = keyframe * model.key_ctrl[0]
    mujoco.mj_forward(model, data)
    found = np.zeros(2)
    for actuator, effort in zip(made.actuators, JointCoordinates(made).efforts(0.0, q, v), strict=True):
        found[made.joint_index[actuator.joint]] += effort
    assert found == pytest.approx(data.qfrc_actuator, rel=1e-12, abs=1e-15)
    assert made.actuators
    assert load_scene(str(path)).elements[0].mechanism.actuators == ()


@pytest.mark.drill
def test_an_arm_of_a_file_moves_under_its_servos(tmp_path):
    """A robot whose servos act has a truth, which MuJoCo's run of the scene agrees with."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(actuator='<position name="m" joint="k1" kp="20" kv="2" forcerange="-5 5"/>'))
    scene = load_scene(str(path), actuators=1)
    true = truth(scene, np.array([0.0, 0.2, 0.4]))
    run = simulate(scene, "mujoco", until=0.4, every=0.2)
    assert float(np.abs(run["positions"] - true["positions"]).max()) < 1e-5
    assert float(np.abs(run["effort.m"] - true["effort.m"]).max()) < 1e-3


@pytest.mark.parametrize(
    "actuator",
    [
        '<general name="m" joint="k1" dyntype="integrator"/>',
        '<position name="m" joint="k1" dampratio="1"/>',
        '<motor name="m" joint="k1" forcerange="-1 2"/>',
        '<motor name="m" site="s"/>',
        '<position name="n" joint="k1"/><position name="m" joint="k1"/>',
    ],
)
def test_an_actuator_that_no_scene_has_is_named(tmp_path, actuator):
    """Activation, damping ratios, limits of one side, sites, two servos: one line names the actuator."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf(actuator=actuator, base='<site name="s"/>'))
    with pytest.raises(Refused, match=r"the actuator \w+ m \(actuators=0 leaves all out\)"):
        truth(load_scene(str(path), actuators=1), np.array([0.0, 0.1]))
